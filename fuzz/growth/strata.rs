//! Curves of wis_lights.h.

use crate::world::{Block, Map, World, call, counted, numbers, sized};
use std::ptr::{null, null_mut};
use wis::ffi::MemorySize;
use wis::ffi::lights::jitter::*;
use wis::ffi::lights::strata::*;
use wis::status::Status;
use wis::wavelets::descent::Sample;

const TEXELS: [usize; 3] = [2048, 8192, 32768];
const COUNTS: [usize; 4] = [16, 64, 256, 1024];

fn constant(_: f64) -> f64 {
    1.0
}

fn linear(n: f64) -> f64 {
    n
}

pub fn run(w: &mut World) {
    strata(w);
    jitters(w);
    order(w);
}

fn config(lights: usize, levels: usize) -> StrataConfig {
    let mut config: StrataConfig = sized();
    (config.count, config.levels) = (lights as u32, levels as u32);
    config
}

fn measured(w: &World, map: &Map, config: &StrataConfig) -> MemorySize {
    let mut size = MemorySize::default();
    assert_eq!(call!(w, wis_strata_size(&map.config, config, &mut size, null_mut())), Status::Ok);
    size
}

fn lights(w: &mut World, texels: usize, lights: usize, levels: usize) {
    let (map, config) = (Map::new(texels), config(lights, levels));
    let size = measured(w, &map, &config);
    let (mut scratch, mut out, mut label, mut count) =
        (Block::new(size.scratch_bytes), Block::new(size.bytes), vec![0u32; texels], 0);
    let (place, room, out, label) = (scratch.at(), size.scratch_bytes, out.at(), label.as_mut_ptr());
    counted!(w, wis_strata_lights(&map.config, &config, place, room, out, &mut count, label, null_mut()));
}

fn strata(w: &mut World) {
    w.curve("wis_strata_size", "texels", &TEXELS, constant, |w, n| {
        let (map, mut size) = (Map::new(n), MemorySize::default());
        counted!(w, wis_strata_size(&map.config, &config(64, 0), &mut size, null_mut()));
    });
    w.curve("wis_strata_size", "bytes by lights", &COUNTS, linear, |w, n| {
        let bytes = measured(w, &Map::new(2048), &config(n, 0)).bytes;
        w.bytes(bytes);
    });
    w.curve("wis_strata_size", "scratch by texels", &TEXELS, linear, |w, n| {
        let bytes = measured(w, &Map::new(n), &config(64, 0)).scratch_bytes;
        w.bytes(bytes);
    });
    w.curve("wis_strata_lights", "texels", &TEXELS, linear, |w, n| lights(w, n, 16, 0));
    w.curve("wis_strata_lights", "lights", &COUNTS[..3], linear, |w, n| lights(w, 2048, n, 0));
    w.at_most("wis_strata_lights", "levels", &[4, 16, 64], linear, |w, n| lights(w, 2048, 64, n));
}

/// A map, its memory and the texels' lights.
struct Jittered {
    map: Map,
    memory: Block,
    scratch: Block,
    labels: Vec<u32>,
    lights: u32,
}

impl Jittered {
    fn new(w: &World, texels: usize, lights: usize) -> Jittered {
        let (map, mut size, lights) = (Map::new(texels), MemorySize::default(), lights as u32);
        assert_eq!(
            call!(w, wis_jitter_size(&map.config, &jitter_config(lights, &[]), &mut size, null_mut())),
            Status::Ok
        );
        let labels = (0..texels as u32).map(|i| i % lights).collect();
        Jittered { map, memory: Block::new(size.bytes), scratch: Block::new(size.scratch_bytes), labels, lights }
    }

