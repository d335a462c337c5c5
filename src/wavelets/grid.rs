//! Grids of directions: functions of a direction tabulated at the cells of the octahedral square, and read with bilinear
//! weights.
//!
//! Cell `side i + j` has the centre `((i + 1/2) / side, (j + 1/2) / side)`. Beyond an edge of the square it goes on at the
//! other half of the same edge, so that every direction lies between four cells; at the corners of the square, where all
//! four sheets meet, cells may repeat.

use crate::sphere::square;
use glam::Vec3;

/// The most cells along an axis.
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
