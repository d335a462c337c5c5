//! The maps, meshes and BRDFs beside the project, which are never part of it; where one is missing, something of its kind
//! that is made here stands in for it.

use crate::light::Light;
use crate::material::Material;
use crate::mesh::Mesh;
use crate::scene::{Scene, View};
use anyhow::Result;
use glam::Vec3;
use std::path::{Path, PathBuf};

/// The folder of the data.
pub const FOLDER: &str = "../shared/data";

fn file(kind: &str, name: &str) -> Option<PathBuf> {
    Some(Path::new(FOLDER).join(kind).join(name)).filter(|path| path.exists())
}

/// A map, or windows of a room.
///
/// # Errors
/// A map that cannot be read.
pub fn light(name: &str) -> Result<Light> {
    file("envmaps", name).map_or_else(|| Ok(Light::windows(512)), |path| Light::load(&path))
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
