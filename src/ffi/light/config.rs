//! A light in the numbers of the C interface: what a client asks for, checked, and what was built.

use crate::ffi::Checked;
use crate::light::chart::LAYOUTS;
use crate::light::environment::Environment;
use crate::light::pixels::{Format, Pixels};
use crate::light::plan::{Description, Filter, Plan};
use crate::numeric::ContentHash;
use crate::sphere::Frame;
use crate::status::{Error, Status};
use core::ffi::c_void;

/// Columns: azimuth 2 pi (x + 1/2) / width from +x to +y. Rows: angle pi (y + 1/2) / height from +z.
pub const WIS_LAYOUT_LATLONG: u32 = 1;
/// Six square faces below one another, +x -x +y -y +z -z, each as OpenGL orients it; height = 6 width.
pub const WIS_LAYOUT_CUBE: u32 = 2;
/// Equal-area octahedral square (Clarberg 2008): +z in the centre, columns along x; height = width.
pub const WIS_LAYOUT_OCTAHEDRAL: u32 = 3;

/// The passes of a build that threads share.
pub const WIS_ENVIRONMENT_PASSES: u32 = 6;

/// 32-bit floats.
pub const WIS_FORMAT_F32: u32 = 1;
/// 16-bit floats.
pub const WIS_FORMAT_F16: u32 = 2;

/// You interpolate between texel centres. Azimuth wraps; beyond a pole rows go on half a turn further; faces join.
pub const WIS_FILTER_BILINEAR: u32 = 0;
/// You take the texel that holds the direction.
pub const WIS_FILTER_NEAREST: u32 = 1;

/// Lat-long: the first and the last row lie at the poles: theta = pi y / (height - 1).
pub const WIS_ENVIRONMENT_ROWS_AT_POLES: u32 = 1;
/// Black texels get pdf 0. Otherwise none counts as darker than 2^-16 of the mean.
pub const WIS_ENVIRONMENT_EXACT_ZERO: u32 = 2;
/// Densities and products are those of max(L - mean, L / 64) (Karlik et al. 2019), for MIS.
pub const WIS_ENVIRONMENT_COMPENSATED: u32 = 4;
/// NaN and -Inf count as 0, +Inf as 65504, instead of being rejected. Clamp your look-up alike.
pub const WIS_ENVIRONMENT_SANITISE: u32 = 8;

/// No products will be prepared with it, nor shared by hits: 21 kB less. wis_product_prepare answers WIS_NOT_BUILT.
pub const WIS_ENVIRONMENT_LIGHT_ONLY: u32 = 16;
/// Only rays will be drawn with it: no exact tables. 1.1 to 2.1 MB for a map of 1024 x 512, in half the time; wis_sample, wis_pdf, wis_invert,
/// wis_product_prepare and wis_check answer WIS_NOT_BUILT, with the field `flags`. A library without products and checks sets it.
pub const WIS_ENVIRONMENT_RAYS_ONLY: u32 = 64;
/// Negative channels count by their size instead of as 0: pdf > 0 wherever |L| > 0.
pub const WIS_ENVIRONMENT_ABSOLUTE: u32 = 32;

/// By their numbers: WIS_FORMAT_*, from 1 on.
const FORMATS: [Format; 2] = [Format::F32, Format::F16];
/// By their numbers: WIS_FILTER_*.
const FILTERS: [Filter; 2] = [Filter::Bilinear, Filter::Nearest];

/// The switches of a description.
const SWITCHES: [u32; 5] = [
    WIS_ENVIRONMENT_ROWS_AT_POLES,
    WIS_ENVIRONMENT_EXACT_ZERO,
    WIS_ENVIRONMENT_COMPENSATED,
    WIS_ENVIRONMENT_LIGHT_ONLY,
    WIS_ENVIRONMENT_RAYS_ONLY,
];

/// Gives row `y` in the format of the configuration. The bytes must stay until the next call on the same
/// thread. Null: WIS_CALLBACK_FAILED.
pub type RowFn = Option<unsafe extern "C" fn(user: *mut c_void, y: u32) -> *const c_void>;

