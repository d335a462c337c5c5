//! The peers: what a renderer does without the library.

use crate::batch::Stream;
use crate::client;
use crate::lanes::F8;
use crate::material::Bsdf;
use crate::pool::Pick;
use crate::portal::{Measure, Portals, Uniform};
use crate::scene::ShadingPoint;
use crate::setting::{Sampler, Setting};
use crate::texels::Texels;

/// A peer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Peer {
    /// Proportional to the light.
    Environment,
    /// Proportional to the BRDF x cosine.
    Brdf,
    /// Both, by the balance heuristic.
    MisBalance,
    /// Both, by the power heuristic.
    MisPower,
    /// Compensated light and BRDF, by the balance heuristic (Karlik et al. 2019).
    MisCompensated,
    /// Each sample resampled from so many candidates.
    Ris(usize, Candidates),
    /// All samples resampled from a pool of so many candidates for each.
    Pool(usize, Candidates),
    /// One sample by the light in each stratum of the map (Agarwal et al. 2003).
    Structured,
    /// Uniform in the solid angle of portals, and the BRDF, by the balance heuristic.
    Portals,
    /// By the window of the map that the point sees through portals, as pbrt-v4 has it, and the BRDF.
    Windows,
}

/// Where the half of the candidates comes from that is not the BRDF's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Candidates {
    /// The light.
    Plain,
    /// What the light has above its mean.
    Compensated,
}

impl Candidates {
    /// The distribution that draws them.
    pub fn texels<'a>(self, setting: &Setting<'a>) -> &'a Texels {
        match self {
            Candidates::Plain => setting.plain,
            Candidates::Compensated => setting.compensated,
        }
    }
}

impl Peer {
    pub fn name(self) -> String {
        let suffix = |candidates| if candidates == Candidates::Plain { "" } else { " comp." };
        match self {
            Peer::Environment => "environment".into(),
            Peer::Brdf => "BRDF".into(),
            Peer::MisBalance => "MIS balance".into(),
            Peer::MisPower => "MIS power".into(),
            Peer::MisCompensated => "MIS compensated".into(),
            Peer::Ris(m, candidates) => format!("RIS{m}{}", suffix(candidates)),
            Peer::Pool(k, candidates) => format!("P({k}){}", suffix(candidates)),
            Peer::Structured => "structured".into(),
            Peer::Portals => "uniform in portals".into(),
            Peer::Windows => "pbrt-v4's windows".into(),
        }
    }
}

/// The density of a sample: that of its own technique and that of the other, counts included.
pub type Heuristic = fn(F8, F8) -> F8;

pub fn balance(own: F8, other: F8) -> F8 {
    own + other
}

pub fn power(own: F8, other: F8) -> F8 {
    own + other * (other / own)
}

/// The density of samples from a number on, of which so many are of the first technique and of the second.
pub fn of_two(counts: [usize; 2], heuristic: Heuristic) -> impl Fn(usize, F8, F8) -> F8 {
    let [firsts, seconds] = counts.map(|count| F8::splat(count as f32));
    move |number, first, second| {
        let (first, second) = (first * firsts, second * seconds);
        let own = F8::new(std::array::from_fn(|i| f32::from(u8::from(number + i < counts[0]))));
        let of_first = wide::CmpGt::cmp_gt(own, F8::ZERO);
        of_first.blend(heuristic(first, second), heuristic(second, first))
    }
}

/// How many of `n` samples each of two techniques draws. A single one is one of each, as renderers have it: two rays and two
/// evaluations, which count as such. A coin between the two would be worse, and neither would be stratified over a pixel's hits.
pub fn halves(n: usize) -> [usize; 2] {
    [(n / 2).max(1), n - n / 2]
}

impl Sampler {
    /// Estimates by a peer.
    ///
    /// # Errors
    /// Those of the library, whose strata structured sampling takes.
    pub fn peer(
        &mut self,
        peer: Peer,
        setting: &Setting,
        point: &ShadingPoint,
        bsdf: &Bsdf,
        n: usize,
    ) -> client::Result<()> {
        match peer {
            Peer::Environment => self.environment(setting, bsdf, n),
            Peer::Brdf => self.bsdf(setting, bsdf, n),
            Peer::MisBalance => self.mis(setting.plain, balance, setting, bsdf, n),
            Peer::MisPower => self.mis(setting.plain, power, setting, bsdf, n),
            Peer::MisCompensated => self.mis(setting.compensated, balance, setting, bsdf, n),
            Peer::Ris(m, candidates) => self.resampled(m, candidates.texels(setting), setting, bsdf, n),
            Peer::Pool(k, candidates) => self.pooled(k, candidates.texels(setting), setting, bsdf, n),
            Peer::Structured => self.structured(setting, bsdf, n)?,
            Peer::Portals => {
                let portals = setting.room.map_or(&[][..], |room| &room.portals);
                self.portals(&Uniform::of(portals, point.origin), setting, bsdf, n)?;
            }
            Peer::Windows => {
                let windows = setting.room.map(|room| room.windows(point.origin)).unwrap_or_default();
                self.portals(&windows, setting, bsdf, n)?;
            }
        }
        Ok(())
    }

