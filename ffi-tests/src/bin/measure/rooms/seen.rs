//! Rooms without portals whose visibility a cache has learnt, beside calls without a cache and MIS. Passes over an image teach the cache;
//! then calls of other seeds are judged one by one, so that MIS needs no passes of its own.

use super::renderer::Renderer;
use anyhow::Result;
use wis_ffi_tests::cost::MODELS;
use wis_ffi_tests::estimator::Estimator;
use wis_ffi_tests::measure::Truth;
use wis_ffi_tests::method::Method;
use wis_ffi_tests::peers::Peer;
use wis_ffi_tests::processor;
use wis_ffi_tests::scene::{Scene, ShadingPoint};
use wis_ffi_tests::setting::{Setting, shadowed_and_not};

/// What is compared, the first with the others.
pub const WAYS: [&str; 3] = ["MIS balance", "no cache", "a visibility cache"];
pub const RAYS: [usize; 3] = [1, 4, 16];
/// Every so many columns and rows of the view teach the cache.
pub const STEP: u32 = 4;
/// Passes that teach, of as many rays as are judged.
const PASSES: u32 = 4;
/// Repeats that are judged and timed, and those that are timed where rays are expensive: of few rays more, whose errors are heavy-tailed.
const REPEATS: [[u32; MODELS.len()]; RAYS.len()] = [[128, 8], [64, 4], [16, 4]];
/// Seeds of repeats are apart from those that taught.
const JUDGED: u32 = 100;

/// A scene, a light and a material.
pub struct Seen {
    pub is_closed: bool,
    /// For each of `RAYS` and `WAYS`: the mean squared error in both metrics.
    pub errors: [[[f64; 2]; WAYS.len()]; RAYS.len()],
    /// Processor time in each of `MODELS`: the least of all repeats.
    pub times: [[[f64; MODELS.len()]; WAYS.len()]; RAYS.len()],
}

pub fn measured(scene: &Scene, taught: &Scene, setting: &Setting, truth: &Truth) -> Result<Seen> {
    let (mut errors, mut times) =
        ([[[0.0; 2]; WAYS.len()]; RAYS.len()], [[[0.0; MODELS.len()]; WAYS.len()]; RAYS.len()]);
    for (number, rays) in RAYS.into_iter().enumerate() {
        let mut estimator = Estimator::new(setting, 1)?;
        let mis = |setting: &Setting, place: &ShadingPoint, repeat: u32| {
            let picks = estimator.picks(Method::Peer(Peer::MisBalance), setting, place, repeat, rays)?;
            Ok(shadowed_and_not(scene, setting.cost, place, picks)[0])
        };
        let mut bare = Renderer::new(setting, [false, false], rays)?;
        let mut learnt = Renderer::new(setting, [true, false], rays)?;
        for pass in 0..PASSES {
            for place in taught.points.iter().chain(&scene.points) {
                learnt.call(scene, setting, place, (0, pass))?;
            }
            learnt.end_pass()?;
        }
        let repeats = REPEATS[number];
        let found = [
            judged(scene, setting, truth, repeats, mis)?,
            judged(scene, setting, truth, repeats, |setting, place, repeat| {
                bare.call(scene, setting, place, (JUDGED + repeat, 0))
            })?,
            judged(scene, setting, truth, repeats, |setting, place, repeat| {
                learnt.call(scene, setting, place, (JUDGED + repeat, 0))
            })?,
        ];
        errors[number] = found.map(|of| of.0);
        times[number] = found.map(|of| of.1);
    }
    Ok(Seen { is_closed: scene.is_closed, errors, times })
}

/// Errors in both metrics, and times in each of `MODELS`.
fn judged(
    scene: &Scene,
    setting: &Setting,
    truth: &Truth,
    repeats: [u32; MODELS.len()],
    mut estimate: impl FnMut(&Setting, &ShadingPoint, u32) -> Result<f64>,
) -> Result<([f64; 2], [f64; MODELS.len()])> {
    let (mut errors, mut times) = ([0.0; 2], [f64::INFINITY; MODELS.len()]);
    for (model, (_, cost)) in MODELS.into_iter().enumerate() {
        let setting = setting.at(cost);
        for repeat in 0..repeats[model] {
            let begin = 1e9 * processor::seconds();
            let each = scene.points.iter().map(|place| Ok([estimate(&setting, place, repeat)?; 2]));
            let estimates = each.collect::<Result<Vec<_>>>()?;
            times[model] = f64::min(times[model], 1e9 * processor::seconds() - begin);
            if model == 0 {
                let found = truth.errors(&estimates, 0);
                errors = [errors[0] + found.absolute, errors[1] + found.relative];
            }
        }
    }
    Ok((errors, times))
}
