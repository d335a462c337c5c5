//! The first values of the BRDF at a shading point: on a grid of 8 x 8 cells of the square, and at its peaks.

use crate::numeric::{exp2i, exponent, max};
use crate::sphere::Frame;
use crate::status::Result;
use crate::wavelets::lanes::sphere::to_world;
use crate::wavelets::lanes::vector::{V3, dot, splat, to_arrays};
use crate::wavelets::lanes::{LANES, Lanes};
use crate::wavelets::lobe::{Asked, Brdf, MAX_PEAKS, Peak};
use crate::wavelets::wide::ALL;

/// Cells of the base along each axis.
pub const SIDE: usize = 8;
/// Directions of the base: 81 grid points, of which the folded edges leave these.
pub const BASE: usize = 66;
/// The finest base, of [`SIDE`] x [`SIDE`] leaves.
pub const FINEST: u32 = 3;
/// Eight directions each that hold the base and, behind it, the peaks.
const GROUPS: usize = (BASE + MAX_PEAKS).div_ceil(LANES);
/// A row of grid points. Point `j` stands at `1 + j`, so that the eight points before and behind eight can be read.
pub type Row = [f32; 12];

/// The squares of a complete tree.
pub const fn complete(level: u32) -> u32 {
    ((1 << (2 * level)) - 1) / 3
}

/// The least room for squares: the base is written as if it were the finest.
pub const LEAST_SQUARES: u32 = complete(FINEST);

/// The level of the leaves of the base for a budget of squares.
pub fn level_of_base(squares: u32) -> u32 {
    match squares {
        LEAST_SQUARES.. => FINEST,
        5.. => 2,
        _ => 1,
    }
}

/// Values above this multiple of the largest of the base are cut, so that products stay finite; so are their negatives.
const LARGEST: f32 = 1e9;

/// Values within what is stored.
#[inline(always)]
pub fn bounded<F: Lanes>(values: F) -> F {
    values.min(F::splat(LARGEST)).max(F::splat(-LARGEST))
}

/// The grid points of the square and their directions in map space, component by component, eight at a time.
struct Grid {
    directions: [[[f32; LANES]; 3]; GROUPS],
    /// Which direction is the grid point (i, j).
    points: [[u8; SIDE + 1]; SIDE + 1],
}

const GRID: Grid = Grid::new();

impl Grid {
    const fn new() -> Grid {
        let mut grid = Grid { directions: [[[0.0; LANES]; 3]; GROUPS], points: [[0; SIDE + 1]; SIDE + 1] };
        let (mut seen, mut count, mut point) = ([[0.0f32; 3]; BASE], 0, 0);
        while point < (SIDE + 1) * (SIDE + 1) {
            let (i, j) = (point / (SIDE + 1), point % (SIDE + 1));
            let [x, y, z] = grid_direction(i, j);
            let mut k = 0;
            while k < count && !(seen[k][0] == x && seen[k][1] == y && seen[k][2] == z) {
                k += 1;
            }
            if k == count {
                seen[k] = [x, y, z];
                (grid.directions[k / LANES][0][k % LANES], grid.directions[k / LANES][1][k % LANES]) = (x, y);
                grid.directions[k / LANES][2][k % LANES] = z;
                count += 1;
            }
            grid.points[i][j] = k as u8;
            point += 1;
        }
        assert!(count == BASE);
        grid
    }
}

/// As [`crate::sphere::direction`], of the grid point (i, j) of [`SIDE`] x [`SIDE`] cells.
const fn grid_direction(i: usize, j: usize) -> [f32; 3] {
    /// The cosine of m of k parts of a right angle.
    const COSINE: [[f32; 5]; 5] = [
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [1.0, core::f32::consts::FRAC_1_SQRT_2, 0.0, 0.0, 0.0],
        [1.0, 0.866_025_4, 0.5, 0.0, 0.0],
        [1.0, 0.923_879_5, core::f32::consts::FRAC_1_SQRT_2, 0.382_683_43, 0.0],
    ];
    let (x, y) = (if i < SIDE - i { i } else { SIDE - i }, if j < SIDE - j { j } else { SIDE - j });
    let south = x + y < SIDE / 2;
    let (a, b) = if south { (y, x) } else { (SIDE / 2 - x, SIDE / 2 - y) };
    let k = a + b;
    let (horizontal, height) = (HORIZONTAL[k], 1.0 - (k * k) as f32 / 16.0);
    let (sx, sy) = (if i < SIDE / 2 { -1.0 } else { 1.0 }, if j < SIDE / 2 { -1.0 } else { 1.0 });
    [sx * horizontal * COSINE[k][b], sy * horizontal * COSINE[k][a], if south { -height } else { height }]
}

/// The directions of the centres of the cells of a row in map space, component by component.
pub const CENTRES: [[[f32; SIDE]; 3]; SIDE] = {
    let (mut centres, mut cell) = ([[[0.0; SIDE]; 3]; SIDE], 0);
    while cell < SIDE * SIDE {
        let (i, j) = (cell / SIDE, cell % SIDE);
        let [x, y, z] = centre_direction(i, j);
        (centres[i][0][j], centres[i][1][j], centres[i][2][j]) = (x, y, z);
        cell += 1;
    }
    centres
};

/// The horizontal part of a direction whose distance from the pole is k quarters.
const HORIZONTAL: [f32; 5] = [0.0, 0.347_985_26, 0.661_437_8, 0.899_218_4, 1.0];

