//! Sparse sets of wavelets in C: how many of a tree's are kept, and how they are stored.

use crate::ffi::wavelets::memory::ordered;
use crate::ffi::wavelets::tree::{Tree, square_tree};
use crate::ffi::{Diagnostic, answer, out, put, require, slice, slice_mut};
use crate::numeric::is_float;
use crate::status::{Error, Status};
use crate::wavelets::triple::{Wavelets, disorder};
use crate::wavelets::{approximate, packed as kernel};
use core::ptr::null_mut;

/// Rule of wis_triple_terms: the fewest that leave a relative L2 error of at most `bound`. Costs 33 visits of each square.
pub const WIS_TERMS_ERROR: u32 = 0;
/// Rule of wis_triple_terms: those with an orthonormal coefficient of at least `bound`, as those keep who threshold. One visit of
/// each square.
pub const WIS_TERMS_THRESHOLD: u32 = 1;

/// How many of the largest wavelets of a tree of two axes wis_triple_select is asked to keep, by a `rule`: WIS_TERMS_ERROR or WIS_TERMS_THRESHOLD,
/// else WIS_INVALID_ARGUMENT. `bound` is 0 or more. Work: squares.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_triple_terms(tree: *const Tree, rule: u32, bound: f64, terms: *mut u32) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        require([WIS_TERMS_ERROR, WIS_TERMS_THRESHOLD].contains(&rule), Status::InvalidArgument, 2)?;
        require(bound >= 0.0, Status::InvalidArgument, 3)?;
        let count = |(tree, exponent)| match rule {
            WIS_TERMS_ERROR => approximate::terms(&tree, bound),
            _ => approximate::at_least(&tree, bound, exponent),
        };
        put(terms, 4, square_tree(tree, 1).map(count))
    })
}

/// Stores a function of two axes as the papers do: its average, and any of its wavelets as an index by difference and 16 bits of
/// one scale, 3 to 4 bytes for each where they are dense (Clarberg et al. 2005, Section 7, has 300 kB for 2 % of 16 x 16 slices of
/// 64 x 64 in three colours, and 5 MB for 32 x 32 of 128 x 128). A slice of a table takes a call; slices may stand one behind
/// another, without alignment.
///
/// `average`: finite, kept as a float. `wavelets`: as wis_triple_select writes them (WIS_INVALID_ARGUMENT if they are out of order;
/// `y` in the diagnostic is the first element that is). Coefficients are rounded to 1/32767 of the largest orthonormal one, and
/// dropped where that is 0. `packed` has room for `room` bytes; `packed_bytes` tells how many the function takes: at most 16, and 18
/// for each element. WIS_MEMORY_TOO_SMALL if there is no room for them; `packed` is then undefined. WIS_OVERFLOW if the average is
/// beyond a float. Work: count.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_sparse_pack(
    average: f64,
    count: u32,
    wavelets: *const Wavelets,
    room: usize,
    packed: *mut u8,
    packed_bytes: *mut usize,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        require(average.is_finite(), Status::InvalidArgument, 1)?;
        require(is_float(average), Status::Overflow, 1)?;
        let list = ordered(wavelets, count, 3, disorder)?;
        let (packed, target) = (slice_mut(packed, room, 5)?, out(packed_bytes, 6)?);
        let bytes = kernel::pack(average as f32, list, packed);
        target.write(bytes);
        if bytes > room { Err(Error::too_small(4, bytes)) } else { Ok(()) }
    })
}

/// Reads what wis_sparse_pack wrote, one function at a time, as a list for WIS_TREE_WAVELETS, from which trees are sampled, queried
/// and multiplied, and for wis_triple_sublinear, wis_triple_blend and wis_visibility_integral. `packed`: `packed_bytes` bytes, of
/// which as many are read as the function has. WIS_CORRUPT if they are no such function. A change that leaves one is not noticed: there is
/// no checksum. `wavelets` has room for `room` elements; `wavelet_count` tells how many squares there are, at most a third of the
/// bytes. WIS_MEMORY_TOO_SMALL if there is no room for them. `wavelets` is undefined after both. Work: packed_bytes.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_sparse_unpack(
    packed: *const u8,
    packed_bytes: usize,
    room: u32,
    wavelets: *mut Wavelets,
    wavelet_count: *mut u32,
    average: *mut f64,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract; the list does not overlap the bytes.
    answer(diagnostic, || unsafe {
        let (packed, list) = (slice(packed, packed_bytes, 1)?, slice_mut(wavelets, room as usize, 4)?);
        let (to_count, to_average) = (out(wavelet_count, 5)?, out(average, 6)?);
        let (mean, squares) = kernel::unpack(packed, list).map_err(|status| Error::new(status, 1))?;
        to_count.write(squares as u32);
        to_average.write(mean.into());
        let needed = squares * size_of::<Wavelets>();
        if squares > list.len() { Err(Error::too_small(3, needed)) } else { Ok(()) }
    })
}
