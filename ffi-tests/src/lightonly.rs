//! Sampling by the light alone, and MIS with the BRDF, from three kinds of tables: those of wis_environment, the pyramid of
//! version 0.1, and a piecewise constant distribution as pbrt builds it. Everything else is the same for the three.

use crate::client::{self, Density, raw};
use crate::environment::{self, Environment};
use crate::estimator::{Sampler, Setting};
use crate::light::Light;
use crate::material::Bsdf;
use crate::piecewise::Piecewise;
use std::cell::RefCell;

/// A technique from a kind of tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightOnly {
    pub technique: Technique,
    pub source: Source,
}

/// How the light is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Technique {
    /// All samples from the light.
    Environment,
    /// Half from the light and half from the BRDF, by the balance heuristic.
    Mis,
    /// The same with the compensated light (Karlik et al. 2019).
    Compensated,
}

impl Technique {
    pub const ALL: [Technique; 3] = [Technique::Environment, Technique::Mis, Technique::Compensated];

    pub fn name(self) -> &'static str {
        match self {
            Technique::Environment => "environment",
            Technique::Mis => "MIS",
            Technique::Compensated => "compensated MIS",
        }
    }
}

/// Which tables the light stands in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// wis_environment.
    Tables,
    /// The light of version 0.1.
    Pyramid,
    /// pbrt's distribution.
    Piecewise,
}

impl Source {
    pub const ALL: [Source; 3] = [Source::Tables, Source::Pyramid, Source::Piecewise];

    pub fn name(self) -> &'static str {
        match self {
            Source::Tables => "wis",
            Source::Pyramid => "version 0.1",
            Source::Piecewise => "pbrt-like",
        }
    }
}

impl Source {
    /// Whether these tables can be sampled so: pyramids have no compensated light.
    pub fn has(self, technique: Technique) -> bool {
        technique != Technique::Compensated || self != Source::Pyramid
    }
}

impl LightOnly {
    /// Every technique from every kind of tables that has it.
    pub fn all() -> impl Iterator<Item = LightOnly> {
        let of = |technique| Source::ALL.map(|source| LightOnly { technique, source });
        let all = Technique::ALL.into_iter().flat_map(of);
        all.filter(|of| of.source.has(of.technique))
    }

    pub fn name(self) -> String {
        format!("{}, {}", self.technique.name(), self.source.name())
    }
}

/// The tables that a light is sampled from besides those of every setting.
pub struct Sources {
    compensated: Environment,
    piecewise: [Piecewise; 2],
}

impl Sources {
    /// # Errors
    /// Those of the library.
    pub fn new(light: &Light) -> client::Result<Sources> {
        let compensated = light.tables(raw::WIS_ENVIRONMENT_COMPENSATED, 0.0)?;
        Ok(Sources { compensated, piecewise: [Piecewise::plain(light), Piecewise::compensated(light)] })
    }
}

impl Sampler {
    /// Estimates by the light and the BRDF alone.
    ///
    /// # Errors
    /// Those of the library.
    ///
    /// # Panics
    /// If the setting was made without sources.
    pub fn light_only(
        &mut self,
        method: LightOnly,
        own: &RefCell<environment::Sampler>,
        (setting, bsdf): (&Setting, &Bsdf),
        n: usize,
    ) -> client::Result<()> {
        let sources = setting.sources.expect("a setting with sources");
        let compensated = method.technique == Technique::Compensated;
        let mut draw = |density: &dyn Density| match method.technique {
            Technique::Environment => self.density(density, setting, bsdf, n),
            Technique::Mis | Technique::Compensated => self.density_mis(density, setting, bsdf, n),
        };
        match method.source {
            Source::Tables => {
                let environment = if compensated { &sources.compensated } else { setting.tables };
                draw(&environment::Light::new(environment, own))
            }
            Source::Pyramid => draw(&setting.light.distribution(setting.environment)),
            Source::Piecewise => draw(&sources.piecewise[usize::from(compensated)]),
        }
    }
}
