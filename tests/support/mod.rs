//! What the integration tests share: environments and products built through the C boundary, in aligned memory.
#![allow(dead_code)]

pub mod maps;
pub mod material;
pub mod panorama;
pub mod partition;
pub mod quadrature;
pub mod scenes;
pub mod statistics;
pub mod vector;

use std::ptr::{null, null_mut};
use wis::ffi::light::{LightConfig, WIS_FILTER_BILINEAR};
use wis::ffi::wavelets::environment::*;
use wis::ffi::wavelets::product::*;
use wis::ffi::wavelets::sampling::*;
use wis::ffi::wavelets::tree::{Tree, TreeConfig, TreeInfo, WIS_TREE_PIXELS, wis_tree_init, wis_tree_size};
use wis::ffi::{Diagnostic, MemorySize};
use wis::points::sobol;
use wis::status::Status;
use wis::wavelets::descent::Sample;
use wis::wavelets::query::*;
use wis::wavelets::wide::TOGETHER;

/// Memory as a client gives it: 16-byte aligned, filled with a pattern so that nothing relies on zeros.
pub struct Memory(Vec<u128>);

impl Memory {
    pub fn new(bytes: usize) -> Memory {
        Memory::filled(bytes, 0xa5)
    }

    pub fn filled(bytes: usize, with: u8) -> Memory {
        Memory(vec![u128::from_ne_bytes([with; 16]); bytes.div_ceil(16)])
    }

    /// A copy elsewhere.
    pub fn copy(bytes: &[u8]) -> Memory {
        let mut memory = Memory::new(bytes.len());
        // SAFETY: the block is at least as long.
        unsafe { memory.pointer().cast::<u8>().copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
        memory
    }

    pub fn pointer(&mut self) -> *mut std::ffi::c_void {
        self.0.as_mut_ptr().cast()
    }

    pub fn len(&self) -> usize {
        self.0.len() * 16
    }

    pub fn bytes(&self) -> &[u8] {
        // SAFETY: any bit pattern is a byte.
        unsafe { std::slice::from_raw_parts(self.0.as_ptr().cast(), self.len()) }
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
            if status == Status::Ok { Ok(BuiltTree { memory, handle, info, size }) } else { Err(status) }
        }
    }
}

/// An environment and the memory that it lives in.
pub struct Environment {
    pub memory: Memory,
    pub handle: *const wis::ffi::wavelets::environment::Environment,
    pub info: EnvironmentInfo,
}

// SAFETY: environments are constant once built.
unsafe impl Sync for Environment {}

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

    pub fn config(&self, resolution: u32, flags: u32) -> EnvironmentConfig {
        EnvironmentConfig {
            size: size_of::<EnvironmentConfig>() as u32,
            layout: self.layout,
            width: self.width,
            height: self.height,
            channels: self.channels,
            format: WIS_FORMAT_F32,
            flags,
            storage: WIS_STORAGE_PYRAMID,
            resolution,
            error_budget: 0.0,
            pixels: self.pixels.as_ptr().cast(),
            row_stride: 0,
            row: None,
            row_user: null_mut(),
        }
    }

    /// The map as the renderer's header describes it.
    pub fn light_config(&self, flags: u32) -> LightConfig {
        LightConfig {
            size: size_of::<LightConfig>() as u32,
            layout: self.layout,
            width: self.width,
            height: self.height,
            channels: self.channels,
            format: WIS_FORMAT_F32,
            filter: WIS_FILTER_BILINEAR,
            flags,
            error_budget: 0.0,
            pixels: self.pixels.as_ptr().cast(),
            row_stride: 0,
            row: None,
            row_user: null_mut(),
            world_from_map: null(),
        }
    }

    pub fn build(&self, resolution: u32, flags: u32) -> Environment {
        build(&self.config(resolution, flags)).expect("the map is valid")
    }
}

/// Builds an environment in one call.
pub fn build(config: &EnvironmentConfig) -> Result<Environment, (Status, Diagnostic)> {
    build_over(config, 0xa5)
}

