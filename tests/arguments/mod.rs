//! Every function of the headers answers null, misaligned, short, overflowing and out-of-range arguments with its
//! status, blames the right argument and writes nothing but the diagnostic.
//!
//! The header drives the tests: what it declares is called, with every parameter spoiled in turn. A function that is
//! missing in the table, or a parameter that has no valid value, fails.

pub mod block;
mod call;
mod control;
mod fields;
/// One reader of the headers serves the fuzzer and these tests.
#[allow(dead_code)]
#[path = "../../fuzz/src/header.rs"]
mod header;
mod objects;
mod order;
mod pointers;
mod renderer;
mod scene;
mod sizes;
mod sources;
mod table;
mod values;

use call::Call;
use objects::functions;
use scene::Scene;
use table::TABLE;

/// The names in front of a parenthesis anywhere in the code, found without understanding declarations.
fn called_names() -> Vec<String> {
    let plain = header::HEADERS.split("/*").map(|piece| piece.split_once("*/").map_or(piece, |(_, after)| after));
    let lines = plain.flat_map(str::lines).filter(|line| !line.trim().starts_with("//") && !line.starts_with('#'));
    let code: String = lines.collect();
    let names = code.split('(').filter_map(|before| before.rsplit(|c: char| !c.is_alphanumeric() && c != '_').next());
    names.filter(|name| name.starts_with("wis_")).map(String::from).collect()
}

#[test]
fn the_table_is_the_header() {
    let functions = functions();
    let declared: Vec<_> = functions.iter().map(|function| function.name.as_str()).collect();
    assert!(declared.len() >= 40);
    assert_eq!(declared, called_names());
    let mut names: Vec<_> = TABLE.iter().map(|entry| entry.name).collect();
    let mut sorted = declared.clone();
    names.sort_unstable();
    sorted.sort_unstable();
    assert_eq!(names, sorted);
    for entry in TABLE {
        let function = functions.iter().find(|function| function.name == entry.name).unwrap();
        let parameters: Vec<_> = function.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
        assert_eq!(entry.parameters, parameters, "{}", entry.name);
    }
}

#[test]
fn valid_arguments_are_accepted() {
    let scene = Scene::new();
    for function in functions().iter().filter(|function| function.answers_status) {
        Call::valid(&scene, function).succeeds("valid");
    }
}

/// The functions that answer no status have no pointers, and are total.
#[test]
fn functions_without_status_take_any_number() {
    let scene = Scene::new();
    for function in functions().iter().filter(|function| !function.answers_status) {
        for number in [0, 1, 13, 14, 0x7fff_ffff, 0xffff_ffff] {
            let mut call = Call::valid(&scene, function);
            for parameter in &function.parameters {
                assert!(!parameter.is_pointer());
                call.set(&parameter.name, number);
            }
            call.answer();
        }
    }
}

/// Every status has a sentence of its own, and so has what is no status.
#[test]
fn statuses_have_sentences() {
    let sentence = |status: u32| {
        // SAFETY: the library gives a static string.
        unsafe { std::ffi::CStr::from_ptr(wis::ffi::wis_status_string(status)) }.to_str().unwrap()
    };
    let all: std::collections::HashSet<_> = (0..15).map(sentence).collect();
    assert_eq!(all.len(), 15);
    assert!([16, 99, u32::MAX].map(sentence).iter().all(|text| *text == sentence(15) && !all.contains(text)));
}

/// The version in the header is the package's.
#[test]
fn versions() {
    let package = env!("CARGO_PKG_VERSION").split('.').map(|part| part.parse::<u32>().unwrap());
    assert_eq!(package.fold(0, |version, part| version << 8 | part), wis::ffi::WIS_VERSION);
    assert_eq!(wis::ffi::wis_version(), wis::ffi::WIS_VERSION);
}
