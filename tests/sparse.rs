//! Sparse sets of wavelets, rooted or not: products without decompression, terms for an error, and trees of them.

use crate::stored::{Random, Stored};
use crate::support::{BuiltTree, pixel_config, tree_config};
use std::ptr::{null, null_mut};
use wis::ffi::wavelets::sparse::*;
use wis::ffi::wavelets::tree::*;
use wis::status::Status;
use wis::wavelets::approximate::{self, at_least, terms};
use wis::wavelets::sparse::{Details, Set, Sparse, Unfit, is_ordered, multiply, squares, to_tree};
use wis::wavelets::tree::{Link, Tree};
use wis::wavelets::triple::{self, Wavelets};

const DEPTH: u32 = 5;
const SIDE: usize = 1 << DEPTH;

/// Any wavelets, most of them without their ancestors.
fn scattered(random: &mut Random, count: usize, deepest: u32) -> Vec<Wavelets> {
    let mut map = std::collections::BTreeMap::new();
    for _ in 0..count {
        let level = (random.unit() * deepest as f32) as u32;
        let place = (random.unit() * (1u32 << (2 * level)) as f32) as u32;
        let position = place << (2 * (12 - level));
        map.insert((position, level), [0, 1, 2].map(|_| if random.unit() < 0.3 { 0.0 } else { random.unit() - 0.5 }));
    }
    map.into_iter().map(|((position, level), detail)| Wavelets { position, level, detail }).collect()
}

/// The pixels of a set, in Morton order, by the definition.
fn pixels(set: Sparse) -> Vec<f64> {
    let mut pixels = vec![set.average; SIDE * SIDE];
    for w in set.wavelets {
        let quarter = (SIDE * SIDE) >> (2 * w.level + 2);
        let first = (w.position >> (24 - 2 * DEPTH)) as usize;
        for c in 0..4usize {
            let sign = |f: usize| if (f & c).count_ones() % 2 == 1 { -1.0 } else { 1.0 };
            let value: f64 = (1..4).map(|f| sign(f) * f64::from(w.detail[f - 1])).sum();
            pixels[first + c * quarter..][..quarter].iter_mut().for_each(|pixel| *pixel += value);
        }
    }
    pixels
}

#[test]
fn products_are_those_of_the_pixels() {
    let mut random = Random(21);
    for (a, b) in [(0, 0), (1, 0), (0, 7), (1, 1), (5, 3), (40, 40), (400, 10), (1000, 1000)] {
        let (e, f) = (scattered(&mut random, a, DEPTH), scattered(&mut random, b, DEPTH));
        let (e, f) = (Sparse { average: 0.7, wavelets: &e }, Sparse { average: -0.3, wavelets: &f });
        let mut out = vec![Wavelets::default(); 12 * (a + b) + 1];
        let (average, count) = multiply((2, e), (2, f), &mut out).unwrap();
        assert!(count <= 12 * (a + b), "{count}");
        let product = &out[..count];
        assert!(triple::is_ordered(product));
        let got = pixels(Sparse { average, wavelets: product });
        for ((got, e), f) in got.iter().zip(pixels(e)).zip(pixels(f)) {
            assert!((got - e * f).abs() < 1e-5, "{got} for {}", e * f);
        }
        // What does not fit is counted and not written.
        let mut short = vec![Wavelets::default(); count.saturating_sub(1)];
        let unwritten = short.clone();
        assert!(count == 0 || multiply((2, e), (2, f), &mut short) == Err(Unfit::Room(count as u64)));
        assert_eq!(short, unwritten);
    }
}

/// Any wavelets of n axes.
fn details(random: &mut Random, axes: u32, count: usize, deepest: u32) -> Vec<Details> {
    let mut map = std::collections::BTreeMap::new();
    for _ in 0..count {
        let level = (random.unit() * deepest as f32) as u32;
        let place = (random.unit() * (1u32 << (axes * level)) as f32) as u64;
        let mut detail = [0.0; 16];
        detail[1..1 << axes].iter_mut().for_each(|d| *d = random.unit() - 0.5);
        map.insert((place << (axes * (12 - level)), level), detail);
    }
    let element = |((position, level), detail)| Details { position, level, reserved: 0, detail };
    map.into_iter().map(element).collect()
}

