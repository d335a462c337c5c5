//! What comments and pages cite exists.

use std::fs;
use std::path::{Path, PathBuf};

/// The repository's root.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_path_buf()
}

pub fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// All files with one of the extensions below a folder.
pub fn files(folder: &Path, extensions: &[&str], found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of the repository") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files(&path, extensions, found);
        } else if path.extension().is_some_and(|e| extensions.iter().any(|extension| e == *extension)) {
            found.push(path);
        }
    }
}

/// The numbers of rules that a text cites: "rule 13", "rules 12 and 13", "rules 12 to 14".
fn cited(text: &str) -> Vec<u32> {
    let words: Vec<&str> = text.split_whitespace().filter(|word| !word.starts_with("//") && *word != "*").collect();
    let number = |word: &str| {
        let digits: String = word.chars().skip_while(|c| *c == '(').take_while(char::is_ascii_digit).collect();
        digits.parse::<u32>().ok()
    };
    let mut cited = Vec::new();
    for (i, word) in words.iter().enumerate() {
        if matches!(word.trim_start_matches('('), "rule" | "rules") {
            let joined = |word: &&&str| number(word).is_some() || matches!(**word, "and" | "to" | "or");
            cited.extend(words[i + 1..].iter().take_while(joined).filter_map(|word| number(word)));
        }
    }
    cited
}

#[test]
fn cited_rules_stand_in_the_design() {
    let design = read("docs/design.md");
    let mut sources = Vec::new();
    for folder in ["src", "tests", "ffi-tests/src", "benches", "xtask/src", "c-examples", "include"] {
        files(&root().join(folder), &["rs", "c", "h", "hpp", "cpp"], &mut sources);
    }
    let mut missing = Vec::new();
    let mut found = 0;
    for path in sources {
        let text = fs::read_to_string(&path).expect("a source");
        for rule in cited(&text) {
            found += 1;
            if !design.contains(&format!("\n**{rule}. ")) {
                missing.push(format!("{}: rule {rule}", path.display()));
            }
        }
    }
    assert!(found >= 10, "{found} citations were found");
    assert!(missing.is_empty(), "not in docs/design.md:\n{}", missing.join("\n"));
}

#[test]
fn citations_are_found_in_every_form() {
    assert_eq!(cited("as the (rule 13 of the design) says, or\n//! (rules 12 and\n//! 14)"), [13, 12, 14]);
    assert_eq!(cited("rule of thumb, the rule 5: no"), [5]);
}

/// Functions of wis.h that wis.hpp does not call yet; a name that ends in `_` stands for all that begin with it.
const NOT_WRAPPED: [&str; 0] = [];

#[test]
fn the_wrapper_covers_the_header() {
    let called = |text: &str| -> Vec<String> {
        let code: Vec<&str> = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
        let code = code.join("\n");
        let names = code.split(|c: char| !(c.is_alphanumeric() || matches!(c, '_' | '(')));
        let names = names.flat_map(|word| word.split_inclusive('('));
        names
            .filter_map(|word| word.strip_suffix('('))
            .filter(|name| name.starts_with("wis_"))
            .map(String::from)
            .collect()
    };
    let header = read("include/wis.h");
    let functions = called(header.split_once("#ifndef WIS_H").expect("a guard").1);
    let wrapper = called(&read("include/wis.hpp"));
    assert!(functions.len() >= 30, "{functions:?}");
    let allowed =
        |name: &str| NOT_WRAPPED.iter().any(|not| name == *not || (not.ends_with('_') && name.starts_with(not)));
    let missing: Vec<&String> = functions.iter().filter(|name| !wrapper.contains(name) && !allowed(name)).collect();
    assert!(missing.is_empty(), "not in wis.hpp: {missing:?}");
}

/// The most lines and words of the README, and the most lines of its loop with its set-up.
const README: (usize, usize) = (100, 900);
const LOOP: usize = 22;

#[test]
fn the_readme_is_short() {
    let readme = read("README.md");
    let (lines, words) = (readme.lines().count(), readme.split_whitespace().count());
    assert!(lines <= README.0 && words <= README.1, "{lines} lines, {words} words");
}

#[test]
fn the_loop_of_the_readme_is_that_of_the_examples() {
    let (readme, minimal, direct) = (read("README.md"), read("c-examples/minimal.c"), read("c-examples/direct.h"));
    let (_, code) = readme.split_once("```c\n").expect("a block of C in the README");
    let (calls, whole) =
        code.split_once("```").and_then(|(code, _)| code.split_once("\n\n")).expect("calls and the loop");
    let indented: String = calls.lines().map(|line| format!("    {line}\n")).collect();
    assert!(minimal.contains(&format!("\n{indented}")), "c-examples/minimal.c has other lines");
    assert!(calls.contains("direct_light("), "the call is missing");
    let begin = direct.find("static wis_status direct_light(").expect("the loop");
    assert_eq!(direct[begin..].split_inclusive("\n}\n").next(), Some(whole), "c-examples/direct.h has other lines");
    let lines = calls.lines().count() + whole.lines().count();
    assert!(lines <= LOOP && readme.contains(&format!("All of it is {lines} lines")), "{lines} lines");
}

