//! Sparse sets of wavelets in C: the largest of a tree, and products.

use crate::ffi::wavelets::check_axes;
use crate::ffi::wavelets::memory::ordered;
use crate::ffi::wavelets::tree::{Tree, view};
use crate::ffi::{Checked, Diagnostic, Failure, answer, out, put, require, slice_mut};
use crate::status::Status;
use crate::wavelets::approximate;
use crate::wavelets::sparse::{self, Details, Set, Unfit};
use crate::wavelets::stored::Stored;
use crate::wavelets::triple::{Wavelets, disorder};
use core::ptr::null_mut;

/// Rule of wis_triple_terms: the fewest that leave a relative L2 error of at most `bound`. Costs 33 visits of each square.
pub const WIS_TERMS_ERROR: u32 = 0;
/// Rule of wis_triple_terms: those with an orthonormal coefficient of at least `bound`, as those keep who threshold. One visit of
/// each square.
pub const WIS_TERMS_THRESHOLD: u32 = 1;

/// How many of a tree's largest wavelets wis_triple_select and wis_sparse_select are asked to keep, by a `rule`: WIS_TERMS_ERROR
/// or WIS_TERMS_THRESHOLD, else WIS_INVALID_ARGUMENT. `bound` is 0 or more. Work: squares.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_triple_terms(tree: *const Tree, rule: u32, bound: f64, terms: *mut u32) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        require([WIS_TERMS_ERROR, WIS_TERMS_THRESHOLD].contains(&rule), Status::InvalidArgument, 2)?;
        require(bound >= 0.0, Status::InvalidArgument, 3)?;
        let count = |Stored { tree, header }: Stored| match rule {
            WIS_TERMS_ERROR => approximate::terms(&tree, bound),
            _ => approximate::at_least(&tree, bound, header.exponent),
        };
        put(terms, 4, view(tree, 1).map(count))
    })
}

/// As wis_triple_select, for a tree of 1 to 4 axes: its `keep` wavelets with the largest orthonormal coefficients, into `kept`.
/// Work: squares.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_sparse_select(
    tree: *const Tree,
    keep: u32,
    kept: *mut Details,
    kept_count: *mut u32,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let stored = view(tree, 1)?;
        let (list, target) = (slice_mut(kept, keep as usize, 3)?, out(kept_count, 4)?);
        let used = approximate::select(&stored.tree, keep, stored.header.exponent, list);
        target.write(used.map_err(|status| Failure::new(status, 1))? as u32);
        Ok(())
    })
}

/// The product of two functions given by averages and wavelets, any sets in order (Clarberg et al. 2005, Section 4.3; values
/// may be negative): its average and its wavelets, without decompression: each square that either has a wavelet in is
/// visited once. `wavelets` has room for `room` elements. WIS_MEMORY_TOO_SMALL if the product has more squares: then nothing is
/// multiplied, and `wavelet_count` alone is written. It tells how many squares the product has, at most 12 times the sum of
/// both counts. WIS_INVALID_ARGUMENT for an average that is not finite, or a list that is out of order: `y` in the diagnostic
/// is the first element that is. WIS_OVERFLOW if the average is beyond a double or a detail beyond a float; `wavelets` is then
/// undefined. Work: e_count + f_count.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_triple_multiply(
    e_average: f64,
    e_count: u32,
    e: *const Wavelets,
    f_average: f64,
    f_count: u32,
    f: *const Wavelets,
    room: u32,
    wavelets: *mut Wavelets,
    wavelet_count: *mut u32,
    average: *mut f64,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract; the product does not overlap its factors.
    answer(diagnostic, || unsafe {
        require(e_average.is_finite(), Status::InvalidArgument, 1)?;
        require(f_average.is_finite(), Status::InvalidArgument, 4)?;
        let e = Set { average: e_average, wavelets: ordered(e, e_count, 3, disorder)? };
        let f = Set { average: f_average, wavelets: ordered(f, f_count, 6, disorder)? };
        let wavelets = slice_mut(wavelets, room as usize, 8)?;
        let (to_count, to_average) = (out(wavelet_count, 9)?, out(average, 10)?);
        report::<Wavelets>(sparse::multiply((2, e), (2, f), wavelets), to_count, (to_average, 7))
    })
}

/// As wis_triple_multiply, for a function `e` of n axes, 1 to 4, and one, `f`, of the first m of them, 1 to n, constant along
/// the rest (Clarberg et al. 2005, Section 4.3). Where `e` is constant and `f` is not, the product has as many squares as
/// n axes ask for: 2^((n - m) level) for each of `f`. A `product_count` of 2^32 - 1 stands for that many or more.
/// Work: e_count + f_count + squares of the product.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_sparse_multiply(
    n: u32,
    m: u32,
    e_average: f64,
    e_count: u32,
    e: *const Details,
    f_average: f64,
    f_count: u32,
    f: *const Details,
    room: u32,
    product: *mut Details,
    product_count: *mut u32,
    average: *mut f64,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract; the product does not overlap its factors.
    answer(diagnostic, || unsafe {
        check_axes(n, m)?;
        require(e_average.is_finite(), Status::InvalidArgument, 3)?;
        require(f_average.is_finite(), Status::InvalidArgument, 6)?;
        let e = Set { average: e_average, wavelets: ordered(e, e_count, 5, |list| sparse::disorder(list, n))? };
        let f = Set { average: f_average, wavelets: ordered(f, f_count, 8, |list| sparse::disorder(list, m))? };
        let out_list = slice_mut(product, room as usize, 10)?;
        let (to_count, to_average) = (out(product_count, 11)?, out(average, 12)?);
        report::<Details>(sparse::multiply((n, e), (m, f), out_list), to_count, (to_average, 9))
    })
}

/// Writes what a product of sets is; `room` is the argument that is at fault if there are more elements of `W`.
///
/// # Safety
/// The pointers are those of the caller's results.
unsafe fn report<W>(
    product: core::result::Result<(f64, usize), Unfit>,
    to_count: *mut u32,
    (to_average, room): (*mut f64, u32),
) -> Checked<()> {
    // SAFETY: the caller's contract.
    let tell = |squares: u64| unsafe { to_count.write(u32::try_from(squares).unwrap_or(u32::MAX)) };
    match product {
        Ok((mean, squares)) => {
            tell(squares as u64);
            // SAFETY: the caller's contract.
            unsafe { to_average.write(mean) };
            Ok(())
        }
        Err(Unfit::Room(squares)) => {
            tell(squares);
            let bytes = squares.saturating_mul(size_of::<W>() as u64);
            Err(Failure::too_small(room, usize::try_from(bytes).unwrap_or(usize::MAX)))
        }
        Err(Unfit::Range) => Err(Failure::new(Status::Overflow, 0)),
    }
}
