//! A file of `src/` imports only what stands before it in the order that `src/lib.rs` states, and is unsafe in two folders and one file alone.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Nothing imports these but themselves and the boundary: a renderer's library is built without them.
const FEATURES: [&str; 2] = ["lights", "wavelets"];
const BOUNDARY: &str = "ffi";
/// Where `unsafe` may stand, in types of functions, too, which no lint sees.
const UNSAFE: [&str; 3] = [BOUNDARY, "simd", "blob"];

/// Modules that import each other, each with the reason why they stay so. A group that is no longer needed fails the test.
const KNOWN_CYCLES: &[(&[&str], &str)] = &[
    (&["ffi::material", "ffi::visibility"], "a point names its cache, and the cache's calls take points"),
    (&["light::check", "light::environment"], "an environment is opened by checking it, and checked as an environment"),
    (&["light::tables", "light::walk"], "the walk is the tables' own: `impl Light` in a second file"),
];

/// The path of a module below the crate: `light::warp`; the crate itself is empty.
type Module = String;

/// Sources by module.
type Sources = BTreeMap<Module, String>;

/// The module of a path below `src/`.
fn module_of(path: &str) -> Module {
    let path = path.trim_end_matches(".rs").trim_end_matches("/mod");
    if path == "lib" || path == "main" { String::new() } else { path.replace('/', "::") }
}

/// The source without comments and strings.
fn code_of(source: &str) -> String {
    let mut code = String::new();
    let mut rest = source;
    while let Some(first) = rest.chars().next() {
        let skipped = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if first == '"' {
            let mut escaped = false;
            let end = rest[1..].find(|c| {
                let ends = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                ends
            });
            end.map_or(rest.len(), |end| end + 2)
        } else if rest.starts_with("'\"'") {
            3
        } else {
            code.push(first);
            first.len_utf8()
        };
        rest = &rest[skipped..];
    }
    code
}

/// Identifiers, `::`, and other signs one by one.
fn tokens_of(code: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut rest = code.trim_start();
    while let Some(first) = rest.chars().next() {
        let is_name = |c: char| c.is_alphanumeric() || c == '_';
        let end = if is_name(first) {
            rest.find(|c| !is_name(c)).unwrap_or(rest.len())
        } else if rest.starts_with("::") {
            2
        } else {
            first.len_utf8()
        };
        tokens.push(&rest[..end]);
        rest = rest[end..].trim_start();
    }
    tokens
}

/// Reads what follows `prefix` at `at`: the rest of a path, or a group of paths. Answers where it ends.
fn read_paths(tokens: &[&str], mut at: usize, prefix: &[String], paths: &mut Vec<Vec<String>>) -> usize {
    let mut path = prefix.to_vec();
    while tokens.get(at) == Some(&"::") {
        match tokens.get(at + 1) {
            Some(&"{") => {
                at += 2;
                while let Some(&token) = tokens.get(at) {
                    match token {
                        "}" => return at + 1,
                        "," => at += 1,
                        "self" => {
                            paths.push(path.clone());
                            at += 1;
                        }
                        name => {
                            let inner: Vec<String> = path.iter().cloned().chain([name.to_string()]).collect();
                            at = read_paths(tokens, at + 1, &inner, paths);
                        }
                    }
                }
                return at;
            }
            Some(name) if name.starts_with(|c: char| c.is_alphabetic() || c == '_') => {
                path.push((*name).to_string());
                at += 2;
            }
            _ => break,
        }
    }
    paths.push(path);
    at
}

/// The modules that a module names, the longest prefix of each path that is one. Its parts are not among them where they are
/// only handed on (`pub use`): who imports what was handed on imports the part, through its parent.
fn imports_of(module: &str, source: &str, sources: &Sources) -> BTreeSet<Module> {
    let code = code_of(source);
    let tokens = tokens_of(&code);
    let own: Vec<String> = module.split("::").filter(|name| !name.is_empty()).map(String::from).collect();
    let child = |name: &str| [own.clone(), vec![name.to_string()]].concat().join("::");
    let (mut paths, mut at, mut handed_on) = (Vec::new(), 0, false);
    while let Some(&token) = tokens.get(at) {
        let begins = at == 0 || tokens[at - 1] != "::";
        if token == "use" {
            handed_on = at > 0 && matches!(tokens[at - 1], "pub" | ")");
        } else if token == ";" {
            handed_on = false;
        }
        let prefix = match token {
            _ if !begins || tokens.get(at + 1) != Some(&"::") => None,
            "crate" => Some(Vec::new()),
            "self" => Some(own.clone()),
            "super" => {
                let mut prefix = own.clone();
                prefix.pop();
                while tokens.get(at + 1) == Some(&"::") && tokens.get(at + 2) == Some(&"super") {
                    prefix.pop();
                    at += 2;
                }
                Some(prefix)
            }
            name if sources.contains_key(&child(name)) => Some([own.clone(), vec![name.to_string()]].concat()),
            _ => None,
        };
        let Some(prefix) = prefix else {
            at += 1;
            continue;
        };
        let first = paths.len();
        at = read_paths(&tokens, at + 1, &prefix, &mut paths);
        if handed_on {
            let hands_on = |path: &Vec<String>| path.len() > own.len() && path.starts_with(&own);
            let rest: Vec<Vec<String>> = paths.drain(first..).filter(|path| !hands_on(path)).collect();
            paths.extend(rest);
        }
    }
    let longest = |path: Vec<String>| {
        (0..=path.len()).rev().map(|n| path[..n].join("::")).find(|prefix| sources.contains_key(prefix))
    };
    paths.into_iter().filter_map(longest).filter(|import| import != module && !import.is_empty()).collect()
}

