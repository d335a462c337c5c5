//! Measured BRDFs as tables with holes: entries of 0 among others.

use super::bounds::{self, Fault, Figures, Job, LARGEST, Limits, MISSED, Task, wide};
use super::brdf::{Hit, Lobe, V3, single};
use super::maps::{Image, sky};
use super::quadrature::Peak;
use super::scenes::{IDLE, NORMAL};
use crate::client::raw;
use crate::environment::{self, material};
use std::f64::consts::{FRAC_PI_2, TAU};

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
}

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
    let environment = environment::Environment::new(&image.map())?;
    let mean = environment.info.mean;
    let brings = |wi: V3| client.f_cos(wi) * radiance(&image, mean / 65536.0, wi) / mean;
    let task = Task::new(&brings, vec![Peak { at: client.hit.peak(), detail: 0.3 }], 1e-3, fault);
    let shapes: Vec<raw::wis_lobe> = client.hit.lobes.iter().map(Lobe::shape).collect();
    let material = material(&shapes)?;
    let point = client.hit.point(&material);
    // The lobes do not know the holes: what they state is larger, and what they choose brings nothing at times.
    let idle = if is_target { IDLE } else { 0.6 };
    let limits = Limits { integral: 1.0, empty: 0.6, idle, weights: LARGEST, missed: MISSED };
    let mut own = |wi: &[[f32; 3]], f_cos: &mut [f32]| {
        wi.iter().zip(f_cos).for_each(|(wi, f_cos)| *f_cos = client.f_cos(wide(*wi)) as f32);
        true
    };
    let rays = bounds::rays(&environment, &point, if is_target { Some(&mut own) } else { None }, &task, &limits)?;
    if is_target {
        return Ok(Figures { rays: Some(rays), ..Figures::default() });
    }
    Ok(Figures { rays: Some(rays), ..bounds::product(&environment, &point, &task, &limits)? })
}

fn radiance(image: &Image, least: f64, wi: V3) -> f64 {
    image.radiance(true, false, least, single(wi))
}
