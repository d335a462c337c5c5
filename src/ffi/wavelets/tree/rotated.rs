//! Rotated maps in C.

use super::{Tree, TreeInfo, refused};
use crate::ffi::memory::block_mut;
use crate::ffi::wavelets::environment::{Environment, view};
use crate::ffi::wavelets::memory::{Results, room_mut};
use crate::ffi::{Checked, Diagnostic, Failure, MemorySize, answer, frame, put_size, sized};
use crate::status::Status;
use crate::wavelets::rotated::Rotation;
use core::ffi::c_void;

/// How to rotate a map.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct RotatedConfig {
    /// sizeof(wis_rotated_config).
    pub size: u32,
    /// The tree has 2^depth pixels along each axis; 0 to 12. The paper has 6 and 7.
    pub depth: u32,
    /// Each pixel is the mean of places x places, 1 to WIS_MAX_PLACES, each of a cell of the map about as large as what it
    /// stands for; 2 is a good start.
    pub places: u32,
    /// As wis_tree_config.
    pub error_budget: f32,
    /// The share of the map's mean that is added to each pixel, 0 to 1e6: what keeps the pdf above 0 wherever there is light.
    pub least: f32,
    /// Nine numbers, row by row: world = M map, within 1e-4 of a rotation or reflection; null is the identity.
    pub world_from_map: *const f32,
    /// The same from the frame of the tree: the direction about which the map is rotated is its third column. Null is the
    /// identity.
    pub world_from_tree: *const f32,
}

/// The memory that wis_tree_of_environment needs at most. Does not read the transforms. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_of_environment_size(
    config: *const RotatedConfig,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let rotation = checked(sized(config, 1)?, 1)?;
        put_size(size, 2, rotation.size().ok_or(Failure::new(Status::Overflow, 1)))
    })
}

/// The luminance of an environment over the octahedral square of another frame as a tree: a map that is rotated about a
/// direction, made when a scene asks for it (Clarberg et al. 2005, Section 6.1, make all of them beforehand). With a BRDF that
/// is tabulated about the same direction wis_tree_multiply gives their product; wis_tree_blend interpolates between
/// directions, wis_grid_cells says which. `info` may be null. The bytes in use stand in `info`. Costs (places 2^depth)^2
/// look-ups in the map. Work: places^2 x 4^depth.
///
/// # Safety
/// Pointers are null or point to what the header says; blocks are as long as stated and nobody else uses them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_of_environment(
    environment: *const Environment,
    config: *const RotatedConfig,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    tree: *mut *const Tree,
    info: *mut TreeInfo,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let environment = view(environment, 1)?;
        let config: &RotatedConfig = sized(config, 2)?;
        let rotation = checked(config, 2)?;
        let frames = [
            frame(config.world_from_map.cast(), 2).map_err(|at| at.of(c"world_from_map"))?,
            frame(config.world_from_tree.cast(), 2).map_err(|at| at.of(c"world_from_tree"))?,
        ];
        let results = Results::new((tree, 7), (info, 8))?;
        let size = rotation.size().ok_or(Failure::new(Status::Overflow, 1))?;
        let scratch = block_mut(scratch, scratch_bytes, size.scratch, 5)?;
        let block = room_mut(memory, bytes, size.bytes, 3)?;
        let built = rotation.build_in(&environment, frames, block, scratch);
        results.publish(memory, built.map_err(|why| refused(why, [1, 3, 5]))?.info())
    })
}

/// What is to be built.
fn checked(config: &RotatedConfig, argument: u32) -> Checked<Rotation> {
    let &RotatedConfig { depth, places, error_budget, least, .. } = config;
    let rotation = Rotation { depth, places, error_budget, least };
    rotation.check().map_err(|fault| Failure::fault(fault, argument))?;
    Ok(rotation)
}
