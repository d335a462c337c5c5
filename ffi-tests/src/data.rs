//! The maps, meshes and BRDFs beside the project, which are never part of it; where one is missing, something of its kind
//! that is made here stands in for it.

use crate::cornell::Scattered;
use crate::light::Light;
use crate::material::Material;
use crate::mesh::Mesh;
use crate::reflectance::Reflectance;
use crate::rgl::Measured;
use crate::scene::{Scene, View};
use anyhow::Result;
use glam::{DVec3, Vec3};
use std::path::{Path, PathBuf};

/// The folder of the data.
const FOLDER: &str = "../shared/data";

/// Maps that the library was tuned on.
pub const DEVELOPER: [&str; 5] = [
    "studio_small_03_1k.hdr",
    "st_fagans_interior_1k.hdr",
    "venice_sunset_1k.hdr",
    "rooitou_park_1k.hdr",
    "forest_slope_1k.hdr",
];
/// Maps that it was not.
pub const OTHERS: [&str; 4] =
    ["adams_place_bridge_1k.hdr", "empty_warehouse_01_1k.hdr", "dikhololo_night_1k.hdr", "potsdamer_platz_1k.hdr"];

/// A file, if it is there.
pub fn file(kind: &str, name: &str) -> Option<PathBuf> {
    Some(Path::new(FOLDER).join(kind).join(name)).filter(|path| path.exists())
}

/// All files of a kind, in the order of their names.
pub fn files(kind: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(Path::new(FOLDER).join(kind)).into_iter().flatten();
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.sort();
    files
}

/// A map, or the room of the project's own.
///
/// # Errors
/// A map that cannot be read.
pub fn light(name: &str) -> Result<Light> {
    file("envmaps", name).map_or_else(|| Ok(Light::room(512)), |path| Light::load(&path))
}

/// The red, green and blue of a map, or the project's room three times.
///
/// # Errors
/// A map that cannot be read.
pub fn colours(name: &str) -> Result<[Light; 3]> {
    let room = || Ok([0; 3].map(|_| Light::room(512)));
    file("envmaps", name).map_or_else(room, |path| Light::load_channels(&path))
}

/// Those of the maps that are there, looked up bilinearly.
///
/// # Errors
/// A map that cannot be read.
pub fn lights(names: &[&str]) -> Result<Vec<Light>> {
    let paths = names.iter().filter_map(|name| file("envmaps", name));
    paths.map(|path| Ok(Light::load(&path)?.bilinear())).collect()
}

/// A mesh, or a block.
///
/// # Errors
/// A mesh that cannot be read.
pub fn mesh(name: &str) -> Result<Mesh> {
    let block = || Ok(Mesh::block(Vec3::new(-0.4, -0.3, 0.0), Vec3::new(0.4, 0.3, 0.9)));
    file("meshes", name).map_or_else(block, |path| Mesh::load(&path))
}

/// A mesh on a ground plane, or spheres and blocks.
///
/// # Errors
/// A mesh that cannot be read, or nothing is seen.
pub fn scene(name: &str, view: View) -> Result<Scene> {
    file("meshes", name).map_or_else(|| Scene::procedural(view), |path| Scene::from_file(&path, view))
}

/// A measured material, or a rough one.
///
/// # Errors
/// A file that cannot be read.
pub fn measured(name: &str) -> Result<Material> {
    file("brdfs", name).map_or_else(|| Ok(Material::ggx(0.3)), |path| Material::measured(&path))
}

/// BRDF x cosine for wo and wi in a frame whose normal is +z.
pub type Value = Box<dyn Fn(DVec3, DVec3) -> f64 + Sync>;

/// A BRDF of a file.
pub struct Brdf {
    pub name: String,
    /// Luminance.
    pub value: Value,
    /// Red, green and blue, where the file has them.
    pub channels: Option<[Value; 3]>,
}

/// All BRDFs that are there, in the order of their names, or a rough one.
///
/// # Errors
/// A file that cannot be read.
pub fn all_brdfs() -> Result<Vec<Brdf>> {
    let mut brdfs = Vec::new();
    for file in files("brdfs") {
        match file.extension().and_then(|extension| extension.to_str()) {
            Some("bsdf") => {
                let measured = Measured::load(&file)?;
                let name = measured.name.clone();
                let channel = |weights: [f64; 3]| -> Result<Value> {
                    let measured = Measured::load_weighed(&file, weights)?;
                    Ok(Box::new(move |wo, wi| measured.eval(wo, wi)))
                };
                let channels = [channel([1.0, 0.0, 0.0])?, channel([0.0, 1.0, 0.0])?, channel([0.0, 0.0, 1.0])?];
                let value: Value = Box::new(move |wo, wi| measured.eval(wo, wi));
                brdfs.push(Brdf { name, value, channels: Some(channels) });
            }
            Some("brdf") => {
                let measured = Scattered::load(&file)?;
                let name = measured.name.clone();
                brdfs.push(Brdf { name, value: Box::new(move |wo, wi| measured.eval(wo, wi)), channels: None });
            }
            _ => (),
        }
    }
    if brdfs.is_empty() {
        let phong = |wo: DVec3, wi: DVec3| {
            let mirror = DVec3::new(-wo.x, -wo.y, wo.z);
            if wi.z > 0.0 { mirror.dot(wi).max(0.0).powi(30) * wi.z } else { 0.0 }
        };
        brdfs.push(Brdf { name: "a lobe in place of files".into(), value: Box::new(phong), channels: None });
    }
    Ok(brdfs)
}
