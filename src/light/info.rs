//! A light in the numbers of the C interface: what was built.

use super::chart::Layout;
use super::environment::Environment;
use super::plan::Filter;
use super::request::{
    WIS_ENVIRONMENT_COMPENSATED, WIS_ENVIRONMENT_EXACT_ZERO, WIS_ENVIRONMENT_LIGHT_ONLY, WIS_ENVIRONMENT_RAYS_ONLY,
    WIS_ENVIRONMENT_ROWS_AT_POLES, WIS_FILTER_BILINEAR, WIS_FILTER_NEAREST, WIS_LAYOUT_CUBE, WIS_LAYOUT_LATLONG,
    WIS_LAYOUT_OCTAHEDRAL,
};

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
        let flag = |on: bool, flag: u32| if on { flag } else { 0 };
        LightInfo {
            size: size_of::<LightInfo>() as u32,
            layout: match of.layout {
                Layout::LatLong => WIS_LAYOUT_LATLONG,
                Layout::Cube => WIS_LAYOUT_CUBE,
                Layout::Octahedral => WIS_LAYOUT_OCTAHEDRAL,
            },
            width: of.width,
            height: of.height,
            filter: if of.filter == Filter::Bilinear { WIS_FILTER_BILINEAR } else { WIS_FILTER_NEAREST },
            flags: flag(of.rows_at_poles, WIS_ENVIRONMENT_ROWS_AT_POLES)
                | flag(of.exact_zero, WIS_ENVIRONMENT_EXACT_ZERO)
                | flag(of.compensated, WIS_ENVIRONMENT_COMPENSATED)
                | flag(of.light_only, WIS_ENVIRONMENT_LIGHT_ONLY)
                | flag(of.rays_only, WIS_ENVIRONMENT_RAYS_ONLY),
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
