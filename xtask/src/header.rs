//! The C header, generated from the boundary's `repr(C)` types, `WIS_` constants and `wis_` functions.

use cbindgen::{
    Builder, Config, DocumentationStyle, EnumConfig, ExportConfig, FunctionConfig, Language, Layout, RenameRule, Style,
};
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

const HEADER: &str = "include/wis.h";

/// Where the items of the C API are declared, in the order in which the header lists constants and functions. The
/// modules of a `mod.rs` are followed.
const SOURCES: [&str; 16] = [
    "src/ffi/mod.rs",
    "src/direct/ray.rs",
    "src/query.rs",
    "src/table.rs",
    "src/descent.rs",
    "src/prior.rs",
    "src/pool.rs",
    "src/strata.rs",
    "src/tripling.rs",
    "src/triple.rs",
    "src/grid.rs",
    "src/sparse.rs",
    "src/combine.rs",
    "src/rotated.rs",
    "src/visibility.rs",
    "src/status.rs",
];

/// The top of the header: what a caller must know that no single declaration can say.
const INTRODUCTION: &str = include_str!("introduction.h");

/// Writes `include/wis.h`.
pub fn write(root: &Path) -> Result<()> {
    Ok(fs::write(root.join(HEADER), generate(root)?)?)
}

/// Fails if `include/wis.h` is not, to the byte, what [`write()`] would write.
pub fn check(root: &Path) -> Result<()> {
    let committed = fs::read(root.join(HEADER))?;
    if committed == generate(root)?.into_bytes() {
        return Ok(());
    }
    Err(format!("{HEADER} is out of date: run `cargo run -p xtask -- header` and commit the result").into())
}

fn generate(root: &Path) -> Result<String> {
    let mut builder = Builder::new().with_config(config(&declarations(root)?));
    for source in SOURCES {
        builder = builder.with_src(root.join(source));
    }
    let mut text = Vec::new();
    builder.generate()?.write(&mut text);
    // cbindgen qualifies an enumerator with the name of its type; the statuses are known as WIS_OK, not WIS_STATUS_OK.
    let text = String::from_utf8(text)?.replace("WIS_STATUS_", "WIS_");
    let text = array_parameters(&without_safety_sections(&text));
    reject_rust_syntax(&text)?;
    Ok(text)
}

fn config(declarations: &str) -> Config {
    let types = declarations.lines().filter_map(declared_type);
    let internal = declarations.lines().filter_map(declared_constant).filter(|name| !name.starts_with("WIS_"));
    Config {
        language: Language::C,
        header: Some(INTRODUCTION.trim_end().into()),
        include_guard: Some("WIS_H".into()),
        no_includes: true,
        sys_includes: vec!["stddef.h".into(), "stdint.h".into()],
        cpp_compat: true,
        usize_is_size_t: true,
        style: Style::Both,
        documentation_style: DocumentationStyle::Cxx,
        line_length: 120,
        export: ExportConfig {
            rename: types.map(|name| (name.into(), c_name(name))).collect(),
            exclude: internal.map(String::from).collect(),
            ..ExportConfig::default()
        },
        enumeration: EnumConfig { rename_variants: RenameRule::QualifiedScreamingSnakeCase, ..EnumConfig::default() },
        function: FunctionConfig { args: Layout::Auto, ..FunctionConfig::default() },
        ..Config::default()
    }
}

/// The text of all sources.
fn declarations(root: &Path) -> Result<String> {
    let mut text = String::new();
    for file in source_files(root)? {
        text += &fs::read_to_string(file)?;
    }
    Ok(text)
}

/// Every Rust file of a source and of the modules below it, whose folders are followed.
fn source_files(root: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for source in SOURCES {
        let source = root.join(source);
        if !source.ends_with("mod.rs") {
            files.push(source);
            continue;
        }
        let mut folders = vec![source.with_file_name("")];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder)? {
                let path = entry?.path();
                if path.is_dir() { folders.push(path) } else { files.push(path) }
            }
        }
    }
    files.retain(|file| file.extension().is_some_and(|extension| extension == "rs"));
    Ok(files)
}

/// The name in a line such as `pub struct Name {`.
fn declared_type(line: &str) -> Option<&str> {
    let item = line.trim_start().strip_prefix("pub ")?;
    let rest = ["struct ", "enum ", "union ", "type "].iter().find_map(|keyword| item.strip_prefix(keyword))?;
    identifier(rest)
}

/// The name in a line such as `pub const NAME: u32 = 1;`.
fn declared_constant(line: &str) -> Option<&str> {
    identifier(line.trim_start().strip_prefix("pub const ")?)
}