/// Builds an environment in blocks filled with a byte.
pub fn build_over(config: &EnvironmentConfig, fill: u8) -> Result<Environment, (Status, Diagnostic)> {
    let mut size = MemorySize::default();
    let mut diagnostic = Diagnostic::default();
    // SAFETY: all pointers are valid.
    let status = unsafe { wis_wavelet_light_size(config, &mut size, &mut diagnostic) };
    if status != Status::Ok {
        return Err((status, diagnostic));
    }
    let (mut memory, mut scratch) = (Memory::filled(size.bytes, fill), Memory::filled(size.scratch_bytes, fill));
    let mut handle = null();
    let mut info = EnvironmentInfo { size: size_of::<EnvironmentInfo>() as u32, ..Default::default() };
    // SAFETY: all pointers are valid and the blocks as long as the library said.
    let status = unsafe {
        wis_wavelet_light_init(
            config,
            memory.pointer(),
            size.bytes,
            scratch.pointer(),
            size.scratch_bytes,
            &mut handle,
            &mut info,
            &mut diagnostic,
        )
    };
    if status == Status::Ok { Ok(Environment { memory, handle, info }) } else { Err((status, diagnostic)) }
}

impl Environment {
    /// The bytes that are the environment.
    pub fn bytes(&self) -> &[u8] {
        &self.memory.bytes()[..self.info.bytes as usize]
    }

    pub fn sample(&self, matrix: Option<&[f32; 9]>, u: [f32; 2]) -> Sample {
        sample(self.handle, null(), matrix, u)
    }

    pub fn pdf(&self, matrix: Option<&[f32; 9]>, wi: [f32; 3]) -> f32 {
        pdf(self.handle, null(), matrix, wi)
    }

    pub fn invert(&self, matrix: Option<&[f32; 9]>, wi: [f32; 3]) -> Option<[f32; 2]> {
        invert(self.handle, null(), matrix, wi)
    }

    /// Opens a copy of an environment's bytes.
    pub fn open(bytes: &[u8]) -> Environment {
        let mut memory = Memory::copy(bytes);
        let mut handle = null();
        let mut info = EnvironmentInfo { size: size_of::<EnvironmentInfo>() as u32, ..Default::default() };
        let start = memory.pointer();
        // SAFETY: all pointers are valid.
        let status = unsafe { wis_wavelet_light_open(start, bytes.len(), &mut handle, &mut info, null_mut()) };
        assert_eq!(status, Status::Ok);
        Environment { memory, handle, info }
    }

    pub fn prepare(&self, query: &Query, config: &ProductConfig) -> Product<'_> {
        self.prepare_over(query, config, 0xa5)
    }

    /// Prepares a product in a block filled with a byte.
    pub fn prepare_over(&self, query: &Query, config: &ProductConfig, fill: u8) -> Product<'_> {
        let mut size = MemorySize::default();
        let mut handle = null();
        // SAFETY: all pointers are valid.
        unsafe {
            assert_eq!(wis_wavelet_product_size(config, &mut size, null_mut()), Status::Ok);
            let mut memory = Memory::filled(size.bytes, fill);
            let block = memory.pointer();
            let (bytes, none) = (size.bytes, null_mut());
            let status = wis_wavelet_product_prepare(self.handle, config, 1, query, block, bytes, &mut handle, none);
            assert_eq!(status, Status::Ok);
            Product { environment: self, memory, handle }
        }
    }
}

/// RGB of BRDF x cosine as the library evaluates a query.
pub fn eval(query: &Query, wi: [f32; 3]) -> [f32; 3] {
    let mut f_cos = [-1.0; 3];
    // SAFETY: both arrays have one element.
    let status = unsafe { wis_wavelet_query_eval(query, null(), 1, wi.as_ptr(), 0, f_cos.as_mut_ptr(), 0) };
    assert_eq!(status, Status::Ok);
    f_cos
}

/// A product and the memory that it lives in.
pub struct Product<'a> {
    pub environment: &'a Environment,
    pub memory: Memory,
    pub handle: *const wis::ffi::wavelets::product::Product,
}

impl Product<'_> {
    pub fn sample(&self, u: [f32; 2]) -> Sample {
        sample(self.environment.handle, self.handle, None, u)
    }

    pub fn pdf(&self, wi: [f32; 3]) -> f32 {
        pdf(self.environment.handle, self.handle, None, wi)
    }

    pub fn invert(&self, wi: [f32; 3]) -> Option<[f32; 2]> {
        invert(self.environment.handle, self.handle, None, wi)
    }

    pub fn estimate(&self) -> f64 {
        self.info().estimate
    }

    pub fn estimate_rgb(&self) -> [f64; 3] {
        let mut rgb = [-1.0; 3];
        // SAFETY: all pointers are valid.
        let status =
            unsafe { wis_wavelet_product_estimate_rgb(self.environment.handle, self.handle, null(), &mut rgb) };
        assert_eq!(status, Status::Ok);
        rgb
    }

    pub fn info(&self) -> ProductInfo {
        let mut info = ProductInfo { size: size_of::<ProductInfo>() as u32, ..Default::default() };
        // SAFETY: all pointers are valid.
        let status = unsafe { wis_wavelet_product_describe(self.environment.handle, self.handle, &mut info) };
        assert_eq!(status, Status::Ok);
        info
    }

    /// The bytes that are the product.
    pub fn bytes(&self) -> &[u8] {
        &self.memory.bytes()[..self.info().bytes as usize]
    }
}

