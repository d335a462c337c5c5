//! Candidates for rays, in lanes: from strata of the light and from the lobes, each with the library's own estimate of what it would bring.
//!
//! A candidate of the light is uniform in a stratum: one load, and its density is exact. In the balance heuristic (Veach and Guibas 1995) a
//! function of the radiance there stands for the density of the light, the same for both sources: so parts of the techniques add up to 1
//! everywhere, and no direction is ever looked for among the strata (rule 24).
//!
//! Candidates stand in order: those of the light along the kD-tree of the strata, those of the lobes along a Morton curve of their numbers.
//! Systematic picks are then spread over directions, also over those of other hits of the pixel (rule 39).

use super::joint::{Points, Set};
use crate::brdf::point::Target;
use crate::brdf::surface::Surface;
use crate::light::candidates::Source;
use crate::light::chart::square_of;
use crate::light::density::to_world;
use crate::points::sobol_points;
use crate::simd::{Compute, Num, Whole};
use crate::sphere::Frame;
use crate::visibility::{CELLS, Factors, cell};

/// The fewest candidates of a source that has any: a multiple of all widths of lanes.
pub const FEWEST: usize = 8;

/// Candidates of a hit, component by component.
#[derive(Debug)]
pub struct Candidates<'a> {
    /// Directions in map space; before, the two numbers of each and nothing.
    pub direction: [&'a mut [f32]; 3],
    /// Densities with counts: what a candidate's target is divided by; infinite where a direction does not count.
    pub density: &'a mut [f32],
    /// Target over density.
    pub weight: &'a mut [f32],
}

/// How many candidates come from each source, one after the other: powers of two from [`FEWEST`] on, or none.
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
}

/// What candidates are drawn for.
pub struct Draw<'a> {
    /// The light.
    pub light: &'a Source<'a>,
    /// The point, in map space.
    pub surface: &'a Surface,
    /// Its random numbers.
    pub points: Points,
    /// From map space to the world.
    pub frame: &'a Frame,
    /// How many candidates come from each source.
    pub counts: Counts,
    /// Whether the client's own target follows: the lobes' values do not count.
    pub without_lobes: bool,
    /// Whether rays bring only the radiance above the mean.
    pub compensated: bool,
    /// What was seen from there, by cell of the world's directions.
    pub seen: Option<&'a Factors>,
}

/// Draws all candidates into room for as many.
pub struct DrawInto<'a, 'b>(pub &'a Draw<'a>, pub &'a mut Candidates<'b>);

/// Bit i of a number below 2^16 as bit 2 i.
#[inline(always)]
fn spread<W: Whole>(x: W) -> W {
    let x = (x | x.shl::<8>()) & W::splat(0x00ff_00ff);
    let x = (x | x.shl::<4>()) & W::splat(0x0f0f_0f0f);
    let x = (x | x.shl::<2>()) & W::splat(0x3333_3333);
    (x | x.shl::<1>()) & W::splat(0x5555_5555)
}

/// The bits of two numbers by turns, those of the first one lower.
#[inline(always)]
fn morton<W: Whole>(low: W, high: W) -> W {
    spread(low) | spread(high).shl::<1>()
}

impl Compute for DrawInto<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Num>(self) {
        let DrawInto(of, out) = self;
        let Counts { light, lobes } = of.counts;
        of.place::<F>(out, Set::Light, 0, light);
        of.place::<F>(out, Set::Lobes, light, lobes);
        let Candidates { direction: [x, y, z], density, weight } = out;
        let places = x.chunks_exact_mut(F::WIDTH).zip(y.chunks_exact_mut(F::WIDTH)).zip(z.chunks_exact_mut(F::WIDTH));
        let weights = density.chunks_exact_mut(F::WIDTH).zip(weight.chunks_exact_mut(F::WIDTH));
        for (group, (((x, y), z), (density, weight))) in places.zip(weights).enumerate() {
            let drawn = of.draw([F::read(x), F::read(y)], group * F::WIDTH < light);
            drawn.direction[0].write(x, 0);
            drawn.direction[1].write(y, 0);
            drawn.direction[2].write(z, 0);
            drawn.density.write(density, 0);
            drawn.weight.write(weight, 0);
        }
    }
}

