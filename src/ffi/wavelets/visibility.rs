//! Visibility in 8 bits, in C.

use crate::ffi::wavelets::tree::{Tree, in_units, square_tree};
use crate::ffi::wavelets::triple::sublinear;
use crate::ffi::{
    Checked, Diagnostic, ExclusiveBlock, Failure, MemorySize, SharedBlock, WIS_ALIGNMENT, answer, borrow, out,
};
use crate::numeric::exp2i;
use crate::status::Status;
use crate::wavelets::triple::Wavelets;
use crate::wavelets::visibility::{self as kernel, MAX_NODES, Node};
use core::ffi::c_void;
use core::ptr::null_mut;

/// A map of visibility in 8 bits: bytes in your memory without pointers, so it may be copied (to any block aligned to
/// WIS_ALIGNMENT), saved and mapped. A third of the tree that it was made of. Constant; any number of threads may use it at
/// once. Nothing to free.
#[allow(missing_debug_implementations)]
pub struct Visibility {
    _opaque: [u8; 0],
}

/// The memory that wis_visibility_init needs: exactly the bytes that are to be saved. WIS_INVALID_ARGUMENT for a tree of
/// other than two axes. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_size(
    tree: *const Tree,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let (tree, _) = square_tree(tree, 1)?;
            let bytes = bytes(tree.squares().len()).ok_or(Failure::new(Status::Overflow, 1))?;
            out(size, 2)?.write(MemorySize { bytes, align: WIS_ALIGNMENT, scratch_bytes: 0 });
        }
        Ok(())
    })
}

/// Stores a tree of two dimensions whose values are 0 (occluded) to 1 (visible) in 8 bits: exactly if they are 0 or 1, up
/// to 1/510 in the averages of larger squares (Ng et al. 2004, Section 7.1.1). WIS_INVALID_ARGUMENT for values above 1.
/// Work: squares.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the block.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_init(
    tree: *const Tree,
    memory: *mut c_void,
    bytes: usize,
    visibility: *mut *const Visibility,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract; header and nodes do not overlap.
        unsafe {
            let (tree, exponent) = square_tree(tree, 1)?;
            let (scale, count) = (exp2i(exponent), tree.squares().len());
            let needed = self::bytes(count).ok_or(Failure::new(Status::Overflow, 1))?;
            let block = ExclusiveBlock::new(memory.cast(), bytes, needed, 2)?;
            let target = out(visibility, 4)?;
            let average = f64::from(tree.average()) * scale;
            if average > 1.0 + 1e-6 {
                return Err(Failure::new(Status::InvalidArgument, 1));
            }
            let nodes = block.slice::<Node>(size_of::<Header>(), 0, count);
            kernel::compress(&tree, scale, nodes).map_err(|status| Failure::new(status, 1))?;
            let average = if average < 1.0 { average as f32 } else { 1.0 };
            memory.cast::<Header>().write(Header { magic: MAGIC, nodes: count as u32, average });
            target.write(memory.cast_const().cast());
        }
        Ok(())
    })
}

/// Checks bytes that wis_visibility_init wrote (copied, or mapped from a file) and gives them as a map of visibility.
/// WIS_CORRUPT if they are none. Reads all of them once. Work: bytes.
///
/// # Safety
/// Pointers are null or point to what the header says; the bytes do not change while the map is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_open(
    memory: *const c_void,
    bytes: usize,
    visibility: *mut *const Visibility,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let target = out(visibility, 3)?;
            let block = SharedBlock::new(memory.cast(), bytes, size_of::<Header>(), 1)?;
            let corrupt = Failure::new(Status::Corrupt, 1);
            let header = *block.slice::<Header>(0, 0, 1).first().ok_or(corrupt)?;
            let needed = self::bytes(header.nodes as usize).filter(|_| header.magic == MAGIC).ok_or(corrupt)?;
            let block = SharedBlock::new(memory.cast(), bytes, needed, 1)?;
            let nodes = block.slice::<Node>(size_of::<Header>(), 0, header.nodes as usize);
            kernel::Visibility::new(header.average, nodes).map_err(|_| corrupt)?;
            target.write(memory.cast());
        }
        Ok(())
    })
}

/// As wis_triple_sublinear, for visibility in 8 bits. Work: brdf_count + light_count.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_integral(
    brdf_average: f64,
    brdf_count: u32,
    brdf: *const Wavelets,
    light_count: u32,
    kept_light: *const Wavelets,
    light: *const Tree,
    visibility: *const Visibility,
    integral: *mut f64,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let visible = view(visibility, 7)?;
            let lists = (brdf_average, (brdf, brdf_count), (kept_light, light_count));
            sublinear(lists, light, (&visible, 0), integral)
        }
    })
}

/// The integral over the unit square of a tree of two dimensions as it is seen through a map of visibility (a double
/// product). Nothing is dropped: exact but for rounding where visibility is 0 or 1. At least 0; WIS_OVERFLOW if it is
/// beyond a double. If many vertices share a BRDF, as all that have one normal or one reflected direction, multiply it
/// by the light once for a frame: this is then faster for each vertex than wis_visibility_integral, and no
/// approximation. Work: squares.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_product_integral(
    tree: *const Tree,
    visibility: *const Visibility,
    integral: *mut f64,
) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let (tree, exponent) = square_tree(tree, 1)?;
            let visible = view(visibility, 2)?;
            let target = out(integral, 3)?;
            target.write(in_units(visible.product_integral(&tree), &[exponent], 3)?);
        }
        Ok(())
    })
}

/// The first bytes of a stored map.
#[repr(C)]
#[derive(Clone, Copy)]
struct Header {
    magic: u64,
    nodes: u32,
    average: f32,
}

/// "wis-vis" and the version of the format.
const MAGIC: u64 = u64::from_le_bytes(*b"wis-vis\x02");

fn bytes(nodes: usize) -> Option<usize> {
    if nodes < MAX_NODES { Some(size_of::<Header>() + nodes * size_of::<Node>()) } else { None }
}

/// # Safety
/// The handle is null or points to a map that this version wrote or opened.
unsafe fn view<'a>(visibility: *const Visibility, argument: u32) -> Checked<kernel::Visibility<'a>> {
    // SAFETY: the caller's contract; the block is as long as its header says.
    unsafe {
        let header = *borrow(visibility.cast::<Header>(), argument)?;
        let mismatch = Failure::new(Status::Mismatch, argument);
        let bytes = bytes(header.nodes as usize).filter(|_| header.magic == MAGIC).ok_or(mismatch)?;
        let block = SharedBlock::new(visibility.cast(), bytes, bytes, argument)?;
        Ok(kernel::Visibility::trusted(header.average, block.slice(size_of::<Header>(), 0, header.nodes as usize)))
    }
}