    fn environment(&mut self, setting: &Setting, bsdf: &Bsdf, n: usize) {
        self.batch.from_texels(setting.plain, setting.light, n);
        self.evaluate(setting, bsdf);
        self.batch.weigh(|_, light, _| light * F8::splat(n as f32));
        self.take_all();
    }

    fn bsdf(&mut self, setting: &Setting, bsdf: &Bsdf, n: usize) {
        self.batch.from_bsdf(bsdf, n);
        self.reflect(setting, bsdf);
        self.batch.weigh(|_, _, pdf| pdf * F8::splat(n as f32));
        self.take_all();
    }

    /// Half the samples from the light and half from the BRDF, as [`halves`] has it.
    pub fn mis(&mut self, texels: &Texels, heuristic: Heuristic, setting: &Setting, bsdf: &Bsdf, n: usize) {
        let counts = halves(n);
        self.batch.from_texels(texels, setting.light, counts[0]);
        self.batch.from_bsdf(bsdf, counts[1]);
        self.batch.evaluate(bsdf, setting.light, texels, setting.cost);
        self.batch.weigh(of_two(counts, heuristic));
        self.take_all();
    }

    /// RIS: each of `n` picks chooses among `m` candidates of its own, half from the light and half from the BRDF (Talbot et
    /// al. 2005).
    fn resampled(&mut self, m: usize, texels: &Texels, setting: &Setting, bsdf: &Bsdf, n: usize) {
        let half = m / 2;
        self.draw(texels, setting, bsdf, n * half, half);
        let Sampler { batch, picks, .. } = self;
        let choices = batch.points(Stream::Choice, n).to_vec();
        for (i, choice) in choices.iter().enumerate() {
            let groups = [i * half, (n + i) * half];
            let all = || groups.iter().flat_map(|&first| first..first + half);
            let sum: f32 = all().map(|c| batch.reflected(c)).sum();
            let mut rest = choice[0] * sum;
            let chosen = all().filter(|&c| batch.reflected(c) > 0.0).find(|&c| {
                rest -= batch.reflected(c);
                rest < 0.0
            });
            // Rounding may leave a little at the end: the last candidate then stands for it.
            if let Some(c) = chosen.or_else(|| all().rfind(|&c| batch.reflected(c) > 0.0)) {
                picks.push(Pick { wi: batch.wi().get(c), contribution: sum / n as f32 });
            }
        }
    }

    /// P(k): `n` picks from `k n` candidates; one that is picked several times is one ray.
    fn pooled(&mut self, k: usize, texels: &Texels, setting: &Setting, bsdf: &Bsdf, n: usize) {
        let half = n * k / 2;
        self.draw(texels, setting, bsdf, half, half);
        self.pick_along_curve(n);
    }

    /// Draws `count` candidates of each kind, `in_group` of which are weighed together.
    fn draw(&mut self, texels: &Texels, setting: &Setting, bsdf: &Bsdf, count: usize, in_group: usize) {
        self.batch.from_texels(texels, setting.light, count);
        self.batch.from_bsdf(bsdf, count);
        self.batch.evaluate(bsdf, setting.light, texels, setting.cost);
        let in_group = F8::splat(in_group as f32);
        self.batch.weigh(|_, pdf_light, pdf_bsdf| in_group * (pdf_light + pdf_bsdf));
    }

    /// Half of the portals and half of the BRDF; all of the BRDF where no portal is seen. Where portals are all, a sample of the BRDF that
    /// misses them needs no ray.
    fn portals<M: Measure>(
        &mut self,
        portals: &Portals<M>,
        setting: &Setting,
        bsdf: &Bsdf,
        n: usize,
    ) -> client::Result<()> {
        let is_complete = setting.room.is_some_and(|room| room.is_complete);
        match (portals.are_there(), is_complete) {
            (true, _) => self.density_mis(portals, balance, setting, bsdf, halves(n), is_complete)?,
            (false, false) => self.bsdf(setting, bsdf, n),
            (false, true) => (),
        }
        Ok(())
    }

    /// A sample in each stratum; their sum is the estimate.
    fn structured(&mut self, setting: &Setting, bsdf: &Bsdf, n: usize) -> client::Result<()> {
        let strata = setting.strata.of(n);
        self.batch.from_each(strata.count(), |i, u| strata.sample(i, u))?;
        self.reflect(setting, bsdf);
        self.batch.weigh_by_drawn(|_, pdf, _| pdf);
        self.take_all();
        Ok(())
    }
}
