//! Measured BRDFs as tables with holes: entries of 0 among others, and slices that were never built.

use super::bounds::{self, Fault, Figures, Job, LARGEST, Limits, MISSED, Task, Weights, wide};
use super::brdf::{Hit, Lobe, V3, single};
use super::maps::{Image, sky};
use super::quadrature::Peak;
use super::scenes::{IDLE, NORMAL};
use crate::client::{self, Block, Preparation, Product, Texels, Tree, raw};
use crate::environment::{self, Light, Map, Sampler, material};
use std::cell::RefCell;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::ptr::null;

const SLICES: u32 = 8;
const DEPTH: u32 = 5;
/// Directions of a client's table, by polar angle and azimuth of wi.
const ROWS: usize = 12;
const COLUMNS: usize = 24;

/// Whether an entry was never measured: four of ten, scattered.
fn is_hole(entry: u32) -> bool {
    entry.wrapping_mul(0x9e37_79b9) >> 16 & 0xff < 102
}

/// Adds the rows.
pub fn add(jobs: &mut Vec<Job>) {
    for degrees in [45.0, 85.0] {
        let table = format!("table with holes, view at {degrees} degrees, smooth sky");
        let stand_in = format!("{table}, for which Lambert and GGX 0.3 stand");
        jobs.push(Job::new(stand_in, move || by_lobes(degrees, false, Fault::None)));
        jobs.push(Job::new(format!("{table}, handed over as `target`"), move || by_lobes(degrees, true, Fault::None)));
    }
    for Sliced { degrees, missing, what, limits } in SLICED {
        let name = format!("`wis_wavelet_table` with holes, view at {degrees} degrees, {what}smooth sky");
        jobs.push(Job::new(name, move || by_slices(degrees, missing, limits, Fault::None)));
    }
}

/// A case of the library's own table.
struct Sliced {
    degrees: f64,
    missing: &'static [u32],
    what: &'static str,
    /// Of the stated integral, and of what comes with large weights: the figures when the row was written, and a quarter of them.
    limits: [f64; 2],
}

const SLICED: [Sliced; 3] = [
    Sliced { degrees: 45.0, missing: &[], what: "", limits: [0.15, 0.01] },
    Sliced { degrees: 85.0, missing: &[], what: "", limits: [0.25, 0.006] },
    Sliced { degrees: 45.0, missing: &[3], what: "one of its two slices missing, ", limits: [0.15, 0.02] },
];

/// A client's own table beside lobes that resemble it.
struct Client {
    hit: Hit,
    entries: Vec<f64>,
}

impl Client {
    fn new(degrees: f64) -> Client {
        let hit = Hit::new(&[Lobe::Lambert(0.4), Lobe::Ggx([0.3; 2], 0.5)], NORMAL, degrees, 0.7);
        let entry = |k: usize| {
            let (theta, phi) = ((k / COLUMNS) as f64 / (ROWS - 1) as f64 * FRAC_PI_2, (k % COLUMNS) as f64);
            let ((sine, cosine), (y, x)) = (theta.sin_cos(), (TAU * phi / COLUMNS as f64).sin_cos());
            let value = hit.f_cos(hit.world([sine * x, sine * y, cosine.max(1e-3)])) / cosine.max(1e-3);
            if is_hole(k as u32) { 0.0 } else { value }
        };
        let entries = (0..ROWS * COLUMNS).map(entry).collect();
        Client { hit, entries }
    }

    /// The nearest entry.
    fn f_cos(&self, wi: V3) -> f64 {
        let [x, y, z] = self.hit.local(wi);
        if z <= 0.0 {
            return 0.0;
        }
        let row = (z.min(1.0).acos() / FRAC_PI_2 * (ROWS - 1) as f64).round() as usize;
        let column = (y.atan2(x).rem_euclid(TAU) / TAU * COLUMNS as f64).round() as usize;
        self.entries[row * COLUMNS + column % COLUMNS] * z
    }
}

