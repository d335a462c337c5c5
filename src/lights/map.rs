//! A lat-long map that is decoded into luminance and colours of all texels.

use crate::light::environment::BuildError;
use crate::light::pixels::{Pixels, RowError, Rows, decode_row};
use crate::sphere::Frame;

/// A lat-long map.
#[derive(Clone, Copy, Debug)]
pub struct Map {
    /// What its rows hold.
    pub pixels: Pixels,
    /// From its space to the world's.
    pub frame: Frame,
    /// NaN, infinite and negative channels are replaced instead of rejected.
    pub sanitise: bool,
}

impl Map {
    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        [self.pixels.width, self.pixels.height]
    }

    /// Reads all texels; +Inf becomes the largest finite luminance, in grey. `rgb` may be empty.
    ///
    /// # Errors
    /// [`BuildError::Row`].
    pub fn decode(
        &self,
        rows: &impl Rows,
        luminance: &mut [f64],
        rgb: &mut [[f32; 3]],
    ) -> core::result::Result<(), BuildError> {
        let width = self.pixels.width.max(1) as usize;
        let (mut largest, mut colours) = (0.0, rgb.chunks_exact_mut(width));
        for (y, values) in (0..).zip(luminance.chunks_exact_mut(width)) {
            let colours = colours.next().unwrap_or(&mut []);
            let decoded = rows.row(y).ok_or(RowError::Missing);
            let decoded = decoded.and_then(|row| decode_row(&self.pixels, row, y, self.sanitise, values, colours));
            let summary = decoded.map_err(|error| BuildError::Row(y, error))?;
            largest = if summary.largest > largest { summary.largest } else { largest };
        }
        let mut colours = rgb.iter_mut();
        for value in luminance {
            let colour = colours.next();
            if !(*value < f64::INFINITY) {
                *value = largest;
                colour.into_iter().for_each(|colour| *colour = [largest as f32; 3]);
            }
        }
        Ok(())
    }
}
