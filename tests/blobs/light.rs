//! Lights that other stored objects belong to.

use crate::arguments::block::Block;
use crate::support::light_config;
use std::ptr::{null, null_mut};
use wis::ffi::MemorySize;
use wis::ffi::light::*;
use wis::light::environment::Environment;
use wis::status::Status;

thread_local! {
    static SKY: Block = Block::new(&built(&SKY_PIXELS, SKY_SIZE), 0);
}

/// A lamp in a sky that is brighter towards one side.
const SKY_SIZE: [u32; 2] = [16, 8];
const SKY_PIXELS: [f32; 128] = {
    let mut pixels = [0.0; 128];
    let mut k = 0;
    while k < 128 {
        pixels[k] = 0.5 + (k % 16) as f32 / 16.0;
        k += 1;
    }
    pixels[37] = 900.0;
    pixels
};

/// Calls with the light of all stored products.
pub fn with<T>(call: impl FnOnce(*const EnvironmentObject) -> T) -> T {
    SKY.with(|sky| call(sky.pointer().cast_const().cast()))
}

/// The bytes of the environment of a map.
pub fn built(pixels: &[f32], size: [u32; 2]) -> Vec<u8> {
    let (config, mut size) = (light_config(WIS_LAYOUT_LATLONG, size, pixels), MemorySize::default());
    // SAFETY: the configuration describes the pixels, and the blocks are as long as stated.
    unsafe {
        assert_eq!(wis_environment_size(&config, &mut size, null_mut()), Status::Ok);
        let (memory, scratch) = (Block::unwritten(size.bytes), Block::unwritten(size.scratch_bytes));
        let (block, work) = (memory.pointer().cast(), scratch.pointer().cast());
        let (mut handle, none) = (null(), null_mut());
        let status = wis_environment_init(&config, block, size.bytes, work, scratch.len(), &mut handle, none);
        assert_eq!(status, Status::Ok);
        // Less than was asked for: how many strata a light has depends on its pixels.
        let bytes = memory.to_vec();
        Environment::view(&bytes).unwrap().as_bytes().to_vec()
    }
}
