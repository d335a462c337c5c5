//! What two common samplers of a lat-long map do on a hard case: their published formulas in 32-bit floats.
//!
//! [`Sums`]: marginal and conditional cumulative sums (Pharr, Jakob and Humphreys, "Physically Based Rendering", third
//! edition, 13.3 and 14.2). [`Warp`]: hierarchical sample warping (Clarberg et al. 2005) over patches that are bilinear
//! between texel centres, as Mitsuba 3 has it. Both weight texels by the sine of their polar angle.

use super::laws::points;
use super::maps::Image;
use crate::piecewise::Constant;
use std::f32::consts::{PI, TAU};

/// What stands in the columns of the peers.
pub struct Answers {
    /// Cumulative sums.
    pub sums: String,
    /// Hierarchical warp.
    pub warp: String,
}

impl Default for Answers {
    fn default() -> Answers {
        Answers { sums: "-".into(), warp: "-".into() }
    }
}

impl Answers {
    /// Runs both on a map.
    pub fn of(image: &Image) -> Answers {
        let weighted = weighted(image);
        let sums = Sums::new(image.width as usize, &weighted);
        let warp = Warp::new(image.width as usize, &weighted);
        Answers {
            sums: judge(&weighted, |u| sums.sample(u), |p| sums.pdf(p), sums.census()),
            warp: judge(&weighted, |u| warp.sample(u), |p| warp.pdf(p), warp.census()),
        }
    }
}

fn weighted(image: &Image) -> Vec<f32> {
    let row = |index: usize| index / image.width as usize;
    let sine = |index: usize| (PI * (row(index) as f32 + 0.5) / image.height as f32).sin();
    image.texels.iter().enumerate().map(|(index, l)| l * sine(index)).collect()
}

/// A point of the unit square and its density there.
type Sampled = ([f32; 2], f32);

/// Lit elements, and which of them no sample finds.
#[derive(Default)]
struct Census {
    lit: usize,
    unreachable: usize,
    blind: usize,
}

impl Census {
    fn count(&mut self, lit: bool, pdf: f32, reached: bool) {
        self.lit += usize::from(lit);
        self.unreachable += usize::from(lit && pdf > 0.0 && !reached);
        self.blind += usize::from(lit && pdf <= 0.0);
    }
}

/// Says what is wrong with the samples of a peer.
fn judge(
    weighted: &[f32],
    sample: impl Fn([f32; 2]) -> Sampled,
    pdf: impl Fn([f32; 2]) -> f32,
    census: Census,
) -> String {
    let u = points().into_iter().filter(|u| u.iter().all(|u| (0.0..1.0).contains(u)));
    let mut faults = Faults::default();
    for u in u {
        let (point, density) = sample(u);
        let again = pdf(through_direction(point));
        faults.samples += 1;
        if !density.is_finite() || point.iter().any(|p| !p.is_finite()) {
            faults.broken += 1;
        } else if density <= 0.0 {
            faults.empty += 1;
        } else if (f64::from(again) / f64::from(density) - 1.0).abs() <= 1e-3 {
            faults.sound += 1;
        }
    }
    faults.describe(&census, weighted.iter().all(|w| *w == 0.0))
}

/// What the samples of a peer are.
#[derive(Default)]
struct Faults {
    samples: usize,
    broken: usize,
    empty: usize,
    sound: usize,
}

impl Faults {
    fn describe(&self, census: &Census, black: bool) -> String {
        let of_samples = |count: usize, what: &str| (count, format!("{what} in {count} of {} samples", self.samples));
        let of_lit = |count: usize, what: &str| (count, format!("{count} of {} {what}", census.lit));
        let off = self.samples - self.broken - self.empty - self.sound;
        let all = [
            of_samples(self.broken, "NaN or Inf"),
            of_samples(if black { 0 } else { self.empty }, "pdf 0"),
            of_samples(off, "off"),
            of_lit(census.unreachable, "unreachable"),
            of_lit(census.blind, "blind"),
        ];
        let faults: Vec<String> = all.into_iter().filter(|(count, _)| *count > 0).map(|(_, text)| text).collect();
        match (faults.is_empty(), black) {
            (true, true) => "pdf 0".into(),
            (true, false) => "sound".into(),
            _ => faults.join("; "),
        }
    }
}