/// The map, and what to build from it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct LightConfig {
    /// sizeof(wis_environment_config).
    pub size: u32,
    /// WIS_LAYOUT_*.
    pub layout: u32,
    /// Texels in a row, 1 to 32768, also odd; more is WIS_OVERFLOW.
    pub width: u32,
    /// Rows, 1 to 32768; of a cube map all six faces. More is WIS_OVERFLOW.
    pub height: u32,
    /// 1 (luminance), 3 (RGB) or 4 (alpha is ignored), linear Rec. 709. Negative ones count as 0: clamp alike.
    pub channels: u32,
    /// WIS_FORMAT_*.
    pub format: u32,
    /// WIS_FILTER_*: how you look the map up.
    pub filter: u32,
    /// WIS_ENVIRONMENT_*, or 0.
    pub flags: u32,
    /// The relative standard deviation of radiance / pdf that coarser tables may add, 0 to 1; 0: every texel.
    pub error_budget: f32,
    /// Texel 0 of row 0, aligned to its format; or null, and `row` gives the rows, which need no alignment.
    pub pixels: *const c_void,
    /// Bytes from a row to the next, a multiple of a channel's, may be negative; 0: rows stand close together.
    pub row_stride: isize,
    /// Used if `pixels` is null; called from each thread that runs the first pass.
    pub row: RowFn,
    /// Handed to `row`.
    pub row_user: *mut c_void,
    /// A row-major 3x3 rotation or reflection, world = M map, within 1e-4; null is the identity. Copied.
    pub world_from_map: *const f32,
}

/// A build that was asked for.
#[derive(Clone, Copy, Debug)]
pub struct Request {
    /// What the map becomes.
    pub plan: Plan,
    /// How its pixels are stored.
    pub pixels: Pixels,
    /// From its space to the world's.
    pub frame: Frame,
    /// WIS_ENVIRONMENT_*.
    pub flags: u32,
}

impl Request {
    /// Checks a configuration; the frame is the identity.
    ///
    /// # Errors
    /// [`Error`] names the field.
    pub fn new(config: &LightConfig) -> Result<Request, Error> {
        let &LightConfig { width, height, channels, flags, error_budget, .. } = config;
        // Layouts and formats are counted from 1 on.
        let layout = LAYOUTS.get((config.layout as usize).wrapping_sub(1)).ok_or(Error::range(c"layout"))?;
        let format = FORMATS.get((config.format as usize).wrapping_sub(1)).ok_or(Error::range(c"format"))?;
        let filter = FILTERS.get(config.filter as usize).ok_or(Error::range(c"filter"))?;
        let known = SWITCHES.iter().sum::<u32>() | WIS_ENVIRONMENT_SANITISE | WIS_ENVIRONMENT_ABSOLUTE;
        Error::first([(matches!(channels, 1 | 3 | 4), c"channels"), (flags & !known == 0, c"flags")])?;
        let [sanitise, absolute] = [WIS_ENVIRONMENT_SANITISE, WIS_ENVIRONMENT_ABSOLUTE].map(|flag| flags & flag != 0);
        // -0 is 0.
        let budget = if error_budget == 0.0 { 0.0 } else { error_budget };
        let of = Description::new(*layout, [width, height], *filter, budget).switched(flags, SWITCHES);
        let pixels = Pixels { channels, format: *format, sanitise, absolute };
        Ok(Request { plan: Plan::new(&of.as_read())?, pixels, frame: Frame::IDENTITY, flags })
    }

    /// Tells whether a later call of the same build brings the same configuration.
    pub fn fingerprint(&self) -> u64 {
        let of = &self.plan.of;
        let mut hash = ContentHash::new();
        for word in [of.layout as u32, of.width, of.height, of.filter as u32, self.flags, of.budget.to_bits()] {
            hash.add(word.into());
        }
        for word in [self.pixels.channels, self.pixels.format as u32] {
            hash.add(word.into());
        }
        hash.add_floats(&self.frame.to_array());
        hash.finish()
    }
}

