//! Lanes answer the bits of scalar operations, and the wide walk those of the scalar walk, in arrays and in registers. Products are
//! the same on both.

use crate::support::statistics::Mean;
use crate::support::{Random, ggx, lambert, lane_points, query};
use wis::numeric::{max, min, sqrt};
use wis::points::sobol;
use wis::sphere::Frame;
use wis::wavelets::descent::{self, Sample};
use wis::wavelets::environment::Light;
use wis::wavelets::lanes::{LANES, Lanes, Native, Portable};
use wis::wavelets::lobe::Lobes;
use wis::wavelets::product::{self, Budget, Cell, Node, Room, Scratch};
use wis::wavelets::query::{Lobe, Query, WIS_WAVELET_LOBE_PHONG};
use wis::wavelets::tree::{Tree, build, complete_len};
use wis::wavelets::wide::{self, TOGETHER};

/// Ordinary numbers, and those at which operations differ.
fn numbers() -> Vec<f32> {
    let special = [0.0, -0.0, 1.0, -1.0, 1e-45, 1e-38, 3e38, f32::INFINITY, -f32::INFINITY, f32::NAN, 0.5, 4096.0];
    let ordinary = (0..52).map(|i| (sobol(1, i)[0] - 0.5) * 20.0);
    special.into_iter().chain(ordinary).collect()
}

/// A NaN's bits mean nothing.
fn bits(x: f32) -> u32 {
    if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() }
}

/// Runs a test on every kind of lanes that this processor has.
macro_rules! on_all_lanes {
    ($test:ident) => {{
        $test::<Portable>();
        $test::<Native>();
    }};
}

