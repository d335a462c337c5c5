//! Environment sampling, MIS and compensated MIS at equal time, with the light from three kinds of tables and a client who
//! interpolates.

use anyhow::Result;
use std::path::Path;
use wis_ffi_tests::caches::CACHES;
use wis_ffi_tests::cost::MODELS;
use wis_ffi_tests::estimator::{Lit, Setting};
use wis_ffi_tests::light::Light;
use wis_ffi_tests::lightonly::{LightOnly, Source, Technique};
use wis_ffi_tests::material::Material;
use wis_ffi_tests::measure::{Effort, Errors, Repeat, Row, Truth, rows};
use wis_ffi_tests::method::Method;
use wis_ffi_tests::reference::Reference;
use wis_ffi_tests::scene::Scene;
use wis_ffi_tests::statistics::{quantile, splitmix};

/// What was measured under a light on a material.
pub struct Cell {
    pub light: String,
    pub is_sun: bool,
    pub material: String,
    pub disagreement: f64,
    rows: Vec<Row>,
}

/// Which of the errors counts.
pub type Metric = fn(&Errors) -> f64;

/// The mean squared errors that gains are counted in, by name.
pub const METRICS: [(&str, Metric); 2] = [("absolute", |e| e.absolute), ("relative", |e| e.relative)];

/// Measures the lights on the materials.
///
/// # Errors
/// Those of the library, and of the reference's files.
pub fn cells(
    scene: &Scene,
    lights: &[(Light, bool)],
    materials: &[Material],
    effort: &Effort,
    (cache, most): (&Path, usize),
) -> Result<Vec<Cell>> {
    let mut cells = Vec::new();
    for (light, is_sun) in lights {
        let pyramid = light.environment()?;
        let lit = Lit::new(light, &pyramid)?.with_sources()?;
        for material in materials {
            let setting = Setting::new(&lit, material);
            let name = format!(
                "light-{:016x}-{:016x}-{}-{most}.json",
                light.fingerprint(),
                scene.fingerprint(),
                material.name
            );
            let reference = Reference::to(0.003, &cache.join(name), scene, &setting, most)?;
            let truth = Truth::new(&reference, scene.hits);
            let rows = rows(scene, &setting, &truth, LightOnly::all().map(Method::Light), effort)?;
            let (light, material) = (light.name.clone(), material.name.clone());
            cells.push(Cell { light, is_sun: *is_sun, material, disagreement: reference.disagreement(), rows });
            eprintln!(
                "{} {}: {:.4}",
                cells[cells.len() - 1].light,
                cells[cells.len() - 1].material,
                reference.disagreement()
            );
        }
    }
    Ok(cells)
}

impl Cell {
    /// A method's row.
    pub fn row(&self, technique: Technique, source: Source, count: usize) -> &Row {
        let name = LightOnly { technique, source }.name();
        self.rows.iter().find(|row| row.method == name && row.count == count).expect("a row that was measured")
    }
}

/// Whose gain is meant: a technique with so many samples, against the same technique from other tables.
#[derive(Clone, Copy)]
pub struct Gain {
    pub technique: Technique,
    pub against: Source,
    pub metric: fn(&Errors) -> f64,
    /// Of `MODELS`.
    pub model: usize,
    /// Of `CACHES`.
    pub caches: usize,
}

impl Gain {
    /// Variance x time of the other tables over that of wis: the geometric mean over cells and counts, and its bootstrap
    /// interval of 95 % over repeats.
    pub fn over(&self, cells: &[&Cell], counts: &[usize]) -> [f64; 3] {
        let pairs: Vec<[&Row; 2]> = cells
            .iter()
            .flat_map(|cell| {
                let row = |source, count| cell.row(self.technique, source, count);
                counts.iter().map(move |&count| [row(self.against, count), row(Source::Tables, count)])
            })
            .collect();
        let mut state = 0x2545_f491_4f6c_dd1d;
        let mut resample = |repeats: &[Repeat], resampled: bool| {
            let value = |i: usize| (self.metric)(&repeats[i].errors[0]);
            let sum: f64 = (0..repeats.len())
                .map(|i| value(if resampled { (splitmix(&mut state) % repeats.len() as u64) as usize } else { i }))
                .sum();
            sum / repeats.len() as f64
        };
        let mut mean = |resampled: bool| {
            let logs = pairs.iter().map(|pair| {
                let [other, own] =
                    pair.map(|row| row.times[self.caches][self.model].ns() * resample(&row.repeats, resampled));
                (other / own).ln()
            });
            (logs.sum::<f64>() / pairs.len() as f64).exp()
        };
        let means: Vec<f64> = (0..400).map(|_| mean(true)).collect();
        [mean(false), quantile(&means, 0.025), quantile(&means, 0.975)]
    }
}

/// What a gain is counted in: a metric, a cost model and what is in the caches, of their lists.
pub type Scale = (String, fn(&Errors) -> f64, usize, usize);

/// All of them with their names.
pub fn scales() -> impl Iterator<Item = Scale> {
    let states = CACHES.iter().enumerate().flat_map(|state| MODELS.iter().enumerate().map(move |model| (state, model)));
    states.flat_map(|((caches, state), (model, (cost, _)))| {
        METRICS.map(|(name, metric)| (format!("{name}, {cost}, {state}"), metric, model, caches))
    })
}