/// The pixels of a set of n axes, 2^depth along each, in Morton order, by the definition.
fn pixels_of(axes: u32, depth: u32, set: Set<Details>) -> Vec<f64> {
    let mut pixels = vec![set.average; 1 << (axes * depth)];
    for w in set.wavelets {
        let part = 1usize << (axes * (depth - w.level - 1));
        let first = (w.position >> (axes * (12 - depth))) as usize;
        for c in 0..1usize << axes {
            let sign = |f: usize| if (f & c).count_ones() % 2 == 1 { -1.0 } else { 1.0 };
            let value: f64 = (1..1usize << axes).map(|f| sign(f) * f64::from(w.detail[f])).sum();
            pixels[first + c * part..][..part].iter_mut().for_each(|pixel| *pixel += value);
        }
    }
    pixels
}

/// All pairs of n and m up to 4: against the product of the pixels, where f is constant along the axes that it lacks.
#[test]
fn products_of_different_axes_are_those_of_the_pixels() {
    let mut random = Random(24);
    for (n, m) in (1..=4u32).flat_map(|n| (1..=n).map(move |m| (n, m))) {
        let depth = [0, 6, 4, 3, 2][n as usize];
        for (a, b) in [(0, 0), (0, 3), (1, 0), (4, 4), (30, 20)] {
            let (e, f) = (details(&mut random, n, a, depth), details(&mut random, m, b, depth));
            let (e, f) = (Set { average: 0.7, wavelets: &e }, Set { average: -0.3, wavelets: &f });
            let mut out = vec![Details::default(); 1 << (n * depth)];
            let (average, count) = multiply((n, e), (m, f), &mut out).unwrap();
            let product = &out[..count];
            assert!(is_ordered(product, n));
            let got = pixels_of(n, depth, Set { average, wavelets: product });
            let (e, f) = (pixels_of(n, depth, e), pixels_of(m, depth, f));
            for (i, (got, e)) in got.iter().zip(&e).enumerate() {
                // The pixel of f: the first m bits of each n.
                let level = |k: u32| (i >> (n * k) & ((1 << n) - 1)) >> (n - m) << (m * k);
                let expected = e * f[(0..depth).map(level).sum::<usize>()];
                assert!((got - expected).abs() < 1e-5, "{n} {m}: {got} for {expected}");
            }
        }
    }
    let w = |position, level| Details { position, level, ..Details::default() };
    assert!(is_ordered(&[w(0, 0), w(0, 1), w(7 << 33, 1)], 3));
    let nan = Details { detail: [f32::NAN; 16], ..w(0, 0) };
    for list in [[w(0, 1), w(0, 0)], [w(0, 0), w(1, 1)], [w(0, 0), w(1 << 36, 1)], [w(0, 0), w(0, 12)], [nan, w(0, 3)]]
    {
        assert!(!is_ordered(&list, 3), "{list:?}");
    }
}

/// The tree of a set is the set, raised to the floor, on its finest cells; above them are true averages.
#[test]
fn trees_of_sets() {
    let mut random = Random(22);
    for (count, least) in [(0, 0.0), (1, 0.0), (6, 0.0), (60, 0.01), (900, 0.25)] {
        let list = scattered(&mut random, count, DEPTH);
        let set = Sparse { average: 0.4, wavelets: &list };
        let mut kept = vec![[0.0f32; 4]; squares(2, &list)];
        let mut links = vec![Link::default(); kept.len()];
        let average = to_tree(2, set, least, 2.0, kept.as_flattened_mut(), &mut links);
        let depth = list.iter().map(|w| w.level + 1).max().unwrap_or(0);
        let tree = Tree::<4>::sparse(depth, average as f32, &kept, &links).unwrap();
        let stored =
            Stored { squares: kept.clone(), links: links.clone(), average: average as f32, depth, exponent: 0 };
        let expected: Vec<f64> = pixels(set).iter().map(|x| 2.0 * x.max(least)).collect();
        let mean = expected.iter().sum::<f64>() / expected.len() as f64;
        assert!((average - mean).abs() < 1e-5 && (f64::from(tree.average()) - mean).abs() < 1e-5);
        // C order against Morton order.
        for (i, got) in at_depth(&stored.tree()).into_iter().enumerate() {
            assert!((got - expected[i]).abs() < 1e-5, "{count}: pixel {i}: {got} for {}", expected[i]);
        }
    }
}

