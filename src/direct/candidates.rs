//! Candidates for rays, in lanes: from strata of the light, from the lobes and from portals, each with the library's own estimate of what it
//! would bring.
//!
//! A candidate of the light lies in a stratum by a linear density: one load, and its density is exact. In the balance heuristic (Veach and
//! Guibas 1995) a function of the radiance there stands for the density of the light, the same for all sources: so parts of the techniques add
//! up to 1 everywhere, and no direction is ever looked for among the strata (rule 24).
//!
//! Candidates stand in the order of their first numbers: those of the light along the kD-tree of the strata, those of a lobe about its axis.
//! Systematic picks are then spread over directions, also over those of other hits of the pixel (rule 39).

use super::group::Group;
use super::joint::{Set, Sets};
use super::portals::Portals;
use crate::brdf::point::Target;
use crate::brdf::surface::Surface;
use crate::light::radiance::Source;
use crate::simd::{GROUP, Num, places};
use crate::sphere::{Frame, octahedral_square};
use crate::visibility::{CELLS, Factors, cells};

/// The fewest candidates of a source that has any.
pub const FEWEST: usize = GROUP;

/// How many candidates come from each source, one after the other: powers of two from [`FEWEST`] on, or none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Samples of the light.
    pub light: usize,
    /// Samples of the lobes.
    pub lobes: usize,
    /// Samples of the portals.
    pub portals: usize,
}

impl Counts {
    /// All candidates.
    pub fn sum(&self) -> usize {
        self.light + self.lobes + self.portals
    }

    /// Groups of each source.
    #[inline(always)]
    fn groups(&self) -> [usize; 3] {
        [self.light, self.lobes, self.portals].map(|count| count / GROUP)
    }
}

/// What candidates are drawn for.
pub struct Draw<'a> {
    /// The light.
    pub light: &'a Source<'a>,
    /// The point, in map space.
    pub surface: &'a Surface,
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
    /// Where light comes from, if that is known and seen.
    pub portals: Option<&'a Portals>,
}

/// Candidates, one for each lane.
struct Drawn<F: Num> {
    direction: [F; 3],
    density: F,
    weight: F,
}

impl Draw<'_> {
    /// Draws all candidates into room for as many. Sets have as many points as there are candidates of the light, and of the lobes.
    #[inline(always)]
    pub fn fill<F: Num>(&self, [mut sets, of_lobes]: [&Sets; 2], groups: &mut [Group]) {
        let [light, lobes, portals] = self.counts.groups();
        // Whole numbers of 32 bits become numbers in one instruction.
        let counted = [light, lobes, portals].map(|groups| (GROUP * groups) as i32 as f32);
        let (mut set, mut first) = (Set::Light, 0);
        for (number, group) in groups.iter_mut().enumerate() {
            if number == light {
                (set, sets, first) = (Set::Lobes, of_lobes, 0);
            }
            if number == light + lobes {
                set = Set::Portals;
            }
            for at in places::<F>() {
                let drawn = self.draw::<F>(set, sets.at(set, first + at as u32), (group, at), counted);
                group.put_direction(at, drawn.direction);
                drawn.density.write(&mut group.density, at);
                drawn.weight.write(&mut group.weight, at);
            }
            first += GROUP as u32;
        }
    }

    /// Weighs candidates of one source, which are drawn for two numbers of each; those of portals are given as directions. `counted`: how many
    /// candidates each source has.
    #[inline(always)]
    fn draw<F: Num>(&self, set: Set, numbers: [F; 2], given: (&Group, usize), counted: [f32; 3]) -> Drawn<F> {
        let Draw { light, surface, portals, .. } = *self;
        let of_light = matches!(set, Set::Light);
        let (direction, face, position, inverse) = if of_light {
            light.sample(numbers)
        } else {
            let direction = if matches!(set, Set::Portals) {
                given.0.directions(given.1)
            } else {
                surface.to_map(surface.sample_here(numbers))
            };
            let place = light.chart.place(direction);
            (direction, place.face, place.position, F::splat(1.0))
        };
        let radiance = light.radiance.at(&light.chart, face, position);
        let stand_in = light.stand_in(radiance);
        let local = surface.to_local(direction);
        let (value, lobes) = surface.eval_here(local);
        let mixed = stand_in * counted[0] + lobes * counted[1];
        let through = portals.map(|portals| portals.density(direction));
        let mixed = through.map_or(mixed, |through| mixed + through * counted[2]);
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
        let weight = (target / density).min(F::splat(f32::MAX));
        let (counts, density) = match (portals, through) {
            (Some(portals), Some(through)) if portals.complete => (F::and(counts, zero.lt(through)), density),
            (Some(_), Some(through)) => (counts, F::select(zero.lt(through), density, zero - density)),
            _ => (counts, density),
        };
        Drawn {
            direction,
            density: F::select(counts, density, F::splat(f32::INFINITY)),
            weight: F::only(counts, weight),
        }
    }
}

/// How much of the light along directions of map space was seen.
#[inline(always)]
fn visible<F: Num>(frame: &Frame, factors: &Factors, direction: [F; 3]) -> F {
    let cells = F::ints_of(cells::<F>(octahedral_square(frame.to_world(direction))));
    F::each(|lane| cells.as_ref().get(lane).map_or(0.0, |cell| f32::from(factors[*cell as usize % CELLS])))
}

/// The weight of all candidates outside portals is at most that of those inside over this: an eighth of the rays looks for light that comes
/// through none. A ray lost that way costs a variance of 1/7 where no light does, and 1/3 if it is a quarter of them.
const INSIDE: f32 = 7.0;

/// Directions that a target gets in one call.
const TARGETS: usize = 16;

/// Lowers the weights outside all portals to an eighth of all, and makes their densities positive.
#[inline(never)]
pub fn favour_portals(groups: &mut [Group]) {
    let (mut inside, mut outside) = (0.0, 0.0);
    for (_, density, weight) in groups.iter_mut().flat_map(Group::each) {
        *(if *density < 0.0 { &mut outside } else { &mut inside }) += *weight;
    }
    let scale = if inside > 0.0 && outside * INSIDE > inside { inside / (outside * INSIDE) } else { 1.0 };
    for (_, density, weight) in groups.iter_mut().flat_map(Group::each).filter(|(_, density, _)| **density < 0.0) {
        (*weight, *density) = (*weight * scale, -*density);
    }
}

/// Multiplies the weights of all candidates that count by the client's target. `None` if that failed.
#[inline(never)]
pub fn weigh_by(groups: &mut [Group], target: &dyn Target, frame: &Frame) -> Option<()> {
    let mut candidates = groups.iter_mut().flat_map(Group::each).filter(|(_, density, _)| **density < f32::INFINITY);
    loop {
        let mut wi = [[0.0; 3]; TARGETS];
        let mut weights: [Option<&mut f32>; TARGETS] = [const { None }; TARGETS];
        let mut count = 0;
        for ((wi, slot), (direction, _, weight)) in wi.iter_mut().zip(&mut weights).zip(candidates.by_ref()) {
            *wi = frame.to_world(direction);
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
