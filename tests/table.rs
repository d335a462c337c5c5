//! Tabulated BRDFs: the directions of a slice, what a table means, and products of it.

use crate::support;
use crate::support::{
    BuiltTree, Environment, Map, Memory, Random, eval, lambert, normalise, pixel_config, product_config, query,
};
use std::ptr::{null, null_mut};
use wis::ffi::MemorySize;
use wis::ffi::wavelets::environment::WIS_WAVELET_LIGHT_RGB;
use wis::ffi::wavelets::product::*;
use wis::ffi::wavelets::table::*;
use wis::ffi::wavelets::tree::*;
use wis::status::Status;
use wis::wavelets::query::{Lobe, Query, WIS_WAVELET_LOBE_GGX, WIS_WAVELET_LOBE_TABLE};

const UP: [f32; 3] = [0.0, 0.0, 1.0];

/// A table and the memory of its trees.
struct Owned {
    _trees: Vec<Memory>,
    handles: Vec<*const Tree>,
}

impl Owned {
    /// Tabulates BRDF x cosine, a function of wo and wi in a frame whose normal is +z.
    fn new(slices: u32, depth: u32, error_budget: f32, value: impl Fn([f32; 3], [f32; 3]) -> f32) -> Owned {
        let build = |slice| {
            let (wo, wi) = directions(slice, slices, depth);
            let pixels: Vec<f32> = wi.iter().map(|&wi| if wi[2] > 0.0 { value(wo, wi) } else { 0.0 }).collect();
            tree(2, depth, error_budget, &pixels)
        };
        let (trees, handles) = (0..slices).map(build).unzip();
        Owned { _trees: trees, handles }
    }

    fn table(&self) -> Table {
        let size = size_of::<Table>() as u32;
        Table { size, slice_count: self.handles.len() as u32, slice: self.handles.as_ptr(), colour: [null(); 3] }
    }
}

fn directions(slice: u32, slices: u32, depth: u32) -> ([f32; 3], Vec<[f32; 3]>) {
    let (mut wo, mut wi) = ([0.0; 3], vec![[0.0; 3]; 1 << (2 * depth)]);
    // SAFETY: the array holds 4^depth directions.
    let status =
        unsafe { wis_wavelet_table_directions(slice, slices, depth, &[0.5; 2], &mut wo, wi.as_mut_ptr().cast(), 0) };
    assert_eq!(status, Status::Ok);
    (wo, wi)
}

fn tree(dimensions: u32, depth: u32, error_budget: f32, pixels: &[f32]) -> (Memory, *const Tree) {
    let built = BuiltTree::new(&pixel_config(dimensions, depth, error_budget, pixels)).unwrap();
    (built.memory, built.handle)
}

fn tabulated(weight: [f32; 3]) -> Lobe {
    Lobe { kind: WIS_WAVELET_LOBE_TABLE, weight, ..Lobe::default() }
}

/// BRDF x cosine of a query by a table, RGB.
fn table_eval(table: &Table, query: &Query, wi: [f32; 3]) -> Result<[f32; 3], Status> {
    let mut f_cos = [0.0f32; 3];
    // SAFETY: one direction and one colour.
    let status = unsafe { wis_wavelet_query_eval(query, table, 1, wi.as_ptr(), 0, f_cos.as_mut_ptr(), 0) };
    if status == Status::Ok { Ok(f_cos) } else { Err(status) }
}

/// A prepared product of a table.
struct Prepared<'a> {
    environment: &'a Environment,
    handle: *const Product,
    _memory: Memory,
}

fn prepare<'a>(
    environment: &'a Environment,
    table: &Table,
    query: &Query,
    config: &ProductConfig,
) -> Result<Prepared<'a>, Status> {
    let (mut size, mut handle) = (MemorySize::default(), null());
    let config = &ProductConfig { table, ..*config };
    // SAFETY: all pointers are to live values, and the block is as long as was asked for.
    unsafe {
        assert_eq!(wis_wavelet_product_size(config, &mut size, null_mut()), Status::Ok);
        let mut memory = Memory::new(size.bytes);
        let (light, place) = (environment.handle, memory.pointer());
        let (bytes, none) = (size.bytes, null_mut());
        let status = wis_wavelet_product_prepare(light, config, 1, query, place, bytes, &mut handle, none);
        if status == Status::Ok { Ok(Prepared { environment, handle, _memory: memory }) } else { Err(status) }
    }
}