fn by_lobes(degrees: f64, is_target: bool, fault: Fault) -> Result<Figures, String> {
    let (image, client) = (sky(), Client::new(degrees));
    let map = Map::latlong(image.width, image.height, 1, Texels::F32(&image.texels));
    let environment = environment::Environment::new(&map)?;
    let mean = environment.info.mean;
    let brings = |wi: V3| client.f_cos(wi) * radiance(&image, mean / 65536.0, wi) / mean;
    let task = Task::new(&brings, vec![Peak { at: client.hit.peak(), detail: 0.3 }], 1e-3, fault);
    let shapes: Vec<raw::wis_lobe> = client.hit.lobes.iter().map(Lobe::shape).collect();
    let material = material(&shapes)?;
    let point = client.hit.point(&material);
    // The lobes do not know the holes: what they state is larger, and what they choose brings nothing at times.
    let idle = if is_target { IDLE } else { 0.6 };
    let limits = Limits { integral: 1.0, empty: 0.6, idle, weights: Weights::Largest(LARGEST), missed: MISSED };
    let mut own = |wi: &[[f32; 3]], f_cos: &mut [f32]| {
        wi.iter().zip(f_cos).for_each(|(wi, f_cos)| *f_cos = client.f_cos(wide(*wi)) as f32);
        true
    };
    let rays = bounds::rays(&environment, &point, if is_target { Some(&mut own) } else { None }, &task, &limits)?;
    if is_target {
        return Ok(Figures { rays: Some(rays), ..Figures::default() });
    }
    let (own, other) = (RefCell::new(Sampler::new(1, 0, 0)?), RefCell::new(Sampler::new(1, 0, 0)?));
    let mut memory = Block::new(0);
    let product = Light::product(&environment, &own, &point, &mut memory)?;
    let stored = product.describe()?.integral / mean;
    let figures = bounds::density(&product, &Light::new(&environment, &other), stored, &task, &limits)?;
    Ok(Figures { rays: Some(rays), ..figures })
}

fn radiance(image: &Image, least: f64, wi: V3) -> f64 {
    image.radiance(true, false, least, single(wi))
}

/// A table of the library's, whose slices are trees with pixels of 0, evaluated by the library.
fn by_slices(degrees: f64, missing: &[u32], [integral, heavy]: [f64; 2], fault: Fault) -> Result<Figures, String> {
    let tree = |slice: u32| -> Result<Tree, String> {
        let (wo, wi) = client::table_directions(slice, SLICES, DEPTH, [0.5; 2])?;
        let angle = f64::from(wo[2]).acos().to_degrees();
        let hit = Hit::new(&[Lobe::Lambert(0.4), Lobe::Ggx([0.3; 2], 0.5)], [0.0, 0.0, 1.0], angle, 0.0);
        let hole = |pixel: u32| is_hole(pixel / 2 + slice);
        let pixel = |(k, wi): (u32, &[f32; 3])| if hole(k) { 0.0 } else { hit.f_cos(hit.world(wide(*wi))) as f32 };
        Ok(Tree::new(DEPTH, 0.0, &(0..).zip(&wi).map(pixel).collect::<Vec<_>>())?)
    };
    let trees: Vec<Tree> = (0..SLICES).map(tree).collect::<Result<_, _>>()?;
    let handle = |k: u32| if missing.contains(&k) { null() } else { trees[k as usize].handle() };
    let slice: Vec<*const raw::wis_tree> = (0..SLICES).map(handle).collect();
    let table = raw::wis_wavelet_table {
        size: size_of::<raw::wis_wavelet_table>() as u32,
        slice_count: SLICES,
        slice: slice.as_ptr(),
        colour: [null(); 3],
    };
    let hit = Hit::new(&[Lobe::Lambert(1.0)], NORMAL, degrees, 0.7);
    let point = hit.point(&raw::wis_material::default());
    let query = client::query(point.normal, point.wo, &[client::tabulated([1.0; 3])]);
    let image = sky();
    let environment = client::Environment::new(&image.map())?;
    let mean = environment.info.power / (4.0 * std::f64::consts::PI);
    let brings = |wi: V3| {
        let mut f_cos = [[0.0; 3]];
        let answered = client::table_eval(&table, &query, &[single(wi)], &mut f_cos);
        answered.map_or(f64::NAN, |()| f64::from(f_cos[0][1]) * radiance(&image, 0.0, wi) / mean)
    };
    let task = Task::new(&brings, vec![Peak { at: hit.peak(), detail: 0.1 }], 1e-3, fault);
    let limits = Limits { integral, empty: 0.5, idle: IDLE, weights: Weights::Heavy(heavy), missed: 0.04 };
    let preparation = Preparation::default();
    let mut memory = preparation.memory()?;
    let product = Product::prepare_table(&environment, &table, &query, &preparation, &mut memory)?;
    let stored = product.estimate()? / mean;
    bounds::density(&product, &environment.light(None), stored, &task, &limits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_in_the_density_of_a_table_is_noticed() {
        for Sliced { degrees, missing, limits, .. } in SLICED {
            assert_eq!(by_slices(degrees, missing, limits, Fault::None).err(), None);
            let answer = by_slices(degrees, missing, limits, Fault::Hole).err().unwrap_or_default();
            assert!(answer.contains("weights above"), "{answer:?}");
        }
    }
}
