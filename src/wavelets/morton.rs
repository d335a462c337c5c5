//! Morton order: the cells of a grid of 2^depth cells per axis, ordered so that the children of every square
//! stand together in child order. Axis 1 gives the most significant bit of each child number.

use crate::status::{Result, Status};

/// The finest grid has 2^12 cells per axis.
pub const MAX_DEPTH: u32 = 12;

/// The number of cells of a grid of `n` axes; `None` if it does not fit a `usize`.
pub fn cells(n: u32, depth: u32) -> Option<usize> {
    1usize.checked_shl(n.checked_mul(depth)?)
}

/// The Morton code of cell `t`; n depth must be at most 64 bits.
#[inline]
pub fn encode<const N: usize>(t: [u32; N], depth: u32) -> u64 {
    (0..depth)
        .rev()
        .fold(0, |code, bit| t.iter().fold(code, |code, t| (code << 1) | u64::from(t.wrapping_shr(bit) & 1)))
}

/// The coordinates of a pixel from its position in C order (last axis fastest).
#[inline]
pub fn c_order_cell<const N: usize>(index: usize, depth: u32) -> [u32; N] {
    let mut t = [0; N];
    let mut index = index;
    for t in t.iter_mut().rev() {
        *t = (index & 1usize.wrapping_shl(depth).wrapping_sub(1)) as u32;
        index = index.wrapping_shr(depth);
    }
    t
}

/// Copies a grid from C order (last axis fastest) to Morton order.
///
/// # Errors
/// [`Status::InvalidArgument`] if a length is not 2^(n depth).
pub fn copy_from_c_order<const N: usize>(depth: u32, pixels: &[f32], out: &mut [f32]) -> Result<()> {
    let count = cells(N as u32, depth).ok_or(Status::Overflow)?;
    if pixels.len() != count || out.len() != count {
        return Err(Status::InvalidArgument);
    }
    let last_axis = last_axis_bits::<N>(depth);
    let side = 1usize.wrapping_shl(depth);
    let mut code = 0;
    for (i, pixel) in pixels.iter().enumerate() {
        if i & (side - 1) == 0 {
            code = encode(c_order_cell::<N>(i, depth), depth) as usize;
        }
        if let Some(cell) = out.get_mut(code) {
            *cell = *pixel;
        }
        code = (code & !last_axis) | ((code | !last_axis).wrapping_add(1) & last_axis);
    }
    Ok(())
}

/// The bits of a code that hold the last coordinate: adding 1 behind the other bits steps along that axis.
fn last_axis_bits<const N: usize>(depth: u32) -> usize {
    (0..depth).fold(0, |bits, _| bits.wrapping_shl(N as u32) | 1)
}
