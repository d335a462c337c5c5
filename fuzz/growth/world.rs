//! What curves are made of: the functions of the library, memory, and the objects that calls take.

use crate::count;
use anyhow::{Result, ensure};
use std::ffi::{CString, c_char, c_void};
use std::ptr::{null, null_mut};
use wis::ffi::MemorySize;
use wis::ffi::light::*;
use wis::status::Status;

/// The function of the library that has the type of the kernel's.
macro_rules! function {
    ($world:expr, $name:ident, $($argument:expr),*) => {{
        let kernel: unsafe extern "C" fn($($crate::world::function!(@ $argument)),*) -> _ = $name;
        $world.like(stringify!($name), kernel)
    }};
    (@ $argument:expr) => { _ };
}

/// Calls a function of the library, whose arguments are what its header says.
macro_rules! call {
    ($world:expr, $name:ident($($argument:expr),* $(,)?)) => {{
        let function = $crate::world::function!($world, $name, $($argument),*);
        // SAFETY: pointers are to what the header says.
        unsafe { function($($argument),*) }
    }};
}

/// As `call`, with its instructions counted.
macro_rules! counted {
    ($world:expr, $name:ident($($argument:expr),* $(,)?)) => {{
        let function = $crate::world::function!($world, $name, $($argument),*);
        // SAFETY: pointers are to what the header says.
        $world.count(|| unsafe { function($($argument),*) })
    }};
}

pub(crate) use {call, counted, function};

/// What a call answers.
pub trait Answer {
    fn is_good(&self) -> bool {
        true
    }
}

impl Answer for Status {
    fn is_good(&self) -> bool {
        *self == Status::Ok
    }
}

impl Answer for u32 {}
impl Answer for *const c_char {}

/// A struct of the boundary with nothing set but its size, which is its first field.
pub fn sized<T: Copy>() -> T {
    // SAFETY: structs of the boundary are valid with zeros; the first field is the size.
    unsafe {
        let mut value = std::mem::zeroed::<T>();
        (&raw mut value).cast::<u32>().write(size_of::<T>() as u32);
        value
    }
}

/// Memory aligned to 64.
pub struct Block {
    words: Vec<u128>,
    skip: usize,
    pub bytes: usize,
}

impl Block {
    pub fn new(bytes: usize) -> Block {
        let words = vec![0u128; bytes.div_ceil(16) + 4];
        let skip = words.as_ptr().align_offset(64).min(4);
        Block { words, skip, bytes }
    }

    pub fn at<T>(&mut self) -> *mut T {
        self.words[self.skip..].as_mut_ptr().cast()
    }

    pub fn of<T>(&self) -> *const T {
        self.words[self.skip..].as_ptr().cast()
    }
}

/// Numbers in [0, 1) that follow from a seed.
pub fn numbers(seed: u64, count: usize) -> Vec<f32> {
    let mut state = seed;
    let next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    std::iter::repeat_with(next).take(count).collect()
}

/// Unit directions.
pub fn directions(seed: u64, count: usize) -> Vec<[f32; 3]> {
    let direction = |pair: &[f32]| {
        let (z, phi) = (2.0 * pair[0] - 1.0, std::f32::consts::TAU * pair[1]);
        let r = (1.0 - z * z).max(0.0).sqrt();
        [r * phi.cos(), r * phi.sin(), z]
    };
    numbers(seed, 2 * count).chunks(2).map(direction).collect()
}

pub struct World {
    handle: *mut c_void,
    only: String,
    /// Function, input, size and the stated work of what is measured next.
    next: (String, String, f64, f64),
    /// How the work must relate to the statement.
    relation: &'static str,
    counted: usize,
}

impl World {
    pub fn new(library: &str, only: &str) -> Result<World> {
        let path = CString::new(library)?;
        // SAFETY: the library has no initialisers.
        let handle = unsafe { libc::dlopen(path.as_ptr(), libc::RTLD_NOW) };
        ensure!(!handle.is_null(), "{library}: not a shared library");
        Ok(World { handle, only: only.into(), next: Default::default(), relation: "", counted: 0 })
    }