impl Prepared<'_> {
    fn sample(&self, u: [f32; 2]) -> wis::wavelets::descent::Sample {
        support::sample(self.environment.handle, self.handle, None, u)
    }

    fn pdf(&self, wi: [f32; 3]) -> f32 {
        support::pdf(self.environment.handle, self.handle, None, wi)
    }

    fn estimate(&self) -> f64 {
        let mut info = ProductInfo { size: size_of::<ProductInfo>() as u32, ..ProductInfo::default() };
        // SAFETY: all pointers are to live values.
        let status = unsafe { wis_wavelet_product_describe(self.environment.handle, self.handle, &mut info) };
        assert_eq!(status, Status::Ok);
        info.estimate
    }
}

fn ggx(alpha: f32) -> Lobe {
    Lobe { kind: WIS_WAVELET_LOBE_GGX, weight: [1.0; 3], f0: [0.8; 3], a: alpha, b: alpha }
}

fn map() -> Map {
    Map::latlong(64, 32, |x, y| if x == 20 && y == 9 { 400.0 } else { 0.3 + f64::from((x + 2 * y) % 5) as f32 })
}

/// The mirror direction is in the middle of every slice, wo has its slice's elevation, and the pixels cover the sphere
/// evenly (the mean of the directions is 0).
#[test]
fn slices_are_about_the_mirror_direction() {
    for slices in [1, 3, 16, 256] {
        for slice in [0, slices / 2, slices - 1] {
            let (wo, wi) = directions(slice, slices, 4);
            let angle = (f64::from(slice) + 0.5) / f64::from(slices) * std::f64::consts::FRAC_PI_2;
            assert!((f64::from(wo[2]).acos() - angle).abs() < 1e-6 * 90.0 && wo[1] == 0.0 && wo[0] >= 0.0);
            let around = [wi[7 * 16 + 7], wi[7 * 16 + 8], wi[8 * 16 + 7], wi[8 * 16 + 8]];
            for (axis, mirror) in [-wo[0], wo[1], wo[2]].into_iter().enumerate() {
                let mean = around.iter().map(|wi| wi[axis]).sum::<f32>() / 4.0;
                assert!((mean - mirror).abs() < 0.02, "{slice} of {slices}: {around:?} about {wo:?}");
                let total: f64 = wi.iter().map(|wi| f64::from(wi[axis])).sum();
                assert!(total.abs() < 1e-3, "{total}");
            }
        }
    }
}

/// At the centre of a pixel and the elevation of a slice a table without loss is the BRDF itself, however the surface is
/// turned; between, a fine table comes close.
#[test]
fn tables_mean_the_brdf() {
    let lobe = ggx(0.3);
    let value = |wo: [f32; 3], wi: [f32; 3]| eval(&query(UP, wo, &[lobe]), wi)[0];
    let (slices, depth) = (8, 6);
    let owned = Owned::new(slices, depth, 0.0, value);
    let table = owned.table();
    for slice in 0..slices {
        let (wo, directions) = directions(slice, slices, depth);
        for wi in directions.iter().step_by(7) {
            let [got, ..] = table_eval(&table, &query(UP, wo, &[tabulated([1.0; 3])]), *wi).unwrap();
            let expected = if wi[2] > 0.0 { value(wo, *wi) } else { 0.0 };
            // A pixel's border may be as near as rounding.
            assert!((got - expected).abs() <= 0.12 * expected + 1e-4, "{got} for {expected} at {wo:?}, {wi:?}");
        }
    }
    let mut random = Random(4);
    let (mut difference, mut total) = (0.0, 0.0);
    for _ in 0..4000 {
        let n = random.direction();
        let upper = |d: [f64; 3]| {
            let cosine = d.iter().zip(&n).map(|(d, n)| d * n).sum::<f64>();
            normalise(d.map(|d| if cosine < 0.0 { -d } else { d }))
        };
        let (normal, wo, wi) = (normalise(n), upper(random.direction()), upper(random.direction()));
        let got = table_eval(&table, &query(normal, wo, &[tabulated([1.0; 3])]), wi).unwrap();
        let expected = eval(&query(normal, wo, &[lobe]), wi)[0];
        difference += f64::from((got[0] - expected).abs());
        total += f64::from(expected);
    }
    assert!(difference < 0.08 * total, "{difference} of {total}");
}

