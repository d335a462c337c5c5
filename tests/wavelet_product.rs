//! Products: what lobes mean, budgets, callbacks, estimates, and what they gain over the light alone.

use crate::support::maps::{Filter, hdr_maps, photograph, sky, sun};
use crate::support::material::Material;
use crate::support::quadrature::Scene;
use crate::support::scenes::{grid, lobes, matrices, views};
use crate::support::statistics::Mean;
use crate::support::vector::{dot, luminance, single, unit};
use crate::support::*;
use std::ffi::{c_int, c_void};
use std::ptr::{null, null_mut};
use wis::ffi::MemorySize;
use wis::ffi::wavelets::environment::WIS_WAVELET_LIGHT_RGB;
use wis::ffi::wavelets::product::{CallbackBrdf, ProductConfig, wis_wavelet_product_prepare, wis_wavelet_product_size};
use wis::ffi::wavelets::sampling::wis_wavelet_pdf;
use wis::sphere::direction;
use wis::status::Status;
use wis::wavelets::query::{
    Lobe, Query, WIS_WAVELET_LOBE_PHONG, WIS_WAVELET_QUERY_COSINE_INCLUDED, WIS_WAVELET_QUERY_WHOLE_SPHERE,
};

/// Lobes of each kind, coloured, with the flags of a query.
fn materials() -> Vec<(Vec<Lobe>, u32)> {
    let brushed = Lobe { a: 0.4, b: 0.08, weight: [0.9, 0.8, 0.7], f0: [0.9, 0.5, 0.1], ..ggx(0.3) };
    let phong = |a| Lobe { kind: WIS_WAVELET_LOBE_PHONG, weight: [0.3, 0.6, 0.5], a, ..Lobe::default() };
    let diffuse = Lobe { weight: [0.8, 0.5, 0.2], ..lambert(0.0) };
    let single = lobes().into_iter().map(|(_, lobes)| (lobes, 0));
    let flags = [
        0,
        WIS_WAVELET_QUERY_WHOLE_SPHERE,
        WIS_WAVELET_QUERY_COSINE_INCLUDED,
        WIS_WAVELET_QUERY_WHOLE_SPHERE | WIS_WAVELET_QUERY_COSINE_INCLUDED,
    ];
    let all = vec![diffuse, brushed, phong(0.0), phong(40.0)];
    single.chain([(vec![brushed], 0), (vec![phong(300.0)], 0)]).chain(flags.map(|flags| (all.clone(), flags))).collect()
}

/// Lobes are those of the textbooks. Values are compared where f32 can tell directions apart: to 1e-3, plus what
/// one rounding of the directions changes.
#[test]
fn lobes_mean_what_the_textbooks_say() {
    let mut random = Random(101);
    for (lobes, flags) in materials() {
        for _ in 0..20_000 {
            let (normal, wo) = (unit(random.direction()), random.direction());
            let above = if flags & WIS_WAVELET_QUERY_WHOLE_SPHERE == 0 { dot(normal, wo).signum() } else { 1.0 };
            let tangent = single(random.direction());
            let wo = wo.map(|c| c * above);
            let query = Query { tangent, flags, ..query(single(normal), single(wo), &lobes) };
            let wi = single(random.direction());
            let material = Material::new(&query);
            let expected = material.f_cos(unit(wi.map(f64::from)));
            let moved = [0, 1, 2].map(|axis| {
                let mut near = wi.map(f64::from);
                near[axis] += 2e-7;
                material.f_cos(unit(near))
            });
            for (c, value) in eval(&query, wi).into_iter().enumerate() {
                let rounding: f64 = moved.iter().map(|near| (near[c] - expected[c]).abs()).sum();
                let off = (f64::from(value) - expected[c]).abs();
                assert!(off <= 1e-3 * expected[c] + 4.0 * rounding + 1e-7, "{query:?} {wi:?}: {value} {}", expected[c]);
            }
        }
    }
}

