//! Visibility in 8 bits: what is lost, what is refused, and integrals with it; blends of approximations; grids of
//! directions.

use crate::support::{BuiltTree, Memory, Random, normalise, pixel_config};
use std::ptr::{null, null_mut};
use wis::ffi::MemorySize;
use wis::ffi::wavelets::table::*;
use wis::ffi::wavelets::triple::*;
use wis::ffi::wavelets::visibility::*;
use wis::status::Status;
use wis::wavelets::triple::Wavelets;

const DEPTH: u32 = 5;
const PIXELS: usize = 1 << (2 * DEPTH);

fn tree(pixels: &[f32]) -> BuiltTree {
    BuiltTree::new(&pixel_config(2, DEPTH, 0.0, pixels)).unwrap()
}

/// Bits in patches, or shares.
fn image(random: &mut Random, binary: bool) -> Vec<f32> {
    let patches: Vec<f32> = (0..64).map(|_| random.f32()).collect();
    let at = |i: usize| patches[(i >> DEPTH) / 4 * 8 + i % (1 << DEPTH) / 4];
    let noise = |share: f32, x: f32| if share < 0.3 { 0.0 } else { f32::from(u8::from(share > 0.8 || x < share)) };
    (0..PIXELS).map(|i| if binary { noise(at(i), random.f32()) } else { at(i) }).collect()
}

fn compress(tree: &BuiltTree) -> Result<(Memory, *const Visibility), Status> {
    let (mut size, mut handle) = (MemorySize::default(), null());
    // SAFETY: the block is as long as was asked for.
    unsafe {
        assert_eq!(wis_visibility_size(tree.handle, &mut size, null_mut()), Status::Ok);
        let mut memory = Memory::new(size.bytes);
        let status = wis_visibility_init(tree.handle, memory.pointer(), size.bytes, &mut handle, null_mut());
        if status == Status::Ok { Ok((memory, handle)) } else { Err(status) }
    }
}

fn select(tree: &BuiltTree, keep: usize) -> Vec<Wavelets> {
    let (mut list, mut count) = (vec![Wavelets::default(); keep], 0);
    // SAFETY: there is room for `keep` elements.
    let status = unsafe {
        wis_triple_select(tree.handle, WIS_SELECT_WAVELETS, keep as u32, list.as_mut_ptr(), &mut count, null_mut())
    };
    assert_eq!(status, Status::Ok);
    list.truncate(count as usize);
    list
}

fn integral(brdf: (f64, &[Wavelets]), kept: &[Wavelets], light: &BuiltTree, visible: *const Visibility) -> f64 {
    let mut integral = f64::NAN;
    let (count, list) = (brdf.1.len() as u32, brdf.1.as_ptr());
    let (lights, kept) = (kept.len() as u32, kept.as_ptr());
    // SAFETY: the lists are as long as they say, and the handles are alive.
    let status = unsafe {
        wis_visibility_integral(brdf.0, count, list, lights, kept, light.handle, visible, &mut integral, null_mut())
    };
    assert_eq!(status, Status::Ok);
    integral
}

/// With all wavelets kept the integral is that of the pixels, up to what 8 bits lose in the averages of large squares:
/// half a step of 1/255, where the wavelets of BRDF and light meet.
#[test]
fn integrals_with_eight_bits() {
    let mut random = Random(3);
    let mut largest: f64 = 0.0;
    for case in 0..8 {
        let shares: Vec<f32> = (0..PIXELS).map(|_| random.f32()).collect();
        let lights: Vec<f32> = (0..PIXELS).map(|i| if i % 97 == 0 { 40.0 } else { random.f32() }).collect();
        let seen = image(&mut random, case % 2 == 0);
        let (brdf, light, visible) = (tree(&shares), tree(&lights), tree(&seen));
        let (memory, handle) = compress(&visible).unwrap();
        let value = integral((brdf.info.average, &select(&brdf, PIXELS)), &select(&light, PIXELS), &light, handle);
        let products = shares.iter().zip(&lights).zip(&seen);
        let exact = products.map(|((b, l), v)| f64::from(b * l * v)).sum::<f64>() / PIXELS as f64;
        largest = largest.max((value / exact - 1.0).abs());
        // Opened from other memory it is the same.
        let mut copy = Memory::copy(memory.bytes());
        let (mut opened, bytes) = (null(), memory.len());
        // SAFETY: the block is as long as stated.
        let status = unsafe { wis_visibility_open(copy.pointer(), bytes, &mut opened, null_mut()) };
        assert_eq!(status, Status::Ok);
        let again = integral((brdf.info.average, &select(&brdf, PIXELS)), &select(&light, PIXELS), &light, opened);
        assert_eq!(again.to_bits(), value.to_bits());
    }
    assert!(largest < 0.01, "{largest}");
    assert!(largest > 1e-6, "8 bits lose something: {largest}");
}