/// The same of one to four axes, through C: the product of two free sets as something to sample.
#[test]
fn trees_of_products_of_sets() {
    fn check<const N: usize>(random: &mut Random) {
        let (axes, depth) = (N as u32, [0, 6, 4, 3, 2][N]);
        let (e, f) = (details(random, axes, 12, depth), details(random, 1, 3, depth));
        let (e, f) = (Set { average: 0.7, wavelets: &e }, Set { average: 0.9, wavelets: &f });
        let mut out = vec![Details::default(); 1 << (axes * depth)];
        let (average, count) = multiply((axes, e), (1, f), &mut out).unwrap();
        let (list, least) = (&out[..count], 0.05);
        let (count, details) = (count as u32, list.as_ptr());
        let config = TreeConfig { dimensions: axes, average, count, details, least, ..tree_config(WIS_TREE_DETAILS) };
        let BuiltTree { mut memory, mut handle, info, size } = BuiltTree::new(&config).unwrap();
        // SAFETY: the block is as long as was asked for.
        let opened = unsafe { wis_tree_open(memory.pointer(), size.bytes, &mut handle, null_mut(), null_mut()) };
        assert_eq!((opened, size.scratch_bytes, info.bytes as usize), (Status::Ok, 0, size.bytes));
        let set = Set { average, wavelets: list };
        let expected: Vec<f64> = pixels_of(axes, depth, set).iter().map(|x| x.max(least)).collect();
        let mean = expected.iter().sum::<f64>() / expected.len() as f64;
        assert!((info.average - mean).abs() < 1e-5 && info.dimensions == axes, "{N}: {} {mean}", info.average);
        let pdf = |point: [f32; N]| {
            let mut pdf = f32::NAN;
            // SAFETY: the tree is alive, and the point has as many numbers as it has axes.
            assert_eq!(unsafe { wis_tree_pdf(handle, point.as_ptr(), &mut pdf) }, Status::Ok);
            pdf
        };
        for (i, value) in expected.iter().enumerate() {
            let cell = wis::wavelets::morton::decode::<N>(i as u64, depth);
            let got = f64::from(pdf(cell.map(|c| (c as f32 + 0.5) / (1u32 << depth) as f32))) * mean;
            assert!((got - value).abs() < 1e-4, "{N}: pixel {i}: {got} for {value}");
        }
        for _ in 0..200 {
            let (u, mut point, mut told) = (random.point::<N>(), [0.0f32; N], 0.0);
            // SAFETY: as above.
            let status = unsafe { wis_tree_sample(handle, u.as_ptr(), point.as_mut_ptr(), &mut told) };
            assert_eq!((status, told.to_bits()), (Status::Ok, pdf(point).to_bits()));
        }
    }
    let mut random = Random(29);
    for _ in 0..4 {
        check::<1>(&mut random);
        check::<2>(&mut random);
        check::<3>(&mut random);
        check::<4>(&mut random);
    }
}

/// The pixels of a tree in Morton order, by descent.
fn at_depth(tree: &Tree<4>) -> Vec<f64> {
    let pixel = |i: usize| {
        let (mut value, mut square) = (tree.average(), tree.root_square());
        for level in (0..DEPTH).rev() {
            let Some(here) = square else { break };
            let c = (i >> (2 * level) & 3) as u32;
            value = tree.children(here)[c as usize];
            square = tree.child_square(here, c);
        }
        f64::from(value)
    };
    (0..SIDE * SIDE).map(pixel).collect()
}

