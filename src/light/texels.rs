//! The luminance of a map as the renderer looks it up: texels beyond the border of a face, values at the corners of patches,
//! and the exact integrals over patches.

use super::chart::Layout;
use super::plan::{Filter, Plan};
use super::radiance::encode;
use super::tables::BLOCK;
use core::f64::consts::PI;

/// The texels of all faces, and what is done to a luminance before it becomes light.
#[derive(Clone, Copy)]
pub struct Texels<'a> {
    /// Sizes.
    pub plan: &'a Plan,
    /// Luminance, row by row, face by face.
    pub luminance: &'a [f32],
    /// [`row_weights`] of each row of patches.
    pub rows: &'a [[f64; 2]],
    /// What no luminance lies below.
    pub least: f32,
    /// The mean that compensation subtracts.
    pub mean: f32,
}

/// How many texels away a lit one lifts black.
const NEAR: i64 = 2;

/// Corners of a block.
pub type Corners = [f32; (BLOCK + 1) * (BLOCK + 1)];
/// A number for each patch of a block.
pub type PatchValues = [f64; BLOCK * BLOCK];

/// A rectangle of patches of a face, in strides.
#[derive(Clone, Copy, Debug)]
pub struct Tile {
    /// The face.
    pub face: u32,
    /// The first patch.
    pub origin: [u32; 2],
    /// Cells of the grid, at most [`BLOCK`] along each axis.
    pub grid: [u32; 2],
    /// Patches behind which the tile ends.
    pub end: [u32; 2],
    /// A cell of the grid is 2^step patches wide.
    pub step: [u32; 2],
}

impl Tile {
    /// A rectangle between two patches.
    pub fn new(face: u32, [origin, end]: [[u32; 2]; 2], step: [u32; 2]) -> Tile {
        Tile { face, origin, end, step, grid: [0, 1].map(|k: usize| (end[k] - origin[k]).div_ceil(1 << step[k])) }
    }

    /// The edge before cell `i` along an axis.
    pub fn edge(&self, axis: usize, i: u32) -> u32 {
        (self.origin[axis] + (i << self.step[axis])).min(self.end[axis])
    }

    /// The cells of its grid, row by row, as tiles of single patches.
    pub fn cells(self) -> impl Iterator<Item = Tile> {
        let [columns, rows] = self.grid;
        let at = (0..rows).flat_map(move |j| (0..columns).map(move |i| [i, j]));
        at.map(move |[i, j]| {
            let origin = [self.edge(0, i), self.edge(1, j)];
            Tile::new(self.face, [origin, [self.edge(0, i + 1), self.edge(1, j + 1)]], [0; 2])
        })
    }

    /// Tiles of at most 16 x 16 single patches that cover it.
    pub fn parts(&self) -> impl Iterator<Item = Tile> {
        Tile::new(self.face, [self.origin, self.end], [BLOCK.ilog2(); 2]).cells()
    }
}

