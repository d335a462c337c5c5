//! A configuration that was checked, and the client's rows as the kernel reads them.

use super::{
    EnvironmentConfig, WIS_FORMAT_F16, WIS_FORMAT_F32, WIS_LAYOUT_CUBE, WIS_LAYOUT_LATLONG, WIS_LAYOUT_OCTAHEDRAL,
    WIS_STORAGE_PYRAMID, WIS_STORAGE_SPARSE, WIS_WAVELET_LIGHT_EXACT_ZERO, WIS_WAVELET_LIGHT_NEAREST,
    WIS_WAVELET_LIGHT_RGB, WIS_WAVELET_LIGHT_SANITISE,
};
use crate::ffi::light::rows::{PixelRows, Source};
use crate::ffi::{Checked, Failure, sized};
use crate::light::pixels::RowError;
use crate::status::{Fault, Status};
use crate::wavelets::environment::{self as kernel, ALL_FLAGS, Config, Format, Layout, Pixels, Storage};
use crate::wavelets::tree::MAX_DEPTH;

/// What a row that could not be decoded is to the caller.
pub(super) fn row_failure(y: u32, error: RowError) -> Failure {
    match error {
        RowError::Missing => Failure::at(error.status(), 1, 0, y).of(c"row"),
        RowError::Texel(texel) => Failure::at(error.status(), 1, texel.x, texel.y).of(c"pixels"),
    }
}

/// Checks a configuration.
///
/// # Safety
/// The pointer is null or points to what the header says.
pub(super) unsafe fn read_config(config: *const EnvironmentConfig) -> Checked<(Config, PixelRows)> {
    // SAFETY: the caller's contract.
    let c = unsafe { sized(config, 1)? };
    let invalid = |field| Failure::fault(Fault::range(field), 1);
    let layout = match c.layout {
        WIS_LAYOUT_LATLONG => Layout::LatLong,
        WIS_LAYOUT_CUBE => Layout::Cube,
        WIS_LAYOUT_OCTAHEDRAL => Layout::Octahedral,
        _ => return Err(invalid(c"layout")),
    };
    let format = match c.format {
        WIS_FORMAT_F32 => Format::F32,
        WIS_FORMAT_F16 => Format::F16,
        _ => return Err(invalid(c"format")),
    };
    let storage = match c.storage {
        WIS_STORAGE_PYRAMID => Storage::Pyramid,
        WIS_STORAGE_SPARSE => Storage::Sparse,
        _ => return Err(invalid(c"storage")),
    };
    let resolution_fits = c.resolution == 0 || (c.resolution.is_power_of_two() && c.resolution <= 1 << MAX_DEPTH);
    for (holds, field) in [
        (resolution_fits, c"resolution"),
        (c.flags & !ALL_FLAGS == 0, c"flags"),
        ((0.0..=f32::MAX).contains(&c.error_budget), c"error_budget"),
    ] {
        if !holds {
            return Err(invalid(field));
        }
    }
    let pixels = Pixels { layout, width: c.width, height: c.height, channels: c.channels, format };
    kernel::check(&pixels).map_err(|fault| Failure::fault(fault, 1))?;
    let row_bytes = pixels.row_bytes().ok_or(Failure::new(Status::Overflow, 1).of(c"width"))?;
    let source = Source { pixels: c.pixels, row_stride: c.row_stride, row: c.row, row_user: c.row_user };
    let rows = PixelRows::new(source, format, row_bytes, c.height)?;
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
        rgb: c.flags & WIS_WAVELET_LIGHT_RGB != 0,
        sanitise: c.flags & WIS_WAVELET_LIGHT_SANITISE != 0,
        refined: nearest && c.resolution == 0 && storage == Storage::Pyramid && depth > 0,
    };
    Ok((config, rows))
}