fn identifier(text: &str) -> Option<&str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').next()
}

/// Types whose name in C is not that in Rust: systems of the wavelet header share words with the renderer's.
const NAMES: [(&str, &str); 19] = [
    ("DirectWave", "wis_wave"),
    ("SamplerObject", "wis_sampler"),
    ("MaterialData", "wis_material"),
    ("LobeData", "wis_lobe"),
    ("PointData", "wis_point"),
    ("EnvironmentObject", "wis_environment"),
    ("LightConfig", "wis_environment_config"),
    ("LightInfo", "wis_environment_info"),
    ("Environment", "wis_wavelet_light"),
    ("EnvironmentConfig", "wis_wavelet_light_config"),
    ("EnvironmentInfo", "wis_wavelet_light_info"),
    ("Product", "wis_wavelet_product"),
    ("ProductConfig", "wis_wavelet_product_config"),
    ("ProductInfo", "wis_wavelet_product_info"),
    ("Query", "wis_wavelet_query"),
    ("Lobe", "wis_wavelet_lobe"),
    ("Sample", "wis_drawn"),
    ("CallbackBrdf", "wis_wavelet_callback"),
    ("Table", "wis_wavelet_table"),
];

/// `TreeConfig` becomes `wis_tree_config`.
fn c_name(rust: &str) -> String {
    if let Some((_, name)) = NAMES.iter().find(|(name, _)| *name == rust) {
        return (*name).into();
    }
    let mut name = String::from("wis");
    for letter in rust.chars() {
        if letter.is_uppercase() {
            name.push('_');
        }
        name.extend(letter.to_lowercase());
    }
    name
}

/// Writes a pointer to an array, `float (*u)[2]`, as C programmers do: `float u[2]`. The call is the same.
fn array_parameters(text: &str) -> String {
    let mut pieces = text.split("(*");
    let mut rewritten = String::from(pieces.next().unwrap_or_default());
    for piece in pieces {
        match piece.split_once(')') {
            Some((name, rest)) if rest.starts_with('[') => rewritten.extend([name, rest]),
            _ => rewritten.extend(["(*", piece]),
        }
    }
    rewritten
}

/// Drops what a comment says to Rust programmers behind `# Safety`: the introduction says it to C programmers once.
fn without_safety_sections(text: &str) -> String {
    let mut kept: Vec<&str> = Vec::new();
    let mut skipping = false;
    for line in text.lines() {
        let comment = line.trim_start();
        if comment.starts_with("/// # Safety") {
            skipping = true;
            while kept.last().is_some_and(|line| line.trim() == "///") {
                kept.pop();
            }
        }
        skipping &= comment.starts_with("///");
        if !skipping {
            kept.push(line);
        }
    }
    kept.join("\n") + "\n"
}

/// The header is read by C programmers: links and paths of rustdoc must not leak into it.
fn reject_rust_syntax(text: &str) -> Result<()> {
    match text.lines().find(|line| line.contains("::") || line.contains("[`")) {
        Some(line) => Err(format!("Rust syntax in a comment of the C boundary: {}", line.trim()).into()),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_get_prefixed_snake_case_names() {
        assert_eq!(declared_type("pub struct ProductConfig {"), Some("ProductConfig"));
        assert_eq!(declared_type("pub type RowFn = Option<fn()>;"), Some("RowFn"));
        assert_eq!(declared_type("pub fn size() {"), None);
        assert_eq!(c_name("ProductConfig"), "wis_wavelet_product_config");
    }

    #[test]
    fn constants_are_found_at_any_depth() {
        assert_eq!(declared_constant("    pub const DEFAULT: u32 = 0;"), Some("DEFAULT"));
    }

    #[test]
    fn pointers_to_arrays_become_array_parameters() {
        assert_eq!(array_parameters("f(const float (*u)[2], float (*m)[9]);"), "f(const float u[2], float m[9]);");
        assert_eq!(array_parameters("typedef int (*f)(void);"), "typedef int (*f)(void);");
    }

    #[test]
    fn safety_sections_end_with_their_comment() {
        let text = "/// Does it.\n///\n/// # Safety\n/// Be careful.\nvoid f(void);\n/// Next.\n";
        assert_eq!(without_safety_sections(text), "/// Does it.\nvoid f(void);\n/// Next.\n");
    }

    #[test]
    fn rust_syntax_is_rejected() {
        assert!(reject_rust_syntax("/// See [`Status`].").is_err());
        assert!(reject_rust_syntax("/// See wis_status.").is_ok());
    }
}
