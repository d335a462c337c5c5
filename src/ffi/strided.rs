//! Arrays of small vectors that stand a stride apart, and calls that read one and write another.

use super::{Checked, pointer, slice, slice_mut};
use crate::status::{Error, Result, Status};

/// Elements of `N` floats that stand a stride apart, to read.
#[derive(Clone, Copy)]
pub(crate) struct Strided<const N: usize> {
    start: *const f32,
    stride: usize,
}

impl<const N: usize> Strided<N> {
    /// Checks `count` elements; a stride of 0 means that they stand close together.
    #[inline(always)]
    pub(crate) fn new(start: *const f32, stride: usize, count: usize, argument: u32) -> Checked<Strided<N>> {
        Ok(Strided { start, stride: check_stride(N, start, stride, count, argument)? })
    }

    /// Reads element `index`.
    ///
    /// # Safety
    /// `index` is below the count that was checked, and the elements are readable.
    #[inline(always)]
    pub(crate) unsafe fn read(&self, index: usize) -> [f32; N] {
        // SAFETY: inside the array by this function's contract; floats of it are aligned.
        unsafe { self.start.byte_add(index * self.stride).cast::<[f32; N]>().read() }
    }
}

/// Elements of `N` floats that stand a stride apart, to write.
#[derive(Clone, Copy)]
pub(crate) struct StridedMut<const N: usize> {
    start: *mut f32,
    stride: usize,
}

impl<const N: usize> StridedMut<N> {
    /// Checks `count` elements; a stride of 0 means that they stand close together.
    #[inline(always)]
    pub(crate) fn new(start: *mut f32, stride: usize, count: usize, argument: u32) -> Checked<StridedMut<N>> {
        Ok(StridedMut { start, stride: check_stride(N, start, stride, count, argument)? })
    }

    /// Writes element `index`.
    ///
    /// # Safety
    /// `index` is below the count that was checked, and the elements are writable.
    #[inline(always)]
    pub(crate) unsafe fn write(&self, index: usize, value: [f32; N]) {
        // SAFETY: inside the array by this function's contract; floats of it are aligned.
        unsafe { self.start.byte_add(index * self.stride).cast::<[f32; N]>().write(value) }
    }
}

/// So many elements are copied together: as many as walk together through tables.
const TOGETHER: usize = 32;

/// Calls `each` with all elements, which it reads, and with room for as many results: with the arrays themselves where they are
/// packed and have no byte in common, else with copies of some elements after others.
///
/// # Safety
/// The arrays hold `count` elements, which nobody else uses meanwhile.
#[inline(always)]
pub(crate) unsafe fn in_batches<const N: usize, const M: usize>(
    from: &Strided<N>,
    to: &StridedMut<M>,
    count: usize,
    mut each: impl FnMut(&[[f32; N]], &mut [[f32; M]]),
) {
    if count == 1 {
        let mut written = [[0.0; M]];
        // SAFETY: the caller's contract, here and below.
        each(&[unsafe { from.read(0) }], &mut written);
        return unsafe { to.write(0, written[0]) };
    }
    let packed = from.stride == size_of::<[f32; N]>() && to.stride == size_of::<[f32; M]>();
    let (begin, end) = (from.start.addr(), from.start.addr() + count * from.stride);
    if packed && (end <= to.start.addr() || to.start.addr() + count * to.stride <= begin) {
        // SAFETY: checked not to overlap; the rest is this function's contract.
        let slices = unsafe { (slice(from.start.cast(), count, 0), slice_mut(to.start.cast(), count, 0)) };
        if let (Ok(from), Ok(to)) = slices {
            return each(from, to);
        }
    }
    // SAFETY: the caller's contract.
    unsafe { in_copies(from, to, count, &mut each) }
}

/// What reads some elements and writes as many.
type Batch<'a, const N: usize, const M: usize> = dyn FnMut(&[[f32; N]], &mut [[f32; M]]) + 'a;

/// As [`in_batches`], with copies.
///
/// # Safety
/// As [`in_batches`].
#[inline(never)]
unsafe fn in_copies<const N: usize, const M: usize>(
    from: &Strided<N>,
    to: &StridedMut<M>,
    count: usize,
    each: &mut Batch<'_, N, M>,
) {
    let (mut read, mut written) = ([[0.0; N]; TOGETHER], [[0.0; M]; TOGETHER]);
    for first in (0..count).step_by(TOGETHER) {
        let here = (count - first).min(TOGETHER);
        let (read, written) = (read.get_mut(..here).unwrap_or_default(), written.get_mut(..here).unwrap_or_default());
        for (i, element) in read.iter_mut().enumerate() {
            // SAFETY: the index is below the count.
            *element = unsafe { from.read(first + i) };
        }
        each(read, written);
        for (i, element) in written.iter().enumerate() {
            // SAFETY: the index is below the count.
            unsafe { to.write(first + i, *element) };
        }
    }
}

/// Writes the numbers that lead to directions, and a status for each; where it is not `WIS_OK`, no numbers.
///
/// # Safety
/// The arrays hold an element for each status.
pub(crate) unsafe fn invert_each(
    wi: &Strided<3>,
    u: &StridedMut<2>,
    statuses: &mut [u8],
    invert: &dyn Fn([f32; 3]) -> Result<[f32; 2]>,
) {
    for (i, status) in statuses.iter_mut().enumerate() {
        // SAFETY: the index is below the count.
        *status = match unsafe { invert(wi.read(i)) } {
            Ok(numbers) => {
                // SAFETY: as above.
                unsafe { u.write(i, numbers) };
                Status::Ok as u8
            }
            Err(status) => status as u8,
        };
    }
}

/// So many elements, so many bytes apart, are never too many for memory.
const FEW: usize = 1 << 15;

/// The bytes from an element of `n` floats to the next, checked for `count` of them.
#[inline(always)]
fn check_stride(n: usize, start: *const f32, stride: usize, count: usize, argument: u32) -> Checked<usize> {
    let packed = n * size_of::<f32>();
    let apart = if stride == 0 { packed } else { stride };
    // As nearly all calls are, without a call of its own.
    let sound = (packed..FEW).contains(&apart) && apart % size_of::<f32>() == 0;
    if sound && count < FEW && !start.is_null() && start.is_aligned() {
        return Ok(apart);
    }
    check_any_stride(n, start, stride, count, argument)
}

/// As [`check_stride`], of any stride.
#[inline(never)]
fn check_any_stride(n: usize, start: *const f32, stride: usize, count: usize, argument: u32) -> Checked<usize> {
    let packed = n * size_of::<f32>();
    let stride = if stride == 0 { packed } else { stride };
    if count == 0 {
        return Ok(stride);
    }
    pointer(start, argument)?;
    if stride < packed {
        return Err(Error::new(Status::InvalidArgument, argument + 1));
    }
    if stride % size_of::<f32>() != 0 {
        return Err(Error::new(Status::Misaligned, argument + 1));
    }
    if count.checked_mul(stride).is_none_or(|bytes| bytes > isize::MAX as usize) {
        return Err(Error::new(Status::Overflow, argument + 1));
    }
    Ok(stride)
}
