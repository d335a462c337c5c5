//! The C headers, generated from the boundary's `repr(C)` types, `WIS_` constants and `wis_` functions.

use cbindgen::{
    Builder, Config, DocumentationStyle, EnumConfig, ExportConfig, FunctionConfig, Language, Layout, RenameRule, Style,
};
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// A header: what it is called, where its items are declared, and its top, which says what no single declaration can.
struct Header {
    file: &'static str,
    /// In the order of use: the header lists constants, types and functions source by source. A source may be several files,
    /// between spaces: a boundary, and the safe module whose types it hands out.
    sources: &'static [&'static str],
    /// Groups of the reference: the number of the first source, a name, a title and what it is for.
    groups: &'static [(usize, &'static str, &'static str, &'static str)],
    introduction: &'static str,
}

/// All but the first include the first, and nothing else.
const HEADERS: [Header; 3] = [
    Header {
        file: "wis.h",
        sources: &[
            "src/status.rs",
            "src/ffi/mod.rs",
            "src/ffi/light/config.rs src/ffi/light.rs",
            "src/ffi/sampler.rs",
            "src/brdf/portal.rs src/ffi/material.rs",
            "src/direct/ray.rs",
            "src/ffi/direct.rs",
            "src/light/compare.rs src/brdf/compare.rs src/ffi/check.rs",
            "src/ffi/light/shared.rs",
            "src/ffi/visibility.rs",
            "src/ffi/wave.rs",
            "src/ffi/product.rs src/product/info.rs",
            "src/sample.rs",
            "src/ffi/sampling.rs",
            "src/ffi/points.rs",
        ],
        groups: &[
            (
                0,
                "answers",
                "Answers, memory, version",
                "What calls answer, where a fault lies, and which library is linked.",
            ),
            (2, "light", "The light", "An environment, built once for a map and read by any number of threads."),
            (3, "sampler", "A sampler for each thread", "What a thread keeps from hit to hit."),
            (
                4,
                "material",
                "Materials, portals, points",
                "What a hit tells: lobes near your BSDF, normal, wo, and windows that light comes through.",
            ),
            (5, "direct", "Direct light", "The rays to trace at a hit, and their weights."),
            (
                7,
                "check",
                "Checks while you integrate",
                "Your radiance beside the built light, your BSDF beside the lobes.",
            ),
            (
                8,
                "shared",
                "Builds that threads share, lights that turn",
                "One build by several threads, and an environment that turns without being built again.",
            ),
            (
                9,
                "visibility",
                "Visibility of earlier passes",
                "What rays of earlier passes met, for cells of the scene that you choose.",
            ),
            (10, "wave", "Waves", "Many hits in one call."),
            (
                11,
                "product",
                "Products and densities",
                "Samples and densities, for renderers that combine them with their own (MIS).",
            ),
            (14, "points", "Random numbers", "Low-discrepancy points in the square."),
        ],
        introduction: include_str!("wis.h"),
    },
    Header {
        file: "wis_lights.h",
        sources: &["src/lights/strata.rs", "src/ffi/lights.rs"],
        groups: &[(
            0,
            "lights",
            "Directional lights",
            "Structured importance sampling (Agarwal and others, 2003): a map as directional lights.",
        )],
        introduction: include_str!("wis_lights.h"),
    },
    Header {
        file: "wis_wavelets.h",
        sources: &[
            "src/wavelets/triple.rs",
            "src/wavelets/combine.rs",
            "src/ffi/wavelets/tree.rs src/wavelets/stored.rs",
            "src/wavelets/table.rs",
            "src/ffi/wavelets/table.rs",
            "src/ffi/wavelets/triple.rs",
            "src/wavelets/visibility.rs",
            "src/ffi/wavelets/visibility.rs",
        ],
        groups: &[(
            0,
            "wavelets",
            "Wavelets",
            "Wavelet importance sampling (Clarberg and others, 2005) and triple products (Ng and others, 2004).",
        )],
        introduction: include_str!("wis_wavelets.h"),
    },
];

