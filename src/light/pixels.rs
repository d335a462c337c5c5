//! The caller's pixels: their layout and format, and what becomes of texels that are NaN, infinite or negative.

pub use super::chart::Layout;
use crate::numeric::LUMINANCE;
use crate::status::{Error, Status};
use bytemuck::{Pod, Zeroable};

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

/// What the texels of a map are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pixels {
    /// Which direction a texel stands for.
    pub layout: Layout,
    /// Texels in a row.
    pub width: u32,
    /// Rows; of a cube map all six faces.
    pub height: u32,
    /// 1 (luminance), 3 (RGB) or 4 (RGB and an alpha that is ignored).
    pub channels: u32,
    /// The number format of a channel.
    pub format: Format,
}

impl Pixels {
    /// Bytes of one row.
    pub fn row_bytes(&self) -> Option<usize> {
        let texel = (self.channels as usize).checked_mul(self.format.bytes())?;
        texel.checked_mul(self.width as usize)
    }
}

/// Gives the bytes of a row; `None` stops the build.
pub trait Rows {
    /// Row `y`, at least [`Pixels::row_bytes`] long.
    fn row(&self, y: u32) -> Option<&[u8]>;
}

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

/// What a row held besides light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct RowSummary {
    /// Texels that were negative, or sanitised.
    pub sanitised: u64,
}

/// Decodes one row into luminance and, if `rgb` is not empty, RGB.
///
/// # Errors
/// The first texel that is NaN or infinite, unless `sanitise`.
pub fn decode_row(
    pixels: &Pixels,
    bytes: &[u8],
    y: u32,
    sanitise: bool,
    luminance: &mut [f64],
    rgb: &mut [[f32; 3]],
) -> core::result::Result<RowSummary, Error> {
    let mut summary = RowSummary::default();
    let texels = bytes.chunks_exact((pixels.channels as usize * pixels.format.bytes()).max(1));
    let mut colours = rgb.iter_mut();
    for ((x, texel), out) in (0u32..).zip(texels).zip(luminance.iter_mut()) {
        let found = channels(pixels.format, pixels.channels, texel);
        let colour = mended(found, sanitise, false).ok_or(invalid(x, y))?;
        summary.sanitised += u64::from(colour != found);
        *out = luminance_f64(colour);
        if let Some(out) = colours.next() {
            *out = colour;
        }
    }
    Ok(summary)
}

/// The luminance of a colour in f64; grey stays exactly what it is.
pub fn luminance_f64(rgb: [f32; 3]) -> f64 {
    let [r, g, b] = rgb;
    if r == g && g == b {
        return f64::from(r);
    }
    LUMINANCE[0] * f64::from(r) + LUMINANCE[1] * f64::from(g) + LUMINANCE[2] * f64::from(b)
}

/// The colour of a texel.
pub(crate) fn channels(format: Format, count: u32, texel: &[u8]) -> [f32; 3] {
    let channel = |c: usize| match format {
        Format::F32 => texel.get(4 * c..4 * c + 4).and_then(|b| b.try_into().ok()).map_or(0.0, f32::from_ne_bytes),
        Format::F16 => {
            texel.get(2 * c..2 * c + 2).and_then(|b| b.try_into().ok()).map_or(0.0, |b| half(u16::from_ne_bytes(b)))
        }
    };
    if count == 1 { [channel(0); 3] } else { [channel(0), channel(1), channel(2)] }
}

/// A colour as light: a negative channel is 0, or its size with `absolute`; with `sanitise` NaN is 0 and +Inf [`INFINITE`].
/// `None` without `sanitise` for what is not finite.
pub(crate) fn mended(colour: [f32; 3], sanitise: bool, absolute: bool) -> Option<[f32; 3]> {
    let light = |c: f32| match if absolute { c.abs() } else { c } {
        f32::INFINITY => INFINITE,
        c if c > 0.0 => c,
        _ => 0.0,
    };
    (sanitise || colour.iter().all(|c| c.is_finite())).then(|| colour.map(light))
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

/// Checks sides and channels of a map.
///
/// # Errors
/// [`Error`] names the field.
pub fn check_map(layout: Layout, [width, height]: [u32; 2], channels: u32) -> core::result::Result<(), Error> {
    Error::first([
        (width > 0, c"width"),
        (height > 0 && layout.fits(width, height), c"height"),
        (matches!(channels, 1 | 3 | 4), c"channels"),
    ])
}

/// Checks what the pixels claim to be.
///
/// # Errors
/// [`Status::InvalidArgument`] for sizes of 0 or sides that do not fit the layout, [`Status::Overflow`] if the
/// number of texels or bytes of a row overflows; with the field at fault.
pub fn check(pixels: &Pixels) -> core::result::Result<(), Error> {
    check_map(pixels.layout, [pixels.width, pixels.height], pixels.channels)?;
    let overflow = |field| Error::new(Status::Overflow, 0).of(field);
    pixels.row_bytes().filter(|&b| b <= isize::MAX as usize).ok_or(overflow(c"width"))?;
    (pixels.width as usize).checked_mul(pixels.height as usize).ok_or(overflow(c"height"))?;
    Ok(())
}
