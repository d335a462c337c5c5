//! No test is left out: cargo is told which binaries there are, and each names the files that it consists of.

use crate::pages::{read, root};
use std::collections::BTreeSet;
use std::fs;

/// The binaries of `Cargo.toml`: `[[test]]` with `path = "tests/NAME.rs"`.
fn binaries() -> BTreeSet<String> {
    let manifest = read("Cargo.toml");
    let paths = manifest.lines().filter_map(|line| line.strip_prefix("path = \"tests/")?.strip_suffix(".rs\""));
    paths.map(String::from).collect()
}

#[test]
fn every_file_of_tests_is_in_a_binary() {
    let binaries = binaries();
    assert!(binaries.len() >= 4, "{binaries:?}");
    let mut named = BTreeSet::new();
    for binary in &binaries {
        let source = read(&format!("tests/{binary}.rs"));
        named.extend(source.lines().filter_map(|line| Some(line.strip_prefix("mod ")?.strip_suffix(';')?.to_string())));
    }
    for entry in fs::read_dir(root().join("tests")).expect("tests") {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().expect("a name").to_string_lossy().to_string();
        let holds_tests = path.extension().is_some_and(|extension| extension == "rs") || path.join("mod.rs").exists();
        assert!(!path.join("main.rs").exists(), "tests/{name}/main.rs: name it mod.rs, and name {name} in a binary");
        if holds_tests && !binaries.contains(&name) {
            assert!(named.contains(&name), "no binary of Cargo.toml has `mod {name};`");
        }
    }
}

/// Files below a folder of tests are modules of it.
#[test]
fn every_file_of_a_folder_is_a_module() {
    for entry in fs::read_dir(root().join("tests")).expect("tests") {
        let folder = entry.expect("an entry").path();
        let Ok(parent) = fs::read_to_string(folder.join("mod.rs")) else { continue };
        for file in fs::read_dir(&folder).expect("a folder") {
            let path = file.expect("a file").path();
            let name = path.file_stem().expect("a name").to_string_lossy().to_string();
            if path.extension().is_some_and(|extension| extension == "rs") && name != "mod" {
                assert!(parent.contains(&format!("mod {name};")), "{} is in no binary", path.display());
            }
        }
    }
}
