//! Pictures at equal time, with error maps.

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
    MAPS.iter().map(|map| picture(&scene, map, bench)).collect()
}

fn picture(scene: &Scene, map: &str, bench: &Bench) -> Result<Part> {
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
    let truth: Vec<f64> = reference.values().iter().map(|v| v[0]).collect();
    let mean = truth.iter().sum::<f64>() / truth.len() as f64;
    let ns = |method: Method, count: usize| -> Result<f64> {
        Ok(time(scene, &setting, method, count, TIMED)?[0][MODEL].ns())
    };
    let direct = Method::Library(Mode::Direct);
    let budget = ns(direct, RAYS)?;
    let mut sheet = Sheet::new(4, 2, mean);
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
        let luminance = |rgb: &[f32; 3]| f64::from(0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]);
        let errors: Vec<f64> = picture
            .iter()
            .zip(&truth)
            .map(|(rgb, truth)| (luminance(rgb) - truth).abs() / (truth + 0.01 * mean))
            .collect();
        let squares = errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64;
        sheet.picture([column, 0], scene, &picture, &format!("{}, {count} rays", method.name()));
        sheet.errors([column, 1], scene, &errors, &format!("relative MSE {squares:.3}"));
    }
    let coloured = images::picture(scene, &setting, &colours, Method::Peer(Peer::MisCompensated), 2 * REFERENCE)?;
    sheet.picture([3, 0], scene, &coloured, "reference");
    sheet.legend([3, 1], "error / reference", ["0 %", "100 %"]);
    let caption = format!(
        "Equal time in the expensive cost model: {:.1} us per pixel, {}, {}. Below: error over reference, dark is good.",
        budget / 1e3,
        light.name,
        material.name
    );
    Ok(Part::Picture(file_name(&format!("{}-{}.png", scene.name, light.name)), sheet.png()?, caption))
}
