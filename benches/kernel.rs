//! Times of the kernel's parts, through the C boundary as a client pays them: building an environment, preparing a
//! product, sampling and pdfs one at a time and in batches, and the trees' transform, product and warp.

#[path = "../tests/stored/mod.rs"]
mod stored;
#[path = "../tests/support/mod.rs"]
mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use std::ptr::{null, null_mut};
use std::time::Duration;
use stored::Stored;
use support::{Environment, Map, Memory, Product, Random, ggx, lambert, product_config, query};
use wis::ffi::MemorySize;
use wis::ffi::pool::{Candidates, wis_pool_pick};
use wis::ffi::wavelets::environment::*;
use wis::ffi::wavelets::haar::{WIS_HAAR_FORWARD, wis_haar};
use wis::ffi::wavelets::product::*;
use wis::ffi::wavelets::sampling::*;
use wis::pool::Pick;
use wis::status::Status;
use wis::wavelets::descent::Sample;
use wis::wavelets::query::{Lobe, Query};
use wis::wavelets::{inner, warp};

const RESOLUTION: u32 = 512;
/// Batches of samples, as renderers ask for them.
const BATCHES: [usize; 3] = [4, 16, 64];
/// Numbers to draw from, so that no branch is learnt by heart.
const POINTS: usize = 4096;

fn sky() -> Map {
    support::maps::sky(512, 256)
}