type Light = *const wis::ffi::wavelets::environment::Environment;
type PreparedPoint = *const wis::ffi::wavelets::product::Product;

/// One sample of a product, or of a light.
pub fn sample(light: Light, product: PreparedPoint, matrix: Option<&[f32; 9]>, u: [f32; 2]) -> Sample {
    let mut sample = Sample::default();
    let matrix = matrix.map_or(null(), |m| m as *const _);
    // SAFETY: all pointers are valid.
    let status = unsafe { wis_wavelet_sample(light, product, matrix, 1, u.as_ptr(), 0, &mut sample, 0) };
    assert_eq!(status, Status::Ok);
    sample
}

/// One pdf.
pub fn pdf(light: Light, product: PreparedPoint, matrix: Option<&[f32; 9]>, wi: [f32; 3]) -> f32 {
    let mut pdf = -1.0;
    let matrix = matrix.map_or(null(), |m| m as *const _);
    // SAFETY: all pointers are valid.
    let status = unsafe { wis_wavelet_pdf(light, product, matrix, 1, wi.as_ptr(), 0, &mut pdf, 0) };
    assert_eq!(status, Status::Ok);
    pdf
}

/// One inversion.
pub fn invert(light: Light, product: PreparedPoint, matrix: Option<&[f32; 9]>, wi: [f32; 3]) -> Option<[f32; 2]> {
    let (mut u, mut found) = ([-1.0; 2], 99);
    let matrix = matrix.map_or(null(), |m| m as *const _);
    let (wi, place) = (wi.as_ptr(), u.as_mut_ptr());
    // SAFETY: all pointers are valid.
    let status = unsafe { wis_wavelet_invert(light, product, matrix, 1, wi, 0, place, 0, &mut found) };
    assert_eq!(status, Status::Ok);
    assert!(found == 0 || u == [-1.0; 2]);
    if found == Status::Ok as u8 { Some(u) } else { None }
}

/// The default configuration.
pub fn product_config() -> ProductConfig {
    ProductConfig {
        size: size_of::<ProductConfig>() as u32,
        max_squares: 0,
        max_evaluations: 0,
        reserved: 0,
        world_from_map: null(),
        table: null(),
        callback: null(),
    }
}

pub fn lambert(albedo: f32) -> Lobe {
    Lobe { kind: WIS_WAVELET_LOBE_LAMBERT, weight: [albedo; 3], ..Lobe::default() }
}

pub fn ggx(alpha: f32) -> Lobe {
    Lobe { kind: WIS_WAVELET_LOBE_GGX, weight: [1.0; 3], f0: [0.8; 3], a: alpha, b: alpha }
}

/// A shading point with up to four lobes.
pub fn query(normal: [f32; 3], wo: [f32; 3], lobes: &[Lobe]) -> Query {
    let mut query =
        Query { size: size_of::<Query>() as u32, lobe_count: lobes.len() as u32, normal, wo, ..Query::default() };
    query.lobe[..lobes.len()].copy_from_slice(lobes);
    query
}

/// A unit vector.
pub fn normalise(v: [f64; 3]) -> [f32; 3] {
    let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
    v.map(|c| (c / length) as f32)
}

/// Points for lanes: any number up to two groups, also fewer than one; the first are those that are moved into range.
pub fn lane_points(first: u32) -> Vec<[f32; 2]> {
    let nan = f32::NAN;
    if first == 0 {
        return vec![[0.0; 2], [1.0; 2], [nan, 0.5], [-1.0, 2.0], [0.5; 2], [1e-40; 2], [0.0, 1.0], [-0.0, 0.75]];
    }
    let count = if first % 5 == 0 { 1 + first / 16 % TOGETHER as u32 } else { TOGETHER as u32 };
    (0..count).map(|i| sobol(9, first + i)).collect()
}

/// The next smaller number; `x` is positive.
pub fn next_down(x: f32) -> f32 {
    f32::from_bits(x.to_bits() - 1)
}

/// A fast generator of uniform numbers for tests (splitmix64).
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
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
