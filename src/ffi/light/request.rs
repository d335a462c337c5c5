//! A checked configuration.

use super::super::{Checked, Failure, frame, sized};
use super::rows::{PixelRows, Source};
use super::{
    ALL_FLAGS, LightConfig, WIS_ENVIRONMENT_COMPENSATED, WIS_ENVIRONMENT_EXACT_ZERO, WIS_ENVIRONMENT_LIGHT_ONLY,
    WIS_ENVIRONMENT_ROWS_AT_POLES, WIS_ENVIRONMENT_SANITISE, WIS_FILTER_BILINEAR, WIS_FILTER_NEAREST, WIS_FORMAT_F16,
    WIS_FORMAT_F32, WIS_LAYOUT_CUBE, WIS_LAYOUT_LATLONG, WIS_LAYOUT_OCTAHEDRAL,
};
use crate::light::chart::Layout;
use crate::light::decode::Pixels;
use crate::light::pixels::Format;
use crate::light::plan::{Description, Filter, MAX_SIDE, Plan};
use crate::numeric::ContentHash;
use crate::sphere::Frame;
use crate::status::{Fault, Status};

/// A checked configuration.
#[derive(Clone, Copy)]
pub(in crate::ffi) struct Request {
    pub(in crate::ffi) plan: Plan,
    pub(in crate::ffi) pixels: Pixels,
    pub(in crate::ffi) frame: Frame,
    flags: u32,
}

impl Request {
    /// Tells whether a later call of the same build brings the same configuration.
    pub(in crate::ffi) fn fingerprint(&self) -> u64 {
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

/// Checks a configuration, which is argument 1.
///
/// # Safety
/// The pointer is null or points to what the header says.
pub(in crate::ffi) unsafe fn read_config(config: *const LightConfig) -> Checked<(Request, PixelRows)> {
    // SAFETY: the caller's contract.
    let c = unsafe { sized(config, 1)? };
    let invalid = |field| Failure::fault(Fault::range(field), 1);
    let overflow = |field| Failure::new(Status::Overflow, 1).of(field);
    let (layout, faces) = match c.layout {
        WIS_LAYOUT_LATLONG => (Layout::LatLong, 1),
        WIS_LAYOUT_CUBE => (Layout::Cube, 6),
        WIS_LAYOUT_OCTAHEDRAL => (Layout::Octahedral, 1),
        _ => return Err(invalid(c"layout")),
    };
    let format = match c.format {
        WIS_FORMAT_F32 => Format::F32,
        WIS_FORMAT_F16 => Format::F16,
        _ => return Err(invalid(c"format")),
    };
    let filter = match c.filter {
        WIS_FILTER_BILINEAR => Filter::Bilinear,
        WIS_FILTER_NEAREST => Filter::Nearest,
        _ => return Err(invalid(c"filter")),
    };
    let has = |flag: u32| c.flags & flag != 0;
    let fits = match layout {
        Layout::LatLong => true,
        Layout::Cube => c.width.checked_mul(6) == Some(c.height),
        Layout::Octahedral => c.width == c.height,
    };
    for (holds, field) in [
        (c.width > 0, c"width"),
        (c.height > 0 && fits, c"height"),
        (matches!(c.channels, 1 | 3 | 4), c"channels"),
        (c.flags & !ALL_FLAGS == 0, c"flags"),
        (!has(WIS_ENVIRONMENT_ROWS_AT_POLES) || layout == Layout::LatLong, c"flags"),
        ((0.0..=1.0).contains(&c.error_budget), c"error_budget"),
    ] {
        if !holds {
            return Err(invalid(field));
        }
    }
    for (side, field) in [(c.width, c"width"), (c.height / faces, c"height")] {
        if side > MAX_SIDE {
            return Err(overflow(field));
        }
    }
    let plan = Plan::new(&Description {
        layout,
        width: c.width,
        height: c.height,
        filter,
        rows_at_poles: has(WIS_ENVIRONMENT_ROWS_AT_POLES),
        exact_zero: has(WIS_ENVIRONMENT_EXACT_ZERO),
        compensated: has(WIS_ENVIRONMENT_COMPENSATED),
        light_only: has(WIS_ENVIRONMENT_LIGHT_ONLY),
        // -0 is 0.
        budget: c.error_budget.abs(),
    })
    .map_err(|status| Failure::new(status, 1))?;
    let pixels = Pixels { channels: c.channels, format, sanitise: has(WIS_ENVIRONMENT_SANITISE) };
    let row_bytes = pixels.row_bytes(c.width).ok_or(overflow(c"width"))?;
    let source = Source { pixels: c.pixels, row_stride: c.row_stride, row: c.row, row_user: c.row_user };
    let rows = PixelRows::new(source, format, row_bytes, c.height)?;
    // SAFETY: the caller's contract: null or nine floats.
    let frame = unsafe { frame(c.world_from_map.cast(), 1) }.map_err(|at| at.of(c"world_from_map"))?;
    Ok((Request { plan, pixels, frame, flags: c.flags }, rows))
}
