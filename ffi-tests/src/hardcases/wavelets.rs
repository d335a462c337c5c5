//! Products of the wavelet header where lobes are anisotropic, grazing, or meet a sun.

use super::bounds::{self, Fault, Figures, Job, Limits, Task};
use super::brdf::{Hit, Lobe, V3, single};
use super::maps::{Image, sky};
use super::quadrature::Peak;
use super::scenes::{IDLE, NORMAL, sun};
use crate::client::{self, Preparation, Product, raw};

/// Alphas, view, and the limits under a smooth sky and under a sun: of the stated integral, the largest weight, and the fault of the
/// mean that may be missed. Rule 33 of docs/design.md holds for half-angles from 0.1 on here; the others are the figures when
/// the row was written, and a quarter of them at least.
const ROWS: [([f64; 2], f64, [[f64; 3]; 2]); 7] = [
    ([1.0, 1.0], 45.0, [[0.05, 50.0, 0.02], [0.01, 50.0, 0.02]]),
    ([0.1, 0.1], 45.0, [[0.02, 50.0, 0.02], [0.2, 50.0, 0.02]]),
    ([0.1, 0.1], 85.0, [[0.04, 50.0, 0.02], [0.2, 50.0, 0.02]]),
    ([0.3, 0.05], 45.0, [[0.02, 50.0, 0.02], [0.2, 50.0, 0.02]]),
    ([0.3, 0.05], 85.0, [[0.05, 50.0, 0.02], [0.2, 50.0, 0.02]]),
    ([0.5, 0.02], 45.0, [[0.45, 500.0, 0.03], [0.3, 50.0, 0.02]]),
    ([0.5, 0.02], 85.0, [[0.75, 800.0, 0.06], [1.2, 800.0, 0.03]]),
];

/// Adds the rows.
pub fn add(jobs: &mut Vec<Job>) {
    for ([a, b], degrees, limits) in ROWS {
        let hit = Hit::new(&[Lobe::Ggx([a, b], 0.9)], NORMAL, degrees, 0.7);
        let lights = [("smooth sky", sky()), ("a sun of 1e8 in its mirror direction", sun(hit.peak()))];
        for ((light, image), [integral, largest, missed]) in lights.into_iter().zip(limits) {
            let name = format!("wavelets: GGX {a} x {b}, view at {degrees} degrees, {light}");
            let (hit, limits) = (hit.clone(), Limits { integral, empty: 0.3, idle: IDLE, largest, missed });
            jobs.push(Job::new(name, move || measure(&hit, &image, &limits, Fault::None)));
        }
    }
}

fn measure(hit: &Hit, image: &Image, limits: &Limits, fault: Fault) -> Result<Figures, String> {
    let point = hit.point(&raw::wis_material::default());
    let lobes: Vec<raw::wis_wavelet_lobe> = hit.lobes.iter().map(Lobe::wavelet).collect();
    let query = raw::wis_wavelet_query { tangent: point.tangent, ..client::query(point.normal, point.wo, &lobes) };
    let environment = client::Environment::new(&image.map())?;
    let mean = environment.info.power / (4.0 * std::f64::consts::PI);
    let brings = |wi: V3| {
        let f_cos = hit.f_cos(wi);
        if f_cos > 0.0 { f_cos * image.radiance(true, false, 0.0, single(wi)) / mean } else { 0.0 }
    };
    let task = Task::new(&brings, vec![Peak { at: hit.peak(), detail: hit.detail() }], 1e-4, fault);
    let preparation = Preparation::default();
    let mut memory = preparation.memory()?;
    let product = Product::prepare(&environment, &query, &preparation, &mut memory)?;
    let stored = product.estimate()? / mean;
    bounds::density(&product, &environment.light(None), stored, &task, limits)
}
