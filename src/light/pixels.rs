//! The caller's pixels: their format, rows of them as luminance, and what becomes of texels that are NaN, infinite or negative.

use super::chart::Layout;
use super::plan::Plan;
use crate::numeric::LUMINANCE;
use crate::status::{Error, Status};
use bytemuck::{Pod, Zeroable};
use core::f64::consts::PI;

/// The number format of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 32-bit floats.
    F32,
    /// 16-bit floats.
    F16,
}

impl Format {
    /// The size of one channel.
    pub fn bytes(self) -> usize {
        match self {
            Format::F32 => 4,
            Format::F16 => 2,
        }
    }
}

/// How the pixels are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pixels {
    /// 1 (luminance), 3 (RGB) or 4 (RGB and an alpha that is ignored).
    pub channels: u32,
    /// The number format of a channel.
    pub format: Format,
    /// Whether texels that are NaN or infinite are replaced instead of rejected.
    pub sanitise: bool,
    /// Whether negative channels count by their size instead of as 0.
    pub absolute: bool,
}

impl Pixels {
    /// Bytes of a row of `width` texels.
    pub fn row_bytes(&self, width: u32) -> Option<usize> {
        (self.channels as usize).checked_mul(self.format.bytes())?.checked_mul(width as usize)
    }

    /// The colour of a texel.
    pub fn colour(&self, texel: &[u8]) -> [f32; 3] {
        let channel = |c: usize| match self.format {
            Format::F32 => texel.get(4 * c..4 * c + 4).and_then(|b| b.try_into().ok()).map_or(0.0, f32::from_ne_bytes),
            Format::F16 => {
                texel.get(2 * c..2 * c + 2).and_then(|b| b.try_into().ok()).map_or(0.0, |b| half(u16::from_ne_bytes(b)))
            }
        };
        if self.channels == 1 { [channel(0); 3] } else { [channel(0), channel(1), channel(2)] }
    }

    /// A colour as light: a negative channel is 0, or its size with `absolute`; with `sanitise` NaN is 0 and +Inf [`INFINITE`].
    /// `None` without `sanitise` for what is not finite.
    pub fn mended(&self, colour: [f32; 3]) -> Option<[f32; 3]> {
        let light = |c: f32| match if self.absolute { c.abs() } else { c } {
            f32::INFINITY => INFINITE,
            c if c > 0.0 => c,
            _ => 0.0,
        };
        (self.sanitise || colour.iter().all(|c| c.is_finite())).then(|| colour.map(light))
    }
}

/// Gives the bytes of a row, at least [`Pixels::row_bytes`] of them; `None` stops the build.
pub type Rows<'a> = dyn Fn(u32) -> Option<&'a [u8]> + 'a;

/// What stops a build that gets no row, or a short one.
pub fn missing(y: u32) -> Error {
    Error::new(Status::CallbackFailed, 0).at(0, y).of(c"row")
}

/// What stops a build at a texel that cannot be light.
pub fn invalid(x: u32, y: u32) -> Error {
    Error::new(Status::InvalidTexel, 0).at(x, y).of(c"pixels")
}

/// What +Inf counts as: the largest half float, since suns overflow in maps of half floats.
pub const INFINITE: f32 = 65_504.0;

/// What a row holds besides its luminances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RowSummary {
    /// Luminance times solid angle.
    pub light: f64,
    /// Solid angle of all.
    pub angle: f64,
    /// The largest luminance times solid angle of a texel.
    pub brightest: f64,
    /// Texels that were negative, or replaced.
    pub sanitised: u64,
}

/// The solid angle of the texels of a row, but for a factor that all rows share: the first number; cube maps vary along the
/// row, too: the second is the square of the row's distance from the middle of the face.
fn row_angle(plan: &Plan, y: u32) -> (f64, f64) {
    let height = plan.texels[1];
    let row = f64::from(y % height.max(1));
    match plan.of.layout {
        Layout::LatLong => {
            let spans = f64::from(height - u32::from(plan.of.rows_at_poles && height > 1));
            let first = if plan.of.rows_at_poles { row - 0.5 } else { row };
            let at = |row: f64| libm::cos(PI * row.max(0.0).min(spans) / spans);
            ((at(first) - at(first + 1.0)) * 2.0 * PI / f64::from(plan.texels[0]), 0.0)
        }
        Layout::Cube => {
            let side = f64::from(height);
            let t = (2.0 * row + 1.0) / side - 1.0;
            (4.0 / (side * side), t * t)
        }
        Layout::Octahedral => (4.0 * PI / (f64::from(height) * f64::from(height)), 0.0),
    }
}

