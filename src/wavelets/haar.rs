//! The n-dimensional non-standard Haar transform, n = 1 to 4, in place and orthonormal on the unit cube.
//!
//! Clarberg et al. 2005, Section 3. A square at level l with translation t has one detail for each
//! f = (f1 .. fn) != 0 in binary, f1 (axis 1) most significant; its sign on child c is (-1)^popcount(f & c).
//! In value space average(child c) = average(parent) + sum over f of sign(f, c) detail(f); the orthonormal
//! coefficient is 2^(-n l / 2) times that detail.
//!
//! The coefficient (l, t, f) replaces the pixel at coordinates (2 t_q + f_q) 2^(depth - 1 - l), the scaling
//! coefficient the pixel at the origin; so neither direction needs memory of its own.

use crate::status::{Result, Status};
use crate::wavelets::morton::{self, MAX_DEPTH};
use core::f64::consts::FRAC_1_SQRT_2;

/// The average (entry 0) and the value-space details (entry f) of a square from the averages of its children.
#[inline]
pub fn analyse<const C: usize>(children: [f64; C]) -> [f64; C] {
    hadamard(children).map(|sum| sum / C as f64)
}

/// The averages of the children of a square from its average and value-space details: the inverse of [`analyse`].
#[inline]
pub fn synthesise<const C: usize>(details: [f64; C]) -> [f64; C] {
    hadamard(details)
}

/// Sums over c of (-1)^popcount(f & c) value(c), for every f.
fn hadamard<const C: usize>(values: [f64; C]) -> [f64; C] {
    const { assert!(C.is_power_of_two()) };
    let mut values = values;
    let mut bit = 1;
    while bit < C {
        for c in (0..C).filter(|c| c & bit == 0) {
            let (lower, upper) = (values[c], values[(c | bit) & (C - 1)]);
            values[c] = lower + upper;
            values[(c | bit) & (C - 1)] = lower - upper;
        }
        bit *= 2;
    }
    values
}

/// Replaces an image of 2^depth pixels on each of `N` axes (C order, axis 1 slowest) by its coefficients.
///
/// # Errors
/// [`Status::InvalidArgument`] if the depth exceeds 12 or the length is not 2^(n depth).
pub fn forward<const N: usize, const C: usize>(depth: u32, values: &mut [f64]) -> Result<()> {
    let grid = Grid::<N, C>::new(depth, values.len())?;
    for level in (0..depth).rev() {
        let scale = coefficient_scale(N as u32 * level);
        for square in 0..grid.squares(level) {
            let slots = grid.slots(level, square);
            let mut details = analyse(load(values, slots));
            details.iter_mut().skip(1).for_each(|detail| *detail *= scale);
            store(values, slots, details);
        }
    }
    Ok(())
}

/// Replaces the coefficients of an image by its pixels: the inverse of [`forward`].
///
/// # Errors
/// As [`forward`].
pub fn inverse<const N: usize, const C: usize>(depth: u32, values: &mut [f64]) -> Result<()> {
    let grid = Grid::<N, C>::new(depth, values.len())?;
    for level in 0..depth {
        let scale = coefficient_scale(N as u32 * level);
        for square in 0..grid.squares(level) {
            let slots = grid.slots(level, square);
            let mut details = load(values, slots);
            details.iter_mut().skip(1).for_each(|detail| *detail /= scale);
            store(values, slots, synthesise(details));
        }
    }
    Ok(())
}

/// [`forward`] for 1 to 4 axes.
///
/// # Errors
/// As [`forward`].
pub fn forward_any(axes: u32, depth: u32, values: &mut [f64]) -> Result<()> {
    match axes {
        1 => forward::<1, 2>(depth, values),
        2 => forward::<2, 4>(depth, values),
        3 => forward::<3, 8>(depth, values),
        _ => forward::<4, 16>(depth, values),
    }
}

/// [`inverse`] for 1 to 4 axes.
///
/// # Errors
/// As [`forward`].
pub fn inverse_any(axes: u32, depth: u32, values: &mut [f64]) -> Result<()> {
    match axes {
        1 => inverse::<1, 2>(depth, values),
        2 => inverse::<2, 4>(depth, values),
        3 => inverse::<3, 8>(depth, values),
        _ => inverse::<4, 16>(depth, values),
    }
}

/// 2^(-half_exponent / 2).
fn coefficient_scale(half_exponents: u32) -> f64 {
    let even = (0..half_exponents / 2).fold(1.0, |scale, _| scale * 0.5);
    if half_exponents % 2 == 0 { even } else { even * FRAC_1_SQRT_2 }
}

/// An image of 2^depth pixels on each of `N` axes, and where its squares keep their `C = 2^N` numbers.
struct Grid<const N: usize, const C: usize> {
    depth: u32,
}

impl<const N: usize, const C: usize> Grid<N, C> {
    fn new(depth: u32, len: usize) -> Result<Self> {
        const { assert!(C == 1 << N, "a square of n axes has 2^n children") };
        if depth <= MAX_DEPTH && morton::cells(N as u32, depth) == Some(len) {
            Ok(Grid { depth })
        } else {
            Err(Status::InvalidArgument)
        }
    }

    fn squares(&self, level: u32) -> usize {
        1usize.wrapping_shl(N as u32 * level)
    }

    /// The pixels at coordinates (2 t_q + f_q) 2^(depth - 1 - level), for every f.
    fn slots(&self, level: u32, square: usize) -> [usize; C] {
        let stride = self.depth.wrapping_sub(level + 1);
        let t = morton::c_order_cell::<N>(square, level);
        core::array::from_fn(|f| {
            t.iter().enumerate().fold(0, |index: usize, (axis, t)| {
                let half = (f >> (N - 1 - axis)) & 1;
                index.wrapping_shl(self.depth) | (2 * *t as usize + half).wrapping_shl(stride)
            })
        })
    }
}

fn load<const C: usize>(values: &[f64], slots: [usize; C]) -> [f64; C] {
    slots.map(|slot| values.get(slot).copied().unwrap_or(0.0))
}

fn store<const C: usize>(values: &mut [f64], slots: [usize; C], new: [f64; C]) {
    for (slot, new) in slots.into_iter().zip(new) {
        if let Some(value) = values.get_mut(slot) {
            *value = new;
        }
    }
}