    fn init(mut self, w: &mut World, is_counted: bool) -> Jittered {
        let (memory, bytes, scratch, room) =
            (self.memory.at(), self.memory.bytes, self.scratch.at(), self.scratch.bytes);
        let (map, config, mut handle, none) =
            (&self.map.config, jitter_config(self.lights, &self.labels), null(), null_mut());
        if is_counted {
            counted!(w, wis_jitter_init(map, &config, memory, bytes, scratch, room, &mut handle, none));
        } else {
            let status = call!(w, wis_jitter_init(map, &config, memory, bytes, scratch, room, &mut handle, none));
            assert_eq!(status, Status::Ok);
        }
        self
    }
}

fn jitter_config(light_count: u32, labels: &[u32]) -> JitterConfig {
    let (size, distribution) = (size_of::<JitterConfig>() as u32, WIS_JITTER_ENERGY);
    JitterConfig { size, light_count, distribution, reserved: 0, label: labels.as_ptr() }
}

fn jitters(w: &mut World) {
    w.curve("wis_jitter_size", "texels", &TEXELS, constant, |w, n| {
        let (map, mut size) = (Map::new(n), MemorySize::default());
        counted!(w, wis_jitter_size(&map.config, &jitter_config(64, &[]), &mut size, null_mut()));
    });
    w.curve("wis_jitter_size", "bytes by texels", &TEXELS, linear, |w, n| {
        let bytes = Jittered::new(w, n, 64).memory.bytes;
        w.bytes(bytes);
    });
    w.curve("wis_jitter_init", "texels", &TEXELS, linear, |w, n| {
        Jittered::new(w, n, 64).init(w, true);
    });
    w.curve("wis_jitter_init", "texels, 1 light", &TEXELS, linear, |w, n| {
        Jittered::new(w, n, 1).init(w, true);
    });
    w.curve("wis_jitter_init", "texels and lights", &TEXELS, linear, |w, n| {
        Jittered::new(w, n, n).init(w, true);
    });
    w.curve("wis_jitter_open", "texels", &TEXELS, linear, |w, n| {
        let (made, mut handle) = (Jittered::new(w, n, 64).init(w, false), null());
        counted!(w, wis_jitter_open(made.memory.of(), made.memory.bytes, &mut handle, null_mut()));
    });
    w.curve("wis_jitter_sample", "texels", &TEXELS, f64::log2, |w, n| {
        let (made, mut sample) = (Jittered::new(w, n, 1).init(w, false), Sample::default());
        counted!(w, wis_jitter_sample(made.memory.of(), 0, &[0.3, 0.7], &mut sample));
    });
    w.curve("wis_jitter_pdf", "texels", &TEXELS, f64::log2, |w, n| {
        let (made, mut pdf) = (Jittered::new(w, n, 1).init(w, false), 0.0);
        counted!(w, wis_jitter_pdf(made.memory.of(), 0, &[0.6, 0.0, 0.8], &mut pdf));
    });
}

fn ordered(w: &mut World, contribution: &[f32]) {
    let (mut index, mut traced) = (vec![0u32; contribution.len()], 0);
    let (count, values, index) = (contribution.len(), contribution.as_ptr(), index.as_mut_ptr());
    counted!(w, wis_strata_order(count, values, 0.0, index, &mut traced, null_mut()));
}

/// All are sorted, in the orders that are hard for one or another way to sort.
fn order(w: &mut World) {
    let stated = |n: f64| n * n.log2();
    let rising = |n: usize| (0..n).map(|i| i as f32);
    w.curve("wis_strata_order", "count", &COUNTS, stated, |w, n| ordered(w, &numbers(5, n)));
    w.curve("wis_strata_order", "count, rising", &COUNTS, stated, |w, n| ordered(w, &rising(n).collect::<Vec<_>>()));
    w.curve("wis_strata_order", "count, falling", &COUNTS, stated, |w, n| {
        ordered(w, &rising(n).rev().collect::<Vec<_>>())
    });
    w.curve("wis_strata_order", "count, equal", &COUNTS, stated, |w, n| ordered(w, &vec![1.0; n]));
    w.curve("wis_strata_order", "count, pipe", &COUNTS, stated, |w, n| {
        ordered(w, &rising(n / 2).chain(rising(n / 2).rev()).collect::<Vec<_>>());
    });
}
