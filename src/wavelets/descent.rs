//! Sample, pdf and invert of a density on the octahedral square, and of directions in world space.
//!
//! A density is a tree of quads that ends in cells with a bilinear density. One walk serves all three calls, and
//! the pdf is one function of the world direction: a sample's pdf is the pdf of the direction that it returns
//! (rules 12 and 13 of the design: the same bits, and never 0 where the stored density is not).

pub(crate) use crate::numeric::ONE_MINUS_EPSILON;
use crate::numeric::{inverse_power, max, min, sqrt};
pub use crate::sample::Sample;
use crate::sphere::{self, Frame, SPHERE, unit};
use crate::status::{Result, Status};
use crate::wavelets::tree::MAX_REFINED;
use crate::wavelets::warp::{clamp_u, place, quad_density, take_quad, undo_quad};
use glam::Vec3;

/// A density on the square: quads down to cells, a bilinear function inside each cell.
pub trait Density {
    /// Whether there is anything to sample.
    fn is_positive(&self) -> bool;
    /// Walks from the whole square to a cell: hands the masses of the four children to `choose`, goes to the child
    /// that it names, and so on. Returns the density of the cell at its corners, up to a factor (corner `2 b1 + b2`,
    /// bit 0 = lower end of the axis), or `None` if `choose` gave up.
    fn walk(&self, choose: impl FnMut([f32; 4]) -> Option<u32>) -> Option<[f32; 4]>;
}

/// A cell of the square: `index` of 2^level cells along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Cell {
    level: u32,
    index: [u32; 2],
}

impl Cell {
    const WHOLE: Cell = Cell { level: 0, index: [0, 0] };

    fn child(self, c: u32) -> Cell {
        let [i, j] = self.index;
        Cell { level: self.level + 1, index: [2 * i + (c >> 1 & 1), 2 * j + (c & 1)] }
    }

    /// Whether the cell is not finer than the finest that there is: a damaged tree ends here.
    fn is_allowed(self) -> bool {
        self.level <= MAX_REFINED
    }

    fn contains(self, s: [f32; 2]) -> bool {
        let scale = (1u32 << (self.level & 31)) as f32;
        [(s[0] * scale) as u32, (s[1] * scale) as u32] == self.index
    }

    fn centre(self) -> [f32; 2] {
        let width = inverse_power(self.level);
        self.index.map(|i| (i as f32 + 0.5) * width)
    }
}

/// A point of the square as the path that leads to it: which child at each level, and where in the last cell.
#[derive(Clone, Copy)]
struct Path {
    s: [f32; 2],
    /// The coordinates in units of the finest cells.
    finest: [u32; 2],
}

impl Path {
    #[inline(always)]
    fn to(s: [f32; 2]) -> Path {
        const CELLS: f32 = (1 << MAX_REFINED) as f32;
        Path { s, finest: s.map(|s| (s * CELLS) as u32) }
    }

    /// The child at a level below [`MAX_REFINED`].
    #[inline(always)]
    fn child(&self, level: u32) -> u32 {
        let shift = (MAX_REFINED - 1).wrapping_sub(level) & 31;
        let [i, j] = self.finest;
        2 * (i >> shift & 1) + (j >> shift & 1)
    }

    /// The place inside the cell of a level, each coordinate in [0, 1).
    #[inline(always)]
    fn offset(&self, level: u32) -> [f32; 2] {
        let scale = (1u32 << (level & 31)) as f32;
        let shift = MAX_REFINED.wrapping_sub(level) & 31;
        let [i, j] = self.finest;
        [self.s[0] * scale - (i >> shift) as f32, self.s[1] * scale - (j >> shift) as f32]
    }
}

/// A point of the square that was sampled.
#[derive(Clone, Copy)]
struct Place {
    s: [f32; 2],
    cell: Cell,
    /// The product of the split densities that lead to the cell, and the cell's corners.
    product: f32,
    corners: [f32; 4],
}

/// Random numbers as every sampling call takes them.
#[inline(always)]
pub(crate) fn clamp(u: [f32; 2]) -> [f32; 2] {
    u.map(clamp_u)
}

/// The point of the square for `u`.
#[inline(always)]
fn sample_square<D: Density>(density: &D, u: [f32; 2]) -> Option<Place> {
    let mut cell = Cell::WHOLE;
    let mut u = clamp(u);
    let mut product = 1.0;
    let corners = density.walk(|masses| {
        let (c, inside, factor) = take_quad(masses, u);
        u = inside;
        product *= factor;
        cell = cell.child(c);
        cell.is_allowed().then_some(c)
    })?;
    let inside = sample_bilinear(corners, u);
    let [i, j] = cell.index;
    let s = [place(i, inside[0], cell.level), place(j, inside[1], cell.level)];
    Some(Place { s, cell, product, corners })
}

/// The density at a point of the square, with respect to area; 0 where the stored density is 0.
#[inline(always)]
fn density_at<D: Density>(density: &D, s: [f32; 2]) -> f32 {
    let path = Path::to(s);
    let mut level = 0;
    let mut product = 1.0;
    let corners = density.walk(|masses| {
        let c = path.child(level);
        product *= quad_density(masses, c);
        level += 1;
        (product > 0.0 && level <= MAX_REFINED).then_some(c)
    });
    corners.map_or(0.0, |corners| product * bilinear_density(corners, path.offset(level)))
}

/// A sample of the density as a direction of world space.
#[inline]
pub fn sample<D: Density>(density: &D, frame: &Frame, u: [f32; 2]) -> Sample {
    if !density.is_positive() {
        return Sample::default();
    }
    let Some(place) = sample_square(density, u) else {
        return Sample::default();
    };
    let (world, back) = direction_in_cell(frame, place.cell, place.s);
    // Back in the cell, the walk to it is the one that was just taken: the bits are those of `density_at`.
    let value = if place.cell.contains(back) {
        place.product * bilinear_density(place.corners, Path::to(back).offset(place.cell.level))
    } else {
        density_at(density, back)
    };
    Sample { wi: world.to_array(), pdf: per_solid_angle(value) }
}

