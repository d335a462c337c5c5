//! Candidates for rays, eight at a time: from the light and from the lobes, each with the library's own estimate of what it would bring.

use super::joint::{Set, Turn};
use crate::brdf::point::Target;
use crate::brdf::surface::Surface;
use crate::light::candidates::{Looked, Reads, TOGETHER};
use crate::light::density::to_world;
use crate::light::tables::Light;
use crate::simd::{LANES, Lanes, Num};
use crate::sphere::{Frame, wide};
use crate::visibility::{CELLS, Factors, cell};

/// The share of the mean weight that every candidate has at least, so that a client whose BRDF or radiance is another than the
/// library's meets no huge weight.
pub const FLOOR: f32 = 0.05;

/// Candidates of a hit, component by component.
#[derive(Debug)]
pub struct Candidates<'a> {
    /// Directions in map space.
    pub x: &'a mut [f32],
    /// Directions in map space.
    pub y: &'a mut [f32],
    /// Directions in map space.
    pub z: &'a mut [f32],
    /// Densities with counts: the sum over both sources of number times density; infinite where a direction does not count.
    pub density: &'a mut [f32],
    /// Target over density.
    pub weight: &'a mut [f32],
}

/// What candidates are drawn for.
pub struct Draw<'a> {
    /// The light.
    pub light: &'a Light<'a>,
    /// The point, in map space.
    pub surface: &'a Surface,
    /// Its random numbers.
    pub turn: Turn,
    /// From map space to the world.
    pub frame: &'a Frame,
    /// How many candidates come from each source.
    pub counts: Counts,
    /// Whether the client's own target follows: the lobes' values do not count.
    pub without_lobes: bool,
    /// What was seen from there, by cell of the world's directions.
    pub seen: Option<&'a Factors>,
}

/// Eight directions of map space.
struct Drawn<F: Lanes> {
    direction: [F; 3],
    /// The radiance there, and how many candidates the light has there.
    light: Looked<F>,
    /// Their densities in the light, if they were drawn from it.
    own: Option<F>,
}

/// The bits of two numbers of at most 16 bits by turns, those of the first one lower.
#[inline(always)]
fn morton(low: u32, high: u32) -> u32 {
    let spread = |x: u32| {
        let x = (x | x << 8) & 0x00ff_00ff;
        let x = (x | x << 4) & 0x0f0f_0f0f;
        let x = (x | x << 2) & 0x3333_3333;
        (x | x << 1) & 0x5555_5555
    };
    spread(low) | spread(high) << 1
}

/// Candidates are not multiplied to more than so many: they take 20 bytes each.
pub const MOST_MULTIPLIED: usize = 2048;

/// How many candidates come from each source, one after the other: powers of two, or none, and multiples of 8.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Samples of the light.
    pub light: usize,
    /// Samples of the lobes.
    pub lobes: usize,
}

impl Counts {
    /// All candidates.
    pub fn sum(&self) -> usize {
        self.light + self.lobes
    }

    /// So many times as many of each source, as long as there is room: `factor` is a power of two.
    pub fn times(&self, factor: usize) -> Counts {
        let factor = factor.min(MOST_MULTIPLIED / self.sum().clamp(1, MOST_MULTIPLIED));
        Counts { light: self.light * factor, lobes: self.lobes * factor }
    }
}

