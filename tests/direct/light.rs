//! Environments through the Rust API, and a thread's sampler over them.

use crate::support::Map;
use crate::support::statistics::Mean;
use std::ops::Range;
use wis::brdf::point::Point;
use wis::direct::Ray;
use wis::direct::sampler::{Config, Sampler, Sequence};
use wis::light::chart::Layout;
use wis::light::environment::Environment;
use wis::light::pixels::{Format, Pixels};
use wis::light::plan::{Description, Filter, Plan};
use wis::simd::Level;
use wis::sphere::Frame;

/// A rotation, row by row, by which the light is turned.
pub const TURNED: [f32; 9] = [0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6];

/// What is built of a map unless a test says otherwise.
pub fn description(map: &Map) -> Description {
    Description {
        layout: Layout::LatLong,
        width: map.width,
        height: map.height,
        filter: Filter::Bilinear,
        rows_at_poles: false,
        exact_zero: false,
        compensated: false,
        light_only: false,
        rays_only: false,
        budget: 0.0,
    }
}

/// An environment and its memory.
pub struct Light(Vec<u128>);

impl Light {
    /// The bilinear light of a map, turned.
    pub fn of(map: &Map) -> Light {
        Light::build(map, &description(map))
    }

    pub fn build(map: &Map, of: &Description) -> Light {
        let plan = Plan::new(of).unwrap();
        let size = plan.size().unwrap();
        let (mut memory, mut scratch) = (vec![0u128; size.bytes.div_ceil(16)], vec![0u128; size.scratch.div_ceil(16)]);
        let length = (4 * map.channels * map.width) as usize;
        let bytes: &[u8] = bytemuck::cast_slice(&map.pixels);
        let row = |y: u32| bytes.get(y as usize * length..(y as usize + 1) * length);
        let pixels = Pixels { channels: map.channels, format: Format::F32, sanitise: false, absolute: false };
        let frame = Frame::new(&TURNED).unwrap();
        let blocks = (bytemuck::cast_slice_mut(&mut memory), bytemuck::cast_slice_mut(&mut scratch));
        Environment::build_in(&plan, &pixels, &frame, &row, blocks.0, blocks.1).unwrap();
        Light(memory)
    }

    pub fn environment(&self) -> Environment<'_> {
        Environment::view(bytemuck::cast_slice(&self.0)).unwrap()
    }
}

/// A sampler's memory.
pub struct Thread {
    level: Level,
    config: Config,
    memory: Vec<u64>,
}

impl Thread {
    /// For so many rays in a call, with the library's own number of candidates.
    pub fn new(rays: u32) -> Thread {
        Thread::with(Level::detect(), Config { rays, candidates_per_ray: 0, hits_per_pixel: 0, reserved: 0 })
    }

    pub fn with(level: Level, config: Config) -> Thread {
        // Nothing of what stood there may remain.
        let mut thread = Thread { level, config, memory: vec![u64::MAX; config.bytes().div_ceil(8)] };
        thread.begin_pixel();
        thread
    }

    fn sampler(&mut self) -> Sampler<'_> {
        Sampler::new(self.level, self.config, bytemuck::cast_slice_mut(&mut self.memory)).unwrap()
    }

    pub fn begin_pixel(&mut self) {
        self.sampler().begin_pixel();
    }

    /// The rays of a call.
    pub fn direct(&mut self, environment: &Environment<'_>, point: &Point<'_>, at: Sequence, rays: usize) -> Vec<Ray> {
        let mut out = vec![Ray { wi: [f32::NAN; 3], weight: f32::NAN }; rays];
        let count = self.sampler().direct(environment, point, at, rays, &mut out).unwrap();
        assert!(count <= rays, "{count} rays of {rays}");
        out.truncate(count);
        out
    }
}

/// The first hit of a pixel.
pub fn first_hit(seed: u32) -> Sequence {
    Sequence { seed, sample: 0, bounce: 0 }
}

/// The mean over seeds of as many calls as a z-test needs to find a fault of [`LARGEST_MISSED`]; how many those are is learnt from
/// the first, which are then left out.
///
/// [`LARGEST_MISSED`]: crate::support::statistics::LARGEST_MISSED
pub fn mean_of(significance: f64, mut call: impl FnMut(u32) -> f64) -> Mean {
    const PILOT: u32 = 10_000;
    const MOST: u32 = 2_000_000;
    let mut run = |seeds: Range<u32>| {
        let mut mean = Mean::default();
        seeds.for_each(|seed| mean.add(call(seed)));
        mean
    };
    // The variance is known from the pilot only roughly.
    let needed = 1.8 * run(0..PILOT).samples_needed(significance);
    run(PILOT..PILOT + (needed as u32).clamp(PILOT, MOST))
}