/// Products keep to their budgets, and the smallest is still a density.
#[test]
fn budgets_are_kept() {
    let environment = sun(256, 128).build(0, 0);
    let (_, normal, wo) = views(sun(256, 128).key())[0];
    let mut random = Random(103);
    for (_, lobes) in lobes() {
        for max_squares in [1, 2, 4, 5, 6, 20, 100, 4096] {
            for max_evaluations in [1, 18, 30, 64, 1000] {
                let config = ProductConfig { max_squares, max_evaluations, ..product_config() };
                let product = environment.prepare(&query(single(normal), single(wo), &lobes), &config);
                let info = product.info();
                assert!((1..=max_squares).contains(&info.squares), "{} of {max_squares}", info.squares);
                assert_eq!(info.leaves, 3 * info.squares + 1);
                // The base is spent in any case; the peaks of narrow lobes may ask for 24 splits of 5 values, and for their own.
                assert!(info.evaluations <= max_evaluations.max(66) + 24 * 5 + 4, "{}", info.evaluations);
                for _ in 0..100 {
                    let sample = product.sample([random.f32(), random.f32()]);
                    assert!(sample.pdf > 0.0 && product.pdf(sample.wi) == sample.pdf);
                }
            }
        }
    }
}

/// A client whose callback evaluates a query, spoils a value, or reports a failure. It also fails for batches of no
/// direction or of more than 40, and for directions that are not of unit length.
#[derive(Clone, Copy)]
struct Client {
    query: Query,
    spoilt: Option<f32>,
    returns: c_int,
}

unsafe extern "C" fn evaluate(user: *mut c_void, count: usize, wi: *const f32, f_cos: *mut f32) -> c_int {
    // SAFETY: the user pointer is a client, and the arrays have `count` elements.
    let (client, wi, f_cos) = unsafe {
        let wi = std::slice::from_raw_parts(wi.cast::<[f32; 3]>(), count);
        (&*user.cast::<Client>(), wi, std::slice::from_raw_parts_mut(f_cos, count))
    };
    let is_unit = |wi: &[f32; 3]| (wi.iter().map(|c| c * c).sum::<f32>() - 1.0).abs() < 1e-5;
    if !(1..=40).contains(&count) || !wi.iter().all(is_unit) {
        return -1;
    }
    for (wi, f_cos) in wi.iter().zip(f_cos.iter_mut()) {
        *f_cos = luminance(eval(&client.query, *wi).map(f64::from)) as f32;
    }
    f_cos[count - 1] = client.spoilt.unwrap_or(f_cos[count - 1]);
    client.returns
}

/// Prepares a product by callback; `half_angle` 0 announces no narrow lobe.
fn prepare_callback<'a>(environment: &'a Environment, client: &Client, half_angle: f32) -> Result<Product<'a>, Status> {
    let brdf = CallbackBrdf {
        size: size_of::<CallbackBrdf>() as u32,
        half_angle,
        peak: single(Material::new(&client.query).mirror()),
        reserved: 0,
        eval: Some(evaluate),
        user: std::ptr::from_ref(client).cast_mut().cast(),
    };
    let config = ProductConfig { max_evaluations: 106, callback: &brdf, ..product_config() };
    let query = Query { flags: 0, ..client.query };
    let (mut size, mut handle) = (MemorySize::default(), null());
    // SAFETY: all pointers are valid.
    let (status, memory) = unsafe {
        assert_eq!(wis_wavelet_product_size(&config, &mut size, null_mut()), Status::Ok);
        let mut memory = Memory::new(size.bytes);
        let (start, bytes) = (memory.pointer(), size.bytes);
        let e = environment.handle;
        (wis_wavelet_product_prepare(e, &config, 1, &query, start, bytes, &mut handle, null_mut()), memory)
    };
    if status == Status::Ok { Ok(Product { environment, memory, handle }) } else { Err(status) }
}