impl Draw<'_> {
    /// Draws all candidates.
    #[inline(always)]
    pub fn run<F: Lanes>(&self, out: &mut Candidates<'_>) {
        let Counts { light, lobes } = self.counts;
        self.place(Set::Light, 0, light, out);
        self.place(Set::Lobes, light, lobes, out);
        let mut reads = Reads::default();
        for first in (0..light.max(lobes)).step_by(TOGETHER) {
            let left = |count: usize| count.saturating_sub(first).min(TOGETHER);
            self.draw::<F>(&mut reads, [(first, left(light)), (light + first, left(lobes))], out);
        }
    }

    /// Draws as many of each source as are read together: from which candidate on, and how many.
    #[inline(always)]
    fn draw<F: Lanes>(
        &self,
        reads: &mut Reads,
        [(walks, walk_count), (looks, look_count)]: [(usize, usize); 2],
        out: &mut Candidates<'_>,
    ) {
        let walked = walks..walks + walk_count;
        let [across, down] = [&*out.x, &*out.y].map(|of| of.get(walked.clone()).unwrap_or_default());
        reads.begin(self.light, across, down);
        for group in (0..look_count).step_by(LANES) {
            let number = |of: &[f32]| <F as Num>::read(of.get(looks + group..).unwrap_or_default());
            let direction = self.surface.to_map(self.surface.sample([number(out.x), number(out.y)]));
            reads.aim(self.light, group, &self.light.chart.place(direction));
            out.put(looks + group, direction);
        }
        reads.read(self.light, walk_count, look_count);
        for group in (0..walk_count + look_count).step_by(LANES) {
            if group < walk_count {
                let (direction, density, light) = reads.drawn::<F>(self.light, group);
                self.weigh(&Drawn { direction, light, own: Some(density) }, walks + group, out);
            } else {
                let (look, at) = (group - walk_count, looks + group - walk_count);
                let direction: [F; 3] = out.directions(at);
                self.weigh(&Drawn { direction, light: reads.looked::<F>(self.light, look), own: None }, at, out);
            }
        }
    }

    /// Writes the numbers of a set to where its directions will stand, in the order of a Morton curve, so that systematic picks are spread
    /// over directions.
    ///
    /// The points of a set are a (0, 2)-net: of the boxes along the curve each holds one of them.
    #[inline(always)]
    fn place(&self, set: Set, begin: usize, count: usize, out: &mut Candidates<'_>) {
        let (seed, first) = self.turn.set(set, count);
        let bits = count.max(1).trailing_zeros();
        let [across, down] = [bits.div_ceil(2), bits / 2];
        let of = |u: f32, bits: u32| (u * (1 << (bits & 31)) as f32) as i32 as u32;
        for group in (0..count).step_by(LANES) {
            // A loop of its own, so that it becomes vector instructions.
            let mut points = [[0.0; LANES]; 2];
            let [xs, ys] = &mut points;
            for ((x, y), index) in xs.iter_mut().zip(ys).zip(group as u32..) {
                [*x, *y] = Turn::point(seed, first.wrapping_add(index));
            }
            for (&x, &y) in points[0].iter().zip(&points[1]) {
                let (x_bits, y_bits) = (of(x, across), of(y, down));
                // With an odd number of bits the first one is of the first number.
                let slot = if across == down { morton(y_bits, x_bits) } else { morton(x_bits, y_bits) };
                let at = begin + slot as usize;
                if let (Some(across), Some(down)) = (out.x.get_mut(at), out.y.get_mut(at)) {
                    (*across, *down) = (x, y);
                }
            }
        }
    }

    /// How much of the light along eight directions of map space was seen.
    #[inline(always)]
    fn visible<F: Lanes>(&self, direction: [F; 3]) -> F {
        let Some(factors) = self.seen else { return <F as Num>::splat(1.0) };
        let [x, y] = wide::square(wide::to_world(self.frame, direction));
        let (x, y) = (Num::store(x), Num::store(y));
        let mut visible = [1.0; LANES];
        for ((visible, x), y) in visible.iter_mut().zip(x).zip(y) {
            *visible = f32::from(factors[cell([x, y]) % CELLS]);
        }
        <F as Num>::load(visible)
    }

    /// Weighs eight directions and writes them.
    ///
    /// Densities are mixed by the balance heuristic (Veach and Guibas 1995), in which the radiance over the power stands for the density of
    /// the light: tables round that a little, and finding it takes longer. A candidate of the light has its own density in place of the
    /// radiance there, so that the estimate is unbiased.
    #[inline(always)]
    fn weigh<F: Lanes>(&self, drawn: &Drawn<F>, group: usize, out: &mut Candidates<'_>) {
        let zero = <F as Num>::splat(0.0);
        let direction = drawn.direction;
        let light = drawn.light.radiance;
        let local = self.surface.to_local(direction);
        let (value, lobes) = self.surface.eval(local);
        let [lights, of_lobes] = [self.counts.light, self.counts.lobes].map(|n| <F as Num>::splat(n as f32));
        let mut density = lights * (light * drawn.light.candidates) + of_lobes * lobes;
        if let Some(own) = drawn.own {
            density = density * (own / light);
        }
        // Lobes answer 0 in all components where they have no direction.
        let height = if self.surface.is_whole() {
            local[0] * local[0] + local[1] * local[1] + local[2] * local[2]
        } else {
            local[2]
        };
        let counts = Num::lt(zero, height);
        // A density of 0 can only come from rounding, and one that is not finite from a place without light or without area: such
        // directions do not count either.
        let counts = <F as Num>::and(counts, Num::lt(zero, density));
        let counts = <F as Num>::and(counts, Num::lt(density, <F as Num>::splat(f32::INFINITY)));
        let value = if self.without_lobes { <F as Num>::splat(1.0) } else { value };
        let target = value * light * self.visible(direction);
        let weight = <F as Num>::only(counts, (target / density).min(<F as Num>::splat(f32::MAX)));
        let density = <F as Num>::select(counts, density, <F as Num>::splat(f32::INFINITY));
        out.put(group, direction);
        put(out.density, group, density);
        put(out.weight, group, weight);
    }
}