/// The module whose folders hold the boundary; cbindgen follows it.
const BOUNDARY: &str = "src/ffi/mod.rs";

/// Writes the headers into `include/`.
pub fn write(root: &Path) -> Result<()> {
    for (header, text) in HEADERS.iter().zip(generate(root)?) {
        fs::write(root.join("include").join(header.file), text)?;
    }
    Ok(())
}

/// Fails if a header in `include/` is not, to the byte, what [`write()`] would write.
pub fn check(root: &Path) -> Result<()> {
    for (header, text) in HEADERS.iter().zip(generate(root)?) {
        let file = header.file;
        if fs::read(root.join("include").join(file))? != text.into_bytes() {
            let advice = "run `cargo run -p xtask -- header` and commit the result";
            return Err(format!("include/{file} is out of date: {advice}").into());
        }
    }
    Ok(())
}

/// The files that declare what is in the headers.
fn source_paths() -> impl Iterator<Item = &'static str> {
    HEADERS.iter().flat_map(|header| header.sources).flat_map(|source| source.split(' '))
}

/// The text of each header.
fn generate(root: &Path) -> Result<Vec<String>> {
    let mut builder = Builder::new().with_config(config(&declarations(root)?));
    for source in source_paths().filter(|source| *source == BOUNDARY || !source.starts_with("src/ffi/")) {
        builder = builder.with_src(root.join(source));
    }
    let mut text = Vec::new();
    builder.generate()?.write(&mut text);
    // cbindgen qualifies an enumerator with the name of its type; the statuses are known as WIS_OK, not WIS_STATUS_OK.
    let text = String::from_utf8(text)?.replace("WIS_STATUS_", "WIS_");
    let text = array_parameters(&without_safety_sections(&text));
    reject_rust_syntax(&text)?;
    arrange(root, &items(&text)?)
}

/// A declaration with its comment.
#[derive(Debug, PartialEq)]
struct Item<'a> {
    kind: Kind,
    name: &'a str,
    text: &'a str,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Constant,
    Type,
    Function,
}

/// The items of what cbindgen wrote: they stand apart by empty lines.
fn items(text: &str) -> Result<Vec<Item<'_>>> {
    let mut items = Vec::new();
    for text in text.split("\n\n").map(str::trim).filter(|piece| !piece.is_empty()) {
        let code = text.lines().find(|line| !line.trim_start().starts_with("///")).unwrap_or_default();
        if !code.starts_with("#define ") && code.starts_with('#') {
            // What surrounds the items: conditions and includes.
            continue;
        }
        let (kind, name) = named(code).ok_or(format!("a declaration without name: {code}"))?;
        items.push(Item { kind, name, text });
    }
    // A type that nothing names is not the boundary's.
    let is_used = |item: &Item| {
        let elsewhere = items.iter().filter(|other| other.name != item.name);
        item.kind != Kind::Type || elsewhere.into_iter().any(|other| words(other.text).any(|word| word == item.name))
    };
    let used: Vec<bool> = items.iter().map(is_used).collect();
    Ok(items.into_iter().zip(used).filter(|(_, used)| *used).map(|(item, _)| item).collect())
}

/// The kind and the name of the declaration that begins with a line.
fn named(code: &str) -> Option<(Kind, &str)> {
    if let Some(rest) = code.strip_prefix("#define ") {
        return Some((Kind::Constant, identifier(rest)?));
    }
    if let Some(rest) = code.strip_prefix("typedef ") {
        let tagged = ["struct ", "enum ", "union "].iter().find_map(|tag| rest.strip_prefix(tag));
        let name = match rest.split_once("(*") {
            Some((_, pointer)) => identifier(pointer)?,
            None => identifier(tagged?)?,
        };
        return Some((Kind::Type, name));
    }
    Some((Kind::Function, words(code.split_once('(')?.0).last()?))
}