impl Texels<'_> {
    /// A luminance as light.
    #[inline(always)]
    fn light(&self, luminance: f32) -> f32 {
        let l = if luminance < self.least { self.least } else { luminance };
        if self.plan.of.compensated { (l - self.mean).max(l * (1.0 / 64.0)) } else { l }
    }

    /// A texel inside a face.
    #[inline(always)]
    fn inner(&self, face: u32, x: u32, y: u32) -> f32 {
        let [width, height] = self.plan.texels;
        let row = (face * height + y) as usize;
        self.light(self.luminance.get(row * width as usize + x as usize).copied().unwrap_or(0.0))
    }

    /// A texel at most one beyond the border of a face: lat-long maps wrap and mirror over the poles, octahedral edges fold, faces
    /// of a cube join.
    fn texel(&self, face: u32, x: i64, y: i64) -> f32 {
        let [width, height] = self.plan.texels.map(i64::from);
        if (0..width).contains(&x) && (0..height).contains(&y) {
            return self.inner(face, x as u32, y as u32);
        }
        let clamped = [x.max(0).min(width - 1), y.max(0).min(height - 1)];
        match self.plan.of.layout {
            Layout::LatLong => {
                let x = x.rem_euclid(width.max(1));
                if (0..height).contains(&y) {
                    return self.inner(face, x as u32, y as u32);
                }
                // Over the pole: half a turn on, between two texels if their number is odd.
                let row = clamped[1] as u32;
                let over = |x: i64| self.inner(face, x.rem_euclid(width.max(1)) as u32, row);
                0.5 * over(x + width / 2) + 0.5 * over(x + (width + 1) / 2)
            }
            Layout::Octahedral => {
                let folded_x = if y == clamped[1] { x } else { width - 1 - x };
                let folded_y = if x == clamped[0] { y } else { height - 1 - y };
                self.inner(face, folded_x.max(0).min(width - 1) as u32, folded_y.max(0).min(height - 1) as u32)
            }
            Layout::Cube => self.across(face, [x, y], clamped),
        }
    }

    /// A texel of a cube map beyond an edge of its face; beyond a corner, where three faces meet, their mean.
    fn across(&self, face: u32, at: [i64; 2], clamped: [i64; 2]) -> f32 {
        if at[0] != clamped[0] && at[1] != clamped[1] {
            let own = self.inner(face, clamped[0] as u32, clamped[1] as u32);
            let beside = [[at[0], clamped[1]], [clamped[0], at[1]]].map(|at| f64::from(self.across(face, at, clamped)));
            return ((f64::from(own) + beside[0] + beside[1]) * (1.0 / 3.0)) as f32;
        }
        let side = f64::from(self.plan.texels[0]);
        // The neighbour's texel whose centre lies where the ray through this one, folded onto the neighbour's plane, meets it.
        let plane = at.map(|x| (2.0 * x as f64 + 1.0) / side - 1.0);
        let beyond = |x: f64| if x.abs() > 1.0 { x.abs() - 1.0 } else { 0.0 };
        let depth = 1.0 - beyond(plane[0]) - beyond(plane[1]);
        let [s, t] = plane.map(|x| x.clamp(-1.0, 1.0));
        let mut direction = crate::sphere::cube_direction(face, s, t);
        if let Some(major) = direction.get_mut(face as usize / 2) {
            *major *= depth;
        }
        let (neighbour, uv) = crate::sphere::cube(direction);
        let texel = |u: f64| ((u * side) as i64).max(0).min(side as i64 - 1) as u32;
        self.inner(neighbour, texel(uv[0]), texel(uv[1]))
    }

    /// The texel before an edge between patches, and how far the edge lies towards the next.
    fn texel_at(&self, axis: usize, edge: u32) -> (i64, f32) {
        self.texel_before(axis, self.plan.chart.axes[axis].edge_f64(edge))
    }

    /// The texel before a position, and how far the position lies towards the next.
    fn texel_before(&self, axis: usize, position: f64) -> (i64, f32) {
        let latlong = self.plan.of.layout == Layout::LatLong;
        let poles = latlong && axis == 1 && self.plan.of.rows_at_poles && self.plan.texels[1] > 1;
        // Columns of a lat-long map begin at the first texel centre, rows at the poles at the first row.
        let half = if (latlong && axis == 0) || poles { 0.0 } else { 0.5 };
        let texel = position / f64::from(self.plan.refined) - half;
        let before = libm::floor(texel);
        (before as i64, (texel - before) as f32)
    }

    /// The light at a corner of the texel map: beyond a border where half a patch lies there, at a texel's centre. For a nearest client
    /// that of the patches which a coarse corner stands for.
    pub fn node(&self, face: u32, corner: [u32; 2], step: u8) -> f32 {
        let axes = &self.plan.chart.axes;
        let at = [0, 1].map(|k: usize| corner[k].min(axes[k].patches));
        if self.plan.of.filter == Filter::Nearest {
            return self.mean_of_patches(face, at, step);
        }
        let place = [0, 1].map(|k: usize| self.texel_before(k, f64::from(at[k]) - f64::from(axes[k].shift)));
        let light = self.between(face, place);
        if self.black_is_dark() && !(light > 0.0) {
            self.spread_from(face, place.map(|(texel, _)| texel))
        } else {
            light
        }
    }

    /// The light between texels: along each axis the texel before, and how far it is towards the next.
    fn between(&self, face: u32, [(x, right), (y, below)]: [(i64, f32); 2]) -> f32 {
        let row = |y: i64| {
            let here = self.texel(face, x, y);
            if right == 0.0 { here } else { here + (self.texel(face, x + 1, y) - here) * right }
        };
        let here = row(y);
        if below == 0.0 { here } else { here + (row(y + 1) - here) * below }
    }

    /// The mean light of the patches of a coarse grid's cell.
    fn mean_of_patches(&self, face: u32, at: [u32; 2], step: u8) -> f32 {
        let patches = self.plan.chart.axes.map(|axis| axis.patches);
        let first = [0, 1].map(|k: usize| at[k].min((patches[k] - 1) >> step << step));
        let end = [0, 1].map(|k: usize| (first[k] + (1 << step)).min(patches[k]));
        let (mut sum, mut count) = (0.0f64, 0.0f64);
        for y in first[1]..end[1] {
            for x in first[0]..end[0] {
                sum += f64::from(self.patch(face, x, y));
                count += 1.0;
            }
        }
        (sum / count) as f32
    }

    /// Writes words of the texel map from a corner on, if these are a row of texels as they stand. Answers whether they were.
    pub fn corner_row(&self, face: u32, corner: [u32; 2], words: &mut [u16]) -> bool {
        let Plan { refined, texels, chart, of, .. } = self.plan;
        let before = |k: usize| self.texel_before(k, f64::from(corner[k]) - f64::from(chart.axes[k].shift));
        let [(x, right), (y, below)] = [before(0), before(1)];
        let plain = right == 0.0 && below == 0.0 && (0..i64::from(texels[1])).contains(&y) && *refined == 1;
        if !plain || of.filter == Filter::Nearest {
            return false;
        }
        let dark = self.black_is_dark();
        let last = x + words.len() as i64 - 1;
        if dark && self.brightest_inside(face, [x, y], [last, y]) == Some(0.0) {
            words.fill(0);
            return true;
        }
        let width = i64::from(texels[0]);
        let row = (i64::from(face * texels[1]) + y) * width;
        let source = self.luminance.get(row as usize..(row + width) as usize).unwrap_or(&[]);
        let before = x.min(0).unsigned_abs() as usize;
        let inside = source.get(x.max(0) as usize..).unwrap_or(&[]);
        for (word, &luminance) in words.get_mut(before..).unwrap_or_default().iter_mut().zip(inside) {
            *word = encode(self.light(luminance));
        }
        for (i, word) in (x..).zip(words.iter_mut()) {
            if !(0..width).contains(&i) {
                *word = encode(self.texel(face, i, y));
            }
            if dark && *word == 0 {
                *word = encode(self.spread_from(face, [i, y]));
            }
        }
        true
    }

    /// The values at the corners of a tile's grid, row by row, [`BLOCK`] + 1 in each.
    pub fn corners(&self, tile: &Tile, corners: &mut Corners) {
        self.marked_corners(tile, corners);
        for corner in corners.iter_mut() {
            *corner = corner.abs();
        }
    }

    /// As [`Texels::corners`], with lifted ones below 0.
    fn marked_corners(&self, tile: &Tile, corners: &mut Corners) {
        let columns = |i: u32| self.texel_at(0, tile.edge(0, i));
        let ((first, part), step) = (columns(0), tile.step[0]);
        let last = first + i64::from(tile.edge(0, tile.grid[0]) - tile.edge(0, 0));
        let width = i64::from(self.plan.texels[0]);
        for (j, row) in (0..=tile.grid[1]).zip(corners.chunks_exact_mut(BLOCK + 1)) {
            let (y, below) = self.texel_at(1, tile.edge(1, j));
            let plain = below == 0.0 && (0..i64::from(self.plan.texels[1])).contains(&y);
            // In the middle of a map that is not refined corners are texels.
            let direct = plain && part == 0.0 && self.plan.refined == 1 && step == 0 && first >= 0 && last < width;
            if direct {
                let start = (i64::from(tile.face * self.plan.texels[1]) + y) * width + first;
                let source = self.luminance.get(start as usize..).unwrap_or(&[]);
                for (out, &luminance) in row.iter_mut().take(tile.grid[0] as usize + 1).zip(source) {
                    *out = self.light(luminance);
                }
                continue;
            }
            for (i, out) in (0..=tile.grid[0]).zip(row.iter_mut()) {
                *out = self.between(tile.face, [columns(i), (y, below)]);
            }
        }
        if self.black_is_dark() {
            self.spread(tile, corners);
        }
    }

    /// Lifts black corners next to light, so that a direction which the renderer's rounding still finds lit has a density.
    fn spread(&self, tile: &Tile, corners: &mut Corners) {
        let at = |i: [u32; 2]| [0, 1].map(|k: usize| self.texel_at(k, tile.edge(k, i[k])).0);
        if self.brightest_inside(tile.face, at([0; 2]), at(tile.grid)) == Some(0.0) {
            return;
        }
        for (j, row) in (0..=tile.grid[1]).zip(corners.chunks_exact_mut(BLOCK + 1)) {
            for (i, corner) in (0..=tile.grid[0]).zip(row.iter_mut()).filter(|(_, corner)| !(**corner > 0.0)) {
                let [(x, _), (y, _)] = [self.texel_at(0, tile.edge(0, i)), self.texel_at(1, tile.edge(1, j))];
                *corner = -self.spread_from(tile.face, [x, y]);
            }
        }
    }

    /// Whether a texel can have no light at all.
    fn black_is_dark(&self) -> bool {
        !(self.light(0.0) > 0.0)
    }

    /// What black keeps of the brightest texel beside it: little enough that samples are not wasted on it.
    fn spread_from(&self, face: u32, [x, y]: [i64; 2]) -> f32 {
        const SHARE: f32 = 1.0 / (1 << 20) as f32;
        const LEAST: f32 = f32::from_bits(1);
        let brightest = self.brightest_inside(face, [x, y], [x, y]).unwrap_or_else(|| {
            let near = (-NEAR..=NEAR).flat_map(|dy| (-NEAR..=NEAR).map(move |dx| [x + dx, y + dy]));
            near.fold(0.0, |brightest: f32, [x, y]| brightest.max(self.texel_near(face, x, y)))
        });
        if brightest > 0.0 { (SHARE * brightest).max(LEAST) } else { 0.0 }
    }

    /// The brightest texel beside those from a first one to a last one, if all of them lie inside a face: by rows, as most do.
    #[inline(always)]
    fn brightest_inside(&self, face: u32, first: [i64; 2], last: [i64; 2]) -> Option<f32> {
        let sides = self.plan.texels.map(i64::from);
        if !(0..2).all(|k: usize| first[k] >= NEAR && last[k] + NEAR < sides[k]) {
            return None;
        }
        let start = (i64::from(face) * sides[1] + first[1] - NEAR) * sides[0] + first[0] - NEAR;
        let [columns, rows] = [0, 1].map(|k: usize| (last[k] - first[k] + 2 * NEAR + 1) as usize);
        let rows = self.luminance.get(start as usize..)?.chunks((sides[0] as usize).max(1)).take(rows);
        let brightest = rows.fold(0.0, |brightest, row| {
            row.iter().take(columns).fold(brightest, |brightest, &x| crate::numeric::max(x, brightest))
        });
        // More luminance is never less light.
        Some(self.light(brightest))
    }

    /// As [`Texels::texel`], for places up to two beyond the border.
    fn texel_near(&self, face: u32, x: i64, y: i64) -> f32 {
        let [width, height] = self.plan.texels.map(i64::from);
        let x = if self.plan.of.layout == Layout::LatLong { x } else { x.max(-1).min(width) };
        self.texel(face, x, y.max(-1).min(height))
    }

    /// Hands out each patch of a tile of single patches: its place in the tile, the weights of its corners, their light (for a nearest
    /// client that of the patch), and its light.
    #[inline(always)]
    pub fn each_patch(&self, tile: &Tile, mut each: impl FnMut([u32; 2], [f64; 4], [f64; 4], f64)) {
        let mut corners: Corners = [0.0; (BLOCK + 1) * (BLOCK + 1)];
        let bilinear = self.plan.of.filter == Filter::Bilinear;
        if bilinear {
            self.marked_corners(tile, &mut corners);
        }
        let rows = corners.windows(2 * BLOCK + 2).step_by(BLOCK + 1);
        for (j, pair) in (0..tile.grid[1]).zip(rows) {
            let (above, below) = pair.split_at(BLOCK + 1);
            let y = tile.origin[1] + j;
            let weights = self.rows.get(y as usize).copied().unwrap_or_default();
            let corner_pairs = above.windows(2).zip(below.windows(2));
            for (i, corner) in (0..tile.grid[0]).zip(corner_pairs) {
                let (&[c00, c01], &[c10, c11]) = corner else { continue };
                let x = tile.origin[0] + i;
                let weights = match self.plan.of.layout {
                    Layout::Cube => self.cube_weights(x, y),
                    _ => self.column_weights(x, weights),
                };
                let [w00, w01, w10, w11] = weights;
                if !bilinear {
                    let patch = f64::from(self.patch(tile.face, x, y));
                    each([i, j], weights, [patch; 4], ((w00 + w01) + (w10 + w11)) * patch);
                    continue;
                }
                let lit = [c00, c01, c10, c11].map(|c| f64::from(c.abs()));
                let light = if c00.max(c01).max(c10.max(c11)) <= 0.0 {
                    // Black, whatever its corners are lifted to.
                    0.0
                } else {
                    (w00 * lit[0] + w01 * lit[1]) + (w10 * lit[2] + w11 * lit[3])
                };
                each([i, j], weights, lit, light);
            }
        }
    }

    /// The light of a patch for a nearest client.
    fn patch(&self, face: u32, x: u32, y: u32) -> f32 {
        let Plan { of, refined, texels, .. } = self.plan;
        let last = [texels[0] - 1, texels[1] - 1];
        let at_poles = of.rows_at_poles && last[1] > 0;
        let row = match (at_poles, *refined) {
            (false, refined) => y / refined.max(1),
            (true, 1) => y,
            // The texel whose centre is nearest to the patch's.
            (true, refined) => (2 * y + 1 + refined) / (2 * refined).max(1),
        };
        let [x, y] = [(x / (*refined).max(1)).min(last[0]), row.min(last[1])];
        self.inner(face, x, y)
    }

    /// The weights of a patch's four corners from those of its row.
    #[inline(always)]
    fn column_weights(&self, x: u32, [upper, lower]: [f64; 2]) -> [f64; 4] {
        let a = self.plan.chart.axes[0];
        let half = if self.plan.of.layout == Layout::LatLong {
            PI / f64::from(a.length)
        } else {
            let area = 4.0 * PI / (f64::from(a.length) * f64::from(a.length));
            0.5 * area * (a.edge_f64(x + 1) - a.edge_f64(x))
        };
        [half * upper, half * upper, half * lower, half * lower]
    }

    /// The weights of the four corners of a patch of a cube face, by two Gauss points along each axis.
    fn cube_weights(&self, x: u32, y: u32) -> [f64; 4] {
        const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];
        let edges = |axis: usize, k: u32| {
            let a = self.plan.chart.axes[axis];
            let plane = |k: u32| 2.0 * a.edge_f64(k) / f64::from(a.length) - 1.0;
            (plane(k), plane(k + 1))
        };
        let ((s0, s1), (t0, t1)) = (edges(0, x), edges(1, y));
        let mut weights = [0.0; 4];
        for v in GAUSS {
            for u in GAUSS {
                let (s, t) = (s0 + (s1 - s0) * u, t0 + (t1 - t0) * v);
                let squared = 1.0 + s * s + t * t;
                let w = 0.25 * (s1 - s0) * (t1 - t0) / (squared * libm::sqrt(squared));
                for (out, part) in weights.iter_mut().zip([(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v])
                {
                    *out += w * part;
                }
            }
        }
        weights
    }
}

/// The weights of a patch row's upper and lower corners for a unit of columns (not for cubes).
pub fn row_weights(plan: &Plan, y: u32) -> [f64; 2] {
    let a = plan.chart.axes[1];
    let (top, bottom) = (a.edge_f64(y), a.edge_f64(y + 1));
    if plan.of.layout != Layout::LatLong {
        return [0.5 * (bottom - top); 2];
    }
    let angle = PI / f64::from(a.length);
    let (upper, lower) = (top * angle, bottom * angle);
    let mean = (libm::sin(lower) - libm::sin(upper)) / (lower - upper);
    [libm::cos(upper) - mean, mean - libm::cos(lower)]
}
