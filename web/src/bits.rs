//! Twenty rays whose bits are those of the C library: what python/tests/twenty.c prints first.

use alloc::vec;
use alloc::vec::Vec;
use wis::{Block, Config, Level, Map, Material, Point, Ray, Sampler, Sequence, Shape};

const WIDTH: u32 = 64;
const HEIGHT: u32 = 32;
const CALLS: usize = 5;
const RAYS: usize = 4;

/// RGB texels in no order, and a lamp.
fn texels() -> Vec<f32> {
    let value = |i: u32| {
        let (x, y, c) = (i / 3 % WIDTH, i / 3 / WIDTH, i % 3);
        ((7 * x + 13 * y + 5 * c) % 32 + if (x, y) == (20, 9) { 4096 } else { 1 }) as f32 / 32.0
    };
    (0..3 * WIDTH * HEIGHT).map(value).collect()
}

/// Rays of five points; none where a call failed.
pub fn twenty_rays() -> [[f32; 4]; CALLS * RAYS] {
    let mut out = [[0.0; 4]; CALLS * RAYS];
    let pixels = texels();
    let map = Map::latlong(WIDTH, HEIGHT, 3, &pixels);
    let Ok(size) = map.size() else { return out };
    let mut memory = vec![Block::ZERO; Block::count(size.bytes)];
    let mut scratch = vec![Block::ZERO; Block::count(size.scratch)];
    let Ok(environment) = map.build_in(&mut memory, &mut scratch) else { return out };
    let config = Config::for_rays(RAYS as u32);
    let mut memory = vec![Block::ZERO; Block::count(config.bytes())];
    let Some(mut sampler) = Sampler::new(Level::detect(), config, Block::bytes_mut(&mut memory)) else { return out };
    let material = Material::new(&[Shape::LAMBERT, Shape::ggx(0.25, 0.25)]).unwrap_or(Material::NONE);
    for (call, out) in out.chunks_mut(RAYS).enumerate() {
        let wo = if call % 2 == 0 { [0.6, 0.0, 0.8] } else { [0.0, 0.6, 0.8] };
        let mut point = Point::new(&material, [0.0, 0.0, 1.0], wo);
        (point.weight[0], point.f0[1]) = ([0.125 * (call + 1) as f32; 3], [0.0625; 3]);
        let (at, mut rays) = (Sequence { seed: call as u32, sample: 3, bounce: 0 }, [Ray::default(); RAYS]);
        let count = sampler.direct(&environment, &point, at, RAYS, &mut rays).unwrap_or(0);
        for (out, Ray { wi: [x, y, z], weight }) in out.iter_mut().zip(&rays).take(count) {
            *out = [*x, *y, *z, *weight];
        }
    }
    out
}
