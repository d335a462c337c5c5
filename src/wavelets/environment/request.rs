//! An environment in the numbers of the C interface: what a client asks for, checked.

use super::{
    ALL_FLAGS, Config, Pixels, Storage, WIS_STORAGE_PYRAMID, WIS_STORAGE_SPARSE, WIS_WAVELET_LIGHT_EXACT_ZERO,
    WIS_WAVELET_LIGHT_NEAREST, WIS_WAVELET_LIGHT_RGB, WIS_WAVELET_LIGHT_SANITISE, check,
};
use crate::light::config::{format_of, layout_of};
use crate::status::Error;
use crate::wavelets::tree::MAX_DEPTH;

/// What a configuration asks for.
#[derive(Clone, Copy, Debug)]
pub struct Numbers {
    /// Of the map: WIS_LAYOUT_*, texels in a row, rows, channels, WIS_FORMAT_*.
    pub map: [u32; 5],
    /// WIS_WAVELET_LIGHT_*.
    pub flags: u32,
    /// WIS_STORAGE_*.
    pub storage: u32,
    /// Cells along each side of the square; 0: as many as the map asks for.
    pub resolution: u32,
    /// 0 or more.
    pub error_budget: f32,
}

impl Config {
    /// Checks what a client asks for.
    ///
    /// # Errors
    /// [`Error`] names the field.
    pub fn new(numbers: &Numbers) -> core::result::Result<Config, Error> {
        let &Numbers { map, flags, resolution, error_budget, .. } = numbers;
        let [layout, width, height, channels, format] = map;
        let (layout, format) = (layout_of(layout)?, format_of(format)?);
        let storage = match numbers.storage {
            WIS_STORAGE_PYRAMID => Storage::Pyramid,
            WIS_STORAGE_SPARSE => Storage::Sparse,
            _ => return Err(Error::range(c"storage")),
        };
        let resolution_fits = resolution == 0 || (resolution.is_power_of_two() && resolution <= 1 << MAX_DEPTH);
        Error::first([
            (resolution_fits, c"resolution"),
            (flags & !ALL_FLAGS == 0, c"flags"),
            ((0.0..=f32::MAX).contains(&error_budget), c"error_budget"),
        ])?;
        let pixels = Pixels { layout, width, height, channels, format };
        check(&pixels)?;
        let depth = if resolution == 0 { Config::natural_depth(&pixels) } else { resolution.ilog2() };
        // What a client with a bilinear filter sees varies inside texels, too: edges of texels, which squares below cells
        // would draw sharply, are not edges to it.
        let nearest = flags & WIS_WAVELET_LIGHT_NEAREST != 0;
        Ok(Config {
            pixels,
            depth,
            storage,
            error_budget: error_budget.into(),
            nearest,
            exact_zero: flags & WIS_WAVELET_LIGHT_EXACT_ZERO != 0,
            rgb: flags & WIS_WAVELET_LIGHT_RGB != 0,
            sanitise: flags & WIS_WAVELET_LIGHT_SANITISE != 0,
            refined: nearest && resolution == 0 && storage == Storage::Pyramid && depth > 0,
        })
    }
}
