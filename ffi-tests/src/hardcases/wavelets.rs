//! Products of the wavelet header where lobes are anisotropic, grazing, or meet a sun.

use super::bounds::{self, Fault, Figures, Job, LARGEST, Limits, Task, Weights};
use super::brdf::{Hit, Lobe, V3, single};
use super::maps::{Image, sky};
use super::quadrature::Peak;
use super::scenes::{IDLE, NORMAL, sun};
use crate::client::{self, Preparation, Product, raw};

/// Limits of a row under one light.
type Bounds = (f64, Weights, f64);

/// Alphas, view, and the limits under a smooth sky and under a sun: of the stated integral, of weights, and of the fault of the
/// mean that may be missed. Rule 33 of docs/design.md bounds weights for half-angles from 0.1 on here. For narrower lobes the share
/// of the integral that comes with large weights is bounded: the figures when the row was written, and a quarter of them at least.
const ROWS: [([f64; 2], f64, [Bounds; 2]); 7] = [
    ([1.0, 1.0], 45.0, [(0.05, MOST, 0.02), (0.01, MOST, 0.02)]),
    ([0.1, 0.1], 45.0, [(0.02, MOST, 0.02), (0.25, MOST, 0.02)]),
    ([0.1, 0.1], 85.0, [(0.04, MOST, 0.02), (0.25, MOST, 0.02)]),
    ([0.3, 0.05], 45.0, [(0.02, MOST, 0.02), (0.25, MOST, 0.02)]),
    ([0.3, 0.05], 85.0, [(0.05, MOST, 0.02), (0.2, MOST, 0.02)]),
    ([0.5, 0.02], 45.0, [(0.7, Weights::Heavy(0.16), 0.03), (0.4, MOST, 0.02)]),
    ([0.5, 0.02], 85.0, [(0.75, Weights::Heavy(0.6), 0.06), (1.2, Weights::Heavy(0.06), 0.03)]),
];

const MOST: Weights = Weights::Largest(LARGEST);

/// Adds the rows.
pub fn add(jobs: &mut Vec<Job>) {
    for ([a, b], degrees, limits) in ROWS {
        let hit = Hit::new(&[Lobe::Ggx([a, b], 0.9)], NORMAL, degrees, 0.7);
        let lights = [("smooth sky", sky()), ("a sun of 1e8 in its mirror direction", sun(hit.peak()))];
        for ((light, image), (integral, weights, missed)) in lights.into_iter().zip(limits) {
            let name = format!("wavelets: GGX {a} x {b}, view at {degrees} degrees, {light}");
            let (hit, limits) = (hit.clone(), Limits { integral, empty: 0.3, idle: IDLE, weights, missed });
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_in_the_density_is_noticed_where_weights_are_large() {
        let ([a, b], degrees, [(integral, weights, missed), _]) = ROWS[ROWS.len() - 1];
        let hit = Hit::new(&[Lobe::Ggx([a, b], 0.9)], NORMAL, degrees, 0.7);
        let limits = Limits { integral, empty: 0.3, idle: IDLE, weights, missed };
        assert_eq!(measure(&hit, &sky(), &limits, Fault::None).err(), None);
        let answer = measure(&hit, &sky(), &limits, Fault::Hole).err().unwrap_or_default();
        assert!(answer.contains("weights above"), "{answer:?}");
    }
}
