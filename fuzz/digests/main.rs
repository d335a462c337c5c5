//! Digests of what the renderer's calls answer: the same on every platform, at every level of optimisation and of instructions.
//! They are on record in record.txt. A test compares them here, and `scripts/check-bits.sh` elsewhere.

use std::error::Error;
use wis::numeric::ContentHash;
use wis::points::{hammersley, pixel_seed, sobol};
use wis::product::prepare::{Config as ProductConfig, Task};
use wis::product::stored::{MAX_DIVIDED, most_bytes};
use wis::{
    Block, Config, Environment, Filter, Layout, Level, Map, Material, Point, Ray, Sample, Sampler, Sequence, Shape,
    Status,
};

const RAYS: usize = 16;

fn words(hash: &mut ContentHash, bytes: &[u8]) {
    let mut words =
        bytes.chunks(8).map(|chunk| chunk.iter().rev().fold(0u64, |word, byte| word << 8 | u64::from(*byte)));
    words.by_ref().for_each(|word| hash.add(word));
}

/// Texels made by sums and products alone: the mathematical functions of a platform are not the library's.
fn texels(count: u32) -> Vec<f32> {
    let bright = |i: u32| if i % 211 == 7 { 700.0 } else { 0.0 };
    (0..count).map(|i| 0.1 + (i * 7 % 17) as f32 * 0.3 + bright(i)).collect()
}

fn unit(i: u32) -> [f32; 3] {
    let [x, y] = sobol(9, i).map(|u| 2.0 * u - 1.0);
    let z = 0.25 + sobol(10, i)[0];
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, y / length, z / length]
}

fn materials() -> Result<Vec<Material>, Box<dyn Error>> {
    let glass = Shape::ggx(0.1, 0.1);
    let lobes: [&[Shape]; 5] = [
        &[Shape::LAMBERT],
        &[Shape::ggx(0.3, 0.3)],
        &[Shape::LAMBERT, Shape::ggx(0.05, 0.2)],
        &[glass, Shape::LAMBERT, Shape::ggx(0.5, 0.5), Shape::ggx(0.02, 0.02)],
        &[],
    ];
    Ok(lobes.into_iter().map(Material::new).collect::<Result<_, _>>()?)
}

/// Samples of the light, their densities and the numbers that lead to them.
fn of_light(sampler: &Sampler, light: &Environment) -> Result<u64, Status> {
    let mut hash = ContentHash::new();
    let u: Vec<[f32; 2]> = (0..500).map(|i| sobol(3, i)).collect();
    let (mut drawn, mut pdf) = (vec![Sample::default(); u.len()], vec![0.0; u.len()]);
    sampler.sample(light, &u, &mut drawn)?;
    let wi: Vec<[f32; 3]> = drawn.iter().map(|drawn| drawn.wi).collect();
    sampler.pdf(light, &wi, &mut pdf)?;
    for ((drawn, wi), pdf) in drawn.iter().zip(&wi).zip(pdf) {
        hash.add_floats(&[wi[0], wi[1], wi[2], drawn.pdf, pdf]);
        hash.add_floats(&sampler.invert(light, *wi).unwrap_or([-1.0; 2]));
    }
    Ok(hash.finish())
}