/// Sorts the items into the headers: source by source, constants before types before functions.
fn arrange(root: &Path, items: &[Item]) -> Result<Vec<String>> {
    let mut places = Vec::new();
    for (number, header) in HEADERS.iter().enumerate() {
        for (order, source) in header.sources.iter().enumerate() {
            let files: Vec<String> =
                source.split(' ').map(|file| fs::read_to_string(root.join(file))).collect::<std::io::Result<_>>()?;
            places.extend(files.iter().flat_map(|file| file.lines()).enumerate().filter_map(|(line, text)| {
                let name = declared_type(text).map(c_name);
                let name =
                    name.or_else(|| declared_constant(text).or_else(|| declared_function(text)).map(String::from));
                name.map(|name| (name, (number, order, line)))
            }));
        }
    }
    let mut sorted = Vec::new();
    for (position, item) in items.iter().enumerate() {
        let place = places.iter().find(|(name, _)| name == item.name);
        let (_, (header, order, line)) =
            place.ok_or(format!("{} is declared in no source of a header: add its file to HEADERS", item.name))?;
        // cbindgen brings types into an order in which they can be declared.
        let line = if item.kind == Kind::Type { position } else { *line };
        sorted.push(((*header, *order, item.kind, line), item));
    }
    sorted.sort_by_key(|(key, _)| *key);
    let in_header = |number: usize| sorted.iter().filter(move |((header, ..), _)| *header == number);
    let of = |number: usize| in_header(number).map(|(_, item)| *item);
    let mut headers = Vec::new();
    for (number, header) in HEADERS.iter().enumerate() {
        for item in of(number) {
            let others = (1..HEADERS.len()).filter(|other| *other != number).flat_map(of);
            let named: Vec<&str> = others.map(|other| other.name).collect();
            if let Some(foreign) = words(item.text).find(|word| named.contains(word)) {
                return Err(format!("{}: {} names {foreign} of another header", header.file, item.name).into());
            }
        }
        headers.push(header.assemble(in_header(number).map(|((_, order, ..), item)| (*order, *item))));
    }
    Ok(headers)
}

impl Header {
    /// The header of items, each with the number of its source.
    fn assemble<'a>(&self, items: impl Iterator<Item = (usize, &'a Item<'a>)>) -> String {
        let guard = self.file.to_uppercase().replace('.', "_");
        let includes =
            if self.file == "wis.h" { "#include <stddef.h>\n#include <stdint.h>" } else { "#include \"wis.h\"" };
        let mut text =
            format!("{}\n\n#ifndef {guard}\n#define {guard}\n\n{includes}\n\n", self.introduction.trim_end());
        text += "#ifdef __cplusplus\nextern \"C\" {\n#endif\n";
        let (mut after_short, mut groups, mut is_open) = (false, self.groups.iter().peekable(), false);
        for (order, item) in items {
            while let Some((_, name, title, brief)) = groups.next_if(|(first, ..)| *first <= order) {
                text += &format!(
                    "{}\n/** @defgroup {name} {title}\n *  {brief} */ /** @{{ */\n",
                    if is_open { "/** @} */\n" } else { "" }
                );
                (is_open, after_short) = (true, false);
            }
            let item_text = compact(item);
            // Constants of a line each stand close together.
            let is_short = item.kind == Kind::Constant && !item_text.contains('\n');
            if !(is_short && after_short) {
                text.push('\n');
            }
            after_short = is_short;
            text += &item_text;
            text.push('\n');
        }
        text += if is_open { "/** @} */\n\n" } else { "\n" };
        text + &format!("#ifdef __cplusplus\n}}\n#endif\n\n#endif /* {guard} */\n")
    }
}

/// The most characters of a line.
const WIDTH: usize = 140;

