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
use crate::light::radiance::{Source, Texels};
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

/// Candidates that were found, but for their directions: where the light is read, and one over the density among the strata.
#[derive(Clone, Copy)]
struct Found<F: Num> {
    texels: Texels<F>,
    inverse: F,
}

impl Draw<'_> {
    /// Draws all candidates into room for as many. Sets have as many points as there are candidates of the light, and of the lobes.
    ///
    /// In a renderer what is read of the light is far away. So all strata are prefetched before candidates are found, from the last to the first; and
    /// their texels before those that were found earlier are weighed.
    #[inline(always)]
    pub fn fill<F: Num>(&self, [sets, of_lobes]: [&Sets; 2], groups: &mut [Group]) {
        let sources @ [light, lobes, _] = self.counts.groups();
        // Whole numbers of 32 bits become numbers in one instruction.
        let counted = sources.map(|groups| (GROUP * groups) as i32 as f32);
        for (number, group) in groups.iter_mut().take(light + lobes).enumerate() {
            let of_light = number < light;
            let (set, sets, first) = if of_light { (Set::Light, sets, 0) } else { (Set::Lobes, of_lobes, light) };
            for at in places::<F>() {
                let [u, v] = sets.at::<F>(set, (GROUP * (number - first) + at) as u32);
                if of_light {
                    self.light.prefetch(u);
                }
                u.write(&mut group.density, at);
                v.write(&mut group.weight, at);
            }
        }
        let registers = GROUP / F::WIDTH;
        let mut found = Found { texels: Texels::none(), inverse: F::splat(0.0) };
        for register in (0..=registers * groups.len()).rev() {
            let earlier = found;
            if let Some(next) = register.checked_sub(1)
                && let Some(group) = groups.get_mut(next / registers)
            {
                found = self.find(next / registers, next % registers * F::WIDTH, sources, group);
            }
            let number = register / registers;
            if let Some(group) = groups.get_mut(number) {
                self.weigh(number < light, earlier, counted, group, register % registers * F::WIDTH);
            }
        }
    }

    /// Finds candidates in a group, and prefetches the texels there. Two numbers of each stand in place of densities and weights; those of portals
    /// are given as directions. `sources`: groups of each.
    #[inline(always)]
    fn find<F: Num>(
        &self,
        number: usize,
        at: usize,
        [of_light, of_lobes, _]: [usize; 3],
        group: &mut Group,
    ) -> Found<F> {
        let Draw { light, surface, .. } = *self;
        let numbers = [F::at(&group.density, at), F::at(&group.weight, at)];
        let (direction, face, position, inverse) = if number < of_light {
            light.sample(numbers)
        } else {
            let direction = if number < of_light + of_lobes {
                surface.to_map(surface.sample(numbers))
            } else {
                group.directions(at)
            };
            let place = light.chart.place(direction);
            (direction, place.face, place.position, F::splat(1.0))
        };
        group.put_direction(at, direction);
        let texels = light.radiance.texels(&light.chart, face, position);
        light.radiance.prefetch(&texels);
        Found { texels, inverse }
    }

    /// Weighs candidates that [`Draw::find`] found. `counted`: how many candidates each source has.
    #[inline(always)]
    fn weigh<F: Num>(&self, of_light: bool, found: Found<F>, counted: [f32; 3], group: &mut Group, at: usize) {
        let Draw { light, surface, portals, .. } = *self;
        let Found { texels, inverse } = found;
        let direction = group.directions::<F>(at);
        let radiance = light.radiance.of(&texels);
        let stand_in = light.stand_in(radiance);
        let local = surface.to_local(direction);
        let (value, lobes) = surface.eval(local);
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
        F::select(counts, density, F::splat(f32::INFINITY)).write(&mut group.density, at);
        F::only(counts, weight).write(&mut group.weight, at);
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
