//! Resampling of candidates from light and BRDF: for each pick on its own (Talbot et al. 2005), or pooled: all
//! candidates of a pixel along the Morton curve of the octahedron, picked by systematic resampling.

use crate::client::{self, Density};
use crate::estimator::{Draws, Pick, Stream};
use crate::light::Light;
use crate::material::Bsdf;
use glam::Vec3;

/// Candidates with their resampling weights g / (n_e p_e + n_b p_b).
#[derive(Default)]
pub struct Candidates {
    weighted: Vec<(Vec3, f32)>,
    ordered: Vec<(u32, u32)>,
}

impl Candidates {
    /// RIS: each of `n` picks chooses among `m` candidates of its own, half from the light and half from the BRDF.
    pub fn pick_each(
        &mut self,
        draws: &mut Draws,
        sources: (&impl Density, &Light, &Bsdf),
        n: usize,
        m: usize,
        picks: &mut Vec<Pick>,
    ) -> client::Result<()> {
        let half = m / 2;
        self.draw(draws, sources, n * half, half as f32)?;
        let choices = draws.points(Stream::Choice, n)?;
        let (light, bsdf) = self.weighted.split_at(n * half);
        for (i, choice) in choices.iter().enumerate() {
            let groups = [&light[i * half..(i + 1) * half], &bsdf[i * half..(i + 1) * half]];
            let all = || groups.iter().copied().flatten();
            let sum: f32 = all().map(|c| c.1).sum();
            let mut rest = choice[0] * sum;
            let chosen = all().filter(|c| c.1 > 0.0).find(|c| {
                rest -= c.1;
                rest < 0.0
            });
            // Rounding may leave a little at the end: the last candidate then stands for it.
            if let Some(&(wi, _)) = chosen.or_else(|| all().rfind(|c| c.1 > 0.0)) {
                picks.push(Pick { wi, contribution: sum / n as f32 });
            }
        }
        Ok(())
    }

    /// P(k): `n` picks from `k n` candidates; one that is picked several times is one ray.
    pub fn pick_pooled(
        &mut self,
        draws: &mut Draws,
        sources: (&impl Density, &Light, &Bsdf),
        n: usize,
        k: usize,
        picks: &mut Vec<Pick>,
    ) -> client::Result<()> {
        let half = n * k / 2;
        self.draw(draws, sources, half, half as f32)?;
        let offset = draws.points(Stream::Choice, 1)?[0][0];
        self.order();
        let sum: f32 = self.ordered.iter().map(|&(_, i)| self.weighted[i as usize].1).sum();
        let (mut passed, mut taken) = (0.0, 0);
        for &(_, i) in &self.ordered {
            let (wi, weight) = self.weighted[i as usize];
            passed += weight;
            let up_to = ((passed / sum * n as f32 - offset).ceil().max(0.0) as usize).min(n);
            if up_to > taken {
                picks.push(Pick { wi, contribution: sum / n as f32 * (up_to - taken) as f32 });
                taken = up_to;
            }
        }
        Ok(())
    }

    /// Draws `count` candidates of each kind, `in_group` of which are weighed together.
    fn draw(
        &mut self,
        draws: &mut Draws,
        (density, light, bsdf): (&impl Density, &Light, &Bsdf),
        count: usize,
        in_group: f32,
    ) -> client::Result<()> {
        self.weighted.clear();
        let mut weigh = |wi: Vec3, p_light: f32| {
            let (f_cos, p_bsdf) = bsdf.eval(wi);
            let weight = if f_cos > 0.0 { f_cos * light.radiance(wi) / (in_group * (p_light + p_bsdf)) } else { 0.0 };
            self.weighted.push((wi, weight));
        };
        draws.from_density(density, Stream::Light, count)?;
        draws.for_each(&mut weigh);
        draws.from_bsdf(bsdf, Stream::Bsdf, count)?;
        draws.evaluate(density)?;
        draws.for_each(weigh);
        Ok(())
    }

    /// Those that can be picked, along the Morton curve.
    fn order(&mut self) {
        self.ordered.clear();
        let weighted = self.weighted.iter().enumerate().filter(|(_, c)| c.1 > 0.0);
        self.ordered.extend(weighted.map(|(i, c)| (octahedral_morton(c.0), i as u32)));
        self.ordered.sort_unstable();
    }
}

/// The Morton code of a direction's cell on the octahedral square of 2^16 cells.
fn octahedral_morton(d: Vec3) -> u32 {
    let norm = d.x.abs() + d.y.abs() + d.z.abs();
    let (x, y) = (d.x / norm, d.y / norm);
    let fold = |a: f32, b: f32| (1.0 - b.abs()).copysign(a);
    let (x, y) = if d.z < 0.0 { (fold(x, y), fold(y, x)) } else { (x, y) };
    let cell = |c: f32| ((c * 0.5 + 0.5) * 256.0).clamp(0.0, 255.0) as u32;
    spread(cell(x)) | spread(cell(y)) << 1
}

/// Moves bit i to bit 2 i.
fn spread(bits: u32) -> u32 {
    let bits = (bits | bits << 4) & 0x0f0f;
    let bits = (bits | bits << 2) & 0x3333;
    (bits | bits << 1) & 0x5555
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_on_the_curve_are_neighbours_on_the_sphere() {
        assert_eq!(spread(0b1011), 0b100_0101);
        assert_ne!(octahedral_morton(Vec3::Z), octahedral_morton(Vec3::NEG_Z));
        let near = Vec3::new(0.3, 0.4, 0.5).normalize();
        assert_eq!(octahedral_morton(near), octahedral_morton((near + Vec3::splat(1e-5)).normalize()));
    }
}
