//! What the integration tests share: trees built through the C boundary in aligned memory, maps, numbers.
#![allow(dead_code)]

pub mod maps;
pub mod scenes;
/// Changed bytes are signed alike by the fuzzer and by these tests.
#[path = "../../fuzz/src/sign.rs"]
pub mod sign;
pub mod sphere;
pub mod statistics;
pub mod vector;

use std::ptr::{null, null_mut};
use wis::ffi::MemorySize;
use wis::ffi::light::{LightConfig, WIS_FILTER_BILINEAR, WIS_FORMAT_F32, WIS_LAYOUT_LATLONG};
use wis::ffi::wavelets::tree::{Tree, TreeConfig, TreeInfo, WIS_TREE_PIXELS, wis_tree_init, wis_tree_size};
use wis::status::Status;

/// Abscissa of Gauss' rule with two points on [-1/2, 1/2].
pub const GAUSS: f64 = 0.288_675_134_594_812_9;

/// Memory as a client gives it: 16-byte aligned, filled with a pattern so that nothing relies on zeros.
pub struct Memory {
    words: Vec<u128>,
    len: usize,
}

impl Memory {
    pub fn new(bytes: usize) -> Memory {
        Memory::filled(bytes, 0xa5)
    }

    pub fn filled(len: usize, with: u8) -> Memory {
        Memory { words: vec![u128::from_ne_bytes([with; 16]); len.div_ceil(16)], len }
    }

    /// A copy elsewhere.
    pub fn copy(bytes: &[u8]) -> Memory {
        let mut memory = Memory::new(bytes.len());
        memory.bytes_mut().copy_from_slice(bytes);
        memory
    }

    pub fn pointer(&mut self) -> *mut std::ffi::c_void {
        self.words.as_mut_ptr().cast()
    }

    pub fn len(&self) -> usize {
        self.len
    }

    pub fn bytes(&self) -> &[u8] {
        // SAFETY: any bit pattern is a byte, and the words are at least as many.
        unsafe { std::slice::from_raw_parts(self.words.as_ptr().cast(), self.len) }
    }

    pub fn bytes_mut(&mut self) -> &mut [u8] {
        // SAFETY: as above.
        unsafe { std::slice::from_raw_parts_mut(self.words.as_mut_ptr().cast(), self.len) }
    }
}

/// A configuration of a tree of which nothing is set but the source.
pub fn tree_config(source: u32) -> TreeConfig {
    let size = size_of::<TreeConfig>() as u32;
    // SAFETY: a struct of numbers and pointers.
    TreeConfig { size, source, ..unsafe { std::mem::zeroed() } }
}

/// That of a tree of pixels.
pub fn pixel_config(dimensions: u32, depth: u32, error_budget: f32, pixels: &[f32]) -> TreeConfig {
    TreeConfig { dimensions, depth, error_budget, pixels: pixels.as_ptr(), ..tree_config(WIS_TREE_PIXELS) }
}

/// A tree and the memory that it lives in.
pub struct BuiltTree {
    pub memory: Memory,
    pub handle: *const Tree,
    pub info: TreeInfo,
    /// What wis_tree_size answered.
    pub size: MemorySize,
}

impl BuiltTree {
    /// Builds in blocks as large as wis_tree_size says.
    pub fn new(config: &TreeConfig) -> Result<BuiltTree, Status> {
        let (mut size, mut handle) = (MemorySize::default(), null());
        let mut info = TreeInfo { size: size_of::<TreeInfo>() as u32, ..TreeInfo::default() };
        // SAFETY: what the configuration points to is alive, and the blocks are as large as was asked for.
        unsafe {
            assert_eq!(wis_tree_size(config, &mut size, null_mut()), Status::Ok);
            let (mut memory, mut scratch) = (Memory::new(size.bytes), Memory::new(size.scratch_bytes));
            let (place, work) = (memory.pointer(), scratch.pointer());
            let (bytes, room) = (size.bytes, size.scratch_bytes);
            let status = wis_tree_init(config, place, bytes, work, room, &mut handle, &mut info, null_mut());
            if status != Status::Ok {
                return Err(status);
            }
            assert!(handle.cast() == place.cast_const() && info.bytes as usize <= size.bytes);
            Ok(BuiltTree { memory, handle, info, size })
        }
    }
}

/// A map for tests.
#[derive(Clone)]
pub struct Map {
    pub width: u32,
    pub height: u32,
    pub channels: u32,
    pub layout: u32,
    pub pixels: Vec<f32>,
}

impl Map {
    pub fn latlong(width: u32, height: u32, mut luminance: impl FnMut(u32, u32) -> f32) -> Map {
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| luminance(x, y)).collect();
        Map { width, height, channels: 1, layout: WIS_LAYOUT_LATLONG, pixels }
    }

    /// The map as the renderer's header describes it.
    pub fn light_config(&self, flags: u32) -> LightConfig {
        LightConfig { flags, ..light_config(self.layout, [self.width, self.height], &self.pixels) }
    }
}

/// A map of so many columns and rows, of as many channels as there are numbers.
pub fn light_config(layout: u32, [width, height]: [u32; 2], pixels: &[f32]) -> LightConfig {
    let texels = (width * height) as usize;
    assert_eq!(pixels.len() % texels, 0);
    LightConfig {
        size: size_of::<LightConfig>() as u32,
        layout,
        width,
        height,
        channels: (pixels.len() / texels) as u32,
        format: WIS_FORMAT_F32,
        filter: WIS_FILTER_BILINEAR,
        flags: 0,
        error_budget: 0.0,
        pixels: pixels.as_ptr().cast(),
        row_stride: 0,
        row: None,
        row_user: null_mut(),
        world_from_map: null(),
    }
}

/// A unit vector.
pub fn normalise(v: [f64; 3]) -> [f32; 3] {
    let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
    v.map(|c| (c / length) as f32)
}

/// A fast generator of uniform numbers for tests (Steele et al. 2014, SplitMix64).
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1), a multiple of 2^-24.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / 16_777_216.0
    }

    /// In (0, 1), a multiple of 2^-24 plus half of that, as clients of 24 bits have it.
    pub fn f32(&mut self) -> f32 {
        ((self.bits() >> 40) as f32 + 0.5) / 16_777_216.0
    }

    pub fn f64(&mut self) -> f64 {
        ((self.bits() >> 11) as f64 + 0.5) / 9_007_199_254_740_992.0
    }

    pub fn direction(&mut self) -> [f64; 3] {
        let z = 2.0 * self.f64() - 1.0;
        let phi = std::f64::consts::TAU * self.f64();
        let r = (1.0 - z * z).sqrt();
        [r * phi.cos(), r * phi.sin(), z]
    }
}