/// Weights are colours, and other lobes add.
#[test]
fn weights_and_other_lobes() {
    let owned = Owned::new(4, 3, 0.0, |_, wi| 0.5 * wi[2]);
    let table = owned.table();
    let wo = normalise([0.3, 0.2, 0.9]);
    let wi = normalise([0.1, -0.4, 0.8]);
    let [alone, ..] = table_eval(&table, &query(UP, wo, &[tabulated([1.0; 3])]), wi).unwrap();
    let coloured = table_eval(&table, &query(UP, wo, &[lambert(0.5), tabulated([1.0, 2.0, 0.0])]), wi).unwrap();
    let diffuse = 0.5 * wi[2] / std::f32::consts::PI;
    for (got, expected) in coloured.into_iter().zip([diffuse + alone, diffuse + 2.0 * alone, diffuse]) {
        assert!((got - expected).abs() < 1e-6, "{got} for {expected}");
    }
}

/// One object holds a colour: each channel is its own table, sampling goes by luminance, and the integral in RGB has the
/// luminance of the estimate and the channels' own sizes.
#[test]
fn coloured_tables() {
    let channel = |c: usize| move |_: [f32; 3], wi: [f32; 3]| [0.8, 0.1, 0.3][c] * wi[2] * (1.0 + c as f32 * wi[0]);
    let luminance = |rgb: [f64; 3]| 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
    let value =
        |wo: [f32; 3], wi: [f32; 3]| luminance([0, 1, 2].map(|c| f64::from(channel(c)(wo, wi).max(0.0)))) as f32;
    let grey = Owned::new(8, 5, 0.0, value);
    let channels = [0, 1, 2].map(|c| Owned::new(8, 5, 0.0, move |wo, wi| channel(c)(wo, wi).max(0.0)));
    let table = Table { colour: [0, 1, 2].map(|c| channels[c].handles.as_ptr()), ..grey.table() };
    let (mut random, wo) = (Random(8), normalise([0.3, 0.2, 0.9]));
    let at = query(UP, wo, &[tabulated([1.0, 2.0, 0.5])]);
    for _ in 0..100 {
        let [x, y, z] = random.direction();
        let wi = normalise([x, y, z.abs() + 0.1]);
        let got = table_eval(&table, &at, wi).unwrap();
        for (c, weight) in [1.0, 2.0, 0.5].into_iter().enumerate() {
            let [alone, ..] = table_eval(&channels[c].table(), &query(UP, wo, &[tabulated([1.0; 3])]), wi).unwrap();
            assert!((got[c] - weight * alone).abs() <= 1e-6 * alone, "{got:?}");
        }
    }
    let environment = Map { channels: 3, pixels: map().pixels.iter().flat_map(|p| [*p; 3]).collect(), ..map() };
    let environment = environment.build(64, WIS_WAVELET_LIGHT_RGB);
    let at = query(UP, wo, &[tabulated([1.0; 3])]);
    let product = prepare(&environment, &table, &at, &product_config()).unwrap();
    let estimate = |table: &Table| {
        let mut rgb = [f64::NAN; 3];
        // SAFETY: all pointers are to live values.
        let status = unsafe { wis_wavelet_product_estimate_rgb(environment.handle, product.handle, table, &mut rgb) };
        if status == Status::Ok { Ok(rgb) } else { Err(status) }
    };
    let rgb = estimate(&table).unwrap();
    assert!((luminance(rgb) / product.estimate() - 1.0).abs() < 1e-4, "{rgb:?} {}", product.estimate());
    for (c, own) in rgb.into_iter().enumerate() {
        let alone = prepare(&environment, &channels[c].table(), &at, &product_config()).unwrap().estimate();
        // Both are approximations, of the colour at the centres of leaves and of each channel on leaves of its own.
        assert!((own / alone - 1.0).abs() < 0.2, "{c}: {own} {alone}");
    }
    let grey = estimate(&grey.table()).unwrap();
    assert!(grey.iter().all(|c| (c / product.estimate() - 1.0).abs() < 1e-5), "{grey:?}");
    let partly = Table { colour: [channels[0].handles.as_ptr(), null(), null()], ..table };
    assert_eq!(estimate(&partly), Err(Status::NullPointer));
    assert_eq!(table_eval(&partly, &at, UP), Err(Status::NullPointer));
}

