//! Tabulated BRDFs and grids of directions in C: which slices a view needs and in which frame they lie, and the octahedral square.

use crate::ffi::{Checked, answer, borrow, frame, out, put, require};
use crate::sphere::{octahedral_direction, square, unit};
use crate::status::{Error, Status};
use crate::wavelets::table::{self, View, WIS_MAX_GRID, WIS_MAX_SLICES};
use core::ptr::null_mut;
use glam::Vec3;

/// How a table of an isotropic BRDF x cosine is read at a shading point (Clarberg et al. 2005, Section 5). Slice k is a tree of two
/// axes for the view whose angle to the normal is `(k + 1/2) / slice_count` of a right angle, over the octahedral square about the
/// mirror direction. Other views blend the two slices beside them: WIS_TREE_BLEND with these weights.
///
/// To build slice k, call this with its own view, and evaluate BRDF x cosine where wis_square_direction leads with
/// `world_from_tree`. Choose pixels (2 / 2^depth radians wide at the mirror direction) that are finer than the lobe: samples are as
/// uneven as the lobe is inside a pixel.
///
/// `slice_count`: 1 to WIS_MAX_SLICES; the paper has 16 and 32. `normal` and `wo`, the direction to the viewer, have unit length, else
/// WIS_INVALID_TRANSFORM; a `wo` below the surface counts as one along it. `slice`: the two slices, which may be the same; `weight`: two
/// numbers that add up to 1. `world_from_tree`: nine numbers as wis_tree_config has them, for WIS_TREE_ENVIRONMENT. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_table_view(
    slice_count: u32,
    normal: *const [f32; 3],
    wo: *const [f32; 3],
    slice: *mut [u32; 2],
    weight: *mut [f64; 2],
    world_from_tree: *mut [f32; 9],
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        require((1..=WIS_MAX_SLICES).contains(&slice_count), Status::InvalidArgument, 1)?;
        let (normal, wo) = (direction(normal, 2)?, direction(wo, 3)?);
        let (slice, weight, frame) = (out(slice, 4)?, out(weight, 5)?, out(world_from_tree, 6)?);
        let View { slices, weights, axes } = View::new(normal, wo, slice_count);
        let [x, y, z] = axes.map(|axis| axis.to_array());
        slice.write(slices);
        weight.write(weights);
        frame.write([x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]]);
        Ok(())
    })
}

/// The four cells about a direction of unit length (else WIS_INVALID_TRANSFORM) in a grid of `side` x `side` (1 to WIS_MAX_GRID),
/// and their bilinear weights, which add up to 1. Cells are pixels of the octahedral square, axis 1 slowest; tabulate at their
/// centres (wis_square_direction). For pairs of directions, as a normal and the reflected direction, the 16 products of two weights
/// interpolate quadrilinearly. Cells may repeat where the sheets of the square meet. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_grid_cells(
    side: u32,
    wi: *const [f32; 3],
    cell: *mut [u32; 4],
    weights: *mut [f32; 4],
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        require((1..=WIS_MAX_GRID).contains(&side), Status::InvalidArgument, 1)?;
        let wi = direction(wi, 2)?;
        let (to_cell, to_weights) = (out(cell, 3)?, out(weights, 4)?);
        let (cells, values) = table::about(side, wi);
        to_cell.write(cells);
        to_weights.write(values);
        Ok(())
    })
}

/// The world direction of a point of the octahedral square of a frame: of a sample of a tree of light or BRDF. The pdf per steradian is
/// that of the tree over 4 pi. Coordinates in [0, 1], else WIS_INVALID_ARGUMENT. `world_from_tree` as in wis_tree_config; null is the
/// identity. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_square_direction(
    point: *const [f32; 2],
    world_from_tree: *const [f32; 9],
    direction: *mut [f32; 3],
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let point = *borrow(point, 1)?;
        require(point.iter().all(|x| (0.0..=1.0).contains(x)), Status::InvalidArgument, 1)?;
        let frame = frame(world_from_tree, 2)?;
        put(direction, 3, Ok(frame.to_world(octahedral_direction(point))))
    })
}

/// The point of the octahedral square of a frame for a world direction of unit length (else WIS_INVALID_TRANSFORM): where wis_tree_pdf
/// and wis_tree_invert take it. `world_from_tree` as in wis_square_direction. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_square_point(
    wi: *const [f32; 3],
    world_from_tree: *const [f32; 9],
    point: *mut [f32; 2],
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let wi = direction(wi, 1)?;
        let frame = frame(world_from_tree, 2)?;
        put(point, 3, Ok(square(frame.to_map(wi.to_array()).into())))
    })
}

/// A direction of unit length.
///
/// # Safety
/// As [`borrow`].
unsafe fn direction(v: *const [f32; 3], argument: u32) -> Checked<Vec3> {
    // SAFETY: the caller's contract.
    unit(unsafe { *borrow(v, argument)? }).ok_or(Error::new(Status::InvalidTransform, argument))
}