/// Stored averages are the nearest bytes: off by 1/510 at most, and as often too high as too low.
#[test]
fn averages_are_rounded_to_the_nearest_byte() {
    use wis::wavelets::triple::Quadtree;
    let averages: Vec<f32> = (0..1024).map(|i| (i as f32 + 0.5) / 1024.0).collect();
    let squares: Vec<[f32; 4]> = averages.chunks_exact(4).map(|four| [four[0], four[1], four[2], four[3]]).collect();
    let mut sum = 0.0;
    for square in squares {
        let squares = [square];
        let tree = wis::wavelets::tree::Tree::<4>::complete(1, square.iter().sum::<f32>() / 4.0, &squares).unwrap();
        let mut nodes = [wis::wavelets::visibility::Node::default()];
        wis::wavelets::visibility::compress(&tree, 1.0, &mut nodes).unwrap();
        let stored = wis::wavelets::visibility::Visibility::new(tree.average(), &nodes).unwrap().children(0);
        for (stored, exact) in stored.into_iter().zip(square) {
            assert!((stored - exact).abs() <= 1.0 / 510.0 + 1e-6, "{stored} for {exact}");
            sum += f64::from(stored - exact) / 1024.0;
        }
    }
    assert!(sum.abs() < 1e-4, "off by {sum} on average");
}

/// What is seen of a product is the sum over pixels, to rounding, since bits lose nothing in 8 bits: for complete and
/// for pruned trees, and where either is constant.
#[test]
fn products_seen_through_bits_are_exact() {
    let mut random = Random(13);
    let block = |i: usize| (i >> DEPTH) / 8 * 4 + i % (1 << DEPTH) / 8;
    let mut images: Vec<Vec<f32>> = vec![vec![3.0; PIXELS], vec![0.0; PIXELS]];
    images.push((0..PIXELS).map(|i| if i % 97 == 0 { 4000.0 } else { random.f32() }).collect());
    let steps: Vec<f32> = (0..16).map(|_| random.f32()).collect();
    images.push((0..PIXELS).map(|i| steps[block(i)]).collect());
    let mut maps: Vec<Vec<f32>> = vec![vec![0.0; PIXELS], vec![1.0; PIXELS]];
    maps.extend((0..4).map(|_| image(&mut random, true)));
    for pixels in &images {
        let function = tree(pixels);
        for seen in &maps {
            let (_memory, handle) = compress(&tree(seen)).unwrap();
            let mut integral = f64::NAN;
            // SAFETY: both handles are alive.
            let status = unsafe { wis_visibility_product_integral(function.handle, handle, &mut integral) };
            assert_eq!(status, Status::Ok);
            let products = pixels.iter().zip(seen).map(|(a, b)| f64::from(*a) * f64::from(*b));
            let exact = products.sum::<f64>() / PIXELS as f64;
            assert!((integral - exact).abs() <= 1e-6 * exact, "{integral} {exact}");
        }
    }
}

/// Constant visibility is exact and takes a header.
#[test]
fn constant_visibility() {
    let mut random = Random(5);
    let (brdf, light) = ([0; PIXELS].map(|_| random.f32()), [0; PIXELS].map(|_| random.f32()));
    let exact = brdf.iter().zip(&light).map(|(b, l)| f64::from(*b) * f64::from(*l)).sum::<f64>() / PIXELS as f64;
    let (brdf, light) = (tree(&brdf), tree(&light));
    for seen in [0.0f32, 1.0] {
        let (memory, handle) = compress(&tree(&[seen; PIXELS])).unwrap();
        assert_eq!(memory.len(), 24, "a header alone");
        let value = integral((brdf.info.average, &select(&brdf, PIXELS)), &select(&light, PIXELS), &light, handle);
        assert!((value - f64::from(seen) * exact).abs() < 1e-6, "{value}");
    }
}

#[test]
fn more_than_everything_is_no_visibility() {
    let mut pixels = vec![1.0; PIXELS];
    pixels[77] = 1.001;
    assert_eq!(compress(&tree(&pixels)).err(), Some(Status::InvalidArgument));
    assert_eq!(compress(&tree(&[1.5; PIXELS])).err(), Some(Status::InvalidArgument));
}

