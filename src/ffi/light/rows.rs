//! The client's rows of pixels: an array or a callback.

use super::config::RowFn;
use crate::ffi::Checked;
use crate::light::pixels::{Format, Rows};
use crate::status::{Error, Status};
use core::ffi::c_void;

/// The client's rows, as a configuration describes them.
pub(in crate::ffi) struct PixelRows {
    pub(in crate::ffi) pixels: *const c_void,
    pub(in crate::ffi) row_stride: isize,
    pub(in crate::ffi) row: RowFn,
    pub(in crate::ffi) row_user: *mut c_void,
    pub(in crate::ffi) row_bytes: usize,
}

impl PixelRows {
    /// Checks what a configuration, which is argument 1, says about `height` rows.
    pub(in crate::ffi) fn checked(self, format: Format, height: u32) -> Checked<PixelRows> {
        let PixelRows { pixels, row_stride, row, row_bytes, .. } = self;
        let stride = if row_stride == 0 { row_bytes as isize } else { row_stride };
        if stride.unsigned_abs() < row_bytes {
            return Err(Error::range(c"row_stride").instead(1));
        }
        if stride % format.bytes() as isize != 0 {
            return Err(Error::new(Status::Misaligned, 1).of(c"row_stride"));
        }
        if stride.checked_mul(height as isize).is_none() {
            return Err(Error::new(Status::Overflow, 1).of(c"row_stride"));
        }
        if pixels.is_null() && row.is_none() {
            return Err(Error::new(Status::NullPointer, 1).of(c"pixels"));
        }
        if pixels.addr() % format.bytes() != 0 {
            return Err(Error::new(Status::Misaligned, 1).of(c"pixels"));
        }
        Ok(PixelRows { row_stride: stride, ..self })
    }
}

impl Rows for PixelRows {
    fn row(&self, y: u32) -> Option<&[u8]> {
        let &PixelRows { pixels, row_stride, row, row_user, .. } = self;
        let start: *const u8 = match row {
            // SAFETY: row y of the array that the client describes; the offset was checked to fit an isize.
            _ if !pixels.is_null() => unsafe { pixels.cast::<u8>().byte_offset(row_stride * y as isize) },
            // SAFETY: the client's function with the client's argument.
            Some(row) => unsafe { row(row_user, y).cast() },
            None => core::ptr::null(),
        };
        if start.is_null() {
            return None;
        }
        // SAFETY: the client gives rows of that many bytes.
        Some(unsafe { core::slice::from_raw_parts(start, self.row_bytes) })
    }
}
