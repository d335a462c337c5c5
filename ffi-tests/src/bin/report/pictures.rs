//! Pictures at equal time, with error maps.

use crate::gains::METRICS;
use crate::{Bench, Options, data_file, file_name};
use anyhow::Result;
use wis_ffi_tests::data;
use wis_ffi_tests::estimator::{Lit, Setting};
use wis_ffi_tests::images::{self, Sheet};
use wis_ffi_tests::library::Mode;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::method::Method;
use wis_ffi_tests::page::Part;
use wis_ffi_tests::peers::Peer;
use wis_ffi_tests::scene::{Scene, View};
use wis_ffi_tests::timing::time;

/// The maps of the pictures.
const MAPS: [&str; 2] = ["adams_place_bridge_1k.hdr", "rooitou_park_1k.hdr"];
/// Rays of direct for a pixel.
const RAYS: usize = 4;
/// The cost model whose times are equal: the expensive one.
const MODEL: usize = 1;
/// Samples of each technique in half of a reference, and of the coloured reference.
const REFERENCE: usize = 256;
/// Pixels with a smaller share of visible light are judged apart: the umbra of rule 32.
const DARK: f64 = 0.05;
/// Pixels that are timed.
const TIMED: usize = 40;

/// A picture for each map.
///
/// # Errors
/// A file that cannot be read, or the library's.
pub fn all(options: &Options, bench: &Bench) -> Result<Vec<Part>> {
    let scene = match data_file("meshes", "spot.obj").or(options.mesh.clone()) {
        Some(path) => Scene::from_file(&path, View::Image(1))?,
        None => data::scene("spot.obj", View::Image(1))?,
    };
    let pictures = MAPS.iter().map(|map| picture(&scene, map, bench)).collect::<Result<Vec<_>>>()?;
    Ok(pictures.into_iter().flatten().collect())
}

/// The squared errors of a panel's pixels, relative to the mean of the truth or to each pixel's.
struct Panel {
    name: String,
    errors: [Vec<f64>; 2],
}

impl Panel {
    fn new(name: String, picture: &[[f32; 3]], truth: &[f64], mean: f64) -> Panel {
        let luminance = |rgb: &[f32; 3]| f64::from(0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]);
        let squares: Vec<f64> =
            picture.iter().zip(truth).map(|(rgb, truth)| (luminance(rgb) - truth).powi(2)).collect();
        let relative =
            squares.iter().zip(truth).map(|(square, truth)| square / (truth.powi(2) + (0.01 * mean).powi(2)));
        Panel { name, errors: [squares.iter().map(|square| square / mean.powi(2)).collect(), relative.collect()] }
    }

    /// The mean over the pixels that are kept.
    fn mean(&self, metric: usize, kept: &dyn Fn(usize) -> bool) -> f64 {
        let errors: Vec<f64> = self.errors[metric].iter().enumerate().filter(|(i, _)| kept(*i)).map(|e| *e.1).collect();
        errors.iter().sum::<f64>() / errors.len() as f64
    }
}

/// Where the library has the larger error, and what is left of that without pixels whose light is blocked.
fn verdict(own: &Panel, peers: &[Panel], visible: &[f64]) -> String {
    let (all, dark) = (|_: usize| true, |i: usize| visible[i] < DARK);
    let share = visible.iter().filter(|v| **v < DARK).count() as f64 / visible.len() as f64;
    let mut sentences = Vec::new();
    for (metric, (word, _)) in METRICS.iter().enumerate() {
        let ours = own.mean(metric, &all);
        let better: Vec<&Panel> = peers.iter().filter(|peer| peer.mean(metric, &all) < ours).collect();
        if better.is_empty() {
            continue;
        }
        let list = |kept: &dyn Fn(usize) -> bool| {
            let each = better.iter().map(|peer| format!("{:.3} ({})", peer.mean(metric, kept), peer.name));
            each.collect::<Vec<_>>().join(" and ")
        };
        let (held, lit) = (share * own.mean(metric, &dark) / ours, |i: usize| !dark(i));
        sentences.push(format!(
            "**{} has the larger {word} error: {ours:.3} against {}.** Pixels with less than {:.0} % visible light are {:.1} % of all and \
             hold {:.0} % of its error. Without them it is {:.3} against {}.",
            own.name,
            list(&all),
            100.0 * DARK,
            100.0 * share,
            if share > 0.0 { 100.0 * held } else { 0.0 },
            own.mean(metric, &lit),
            list(&lit)
        ));
    }
    if sentences.is_empty() {
        return format!("{} has the least error of all three in both metrics.", own.name);
    }
    sentences.join(" ")
}

