//! A small path tracer under a map of two parts: BSDF rays bring the map up to its mean, the rays of `direct` bring the rest.
//! What c-examples/pathtracer/small.c does, number for number.

use std::error::Error;
use std::f32::consts::PI;
use wis::light::environment::Environment;
use wis::light::plan::Filter;
use wis::{Block, Config, Level, Map, Material, Point, Ray, Sampler, Sequence, Shape};

const WIDTH: usize = 64;
const HEIGHT: usize = 32;
const DEPTH: u32 = 3;
const SAMPLES: u32 = 64;
const CENTRE: V3 = [0.0, 0.0, 0.5];

type V3 = [f32; 3];

fn dot(a: V3, b: V3) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn scale(a: V3, s: f32) -> V3 {
    a.map(|x| x * s)
}

/// a + s b
fn axpy(a: V3, s: f32, b: V3) -> V3 {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

fn sub(a: V3, b: V3) -> V3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: V3, b: V3) -> V3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn normalise(a: V3) -> V3 {
    scale(a, 1.0 / dot(a, a).sqrt())
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / 16_777_216.0
    }
}

/// A floor z = 0 and a sphere upon it: the distance and the normal.
fn trace(o: V3, d: V3) -> Option<(f32, V3)> {
    let to = sub(CENTRE, o);
    let along = dot(to, d);
    let square = along * along - dot(to, to) + 0.25;
    let mut hit = None;
    if square > 0.0 && along - square.sqrt() > 1e-3 {
        let distance = along - square.sqrt();
        hit = Some((distance, normalise(sub(scale(d, distance), to))));
    }
    let floor = -o[2] / d[2];
    if floor > 1e-3 && hit.is_none_or(|(nearest, _)| floor < nearest) {
        hit = Some((floor, [0.0, 0.0, 1.0]));
    }
    hit
}

struct Tracer<'a> {
    map: &'a [f32],
    mean: f32,
    environment: Environment<'a>,
    sampler: Sampler<'a>,
    material: Material,
    random: Random,
}

impl Tracer<'_> {
    /// The nearest texel.
    fn radiance(&self, wi: V3) -> f32 {
        let turn = wi[1].atan2(wi[0]) / (2.0 * PI);
        let polar = wi[2].clamp(-1.0, 1.0).acos() / PI;
        let x = ((if turn < 0.0 { turn + 1.0 } else { turn }) * WIDTH as f32) as usize;
        let y = (polar * HEIGHT as f32) as usize;
        self.map[y.min(HEIGHT - 1) * WIDTH + x.min(WIDTH - 1)]
    }

    /// The share of the map that BSDF rays bring.
    fn base(&self, light: f32) -> f32 {
        (self.mean / light).min(1.0)
    }

    fn path(&mut self, seed: u32, sample: u32, mut o: V3, mut d: V3) -> f32 {
        let (mut color, mut beta) = (0.0, 1.0);
        for bounce in 0.. {
            let Some((distance, normal)) = trace(o, d) else {
                let light = self.radiance(d);
                return color + beta * light * if bounce == 0 { 1.0 } else { self.base(light) };
            };
            if bounce == DEPTH {
                break;
            }
            o = axpy(o, distance, d);
            let mut point = Point { compensated: true, ..Point::new(&self.material, normal, scale(d, -1.0)) };
            point.weight[0] = [0.6; 3];
            let (at, mut rays) = (Sequence { seed, sample, bounce }, [Ray::default()]);
            let count = self.sampler.direct(&self.environment, &point, at, 1, &mut rays).unwrap_or(0);
            for ray in rays.iter().take(count) {
                let (light, cosine) = (self.radiance(ray.wi), dot(normal, ray.wi));
                if cosine > 0.0 && trace(o, ray.wi).is_none() {
                    color += beta * (0.6 / PI) * cosine * light * (1.0 - self.base(light)) * ray.weight;
                }
            }
            beta *= 0.6;
            let phi = 2.0 * PI * self.random.uniform();
            let r = self.random.uniform();
            let tangent =
                normalise(cross(if normal[0].abs() < 0.7 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] }, normal));
            d = axpy(scale(tangent, r.sqrt() * phi.cos()), r.sqrt() * phi.sin(), cross(normal, tangent));
            d = normalise(axpy(d, (1.0 - r).sqrt(), normal));
        }
        color
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let lamp = |x: usize, y: usize| (20..24).contains(&x) && (6..9).contains(&y);
    let texel = |i: usize| {
        let (x, y) = (i % WIDTH, i / WIDTH);
        if lamp(x, y) { 40.0 } else { 0.25 + 0.015_625 * y as f32 }
    };
    let pixels: Vec<f32> = (0..WIDTH * HEIGHT).map(texel).collect();
    let map = Map { filter: Filter::Nearest, ..Map::latlong(WIDTH as u32, HEIGHT as u32, 1, &pixels) };
    let size = map.size()?;
    let mut memory = vec![Block::ZERO; Block::count(size.bytes)];
    let mut scratch = vec![Block::ZERO; Block::count(size.scratch)];
    let environment = map.build_in(&mut memory, &mut scratch)?;
    let config = Config::for_rays(1);
    let mut memory = vec![Block::ZERO; Block::count(config.bytes())];
    let sampler = Sampler::new(Level::detect(), config, Block::bytes_mut(&mut memory)).ok_or("too little memory")?;
    let (mean, material) = (environment.header().mean as f32, Material::new(&[Shape::LAMBERT])?);
    let mut tracer = Tracer { map: &pixels, mean, environment, sampler, material, random: Random(0) };
    for pixel in 0..32u32 {
        tracer.random = Random(pixel.into());
        tracer.sampler.begin_pixel();
        let mut sum = 0.0;
        for sample in 0..SAMPLES {
            let x = ((pixel % 8) as f32 + tracer.random.uniform() - 4.0) / 4.0;
            let z = (2.0 - (pixel / 8) as f32) / 4.0 - tracer.random.uniform() / 4.0;
            sum += f64::from(tracer.path(pixel, sample, [0.0, -3.0, 1.0], normalise([x, 2.0, z - 0.4])));
        }
        print!("{:.4}{}", sum / f64::from(SAMPLES), if pixel % 8 == 7 { '\n' } else { ' ' });
    }
    Ok(())
}