fn imports(sources: &Sources) -> BTreeMap<Module, BTreeSet<Module>> {
    sources.iter().map(|(module, source)| (module.clone(), imports_of(module, source, sources))).collect()
}

/// The first name of a module's path.
fn top(module: &str) -> &str {
    module.split("::").next().unwrap_or(module)
}

/// The order that the head of `src/lib.rs` states: the names between backticks behind "Order of folders:".
fn order_of(lib: &str) -> Vec<String> {
    let head: Vec<&str> = lib.lines().filter_map(|line| line.strip_prefix("//")).collect();
    let head = head.join(" ");
    let Some((_, list)) = head.split_once("Order of folders:") else { return Vec::new() };
    let list = list.split('.').next().unwrap_or("");
    list.split('`').skip(1).step_by(2).map(String::from).collect()
}

/// What is wrong with the imports, a sentence each.
fn faults(sources: &Sources, order: &[String], known: &[(&[&str], &str)]) -> Vec<String> {
    let imports = imports(sources);
    let mut faults = Vec::new();
    let place = |name: &str| order.iter().position(|listed| listed == name);
    for module in sources.keys().filter(|module| !module.is_empty()) {
        if place(top(module)).is_none() {
            faults.push(format!("{module} is not in the order of src/lib.rs"));
        }
    }
    for (module, imported) in imports.iter().flat_map(|(module, all)| all.iter().map(move |other| (module, other))) {
        let (from, to) = (top(module), top(imported));
        if from == to || module.is_empty() {
            continue;
        }
        if place(from) < place(to) {
            faults.push(format!("{module} imports {imported}, which stands behind it"));
        } else if FEATURES.contains(&to) && from != BOUNDARY {
            faults.push(format!("{module} imports {imported}, a feature of its own"));
        }
    }
    for (module, source) in sources.iter().filter(|(module, _)| !module.is_empty() && !UNSAFE.contains(&top(module))) {
        if tokens_of(&code_of(source)).contains(&"unsafe") {
            faults.push(format!("{module} is unsafe"));
        }
    }
    faults.extend(circles(sources, known));
    faults
}

/// Groups of two and more modules of which each leads to each other.
fn cycles(imports: &BTreeMap<Module, BTreeSet<Module>>) -> Vec<BTreeSet<Module>> {
    let reached = |from: &str| {
        let (mut reached, mut open) = (BTreeSet::new(), vec![from.to_string()]);
        while let Some(module) = open.pop() {
            for next in imports.get(&module).into_iter().flatten() {
                if reached.insert(next.clone()) {
                    open.push(next.clone());
                }
            }
        }
        reached
    };
    let reach: BTreeMap<&str, BTreeSet<Module>> = imports.keys().map(|m| (m.as_str(), reached(m))).collect();
    let mut cycles: Vec<BTreeSet<Module>> = Vec::new();
    for (module, reached) in &reach {
        if !reached.contains(*module) || cycles.iter().any(|cycle| cycle.contains(*module)) {
            continue;
        }
        let both = |other: &&Module| reach.get(other.as_str()).is_some_and(|back| back.contains(*module));
        cycles.push(reached.iter().filter(both).cloned().collect());
    }
    cycles
}

fn collect(folder: &Path, root: &Path, sources: &mut Sources) {
    for entry in fs::read_dir(folder).expect("src can be read") {
        let path = entry.expect("src can be read").path();
        if path.is_dir() {
            collect(&path, root, sources);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let name = path.strip_prefix(root).expect("below src").to_string_lossy().replace('\\', "/");
            sources.insert(module_of(&name), fs::read_to_string(&path).expect("a source can be read"));
        }
    }
}

#[test]
fn files_import_only_what_stands_before_them() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut sources = Sources::new();
    collect(&root, &root, &mut sources);
    let order = order_of(&sources[""]);
    assert!(order.len() > 10, "the order of src/lib.rs was not found");
    let faults = faults(&sources, &order, KNOWN_CYCLES);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Circles of a crate, each with its imports.
fn circles(sources: &Sources, known: &[(&[&str], &str)]) -> Vec<String> {
    let imports = imports(sources);
    let cycles = cycles(&imports);
    let named: Vec<BTreeSet<Module>> =
        known.iter().map(|(modules, _)| modules.iter().map(|module| (*module).to_string()).collect()).collect();
    let mut faults = Vec::new();
    for cycle in cycles.iter().filter(|cycle| !named.contains(cycle)) {
        let edges = cycle.iter().map(|module| {
            let all: Vec<&str> = imports[module].iter().filter(|m| cycle.contains(*m)).map(String::as_str).collect();
            format!("{module} -> {}", all.join(", "))
        });
        faults.push(format!("modules import each other: {}", edges.collect::<Vec<_>>().join("; ")));
    }
    let gone = named.iter().filter(|known| !cycles.contains(known));
    faults.extend(gone.map(|known| format!("no longer a cycle, strike it off the known ones: {known:?}")));
    faults
}