/// A callback that evaluates the lobes of a query gives the query's product, but for the last digit.
#[test]
fn callbacks_give_the_product_of_the_same_lobes() {
    let map = sun(256, 128);
    let environment = map.build(0, 0);
    let mut random = Random(107);
    // Lobes whose peaks are discs: a GGX lobe's is an ellipse, which a callback cannot announce; nor can it announce that it
    // is Lambert's, which is straight across the horizon.
    let phong = |exponent: f32| {
        let half_angle = 2.0f32.powf(-1.0 / (exponent + 1.0)).acos();
        (half_angle, vec![Lobe { kind: WIS_WAVELET_LOBE_PHONG, weight: [1.0; 3], a: exponent, ..Lobe::default() }])
    };
    for (half_angle, lobes) in [phong(1.0), phong(20.0), phong(500.0)] {
        for (_, normal, wo) in views(map.key()) {
            let query = query(single(normal), single(wo), &lobes);
            // What a product of Lambert's lobes spends of itself is less than a callback's.
            let config = ProductConfig { max_evaluations: 106, ..product_config() };
            let product = environment.prepare(&query, &config);
            let client = Client { query, spoilt: None, returns: 0 };
            let called = prepare_callback(&environment, &client, half_angle).unwrap();
            assert!((called.estimate() / product.estimate() - 1.0).abs() < 1e-3);
            let same = |wi| (called.pdf(wi) - product.pdf(wi)).abs() <= 1e-3 * product.pdf(wi);
            let agreeing = (0..1000).filter(|_| same(product.sample([random.f32(), random.f32()]).wi)).count();
            assert!(agreeing > 980, "{agreeing} of 1000 agree");
        }
    }
}

/// Few samples of a rough lobe are lost below the horizon: leaves that it crosses are not brighter there than their floor.
/// With straight lines that begin at 0 at the lower corners, both lobes lose 23 in a thousand. And few weigh much: the density
/// is not far too low above it.
#[test]
fn few_samples_lie_below_the_horizon() {
    let environment = Map::latlong(16, 8, |_, _| 1.0).build(64, 0);
    for (lobe, share) in [(lambert(0.7), 0.015), (ggx(0.5), 0.015)] {
        let mut random = Random(89);
        let (mut below, mut heavy, mut all) = (0, 0, 0);
        for _ in 0..300 {
            let (normal, wo) = (random.direction(), random.direction());
            if dot(normal, wo) > 0.3 {
                let query = query(normalise(normal), normalise(wo), &[lobe]);
                let product = environment.prepare(&query, &product_config());
                for _ in 0..1000 {
                    let sample = product.sample([random.f32(), random.f32()]);
                    below += i32::from(dot(sample.wi.map(f64::from), normal) <= 0.0);
                    let wi = normalise(random.direction());
                    let weight = f64::from(eval(&query, wi)[0] / product.pdf(wi)) / product.estimate();
                    heavy += i32::from(weight > 5.0);
                    all += 1;
                }
            }
        }
        let lost = f64::from(below) / f64::from(all);
        println!("{lost:.4} of {all} samples lie below the horizon, {heavy} directions weigh more than 5");
        assert!(lost < share && f64::from(heavy) < 1e-4 * f64::from(all), "{lost} {heavy}");
    }
}

unsafe extern "C" fn record(user: *mut c_void, count: usize, wi: *const f32, f_cos: *mut f32) -> c_int {
    // SAFETY: the user pointer is a vector, and the arrays have `count` elements.
    let (asked, wi) = unsafe {
        std::slice::from_raw_parts_mut(f_cos, count).fill(1.0);
        (&mut *user.cast::<Vec<[f32; 3]>>(), std::slice::from_raw_parts(wi.cast::<[f32; 3]>(), count))
    };
    asked.extend(wi);
    0
}

/// The directions that a callback with normal +z is asked for at first.
fn asked_first(flags: u32) -> Vec<[f32; 3]> {
    let environment = sky(16, 8).build(0, 0);
    let mut asked: Vec<[f32; 3]> = Vec::new();
    let brdf = CallbackBrdf {
        size: size_of::<CallbackBrdf>() as u32,
        half_angle: 0.0,
        peak: [0.0; 3],
        reserved: 0,
        eval: Some(record),
        user: (&raw mut asked).cast(),
    };
    let query = Query { flags, ..query([0.0, 0.0, 1.0], [0.0, 0.0, 1.0], &[]) };
    let config = ProductConfig { max_evaluations: 1, callback: &brdf, ..product_config() };
    let (mut size, mut handle) = (MemorySize::default(), null());
    // SAFETY: all pointers are valid.
    unsafe {
        assert_eq!(wis_wavelet_product_size(&config, &mut size, null_mut()), Status::Ok);
        let mut memory = Memory::new(size.bytes);
        let (e, start) = (environment.handle, memory.pointer());
        let status = wis_wavelet_product_prepare(e, &config, 1, &query, start, size.bytes, &mut handle, null_mut());
        assert_eq!(status, Status::Ok);
    }
    assert_eq!(asked.len(), 66);
    asked
}