/// Programs that run the loop of direct.h, each by a file that includes it.
const CLIENTS: [&str; 4] = [
    "c-examples/minimal.c",
    "c-examples/render/integrate.c",
    "c-examples/pathtracer/path.h",
    "c-examples/pathtracer/small.c",
];

#[test]
fn the_demo_and_the_tracer_run_the_loop_of_the_readme() {
    for client in CLIENTS {
        let text = read(client);
        assert!(text.contains("direct.h\"\n"), "{client} does not include direct.h");
        assert!(
            text.contains(" direct_light(") || text.contains("(direct_light("),
            "{client} does not call direct_light"
        );
    }
    // Nothing calls wis_direct beside the loop, but the instruments in Rust, in one place.
    let mut sources = vec![root().join(CLIENTS[0])];
    for folder in
        ["c-examples/render", "c-examples/demo", "c-examples/pathtracer", "c-examples/gallery", "ffi-tests/src"]
    {
        files(&root().join(folder), &["c", "h", "rs"], &mut sources);
    }
    let text = |path: &PathBuf| fs::read_to_string(path).expect("a source").replace("wis_direct)(", "wis_direct(");
    let calls = |path: &PathBuf| text(path).matches("wis_direct(").count();
    let callers: Vec<(&PathBuf, usize)> = sources.iter().map(|path| (path, calls(path))).filter(|c| c.1 > 0).collect();
    assert_eq!(callers, [(&root().join("ffi-tests/src/environment.rs"), 1)]);
}

/// Where a page's links lead: files beside the page, without the anchors.
fn links(text: &str) -> Vec<&str> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split([')', '#']).next());
    targets.filter(|target| !target.is_empty() && !target.contains("://")).collect()
}

#[test]
fn links_lead_to_files() {
    let mut pages = Vec::new();
    files(&root().join("docs"), &["md"], &mut pages);
    pages.extend(["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|page| root().join(page)));
    let mut dead = Vec::new();
    // What rustdoc reads has links of its own.
    for page in pages.iter().filter(|page| !page.ends_with("docs/crate.md")) {
        let text = fs::read_to_string(page).expect("a page");
        let gone = |target: &&str| !page.with_file_name(target).exists();
        dead.extend(links(&text).into_iter().filter(gone).map(|target| format!("{}: {target}", page.display())));
    }
    assert!(dead.is_empty(), "no such file:\n{}", dead.join("\n"));
}

#[test]
fn links_are_found() {
    assert_eq!(links("[a](b.md#c), ![d](e/f.png), [g](#h) and [i](https://j.k)"), ["b.md", "e/f.png"]);
}

/// What stands between backticks.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// Pages that name files and functions.
const MAPS: [&str; 5] =
    ["ARCHITECTURE.md", "CONTRIBUTING.md", "docs/trust.md", "docs/design.md", "docs/integrating.md"];

#[test]
fn files_and_functions_that_pages_name_are_there() {
    let mut gone = Vec::new();
    for page in MAPS {
        let text = read(page);
        let has_root = |path: &&str| {
            let folder = path.split_once('/').map_or("", |(folder, _)| folder);
            !matches!(folder, "" | "build")
                && root().join(folder).is_dir()
                && !path.contains(['*', ' '])
                && !path.contains("NAME")
        };
        let missing = quoted(&text).filter(has_root).filter(|path| !root().join(path).exists());
        gone.extend(missing.map(|path| format!("{page}: {path}")));
    }
    let architecture = read("ARCHITECTURE.md");
    let rows = architecture.lines().filter(|line| line.starts_with("| Where") || line.contains("? | `src/"));
    let mut found = 0;
    for row in rows {
        let names: Vec<&str> = quoted(row).collect();
        let [.., file, name] = names[..] else { panic!("no file and function: {row}") };
        found += 1;
        let function = format!("fn {name}");
        if !read(file).match_indices(&function).any(|(at, _)| read(file)[at + function.len()..].starts_with(['(', '<']))
        {
            gone.push(format!("ARCHITECTURE.md: {name} in {file}"));
        }
    }
    assert!(found >= 10, "{found} rows were found");
    // In the row of a folder of src, what is one word is a file of it.
    for row in architecture.lines().filter(|line| line.starts_with("| `")) {
        let Some((folder, text)) = row.strip_prefix("| `").and_then(|row| row.split_once("/`")) else { continue };
        let Some((_, text)) = text.split_once(" | ") else { continue };
        if !root().join("src").join(folder).is_dir() {
            continue;
        }
        let words = quoted(text).filter(|name| name.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'_'));
        let missing = words.filter(|word| !root().join(format!("src/{folder}/{word}.rs")).exists());
        gone.extend(missing.map(|word| format!("ARCHITECTURE.md: {word} in src/{folder}")));
    }
    assert!(gone.is_empty(), "not there:\n{}", gone.join("\n"));
}
