//! Divided cells: F at the middles of 4 x 4 parts of the light's numbers, and from there bilinear in each part.
//!
//! Cells stand side by side in groups, so that what is done to parts is done to many of them at once.

use super::corners::{Cone, respond};
use super::leaves::{Corners, FLOOR, largest};
use crate::brdf::surface::Surface;
use crate::light::guide::Guide;
use crate::light::parts::{MIDDLES, PARTS};
use crate::simd::{GROUP, Num};

/// A part reflects nothing if F is not above 0 up to this far beyond its middle, over the way to its corners: slopes are no more than a guess, and
/// a sliver of a lamp may stand above the horizon. The largest weights of `the_sky_about_a_lamp_below_the_horizon_has_no_huge_weight` are
/// 50000 at 1.25, 59 at 1.5 to 2, and 163 at 3.
const REACH: f32 = 1.75;

/// F at the middles of the parts of a group of cells.
pub type Middles = [[f32; GROUP]; MIDDLES];

/// Evaluates F at the middles of the parts of at most a group of cells.
#[inline(always)]
pub fn middles<F: Num>(surface: &Surface, cone: &Cone, guide: &Guide<'_>, cells: &[u32], out: &mut Middles) {
    for (lane, &cell) in cells.iter().enumerate() {
        let mut values = [0.0; MIDDLES];
        respond::<F>(surface, cone, guide.middles(cell as usize), &mut values);
        for (out, value) in out.iter_mut().zip(values) {
            if let Some(out) = out.get_mut(lane) {
                *out = value;
            }
        }
    }
}

/// Writes the borders of the parts of at most a group of cells; 1 at places without a cell.
#[inline(always)]
pub fn borders(guide: &Guide<'_>, cells: &[u32], out: &mut [[f32; GROUP]]) {
    out.fill([1.0; GROUP]);
    for (lane, &cell) in cells.iter().enumerate() {
        for (out, border) in out.iter_mut().zip(guide.borders(cell as usize)) {
            if let Some(out) = out.get_mut(lane) {
                *out = border;
            }
        }
    }
}

/// Whether a part reflects so little at its middle that most of its least value is wasted.
#[inline(always)]
pub fn is_wasted<F: Num>(middle: F, least: F) -> F::Mask {
    middle.lt(F::splat(0.5) * least)
}

/// F over part (column, row) of the cells from place `first` of a group on: the middle's value with the slopes to its neighbours. `kept`: the least value where nothing is
/// reflected, also not beside the part.
#[inline(always)]
pub fn part<F: Num>(middles: &Middles, first: usize, [column, row]: [usize; 2], least: F, kept: F) -> Corners<F> {
    let at = |column: usize, row: usize| F::at(middles.get(row * PARTS + column).unwrap_or(&[0.0; GROUP]), first);
    let value = at(column, row);
    let half = F::splat(0.5);
    let (left, right) = (at(column.saturating_sub(1), row), at((column + 1).min(PARTS - 1), row));
    let (top, bottom) = (at(column, row.saturating_sub(1)), at(column, (row + 1).min(PARTS - 1)));
    let across = slope::<F>(left, value, right, column) * half;
    let down = slope::<F>(top, value, bottom, row) * half;
    let corners = [value - across - down, value + across - down, value - across + down, value + across + down];
    let highest = value + F::splat(REACH) * (across.abs() + down.abs());
    let is_dark = F::and(is_wasted::<F>(value, least), highest.le(F::splat(0.0)));
    let floor = F::select(is_dark, kept, least).max(F::splat(FLOOR) * largest(corners));
    let mut out = corners;
    for (out, corner) in out.iter_mut().zip(corners) {
        *out = corner.max(floor);
    }
    out
}

/// The slope over a part: at either end of a cell to the only neighbour; elsewhere the mean of both, but at most twice the smaller,
/// so that a jump on one side does not overshoot on the other (van Leer 1977).
#[inline(always)]
fn slope<F: Num>(before: F, value: F, behind: F, place: usize) -> F {
    let (zero, two) = (F::splat(0.0), F::splat(2.0));
    let (left, right) = (value - before, behind - value);
    if place == 0 {
        return right;
    }
    if place == PARTS - 1 {
        return left;
    }
    let mean = F::splat(0.5) * (left + right);
    let limit = two * left.abs().min(right.abs());
    let limited = (mean.abs().min(limit)).copysign(mean);
    F::only(zero.lt(left * right), limited)
}
