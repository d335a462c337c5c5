//! How many candidates a call has.
//!
//! An image's squared error is the sum over its points, so candidates should be spread over points as their standard deviations are
//! (Neyman 1934): narrow lobes, which meet lamps, have the largest by far.

use super::candidates::{Counts, FEWEST};
use crate::brdf::surface::Surface;

/// The roughness below which a single ray has twice as many candidates, so that no contribution exceeds 50 integrals (rule 33). Of more rays, twice
/// as many took more time than variance they saved: with 4, one half has 1.3 (absolute) and 1.6 times (relative) the efficiency.
const NARROW: f32 = 0.15;
/// The roughness from which on a lobe is wide.
const WIDE: f32 = 0.25;
/// Candidates of each source for a ray under a compensated light.
const OF_LAMPS: usize = 2;
/// Candidates from portals for a ray, and in a call at the least. In rooms with one to four of them, three materials and six maps, variance is
/// then a hundredth of that of MIS with uniform samples of the portals; twice as many would halve what is left, and take 0.2 us for a ray.
const OF_PORTALS: usize = 8;
const OF_PORTALS_LEAST: usize = 16;
/// Candidates of each source for a ray where little of the light was seen: most of what more of them find is blocked. In rooms of one to four
/// openings, variance x time with 4 rays is then 0.7 (absolute) and 0.5 times as high (relative), and 0.9 and 0.6 times with expensive rays.
const OF_DARK: usize = 4;
/// From more rays on, fewer candidates for each suffice. With 16 rays, 4 have 1.0 (absolute) and 1.4 times (relative) the efficiency of 8 in the open
/// where rays are cheap, 0.9 and 1.2 times where they are expensive, and 1.2 to 1.4 and 1.4 to 1.7 times in rooms (docs/measurements/development.md).
const MANY: usize = 8;
/// The most candidates of a source in a call for which the library chooses their number.
pub const MOST: usize = 1024;

/// Candidates of each source for a ray, by the number of rays and the least roughness, [`f32::MAX`] if all lobes are diffuse. With 4 and 16 rays,
/// variance x time is lower than that of as many samples of a product, by 1.3 to 4 times where nothing blocks and 0.9 to 1.7 behind blockers.
fn per_ray(rays: usize, least: f32) -> usize {
    match rays {
        0..=1 if least < NARROW => 32,
        0..=1 => 8,
        2..=MANY if least < f32::MAX => 8,
        _ => 4,
    }
}

/// A power of two of candidates, whole lanes: a net that can be ordered.
fn rounded(candidates: usize) -> usize {
    candidates.next_power_of_two().max(FEWEST)
}

/// How many candidates a call has from each source.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Rays of the call.
    pub rays: usize,
    /// Candidates for each ray that the client wants; 0: the library's choice.
    pub wanted: usize,
    /// Whether rays bring only the radiance above the mean.
    pub compensated: bool,
    /// Whether a client's own target weighs candidates, which takes long.
    pub targeted: bool,
    /// Whether light comes through portals that the point sees.
    pub portals: bool,
    /// Whether earlier passes saw little of the light from there.
    pub dark: bool,
}

impl Effort {
    /// Those of a point.
    #[inline(always)]
    pub fn counts(&self, surface: &Surface) -> Counts {
        let counts = self.without_portals(surface);
        Counts { portals: if self.portals { self.of_portals(self.rays) } else { 0 }, ..counts }
    }

    /// Candidates from portals.
    fn of_portals(&self, rays: usize) -> usize {
        match self.wanted {
            0 => rounded(rays * OF_PORTALS).clamp(OF_PORTALS_LEAST, MOST),
            wanted => rounded((rays * wanted).div_ceil(2)),
        }
    }

    #[inline(always)]
    fn without_portals(&self, surface: &Surface) -> Counts {
        let &Effort { rays, wanted, compensated, targeted, dark, .. } = self;
        if wanted != 0 {
            let each = rounded((rays * wanted).div_ceil(2));
            return Counts { light: each, lobes: each, portals: 0 };
        }
        let least = surface.least_alpha();
        if compensated {
            // What is left of the light is lamps: they are found by drawing the light, however wide lobes reflect.
            let each = rounded(rays * OF_LAMPS).min(MOST);
            return Counts { light: each, lobes: if least < WIDE { each } else { 0 }, portals: 0 };
        }
        // A target or portals: the lobes do not tell how even the light is there.
        let least = if targeted { least.max(NARROW) } else { least };
        let least = if targeted || self.portals { least.min(1.0) } else { least };
        let each = rounded(rays * if dark { OF_DARK } else { per_ray(rays, least) }).min(MOST);
        Counts { light: each, lobes: each, portals: 0 }
    }

    /// The most candidates of any call for as many rays or fewer.
    pub fn most(&self) -> usize {
        let of = |rays: usize| {
            let wanted = if self.wanted == 0 { 2 * per_ray(rays, 0.0) } else { self.wanted };
            let each = rounded((rays * wanted).div_ceil(2));
            self.of_portals(rays) + 2 * if self.wanted == 0 { each.min(MOST) } else { each }
        };
        [1, self.rays.min(MANY), self.rays].into_iter().map(of).max().unwrap_or(0)
    }
}
