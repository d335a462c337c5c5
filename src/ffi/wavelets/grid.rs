//! Grids of directions in C.

use crate::ffi::{answer, borrow, frame, out, put, require};
use crate::sphere::{octahedral_direction, square, unit};
use crate::status::{Error, Status};
use crate::wavelets::grid::{self, WIS_MAX_GRID};
use core::ptr::null_mut;

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
        let wi = unit(*borrow(wi, 2)?).ok_or(Error::new(Status::InvalidTransform, 2))?;
        let (to_cell, to_weights) = (out(cell, 3)?, out(weights, 4)?);
        let (cells, values) = grid::about(side, wi);
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
        let wi = unit(*borrow(wi, 1)?).ok_or(Error::new(Status::InvalidTransform, 1))?;
        let frame = frame(world_from_tree, 2)?;
        put(point, 3, Ok(square(frame.to_map(wi.to_array()).into())))
    })
}
