//! Rotated maps in C.

use super::{Request, Tree, TreeConfig, TreeInfo, build, check_results, publish};
use crate::ffi::wavelets::environment::{Environment, view};
use crate::ffi::{Checked, Diagnostic, ExclusiveBlock, Failure, MemorySize, WIS_ALIGNMENT, answer, frame, out, sized};
use crate::status::{Fault, Status};
use crate::wavelets::rotated::{MAX_LEAST, Rotated, WIS_MAX_PLACES};
use core::ffi::c_void;
use core::ptr::null;

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
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let request = request(sized(config, 1)?, 1)?;
            let size = out(size, 2)?;
            let stored = request.stored(request.complete)?;
            let scratch_bytes = layout(&request)?.bytes;
            size.write(MemorySize { bytes: stored.bytes, align: WIS_ALIGNMENT, scratch_bytes });
        }
        Ok(())
    })
}

/// The luminance of an environment over the octahedral square of another frame as a tree: a map that is rotated about a
/// direction, made when a scene asks for it (Clarberg et al. 2005, Section 5.1, make all of them beforehand). With a BRDF that
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
    answer(diagnostic, || {
        // SAFETY: the caller's contract; the pixels stand behind what the build needs.
        unsafe {
            let environment = view(environment, 1)?;
            let config: &RotatedConfig = sized(config, 2)?;
            let request = Request { exponent: environment.header.exponent, memory: 3, ..request(config, 2)? };
            let frames = [
                frame(config.world_from_map.cast(), 2).map_err(|at| at.of(c"world_from_map"))?,
                frame(config.world_from_tree.cast(), 2).map_err(|at| at.of(c"world_from_tree"))?,
            ];
            check_results(tree, 7, info, 8)?;
            let layout = layout(&request)?;
            let scratch = ExclusiveBlock::new(scratch.cast(), scratch_bytes, layout.bytes, 5)?;
            ExclusiveBlock::new(memory.cast(), bytes, 0, 3)?;
            let pixels = scratch.slice::<f32>(layout.pixels, 0, 1 << (2 * request.depth));
            Rotated::new(environment.light(), frames, request.depth, config.places, config.least).fill(pixels);
            let header = build::<2, 4>(&request, pixels, &scratch, memory.cast(), bytes)?;
            publish(memory.cast(), &header, tree, info);
        }
        Ok(())
    })
}

/// What is to be built.
fn request(config: &RotatedConfig, argument: u32) -> Checked<Request> {
    let size = size_of::<TreeConfig>() as u32;
    let (depth, error_budget) = (config.depth, config.error_budget);
    let tree = TreeConfig { size, dimensions: 2, depth, error_budget, pixels: null() };
    if !(1..=WIS_MAX_PLACES).contains(&config.places) {
        return Err(Failure::fault(Fault::range(c"places"), argument));
    }
    if !(0.0..=MAX_LEAST).contains(&config.least) {
        return Err(Failure::fault(Fault::range(c"least"), argument));
    }
    Request::new(&tree).map_err(|at| at.instead(argument))
}

/// Where the parts of the scratch memory stand.
struct Layout {
    pixels: usize,
    bytes: usize,
}

fn layout(request: &Request) -> Checked<Layout> {
    let pixels = request.scratch()?.bytes;
    let bytes = pixels.checked_add(size_of::<f32>() << (2 * request.depth));
    let bytes = bytes.filter(|bytes| *bytes <= isize::MAX as usize).ok_or(Failure::new(Status::Overflow, 1))?;
    Ok(Layout { pixels, bytes })
}