/// Of one to four axes, through C: all wavelets are the function, few are its largest, in order, and as many as an error
/// asks for leave that error, measured in pixels.
#[test]
fn the_largest_of_any_axes() {
    fn check<const N: usize, const C: usize>(random: &mut Random) {
        let (axes, depth) = (N as u32, [0, 6, 4, 3, 2][N]);
        let image: Vec<f32> = (0..1usize << (axes * depth)).map(|_| (4.0 * random.unit()).exp() * 1e6).collect();
        let BuiltTree { memory: _memory, handle, info, .. } =
            BuiltTree::new(&pixel_config(axes, depth, 0.0, &image)).unwrap();
        let select = |keep: usize| {
            let (mut list, mut count) = (vec![Details::default(); keep], 0);
            // SAFETY: there is room for `keep` elements.
            let status = unsafe { wis_sparse_select(handle, keep as u32, list.as_mut_ptr(), &mut count, null_mut()) };
            assert_eq!(status, Status::Ok);
            list.truncate(count as usize);
            assert!(is_ordered(&list, axes));
            list
        };
        let mut morton = vec![0.0f32; image.len()];
        wis::wavelets::morton::copy_from_c_order::<N>(depth, &image, &mut morton).unwrap();
        let off = |list: &[Details]| {
            let pixels = pixels_of(axes, depth, Set { average: info.average, wavelets: list });
            let squares: f64 = pixels.iter().zip(&morton).map(|(a, b)| (a - f64::from(*b)).powi(2)).sum();
            (squares / morton.iter().map(|b| f64::from(*b).powi(2)).sum::<f64>()).sqrt()
        };
        let all = select(image.len());
        assert!(off(&all) < 1e-5, "{N}: {}", off(&all));
        let orthonormal = |list: &[Details]| -> Vec<f64> {
            let of = |w: &Details| w.detail.map(|d| f64::from(d.abs()) * 0.5f64.powf(f64::from(axes * w.level) / 2.0));
            let mut sizes: Vec<f64> = list.iter().flat_map(of).filter(|size| *size > 0.0).collect();
            sizes.sort_by(|a, b| b.total_cmp(a));
            sizes
        };
        let sizes = orthonormal(&all);
        for keep in [0, 1, 7, sizes.len() / 2, sizes.len()] {
            let kept = orthonormal(&select(keep));
            assert_eq!(kept.len(), keep);
            assert!(kept.iter().zip(&sizes).all(|(a, b)| (a / b - 1.0).abs() < 1e-5), "{N}: {keep}");
        }
        for error in [0.0, 0.02, 0.1, 0.3] {
            let mut terms = 0;
            // SAFETY: the handle is alive.
            assert_eq!(unsafe { wis_triple_terms(handle, WIS_TERMS_ERROR, error, &mut terms) }, Status::Ok);
            assert!(off(&select(terms as usize)) <= error + 1e-5, "{N}: {error} with {terms}");
            assert!(terms == 0 || off(&select(terms as usize - 1)) > error - 1e-5, "{N}: {error}");
            let mut above = 0;
            let smallest = sizes[(sizes.len() / 3).max(1) - 1];
            // SAFETY: as above.
            assert_eq!(
                unsafe { wis_triple_terms(handle, WIS_TERMS_THRESHOLD, 0.99999 * smallest, &mut above) },
                Status::Ok
            );
            assert_eq!(above as usize, (sizes.len() / 3).max(1), "{N}");
        }
    }
    let mut random = Random(31);
    check::<1, 2>(&mut random);
    check::<2, 4>(&mut random);
    check::<3, 8>(&mut random);
    check::<4, 16>(&mut random);
}

/// So many wavelets leave no more than the error, and one less leaves more.
#[test]
fn terms_are_the_fewest() {
    let mut random = Random(23);
    for kind in 0..3 {
        let image: Vec<f64> = (0..SIDE * SIDE)
            .map(|_| {
                if kind == 2 {
                    f64::from(u8::from(random.unit() < 0.2))
                } else {
                    (4.0 * f64::from(random.unit())).exp()
                }
            })
            .collect();
        let image: Vec<f32> = image.iter().map(|x| *x as f32).collect();
        let stored = Stored::<4>::complete::<2>(DEPTH, &image);
        let tree = stored.tree();
        let mut all = vec![Wavelets::default(); SIDE * SIDE];
        let used = approximate::select(&tree.into(), (SIDE * SIDE) as u32, 0, &mut all).unwrap();
        let energy = |list: &[Wavelets]| -> f64 {
            let own = |w: &Wavelets| {
                w.detail.map(|d| f64::from(d).powi(2)).iter().sum::<f64>() * 0.25f64.powi(w.level as i32)
            };
            list.iter().map(own).sum()
        };
        let whole = f64::from(tree.average()).powi(2) + energy(&all[..used]);
        let size =
            |w: &Wavelets, f: usize| f64::from((f64::from(w.detail[f].abs()) * 0.5f64.powi(w.level as i32)) as f32);
        for threshold in [0.0, 0.01, 0.1, 1.0] {
            let sizes = all[..used].iter().flat_map(|w| (0..3).map(|f| size(w, f)).collect::<Vec<_>>());
            let expected = sizes.filter(|size| *size > 0.0 && 8.0 * size >= threshold).count();
            assert_eq!(at_least(&tree.into(), threshold, 3), expected as u32, "{threshold}");
        }
        for error in [0.0, 0.001, 0.01, 0.1, 0.3, 2.0] {
            let count = terms(&tree.into(), error);
            let lost = |keep: u32| {
                let mut list = vec![Wavelets::default(); keep as usize];
                let used = approximate::select(&tree.into(), keep, 0, &mut list).unwrap();
                ((energy(&all) - energy(&list[..used])).max(0.0) / whole).sqrt()
            };
            assert!(lost(count) <= error + 1e-4, "{error}: {} with {count}", lost(count));
            assert!(count == 0 || lost(count - 1) > error - 1e-4, "{error}: {count} are not the fewest");
        }
    }
}

