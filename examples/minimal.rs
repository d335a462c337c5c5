//! Direct light at one point: the light, a sampler, a material, and the rays to trace. What c-examples/minimal.c does.

use std::error::Error;
use wis::{Block, Config, Level, Map, Material, Point, Ray, Sampler, Sequence, Shape};

const WIDTH: u32 = 64;
const HEIGHT: u32 = 32;
const RAYS: usize = 4;
const HITS: u32 = 4096;

/// The renderer's own side: its map, its BSDF and its shadow rays.
fn radiance(_wi: [f32; 3]) -> f32 {
    1.0 // what main puts into every texel
}

fn bsdf_times_cosine(normal: [f32; 3], wi: [f32; 3]) -> f32 {
    let cosine = normal[0] * wi[0] + normal[1] * wi[1] + normal[2] * wi[2];
    if cosine > 0.0 { 0.8 / std::f32::consts::PI * cosine } else { 0.0 }
}

/// A wall hides the half of the sky with x < 0.
fn occluded(wi: [f32; 3]) -> bool {
    wi[0] < 0.0
}

fn main() -> Result<(), Box<dyn Error>> {
    // 1. The light, once: built in your memory from your map, then shared by all threads.
    let pixels = vec![1.0; (WIDTH * HEIGHT) as usize];
    let map = Map::latlong(WIDTH, HEIGHT, 1, &pixels);
    let size = map.size()?;
    let mut memory = vec![Block::ZERO; Block::count(size.bytes)];
    let mut scratch = vec![Block::ZERO; Block::count(size.scratch)];
    let environment = map.build_in(&mut memory, &mut scratch)?;
    drop(scratch);

    // 2. A sampler for each thread.
    let config = Config::for_rays(RAYS as u32);
    let mut memory = vec![Block::ZERO; Block::count(config.bytes())];
    let mut sampler =
        Sampler::new(Level::detect(), config, Block::bytes_mut(&mut memory)).ok_or("too little memory")?;

    // 3. A material: the shapes of its lobes.
    let material = Material::new(&[Shape::LAMBERT])?;

    // 4. A hit: normal, view, and how strongly each lobe reflects there.
    let mut point = Point::new(&material, [0.0, 0.0, 1.0], [0.6, 0.0, 0.8]);
    point.weight[0] = [0.8; 3];

    // 5. The rays to trace, each with its weight. Here as for many hits of one pixel.
    let (mut sum, mut rays) = (0.0, [Ray::default(); RAYS]);
    sampler.begin_pixel();
    for sample in 0..HITS {
        let at = Sequence { seed: 7, sample, bounce: 0 };
        let count = sampler.direct(&environment, &point, at, RAYS, &mut rays).map_err(|fault| format!("{fault:?}"))?;
        for ray in rays.iter().take(count).filter(|ray| !occluded(ray.wi)) {
            sum += f64::from(bsdf_times_cosine(point.normal, ray.wi) * radiance(ray.wi) * ray.weight);
        }
    }
    println!("reflected light: {:.3} (exactly 0.400)", sum / f64::from(HITS));
    Ok(())
}
