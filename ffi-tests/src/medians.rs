//! Lights by cutting a lat-long map into rectangles: median cut (Debevec 2005) and variance minimisation (Viriyothai and Debevec 2009), written
//! anew after the papers.

use crate::light::Light;
use crate::structured::Lights;
use glam::{DVec3, Vec3};

/// Which rectangle is cut next, and where.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Cut {
    /// The brightest, across its longer side, into halves of the same light.
    Median,
    /// That with the largest variance, where the variances of both parts add up to least.
    Variance,
}

/// What a rectangle emits, and that times the direction.
#[derive(Clone, Copy, Default)]
struct Power {
    energy: f64,
    moment: DVec3,
}

impl Power {
    fn plus(self, other: Power, sign: f64) -> Power {
        Power { energy: self.energy + sign * other.energy, moment: self.moment + sign * other.moment }
    }

    /// Energy times the mean squared distance of its directions from their mean.
    fn variance(self) -> f64 {
        if self.energy > 0.0 { (self.energy - self.moment.length_squared() / self.energy).max(0.0) } else { 0.0 }
    }
}

/// Sums of all texels above and to the left.
struct Sums {
    width: usize,
    height: usize,
    sums: Vec<Power>,
}

/// Columns and rows from the first up to, without it, the second.
type Rectangle = [[usize; 2]; 2];

impl Sums {
    fn new(light: &Light) -> Sums {
        let [width, height] = light.size();
        let mut sums = vec![Power::default(); (width + 1) * (height + 1)];
        for (i, ((direction, area), radiance)) in light.quadrature(1).zip(light.luminance()).enumerate() {
            let at = (i / width + 1) * (width + 1) + i % width + 1;
            let energy = area * f64::from(*radiance);
            let own = Power { energy, moment: energy * direction.as_dvec3() };
            let beside = sums[at - 1].plus(sums[at - width - 1], 1.0).plus(sums[at - width - 2], -1.0);
            sums[at] = own.plus(beside, 1.0);
        }
        Sums { width, height, sums }
    }

    fn of(&self, [[left, right], [top, bottom]]: Rectangle) -> Power {
        let at = |x: usize, y: usize| self.sums[y * (self.width + 1) + x];
        at(right, bottom).plus(at(left, top), 1.0).plus(at(right, top), -1.0).plus(at(left, bottom), -1.0)
    }

    /// The parts of a rectangle cut along an axis before a column or row.
    fn parts(rectangle: Rectangle, axis: usize, at: usize) -> [Rectangle; 2] {
        let (mut first, mut second) = (rectangle, rectangle);
        (first[axis][1], second[axis][0]) = (at, at);
        [first, second]
    }

    /// The parts of a rectangle by a rule; none of a single texel.
    fn cut(&self, rectangle: Rectangle, rule: Cut) -> Option<[Rectangle; 2]> {
        let [columns, rows] = rectangle;
        let middle = 0.5 * (rows[0] + rows[1]) as f64 / self.height as f64;
        // Widths shrink towards the poles.
        let wide = 2.0 * (columns[1] - columns[0]) as f64 / self.width as f64 * (std::f64::consts::PI * middle).sin();
        let is_wide = wide >= (rows[1] - rows[0]) as f64 / self.height as f64;
        let loss = |parts: &[Rectangle; 2]| {
            let [a, b] = parts.map(|part| self.of(part));
            if rule == Cut::Median { (a.energy - b.energy).abs() } else { a.variance() + b.variance() }
        };
        let places =
            |axis: usize| (rectangle[axis][0] + 1..rectangle[axis][1]).map(move |at| Sums::parts(rectangle, axis, at));
        let longer = usize::from(!is_wide);
        let best = |axis: usize| places(axis).min_by(|a, b| loss(a).total_cmp(&loss(b)));
        match rule {
            Cut::Median => best(longer).or_else(|| best(1 - longer)),
            Cut::Variance => [0, 1].into_iter().filter_map(best).min_by(|a, b| loss(a).total_cmp(&loss(b))),
        }
    }
}

/// So many lights, each at the mean direction of its rectangle.
pub fn cut(light: &Light, count: usize, rule: Cut) -> Lights {
    let sums = Sums::new(light);
    let mut all: Vec<Rectangle> = vec![[[0, sums.width], [0, sums.height]]];
    let weight = |rectangle: &Rectangle| {
        let power = sums.of(*rectangle);
        if rule == Cut::Median { power.energy } else { power.variance() }
    };
    while all.len() < count {
        let several = |i: &usize| all[*i].iter().any(|[from, to]| to - from > 1);
        let largest = (0..all.len()).filter(several).max_by(|a, b| weight(&all[*a]).total_cmp(&weight(&all[*b])));
        let Some((largest, [first, second])) = largest.and_then(|i| Some((i, sums.cut(all[i], rule)?))) else { break };
        all[largest] = first;
        all.push(second);
    }
    let light = |rectangle: &Rectangle| {
        let power = sums.of(*rectangle);
        (power.moment.as_vec3().try_normalize().unwrap_or(Vec3::Z), power.energy as f32)
    };
    Lights::new(&all.iter().map(light).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nothing is lost by cutting, and a map is cut as often as is asked for.
    #[test]
    fn parts_add_up_to_the_map() {
        let light = Light::room(64).to_latlong(64);
        let sums = Sums::new(&light);
        let whole = [[0, sums.width], [0, sums.height]];
        for rule in [Cut::Median, Cut::Variance] {
            let parts = sums.cut(whole, rule).unwrap().map(|part| sums.of(part));
            let energy = parts[0].energy + parts[1].energy;
            assert!((energy / sums.of(whole).energy - 1.0).abs() < 1e-9);
            assert!(rule == Cut::Variance || parts[0].energy < 0.6 * energy && parts[1].energy < 0.6 * energy);
            assert!(parts[0].variance() + parts[1].variance() <= sums.of(whole).variance());
            assert!(cut(&light, 64, rule).count == 64);
        }
    }
}