/// Free thresholding through C: negative values are raised, and sample and pdf are those of what was raised.
#[test]
fn negative_values_are_raised_in_sample_and_pdf() {
    // [4, 0, 0, 0] without its detail in both axes has a pixel of -1.
    let list = [Wavelets { position: 0, level: 0, detail: [1.0, 1.0, 0.0] }];
    for (least, floor) in [(0.0, 0.0), (0.5, 0.5)] {
        let wavelets = list.as_ptr();
        let config = TreeConfig { average: 1.0, count: 1, wavelets, least, ..tree_config(WIS_TREE_WAVELETS) };
        let BuiltTree { mut memory, handle, info, size } = BuiltTree::new(&config).unwrap();
        // SAFETY: the tree is alive.
        unsafe {
            // The values are 3, 1, 1 and -1, which is raised.
            let mean = (3.0 + 1.0 + 1.0 + floor) / 4.0;
            assert!((info.average - mean).abs() < 1e-6 && info.bytes as usize == size.bytes);
            let pdf = |point: [f32; 2]| {
                let mut pdf = f32::NAN;
                assert_eq!(wis_tree_pdf(handle, point.as_ptr(), &mut pdf), Status::Ok);
                f64::from(pdf)
            };
            assert!((pdf([0.2, 0.2]) - 3.0 / mean).abs() < 1e-6);
            assert!((pdf([0.8, 0.8]) - floor / mean).abs() < 1e-6);
            let mut random = Random(3);
            for _ in 0..1000 {
                let (u, mut point, mut told) = ([random.unit(), random.unit()], [0.0f32; 2], 0.0);
                assert_eq!(wis_tree_sample(handle, u.as_ptr(), point.as_mut_ptr(), &mut told), Status::Ok);
                assert!(told > 0.0 && f64::from(told).to_bits() == pdf(point).to_bits());
                assert!(floor > 0.0 || point[0] < 0.5 || point[1] < 0.5);
            }
            // The bytes are a tree like any other.
            let mut opened = null();
            let status = wis_tree_open(memory.pointer(), size.bytes, &mut opened, null_mut(), null_mut());
            assert_eq!(status, Status::Ok);
        }
    }
}

/// Room that is too short is found out from counts: of one wavelet that stands for 8^10 squares, and of any sets.
#[test]
fn rooms_that_are_too_short_cost_nothing() {
    let started = std::time::Instant::now();
    let multiply = |axes: (u32, u32), e: &[Details], f: &[Details], out: &mut [Details]| {
        let (mut count, mut average) = (0, f64::NAN);
        let (size, room, out) = (size_of::<DetailSet>() as u32, out.len() as u32, out.as_mut_ptr());
        let set = |axes, average, list: &[Details]| DetailSet {
            size,
            axes,
            count: list.len() as u32,
            reserved: 0,
            average,
            details: list.as_ptr(),
        };
        // SAFETY: the lists are as long as stated.
        let status = unsafe {
            wis_sparse_multiply(
                &set(axes.0, 0.7, e),
                &set(axes.1, -0.3, f),
                room,
                out,
                &mut count,
                &mut average,
                null_mut(),
            )
        };
        (status, count)
    };
    let wavelet = |level: u32| {
        let mut detail = [0.0; 16];
        detail[1] = 1.0;
        [Details { level, detail, ..Details::default() }]
    };
    let mut room = [Details::default(); 16];
    assert_eq!(multiply((4, 1), &[], &wavelet(10), &mut room), (Status::MemoryTooSmall, ((1u64 << 33) / 7) as u32));
    // More than the count can tell.
    assert_eq!(multiply((4, 1), &[], &wavelet(11), &mut room), (Status::MemoryTooSmall, u32::MAX));
    assert!(started.elapsed().as_secs_f64() < 1.0, "{:?}", started.elapsed());
    let mut random = Random(25);
    for (n, m) in (1..=4u32).flat_map(|n| (1..=n).map(move |m| (n, m))) {
        let depth = [0, 6, 4, 3, 2][n as usize];
        let (e, f) = (details(&mut random, n, 9, depth), details(&mut random, m, 4, depth));
        let mut long = vec![Details::default(); 1 << (n * depth)];
        let (status, count) = multiply((n, m), &e, &f, &mut long);
        assert_eq!(status, Status::Ok);
        long.truncate(count as usize);
        assert_eq!(multiply((n, m), &e, &f, &mut long), (Status::Ok, count));
        long.pop();
        let before = long.clone();
        assert_eq!(multiply((n, m), &e, &f, &mut long), (Status::MemoryTooSmall, count));
        assert_eq!(long, before);
    }
}