fn lobes() -> [(&'static str, Vec<Lobe>); 3] {
    [("lambert", vec![lambert(0.8)]), ("ggx 0.2", vec![ggx(0.2)]), ("ggx 0.01", vec![ggx(0.01)])]
}

fn shading_point(lobes: &[Lobe]) -> Query {
    query([0.36, 0.48, 0.8], [0.0, 0.6, 0.8], lobes)
}

fn points() -> Vec<[f32; 2]> {
    let mut random = Random(1);
    (0..POINTS).map(|_| [random.f32(), random.f32()]).collect()
}

fn environment_build(criterion: &mut Criterion) {
    let map = sky();
    let mut group = criterion.benchmark_group("environment build");
    group.sample_size(10);
    for flags in [0, WIS_WAVELET_LIGHT_NEAREST] {
        let name = if flags == 0 { "bilinear" } else { "nearest" };
        group.bench_function(name, |bencher| bencher.iter(|| map.build(RESOLUTION, flags)));
    }
    group.finish();
}

fn environment_sample(criterion: &mut Criterion) {
    let environment = sky().build(RESOLUTION, 0);
    let directions: Vec<[f32; 3]> = points().iter().map(|u| environment.sample(None, *u).wi).collect();
    let mut group = criterion.benchmark_group("environment");
    let mut u = points().into_iter().cycle();
    group.bench_function("sample", |bencher| {
        bencher.iter(|| environment.sample(None, black_box(u.next().unwrap())));
    });
    let mut wi = directions.into_iter().cycle();
    group.bench_function("pdf", |bencher| {
        bencher.iter(|| environment.pdf(None, black_box(wi.next().unwrap())));
    });
    group.finish();
}

/// Prepares over and over in one block, as a thread of a renderer does.
fn prepare(environment: &Environment, query: &Query, config: &ProductConfig, memory: &mut Memory) {
    let (block, bytes, mut handle) = (memory.pointer(), memory.len(), null());
    // SAFETY: all pointers are valid.
    let status = unsafe {
        wis_wavelet_product_prepare(environment.handle, config, 1, query, block, bytes, &mut handle, null_mut())
    };
    assert_eq!(status, Status::Ok);
}

fn product_prepare(criterion: &mut Criterion) {
    let environment = sky().build(RESOLUTION, 0);
    let mut group = criterion.benchmark_group("product prepare");
    for (name, lobes) in lobes() {
        for max_squares in [32, 128, 512] {
            let config = ProductConfig { max_squares, max_evaluations: max_squares / 2, ..product_config() };
            let mut size = MemorySize::default();
            // SAFETY: all pointers are valid.
            assert_eq!(unsafe { wis_wavelet_product_size(&config, &mut size, null_mut()) }, Status::Ok);
            let (query, mut memory) = (shading_point(&lobes), Memory::new(size.bytes));
            group.bench_function(BenchmarkId::new(name, max_squares), |bencher| {
                bencher.iter(|| prepare(&environment, black_box(&query), &config, &mut memory));
            });
        }
    }
    group.finish();
}

fn product_sample(criterion: &mut Criterion) {
    let environment = sky().build(RESOLUTION, 0);
    let product = environment.prepare(&shading_point(&[ggx(0.2)]), &product_config());
    let points = points();
    let mut group = criterion.benchmark_group("product sample");
    let mut u = points.iter().cycle();
    group.bench_function("1", |bencher| bencher.iter(|| product.sample(black_box(*u.next().unwrap()))));
    for count in BATCHES {
        let mut drawn = vec![Sample::default(); count];
        let mut batches = points.chunks_exact(count).cycle();
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(count.to_string(), |bencher| {
            bencher.iter(|| sample_n(&product, black_box(batches.next().unwrap()), &mut drawn));
        });
    }
    group.finish();
}

fn sample_n(product: &Product, u: &[[f32; 2]], drawn: &mut [Sample]) {
    let (u, count, drawn) = (u.as_ptr().cast(), u.len(), drawn.as_mut_ptr());
    // SAFETY: the slices are of one length, and both handles are alive.
    let status =
        unsafe { wis_wavelet_sample(product.environment.handle, product.handle, null(), count, u, 0, drawn, 0) };
    assert_eq!(status, Status::Ok);
}

fn product_pdf(criterion: &mut Criterion) {
    let environment = sky().build(RESOLUTION, 0);
    let product = environment.prepare(&shading_point(&[ggx(0.2)]), &product_config());
    let directions: Vec<[f32; 3]> = points().iter().map(|u| product.sample(*u).wi).collect();
    let mut group = criterion.benchmark_group("product pdf");
    let mut wi = directions.iter().cycle();
    group.bench_function("1", |bencher| bencher.iter(|| product.pdf(black_box(*wi.next().unwrap()))));
    for count in BATCHES {
        let mut pdf = vec![0.0; count];
        let mut batches = directions.chunks_exact(count).cycle();
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(count.to_string(), |bencher| {
            bencher.iter(|| pdf_n(&product, black_box(batches.next().unwrap()), &mut pdf));
        });
    }
    group.finish();
}

fn pdf_n(product: &Product, wi: &[[f32; 3]], pdf: &mut [f32]) {
    let (wi, count, pdf) = (wi.as_ptr().cast(), wi.len(), pdf.as_mut_ptr());
    // SAFETY: as in `sample_n`.
    let status = unsafe { wis_wavelet_pdf(product.environment.handle, product.handle, null(), count, wi, 0, pdf, 0) };
    assert_eq!(status, Status::Ok);
}

fn trees(criterion: &mut Criterion) {
    const DEPTH: u32 = 9;
    let mut random = stored::Random(1);
    let [e, f] = [0, 1].map(|_| random.image(1 << (2 * DEPTH)));
    let mut group = criterion.benchmark_group("tree of 512 x 512");
    group.sample_size(20);
    let mut values: Vec<f64> = e.iter().map(|&x| f64::from(x)).collect();
    group.bench_function("haar forward", |bencher| {
        // SAFETY: the slice holds 2^(2 DEPTH) values.
        bencher.iter(|| unsafe {
            wis_haar(WIS_HAAR_FORWARD, 2, DEPTH, values.len(), values.as_mut_ptr(), std::ptr::null_mut())
        });
    });
    let [e, f] = [e, f].map(|pixels| Stored::<4>::complete::<2>(DEPTH, &pixels).pruned(0.01).0);
    group.bench_function("product integral", |bencher| bencher.iter(|| inner::integral(&e.tree(), &f.tree())));
    let points = points();
    let index: Vec<u32> = (0u32..).take(POINTS).collect();
    group.throughput(Throughput::Elements(POINTS as u64));
    group.bench_function("warp in place", |bencher| {
        bencher.iter(|| warp::warp_in_place(&e.tree(), &mut points.clone(), &mut index.clone()).unwrap());
    });
    group.finish();
}

fn pool(criterion: &mut Criterion) {
    let mut random = stored::Random(2);
    let mut group = criterion.benchmark_group("pool pick");
    for picks in BATCHES {
        let count = 4 * picks;
        let mut direction = || [random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5];
        let wi: Vec<[f32; 3]> = (0..count).map(|_| direction()).collect();
        let weight: Vec<f32> = (0..count).map(|i| (i % 5) as f32).collect();
        let mut scratch = Memory::filled(16 * count, 0);
        let (bytes, mut chosen) = (scratch.len(), vec![Pick::default(); picks]);
        group.throughput(Throughput::Elements(picks as u64));
        group.bench_function(picks.to_string(), |bencher| {
            bencher.iter(|| {
                let (mut used, mut sum) = (0, 0.0);
                let (wi, weight) = (black_box(wi.as_ptr()).cast(), weight.as_ptr());
                let (memory, out, n) = (scratch.pointer(), chosen.as_mut_ptr(), picks as u32);
                let size = size_of::<Candidates>() as u32;
                let all = Candidates { size, reserved: 0, count, wi, wi_stride: 0, weight, weight_stride: 0 };
                // SAFETY: all arrays are as long as the header asks for.
                let status =
                    unsafe { wis_pool_pick(&all, n, 0.4, memory, bytes, out, &mut used, &mut sum, null_mut()) };
                assert_eq!(status, Status::Ok);
            });
        });
    }
    group.finish();
}

criterion_group! {
    name = kernel;
    config = Criterion::default().warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    targets = environment_build, environment_sample, product_prepare, product_sample, product_pdf, pool, trees
}
criterion_main!(kernel);
