//! Times of the trees' parts and of the pool: a rotated map, the transform, the inner product and the warp.

#[path = "../tests/stored/mod.rs"]
mod stored;
#[path = "../tests/support/mod.rs"]
mod support;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use std::ptr::null_mut;
use std::time::Duration;
use stored::Stored;
use support::{BuiltTree, Memory, tree_config};
use wis::ffi::pool::{Candidates, wis_pool_pick};
use wis::ffi::wavelets::tree::{TreeConfig, WIS_TREE_ENVIRONMENT};
use wis::pool::Pick;
use wis::status::Status;
use wis::wavelets::{inner, warp};
use wis::{Block, Map};

/// Batches of samples, as renderers ask for them.
const BATCHES: [usize; 3] = [4, 16, 64];
/// Numbers to draw from, so that no branch is learnt by heart.
const POINTS: usize = 4096;

fn points() -> Vec<[f32; 2]> {
    let mut random = stored::Random(1);
    (0..POINTS).map(|_| random.point()).collect()
}

fn rotated(criterion: &mut Criterion) {
    let sky = support::maps::sky(1024, 512);
    let map = Map::latlong(1024, 512, 1, &sky.pixels);
    let size = map.size().unwrap();
    let mut light = vec![Block::ZERO; Block::count(size.bytes)];
    map.build_in(&mut light, &mut vec![Block::ZERO; Block::count(size.scratch)]).unwrap();
    let mut group = criterion.benchmark_group("rotated map of 1024 x 512");
    group.sample_size(10);
    for depth in [6, 7] {
        let config = TreeConfig { depth, environment: light.as_ptr().cast(), ..tree_config(WIS_TREE_ENVIRONMENT) };
        group.bench_function(format!("depth {depth}"), |bencher| bencher.iter(|| BuiltTree::new(&config).unwrap()));
    }
    group.finish();
}

fn trees(criterion: &mut Criterion) {
    const DEPTH: u32 = 9;
    let mut random = stored::Random(1);
    let [e, f] = [0, 1].map(|_| random.image(1 << (2 * DEPTH)));
    let mut group = criterion.benchmark_group("tree of 512 x 512");
    group.sample_size(20);
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
    targets = rotated, pool, trees
}
criterion_main!(kernel);