/// A point of the map as the direction in 32-bit floats, and back: what a pdf is asked for.
fn through_direction([u, v]: [f32; 2]) -> [f32; 2] {
    let (phi, theta) = (TAU * u, PI * v);
    let direction = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
    let turn = direction[1].atan2(direction[0]) / TAU;
    [if turn < 0.0 { turn + 1.0 } else { turn }, direction[2].clamp(-1.0, 1.0).acos() / PI]
}

/// Rows by the sums of their integrals, then columns by the sums in the row.
struct Sums {
    rows: Vec<Constant>,
    marginal: Constant,
}

impl Sums {
    fn new(width: usize, weighted: &[f32]) -> Sums {
        let rows: Vec<Constant> = weighted.chunks_exact(width).map(|row| Constant::new(row.into())).collect();
        let marginal = Constant::new(rows.iter().map(|row| row.integral).collect());
        Sums { rows, marginal }
    }

    fn sample(&self, u: [f32; 2]) -> Sampled {
        let (v, row) = self.marginal.sample(u[1]);
        let (u, column) = self.rows[row].sample(u[0]);
        ([u, v], self.rows[row].pdf(column) * self.marginal.pdf(row))
    }

    fn pdf(&self, point: [f32; 2]) -> f32 {
        let cell = |x: f32, count: usize| ((x * count as f32) as usize).min(count - 1);
        let row = &self.rows[cell(point[1], self.rows.len())];
        row.value[cell(point[0], row.value.len())] / self.marginal.integral
    }

    fn census(&self) -> Census {
        let mut census = Census::default();
        for (y, row) in self.rows.iter().enumerate() {
            for (x, value) in row.value.iter().enumerate() {
                let reached = self.marginal.reached(y) && row.reached(x);
                census.count(*value != 0.0, value / self.marginal.integral, reached);
            }
        }
        census
    }
}

/// Sums of two by two patches up to the whole, level 0 the finest.
struct Warp {
    /// Texels in a row, and rows.
    size: [usize; 2],
    vertices: Vec<f32>,
    levels: Vec<Level>,
}

struct Level {
    size: [usize; 2],
    values: Vec<f32>,
}

impl Level {
    /// The value of a patch; 0 beyond the border.
    fn at(&self, x: usize, y: usize) -> f32 {
        if x < self.size[0] && y < self.size[1] { self.values[y * self.size[0] + x] } else { 0.0 }
    }

    fn square(&self, x: usize, y: usize) -> [f32; 4] {
        [self.at(x, y), self.at(x + 1, y), self.at(x, y + 1), self.at(x + 1, y + 1)]
    }
}

impl Warp {
    fn new(width: usize, weighted: &[f32]) -> Warp {
        let size = [width, weighted.len() / width];
        let total: f64 = weighted.iter().map(|w| f64::from(*w)).sum();
        let scale = (weighted.len() as f64 / total) as f32;
        let mut warp = Warp { size, vertices: weighted.iter().map(|w| w * scale).collect(), levels: Vec::new() };
        let patches = [size[0], (size[1] - 1).max(1)];
        let average = |index: usize| 0.25 * warp.corners(index % patches[0], index / patches[0]).iter().sum::<f32>();
        let values = (0..patches[0] * patches[1]).map(average).collect();
        warp.levels.push(Level { size: patches, values });
        while warp.levels[warp.levels.len() - 1].size != [1, 1] {
            let below = &warp.levels[warp.levels.len() - 1];
            let size = below.size.map(|n| n.div_ceil(2));
            let sum = |index: usize| below.square(2 * (index % size[0]), 2 * (index / size[0])).iter().sum();
            let values = (0..size[0] * size[1]).map(sum).collect();
            warp.levels.push(Level { size, values });
        }
        warp
    }

    /// The four texels about a patch; azimuth wraps.
    fn corners(&self, x: usize, y: usize) -> [f32; 4] {
        let texel = |x: usize, y: usize| self.vertices[y.min(self.size[1] - 1) * self.size[0] + x % self.size[0]];
        [texel(x, y), texel(x + 1, y), texel(x, y + 1), texel(x + 1, y + 1)]
    }

