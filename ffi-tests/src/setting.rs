//! What the estimators share: the light and the material of a cell, the BRDF, the look-up of the light and the rays. The renderer's side of
//! each computes eight samples side by side.

use crate::batch::{Batch, Stream};
use crate::client;
use crate::cost::Cost;
use crate::dense::Grid;
use crate::earlier;
use crate::environment::Environment;
use crate::light::Light;
use crate::material::{Bsdf, Material};
use crate::pool::{Curve, Pick};
use crate::portal::Room;
use crate::scene::{Scene, ShadingPoint};
use crate::stratified::Stratified;
use crate::texels::Texels;
use glam::Vec3;

/// A light as the estimators need it.
pub struct Lit<'a> {
    pub light: &'a Light,
    /// The light in small tables.
    pub tables: Environment,
    /// As version 0.2 builds it, if that is there.
    pub earlier: Option<Environment>,
    pub plain: Texels,
    pub compensated: Texels,
    pub strata: Stratified,
    pub grid: Grid,
}

impl<'a> Lit<'a> {
    /// # Errors
    /// Those of the library.
    pub fn new(light: &'a Light) -> client::Result<Lit<'a>> {
        let (plain, compensated) = (Texels::plain(light), Texels::compensated(light));
        let strata = Stratified::new(light)?;
        let earlier = earlier::version().map(|version| light.mapped(0, 0.0, |map| Environment::by(version, map)));
        let (tables, earlier) = (light.tables(0, 0.0)?, earlier.transpose()?);
        Ok(Lit { light, tables, earlier, plain, compensated, strata, grid: Grid::new(light) })
    }
}

/// What the estimators of a report cell share.
#[derive(Clone, Copy)]
pub struct Setting<'a> {
    pub light: &'a Light,
    pub tables: &'a Environment,
    pub earlier: Option<&'a Environment>,
    pub material: &'a Material,
    pub plain: &'a Texels,
    pub compensated: &'a Texels,
    pub strata: &'a Stratified,
    pub grid: &'a Grid,
    /// The portals of the scene, if it has any.
    pub room: Option<&'a Room>,
    /// What the client spends besides.
    pub cost: Cost,
}

impl<'a> Setting<'a> {
    pub fn new(lit: &'a Lit<'a>, material: &'a Material) -> Setting<'a> {
        let Lit { light, tables, plain, compensated, strata, grid, .. } = lit;
        let earlier = lit.earlier.as_ref();
        let (room, cost) = (None, Cost::CHEAP);
        Setting { light, tables, earlier, material, plain, compensated, strata, grid, room, cost }
    }

    /// The same in a room.
    pub fn within(&self, room: Option<&'a Room>) -> Setting<'a> {
        Setting { room, ..*self }
    }

    /// The same at another cost.
    pub fn at(&self, cost: Cost) -> Setting<'a> {
        Setting { cost, ..*self }
    }
}

/// Samples on their way to picks.
#[derive(Default)]
pub struct Sampler {
    pub batch: Batch,
    pub picks: Vec<Pick>,
    curve: Curve,
}

impl Sampler {
    /// Evaluates BRDF, its pdf and radiance for all samples: all that a method needs that has a pdf of its own.
    pub fn reflect(&mut self, setting: &Setting, bsdf: &Bsdf) {
        self.batch.reflect(bsdf, setting.light, setting.plain, setting.cost);
    }

    /// The same and the pdf of the plain light.
    pub fn evaluate(&mut self, setting: &Setting, bsdf: &Bsdf) {
        self.batch.evaluate(bsdf, setting.light, setting.plain, setting.cost);
    }

    /// Picks every sample that adds something.
    pub fn take_all(&mut self) {
        let Sampler { batch, picks, .. } = self;
        picks.resize(batch.len(), Pick { wi: Vec3::ZERO, contribution: 0.0 });
        // Every sample is written and the place only moves on for those to keep: nothing to predict.
        let mut kept = 0;
        for i in 0..batch.len() {
            picks[kept] = Pick { wi: batch.wi().get(i), contribution: batch.reflected(i) };
            kept += usize::from(batch.reflected(i) > 0.0);
        }
        picks.truncate(kept);
    }

    /// Picks `n` of the weighed samples, spread along the Morton curve.
    pub fn pick_along_curve(&mut self, n: usize) {
        let offset = self.batch.points(Stream::Choice, 1)[0][0];
        self.curve.pick(&self.batch, n, offset, &mut self.picks);
    }
}

/// The sums of picks with and without shadows; rays are traced at a cost.
pub fn shadowed_and_not(scene: &Scene, cost: Cost, point: &ShadingPoint, picks: &[Pick]) -> [f64; 2] {
    picks.iter().fold([0.0; 2], |sum, pick| {
        let contribution = f64::from(pick.contribution);
        [sum[0] + if scene.visible_at(cost, point, pick.wi) { contribution } else { 0.0 }, sum[1] + contribution]
    })
}
