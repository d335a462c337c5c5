//! Systematic picks: of all candidates as many as there are rays, each as often as its share of the weights says.

use super::Ray;
use super::group::Group;
use crate::simd::{Four, GROUP, Num, places};
use crate::sphere::Frame;

/// The share of the mean weight that every candidate has at least, so that a client whose BRDF or radiance is another than the
/// library's meets no huge weight. A higher one costs clients whose BRDF is the library's: rays are spent on what brings nothing. A lower one costs the
/// others.
pub const FLOOR: f32 = 0.04;
/// The share of the picks that candidates of the light have at least, and no more than one pick of a call for it. Where a narrow lobe meets what is
/// blocked, light arrives from elsewhere, which candidates of the lobe hardly find.
const OF_LIGHT: f32 = 0.25;
/// The most that weights of the light grow by for it: those that are next to nothing stay so.
const GROWTH: f32 = 1e25;
/// Sums of weights beyond these are too close to the ends of f32 to work with: every candidate that counts is then as good as another.
/// Times a density, of a lobe of alpha 1e-5 for instance, it is still a number.
const LARGEST: f32 = 1e25;
/// Shares of it, such as a ray's and the least weight, are still normal numbers.
const SMALLEST: f32 = 1e-30;

/// Picks as many candidates as there is room for rays, merged where one is picked more than once, and writes a ray for each. Answers how many
/// there are. `light`: groups of the light, which stand first and have their share of the picks, or 0: they have none. `floor`: the least weight,
/// as a share of the mean. `u`: the number of the pick.
#[inline(always)]
pub fn pick_rays<F: Num>(
    groups: &mut [Group],
    light: usize,
    floor: f32,
    u: f32,
    frame: &Frame,
    out: &mut [Ray],
) -> usize {
    pick::<F>(groups, light, floor, out.len(), u, |ray, direction, weight| {
        if let Some(out) = out.get_mut(ray) {
            *out = Ray { wi: frame.to_world(direction), weight };
        }
    })
}

/// Picks `rays` candidates, merged where one is picked more than once, and hands their number, direction and weight to `put`.
/// Answers how many there are: none if no candidate counts.
#[inline(always)]
pub fn pick<F: Num>(
    groups: &mut [Group],
    light: usize,
    floor: f32,
    rays: usize,
    u: f32,
    mut put: impl FnMut(usize, [f32; 3], f32),
) -> usize {
    let total = sum_up::<F>(groups, light, rays, floor);
    if !(total > 0.0) {
        return 0;
    }
    let groups: &[Group] = groups;
    let step = total / number(rays);
    let threshold = |taken: usize| (number(taken) + u) * step;
    let sum = |index: usize| groups.get(index / GROUP).map_or(0.0, |group| group.weight[index % GROUP]);
    let (mut from, mut taken, mut written) = (0, 0, 0);
    while taken < rays {
        let index = first_above(groups, from, threshold(taken)).unwrap_or_else(|| last_picked(groups));
        let Some(group) = groups.get(index / GROUP) else { break };
        let (before, end) = (sum(index.wrapping_sub(1)), sum(index));
        let first = taken;
        taken += 1;
        // The last one takes what rounding leaves.
        while taken < rays && (threshold(taken) < end || end == total) {
            taken += 1;
        }
        let density = (end - before) * group.density[index % GROUP];
        let [x, y, z] = &group.direction;
        let weight = (number(taken - first) * step / density).min(f32::MAX);
        put(written, [x[index % GROUP], y[index % GROUP], z[index % GROUP]], weight);
        written += 1;
        from = index;
    }
    written
}

/// [`FLOOR`] where earlier passes saw little of the light: what weighs much there is mostly blocked, and light arrives from elsewhere. With 4 rays
/// in rooms of one to four openings, variance x time is 0.88 times that of 0.05 in both metrics; one of 1 is worse than 0.05.
pub const FLOOR_IN_THE_DARK: f32 = 0.25;

/// A count as a number: of 32 bits, in one instruction.
#[inline(always)]
fn number(count: usize) -> f32 {
    count as i32 as f32
}

/// The places in a group at which four numbers begin.
const FOURS: [usize; GROUP / Four::WIDTH] = {
    assert!(GROUP == 2 * Four::WIDTH);
    [0, Four::WIDTH]
};

/// The sum of all weights.
#[inline(always)]
fn sum_of(groups: &[Group]) -> f32 {
    let mut sums = Four::splat(0.0);
    for group in groups {
        for at in FOURS {
            sums = sums + Four::at(&group.weight, at);
        }
    }
    let [a, b, c, d] = sums.store();
    (a + b) + (c + d)
}

/// Multiplies all weights.
fn raise(groups: &mut [Group], growth: f32) {
    for weight in groups.iter_mut().flat_map(|group| &mut group.weight) {
        *weight *= growth;
    }
}

/// Raises the weights of the light to their share. Answers the sum of all. Apart, since a single ray has no share to keep.
#[inline(never)]
fn share_out(groups: &mut [Group], light: usize, rays: usize) -> f32 {
    let share = OF_LIGHT.min(1.0 / number(rays));
    let (first, others) = groups.split_at_mut_checked(light).unwrap_or_default();
    let (of_light, of_others) = (sum_of(first), sum_of(others));
    let wanted = of_others * share / (1.0 - share);
    let growth = if of_light > 0.0 && of_light < wanted { (wanted / of_light).min(GROWTH) } else { 1.0 };
    let sum = of_light * growth + of_others;
    if growth > 1.0 && is_fit(sum) {
        raise(first, growth);
    }
    sum
}

/// Whether a sum of weights is one to work with.
fn is_fit(sum: f32) -> bool {
    sum > SMALLEST && sum < LARGEST
}

/// Turns weights into their sums up to each: candidates of the light get at least their share, and all that count the least weight.
/// Answers the sum of all.
#[inline(always)]
fn sum_up<F: Num>(groups: &mut [Group], light: usize, rays: usize, floor: f32) -> f32 {
    let sum = if light > 0 { share_out(groups, light, rays) } else { sum_of(groups) };
    // Without any target every candidate that counts is as good as another.
    let (scale, least) = if is_fit(sum) { (1.0, floor * sum / number(GROUP * groups.len())) } else { (0.0, 1.0) };
    let mut total = 0.0;
    for group in groups {
        for at in places::<F>() {
            let counts = F::at(&group.density, at).lt(F::splat(f32::INFINITY));
            F::only(counts, F::at(&group.weight, at) * scale + least).sums().write(&mut group.weight, at);
        }
        for at in FOURS {
            let sums = Four::at(&group.weight, at) + total;
            sums.write(&mut group.weight, at);
            [.., total] = sums.store();
        }
    }
    total
}

/// The first of ascending sums that is above a threshold, from an index on before which none is.
#[inline(always)]
fn first_above(groups: &[Group], from: usize, threshold: f32) -> Option<usize> {
    for (number, group) in groups.iter().enumerate().skip(from / GROUP) {
        for at in FOURS {
            let above = Four::bits(Four::splat(threshold).lt(Four::at(&group.weight, at)));
            if above != 0 {
                return Some(GROUP * number + at + above.trailing_zeros() as usize);
            }
        }
    }
    None
}

/// The last candidate with a weight, where rounding carried a threshold to the sum of all.
#[cold]
fn last_picked(groups: &[Group]) -> usize {
    let sums = || groups.iter().flat_map(|group| group.weight);
    let total = sums().last().unwrap_or(0.0);
    sums().position(|sum| sum == total).unwrap_or(0)
}