/// As [`crate::sphere::direction`], of the centre of cell (i, j).
const fn centre_direction(i: usize, j: usize) -> [f32; 3] {
    /// The cosine of `2 m + 1` of `2 k` parts of a right angle.
    const COSINE: [[f32; 4]; 5] = [
        [1.0, 0.0, 0.0, 0.0],
        [core::f32::consts::FRAC_1_SQRT_2, 0.0, 0.0, 0.0],
        [0.923_879_5, 0.382_683_43, 0.0, 0.0],
        [0.965_925_8, core::f32::consts::FRAC_1_SQRT_2, 0.258_819_04, 0.0],
        [0.980_785_25, 0.831_469_6, 0.555_570_24, 0.195_090_32],
    ];
    let (last, i2, j2) = (2 * SIDE - 1, 2 * i + 1, 2 * j + 1);
    let (x, y) = (if i2 < SIDE { i2 } else { last + 1 - i2 }, if j2 < SIDE { j2 } else { last + 1 - j2 });
    let south = x + y < SIDE;
    let (a, b) = if south { (y, x) } else { (SIDE - x, SIDE - y) };
    let k = (a + b) / 2;
    let (horizontal, height) = (HORIZONTAL[k], 1.0 - (k * k) as f32 / 16.0);
    let (sx, sy) = (if i2 < SIDE { -1.0 } else { 1.0 }, if j2 < SIDE { -1.0 } else { 1.0 });
    let (cosine, sine) = (COSINE[k][b / 2], COSINE[k][a / 2]);
    [sx * horizontal * cosine, sy * horizontal * sine, if south { -height } else { height }]
}

/// The first values of the BRDF, and what follows from them.
pub struct Base {
    values: [f32; GROUPS * LANES],
    /// The mean of the values above the horizon.
    pub mean: f32,
    /// All values are the BRDF's own times 2^-exponent, and ordinary numbers.
    pub exponent: i32,
    pub evaluations: u32,
}

impl Base {
    /// Evaluates the base directions and the peaks.
    #[inline(always)]
    pub fn evaluate<F: Lanes, B: Brdf>(frame: &Frame, brdf: &mut B, peaks: &[Option<Peak>; MAX_PEAKS]) -> Result<Base> {
        let (zero, hemisphere) = (F::splat(0.0), brdf.hemisphere());
        let mut wi = [Asked { wi: splat([0.0, 0.0, 1.0]), lanes: ALL }; GROUPS];
        for (asked, [x, y, z]) in wi.iter_mut().zip(&GRID.directions) {
            asked.wi = to_world(frame, [F::from_array(*x), F::from_array(*y), F::from_array(*z)]);
        }
        let mut count = BASE;
        if let Some(last) = wi.last_mut() {
            let [mut x, mut y, mut z] = to_arrays(last.wi);
            for peak in peaks.iter().flatten() {
                let lane = count % LANES;
                [x[lane], y[lane], z[lane]] = peak.direction.to_array();
                count += 1;
            }
            last.wi = [F::from_array(x), F::from_array(y), F::from_array(z)];
            last.lanes = (1 << (count - (GROUPS - 1) * LANES)) - 1;
        }
        let mut f_cos = [zero; GROUPS];
        brdf.eval(&wi, &mut f_cos)?;
        let (mut largest, mut sum, mut lit) = (zero, zero, 0);
        for (f_cos, asked) in f_cos.iter_mut().zip(&wi) {
            *f_cos = F::only(F::mask(asked.lanes), *f_cos);
            largest = largest.max(*f_cos);
        }
        let largest = largest.to_array().into_iter().fold(0.0, max);
        // Within what an f32 holds as a factor, also for the values of denormal BRDFs and if all are 0.
        let exponent = if largest > 0.0 { exponent(f64::from(largest)).clamp(-126, 126) } else { -126 };
        let scale = F::splat(exp2i(-exponent) as f32);
        let mut values = [0.0; GROUPS * LANES];
        for (group, ((eight, f_cos), asked)) in values.chunks_exact_mut(LANES).zip(f_cos).zip(&wi).enumerate() {
            let f_cos = bounded(f_cos * scale);
            eight.copy_from_slice(&f_cos.to_array());
            let base = F::mask(if group + 1 < GROUPS { ALL } else { (1 << (BASE % LANES)) - 1 });
            let above = hemisphere.map_or(base, |n| F::and(base, zero.lt(height::<F>(n, asked.wi))));
            sum = sum + F::only(above, f_cos);
            lit += F::bits(above).count_ones();
        }
        let sum = sum.to_array().into_iter().fold(0.0f64, |sum, value| sum + f64::from(value));
        Ok(Base { values, mean: (sum / f64::from(lit.max(1))) as f32, exponent, evaluations: count as u32 })
    }

    /// The values at the grid points of 2^level cells along each axis.
    #[inline(always)]
    pub fn grid(&self, level: u32) -> [Row; SIDE + 1] {
        let mut rows = [[0.0; 12]; SIDE + 1];
        let value = |point: u8| self.values.get(usize::from(point)).copied().unwrap_or(0.0);
        let step = SIDE >> level.min(3);
        if step == 1 {
            for (row, points) in rows.iter_mut().zip(&GRID.points) {
                for (value_here, point) in row.iter_mut().skip(1).zip(points) {
                    *value_here = value(*point);
                }
            }
            return rows;
        }
        for (row, points) in rows.iter_mut().zip(GRID.points.iter().step_by(step)) {
            for (value_here, point) in row.iter_mut().skip(1).zip(points.iter().step_by(step)) {
                *value_here = value(*point);
            }
        }
        rows
    }

    /// The values at the peaks.
    pub fn peaks(&self) -> impl Iterator<Item = f32> {
        self.values.into_iter().skip(BASE)
    }
}

/// The cosines of directions and a normal.
#[inline(always)]
fn height<F: Lanes>(normal: glam::Vec3, wi: V3<F>) -> F {
    dot(splat(normal.to_array()), wi)
}