/// Rays of hits, and products.
fn of_hits(sampler: &mut Sampler, light: &Environment, material: &Material) -> Result<[u64; 2], Box<dyn Error>> {
    let (mut rays, mut products) = (ContentHash::new(), ContentHash::new());
    for hit in 0..40 {
        let mut point = Point::new(material, unit(2 * hit), unit(2 * hit + 1));
        (point.weight, point.f0) = ([[0.5, 0.25, 0.125]; 4], [[0.04, 0.5, 0.9]; 4]);
        (point.tangent, point.compensated) = ([0.0, 1.0, 0.0], light.is_compensated());
        let at = Sequence { seed: pixel_seed(hit / 4, 3, 1), sample: hit % 4, bounce: hit % 2 };
        let (count, mut out) = ([1, 4, RAYS][hit as usize % 3], [Ray::default(); RAYS]);
        sampler.begin_pixel();
        let count = sampler.direct(light, &point, at, count, &mut out).map_err(|fault| format!("{fault:?}"))?;
        out.iter().take(count).for_each(|ray| rays.add_floats(&[ray.wi[0], ray.wi[1], ray.wi[2], ray.weight]));
        let mut memory = vec![Block::ZERO; Block::count(most_bytes(MAX_DIVIDED))];
        let memory = Block::bytes_mut(&mut memory);
        let task =
            Task { level: sampler.level(), environment: light, point: &point, config: &ProductConfig::default() };
        let bytes = task.prepare(None, memory).map_err(|fault| format!("{fault:?}"))?;
        words(&mut products, &memory[..bytes]);
    }
    Ok([rays.finish(), products.finish()])
}

fn digests(level: Level) -> Result<Vec<(String, u64)>, Box<dyn Error>> {
    let mut all = Vec::new();
    let config = Config::for_rays(RAYS as u32);
    let mut memory = vec![Block::ZERO; Block::count(config.bytes())];
    let mut sampler = Sampler::new(level, config, Block::bytes_mut(&mut memory)).ok_or("too little memory")?;
    for (layout, width, height) in [(Layout::LatLong, 96, 48), (Layout::Cube, 24, 144), (Layout::Octahedral, 50, 50)] {
        let pixels = texels(3 * width * height);
        for (filter, error_budget, compensated) in
            [(Filter::Bilinear, 0.0, false), (Filter::Nearest, 0.0, true), (Filter::Bilinear, 0.05, false)]
        {
            let world_from_map = [0.6, -0.8, 0.0, 0.8, 0.6, 0.0, 0.0, 0.0, 1.0];
            let map = Map {
                layout,
                filter,
                error_budget,
                compensated,
                world_from_map,
                ..Map::latlong(width, height, 3, &pixels)
            };
            let size = map.size()?;
            let mut memory = vec![Block::ZERO; Block::count(size.bytes)];
            let mut scratch = vec![Block::ZERO; Block::count(size.scratch)];
            let light = map.build_in(&mut memory, &mut scratch).map_err(|fault| format!("{fault:?}"))?;
            let name = format!("{layout:?} {filter:?} {error_budget}");
            let mut hash = ContentHash::new();
            words(&mut hash, light.as_bytes());
            all.push((format!("{name} environment"), hash.finish()));
            all.push((format!("{name} samples"), of_light(&sampler, &light)?));
            for (number, material) in materials()?.iter().enumerate() {
                let [rays, products] = of_hits(&mut sampler, &light, material)?;
                all.push((format!("{name} material {number} rays"), rays));
                all.push((format!("{name} material {number} products"), products));
            }
        }
    }
    let mut points = ContentHash::new();
    (0..1000).for_each(|i| points.add_floats(&[sobol(5, i), hammersley(i, 1000)].concat()));
    all.push(("points".into(), points.finish()));
    Ok(all)
}

fn main() -> Result<(), Box<dyn Error>> {
    let found = digests(Level::detect())?;
    for ((name, digest), (_, other)) in found.iter().zip(digests(Level::BASELINE)?) {
        if *digest != other {
            return Err(format!("{name}: {digest:016x} became {other:016x} with the baseline's instructions").into());
        }
        println!("{digest:016x} {name}");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    /// After a change of bits on purpose the record becomes what this program prints.
    #[test]
    fn digests_are_on_record() {
        let found = super::digests(wis::Level::detect()).expect("all is valid");
        let found: Vec<String> = found.iter().map(|(name, digest)| format!("{digest:016x} {name}")).collect();
        let changed: Vec<_> =
            include_str!("record.txt").lines().zip(&found).filter(|(record, found)| record != found).collect();
        assert!(changed.is_empty(), "{} of {}, first {:?}", changed.len(), found.len(), changed[0]);
        assert_eq!(include_str!("record.txt").lines().count(), found.len());
    }
}