/// A blend is the weighted sum, wavelet by wavelet, in order.
#[test]
fn blends_are_weighted_sums() {
    let mut random = Random(9);
    let lists: Vec<Vec<Wavelets>> = (0..16)
        .map(|k| {
            let pixels: Vec<f32> = (0..PIXELS).map(|_| random.f32()).collect();
            select(&tree(&pixels), [0, 5, 60][k % 3])
        })
        .collect();
    let weights: Vec<f64> = (0..16).map(|_| random.f64() - 0.25).collect();
    let (handles, counts): (Vec<_>, Vec<_>) = lists.iter().map(|list| (list.as_ptr(), list.len() as u32)).unzip();
    let mut expected = std::collections::BTreeMap::new();
    for (list, weight) in lists.iter().zip(&weights) {
        for w in list {
            let sums = expected.entry((w.position, w.level)).or_insert([0.0f64; 3]);
            sums.iter_mut().zip(w.detail).for_each(|(sum, d)| *sum += weight * f64::from(d));
        }
    }
    let blend = |room: usize| {
        let (mut list, mut count) = (vec![Wavelets::default(); room], 0);
        let (handles, counts, weights) = (handles.as_ptr(), counts.as_ptr(), weights.as_ptr());
        // SAFETY: sixteen lists, and room for as many elements as is said.
        let status = unsafe {
            wis_triple_blend(16, handles, counts, weights, room as u32, list.as_mut_ptr(), &mut count, null_mut())
        };
        list.truncate(count as usize);
        (status, count as usize, list)
    };
    let (status, count, list) = blend(16 * 60);
    assert_eq!((status, count), (Status::Ok, expected.len()));
    for (got, ((position, level), detail)) in list.iter().zip(&expected) {
        assert_eq!((got.position, got.level), (*position, *level));
        assert_eq!(got.detail, detail.map(|d| d as f32));
    }
    let (status, count, _) = blend(expected.len() - 1);
    assert_eq!((status, count), (Status::MemoryTooSmall, expected.len()));
    let mut count = 9;
    // SAFETY: nothing is read or written but the count.
    let status = unsafe { wis_triple_blend(0, null(), null(), null(), 0, null_mut(), &mut count, null_mut()) };
    assert_eq!((status, count), (Status::Ok, 0));
    // SAFETY: refused before anything is read.
    let status =
        unsafe { wis_triple_blend(17, handles.as_ptr(), null(), null(), 0, null_mut(), &mut count, null_mut()) };
    assert_eq!(status, Status::InvalidArgument);
}

fn cells(side: u32, wi: [f32; 3]) -> ([u32; 4], [f32; 4]) {
    let (mut cell, mut weights) = ([0; 4], [0.0; 4]);
    // SAFETY: the arrays are as long as the header says.
    assert_eq!(unsafe { wis_grid_cells(side, &wi, &mut cell, &mut weights) }, Status::Ok);
    (cell, weights)
}

fn centre(side: u32, cell: u32) -> [f32; 3] {
    let (mut direction, point) = ([0.0; 3], [cell / side, cell % side].map(|k| (k as f32 + 0.5) / side as f32));
    // SAFETY: the arrays are as long as the header says; no frame is the identity.
    assert_eq!(unsafe { wis_square_direction(&point, null(), &mut direction) }, Status::Ok);
    direction
}

/// Weights are a partition of 1, a cell's centre is its own, and interpolation of a smooth function comes close
/// everywhere, across all edges of the square too, where the map has kinks and the error falls with the side only.
#[test]
fn grids_interpolate() {
    let mut random = Random(11);
    for side in [1u32, 2, 3, 8, 33] {
        for cell in 0..side * side {
            let (cells, weights) = cells(side, centre(side, cell));
            let own: f32 = cells.iter().zip(weights).filter(|(c, _)| **c == cell).map(|(_, w)| w).sum();
            assert!((own - 1.0).abs() < 1e-4, "{cell} of {side}: {cells:?} {weights:?}");
        }
        let value = |d: [f32; 3]| d[0] + 0.7 * d[1] - 0.4 * d[2] + d[0] * d[2];
        let mut largest = 0.0f32;
        for k in 0..4000 {
            let mut d = random.direction();
            // Half of them next to the seams: the lower half of the planes x = 0 and y = 0, and the south pole.
            if k % 4 == 0 {
                (d[k / 4 % 2], d[2]) = (1e-4 * random.f64(), -d[2].abs());
            }
            if k % 4 == 2 {
                (d[0], d[1], d[2]) = (0.05 * d[0], 0.05 * d[1], -1.0);
            }
            let wi = normalise(d);
            let (cells, weights) = cells(side, wi);
            assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5 && weights.iter().all(|w| *w >= 0.0));
            let blended: f32 = cells.iter().zip(weights).map(|(c, w)| w * value(centre(side, *c))).sum();
            largest = largest.max((blended - value(wi)).abs());
        }
        let bound = [(8, 0.4), (33, 0.1)].iter().find(|(s, _)| *s == side).map_or(4.0, |(_, bound)| *bound);
        assert!(largest < bound, "side {side}: {largest}");
    }
}

#[test]
fn grids_out_of_range() {
    let (mut cell, mut weights) = ([0; 4], [0.0; 4]);
    for (side, wi, status) in [
        (0, [0.0, 0.0, 1.0], Status::InvalidArgument),
        (8, [0.0, 0.0, 2.0], Status::InvalidTransform),
        (8, [f32::NAN, 0.0, 1.0], Status::InvalidTransform),
        (8, [0.0, 0.0, -1.0], Status::Ok),
        (4096, [-1.0, 0.0, 0.0], Status::Ok),
    ] {
        // SAFETY: the arrays are as long as the header says.
        assert_eq!(unsafe { wis_grid_cells(side, &wi, &mut cell, &mut weights) }, status);
        assert!(cell.iter().all(|cell| *cell < 4096 * 4096));
    }
}