/// The world direction for `s`, and the point of the square that the direction leads back to.
///
/// Rounding may carry a point next to a border into the neighbouring cell, whose density can be 0: such a point
/// moves towards the centre of its own cell, by 2^-22 at first.
#[inline(always)]
fn direction_in_cell(frame: &Frame, cell: Cell, s: [f32; 2]) -> (Vec3, [f32; 2]) {
    let mut s = s;
    let mut step = 1.0 / 4_194_304.0;
    loop {
        let world = frame.to_world(sphere::direction(s));
        let back = to_square(frame, world.to_array()).unwrap_or(s);
        if cell.contains(back) || step > 1.0 {
            return (world, back);
        }
        let centre = cell.centre();
        s = [towards(s[0], centre[0], step), towards(s[1], centre[1], step)];
        step *= 2.0;
    }
}

/// `from`, moved towards `to` by at most `step`.
fn towards(from: f32, to: f32, step: f32) -> f32 {
    from + min(max(to - from, -step), step)
}

/// The point of the square for a world direction of unit length.
#[inline(always)]
fn to_square(frame: &Frame, wi: [f32; 3]) -> Option<[f32; 2]> {
    let world = unit(wi)?;
    Some(sphere::square(frame.to_map(world)))
}

/// A density on the square as a pdf per solid angle: 0 stays 0, and nothing else underflows to 0.
#[inline(always)]
fn per_solid_angle(density: f32) -> f32 {
    if density > 0.0 { max(density / SPHERE, f32::MIN_POSITIVE) } else { 0.0 }
}

/// The pdf per solid angle of a world direction.
///
/// # Errors
/// [`Status::InvalidTransform`] if `wi` is not of unit length.
#[inline]
pub fn pdf<D: Density>(density: &D, frame: &Frame, wi: [f32; 3]) -> Result<f32> {
    let s = to_square(frame, wi).ok_or(Status::InvalidTransform)?;
    Ok(if density.is_positive() { per_solid_angle(density_at(density, s)) } else { 0.0 })
}

/// The `u` that leads to a world direction.
///
/// # Errors
/// [`Status::InvalidTransform`] if `wi` is not of unit length, [`Status::ZeroDensity`] if no u leads there.
pub fn invert<D: Density>(density: &D, frame: &Frame, wi: [f32; 3]) -> Result<[f32; 2]> {
    let s = to_square(frame, wi).ok_or(Status::InvalidTransform)?;
    if !density.is_positive() {
        return Err(Status::ZeroDensity);
    }
    let path = Path::to(s);
    let mut steps = [([0.0f32; 4], 0u32); MAX_REFINED as usize];
    let mut level = 0;
    let corners = density.walk(|masses| {
        let c = path.child(level);
        *steps.get_mut(level as usize)? = (masses, c);
        level += 1;
        (quad_density(masses, c) > 0.0).then_some(c)
    });
    let start = invert_bilinear(corners.ok_or(Status::ZeroDensity)?, path.offset(level));
    let taken = steps.iter().take(level as usize).rev();
    Ok(taken.fold(start, |u, &(masses, c)| undo_quad(masses, c, u)))
}

/// The point of [0, 1)^2 that the bilinear density with these corners puts at `u`: the marginal along axis 1,
/// then the conditional along axis 2.
#[inline(always)]
fn sample_bilinear(corners: [f32; 4], u: [f32; 2]) -> [f32; 2] {
    let [c00, c01, c10, c11] = corners;
    let x = sample_linear(c00 + c01, c10 + c11, u[0]);
    let y = sample_linear(lerp(x, c00, c10), lerp(x, c01, c11), u[1]);
    [x, y]
}

/// The density of [`sample_bilinear`] at a point; its mean over the cell is 1.
#[inline(always)]
fn bilinear_density(corners: [f32; 4], x: [f32; 2]) -> f32 {
    let [c00, c01, c10, c11] = corners;
    let sum = (c00 + c01) + (c10 + c11);
    if sum > 0.0 { 4.0 * lerp(x[1], lerp(x[0], c00, c10), lerp(x[0], c01, c11)) / sum } else { 1.0 }
}

/// The inverse of [`sample_bilinear`].
#[inline(always)]
fn invert_bilinear(corners: [f32; 4], x: [f32; 2]) -> [f32; 2] {
    let [c00, c01, c10, c11] = corners;
    let v = invert_linear(c00 + c01, c10 + c11, x[0]);
    let w = invert_linear(lerp(x[0], c00, c10), lerp(x[0], c01, c11), x[1]);
    [v, w]
}

/// The point that the linear density from `a` to `b` puts at `u`.
#[inline(always)]
fn sample_linear(a: f32, b: f32, u: f32) -> f32 {
    let denominator = a + sqrt(lerp(u, a * a, b * b));
    let x = if denominator > 0.0 { u * (a + b) / denominator } else { u };
    min(x, ONE_MINUS_EPSILON)
}

/// The inverse of [`sample_linear`].
#[inline(always)]
fn invert_linear(a: f32, b: f32, x: f32) -> f32 {
    let u = if a + b > 0.0 { x * (a * (2.0 - x) + b * x) / (a + b) } else { x };
    min(u, ONE_MINUS_EPSILON)
}

/// `a` at `t` = 0, `b` at `t` = 1.
#[inline(always)]
pub fn lerp(t: f32, a: f32, b: f32) -> f32 {
    (1.0 - t) * a + t * b
}