/// A preparation starts with the corners of 8 x 8 cells of the square, each direction once; where the BRDF is 0 outside a
/// hemisphere, with the mirror images of those outside.
#[test]
fn the_base_is_a_grid() {
    let asked = asked_first(WIS_WAVELET_QUERY_WHOLE_SPHERE);
    let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
    for point in 0..81 {
        let wi = direction([(point / 9) as f32 / 8.0, (point % 9) as f32 / 8.0]).to_array();
        assert_eq!(asked.iter().filter(|asked| near(**asked, wi)).count(), 1, "{point}: {wi:?}");
    }
    for (mirrored, [x, y, z]) in asked_first(0).into_iter().zip(asked) {
        assert!(near(mirrored, [x, y, z.abs()]), "{mirrored:?}");
    }
}

/// What is spent follows the lobes: Lambert's are done with the base.
#[test]
fn lobes_get_what_they_deserve() {
    let environment = sun(256, 128).build(0, 0);
    let spent = |lobes: &[Lobe]| {
        let query = query([0.0, 0.0, 1.0], [0.0, 0.6, 0.8], lobes);
        environment.prepare(&query, &product_config()).info().evaluations
    };
    assert_eq!(spent(&[lambert(0.5)]), 66);
    assert_eq!(spent(&[lambert(0.5), lambert(0.2)]), 66);
    // And the value at the lobe's peak.
    assert_eq!(spent(&[ggx(0.7)]), 107);
}

#[test]
fn failing_callbacks_stop_the_preparation() {
    let environment = sky(16, 8).build(0, 0);
    let query = query([0.0, 0.0, 1.0], [0.0, 0.6, 0.8], &[lambert(1.0)]);
    let client = Client { query, spoilt: None, returns: 0 };
    let fails = |client| matches!(prepare_callback(&environment, &client, 0.0), Err(Status::CallbackFailed));
    assert!(!fails(client));
    assert!(fails(Client { returns: 1, ..client }));
    for bad in [f32::NAN, f32::INFINITY, -1.0] {
        assert!(fails(Client { spoilt: Some(bad), ..client }), "{bad}");
    }
}

#[test]
fn a_product_wants_its_own_environment() {
    let [environment, other] = [sky(16, 8), sky(16, 9)].map(|map| map.build(16, 0));
    let query = query([0.0, 0.0, 1.0], [0.0, 0.6, 0.8], &[lambert(1.0)]);
    let product = environment.prepare(&query, &product_config());
    let mut pdf = -1.0;
    // SAFETY: all pointers are valid.
    let status = unsafe {
        let wi = [0.0, 0.0, 1.0];
        wis_wavelet_pdf(other.handle, product.handle, null(), 1, wi.as_ptr(), 0, &mut pdf, 0)
    };
    assert_eq!((status, pdf), (Status::Mismatch, -1.0));
}

/// Under constant light a Lambert surface reflects its albedo.
#[test]
fn the_estimate_under_constant_light_is_the_albedo() {
    let environment = Map::latlong(8, 4, |_, _| 3.0).build(16, 0);
    for matrix in matrices() {
        let config = ProductConfig { world_from_map: matrix.as_ptr(), ..product_config() };
        let normal = normalise([0.3, -0.5, 0.8]);
        let product = environment.prepare(&query(normal, normal, &[lambert(0.5)]), &config);
        assert!((product.estimate() / 1.5 - 1.0).abs() < 0.1, "{}", product.estimate());
    }
}

/// The estimate is an approximation: for lobes that the tree can resolve it is of the right size, and it is printed
/// beside brute force.
#[test]
fn estimates_are_of_the_right_size() {
    let maps = hdr_maps().into_iter().chain([("sun", sun(256, 128))]);
    for (name, map) in maps.chain(photograph("st_fagans_interior_1k.hdr")) {
        let environment = map.build(0, 0);
        for point in grid(&map) {
            let scene = point.scene(&map, Filter::Bilinear);
            let share = point.prepare(&environment).estimate() / scene.integral(1.0);
            println!("{name}, {}: estimate {share:.3} of the integral", point.name);
            let narrow = scene.material.half_angle() < 0.1;
            assert!(narrow || (0.25..4.0).contains(&share), "{name}, {}: {share}", point.name);
        }
    }
}

