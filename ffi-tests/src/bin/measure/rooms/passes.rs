//! A room in passes of one ray, with a visibility cache, with portals, and with both.

use super::several::REFERENCES;
use crate::passes::page::PASSES;
use crate::passes::passes;
use anyhow::Result;
use std::path::Path;
use wis_ffi_tests::cost::MODELS;
use wis_ffi_tests::data;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::measure::Truth;
use wis_ffi_tests::reference::Reference;
use wis_ffi_tests::scene::{Scene, Stage, View, WINDOW};
use wis_ffi_tests::setting::{Lit, Setting};

/// Whether there is a cache, and whether there are portals.
pub const WAYS: [(&str, [bool; 2]); 4] = [
    ("neither", [false, false]),
    ("a visibility cache", [true, false]),
    ("a portal", [false, true]),
    ("both", [true, true]),
];

/// A light and a material.
pub struct Passes {
    /// Of each of `WAYS`: the mean squared error in both metrics.
    pub errors: [[f64; 2]; WAYS.len()],
    /// Nanoseconds for a point and a pass in each of `MODELS`.
    pub times: [[f64; MODELS.len()]; WAYS.len()],
}

/// Of the columns and rows that are rendered, every so many have a reference.
const KNOWN: u32 = 4;

pub fn measured(lights: &[Light], quick: bool) -> Result<Vec<Passes>> {
    let step = if quick { 12 } else { 2 };
    let stage = Stage::indoors(data::mesh("spot.obj")?, &[WINDOW]);
    let [scene, judged] = [step, KNOWN * step].map(|step| Scene::of("one window", &stage, View::Image(step)));
    let (scene, judged) = (scene?, judged?);
    let mut all = Vec::new();
    for light in lights.iter().take(2) {
        let lit = Lit::new(light)?;
        for material in [Material::lambert(), Material::ggx(0.2)] {
            let setting = Setting::new(&lit, &material);
            let name = format!("passes-{}-{}-{:x}.json", light.name, material.name, judged.fingerprint());
            let file = Path::new(REFERENCES).join(name.replace(' ', "_"));
            let truth = Truth::new(&Reference::cached(&file, &judged, &setting, 2048)?, 1);
            let mut of = Passes { errors: [[0.0; 2]; WAYS.len()], times: [[0.0; MODELS.len()]; WAYS.len()] };
            for (way, (_, with)) in WAYS.into_iter().enumerate() {
                for (model, (_, cost)) in MODELS.into_iter().enumerate() {
                    let (image, ns) = passes(&scene, &setting.at(cost), with, 0)?;
                    let places = scene.points.iter().zip(image);
                    let known = places.filter(|(place, _)| place.pixel.iter().all(|c| c % (KNOWN * step) == 0));
                    let errors = truth.errors(&known.map(|(_, value)| [value; 2]).collect::<Vec<_>>(), 0);
                    (of.errors[way], of.times[way][model]) = ([errors.absolute, errors.relative], ns);
                }
            }
            eprintln!("{PASSES} passes, {}, {}", light.name, material.name);
            all.push(of);
        }
    }
    Ok(all)
}
