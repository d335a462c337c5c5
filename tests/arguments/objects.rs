//! The functions of the headers, and trees other than the scene's: built with one argument changed.

use super::call::Call;
use super::header::{Function, Headers};
use super::scene::Scene;
use std::sync::LazyLock;
use wis::ffi::wavelets::tree::{TreeConfig, TreeInfo};

pub fn headers() -> &'static Headers {
    static HEADERS: LazyLock<Headers> = LazyLock::new(Headers::read);
    &HEADERS
}

/// Every function, in the order of the headers.
pub fn functions() -> &'static [Function] {
    &headers().functions
}

/// A function of the header.
pub fn function(name: &str) -> &'static Function {
    functions().iter().find(|function| function.name == name).unwrap_or_else(|| panic!("no {name}"))
}

/// A tree of another configuration.
pub fn tree(scene: &Scene, edit: impl FnOnce(&mut TreeConfig)) -> Vec<u8> {
    let mut call = Call::valid(scene, function("wis_tree_init"));
    call.edit("config", edit);
    call.succeeds("another tree");
    call.bytes("memory")[..call.read::<TreeInfo>("info").bytes as usize].to_vec()
}