/// Decodes row `y` into luminance, and adds what it holds of each column of cells to `rgb`.
///
/// # Errors
/// The first texel that is NaN or infinite, unless they are to be replaced.
pub fn decode_row(
    plan: &Plan,
    pixels: &Pixels,
    bytes: &[u8],
    y: u32,
    luminance: &mut [f32],
    rgb: &mut [[f64; 3]],
) -> Result<RowSummary, Error> {
    let size = pixels.channels as usize;
    match (pixels.format, bytemuck::try_cast_slice::<u8, f32>(bytes)) {
        (Format::F32, Ok(floats)) => {
            decode(plan, pixels, floats.chunks_exact(size.max(1)).map(colour), y, luminance, rgb)
        }
        (format, _) => {
            let texels = bytes.chunks_exact((size * format.bytes()).max(1));
            decode(plan, pixels, texels.map(|texel| pixels.colour(texel)), y, luminance, rgb)
        }
    }
}

#[inline(always)]
fn colour(texel: &[f32]) -> [f32; 3] {
    match *texel {
        [r, g, b, ..] => [r, g, b],
        _ => [texel.first().copied().unwrap_or(0.0); 3],
    }
}

#[inline(always)]
fn decode(
    plan: &Plan,
    pixels: &Pixels,
    colours: impl Iterator<Item = [f32; 3]>,
    y: u32,
    luminance: &mut [f32],
    rgb: &mut [[f64; 3]],
) -> Result<RowSummary, Error> {
    let mut summary = RowSummary::default();
    let width = luminance.len().max(1);
    let (row_angle, from_middle) = row_angle(plan, y);
    let cube = plan.of.layout == Layout::Cube;
    let [red, green, blue] = LUMINANCE.map(|c| c as f32);
    let luminance_of = |[r, g, b]: [f32; 3]| if r == g && g == b { r } else { red * r + green * g + blue * b };
    let columns = rgb.len();
    let mut texels = luminance.iter_mut().zip(colours).enumerate();
    for (column, sum) in rgb.iter_mut().enumerate() {
        let end = (column + 1) * width / columns.max(1);
        let begin = column * width / columns.max(1);
        let mut total = [0.0f64; 3];
        for (x, (out, colour)) in texels.by_ref().take(end - begin) {
            let angle = if cube {
                let s = (2.0 * x as f64 + 1.0) / width as f64 - 1.0;
                let squared = 1.0 + s * s + from_middle;
                row_angle / (squared * libm::sqrt(squared))
            } else {
                row_angle
            };
            let [r, g, b] = colour;
            let mut colour = colour;
            let mut l = luminance_of(colour);
            summary.angle += angle;
            // Any NaN, infinite or negative channel, or a sum that overflows.
            let fine = r >= 0.0 && g >= 0.0 && b >= 0.0 && l < f32::INFINITY;
            if !fine {
                let mended = pixels.mended(colour).ok_or(invalid(x as u32, y))?;
                summary.sanitised += u64::from(mended != colour);
                colour = mended;
                // Rounding can carry the sum of three large channels beyond the largest float.
                l = luminance_of(colour).min(f32::MAX);
            }
            *out = l;
            let light = f64::from(l) * angle;
            summary.light += light;
            if light > summary.brightest {
                summary.brightest = light;
            }
            for (total, c) in total.iter_mut().zip(colour) {
                *total += f64::from(c) * angle;
            }
        }
        *sum = total;
    }
    Ok(summary)
}

/// A 16-bit float as f32, exactly.
fn half(bits: u16) -> f32 {
    let sign = u32::from(bits >> 15) << 31;
    let exponent = u32::from(bits >> 10 & 31);
    let fraction = u32::from(bits & 1023);
    let magnitude = match exponent {
        0 => (fraction as f32 * (1.0 / 16_777_216.0)).to_bits(),
        31 => 0x7f80_0000 | fraction << 13,
        _ => (exponent + 112) << 23 | fraction << 13,
    };
    f32::from_bits(sign | magnitude)
}