    /// The function of that name and type.
    pub fn like<F: Copy>(&self, name: &str, _: F) -> F {
        let symbol = CString::new(name).expect("a name");
        // SAFETY: the handle is open.
        let address = unsafe { libc::dlsym(self.handle, symbol.as_ptr()) };
        assert!(!address.is_null() && size_of::<F>() == size_of_val(&address), "the library has no {name}");
        // SAFETY: the library was built from the same sources, so its function has the type of the kernel's.
        unsafe { std::mem::transmute_copy(&address) }
    }

    /// Measures a function at each size. `stated`: what its work is at most proportional to, and grows with.
    pub fn curve(
        &mut self,
        function: &str,
        input: &str,
        sizes: &[usize],
        stated: impl Fn(f64) -> f64,
        run: impl FnMut(&mut World, usize),
    ) {
        self.relation = "as";
        self.places(function, input, sizes, stated, run);
    }

    /// As `curve`, where most of the work may be another input's.
    pub fn at_most(
        &mut self,
        function: &str,
        input: &str,
        sizes: &[usize],
        stated: impl Fn(f64) -> f64,
        run: impl FnMut(&mut World, usize),
    ) {
        self.relation = "at most";
        self.places(function, input, sizes, stated, run);
    }

    fn places(
        &mut self,
        function: &str,
        input: &str,
        sizes: &[usize],
        stated: impl Fn(f64) -> f64,
        mut run: impl FnMut(&mut World, usize),
    ) {
        if function.contains(&self.only) {
            for size in sizes {
                self.next = (function.into(), input.into(), *size as f64, stated(*size as f64));
                run(self, *size);
            }
        }
    }

    /// Says what is stated at this size, where it follows from what was built.
    pub fn state(&mut self, stated: f64) {
        self.next.3 = stated;
    }

    /// Counts the instructions of the call that a curve is of, which must succeed.
    pub fn count<R: Answer>(&mut self, call: impl FnOnce() -> R) {
        self.counted += 1;
        let label = self.counted.to_string();
        let answer = count::count(&label, call);
        let (function, input, size, ..) = &self.next;
        assert!(answer.is_good(), "{function} fails by {input} {size}");
        self.note(&format!("count {label}"));
    }

    /// Notes bytes that a size query answered.
    pub fn bytes(&self, bytes: usize) {
        self.note(&bytes.to_string());
    }

    fn note(&self, measured: &str) {
        let ((function, input, size, stated), relation) = (&self.next, self.relation);
        println!("{function}\t{input}\t{relation}\t{size}\t{stated}\t{measured}");
    }
}

/// A lat-long map of noise with a sun, RGB.
pub struct Map {
    pub config: LightConfig,
    _pixels: Vec<f32>,
}

impl Map {
    /// Twice as wide as high; texels: a multiple of two that is a square times two.
    pub fn new(texels: usize) -> Map {
        let height = ((texels / 2) as f64).sqrt() as u32;
        let mut pixels = numbers(1, 3 * (2 * height * height) as usize);
        pixels[0] = 1e4;
        let mut config: LightConfig = sized();
        config.layout = WIS_LAYOUT_LATLONG;
        (config.width, config.height) = (2 * height, height);
        (config.channels, config.format) = (3, WIS_FORMAT_F32);
        config.pixels = pixels.as_ptr().cast();
        Map { config, _pixels: pixels }
    }

    pub fn size(&self, world: &World) -> MemorySize {
        let mut size = MemorySize::default();
        assert!(call!(world, wis_environment_size(&self.config, &mut size, null_mut())).is_good());
        size
    }

    pub fn build(&self, world: &World) -> Block {
        let size = self.size(world);
        let (mut memory, mut scratch, mut handle) = (Block::new(size.bytes), Block::new(size.scratch_bytes), null());
        let (place, work) = (memory.at(), scratch.at());
        let (config, bytes, room) = (&self.config, size.bytes, size.scratch_bytes);
        let status = call!(world, wis_environment_init(config, place, bytes, work, room, &mut handle, null_mut()));
        assert!(status.is_good());
        memory
    }
}
