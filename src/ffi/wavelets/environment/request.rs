//! A configuration that was checked, and the client's rows as the kernel reads them.

use super::stored::{Counts, Stored};
use super::{
    ALL_FLAGS, EnvironmentConfig, WIS_FORMAT_F16, WIS_FORMAT_F32, WIS_LAYOUT_CUBE, WIS_LAYOUT_LATLONG,
    WIS_LAYOUT_OCTAHEDRAL, WIS_STORAGE_PYRAMID, WIS_STORAGE_SPARSE, WIS_WAVELET_LIGHT_COMPENSATED,
    WIS_WAVELET_LIGHT_EXACT_ZERO, WIS_WAVELET_LIGHT_NEAREST, WIS_WAVELET_LIGHT_RGB, WIS_WAVELET_LIGHT_SANITISE,
};
use crate::ffi::light::rows::{PixelRows, Source};
use crate::ffi::{Checked, Failure, sized};
use crate::numeric::ContentHash;
use crate::status::{Fault, Status};
use crate::wavelets::environment::{self as kernel, Config, Format, Layout, Pixels, Storage};
use crate::wavelets::tree::{MAX_DEPTH, complete_len};

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
        compensated: c.flags & WIS_WAVELET_LIGHT_COMPENSATED != 0,
        rgb: c.flags & WIS_WAVELET_LIGHT_RGB != 0,
        sanitise: c.flags & WIS_WAVELET_LIGHT_SANITISE != 0,
        refined: nearest && c.resolution == 0 && storage == Storage::Pyramid && depth > 0,
        natural: c.resolution == 0,
    };
    Ok((Request { config, flags: c.flags }, rows))
}
