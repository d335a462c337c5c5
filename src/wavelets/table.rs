//! Isotropic BRDFs as tables: trees of BRDF x cosine about the mirror direction, one for each elevation of the view.
//!
//! Clarberg et al. 2005, Section 5: two dimensions of wo times two of wi, reparameterised about the mirror direction, in
//! which a lobe stays where it is while the view sinks. Of n x n directions of the view only n differ if the BRDF is
//! isotropic: slices are numbered by the angle of wo and the normal, `(k + 1/2) / n` of a right angle, and any other
//! view blends the two slices beside it.
//!
//! A slice lives on the octahedral square with the mirror direction in its centre; axis 1 of the square runs along what
//! lies in the plane of incidence.
//!
//! Functions of a direction are tabulated in grids at the cells of the octahedral square, and read with bilinear weights. Cell
//! `side i + j` has the centre `((i + 1/2) / side, (j + 1/2) / side)`. Beyond an edge of the square it goes on at the
//! other half of the same edge, so that every direction lies between four cells; at the corners of the square, where all
//! four sheets meet, cells may repeat.

use crate::numeric::{max, min, sqrt};
use crate::sphere::square;
use core::f32::consts::FRAC_PI_2;
use glam::Vec3;

/// The most slices of a table.
pub const WIS_MAX_SLICES: u32 = 256;

/// How a table is read for a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The slices beside it.
    pub slices: [u32; 2],
    /// Their weights, which add up to 1.
    pub weights: [f64; 2],
    /// The axes of the slices' frame: the third is the mirror direction.
    pub axes: [Vec3; 3],
}

impl View {
    /// The view from `wo` of a surface with this normal, both of unit length. One from below counts as one along the surface.
    pub fn new(normal: Vec3, wo: Vec3, count: u32) -> View {
        let last = count.max(1) - 1;
        let cosine = max(min(normal.dot(wo), 1.0), 0.0);
        let angle = libm::acosf(cosine);
        let place = min(max(angle / FRAC_PI_2 * count as f32 - 0.5, 0.0), last as f32);
        let low = (place as u32).min(last);
        let share = f64::from(min(place - low as f32, 1.0));
        let (sine, tangent) = (sqrt(1.0 - cosine * cosine), tangent(normal, wo));
        View {
            slices: [low, (low + 1).min(last)],
            weights: [1.0 - share, share],
            axes: [tangent * cosine + normal * sine, normal.cross(tangent), normal * cosine - tangent * sine],
        }
    }
}

/// Views so close to the normal are from straight above: what rounding leaves there may be the normal itself.
const STEEP: f32 = 1e-5;

/// The direction along the surface below a view; any, for one from straight above.
fn tangent(normal: Vec3, wo: Vec3) -> Vec3 {
    let along = wo - normal * normal.dot(wo);
    let length = sqrt(along.dot(along));
    if length > STEEP {
        let once = along / length;
        // What rounding left of the normal, if the view is steep.
        let across = normal.cross(once);
        return across.cross(normal) / sqrt(across.dot(across));
    }
    let [x, y, _] = normal.to_array();
    let least = match [x, y].map(|x| x.abs() < 0.5) {
        [true, _] => Vec3::X,
        [_, true] => Vec3::Y,
        _ => Vec3::Z,
    };
    let across = normal.cross(least);
    across / sqrt(across.dot(across))
}

/// The most cells of a grid along an axis.
pub const WIS_MAX_GRID: u32 = 4096;

/// The four cells about a direction of unit length, and their weights, which add up to 1.
pub fn about(side: u32, wi: Vec3) -> ([u32; 4], [f32; 4]) {
    let [x, y] = square(wi).map(|s| s * side as f32 - 0.5);
    let below = |x: f32| if x < 0.0 { -1 } else { x as i32 };
    let (i, j) = (below(x), below(y));
    let (s, t) = (x - i as f32, y - j as f32);
    let cells = [[i, j], [i, j + 1], [i + 1, j], [i + 1, j + 1]].map(|[i, j]| folded(side as i32, i, j));
    (cells, [(1.0 - s) * (1.0 - t), (1.0 - s) * t, s * (1.0 - t), s * t])
}

/// The number of a cell at most one beyond the edges.
fn folded(side: i32, i: i32, j: i32) -> u32 {
    let inside = |k: i32| (0..side).contains(&k);
    let last = side - 1;
    let clamp = |k: i32| k.max(0).min(last);
    let (i, j) = match (inside(i), inside(j)) {
        (true, true) => (i, j),
        (false, true) => (clamp(i), last - j),
        (true, false) => (last - i, clamp(j)),
        (false, false) => (last - clamp(i), last - clamp(j)),
    };
    (i * side + j) as u32
}
