//! Environments, products and trees other than the scene's: built with one argument changed.

use super::block::Block;
use super::call::Call;
use super::header::{Function, functions};
use super::scene::Scene;
use wis::ffi::wavelets::environment::{EnvironmentConfig, EnvironmentInfo};
use wis::ffi::wavelets::product::ProductConfig;
use wis::ffi::wavelets::tree::{TreeConfig, TreeInfo};

/// A function of the header.
pub fn function(name: &str) -> Function {
    functions().into_iter().find(|function| function.name == name).unwrap()
}

/// An environment of another configuration.
pub fn environment(scene: &Scene, edit: impl FnOnce(&mut EnvironmentConfig)) -> Vec<u8> {
    let init = function("wis_wavelet_light_init");
    let mut call = Call::valid(scene, &init);
    call.edit("config", edit);
    call.succeeds("another environment");
    let mut bytes = 0;
    call.edit("info", |info: &mut EnvironmentInfo| bytes = info.bytes as usize);
    call.bytes("memory")[..bytes].to_vec()
}

/// The scene's map without what it can be built with.
pub fn plain_environment(scene: &Scene) -> Vec<u8> {
    environment(scene, |config| config.flags = 0)
}

/// A black map, as large as the scene's.
pub fn black_environment(scene: &Scene) -> Vec<u8> {
    let pixels = [0.0f32; 6 * 3 * 3];
    environment(scene, |config| config.pixels = pixels.as_ptr().cast())
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

/// A product of the scene's query with an environment.
pub fn product(scene: &Scene, environment: &[u8]) -> Vec<u8> {
    prepared(scene, environment, |_| ())
}

/// A product of the scene's callback with an environment.
pub fn callback_product(scene: &Scene, environment: &[u8]) -> Vec<u8> {
    prepared(scene, environment, |config| config.callback = scene.callback.pointer().cast_const().cast())
}

fn prepared(scene: &Scene, environment: &[u8], edit: impl FnOnce(&mut ProductConfig)) -> Vec<u8> {
    let prepare = function("wis_wavelet_product_prepare");
    let mut call = Call::valid(scene, &prepare);
    call.give("environment", Block::new(environment, 0));
    call.edit("config", edit);
    call.succeeds("another product");
    call.bytes("memory").to_vec()
}
