//! Every estimator is unbiased: z-tests of estimates of 1 and 4 samples against quadrature, with and without an
//! occluder, Holm-corrected to a significance of 0.001 for all of them together. Each single test finds a shift of 2 %
//! with power .99, which is asserted, and a density that is 2 % too large is shown to be found.

use crate::estimator::Estimator;
use crate::library::Mode;
use crate::light::Light;
use crate::material::{Bsdf, Material};
use crate::method::Method;
use crate::portal::{Portal, Room};
use crate::scene::ShadingPoint;
use crate::setting::{Lit, Setting};
use crate::statistics::{holm, smallest_fault, z_test};
use glam::{Quat, Vec3};

const SIGNIFICANCE: f64 = 1e-3;
/// The strictest level that Holm's method applies: at most 24 methods of 2 counts, and one more, 2 materials, with and without
/// occluder.
const EACH: f64 = SIGNIFICANCE / 196.0;
/// Samples, and how many estimates of them.
const SAMPLES: [(usize, u32); 2] = [(1, 240_000), (4, 60_000)];

/// An occluder whose edge lies between texels.
fn open(wi: Vec3) -> bool {
    wi.y > 0.0 || wi.x > 0.0
}

fn point() -> ShadingPoint {
    let normal = Vec3::new(0.3, 0.2, 0.93).normalize();
    ShadingPoint { pixel: [5, 9], hit: 0, origin: Vec3::ZERO, normal, wo: Vec3::new(-0.5, 0.3, 0.8).normalize() }
}

/// Smooth sky, bright patch, dark ground: a map on which every technique has a moderate variance.
fn light() -> Light {
    let (width, height) = (32, 16);
    let texel = |i: usize| {
        let (x, y) = (i % width, i / width);
        let patch = if (3..6).contains(&y) && (20..24).contains(&x) { 2.0 } else { 0.0 };
        0.5 + 0.3 * (x as f32 * 0.4).sin() + patch + if y > 10 { 0.0 } else { 0.4 }
    };
    Light::latlong("test", width, height, (0..width * height).map(texel).collect())
}

/// The integral of f L cos without and with the occluder.
fn integrals(light: &Light, bsdf: &Bsdf) -> [f64; 2] {
    light.quadrature(48).fold([0.0; 2], |sum, (wi, area)| {
        let value = f64::from(bsdf.eval_one(wi).0 * light.radiance(wi)) * area;
        [sum[0] + value, sum[1] + if open(wi) { value } else { 0.0 }]
    })
}

/// Estimates without and with the occluder.
fn estimates(setting: &Setting, method: Method, samples: usize, count: u32) -> [Vec<f64>; 2] {
    let mut estimator = Estimator::new(setting, 1).unwrap();
    let mut all = [Vec::new(), Vec::new()];
    for pass in 0..count {
        let picks = estimator.picks(method, setting, &point(), pass, samples).unwrap();
        let sum = |keep: fn(Vec3) -> bool| picks.iter().filter(|p| keep(p.wi)).map(|p| f64::from(p.contribution)).sum();
        all[0].push(sum(|_| true));
        all[1].push(sum(open));
    }
    all
}

/// The hits of a pixel share products where their normals allow.
#[test]
fn hits_that_share_products_are_unbiased() {
    const PASSES: u32 = 20_000;
    let (light, first) = (light(), point());
    let lit = Lit::new(&light).unwrap();
    // Six groups of three normals, each within the cone of its first.
    let axis = first.normal.cross(first.wo).normalize();
    let turned = |hit: u32| {
        let angle = 0.25 * (hit % 6) as f32 + 0.02 * (hit / 6) as f32;
        ShadingPoint { hit, normal: Quat::from_axis_angle(axis, angle) * first.normal, ..first }
    };
    let hits: Vec<ShadingPoint> = (0..18).map(turned).collect();
    let materials = [Material::lambert(), Material::mix(0.4)];
    let mode = Mode::Shared;
    for material in &materials {
        let setting = Setting::new(&lit, material);
        let integral = |hit: &ShadingPoint| integrals(&light, &Bsdf::new(material, hit))[0];
        let expected = hits.iter().map(integral).sum::<f64>();
        let mut estimator = Estimator::new(&setting, hits.len()).unwrap();
        let mut estimate = |pass: u32| {
            let of_hit = |hit: &ShadingPoint| -> f64 {
                let picks = estimator.picks(mode, &setting, hit, pass, 1).unwrap();
                picks.iter().map(|pick| f64::from(pick.contribution)).sum()
            };
            hits.iter().map(of_hit).sum()
        };
        let values: Vec<f64> = (0..PASSES).map(&mut estimate).collect();
        let (p, fault) = (z_test(&values, expected), smallest_fault(&values, expected, SIGNIFICANCE / 2.0));
        let name = format!("{}, {}", mode.name(), material.name);
        assert!(p > SIGNIFICANCE / 2.0, "{name}: {p}");
        assert!(fault <= 0.01, "{name}: only a shift of {fault} would be found");
    }
}

#[test]
fn every_method_meets_quadrature_and_a_density_two_percent_off_does_not() {
    let light = light();
    let lit = Lit::new(&light).unwrap();
    // Light comes from elsewhere, too.
    let portals = [
        Portal { corner: Vec3::new(-3.0, -2.0, 1.0), edges: [Vec3::Y * 5.0, Vec3::X * 6.0] },
        Portal { corner: Vec3::new(2.0, 0.3, 0.1), edges: [Vec3::Z * 0.8, Vec3::Y * 0.5] },
    ];
    let room = Room::new(&portals, false, &light);
    let (mut names, mut sound, mut faulty, mut faults) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let methods = Method::all().filter(|m| m.is_unbiased()).flat_map(|m| SAMPLES.map(|n| (m, n)));
    let methods: Vec<_> = methods.collect();
    for material in [Material::lambert(), Material::mix(0.4)] {
        let setting = Setting::new(&lit, &material).within(room.as_ref());
        let expected = integrals(&light, &Bsdf::new(&material, &point()));
        for &(method, (samples, count)) in &methods {
            let all = estimates(&setting, method, samples, count);
            for (values, expected) in all.iter().zip(expected) {
                names.push(format!("{}, {}, N = {samples}", method.name(), material.name));
                sound.push(z_test(values, expected));
                faulty.push(z_test(values, expected * 1.02));
                faults.push(smallest_fault(values, expected, EACH));
            }
        }
    }
    for (name, rejected) in names.iter().zip(holm(&sound, SIGNIFICANCE)) {
        assert!(!rejected, "{name}: biased");
    }
    for (name, fault) in names.iter().zip(&faults) {
        assert!(*fault <= 0.02, "{name}: only a shift of {fault} would be found");
    }
    for (name, rejected) in names.iter().zip(holm(&faulty, SIGNIFICANCE)) {
        assert!(rejected, "{name}: a density 2 % off is not found");
    }
}
