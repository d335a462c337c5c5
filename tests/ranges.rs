//! Numbers beyond the range of a float or a double: a status, never infinity or NaN with WIS_OK. And integrals of functions
//! that are nowhere negative are not.

use crate::stored::Random;
use crate::support::{BuiltTree, Memory, pixel_config, tree_config};
use std::ptr::{null, null_mut};
use wis::ffi::wavelets::tree::*;
use wis::ffi::wavelets::triple::*;
use wis::ffi::wavelets::visibility::*;
use wis::ffi::{Diagnostic, MemorySize};
use wis::status::Status;
use wis::wavelets::triple::Wavelets;
use wis::{Block, Map};

/// A tree of two axes.
fn tree(depth: u32, pixels: &[f32]) -> BuiltTree {
    BuiltTree::new(&pixel_config(2, depth, 0.0, pixels)).unwrap()
}

/// The product, which opens.
fn multiply(e: &BuiltTree, f: &BuiltTree, g: &BuiltTree) -> Result<BuiltTree, Status> {
    let trees = [e.handle, f.handle, g.handle];
    let config = TreeConfig { tree_count: 3, trees: trees.as_ptr(), ..tree_config(WIS_TREE_PRODUCT) };
    let mut built = BuiltTree::new(&config)?;
    let (place, bytes) = (built.memory.pointer(), built.size.bytes);
    // SAFETY: the block is as long as was asked for.
    let opened = unsafe { wis_tree_open(place, bytes, &mut built.handle, null_mut(), null_mut()) };
    assert_eq!(opened, Status::Ok);
    assert!((0.0..=f64::MAX).contains(&built.info.average));
    Ok(built)
}

fn cube(tree: &BuiltTree) -> Result<BuiltTree, Status> {
    multiply(tree, tree, tree)
}

/// 1.6e38 and about 5e345; 2e-39 and about 2e-348.
#[test]
fn trees_beyond_a_double() {
    for pixels in [[3e38f32, 1e38, 0.0, 2e38], [1e-39, 2e-39, 0.0, 5e-39]] {
        let third = cube(&tree(1, &pixels)).unwrap();
        assert_eq!(cube(&third).err(), Some(Status::Overflow));
    }
    // 4.3e115 squared is still a double.
    let huge = cube(&tree(1, &[3e38, 1e38, 0.0, 2e38])).unwrap();
    let one = tree(0, &[1.0]);
    let square = multiply(&huge, &huge, &one).unwrap();
    assert_eq!(multiply(&square, &huge, &one).err(), Some(Status::Overflow));
    // What is 0 everywhere is 0 at any scale.
    let (left, right) = (tree(1, &[3e38, 0.0, 3e38, 0.0]), tree(1, &[0.0, 3e38, 0.0, 3e38]));
    let (left, right) = (cube(&left).unwrap(), cube(&right).unwrap());
    assert_eq!(multiply(&left, &right, &left).unwrap().info.average, 0.0);
}

#[test]
fn blends_beyond_a_double() {
    let (one, huge) = (tree(1, &[1.0, 2.0, 3.0, 4.0]), tree(1, &[3e38, 0.0, 0.0, 1e38]));
    for (tree, weight, fits) in [(&one, 1e307, true), (&huge, 1e300, false), (&one, 1.7e308, false)] {
        let (trees, weight, blend) = ([tree.handle], [weight], tree_config(WIS_TREE_BLEND));
        let config = TreeConfig { tree_count: 1, trees: trees.as_ptr(), weight: weight.as_ptr(), ..blend };
        let status = BuiltTree::new(&config).err();
        assert_eq!(status, if fits { None } else { Some(Status::Overflow) }, "{weight:?}");
    }
}

/// Details of values beyond a float: of a tree, of a blend; and averages that are packed.
#[test]
fn details_beyond_a_float() {
    let huge = cube(&tree(1, &[3e38, 1e38, 0.0, 2e38])).unwrap();
    let (mut list, mut count) = ([Wavelets::default(); 4], 0);
    // SAFETY: there is room for four elements.
    unsafe {
        assert_eq!(
            wis_triple_select(huge.handle, WIS_SELECT_WAVELETS, 4, list.as_mut_ptr(), &mut count, null_mut()),
            Status::Overflow
        );
        assert_eq!(
            wis_triple_select(huge.handle, WIS_SELECT_SQUARES, 4, list.as_mut_ptr(), &mut count, null_mut()),
            Status::Overflow
        );
        // Nothing that is kept is too large.
        assert_eq!(
            wis_triple_select(huge.handle, WIS_SELECT_WAVELETS, 0, list.as_mut_ptr(), &mut count, null_mut()),
            Status::Ok
        );
    }
    let wavelets = [Wavelets { detail: [3e38; 3], ..Wavelets::default() }];
    let packed = |average: f64| {
        let (mut out, mut bytes) = ([0u8; 34], 0);
        // SAFETY: list and room are as long as stated.
        unsafe { wis_sparse_pack(average, 1, wavelets.as_ptr(), 34, out.as_mut_ptr(), &mut bytes, null_mut()) }
    };
    assert_eq!([3e38, 4e38, f64::NAN].map(packed), [Status::Ok, Status::Overflow, Status::InvalidArgument]);
    let (lists, counts) = ([wavelets.as_ptr(); 2], [1u32; 2]);
    for (weights, expected) in
        [([0.5, 0.5], Status::Ok), ([1.0, 1.0], Status::Overflow), ([1e308, -1e308], { Status::Overflow })]
    {
        let (mut out, mut count) = ([Wavelets::default(); 2], 0);
        // SAFETY: as above.
        let status = unsafe {
            wis_triple_blend(
                2,
                lists.as_ptr(),
                counts.as_ptr(),
                weights.as_ptr(),
                2,
                out.as_mut_ptr(),
                &mut count,
                null_mut(),
            )
        };
        assert_eq!(status, expected, "{weights:?}");
    }
}