fn picture(scene: &Scene, map: &str, bench: &Bench) -> Result<Vec<Part>> {
    let (light, colours) = match data_file("envmaps", map) {
        Some(path) => (Light::load(&path)?.bilinear(), Light::load_channels(&path)?.map(Light::bilinear)),
        None => {
            let room = Light::room(512).bilinear();
            (room.clone(), [room.clone(), room.clone(), room])
        }
    };
    let (environment, material) = (light.environment()?, Material::mix(0.1).textured());
    let lit = Lit::new(&light, &environment)?;
    let setting = Setting::new(&lit, &material);
    let reference = bench.reference(scene, &setting, REFERENCE)?;
    let (truth, visible): (Vec<f64>, Vec<f64>) = reference.values().iter().map(|v| (v[0], v[0] / v[1])).unzip();
    let mean = truth.iter().sum::<f64>() / truth.len() as f64;
    let ns = |method: Method, count: usize| -> Result<f64> {
        Ok(time(scene, &setting, method, count, TIMED)?[0][MODEL].ns())
    };
    let direct = Method::Library(Mode::Direct);
    let budget = ns(direct, RAYS)?;
    let (mut sheet, mut panels) = (Sheet::labelled(4, 2, mean), Vec::new());
    for (column, peer) in (0..).zip([Some(Peer::MisBalance), Some(Peer::MisCompensated), None]) {
        let method = peer.map_or(direct, Method::Peer);
        // What a sample more takes, from two measurements.
        let count = match peer {
            Some(_) => {
                let [few, many] = [ns(method, 4)?, ns(method, 16)?];
                (4.0 + (budget - few) / (many - few) * 12.0).round().max(1.0) as usize
            }
            None => RAYS,
        };
        let picture = images::picture(scene, &setting, &colours, method, count)?;
        let panel = Panel::new(method.name(), &picture, &truth, mean);
        let [absolute, relative] = [0, 1].map(|metric| panel.mean(metric, &|_| true));
        let errors: Vec<f64> = panel.errors[1].iter().map(|square| square.sqrt()).collect();
        sheet.picture([column, 0], scene, &picture, &format!("{}\n{count} rays", method.name()));
        sheet.errors([column, 1], scene, &errors, &format!("absolute MSE {absolute:.4}\nrelative MSE {relative:.4}"));
        panels.push(panel);
    }
    let (own, peers) = panels.split_last().expect("three panels");
    let verdict = verdict(own, peers, &visible);
    let coloured = images::picture(scene, &setting, &colours, Method::Peer(Peer::MisCompensated), 2 * REFERENCE)?;
    sheet.picture([3, 0], scene, &coloured, "reference");
    sheet.legend([3, 1], "error / reference", ["0 %", "100 %"]);
    let caption = format!(
        "Equal time in the expensive cost model: {:.1} us per pixel, {}, {}. Below: relative error of each pixel, dark is good.",
        budget / 1e3,
        light.name,
        material.name
    );
    let file = file_name(&format!("{}-{}.png", scene.name, light.name));
    Ok(vec![Part::Picture(file, sheet.png()?, caption), Part::Text(verdict)])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two of four pixels are dark: the library's errors there are all that makes it worse.
    #[test]
    fn a_larger_error_is_told_with_and_without_dark_pixels() {
        let panel = |name: &str, dark: f64, lit: f64| {
            let errors = vec![dark, lit, lit, dark];
            Panel { name: name.into(), errors: [vec![0.0; 4], errors] }
        };
        let (own, peer) = (panel("direct", 0.9, 0.1), panel("MIS balance", 0.2, 0.2));
        let text = verdict(&own, &[peer], &[0.0, 1.0, 1.0, 0.04]);
        assert!(text.contains("larger relative error: 0.500 against 0.200 (MIS balance)"), "{text}");
        assert!(text.contains("50.0 % of all and hold 90 % of its error"), "{text}");
        assert!(text.contains("Without them it is 0.100 against 0.200"), "{text}");
        let better = panel("direct", 0.1, 0.1);
        assert!(verdict(&better, &[panel("MIS balance", 0.2, 0.2)], &[1.0; 4]).contains("least error"));
    }
}
