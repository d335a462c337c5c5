//! Sparse sets of wavelets in C: how many of a tree's are kept, and how they are stored; and triple product integrals.

use crate::ffi::wavelets::ordered;
use crate::ffi::wavelets::tree::{Tree, integral_of, square_tree};
use crate::ffi::{Checked, Diagnostic, answer, out, put, require, require_all, slice, slice_mut};
use crate::numeric::{exp2i, is_float};
use crate::status::{Error, Status};
use crate::wavelets::approximate::{self, Of};
use crate::wavelets::combine::WIS_MAX_BLEND;
use crate::wavelets::packed as kernel;
use crate::wavelets::triple::{self, Quadtree, Wavelets, disorder};
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

/// The integral over the unit square of BRDF x light x visibility (Ng et al. 2004, Section 5), three trees of two axes
/// (WIS_INVALID_ARGUMENT for others), in any order. At least 0, and exact but for the rounding of stored averages: the
/// relative error is at most 2e-7. WIS_OVERFLOW if it is beyond a double. Costs one visit of each square that two of the trees
/// keep. For the six faces of a cube map, or three channels, add up as many calls. Work: squares.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_triple_integral(
    brdf: *const Tree,
    light: *const Tree,
    visibility: *const Tree,
    integral: *mut f64,
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let trees = [square_tree(brdf, 1)?, square_tree(light, 2)?, square_tree(visibility, 3)?];
        let sum = triple::integral([&trees[0].0, &trees[1].0, &trees[2].0]);
        put(integral, 4, integral_of(sum, &trees.map(|(_, exponent)| exponent), 4))
    })
}

/// Rule of wis_triple_select: the wavelets with the largest orthonormal coefficients (non-linear approximation).
pub const WIS_SELECT_WAVELETS: u32 = 0;
/// Rule of wis_triple_select: whole squares, those whose three coefficients have the largest sum of squares (Ng et al. 2004,
/// Section 7.2, keeps the light's squares so).
pub const WIS_SELECT_SQUARES: u32 = 1;

/// Keeps `keep` wavelets, or whole squares, of a tree of two axes, as `rule` says: WIS_SELECT_WAVELETS or WIS_SELECT_SQUARES (else
/// WIS_INVALID_ARGUMENT); of equal ones the first in depth-first order. `wavelets` has room for `keep` elements; `wavelet_count`
/// tells how many squares were written, at most that many. WIS_OVERFLOW if a detail that is kept is beyond a float; `wavelets` is
/// then undefined. Costs 33 visits of each square: do it when the function is built. Work: squares.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_triple_select(
    tree: *const Tree,
    rule: u32,
    keep: u32,
    wavelets: *mut Wavelets,
    wavelet_count: *mut u32,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (tree, exponent) = square_tree(tree, 1)?;
        let of = match rule {
            WIS_SELECT_WAVELETS => Of::Wavelets,
            WIS_SELECT_SQUARES => Of::Squares,
            _ => return Err(Error::new(Status::InvalidArgument, 2)),
        };
        let (wavelets, target) = (slice_mut(wavelets, keep as usize, 4)?, out(wavelet_count, 5)?);
        let squares = approximate::select(&tree, of, keep, exponent, wavelets);
        target.write(squares.map_err(|status| Error::new(status, 1))? as u32);
        Ok(())
    })
}

