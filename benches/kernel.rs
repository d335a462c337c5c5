//! Times of the trees' parts: a rotated map, the transform, the inner product and the warp.

#[path = "../tests/stored/mod.rs"]
mod stored;
#[path = "../tests/support/mod.rs"]
mod support;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::time::Duration;
use stored::Stored;
use support::{BuiltTree, tree_config};
use wis::ffi::wavelets::tree::{TreeConfig, WIS_TREE_ENVIRONMENT};
use wis::wavelets::{combine, warp};
use wis::{Block, Map};

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
    group.bench_function("product integral", |bencher| bencher.iter(|| combine::integral(&e.tree(), &f.tree())));
    let points = points();
    let index: Vec<u32> = (0u32..).take(POINTS).collect();
    group.throughput(Throughput::Elements(POINTS as u64));
    group.bench_function("warp in place", |bencher| {
        bencher.iter(|| warp::warp_in_place(&e.tree(), &mut points.clone(), &mut index.clone()).unwrap());
    });
    group.finish();
}

criterion_group! {
    name = kernel;
    config = Criterion::default().warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    targets = rotated, trees
}
criterion_main!(kernel);
