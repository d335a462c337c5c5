//! Sparse sets of wavelets, rooted or not: terms for an error, trees of them, and how they are stored.

use crate::stored::{Random, Stored};
use crate::support::{BuiltTree, pixel_config, tree_config};
use std::ptr::{null, null_mut};
use wis::ffi::wavelets::tree::*;
use wis::ffi::wavelets::triple::*;
use wis::status::Status;
use wis::wavelets::approximate::{self, Of, at_least, terms};
use wis::wavelets::packed::{pack, unpack};
use wis::wavelets::sparse::{Sparse, squares, to_tree};
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

/// The tree of a set is the set, raised to the floor, on its finest cells; above them are true averages.
#[test]
fn trees_of_sets() {
    let mut random = Random(22);
    for (count, least) in [(0, 0.0), (1, 0.0), (6, 0.0), (60, 0.01), (900, 0.25)] {
        let list = scattered(&mut random, count, DEPTH);
        let set = Sparse { average: 0.4, wavelets: &list };
        let mut kept = vec![[0.0f32; 4]; squares(&list)];
        let mut links = vec![Link::default(); kept.len()];
        let average = to_tree(set, least, 2.0, kept.as_flattened_mut(), &mut links);
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

/// Through C: all wavelets are the function, few are its largest, in order, and as many as an error asks for leave that error,
/// measured in pixels.
#[test]
fn the_largest_are_kept() {
    let mut random = Random(31);
    let image: Vec<f32> = (0..SIDE * SIDE).map(|_| (4.0 * random.unit()).exp() * 1e6).collect();
    let BuiltTree { memory: _memory, handle, info, .. } = BuiltTree::new(&pixel_config(2, DEPTH, 0.0, &image)).unwrap();
    let select = |keep: usize| {
        let (mut list, mut count) = (vec![Wavelets::default(); keep], 0);
        let (rule, to) = (WIS_SELECT_WAVELETS, list.as_mut_ptr());
        // SAFETY: there is room for `keep` elements.
        let status = unsafe { wis_triple_select(handle, rule, keep as u32, to, &mut count, null_mut()) };
        assert_eq!(status, Status::Ok);
        list.truncate(count as usize);
        assert!(triple::is_ordered(&list));
        list
    };
    let mut morton = vec![0.0f32; image.len()];
    wis::wavelets::morton::copy_from_c_order::<2>(DEPTH, &image, &mut morton).unwrap();
    let off = |wavelets: &[Wavelets]| {
        let pixels = pixels(Sparse { average: info.average, wavelets });
        let squares: f64 = pixels.iter().zip(&morton).map(|(a, b)| (a - f64::from(*b)).powi(2)).sum();
        (squares / morton.iter().map(|b| f64::from(*b).powi(2)).sum::<f64>()).sqrt()
    };
    let all = select(image.len());
    assert!(off(&all) < 1e-5, "{}", off(&all));
    let orthonormal = |list: &[Wavelets]| -> Vec<f64> {
        let of = |w: &Wavelets| w.detail.map(|d| f64::from(d.abs()) * 0.5f64.powi(w.level as i32));
        let mut sizes: Vec<f64> = list.iter().flat_map(of).filter(|size| *size > 0.0).collect();
        sizes.sort_by(|a, b| b.total_cmp(a));
        sizes
    };
    let sizes = orthonormal(&all);
    for keep in [0, 1, 7, sizes.len() / 2, sizes.len()] {
        let kept = orthonormal(&select(keep));
        assert_eq!(kept.len(), keep);
        assert!(kept.iter().zip(&sizes).all(|(a, b)| (a / b - 1.0).abs() < 1e-5), "{keep}");
    }
}

/// As many as an error or a threshold asks for, by the definition.
#[test]
fn terms_by_definition() {
    let mut random = Random(31);
    for depth in [1, 2, 4, 6] {
        let image: Vec<f32> = (0..1usize << (2 * depth)).map(|_| (4.0 * random.unit()).exp() * 1e6).collect();
        let BuiltTree { memory: _memory, handle, info, .. } =
            BuiltTree::new(&pixel_config(2, depth, 0.0, &image)).unwrap();
        // All orthonormal coefficients, by Haar's steps along the last n bits of Morton order.
        let mut morton = vec![0.0f32; image.len()];
        wis::wavelets::morton::copy_from_c_order::<2>(depth, &image, &mut morton).unwrap();
        let (mut values, mut sizes): (Vec<f64>, _) = (morton.iter().map(|v| f64::from(*v)).collect(), Vec::new());
        for level in (0..depth).rev() {
            let each = |square: &[f64]| -> Vec<f64> {
                let sign = |f: usize, c: usize| if (f & c).count_ones() % 2 == 1 { -1.0 } else { 1.0 };
                (0..4).map(|f| square.iter().enumerate().map(|(c, v)| sign(f, c) * v).sum::<f64>() / 4.0).collect()
            };
            let squares: Vec<Vec<f64>> = values.chunks(4).map(each).collect();
            let orthonormal = |d: &f64| d.abs() * 0.5f64.powi(level as i32);
            sizes.extend(squares.iter().flat_map(|square| square[1..].iter().map(orthonormal)));
            values = squares.iter().map(|square| square[0]).collect();
        }
        sizes.sort_by(|a, b| b.total_cmp(a));
        let all = info.average.powi(2) + sizes.iter().map(|size| size * size).sum::<f64>();
        let off = |keep: usize| (sizes[keep..].iter().map(|size| size * size).sum::<f64>() / all).sqrt();
        let terms = |rule: u32, bound: f64| {
            let mut terms = 0;
            // SAFETY: the handle is alive.
            assert_eq!(unsafe { wis_triple_terms(handle, rule, bound, &mut terms) }, Status::Ok);
            terms as usize
        };
        for error in [0.0, 0.02, 0.1, 0.3] {
            let count = terms(WIS_TERMS_ERROR, error);
            assert!(off(count) <= error + 1e-5, "{depth}: {error} with {count}");
            assert!(count == 0 || off(count - 1) > error - 1e-5, "{depth}: {error}");
        }
        let third = (sizes.len() / 3).max(1);
        assert_eq!(terms(WIS_TERMS_THRESHOLD, 0.99999 * sizes[third - 1]), third, "{depth}");
    }
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
        let used = approximate::select(&tree, Of::Wavelets, (SIDE * SIDE) as u32, 0, &mut all).unwrap();
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
            assert_eq!(at_least(&tree, threshold, 3), expected as u32, "{threshold}");
        }
        for error in [0.0, 0.001, 0.01, 0.1, 0.3, 2.0] {
            let count = terms(&tree, error);
            let lost = |keep: u32| {
                let mut list = vec![Wavelets::default(); keep as usize];
                let used = approximate::select(&tree, Of::Wavelets, keep, 0, &mut list).unwrap();
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

/// What is packed.
fn packed(average: f32, list: &[Wavelets]) -> Vec<u8> {
    let mut bytes = vec![0; 16 + 18 * list.len()];
    let length = pack(average, list, &mut bytes);
    bytes.truncate(length);
    bytes
}

/// Every coefficient comes back within half of a step, in order, at every depth; what rounds to 0 is dropped.
#[test]
fn what_is_packed_comes_back() {
    let mut random = Random(41);
    for (count, deepest) in [(0, 0), (1, 0), (1, 11), (40, 3), (900, DEPTH), (2000, 11), (5000, 6)] {
        let list = scattered(&mut random, count, deepest);
        let bytes = packed(-0.75, &list);
        let coefficients = list.iter().flat_map(|w| w.detail.map(|d| d * 0.5f32.powi(w.level as i32)));
        let step = coefficients.clone().fold(0.0f32, |most, c| most.max(c.abs())) / 32767.0;
        let kept =
            list.iter().filter(|w| w.detail.iter().any(|d| (d * 0.5f32.powi(w.level as i32)).abs() > 0.501 * step));
        let mut back = vec![Wavelets::default(); bytes.len() / 3];
        let (average, squares) = unpack(&bytes, &mut back).unwrap();
        back.truncate(squares);
        assert!(average == -0.75 && triple::is_ordered(&back));
        let mut read = back.iter().peekable();
        let mut met = 0;
        for w in &list {
            let there = read.next_if(|b| (b.position, b.level) == (w.position, w.level));
            met += usize::from(there.is_some());
            let half = 0.5001 * step * 2f32.powi(w.level as i32);
            let detail = there.map_or([0.0; 3], |there| there.detail);
            assert!(w.detail.iter().zip(detail).all(|(a, b)| (a - b).abs() <= half), "{w:?} {there:?}");
        }
        assert!(met == back.len() && met >= kept.count(), "{count} {deepest}");
        // Dense ones take an index of a byte or two.
        let coefficients = back.iter().flat_map(|w| w.detail).filter(|d| *d != 0.0).count();
        assert!(bytes.len() <= 16 + 6 * coefficients && (deepest != 6 || bytes.len() <= 16 + 7 * coefficients / 2));
        // Packed again, nothing changes any more.
        let mut again = vec![Wavelets::default(); back.len()];
        let (_, squares) = unpack(&packed(average, &back), &mut again).unwrap();
        let near = |(a, b): (&Wavelets, &Wavelets)| {
            a.detail.iter().zip(b.detail).all(|(a, b)| (a - b).abs() <= 1e-5 * a.abs())
        };
        assert!(squares == back.len() && back.iter().zip(&again).all(near));
    }
}

/// Through C: a slice that was packed is a tree, with the values of the list; rooms that are too short tell what they lack.
#[test]
fn packed_slices_are_trees() {
    let list = scattered(&mut Random(42), 300, DEPTH);
    let (mut bytes, mut used) = (vec![0u8; 16 + 18 * list.len()], 0);
    let pack = |room: usize, bytes: &mut [u8], used: &mut usize| {
        // SAFETY: the list and the room are as long as stated.
        unsafe { wis_sparse_pack(2.0, list.len() as u32, list.as_ptr(), room, bytes.as_mut_ptr(), used, null_mut()) }
    };
    assert_eq!(pack(bytes.len(), &mut bytes, &mut used), Status::Ok);
    let length = used;
    assert_eq!((pack(length, &mut bytes, &mut used), used), (Status::Ok, length));
    assert_eq!((pack(length - 1, &mut bytes[..length - 1], &mut used), used), (Status::MemoryTooSmall, length));
    // It stands behind other bytes, and others stand behind it.
    let whole = [&[7u8; 5], &packed(2.0, &list)[..], &[9; 3]].concat();
    let (mut back, mut count, mut average) = (vec![Wavelets::default(); 300], 0, 0.0);
    let mut unpack = |room: usize, back: &mut [Wavelets]| {
        let packed = whole[5..].as_ptr();
        // SAFETY: as above.
        let status = unsafe {
            wis_sparse_unpack(packed, length + 3, room as u32, back.as_mut_ptr(), &mut count, &mut average, null_mut())
        };
        (status, count as usize, average)
    };
    let (status, squares, average) = unpack(300, &mut back);
    assert_eq!((status, average, unpack(squares, &mut back).0), (Status::Ok, 2.0, Status::Ok));
    assert_eq!(unpack(squares - 1, &mut back[..squares - 1]), (Status::MemoryTooSmall, squares, 2.0));
    assert_eq!(unpack(squares, &mut back).0, Status::Ok);
    let wavelets = back.as_ptr();
    let config = TreeConfig { average, count: squares as u32, wavelets, least: 0.1, ..tree_config(WIS_TREE_WAVELETS) };
    let tree = BuiltTree::new(&config).unwrap();
    let raised = |wavelets| pixels(Sparse { average, wavelets }).into_iter().map(|x| x.max(0.1)).sum::<f64>();
    let mean = raised(&list) / (SIDE * SIDE) as f64;
    assert!((tree.info.average / mean - 1.0).abs() < 1e-4, "{} {mean}", tree.info.average);
}

/// Whatever the bytes are, what is read is in order and finite, or they are refused.
#[test]
fn spoiled_bytes_are_refused_or_in_order() {
    let (mut random, mut refused) = (Random(43), 0);
    let bytes = packed(1.0, &scattered(&mut random, 60, 11));
    let mut back = vec![Wavelets::default(); bytes.len()];
    for cut in 0..bytes.len() {
        assert_eq!(unpack(&bytes[..cut], &mut back), Err(Status::Corrupt), "{cut}");
    }
    for _ in 0..20_000 {
        let mut spoiled = bytes.clone();
        let place = (random.unit() * 40.0) as usize;
        spoiled[place] ^= 1 << ((random.unit() * 8.0) as u32 & 7);
        match unpack(&spoiled, &mut back) {
            Ok((average, count)) => assert!(average.is_finite() && triple::is_ordered(&back[..count]), "{place}"),
            Err(status) => refused += usize::from(status == Status::Corrupt),
        }
    }
    assert!(refused > 2000, "{refused}");
    // Indices ascend.
    let mut square = packed(1.0, &[Wavelets { position: 0, level: 0, detail: [1.0; 3] }]);
    assert!(unpack(&square, &mut back).is_ok() && square[19] == 1);
    square[19] = 0;
    assert_eq!(unpack(&square, &mut back), Err(Status::Corrupt));
}