/// An item in few lines: comments of one line stand behind what they are about, others are filled, and so are parameters.
fn compact(item: &Item) -> String {
    let mut lines: Vec<String> = Vec::new();
    let mut comment: Vec<&str> = Vec::new();
    let mut code = item.text.lines();
    while let Some(line) = code.next() {
        let indent = &line[..line.len() - line.trim_start().len()];
        if let Some(text) = line.trim_start().strip_prefix("///") {
            comment.push(text.trim_end());
            continue;
        }
        let mut line = line.to_owned();
        if item.kind == Kind::Function {
            let rest: Vec<&str> = code.by_ref().map(str::trim).collect();
            line = [line, rest.join(" ")].join(" ");
        }
        let line = line.trim_end();
        let about = filled(&comment, indent);
        let beside = match &about[..] {
            // Nothing that opens a list of fields, and no function.
            [only] if line.ends_with([';', ',']) && item.kind == Kind::Type || item.kind == Kind::Constant => {
                format!("{line} /**< {} */", only.trim_start().trim_start_matches("/// "))
            }
            _ => String::new(),
        };
        if !beside.is_empty() && beside.len() <= WIDTH && !beside.contains("*//") {
            lines.push(beside);
        } else {
            lines.extend(about);
            lines.extend(wrapped(line));
        }
        comment.clear();
    }
    lines.join("\n")
}

/// A comment whose paragraphs fill lines. What is a list or indented stays as it is.
fn filled(comment: &[&str], indent: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let mut is_open = false;
    for text in comment {
        let is_prose = !text.trim().is_empty() && !text.starts_with("  ") && !text.starts_with(" - ");
        let mut words = text.split_whitespace();
        if !is_prose {
            lines.push(format!("{indent}///{text}"));
            is_open = text.starts_with(" - ");
            continue;
        }
        if !is_open {
            lines.push(format!("{indent}/// {}", words.next().unwrap_or_default()));
        }
        is_open = true;
        for word in words {
            let last = lines.last_mut().expect("an open paragraph");
            if last.len() + 1 + word.len() <= WIDTH {
                last.push(' ');
                last.push_str(word);
            } else {
                lines.push(format!("{indent}/// {word}"));
            }
        }
    }
    lines
}

/// A declaration whose parameters fill lines.
fn wrapped(code: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for part in code.split_inclusive(", ") {
        let last = lines.last_mut().expect("a line");
        if last.is_empty() || last.len() + part.trim_end().len() <= WIDTH {
            last.push_str(part);
        } else {
            *last = last.trim_end().into();
            lines.push(format!("    {part}"));
        }
    }
    lines
}

/// The words of a text: identifiers and numbers.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty())
}

