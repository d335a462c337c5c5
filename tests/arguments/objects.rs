//! Trees other than the scene's: built with one argument changed.

use super::call::Call;
use super::header::{Function, functions};
use super::scene::Scene;
use wis::ffi::wavelets::tree::{TreeConfig, TreeInfo};

/// A function of the header.
pub fn function(name: &str) -> Function {
    functions().into_iter().find(|function| function.name == name).unwrap()
}

/// A tree of another configuration.
pub fn tree(scene: &Scene, edit: impl FnOnce(&mut TreeConfig)) -> Vec<u8> {
    let init = function("wis_tree_init");
    let mut call = Call::valid(scene, &init);
    call.edit("config", edit);
    call.succeeds("another tree");
    let mut bytes = 0;
    call.edit("info", |info: &mut TreeInfo| bytes = info.bytes as usize);
    call.bytes("memory")[..bytes].to_vec()
}
