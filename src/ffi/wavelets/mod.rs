//! The boundary of `wis_wavelets.h`.

pub mod environment;
pub mod grid;
pub mod haar;
mod memory;
pub mod product;
pub mod sampling;
pub mod sparse;
pub mod table;
pub mod tree;
pub mod triple;
pub mod visibility;

use crate::ffi::{Checked, require};
use crate::status::Status;

/// Checks numbers of axes, which are the first two arguments: n, 1 to 4, and the first m of them.
pub(crate) fn check_axes(n: u32, m: u32) -> Checked<()> {
    require((1..=4).contains(&n), Status::InvalidArgument, 1)?;
    require((1..=n).contains(&m), Status::InvalidArgument, 2)
}