/// Writes eight numbers.
#[inline(always)]
fn put<F: Lanes>(out: &mut [f32], group: usize, lanes: F) {
    if let Some(out) = out.get_mut(group..group + LANES) {
        out.copy_from_slice(&Num::store(lanes));
    }
}

/// Directions that a target gets in one call.
const TARGETS: usize = 16;

impl Candidates<'_> {
    /// Writes eight directions.
    #[inline(always)]
    fn put<F: Lanes>(&mut self, group: usize, [x, y, z]: [F; 3]) {
        put(self.x, group, x);
        put(self.y, group, y);
        put(self.z, group, z);
    }

    /// Eight directions that were written.
    #[inline(always)]
    fn directions<F: Lanes>(&self, group: usize) -> [F; 3] {
        let read = |of: &[f32]| <F as Num>::read(of.get(group..).unwrap_or_default());
        [read(self.x), read(self.y), read(self.z)]
    }

    /// Multiplies the weights of all candidates that count by the client's target. `None` if that failed.
    pub fn weigh_by(&mut self, target: &dyn Target, frame: &Frame) -> Option<()> {
        let places = self.x.iter().zip(self.y.iter()).zip(self.z.iter());
        let mut candidates =
            places.zip(self.density.iter()).zip(self.weight.iter_mut()).filter(|((_, d), _)| **d < f32::INFINITY);
        loop {
            let mut wi = [[0.0; 3]; TARGETS];
            let mut weights: [Option<&mut f32>; TARGETS] = [const { None }; TARGETS];
            let mut count = 0;
            for ((wi, slot), ((((x, y), z), _), weight)) in wi.iter_mut().zip(&mut weights).zip(candidates.by_ref()) {
                *wi = to_world(frame, [*x, *y, *z]);
                *slot = Some(weight);
                count += 1;
            }
            if count == 0 {
                return Some(());
            }
            let mut values = [0.0; TARGETS];
            let (wi, values) = (wi.get(..count)?, values.get_mut(..count)?);
            if !target.f_cos(wi, values) {
                return None;
            }
            for (weight, value) in weights.iter_mut().flatten().zip(values) {
                if !(*value >= 0.0 && *value < f32::INFINITY) {
                    return None;
                }
                **weight = (**weight * *value).min(f32::MAX);
            }
        }
    }
}
