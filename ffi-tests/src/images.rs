//! Pictures of a scene by several estimators side by side: the image above, its error below.

use crate::client::Result;
use crate::cost::Cost;
use crate::estimator::{Estimator, Setting};
use crate::measure::shadowed_and_not;
use crate::method::Method;
use crate::reference::Reference;
use crate::scene::{HEIGHT, Scene, WIDTH};
use image::{GrayImage, Luma};

/// Pixels between neighbouring shading points: see `View::Image`.
pub const STEP: u32 = 2;
/// White between panels.
const GAP: u32 = 4;

/// The reference and some methods at a number of samples, from the left; errors below are |estimate - reference| over
/// the mean of the image, black 0 and white 1. Radiance is scaled to a mean of .4 and gamma-corrected.
///
/// # Errors
/// Those of the library.
pub fn sheet(
    scene: &Scene,
    setting: &Setting,
    reference: &Reference,
    methods: &[Method],
    count: usize,
) -> Result<GrayImage> {
    let truth: Vec<f64> = reference.values().iter().map(|v| v[0]).collect();
    let mut pictures = Vec::with_capacity(methods.len());
    for &method in methods {
        let mut estimator = Estimator::new(setting, scene.hits)?;
        let mut values = Vec::with_capacity(truth.len());
        for point in &scene.points {
            let picks = estimator.picks(method, setting, point, 0, count)?;
            values.push(shadowed_and_not(scene, Cost::CHEAP, point, picks)[0]);
        }
        pictures.push(values);
    }
    Ok(side_by_side(scene, &truth, &pictures, 1.0))
}

/// The truth and pictures of it, laid out and scaled as in [`sheet`], but errors `gain` times as bright.
pub fn side_by_side(scene: &Scene, truth: &[f64], pictures: &[Vec<f64>], gain: f64) -> GrayImage {
    let mean = truth.iter().sum::<f64>() / truth.len() as f64;
    let tone = |value: f64| (0.4 * value / mean).min(1.0).powf(1.0 / 2.2);
    let panel = [WIDTH / STEP, HEIGHT / STEP];
    let columns = pictures.len() as u32 + 1;
    let size = [columns * (panel[0] + GAP) - GAP, 2 * panel[1] + GAP];
    let mut sheet = GrayImage::from_pixel(size[0], size[1], Luma([255]));
    let mut draw = |column: u32, row: u32, values: &[f64]| {
        let origin = [column * (panel[0] + GAP), row * (panel[1] + GAP)];
        let pixels = (0..panel[1]).flat_map(|y| (0..panel[0]).map(move |x| [x, y]));
        pixels.for_each(|[x, y]| sheet.put_pixel(origin[0] + x, origin[1] + y, Luma([30])));
        for (point, value) in scene.points.iter().zip(values) {
            let grey = (255.0 * value).round() as u8;
            sheet.put_pixel(origin[0] + point.pixel[0] / STEP, origin[1] + point.pixel[1] / STEP, Luma([grey]));
        }
    };
    draw(0, 0, &truth.iter().map(|&v| tone(v)).collect::<Vec<_>>());
    for (column, values) in (1..).zip(pictures) {
        draw(column, 0, &values.iter().map(|&v| tone(v)).collect::<Vec<_>>());
        let errors = values.iter().zip(truth).map(|(v, t)| (gain * (v - t).abs() / mean).min(1.0));
        draw(column, 1, &errors.collect::<Vec<_>>());
    }
    sheet
}
