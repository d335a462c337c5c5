//! Structured importance sampling (Agarwal et al. 2003): a lat-long map as directional lights. A map is decoded into luminance and colours
//! of all texels.

pub mod jitter;
pub mod strata;

use crate::light::pixels::{Pixels, Rows, invalid, missing};
use crate::numeric::LUMINANCE;
use crate::sphere::Frame;
use crate::status::Error;

/// A lat-long map.
#[derive(Clone, Copy, Debug)]
pub struct Map {
    /// Columns and rows.
    pub size: [u32; 2],
    /// How its pixels are stored.
    pub pixels: Pixels,
    /// From its space to the world's.
    pub frame: Frame,
}

impl Map {
    /// Reads all texels. `rgb` may be empty.
    ///
    /// # Errors
    /// Of a row, and of the first texel that is NaN or infinite, unless they are to be replaced.
    pub fn decode(&self, rows: &Rows<'_>, luminance: &mut [f64], rgb: &mut [[f32; 3]]) -> Result<(), Error> {
        let width = self.size[0].max(1) as usize;
        let (row_bytes, mut colours) = (self.pixels.row_bytes(1).unwrap_or(1).max(1), rgb.iter_mut());
        for (y, values) in (0..).zip(luminance.chunks_exact_mut(width)) {
            let texels = rows(y).ok_or(missing(y))?.chunks_exact(row_bytes);
            for ((x, texel), out) in (0..).zip(texels).zip(values) {
                let colour = self.pixels.mended(self.pixels.colour(texel)).ok_or(invalid(x, y))?;
                *out = luminance_of(colour);
                if let Some(out) = colours.next() {
                    *out = colour;
                }
            }
        }
        Ok(())
    }
}

/// The luminance of a colour in f64; grey stays exactly what it is.
fn luminance_of([r, g, b]: [f32; 3]) -> f64 {
    if r == g && g == b {
        return f64::from(r);
    }
    LUMINANCE[0] * f64::from(r) + LUMINANCE[1] * f64::from(g) + LUMINANCE[2] * f64::from(b)
}
