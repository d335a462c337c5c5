//! What a comparison found, in the numbers of the C interface.

use super::compare::Comparison;
use super::config::{WIS_ENVIRONMENT_ROWS_AT_POLES, WIS_FILTER_BILINEAR, WIS_FILTER_NEAREST};
use super::plan::Filter;

/// The environment is the light that you see.
pub const WIS_CAUSE_NONE: u32 = 0;
/// Your radiance is `scale` times the light: harmless if you meant it, since rays are chosen alike.
pub const WIS_CAUSE_SCALED: u32 = 1;
/// You do not apply world_from_map, or you apply its inverse.
pub const WIS_CAUSE_FRAME: u32 = 2;
/// Your map is rotated by 90, 180 or 270 degrees about the polar axis.
pub const WIS_CAUSE_TURNED: u32 = 3;
/// Your map is mirrored: azimuth runs the other way.
pub const WIS_CAUSE_MIRRORED: u32 = 4;
/// Your polar axis points the other way: rows from bottom to top.
pub const WIS_CAUSE_UPSIDE_DOWN: u32 = 5;
/// Another axis is your polar axis: y up, for instance, in place of z.
pub const WIS_CAUSE_AXES: u32 = 6;
/// You look texels up half a texel beside.
pub const WIS_CAUSE_SHIFTED: u32 = 7;
/// Your first and last rows lie at the poles and those of the environment do not, or the other way round.
pub const WIS_CAUSE_ROWS: u32 = 8;
/// You interpolate and the environment takes the nearest texel, or the other way round.
pub const WIS_CAUSE_FILTER: u32 = 9;
/// Another map, rotation, blur or curve of colours: no other cause leaves almost no difference.
pub const WIS_CAUSE_OTHER: u32 = 10;
/// You clamp what you look up at `limit`: clamp the map before you build the light.
pub const WIS_CAUSE_CLAMPED: u32 = 11;

/// What was found. From `filter` on: what to build the environment with so that it is the light that you see.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct CheckInfo {
    /// sizeof(wis_check_info), set by the caller.
    pub size: u32,
    /// WIS_CAUSE_*: the likely cause of the difference.
    pub cause: u32,
    /// The mean difference of both, each as a share of the larger, 0 to 1. A factor does not count.
    pub error: f32,
    /// The difference that is left with the fields below: `error` if nothing explains it.
    pub explained: f32,
    /// Your radiance over that of the light.
    pub scale: f32,
    /// WIS_FILTER_*.
    pub filter: u32,
    /// WIS_ENVIRONMENT_ROWS_AT_POLES or 0.
    pub flags: u32,
    /// How far beside you look texels up along columns and rows, in texels: 0, 0.5 or -0.5. To be mended in your look-up.
    pub shift: [f32; 2],
    /// The row-major matrix.
    pub world_from_map: [f32; 9],
    /// The luminance at which you clamp what you look up; 0 if you do not.
    pub limit: f32,
}

impl From<Comparison> for CheckInfo {
    fn from(found: Comparison) -> CheckInfo {
        CheckInfo {
            size: size_of::<CheckInfo>() as u32,
            cause: found.cause as u32,
            error: found.error,
            explained: found.explained,
            scale: found.scale,
            filter: if found.filter == Filter::Bilinear { WIS_FILTER_BILINEAR } else { WIS_FILTER_NEAREST },
            flags: if found.rows_at_poles { WIS_ENVIRONMENT_ROWS_AT_POLES } else { 0 },
            shift: found.shift,
            world_from_map: found.world_from_map,
            limit: found.limit,
        }
    }
}
