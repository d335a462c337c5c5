//! A lat-long map that is decoded into luminance and colours of all texels.

use crate::light::pixels::{Pixels, Rows, decode_row, missing};
use crate::sphere::Frame;
use crate::status::Error;

/// A lat-long map.
#[derive(Clone, Copy, Debug)]
pub struct Map {
    /// What its rows hold.
    pub pixels: Pixels,
    /// From its space to the world's.
    pub frame: Frame,
    /// NaN and infinite channels are replaced instead of rejected.
    pub sanitise: bool,
}

impl Map {
    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        [self.pixels.width, self.pixels.height]
    }

    /// Reads all texels. `rgb` may be empty.
    ///
    /// # Errors
    /// Of a row.
    pub fn decode(
        &self,
        rows: &impl Rows,
        luminance: &mut [f64],
        rgb: &mut [[f32; 3]],
    ) -> core::result::Result<(), Error> {
        let width = self.pixels.width.max(1) as usize;
        let mut colours = rgb.chunks_exact_mut(width);
        for (y, values) in (0..).zip(luminance.chunks_exact_mut(width)) {
            let colours = colours.next().unwrap_or(&mut []);
            let decoded = rows.row(y).ok_or(missing(y));
            let decoded = decoded.and_then(|row| decode_row(&self.pixels, row, y, self.sanitise, values, colours));
            decoded?;
        }
        Ok(())
    }
}
