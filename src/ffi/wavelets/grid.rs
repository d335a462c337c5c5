//! Grids of directions in C.

use crate::ffi::{answer, borrow, out, put, require};
use crate::sphere::unit;
use crate::status::{Error, Status};
use crate::wavelets::grid::{self, WIS_MAX_GRID};
use core::ptr::null_mut;

/// The centre of a cell of a grid of `side` x `side` directions (1 to WIS_MAX_GRID): the direction at which to tabulate what
/// wis_grid_cells then finds. Cells are pixels of the octahedral square, axis 1 slowest. WIS_INVALID_ARGUMENT for a side or
/// a cell out of range. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_grid_direction(side: u32, cell: u32, direction: *mut [f32; 3]) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        require((1..=WIS_MAX_GRID).contains(&side), Status::InvalidArgument, 1)?;
        require(cell < side * side, Status::InvalidArgument, 2)?;
        put(direction, 3, Ok(grid::centre(side, cell).to_array()))
    })
}

/// The four cells about a direction of unit length (else WIS_INVALID_TRANSFORM) and their bilinear weights, which add
/// up to 1. For pairs of directions, as a normal and the reflected direction, the 16 products of two weights
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