fn operations<F: Lanes>() {
    let numbers = numbers();
    for (shift, first) in (0..numbers.len()).flat_map(|s| (0..numbers.len()).step_by(LANES).map(move |f| (s, f))) {
        let of = |offset: usize| -> [f32; LANES] {
            std::array::from_fn(|i| numbers[(first + i * (1 + offset % 3) + offset) % numbers.len()])
        };
        let (a, b) = (of(0), of(shift));
        let (x, y) = (F::from_array(a), F::from_array(b));
        let check = |name: &str, lanes: F, scalar: &dyn Fn(f32, f32) -> f32| {
            for (i, lane) in lanes.to_array().into_iter().enumerate() {
                assert_eq!(bits(lane), bits(scalar(a[i], b[i])), "{name} of {} and {}", a[i], b[i]);
            }
        };
        check("sum", x + y, &|a, b| a + b);
        check("difference", x - y, &|a, b| a - b);
        check("product", x * y, &|a, b| a * b);
        check("quotient", x / y, &|a, b| a / b);
        check("root", x.sqrt(), &|a, _| sqrt(a));
        check("size", x.abs(), &|a, _| a.abs());
        check("sign", x.copysign(y), &|a, b| a.copysign(b));
        check("minimum", x.min(y), &min);
        check("maximum", x.max(y), &max);
        check("before", F::splat(2.5).before(), &|_, _| f32::from_bits(2.5f32.to_bits() - 1));
        check("less", F::unit(x.lt(y)), &|a, b| f32::from(u8::from(a < b)));
        check("choice", F::select(x.le(y), x, y), &|a, b| if a <= b { a } else { b });
        check("both", F::unit(F::and(x.lt(y), F::splat(0.0).lt(y))), &|a, b| f32::from(u8::from(a < b && 0.0 < b)));
        check("either", F::unit(F::or(x.lt(y), F::splat(0.0).lt(y))), &|a, b| f32::from(u8::from(a < b || 0.0 < b)));
        assert_eq!(F::bits(F::mask(0b1010_0110)), 0b1010_0110);
        let rows: [[f32; 4]; LANES] = std::array::from_fn(|i| [a[i], b[i], i as f32, 1.0]);
        let columns = F::transpose(std::array::from_fn(|i| &rows[i])).map(F::to_array);
        for (i, row) in rows.iter().enumerate() {
            assert!((0..4).all(|k| bits(columns[k][i]) == bits(row[k])));
        }
        let back = F::rows(F::transpose(std::array::from_fn(|i| &rows[i])));
        assert!(back.iter().flatten().zip(rows.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}

/// Whole numbers: squares of a heap, their children, and what is stored for them.
fn whole_numbers<F: Lanes>() {
    let numbers: [u32; LANES] = [0, 1, 2, 20, 84, u32::MAX, 1 << 31, (1 << 31) - 1];
    let index = F::index(numbers);
    assert_eq!(F::numbers(index), numbers);
    assert_eq!(F::highest_bits(index), 0b0110_0000);
    for bound in [0, 1, 3, 21, 1 << 31, u32::MAX] {
        let below = F::bits(F::below(index, bound));
        assert!(numbers.iter().enumerate().all(|(i, &n)| (below >> i & 1 == 1) == (n < bound)), "{bound}");
    }
    let children = F::numbers(F::child(index, [F::mask(0b1100), F::mask(0b1010)]));
    for (i, (child, number)) in children.into_iter().zip(numbers).enumerate() {
        let c = 2 * (0b1100 >> i & 1) + (0b1010 >> i & 1);
        assert_eq!(child, number.wrapping_mul(4).wrapping_add(1 + c));
    }
    let sums = F::numbers(F::add_index(index, F::index([3; LANES])));
    assert!(sums.into_iter().zip(numbers).all(|(sum, number)| sum == number.wrapping_add(3)));
    assert_eq!(F::with_bits(index).to_array().map(f32::to_bits), numbers);
    let other = F::index([7; LANES]);
    let chosen = F::numbers(F::select_index(F::mask(0b0101_0101), index, other));
    assert!((0..LANES).all(|i| chosen[i] == if i % 2 == 0 { numbers[i] } else { 7 }));
    let rows: Vec<[f32; 4]> = (0..90).map(|i| [i as f32, 0.5, -1.0, 2.0 * i as f32]).collect();
    for index in [numbers, [0, 1, 89, 3, 4, 5, 6, 7]] {
        let columns = F::gather(&rows, F::index(index)).map(F::to_array);
        for (i, number) in index.into_iter().enumerate() {
            let row = rows.get(number as usize).copied().unwrap_or_default();
            assert!((0..4).all(|k| columns[k][i] == row[k]), "{number}");
        }
    }
    let whole: [[u32; 4]; LANES] = std::array::from_fn(|i| [i as u32, u32::MAX, 0x7f80_0001, 3]);
    let columns = F::transpose_index(std::array::from_fn(|i| &whole[i])).map(F::numbers);
    assert!((0..LANES).all(|i| (0..4).all(|k| columns[k][i] == whole[i][k])));
}

#[test]
fn lanes_are_scalar_operations() {
    on_all_lanes!(operations);
}

#[test]
fn lanes_of_whole_numbers() {
    on_all_lanes!(whole_numbers);
}

/// A tree with a hot texel, dark squares and texels far apart in size.
fn squares(depth: u32) -> (f32, Vec<[f32; 4]>) {
    let mut squares = vec![[0.0f32; 4]; complete_len::<4>(depth).unwrap() as usize];
    let first = complete_len::<4>(depth - 1).unwrap() as usize;
    for (i, texel) in squares[first..].iter_mut().flatten().enumerate() {
        let random = sobol(5, i as u32)[0];
        *texel = if i / 16 % 3 == 0 { 0.0 } else { (random * 30.0 - 20.0).exp2() };
    }
    squares[first + 5][2] = 1e5;
    let average = build(depth, &mut squares).unwrap();
    (average as f32, squares)
}

fn same_walk<F: Lanes>() {
    let (average, squares) = squares(6);
    let light = Light(Tree::complete(6, average, &squares).unwrap());
    let turned = Frame::new(&[0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6]).unwrap();
    for frame in [Frame::IDENTITY, turned] {
        for first in (0..1 << 16).step_by(TOGETHER) {
            let u = lane_points(first);
            let mut samples = vec![Sample::default(); u.len()];
            wide::sample::<F, _>(&light, &frame, &u, &mut samples);
            let expected: Vec<Sample> = u.iter().map(|u| descent::sample(&light, &frame, *u)).collect();
            assert_eq!(samples, expected);
            let direction = |(i, u): (usize, &[f32; 2])| if i % 2 == 0 { samples[i].wi } else { uniform(*u) };
            let wi: Vec<[f32; 3]> = u.iter().enumerate().map(direction).collect();
            let expected: Vec<f32> = wi.iter().map(|wi| descent::pdf(&light, &frame, *wi).unwrap_or(0.0)).collect();
            let mut values = vec![0.0; wi.len()];
            wide::pdf::<F, _>(&light, &frame, &wi, &mut values);
            assert_eq!(values, expected);
        }
    }
}

/// Any direction, or one that is not of unit length.
fn uniform(u: [f32; 2]) -> [f32; 3] {
    let z = 1.0 - 2.0 * u[0].clamp(0.0, 1.0);
    let radius = (1.0 - z * z).sqrt();
    let phi = 6.2 * u[1];
    [radius * phi.cos(), radius * phi.sin(), if u[0] < 0.001 { 7.0 } else { z }]
}

#[test]
fn wide_walks_are_scalar_walks() {
    on_all_lanes!(same_walk);
}

/// A product's bytes, on lanes of a kind.
fn products<F: Lanes>() -> Vec<Built> {
    let (average, squares) = squares(6);
    let light = Tree::complete(6, average, &squares).unwrap();
    let narrow = Lobe { b: 0.05, ..ggx(0.2) };
    let phong = Lobe { kind: WIS_WAVELET_LOBE_PHONG, a: 300.0, ..lambert(0.9) };
    let mut all = Vec::new();
    for lobes in [vec![lambert(0.8)], vec![narrow, lambert(0.1)], vec![ggx(0.01)], vec![phong]] {
        for normal in [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, -0.8, 0.6]] {
            let query = Query { tangent: [0.0, 0.6, 0.8], ..query(normal, [0.36, 0.48, 0.8], &lobes) };
            let mut lobes = Lobes::new(&query, None).unwrap();
            let room = Room::new(Budget::DEFAULT.squares).unwrap();
            let (mut nodes, mut cells) = (vec![Node::default(); room.nodes], vec![Cell::default(); room.cells]);
            let (mut priorities, mut slots) = (vec![0.0; room.priorities], vec![0; room.squares]);
            let mut scratch =
                Scratch { nodes: &mut nodes, cells: &mut cells, priorities: &mut priorities, slots: &mut slots };
            let (frame, budget) = (Frame::IDENTITY, Budget::DEFAULT);
            let built = product::build::<F, Lobes>(light, &frame, &mut lobes, budget, &mut scratch).unwrap();
            let average = scratch.finish(built.base, built.squares);
            nodes.truncate(4 * built.squares as usize + 1);
            all.push((nodes, average.to_bits()));
        }
    }
    all
}

/// The nodes of a product and its average.
type Built = (Vec<Node>, u32);

#[test]
fn products_are_the_same_on_all_lanes() {
    let portable = products::<Portable>();
    assert!(portable.iter().all(|(nodes, _)| nodes.len() > 8));
    assert!(portable == products::<Native>());
}

/// The leaves that a build splits next, by lanes of a kind, until none is worth more than `least`.
fn chosen<F: Lanes>(worth: &[f32], least: f32, room: usize) -> Vec<Vec<usize>> {
    let mut priorities = worth.to_vec();
    priorities.resize(Room::new(worth.len() as u32).expect("room").priorities, 0.0);
    let mut scratch = Scratch { nodes: &mut [], cells: &mut [], priorities: &mut priorities, slots: &mut [] };
    let rounds = std::iter::repeat_with(|| {
        scratch.most_valuable::<F>(worth.len(), least, room).iter().map(|(_, leaf)| leaf).collect::<Vec<_>>()
    });
    rounds.take_while(|batch| !batch.is_empty()).collect()
}

/// Each leaf of more than a worth is split once, of any number of leaves; the best is always among the first, the others
/// are worth most of what the very best would be, and signs, which mark peaks, do not count.
#[test]
fn splits_are_worth_most() {
    let mut random = Random(181);
    let mut share = Mean::default();
    for used in (1..60).chain([127, 128, 129, 500]) {
        for room in [1, 5, LANES] {
            let least = 0.1;
            let worth: Vec<f32> = (0..used).map(|_| random.f32().powi(3) * (random.f32() - 0.5).signum()).collect();
            let batches = chosen::<Portable>(&worth, least, room);
            assert_eq!(batches, chosen::<Native>(&worth, least, room));
            assert!(batches.iter().all(|batch| batch.len() <= room));

            let mut best: Vec<usize> = (0..used).filter(|&leaf| worth[leaf].abs() > least).collect();
            let mut all = batches.concat();
            all.sort_unstable();
            assert_eq!(all, best, "{used} leaves");

            best.sort_by(|&a, &b| worth[b].abs().total_cmp(&worth[a].abs()));
            if let (Some(first), Some(leaf)) = (batches.first(), best.first()) {
                assert!(first.contains(leaf), "{used} leaves");
                let sum = |leaves: &[usize]| leaves.iter().map(|&leaf| f64::from(worth[leaf].abs())).sum::<f64>();
                share.add(sum(first) / sum(&best[..best.len().min(room)]));
            }
        }
    }
    println!("the first batch is worth {:.3} of the best, on average", share.mean);
    assert!(share.mean > 0.95, "{}", share.mean);
}