    /// The patch and the point inside it that a point is warped to.
    fn descend(&self, mut u: [f32; 2]) -> ([usize; 2], [f32; 2]) {
        let (mut x, mut y) = (0, 0);
        for level in self.levels.iter().rev().skip(1) {
            (x, y) = (2 * x, 2 * y);
            let [v00, v10, v01, v11] = level.square(x, y);
            let (low, high) = (v00 + v10, v01 + v11);
            let row = choose(into_range(u[1]), low, high);
            let column =
                if row.0 { choose(into_range(u[0]), v01, v11) } else { choose(u[0].clamp(0.0, 1.0), v00, v10) };
            (x, y) = (x + usize::from(column.0), y + usize::from(row.0));
            u = [column.1, row.1];
        }
        ([x, y], u)
    }

    fn sample(&self, u: [f32; 2]) -> Sampled {
        let ([x, y], u) = self.descend(u);
        let [v00, v10, v01, v11] = self.corners(x, y);
        let t = linear(u[1], v00 + v10, v01 + v11);
        let s = linear(u[0], (1.0 - t) * v00 + t * v01, (1.0 - t) * v10 + t * v11);
        let size = self.levels[0].size.map(|n| n as f32);
        ([(x as f32 + s) / size[0], (y as f32 + t) / size[1]], bilinear([v00, v10, v01, v11], s, t))
    }

    fn pdf(&self, point: [f32; 2]) -> f32 {
        let size = self.levels[0].size;
        let place = |x: f32, count: usize| {
            let cell = ((x * count as f32) as usize).min(count - 1);
            (cell, x * count as f32 - cell as f32)
        };
        let ((x, s), (y, t)) = (place(point[0], size[0]), place(point[1], size[1]));
        bilinear(self.corners(x, y), s, t)
    }

    fn census(&self) -> Census {
        let mut census = Census::default();
        let size = self.levels[0].size;
        for (x, y) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
            // Blindness shows before the average of a patch is rounded.
            let lit = self.corners(x, y).iter().any(|v| *v != 0.0);
            census.count(lit, self.levels[0].at(x, y), self.reached(x, y));
        }
        census
    }

    /// Whether each choice on the way to a patch leaves it some u: `u * (a + b) > a` for a u below 1, or
    /// `u * (a + b) <= a` for some u.
    fn reached(&self, x: usize, y: usize) -> bool {
        const LAST: f32 = 1.0 - f32::EPSILON / 2.0;
        let open = |upper: bool, a: f32, b: f32| if upper { LAST * (a + b) > a } else { a > 0.0 };
        (0..self.levels.len() - 1).all(|l| {
            let (i, j) = (x >> l, y >> l);
            let [v00, v10, v01, v11] = self.levels[l].square(i & !1, j & !1);
            let (a, b) = if j & 1 == 1 { (v01, v11) } else { (v00, v10) };
            open(j & 1 == 1, v00 + v10, v01 + v11) && open(i & 1 == 1, a, b)
        })
    }
}

/// The side of a split that `u` falls into, and its place inside.
fn choose(u: f32, lower: f32, upper: f32) -> (bool, f32) {
    let scaled = u * (lower + upper);
    if scaled > lower { (true, (scaled - lower) / upper) } else { (false, scaled / lower) }
}

/// The inverse of the integral of a linear function from `a` to `b`.
fn linear(u: f32, a: f32, b: f32) -> f32 {
    let difference = a - b;
    if difference.abs() > 1e-4 * (a + b) { (a - (a * a + (b * b - a * a) * u).max(0.0).sqrt()) / difference } else { u }
}

fn bilinear([v00, v10, v01, v11]: [f32; 4], s: f32, t: f32) -> f32 {
    (1.0 - t) * ((1.0 - s) * v00 + s * v10) + t * ((1.0 - s) * v01 + s * v11)
}

/// A number moved into [0, 1]; NaN to 0, which `clamp` would keep.
#[allow(clippy::manual_clamp)]
fn into_range(u: f32) -> f32 {
    u.max(0.0).min(1.0)
}