/// Candidates, one for each lane.
struct Drawn<F: Num> {
    direction: [F; 3],
    density: F,
    weight: F,
}

impl Draw<'_> {
    /// Writes the numbers of a set in the order of its candidates: a (0, 2)-net has one point in each box of that order.
    #[inline(always)]
    fn place<F: Num>(&self, out: &mut Candidates<'_>, set: Set, begin: usize, count: usize) {
        let (seed, first) = self.points.set(set, count);
        let [across, down, _] = &mut out.direction;
        let (Some(across), Some(down)) = (across.get_mut(begin..begin + count), down.get_mut(begin..begin + count))
        else {
            return;
        };
        let bits = count.trailing_zeros();
        let power = |bits: u32| (1u32 << (bits & 31)) as f32;
        let (all, columns, rows) = (power(bits), power(bits.div_ceil(2)), power(bits / 2));
        for group in (0..count as u32).step_by(F::WIDTH) {
            let [x, y] = sobol_points::<F>(seed, F::Whole::splat(first.wrapping_add(group)) + F::counted());
            let slot = if matches!(set, Set::Light) {
                (x * all).to_whole()
            } else {
                let (column, row) = ((x * columns).to_whole(), (y * rows).to_whole());
                // With an odd number of bits the first one is of the first number.
                if columns == rows { morton(row, column) } else { morton(column, row) }
            };
            x.scatter(across, slot);
            y.scatter(down, slot);
        }
    }

    /// Draws and weighs candidates of one source for two numbers of each.
    #[inline(always)]
    fn draw<F: Num>(&self, numbers: [F; 2], of_light: bool) -> Drawn<F> {
        let Draw { light, surface, counts, .. } = *self;
        let (direction, face, position, inverse) = if of_light {
            light.sample(numbers)
        } else {
            let direction = surface.to_map(surface.sample_here(numbers));
            let place = light.chart.place(direction);
            (direction, place.face, place.position, F::splat(1.0))
        };
        let radiance = light.radiance.at(&light.chart, face, position);
        let stand_in = light.stand_in(radiance);
        let local = surface.to_local(direction);
        let (value, lobes) = surface.eval_here(local);
        let mixed = stand_in * counts.light as f32 + lobes * counts.lobes as f32;
        let density = if of_light { mixed / (inverse * stand_in) } else { mixed };
        // Lobes answer 0 in all components where they have no direction.
        let height =
            if surface.is_whole() { local[0] * local[0] + local[1] * local[1] + local[2] * local[2] } else { local[2] };
        // A density that is not finite comes from a place without light.
        let zero = F::splat(0.0);
        let counts = F::and(zero.lt(height), F::and(zero.lt(density), density.lt(F::splat(f32::INFINITY))));
        // As a share of the light, so that its unit changes no bit.
        let brought = if self.compensated { (radiance - light.mean).max(zero) } else { radiance } * light.inverse_power;
        let mut target = if self.without_lobes { brought } else { value * brought };
        if let Some(seen) = self.seen {
            target = target * visible(self.frame, seen, direction);
        }
        Drawn {
            direction,
            density: F::select(counts, density, F::splat(f32::INFINITY)),
            weight: F::only(counts, (target / density).min(F::splat(f32::MAX))),
        }
    }
}

/// How much of the light along directions of map space was seen.
#[inline(always)]
fn visible<F: Num>(frame: &Frame, factors: &Factors, direction: [F; 3]) -> F {
    let [x, y] = square_of(to_world(frame, direction));
    let (x, y) = (x.store(), y.store());
    F::each(|lane| {
        let of = |lanes: &F::Floats| lanes.as_ref().get(lane).copied().unwrap_or(0.0);
        f32::from(factors[cell([of(&x), of(&y)]) % CELLS])
    })
}

/// Directions that a target gets in one call.
const TARGETS: usize = 16;

impl Candidates<'_> {
    /// Multiplies the weights of all candidates that count by the client's target. `None` if that failed.
    pub fn weigh_by(&mut self, target: &dyn Target, frame: &Frame) -> Option<()> {
        let [x, y, z] = &self.direction;
        let places = x.iter().zip(y.iter()).zip(z.iter());
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
