//! Candidates for rays, eight at a time: from the product, the light and the lobes, each with the library's own estimate of what it
//! would bring.

use super::joint::{Set, Turn};
use crate::brdf::point::Target;
use crate::brdf::surface::Surface;
use crate::light::batch::Density;
use crate::light::density::{to_map, to_world};
use crate::light::tables::Light;
use crate::product::density::Shaded;
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
    /// The product of both, if candidates come from it.
    pub product: Option<&'a Shaded<'a>>,
    /// From map space to the world.
    pub frame: &'a Frame,
    /// How many candidates come from each source.
    pub counts: Counts,
    /// Whether the client's own target follows: the lobes' values do not count.
    pub without_lobes: bool,
    /// What was seen from there, by cell of the world's directions.
    pub seen: Option<&'a Factors>,
}

/// How many candidates come from each source, one after the other: multiples of 8.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Samples of the product.
    pub product: usize,
    /// Samples of the light.
    pub light: usize,
    /// Samples of the lobes.
    pub lobes: usize,
}

impl Counts {
    /// All candidates.
    pub fn sum(&self) -> usize {
        self.product + self.light + self.lobes
    }

    /// Where candidate `i` comes from, and its number there.
    fn of(&self, i: usize) -> (Set, usize, usize) {
        if i < self.product {
            (Set::Product, self.product, i)
        } else if i < self.product + self.light {
            (Set::Light, self.light, i - self.product)
        } else {
            (Set::Lobes, self.lobes, i - self.product - self.light)
        }
    }
}

impl Draw<'_> {
    /// Draws all candidates.
    #[inline(always)]
    pub fn run<F: Lanes>(&self, out: &mut Candidates<'_>) {
        for group in (0..out.x.len()).step_by(LANES) {
            let (set, count, number) = self.counts.of(group);
            let (seed, first) = self.turn.set(set, count);
            let first = first.wrapping_add(number as u32);
            let (mut across, mut down) = ([0.0; LANES], [0.0; LANES]);
            for ((across, down), index) in across.iter_mut().zip(&mut down).zip(0..) {
                [*across, *down] = Turn::point(seed, first.wrapping_add(index));
            }
            let u = [<F as Num>::load(across), <F as Num>::load(down)];
            let (direction, light, product) = self.draw(set, u);
            self.weigh(direction, light, product, group, out);
        }
    }

    /// Eight directions of map space, with their densities in the light and in the product (or in the light again).
    #[inline(always)]
    fn draw<F: Lanes>(&self, set: Set, u: [F; 2]) -> ([F; 3], F, F) {
        if let (Set::Product, Some(product)) = (set, self.product) {
            let (world, density) = product.sample::<F>(self.frame, u);
            let direction = to_map(self.frame, world);
            return (direction, self.light.density(direction), density);
        }
        let (direction, light) = if set == Set::Lobes {
            let direction = self.surface.to_map(self.surface.sample(u));
            (direction, self.light.density(direction))
        } else {
            self.light.candidates(u)
        };
        let product =
            self.product.map_or(light, |product| product.pdf::<F>(self.frame, to_world(self.frame, direction)));
        (direction, light, product)
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

    /// Weighs eight directions with their densities in light and product, and writes them.
    #[inline(always)]
    fn weigh<F: Lanes>(&self, direction: [F; 3], light: F, product: F, group: usize, out: &mut Candidates<'_>) {
        let zero = <F as Num>::splat(0.0);
        let local = self.surface.to_local(direction);
        let (value, lobes) = self.surface.eval(local);
        let Counts { product: products, light: lights, lobes: of_lobes } = self.counts;
        let [products, lights, of_lobes] = [products, lights, of_lobes].map(|n| <F as Num>::splat(n as f32));
        let density = products * product + (lights * light + of_lobes * lobes);
        // Lobes answer 0 in all components where they have no direction.
        let height = if self.surface.is_whole() {
            local[0] * local[0] + local[1] * local[1] + local[2] * local[2]
        } else {
            local[2]
        };
        let counts = Num::lt(zero, height);
        // A density of 0 can only come from rounding: such a direction does not count either.
        let counts = <F as Num>::and(counts, Num::lt(zero, density));
        let value = if self.without_lobes { <F as Num>::splat(1.0) } else { value };
        let target = value * light * self.visible(direction);
        let weight = <F as Num>::only(counts, target / density);
        let density = <F as Num>::select(counts, density, <F as Num>::splat(f32::INFINITY));
        let columns = [direction[0], direction[1], direction[2], density, weight];
        let targets = [&mut *out.x, &mut *out.y, &mut *out.z, &mut *out.density, &mut *out.weight];
        for (target, column) in targets.into_iter().zip(columns) {
            if let Some(target) = target.get_mut(group..group + LANES) {
                target.copy_from_slice(&Num::store(column));
            }
        }
    }
}

/// Directions that a target gets in one call.
const TOGETHER: usize = 16;

impl Candidates<'_> {
    /// Multiplies the weights of all candidates that count by the client's target. `None` if that failed.
    pub fn weigh_by(&mut self, target: &dyn Target, frame: &Frame) -> Option<()> {
        let places = self.x.iter().zip(self.y.iter()).zip(self.z.iter());
        let mut candidates =
            places.zip(self.density.iter()).zip(self.weight.iter_mut()).filter(|((_, d), _)| **d < f32::INFINITY);
        loop {
            let mut wi = [[0.0; 3]; TOGETHER];
            let mut weights: [Option<&mut f32>; TOGETHER] = [const { None }; TOGETHER];
            let mut count = 0;
            for ((wi, slot), ((((x, y), z), _), weight)) in wi.iter_mut().zip(&mut weights).zip(candidates.by_ref()) {
                *wi = to_world(frame, [*x, *y, *z]);
                *slot = Some(weight);
                count += 1;
            }
            if count == 0 {
                return Some(());
            }
            let mut values = [0.0; TOGETHER];
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
