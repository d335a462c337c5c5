//! A map in strata of the library's making, and the peer that draws a sample in each.

use crate::client::{self, Jitter, Map, Strata, Texels, raw};
use crate::light::Light;

/// Numbers of samples of the report, for which there are strata.
const COUNTS: [usize; 4] = [1, 4, 16, 64];

/// A lat-long light for the library, which takes its texels and matrix from here.
pub struct Source<'a> {
    pub light: &'a Light,
    world_from_map: [f32; 9],
}

impl<'a> Source<'a> {
    pub fn new(light: &'a Light) -> Source<'a> {
        Source { light, world_from_map: light.world_from_map() }
    }

    fn map(&self) -> Map<'a> {
        let [width, height] = self.light.size().map(|n| n as u32);
        let (filter, world_from_map) = (raw::WIS_FILTER_NEAREST, Some(self.world_from_map));
        let map = Map::latlong(width, height, 1, Texels::F32(self.light.luminance()));
        Map { filter, world_from_map, ..map }
    }

    /// The strata for a number of lights.
    ///
    /// # Errors
    /// Those of the library.
    pub fn strata(&self, count: u32) -> client::Result<Strata> {
        self.strata_by(&raw::wis_strata_config { count, ..Default::default() })
    }

    /// The strata of a config.
    ///
    /// # Errors
    /// Those of the library.
    pub fn strata_by(&self, config: &raw::wis_strata_config) -> client::Result<Strata> {
        Strata::new(&self.map(), config)
    }

    /// Places inside strata: `WIS_JITTER_*`.
    ///
    /// # Errors
    /// Those of the library.
    pub fn jitter(&self, strata: &Strata, distribution: u32) -> client::Result<Jitter> {
        strata.jitter(&self.map(), distribution)
    }
}

/// A map's strata for each number of samples of the report, with places inside: one sample a stratum by the light, as
/// unbiased as sampling by the light alone.
pub struct Stratified(Vec<Places>);

/// No more strata than samples.
pub struct Places {
    samples: usize,
    strata: Strata,
    jitter: Jitter,
}

impl Stratified {
    /// # Errors
    /// Those of the library.
    pub fn new(light: &Light) -> client::Result<Stratified> {
        let latlong = light.to_latlong(512);
        let source = Source::new(&latlong);
        let places = |samples: &usize| {
            let mut count = *samples as u32;
            let mut strata = source.strata(count)?;
            // Small bright regions may have got lights of their own.
            while strata.lights.len() > *samples && count > 1 {
                count -= 1;
                strata = source.strata(count)?;
            }
            let jitter = source.jitter(&strata, raw::WIS_JITTER_ENERGY)?;
            Ok(Places { samples: *samples, strata, jitter })
        };
        Ok(Stratified(COUNTS.iter().map(places).collect::<client::Result<_>>()?))
    }

    /// The strata for so many samples.
    ///
    /// # Panics
    /// The report has no such number.
    pub fn of(&self, samples: usize) -> &Places {
        self.0.iter().find(|places| places.samples == samples).expect("a number of samples of the report")
    }
}

impl Places {
    pub fn count(&self) -> usize {
        self.strata.lights.len()
    }

    /// A direction in a stratum, and its pdf there.
    ///
    /// # Errors
    /// Those of the library.
    pub fn sample(&self, stratum: usize, u: [f32; 2]) -> client::Result<([f32; 3], f32)> {
        self.jitter.sample(stratum as u32, u)
    }
}