/// The product of a fine table is as good as that of the BRDF: the estimates agree, the pdf is above 0 wherever the BRDF
/// is, also with a coarse table and for hits nearby, and samples have the pdf that is asked for.
#[test]
fn products_of_tables() {
    let environment = map().build(0, 0);
    let mut random = Random(6);
    for (alpha, budget, is_exact) in [(0.3, 0.0, true), (0.1, 0.01, true), (0.3, 0.2, false)] {
        let lobe = ggx(alpha);
        let value = |wo: [f32; 3], wi: [f32; 3]| eval(&query(UP, wo, &[lobe]), wi)[0];
        let owned = Owned::new(16, 6, budget, value);
        let normal = normalise([0.2, 0.5, 0.7]);
        let wo = normalise([0.5, 0.1, 0.6]);
        let config = product_config();
        let product =
            prepare(&environment, &owned.table(), &query(normal, wo, &[tabulated([1.0; 3])]), &config).unwrap();
        let analytic = environment.prepare(&query(normal, wo, &[lobe]), &config);
        if is_exact {
            let ratio = product.estimate() / analytic.estimate();
            assert!((ratio - 1.0).abs() < 0.15, "alpha {alpha}: {ratio}");
        }
        for _ in 0..2000 {
            let wi = normalise(random.direction());
            if eval(&query(normal, wo, &[lobe]), wi)[0] > 0.0 {
                assert!(product.pdf(wi) > 0.0);
            }
            let sample = product.sample([random.f32(), random.f32()]);
            assert!(sample.pdf > 0.0 && product.pdf(sample.wi).to_bits() == sample.pdf.to_bits());
        }
        let variance = |sample: &mut dyn FnMut() -> (f64, f64)| {
            let (mut sum, mut squares) = (0.0, 0.0);
            for _ in 0..20_000 {
                let (value, pdf) = sample();
                (sum, squares) = (sum + value / pdf, squares + (value / pdf) * (value / pdf));
            }
            let mean = sum / 20_000.0;
            (mean, squares / 20_000.0 / (mean * mean) - 1.0)
        };
        let integrand = |wi: [f32; 3]| {
            let light = environment.pdf(None, wi);
            f64::from(light * eval(&query(normal, wo, &[lobe]), wi)[0])
        };
        let mut by_table = || {
            let sample = product.sample([random.f32(), random.f32()]);
            (integrand(sample.wi), f64::from(sample.pdf))
        };
        let (table_mean, table) = variance(&mut by_table);
        let mut by_lobe = || {
            let sample = analytic.sample([random.f32(), random.f32()]);
            (integrand(sample.wi), f64::from(sample.pdf))
        };
        let (lobe_mean, lobe) = variance(&mut by_lobe);
        // Both are unbiased: 3.9 standard errors are passed by chance once in 10^4, and one is at most .4 % of the mean.
        let error = ((table + lobe) / 20_000.0).sqrt() * lobe_mean;
        assert!((table_mean - lobe_mean).abs() < 3.9 * error, "{table_mean} for {lobe_mean}, {error}");
        assert!(error < 0.004 * lobe_mean, "{error} of {lobe_mean}");
        // Measured: .031 (.021 without the table), .032 (.006: pixels of 3 degrees) and .11 (.05: a coarse table).
        assert!(table < 2.0 * lobe + 0.05, "alpha {alpha}: variance {table} with the table, {lobe} without");
    }
}