fn config(declarations: &str) -> Config {
    let types = declarations.lines().filter_map(declared_type);
    let internal = declarations.lines().filter_map(declared_constant).filter(|name| !name.starts_with("WIS_"));
    Config {
        language: Language::C,
        no_includes: true,
        usize_is_size_t: true,
        style: Style::Both,
        documentation_style: DocumentationStyle::Cxx,
        line_length: 120,
        export: ExportConfig {
            rename: types.map(|name| (name.into(), c_name(name))).collect(),
            exclude: internal.map(String::from).collect(),
            // Fields hold their numbers.
            include: vec!["Cause".into(), "Mistake".into()],
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

/// Every Rust file of a source and, of the boundary, all modules below it.
fn source_files(root: &Path) -> Result<Vec<PathBuf>> {
    let mut files: Vec<PathBuf> = source_paths().map(|source| root.join(source)).collect();
    let mut folders = vec![root.join(BOUNDARY).with_file_name("")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            if path.is_dir() { folders.push(path) } else { files.push(path) }
        }
    }
    files.retain(|file| file.extension().is_some_and(|extension| extension == "rs"));
    files.sort();
    files.dedup();
    Ok(files)
}

/// The name in a line such as `pub struct Name {`.
fn declared_type(line: &str) -> Option<&str> {
    let item = line.trim_start().strip_prefix("pub ")?;
    let rest = ["struct ", "enum ", "union ", "type "].iter().find_map(|keyword| item.strip_prefix(keyword))?;
    identifier(rest)
}

/// The name in a line such as `pub unsafe extern "C" fn name(`.
fn declared_function(line: &str) -> Option<&str> {
    identifier(line.trim_start().split_once("extern \"C\" fn ")?.1)
}

/// The name in a line such as `pub const NAME: u32 = 1;`.
fn declared_constant(line: &str) -> Option<&str> {
    identifier(line.trim_start().strip_prefix("pub const ")?)
}

fn identifier(text: &str) -> Option<&str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').next()
}

/// Types whose name in C is not that in Rust: systems of the wavelet header share words with the renderer's.
const NAMES: [(&str, &str); 13] = [
    ("VisibilityCacheObject", "wis_visibility_cache"),
    ("DirectWave", "wis_wave"),
    ("SamplerObject", "wis_sampler"),
    ("MaterialData", "wis_material"),
    ("LobeData", "wis_lobe"),
    ("PointData", "wis_point"),
    ("EnvironmentObject", "wis_environment"),
    ("LightConfig", "wis_environment_config"),
    ("LightInfo", "wis_environment_info"),
    ("ProductObject", "wis_product"),
    ("GridConfig", "wis_product_config"),
    ("GridInfo", "wis_product_info"),
    ("Sample", "wis_drawn"),
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
        assert_eq!(c_name("TreeConfig"), "wis_tree_config");
    }

    #[test]
    fn items_are_written_in_few_lines() {
        let of = |kind, text| compact(&Item { kind, name: "", text });
        let field = "typedef struct wis_a {\n  /// Bytes.\n  uint32_t size;\n  /// One.\n  ///\n  /// Two.\n  float b;\n} wis_a;";
        let short = "typedef struct wis_a {\n  uint32_t size; /**< Bytes. */\n  /// One.\n  ///\n  /// Two.\n  float b;\n} wis_a;";
        assert_eq!(of(Kind::Type, field), short);
        assert_eq!(of(Kind::Constant, "/// One.\n#define WIS_ONE 1"), "#define WIS_ONE 1 /**< One. */");
        let function = "/// Calls it.\nenum wis_status wis_f(float a,\n                      float b);";
        assert_eq!(of(Kind::Function, function), "/// Calls it.\nenum wis_status wis_f(float a, float b);");
        assert_eq!(filled(&[" a", " b", "", " - c"], ""), ["/// a b", "///", "/// - c"]);
        let long = format!("f({}z)", "abcdefg, ".repeat(20));
        assert!(wrapped(&long).len() == 2 && wrapped(&long).iter().all(|line| line.len() <= WIDTH));
    }

    #[test]
    fn items_have_kinds_and_names() {
        let text = "#include <stdint.h>\n\n/// One.\n#define WIS_ONE 1\n\ntypedef struct wis_a wis_a;\n\n\
                    /// A row.\ntypedef const void *(*wis_row_fn)(void *user);\n\nenum wis_status wis_f(struct wis_a *a,\n wis_row_fn row);\n\n\
                    typedef struct wis_unused wis_unused;\n\n#endif /* WIS_H */\n";
        let found = items(text).unwrap();
        let found: Vec<_> = found.iter().map(|item| (item.kind, item.name)).collect();
        let (constant, function) = ((Kind::Constant, "WIS_ONE"), (Kind::Function, "wis_f"));
        assert_eq!(found, [constant, (Kind::Type, "wis_a"), (Kind::Type, "wis_row_fn"), function]);
    }

    #[test]
    fn functions_are_found() {
        assert_eq!(declared_function("pub unsafe extern \"C\" fn wis_f("), Some("wis_f"));
        assert_eq!(declared_function("unsafe fn f()"), None);
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
    fn headers_are_those_of_the_sources() {
        let root = std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it");
        check(&Path::new(&root).join("..")).unwrap();
    }

    #[test]
    fn rust_syntax_is_rejected() {
        assert!(reject_rust_syntax("/// See [`Status`].").is_err());
        assert!(reject_rust_syntax("/// See wis_status.").is_ok());
    }
}
