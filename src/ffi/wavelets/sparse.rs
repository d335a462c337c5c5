//! Sparse sets of wavelets in C: the largest of a tree, and products.

use crate::ffi::wavelets::memory::ordered;
use crate::ffi::wavelets::tree::{Tree, view};
use crate::ffi::{Checked, Diagnostic, answer, out, put, require, sized, slice_mut};
use crate::status::{Error, Status};
use crate::wavelets::approximate;
use crate::wavelets::sparse::{self, Details, Set, Unfit};
use crate::wavelets::stored::Stored;
use core::ptr::null_mut;

/// The most axes of a function.
const MOST_AXES: u32 = 4;

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
        target.write(used.map_err(|status| Error::new(status, 1))? as u32);
        Ok(())
    })
}

/// A function of 1 to 4 axes: its average, and some of its wavelets, depth first.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct DetailSet {
    /// sizeof(wis_detail_set).
    pub size: u32,
    /// How many axes, 1 to 4.
    pub axes: u32,
    /// Elements of `details`.
    pub count: u32,
    /// Always 0.
    pub reserved: u32,
    /// Over the whole cube; finite, may be negative.
    pub average: f64,
    /// By position, and squares before those inside them. Null if there are none.
    pub details: *const Details,
}

/// The product of a function `e` of 1 to 4 axes and one, `f`, of the first of them, constant along the rest (Clarberg et al. 2005,
/// Section 4.3; values may be negative): its average and its details, without decompression. Each square that either has a
/// wavelet in is visited once. `product` has room for `room` elements. WIS_MEMORY_TOO_SMALL if the product has more squares: then
/// nothing is multiplied, and `product_count` alone is written. It tells how many squares the product has; 2^32 - 1 stands for
/// that many or more. Of two axes these are at most 12 times the sum of both counts. Where `e` is constant and `f` is not, they are as
/// many as n axes ask for: 2^((n - m) level) for each of the m axes of `f`. WIS_INVALID_ARGUMENT for an average that is not finite, or
/// a list that is out of order: `y` in the diagnostic is the first element that is. WIS_OVERFLOW if the average is beyond a double
/// or a detail beyond a float; `product` is then undefined. Work: details of e and f + squares of the product.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_sparse_multiply(
    e: *const DetailSet,
    f: *const DetailSet,
    room: u32,
    product: *mut Details,
    product_count: *mut u32,
    average: *mut f64,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract; the product does not overlap its factors.
    answer(diagnostic, || unsafe {
        let e = cube(e, MOST_AXES, 1)?;
        let f = cube(f, e.0, 2)?;
        let product = slice_mut(product, room as usize, 4)?;
        let results = (out(product_count, 5)?, out(average, 6)?);
        report(sparse::multiply(e, f, product), results)
    })
}

/// A set of any axes, at most so many, with their number, checked.
///
/// # Safety
/// The pointer is null or points to what the header says.
unsafe fn cube<'a>(set: *const DetailSet, most: u32, argument: u32) -> Checked<(u32, Set<'a, Details>)> {
    // SAFETY: the caller's contract.
    unsafe {
        let &DetailSet { axes, count, reserved, average, details, .. } = sized(set, argument)?;
        Error::first([
            ((1..=most).contains(&axes), c"axes"),
            (reserved == 0, c"reserved"),
            (average.is_finite(), c"average"),
        ])
        .map_err(|error| error.instead(argument))?;
        let in_order = |list: &[Details]| sparse::disorder(list, axes);
        let list = ordered(details, count, argument, in_order).map_err(|at| at.of(c"details"))?;
        Ok((axes, Set { average, wavelets: list }))
    }
}

/// Writes what a product of sets is. Argument 3 is at fault if there are more elements.
///
/// # Safety
/// The pointers are those of the caller's results.
unsafe fn report(
    product: core::result::Result<(f64, usize), Unfit>,
    (to_count, to_average): (*mut u32, *mut f64),
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
            let bytes = squares.saturating_mul(size_of::<Details>() as u64);
            Err(Error::too_small(3, usize::try_from(bytes).unwrap_or(usize::MAX)))
        }
        Err(Unfit::Range) => Err(Error::new(Status::Overflow, 0)),
    }
}