/// A narrow table is found wherever its peak lies, as a narrow lobe is: a table of one slice, seen at its elevation.
#[test]
fn narrow_tables_are_found() {
    let environment = Map::latlong(16, 8, |_, _| 1.0).build(512, 0);
    let lobe = ggx(0.02);
    let owned = Owned::new(1, 7, 0.0, |wo, wi| eval(&query(UP, wo, &[lobe]), wi)[0]);
    let (mut random, mut least) = (Random(83), f64::INFINITY);
    for _ in 0..300 {
        // Slices are seen at 45 degrees.
        let (n, d) = (random.direction(), random.direction());
        let along = support::vector::unit(support::vector::cross(n, d));
        let wo: [f32; 3] = normalise([0, 1, 2].map(|k| n[k] + along[k]));
        let mirror = normalise([0, 1, 2].map(|k| n[k] - along[k]));
        let at = query(normalise(n), wo, &[tabulated([1.0; 3])]);
        let product = prepare(&environment, &owned.table(), &at, &product_config()).unwrap();
        let value = table_eval(&owned.table(), &at, mirror).unwrap()[0];
        least = least.min(f64::from(product.pdf(mirror) / value));
    }
    println!("at least {least:.3} of the table's own value at its peak");
    assert!(least > 0.15, "{least}");
}

/// The half-width that a table announces is, on average over widths, about 0.43 of that at which its lobe has fallen to
/// half: cells are powers of two wide, so one lobe alone may be off by that.
#[test]
fn half_widths_of_tables_follow_their_lobes() {
    use wis::wavelets::table::{Slice, Table};
    const DEPTH: u32 = 8;
    let (side, lobes) = (1u32 << DEPTH, 16);
    let mut sum = 0.0;
    for k in 0..lobes {
        let half_width = 0.1 * f64::from(1.0 + k as f32 / lobes as f32);
        let pixel = |i: u32| {
            let at = |c: u32| (f64::from(c) + 0.5) / f64::from(side);
            let [x, y, z] = wis::sphere::direction_f64([at(i / side), at(i % side)]);
            let angle = x.hypot(y).atan2(z);
            (-(angle / half_width).powi(2)).exp2() as f32
        };
        let pixels: Vec<f32> = (0..side * side).map(pixel).collect();
        let mut squares = vec![[0.0f32; 4]; ((1 << (2 * DEPTH)) - 1) / 3];
        let scale = wis::wavelets::image::build::<2, 4>(DEPTH, &pixels, &mut squares).unwrap();
        let tree = wis::wavelets::tree::Tree::complete(DEPTH, scale.average, &squares).unwrap();
        let table = Table::new([Slice { tree, scale: 1.0 }; 2], 0.0).seen(glam::Vec3::Z);
        let (direction, radius) = table.peak().expect("a narrow lobe");
        assert!(direction.z > 0.99, "{direction}");
        sum += (f64::from(radius) / half_width).ln() / f64::from(lobes);
    }
    let ratio = sum.exp();
    println!("{ratio:.3} of the half-width on average");
    assert!((0.34..0.52).contains(&ratio), "{ratio}");
}