/// What was built.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct LightInfo {
    /// sizeof(wis_environment_info), set by the caller.
    pub size: u32,
    /// WIS_LAYOUT_*.
    pub layout: u32,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// WIS_FILTER_*.
    pub filter: u32,
    /// WIS_ENVIRONMENT_*, but for WIS_ENVIRONMENT_SANITISE and WIS_ENVIRONMENT_ABSOLUTE.
    pub flags: u32,
    /// Bytes of the environment: that much of the block is in use and needs to be saved.
    pub bytes: u64,
    /// Texels that had a negative channel, or one that WIS_ENVIRONMENT_SANITISE replaced.
    pub sanitised: u64,
    /// Tells environments apart: a hash of the bytes, also of world_from_map.
    pub content_id: u64,
    /// The integral of luminance, or of what compensation leaves of it, over the sphere: unit of the map x steradian. WIS_ENVIRONMENT_RAYS_ONLY: of luminance.
    pub power: f64,
    /// The mean luminance over the sphere, in the unit of the map.
    pub mean: f64,
    /// The share of the light that the brightest texel gives, 0 to 1.
    pub largest_share: f64,
    /// The relative standard deviation of radiance / pdf that the error budget added.
    pub error: f64,
}

impl LightInfo {
    /// What an environment is.
    pub fn of(environment: &Environment<'_>) -> LightInfo {
        let (header, of) = (environment.header(), environment.description());
        LightInfo {
            size: size_of::<LightInfo>() as u32,
            layout: of.layout as u32 + 1,
            width: of.width,
            height: of.height,
            filter: if of.filter == Filter::Bilinear { WIS_FILTER_BILINEAR } else { WIS_FILTER_NEAREST },
            flags: of.flags(SWITCHES),
            bytes: header.bytes,
            sanitised: header.sanitised,
            content_id: header.content_id,
            power: header.power,
            mean: header.mean,
            largest_share: header.largest_share,
            error: header.error,
        }
    }
}

/// The client's rows, as a configuration describes them.
pub(in crate::ffi) struct PixelRows<'a> {
    config: &'a LightConfig,
    row_bytes: usize,
    stride: isize,
}

impl<'a> PixelRows<'a> {
    /// Checks what a configuration, which is argument 1, says about its rows.
    pub(in crate::ffi) fn new(config: &'a LightConfig, of: &Request) -> Checked<PixelRows<'a>> {
        let (row_bytes, channel) = (of.pixels.row_bytes(config.width).unwrap_or(usize::MAX), of.pixels.format.bytes());
        let stride = if config.row_stride == 0 { row_bytes as isize } else { config.row_stride };
        for (holds, status, field) in [
            (stride.unsigned_abs() >= row_bytes, Status::InvalidArgument, c"row_stride"),
            (stride % channel as isize == 0, Status::Misaligned, c"row_stride"),
            (stride.checked_mul(config.height as isize).is_some(), Status::Overflow, c"row_stride"),
            (!config.pixels.is_null() || config.row.is_some(), Status::NullPointer, c"pixels"),
            (config.pixels.addr() % channel == 0, Status::Misaligned, c"pixels"),
        ] {
            if !holds {
                return Err(Error::new(status, 1).of(field));
            }
        }
        Ok(PixelRows { config, row_bytes, stride })
    }

    /// Row `y`.
    pub(in crate::ffi) fn row(&self, y: u32) -> Option<&'a [u8]> {
        let &LightConfig { pixels, row, row_user, .. } = self.config;
        let start: *const u8 = match row {
            // SAFETY: row y of the array that the client describes; the offset was checked to fit an isize.
            _ if !pixels.is_null() => unsafe { pixels.cast::<u8>().byte_offset(self.stride * y as isize) },
            // SAFETY: the client's function with the client's argument.
            Some(row) => unsafe { row(row_user, y).cast() },
            None => core::ptr::null(),
        };
        // SAFETY: the client gives rows of that many bytes.
        (!start.is_null()).then(|| unsafe { core::slice::from_raw_parts(start, self.row_bytes) })
    }
}
