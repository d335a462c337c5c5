//! Tabulated BRDFs in C: which slices a view needs, and in which frame they lie.

use crate::ffi::{answer, borrow, out, require};
use crate::sphere::unit;
use crate::status::{Error, Status};
use crate::wavelets::table::{View, WIS_MAX_SLICES};
use core::ptr::null_mut;

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
        let direction = |v, argument| unit(*borrow(v, argument)?).ok_or(Error::new(Status::InvalidTransform, argument));
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