#[test]
fn faults() {
    let owned = Owned::new(4, 3, 0.0, |_, wi| wi[2]);
    let (_line, line) = tree(1, 3, 0.0, &[1.0; 8]);
    let at = query(UP, normalise([0.5, 0.0, 0.5]), &[tabulated([1.0; 3])]);
    let wi = normalise([0.0, 0.1, 0.9]);
    let eval = |table: Table| table_eval(&table, &at, wi);
    assert!(eval(owned.table()).is_ok());
    assert_eq!(eval(Table { slice_count: 0, ..owned.table() }), Err(Status::InvalidArgument));
    assert_eq!(eval(Table { slice_count: 257, ..owned.table() }), Err(Status::InvalidArgument));
    assert_eq!(eval(Table { slice: null(), ..owned.table() }), Err(Status::NullPointer));
    // At 45 degrees slices 1 and 2 are asked: one of them is enough.
    let built = |kept: &[usize]| -> Vec<*const Tree> {
        (0..4).map(|k| if kept.contains(&k) { owned.handles[k] } else { null() }).collect()
    };
    for (kept, expected) in [(vec![1], Ok(())), (vec![2], Ok(())), (vec![0, 3], Err(Status::NotBuilt))] {
        let handles = built(&kept);
        assert_eq!(eval(Table { slice: handles.as_ptr(), ..owned.table() }).map(drop), expected);
    }
    let lines = [line; 4];
    assert_eq!(eval(Table { slice: lines.as_ptr(), ..owned.table() }), Err(Status::InvalidArgument));
    // Without the table, its lobe means nothing.
    let mut f_cos = [0.0f32; 3];
    // SAFETY: one direction and one colour.
    let status = unsafe { wis_wavelet_query_eval(&at, null(), 1, wi.as_ptr(), 0, f_cos.as_mut_ptr(), 0) };
    assert_eq!(status, Status::InvalidArgument);
    // A table that is 0 reflects nothing; below the surface there is nothing either.
    let black = Owned::new(4, 3, 0.0, |_, _| 0.0);
    let environment = map().build(0, 0);
    for (table, at) in [(&black, at), (&owned, Query { wo: normalise([0.5, 0.0, -0.5]), ..at })] {
        let product = prepare(&environment, &table.table(), &at, &product_config()).unwrap();
        assert_eq!(product.sample([0.5, 0.5]).pdf, 0.0);
        assert_eq!(product.estimate(), 0.0);
    }
    let (mut wo, mut wi) = ([0.0; 3], [0.0f32; 3]);
    for (slice, slices, depth, offset, status) in [
        (0, 1, 0, [0.5, 0.5], Status::Ok),
        (1, 1, 0, [0.5, 0.5], Status::InvalidArgument),
        (0, 0, 0, [0.5, 0.5], Status::InvalidArgument),
        (0, 257, 0, [0.5, 0.5], Status::InvalidArgument),
        (0, 1, 13, [0.5, 0.5], Status::InvalidArgument),
        (0, 1, 0, [f32::NAN, 0.5], Status::InvalidArgument),
        (0, 1, 0, [0.5, 1.5], Status::InvalidArgument),
    ] {
        // SAFETY: one direction.
        let got = unsafe { wis_wavelet_table_directions(slice, slices, depth, &offset, &mut wo, wi.as_mut_ptr(), 0) };
        assert_eq!(got, status);
    }
}

/// Lanes have the bits of the scalar look-up.
#[test]
fn lanes_are_the_scalar_look_up() {
    use glam::Vec3;
    use wis::wavelets::lanes::{LANES, Lanes, Native, Portable};
    use wis::wavelets::table::{Slice, Table};
    use wis::wavelets::tree::{Link, Tree};
    use wis::wavelets::{image, prune};
    let mut random = Random(12);
    let mut slice = |depth: u32| {
        let pixels: Vec<f32> =
            (0..1u32 << (2 * depth)).map(|_| if random.bits() % 3 == 0 { random.f32() } else { 1.0 }).collect();
        let mut squares = vec![[0.0f32; 4]; ((1 << (2 * depth)) - 1) / 3];
        let scale = image::build::<2, 4>(depth, &pixels, &mut squares).unwrap();
        let complete = Tree::complete(depth, scale.average, &squares).unwrap();
        let mut savings = vec![0.0; squares.len()];
        let planned = prune::plan(&complete, 0.05, &mut savings).unwrap();
        let mut kept = vec![[0.0; 4]; planned.squares as usize];
        let mut links = vec![Link::default(); kept.len()];
        prune::write(&complete, &savings, &mut kept, &mut links).unwrap();
        (depth, scale.average, kept, links)
    };
    let (low, high) = (slice(6), slice(3));
    fn tree((depth, average, squares, links): &(u32, f32, Vec<[f32; 4]>, Vec<Link>)) -> Tree<'_, 4> {
        Tree::sparse(*depth, *average, squares, links).unwrap()
    }
    fn wide<F: Lanes>(table: &Table, wi: &[Vec3; LANES]) -> [f32; LANES] {
        let axis = |c: usize| F::from_array(wi.map(|wi| wi[c]));
        table.at_wide([axis(0), axis(1), axis(2)]).to_array()
    }
    for slices in [[&low, &high], [&high, &high]] {
        let slices = slices.map(|slice| Slice { tree: tree(slice), scale: 3.7 });
        let table = Table::new(slices, 0.3).seen(Vec3::from_array(normalise([0.3, 0.4, 0.6])));
        for _ in 0..500 {
            let wi: [Vec3; LANES] = std::array::from_fn(|_| Vec3::from_array(normalise(random.direction())));
            let expected = wi.map(|wi| table.at(wi).to_bits());
            assert_eq!(wide::<Portable>(&table, &wi).map(f32::to_bits), expected);
            assert_eq!(wide::<Native>(&table, &wi).map(f32::to_bits), expected);
        }
    }
}