/// The triple product integral with approximations of BRDF and light (Ng et al. 2004, Section 5.3): wavelets of the
/// BRDF meet the exact light and visibility, and light and visibility meet the approximate BRDF where the light's
/// wavelet is kept. `brdf_average`: the BRDF's mean over the square, finite; both lists as wis_triple_select writes
/// them (WIS_INVALID_ARGUMENT if they are out of order; `y` in the diagnostic is the first element that is). The exact
/// integral, but for rounding, if nothing was dropped. An integral that is 0 or small may come out below 0, by what was
/// dropped or by rounding. WIS_OVERFLOW if it is beyond a double. Costs a few steps down the trees for each element,
/// whatever the resolution. Work: brdf_count + light_count.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_triple_sublinear(
    brdf_average: f64,
    brdf_count: u32,
    brdf: *const Wavelets,
    light_count: u32,
    kept_light: *const Wavelets,
    light: *const Tree,
    visibility: *const Tree,
    integral: *mut f64,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let lists = (brdf_average, (brdf, brdf_count), (kept_light, light_count));
        let (visible, exponent) = square_tree(visibility, 7)?;
        sublinear(lists, light, (&visible, exponent), integral)
    })
}

/// As wis_triple_sublinear, for every kind of visibility, which the caller has opened.
///
/// # Safety
/// As wis_triple_sublinear.
pub(super) unsafe fn sublinear(
    (brdf_average, brdf, kept): (f64, (*const Wavelets, u32), (*const Wavelets, u32)),
    light: *const Tree,
    (visible, visible_exponent): (&dyn Quadtree, i32),
    integral: *mut f64,
) -> Checked<()> {
    require(brdf_average.is_finite(), Status::InvalidArgument, 1)?;
    // SAFETY: the caller's contract.
    unsafe {
        let list = |(first, count), argument| ordered(first, count, argument, disorder);
        let (brdf, kept) = (list(brdf, 3)?, list(kept, 5)?);
        let (light, exponent) = square_tree(light, 6)?;
        let kept = triple::Scaled { wavelets: kept, scale: exp2i(-exponent) };
        let sum = triple::sublinear(brdf_average, brdf, kept, &light, visible);
        put(integral, 8, integral_of(sum, &[exponent, visible_exponent], 8))
    }
}

/// The weighted sum of up to WIS_MAX_BLEND approximations: a BRDF between tabulated ones, as the 16 nearest pairs of normal
/// and reflected direction give it (Ng et al. 2004, Section 7.1.2; wis_grid_cells). `list`: as wis_triple_select writes them,
/// `list_count` elements each; `weight`: finite. `wavelets` has room for `room` elements; `wavelet_count` tells how many
/// squares the sum has. WIS_MEMORY_TOO_SMALL if there is no room for them; the sum of all counts is always enough.
/// WIS_OVERFLOW if a detail is beyond a float. `wavelets` is undefined after both. Averages are blended with the same weights.
/// Work: elements of all lists.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_triple_blend(
    count: u32,
    list: *const *const Wavelets,
    list_count: *const u32,
    weight: *const f64,
    room: u32,
    wavelets: *mut Wavelets,
    wavelet_count: *mut u32,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let count = count as usize;
        require(count <= WIS_MAX_BLEND, Status::InvalidArgument, 1)?;
        let target = out(wavelet_count, 7)?;
        let mut lists = [&[] as &[Wavelets]; WIS_MAX_BLEND];
        let mut weights: &[f64] = &[];
        if count > 0 {
            let (handles, counts) = (slice(list, count, 2)?, slice(list_count, count, 3)?);
            weights = slice(weight, count, 4)?;
            require_all(weights, 4, |weight| weight.is_finite())?;
            for (k, (slot, (handle, count))) in lists.iter_mut().zip(handles.iter().zip(counts)).enumerate() {
                let list = ordered(*handle, *count, 2, disorder);
                *slot = list.map_err(|at| Error { x: at.y, ..at.instead(2) }.in_row(k))?;
            }
        }
        let wavelets = slice_mut(wavelets, room as usize, 6)?;
        let squares = triple::blend(lists.get(..count).unwrap_or(&[]), weights, wavelets);
        let squares = squares.map_err(|status| Error::new(status, 4))?;
        target.write(squares as u32);
        let needed = squares * size_of::<Wavelets>();
        if squares > wavelets.len() { Err(Error::too_small(5, needed)) } else { Ok(()) }
    })
}