/// The instruments' library and each of their programs, of which none may have a circle.
#[test]
fn instruments_have_no_circles() {
    let library = Path::new(env!("CARGO_MANIFEST_DIR")).join("ffi-tests/src");
    let mut crates = vec![library.clone()];
    for entry in fs::read_dir(library.join("bin")).expect("programs") {
        crates.push(entry.expect("a program").path());
    }
    let mut files = 0;
    for root in crates.into_iter().filter(|path| path.is_dir()) {
        let mut sources = Sources::new();
        collect(&root, &root, &mut sources);
        sources.retain(|module, _| top(module) != "bin");
        // What tests inside a file import by `super` is that file.
        for source in sources.values_mut() {
            source.truncate(source.find("#[cfg(test)]\nmod tests").unwrap_or(source.len()));
        }
        files += sources.len();
        let faults = circles(&sources, &[]);
        assert!(faults.is_empty(), "{}: {}", root.display(), faults.join("\n"));
    }
    assert!(files > 90, "only {files} files were found");
}

/// A made-up crate of three folders; `extra` is one more file.
fn made_up(extra: (&str, &str)) -> (Sources, Vec<String>) {
    let files = [
        ("lib.rs", "// Order of folders: `low`, `high`, `lights`, `ffi`.\npub mod low;"),
        ("low/mod.rs", "pub mod parts;\npub use parts::Part;"),
        ("low/parts.rs", "// crate::high in a comment is no import.\nconst A: &str = \"crate::high\";"),
        ("high/mod.rs", "use crate::low::{Part, parts::{self, Other}};"),
        ("lights/mod.rs", "use crate::high;"),
        ("ffi/mod.rs", "use crate::{high, lights};"),
        extra,
    ];
    let sources: Sources = files.into_iter().map(|(path, source)| (module_of(path), source.to_string())).collect();
    let order = order_of(&sources[""]);
    (sources, order)
}

fn faults_with(path: &str, source: &str) -> String {
    let (sources, order) = made_up((path, source));
    faults(&sources, &order, &[]).join("\n")
}

#[test]
fn imports_are_found_in_every_form() {
    let (sources, order) = made_up(("low/more.rs", ""));
    assert_eq!(order, ["low", "high", "lights", "ffi"]);
    let of = |module: &str| imports_of(module, &sources[module], &sources).into_iter().collect::<Vec<_>>();
    assert_eq!(of("high"), ["low", "low::parts"]);
    assert_eq!(of("ffi"), ["high", "lights"]);
    assert!(of("low").is_empty() && of("low::parts").is_empty());
    assert_eq!(faults(&sources, &order, &[]), [""; 0]);
}

#[test]
fn an_upward_import_is_a_fault() {
    for source in [
        "use crate::high::Thing;",
        "use crate::{\n    high::Thing,\n};",
        "fn f() -> crate::high::Thing { loop {} }",
        "use super::super::high::Thing;",
    ] {
        assert_eq!(faults_with("low/more.rs", source), "low::more imports high, which stands behind it", "{source}");
    }
}

#[test]
fn unsafe_code_has_its_places() {
    for (path, fault) in [("low/more.rs", "low::more is unsafe"), ("ffi/more.rs", "")] {
        assert_eq!(faults_with(path, "pub type RowFn = Option<unsafe extern \"C\" fn(u32)>;"), fault);
        assert_eq!(faults_with(path, "/// Not unsafe.\nfn f() {}"), "");
    }
}

#[test]
fn only_the_boundary_imports_features() {
    let (sources, mut order) = made_up(("late.rs", "use crate::lights::Strata;"));
    order.insert(3, "late".into());
    assert_eq!(faults(&sources, &order, &[]), ["late imports lights, a feature of its own"]);
}

#[test]
fn a_cycle_is_a_fault_unless_it_is_known() {
    let source = ("low/more.rs", "use super::parts::Part;");
    let (mut sources, order) = made_up(source);
    assert_eq!(faults(&sources, &order, &[]), [""; 0]);
    sources.insert("low::parts".into(), "use super::more;".into());
    let found = faults(&sources, &order, &[]).join("\n");
    assert_eq!(found, "modules import each other: low::more -> low::parts; low::parts -> low::more");
    let known: (&[&str], &str) = (&["low::more", "low::parts"], "an example");
    assert_eq!(faults(&sources, &order, &[known]), [""; 0]);
    let (sources, order) = made_up(source);
    assert!(faults(&sources, &order, &[known])[0].starts_with("no longer a cycle"));
}

#[test]
fn a_folder_that_is_not_in_the_order_is_a_fault() {
    assert_eq!(faults_with("odd.rs", ""), "odd is not in the order of src/lib.rs");
}
