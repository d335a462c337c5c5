//! A product in the numbers of the C interface: what was prepared.

use super::density::Shaded;
use crate::light::environment::Environment;

/// What was prepared.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct GridInfo {
    /// sizeof(wis_product_info), set by the caller.
    pub size: u32,
    /// Bytes of the product: that much of the block is in use.
    pub bytes: u32,
    /// Cells that are divided.
    pub divided_cells: u32,
    /// The share of `u[0]` that draws from lobes: narrow ones, or all where a lamp below the horizon would win.
    pub lobe_share: f32,
    /// About the integral of luminance x BRDF x cosine, no estimate. Off by 2 % (root mean square over points, median of eight maps) for
    /// Lambert's lobe and GGX 0.5, 6 % for 0.2, 9 % for 0.1, 21 % for 0.05, and by a factor of 1.5 for 0.02. Where a map is black but for lamps more:
    /// a factor of 1.2 for GGX 0.2, of 5 for 0.02.
    pub integral: f64,
    /// The same for the colour of the light; the BRDF counts by its luminance.
    pub rgb: [f32; 3],
    /// The cosine of the cone of normals that it serves.
    pub cone_cosine: f32,
    /// The content id of its environment.
    pub environment: u64,
}

impl GridInfo {
    /// What a product of an environment is.
    pub fn of(shaded: &Shaded<'_>, environment: &Environment<'_>) -> GridInfo {
        let header = shaded.product.header;
        GridInfo {
            size: size_of::<GridInfo>() as u32,
            bytes: header.bytes,
            divided_cells: header.divided,
            lobe_share: header.peak,
            integral: header.integral,
            rgb: shaded.colour(environment.colours()),
            cone_cosine: header.cone,
            environment: header.environment,
        }
    }
}