/// With grey lobes the RGB estimate has the luminance of the estimate, and the colour of light of one colour.
#[test]
fn the_estimate_in_colour_has_the_luminance_of_the_estimate() {
    let colour = [0.9, 0.5, 0.2];
    let mut map = sun(128, 64);
    map.pixels = map.pixels.iter().flat_map(|&p| colour.map(|c| c * p)).collect();
    map.channels = 3;
    let environment = map.build(64, WIS_WAVELET_LIGHT_RGB);
    for (_, lobes) in lobes().into_iter().take(5) {
        for (_, normal, wo) in views(map.key()) {
            let product = environment.prepare(&query(single(normal), single(wo), &lobes), &product_config());
            let rgb = product.estimate_rgb();
            assert!((luminance(rgb) / product.estimate() - 1.0).abs() < 1e-5);
            for (channel, expected) in rgb.into_iter().zip(colour) {
                let share = channel / luminance(rgb) * luminance(colour.map(f64::from));
                assert!((share / f64::from(expected) - 1.0).abs() < 1e-3, "{rgb:?}");
            }
        }
    }
}

/// The variance of f L / pdf, relative to the square of its mean.
fn relative_variance(scene: &Scene, mut sample: impl FnMut() -> wis::wavelets::descent::Sample) -> f64 {
    let mut mean = Mean::default();
    for _ in 0..20_000 {
        let sample = sample();
        mean.add(scene.integrand(unit(sample.wi.map(f64::from))) / f64::from(sample.pdf));
    }
    mean.count * (mean.standard_error() / mean.mean).powi(2)
}

/// A product of a lobe that the tree can resolve (rule 25 of the design: from .02 on) never has more variance than the
/// light alone, which does not know the BRDF and the horizon.
#[test]
fn products_have_less_variance_than_the_light_alone() {
    let maps = hdr_maps().into_iter().chain([("sky", sky(256, 128)), ("sun", sun(256, 128))]);
    for (name, map) in maps {
        let environment = map.build(0, 0);
        let mut gain = Mean::default();
        for point in grid(&map) {
            let (scene, product) = (point.scene(&map, Filter::Bilinear), point.prepare(&environment));
            let mut random = Random(109);
            let mut u = || [random.f32(), random.f32()];
            let matrix = Some(&point.world_from_map);
            let light = relative_variance(&scene, || environment.sample(matrix, u()));
            let own = relative_variance(&scene, || product.sample(u()));
            let resolved = scene.material.half_angle() >= 0.02;
            assert!(own < light || !resolved, "{name}, {}: {own} instead of {light}", point.name);
            println!("{name}, {}: relative variance {own:.3}, light alone {light:.3}", point.name);
            gain.add((light / own).ln());
        }
        println!("the light alone has {:.1} times the variance (geometric mean)", gain.mean.exp());
    }
}

/// A narrow lobe is found wherever its peak lies: the density there is a good share of the lobe's own, however few of the
/// directions that are evaluated come near it. Leaves cannot be much finer than a lobe of 0.001; those that miss a peak
/// have less than a hundredth of these shares somewhere.
#[test]
fn narrow_peaks_are_found() {
    let environment = Map::latlong(16, 8, |_, _| 1.0).build(512, 0);
    let mut random = Random(83);
    for (alpha, share) in [(0.05, 0.3), (0.02, 0.15), (0.01, 0.15), (3e-3, 0.04), (1e-3, 0.008)] {
        let mut least = f64::INFINITY;
        for _ in 0..2000 {
            let (normal, wo) = (random.direction(), random.direction());
            let cosine = dot(normal, wo);
            if cosine > 0.3 {
                let mirror = normalise(std::array::from_fn(|k| 2.0 * cosine * normal[k] - wo[k]));
                let query = query(normalise(normal), normalise(wo), &[ggx(alpha)]);
                let density = f64::from(environment.prepare(&query, &product_config()).pdf(mirror));
                least = least.min(density / f64::from(eval(&query, mirror)[0]));
            }
        }
        println!("alpha {alpha}: at least {least:.3} of the lobe's density at its peak");
        assert!(least > share, "{alpha}: {least}");
    }
}
