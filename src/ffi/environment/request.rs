//! A configuration that was checked, and the client's rows as the kernel reads them.

use super::super::{Checked, Failure, sized};
use super::stored::{Counts, Stored};
use super::{
    ALL_FLAGS, EnvironmentConfig, RowFn, WIS_FORMAT_F16, WIS_FORMAT_F32, WIS_LAYOUT_CUBE, WIS_LAYOUT_LATLONG,
    WIS_LAYOUT_OCTAHEDRAL, WIS_STORAGE_PYRAMID, WIS_STORAGE_SPARSE, WIS_WAVELET_LIGHT_COMPENSATED,
    WIS_WAVELET_LIGHT_EXACT_ZERO, WIS_WAVELET_LIGHT_NEAREST, WIS_WAVELET_LIGHT_RGB, WIS_WAVELET_LIGHT_SANITISE,
};
use crate::environment::{self as kernel, Config, Format, Layout, Pixels, Rows, Storage};
use crate::numeric::ContentHash;
use crate::status::Status;
use crate::tree::{MAX_DEPTH, complete_len};
use core::ffi::c_void;

/// A checked configuration.
#[derive(Clone, Copy)]
pub(in crate::ffi) struct Request {
    pub(in crate::ffi) config: Config,
    pub(super) flags: u32,
}

impl Request {
    /// Squares of the complete tree.
    pub(super) fn squares(&self) -> u32 {
        complete_len::<4>(self.config.depth).unwrap_or(0)
    }

    /// The layout with so many squares, of which some lie below the cells of a pyramid.
    pub(super) fn stored(&self, squares: u32, refined: u32) -> Option<Stored> {
        let (depth, sparse) = (self.config.depth, self.config.storage == Storage::Sparse);
        let (squares, texels) = (squares.checked_add(refined)?, self.config.kept_texels());
        Stored::new(Counts { squares, refined, depth, sparse, texels }, self.flags)
    }

    /// Tells whether a later call of the same build brings the same configuration.
    pub(super) fn fingerprint(&self) -> u64 {
        let pixels = &self.config.pixels;
        let mut hash = ContentHash::new();
        for word in [pixels.width, pixels.height, pixels.channels, pixels.layout as u32, pixels.format as u32] {
            hash.add(word.into());
        }
        let kinds = [self.config.storage as u32, self.config.refined.into(), self.config.natural.into()];
        for word in [self.flags, self.config.depth].into_iter().chain(kinds) {
            hash.add(word.into());
        }
        hash.add(self.config.error_budget.to_bits());
        hash.finish()
    }
}

/// Checks a configuration.
///
/// # Safety
/// The pointer is null or points to what the header says.
pub(in crate::ffi) unsafe fn read_config(config: *const EnvironmentConfig) -> Checked<(Request, PixelRows)> {
    // SAFETY: the caller's contract.
    let c = unsafe { sized(config, 1)? };
    let invalid = Failure::new(Status::InvalidArgument, 1);
    let layout = match c.layout {
        WIS_LAYOUT_LATLONG => Layout::LatLong,
        WIS_LAYOUT_CUBE => Layout::Cube,
        WIS_LAYOUT_OCTAHEDRAL => Layout::Octahedral,
        _ => return Err(invalid),
    };
    let format = match c.format {
        WIS_FORMAT_F32 => Format::F32,
        WIS_FORMAT_F16 => Format::F16,
        _ => return Err(invalid),
    };
    let storage = match c.storage {
        WIS_STORAGE_PYRAMID => Storage::Pyramid,
        WIS_STORAGE_SPARSE => Storage::Sparse,
        _ => return Err(invalid),
    };
    let resolution_fits = c.resolution == 0 || (c.resolution.is_power_of_two() && c.resolution <= 1 << MAX_DEPTH);
    if !resolution_fits || c.flags & !ALL_FLAGS != 0 || !(0.0..=f32::MAX).contains(&c.error_budget) {
        return Err(invalid);
    }
    let pixels = Pixels { layout, width: c.width, height: c.height, channels: c.channels, format };
    kernel::check(&pixels).map_err(|status| Failure::new(status, 1))?;
    let row_bytes = pixels.row_bytes().ok_or(Failure::new(Status::Overflow, 1))?;
    let stride = if c.row_stride == 0 { row_bytes as isize } else { c.row_stride };
    if stride.unsigned_abs() < row_bytes {
        return Err(invalid);
    }
    if stride.checked_mul(c.height as isize).is_none() {
        return Err(Failure::new(Status::Overflow, 1));
    }
    if c.pixels.is_null() && c.row.is_none() {
        return Err(Failure::new(Status::NullPointer, 1));
    }
    let depth = if c.resolution == 0 { Config::natural_depth(&pixels) } else { c.resolution.ilog2() };
    // What a client with a bilinear filter sees varies inside texels, too: edges of texels, which squares below cells
    // would draw sharply, are not edges to it.
    let nearest = c.flags & WIS_WAVELET_LIGHT_NEAREST != 0;
    let config = Config {
        pixels,
        depth,
        storage,
        error_budget: c.error_budget.into(),
        nearest,
        exact_zero: c.flags & WIS_WAVELET_LIGHT_EXACT_ZERO != 0,
        compensated: c.flags & WIS_WAVELET_LIGHT_COMPENSATED != 0,
        rgb: c.flags & WIS_WAVELET_LIGHT_RGB != 0,
        sanitise: c.flags & WIS_WAVELET_LIGHT_SANITISE != 0,
        refined: nearest && c.resolution == 0 && storage == Storage::Pyramid && depth > 0,
        natural: c.resolution == 0,
    };
    let rows = PixelRows { pixels: c.pixels, stride, row_bytes, row: c.row, user: c.row_user };
    Ok((Request { config, flags: c.flags }, rows))
}

/// The client's rows: an array or a callback.
pub(in crate::ffi) struct PixelRows {
    pixels: *const c_void,
    stride: isize,
    row_bytes: usize,
    row: RowFn,
    user: *mut c_void,
}

impl Rows for PixelRows {
    fn row(&self, y: u32) -> Option<&[u8]> {
        let start: *const u8 = match self.row {
            // SAFETY: row y of the array that the client describes; the offset was checked to fit an isize.
            _ if !self.pixels.is_null() => unsafe { self.pixels.cast::<u8>().byte_offset(self.stride * y as isize) },
            // SAFETY: the client's function with the client's argument.
            Some(row) => unsafe { row(self.user, y).cast() },
            None => core::ptr::null(),
        };
        if start.is_null() {
            return None;
        }
        // SAFETY: the client gives rows of that many bytes.
        Some(unsafe { core::slice::from_raw_parts(start, self.row_bytes) })
    }
}