/// Integrals of trees whose units multiply beyond a double.
#[test]
fn integrals_beyond_a_double() {
    let huge = cube(&tree(1, &[3e38, 1e38, 0.0, 2e38])).unwrap();
    let one = tree(0, &[1.0]);
    let x = multiply(&huge, &huge, &one).unwrap();
    let black = tree(1, &[0.0; 4]);
    let triple = |trees: [&BuiltTree; 3]| {
        let [brdf, light, visibility] = trees.map(|tree| tree.handle);
        let mut integral = f64::NAN;
        // SAFETY: the handles are trees.
        (unsafe { wis_triple_integral(brdf, light, visibility, &mut integral) }, integral)
    };
    assert_eq!(triple([&black, &x, &x]), (Status::Ok, 0.0));
    assert_eq!(triple([&one, &x, &x]).0, Status::Overflow);
    let mut integral = f64::NAN;
    // SAFETY: the handles are trees.
    unsafe {
        assert_eq!(wis_tree_product_integral(x.handle, x.handle, &mut integral), Status::Overflow);
        assert_eq!(wis_tree_product_integral(black.handle, x.handle, &mut integral), Status::Ok);
        assert_eq!(integral, 0.0);
        let list = null();
        let status = wis_triple_sublinear(1e200, 0, list, 0, list, x.handle, one.handle, &mut integral, null_mut());
        assert_eq!(status, Status::Overflow);
        let status = wis_triple_sublinear(0.0, 0, list, 0, list, x.handle, x.handle, &mut integral, null_mut());
        assert_eq!((status, integral), (Status::Ok, 0.0));
        let (mut size, mut seen) = (MemorySize::default(), null());
        assert_eq!(wis_visibility_size(one.handle, &mut size, null_mut()), Status::Ok);
        let mut memory = Memory::new(size.bytes);
        assert_eq!(wis_visibility_init(one.handle, memory.pointer(), size.bytes, &mut seen, null_mut()), Status::Ok);
        let status = wis_visibility_integral(1e200, 0, list, 0, list, x.handle, seen, &mut integral, null_mut());
        assert_eq!(status, Status::Overflow);
    }
}

/// The share of the mean that is added to the pixels of a rotated map.
#[test]
fn rotated_maps_stay_finite() {
    let texels = [1e37; 8 * 4];
    let map = Map::latlong(8, 4, 1, &texels);
    let size = map.size().unwrap();
    let mut light = vec![Block::ZERO; Block::count(size.bytes)];
    map.build_in(&mut light, &mut vec![Block::ZERO; Block::count(size.scratch)]).unwrap();
    let build = |least: f64| {
        let environment = light.as_ptr().cast();
        let config = TreeConfig { depth: 2, least, environment, ..tree_config(WIS_TREE_ENVIRONMENT) };
        let (mut size, mut handle) = (MemorySize::default(), null());
        let mut info = TreeInfo { size: size_of::<TreeInfo>() as u32, ..TreeInfo::default() };
        let (mut memory, mut scratch) = (Memory::new(1 << 16), Memory::new(1 << 16));
        let (place, work, length) = (memory.pointer(), scratch.pointer(), 1 << 16);
        // SAFETY: the blocks are as long as stated.
        unsafe {
            let measured = wis_tree_size(&config, &mut size, null_mut());
            let none: *mut Diagnostic = null_mut();
            let built = wis_tree_init(&config, place, length, work, length, &mut handle, &mut info, none);
            assert_eq!(measured, built);
            if built == Status::Ok {
                assert_eq!(wis_tree_open(place, length, &mut handle, null_mut(), none), Status::Ok);
            }
            (built, info.average)
        }
    };
    let (status, average) = build(1e6);
    assert!(status == Status::Ok && (average / 1.000001e43 - 1.0).abs() < 1e-5, "{status:?} {average}");
    for least in [1.1e6, 1e30, 3.4e38] {
        assert_eq!(build(least).0, Status::InvalidArgument, "{least}");
    }
}

/// Functions of which nowhere two are above 0: no integral is below 0, or above what rounding leaves.
#[test]
fn integrals_of_what_is_not_negative_are_not_negative() {
    let mut random = Random(5);
    for depth in 1..=6 {
        for _ in 0..40 {
            let mut images = [(); 3].map(|()| vec![0.0f32; 1 << (2 * depth)]);
            let mut exact = 0.0;
            let overlap = random.unit() < 0.5;
            for i in 0..images[0].len() {
                let values = [(); 3].map(|()| (8.0 * random.unit()).exp());
                let left_out = (3.0 * random.unit()) as usize % 3;
                let all = overlap && random.unit() < 0.01;
                (0..3).filter(|k| all || *k != left_out).for_each(|k| images[k][i] = values[k]);
                exact += if all { values.map(f64::from).iter().product() } else { 0.0 };
            }
            exact /= images[0].len() as f64;
            let trees = images.map(|image| tree(depth, &image));
            let mut integral = f64::NAN;
            let [a, b, c] = [0, 1, 2].map(|k: usize| trees[k].handle);
            // SAFETY: the handles are trees.
            assert_eq!(unsafe { wis_triple_integral(a, b, c, &mut integral) }, Status::Ok);
            let off = (integral - exact).abs();
            assert!(integral >= 0.0 && off <= exact * 2.0f64.powi(-22), "{integral} for {exact}");
        }
    }
}
