//! What is measured: groups of cells that answer one question each.

use anyhow::Result;
use clap::Parser;
use std::path::PathBuf;
use wis_ffi_tests::data;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::measure::Cell;
use wis_ffi_tests::mesh::Mesh;
use wis_ffi_tests::scene::{Scene, View};

/// Speed against error of wis and of other ways to sample an environment.
#[derive(Parser)]
pub struct Options {
    /// A few small cells, for a check that takes seconds
    #[arg(long)]
    pub quick: bool,
    /// A Radiance or OpenEXR map, lat-long or vertical cross; may be repeated
    #[arg(long)]
    pub map: Vec<PathBuf>,
    /// Where report.md goes with its plots, and cells.tsv with every number behind it
    #[arg(long, default_value = "report")]
    pub out: PathBuf,
    /// Also writes the page to this file, with its plots in a folder of its name
    #[arg(long)]
    pub docs: Option<PathBuf>,
    /// Where references and measured cells are kept
    #[arg(long, default_value = "build/report")]
    pub cache: PathBuf,
}

/// A group of cells: every light with every material, in one scene.
pub struct Study {
    pub name: &'static str,
    pub scene: Scene,
    pub bilinear: bool,
    pub lights: Vec<Light>,
    pub materials: Vec<Material>,
    pub counts: Vec<usize>,
    /// Pixels that are timed.
    pub timed: usize,
    /// Whether the limit is measured, too.
    pub limit: bool,
    /// The methods, if not all.
    pub only: &'static [&'static str],
    /// Repeats, in multiples of the usual number.
    pub repeats: u32,
}

/// The study of a mesh under every light with every lobe; the first screen is about it.
pub const MAIN: &str = "single hits";
/// The same for a client that looks up the nearest texel: goals of version 0.2 for errors were set there.
pub const NEAREST: &str = "nearest look-up";
/// 64 hits of each pixel.
pub const HITS: &str = "64 hits";
/// The same with a textured material.
pub const TEXTURED: &str = "64 hits, textured";
/// A dense mesh with interpolated normals.
pub const SMOOTH: &str = "smooth mesh";
/// A room with one window.
pub const ROOM: &str = "room";
/// Suns that are not clipped, with so many repeats that single cells can be judged.
pub const SUNS: &str = "unclipped suns";
/// Measured materials.
pub const MEASURED: &str = "measured BRDFs";
/// How names of materials begin that are made of lobes which the library knows.
const LOBES: [&str; 3] = ["Lambert", "GGX ", "mix "];

/// The unclipped sun of the project's own.
pub const SUN: &str = "unclipped sun";

/// Maps of the studies, if they are there. Which of them were used for tuning: `data::DEVELOPER`.
const MAPS: [&str; 7] = [
    "st_fagans_interior_1k.hdr",
    "rooitou_park_1k.hdr",
    "adams_place_bridge_1k.hdr",
    "forest_slope_1k.hdr",
    "galileo_cross.hdr",
    "potsdamer_platz_1k.hdr",
    "StageEnvLatLong.exr",
];
/// The maps of the smaller studies.
const FEWER: [&str; 3] = ["adams_place_bridge_1k", "galileo_cross", "StageEnvLatLong"];
const MEASURED_FILES: [&str; 2] = ["satin_rosaline_rgb.bsdf", "cc_iris_purple_gem_rgb.bsdf"];

/// All studies, or those whose names were asked for.
///
/// # Errors
/// A map or a mesh that cannot be read.
pub fn all(options: &Options) -> Result<Vec<Study>> {
    let points = if options.quick { 100 } else { 240 };
    let (lights, mut lobes) = (lights(options)?, Material::all());
    lobes.retain(|m| if options.quick { ["Lambert", "GGX 0.2"].contains(&&*m.name) } else { m.name != "GGX 0.01" });
    let broad: Vec<Material> =
        lobes.iter().filter(|m| !m.name.ends_with("0.5") && !m.name.ends_with("0.05")).cloned().collect();
    let spot = mesh(options, "spot.obj");
    let of_spot = |view| spot.as_ref().map_or_else(|| Scene::procedural(view), |path| Scene::from_file(path, view));
    let dense = mesh(options, "stanford-bunny.obj");
    let smooth = |view| dense.as_ref().map_or_else(|| Scene::procedural(view), |path| Scene::smooth(path, view));
    let inside =
        spot.as_ref().map_or_else(|| Ok(Mesh::sphere(glam::Vec3::Z * 0.4, 0.4, 32)), |path| Mesh::load(path))?;
    let study = |name, scene| -> Result<Study> {
        let (materials, lights, counts) = (lobes.clone(), lights.clone(), vec![1, 4, 16, 64]);
        Ok(Study {
            name,
            scene,
            bilinear: true,
            lights,
            materials,
            counts,
            timed: 6,
            limit: true,
            only: &[],
            repeats: 1,
        })
    };
    let small = |name, scene, materials: &[Material], counts: &[usize]| -> Result<Study> {
        let (lights, materials, counts) = (fewer(&lights), materials.to_vec(), counts.to_vec());
        Ok(Study { lights, materials, counts, timed: 5, limit: false, ..study(name, scene)? })
    };
    let suns = || -> Result<Study> {
        let all = study(SUNS, of_spot(View::Points(points))?)?;
        let lights = suns_among(&all.lights, options);
        let (counts, only) = (vec![4, 16], &["MIS compensated", "product", "product + MIS", "limit"]);
        Ok(Study { lights, counts, only, ..all })
    };
    if options.quick {
        let main = study(MAIN, of_spot(View::Points(points))?)?;
        return Ok(vec![Study { counts: vec![1, 16], timed: 4, ..main }, suns()?]);
    }
    let per_pixel = View::Hits(points.div_ceil(12), 64);
    let mut studies = vec![
        study(MAIN, of_spot(View::Points(points))?)?,
        Study {
            bilinear: false,
            counts: vec![4, 16],
            timed: 4,
            limit: false,
            ..study(NEAREST, of_spot(View::Points(points))?)?
        },
        small(HITS, of_spot(per_pixel)?, &lobes, &[1])?,
        small(TEXTURED, of_spot(per_pixel)?, &[Material::mix(0.1).textured(), Material::mix(0.3).textured()], &[1])?,
        small(SMOOTH, smooth(View::Points(points))?, &broad, &[1, 4, 16])?,
        small(ROOM, Scene::room(inside, View::Points(points))?, &broad, &[1, 4, 16])?,
        Study { timed: 48, repeats: 8, ..suns()? },
    ];
    let measured: Vec<PathBuf> = MEASURED_FILES.into_iter().filter_map(|name| data::file("brdfs", name)).collect();
    if measured.len() == MEASURED_FILES.len() {
        let materials = measured.iter().map(|path| Material::measured(path)).collect::<Result<Vec<_>>>()?;
        studies.push(small(MEASURED, of_spot(View::Points(points / 2))?, &materials, &[1, 4, 16])?);
    }
    Ok(studies)
}

/// Whether the library knows the lobes of a cell's material: of a measured one, they are a guess that bounds no weight.
pub fn has_known_lobes(cell: &Cell) -> bool {
    let name = cell.material.trim_start_matches("textured ");
    LOBES.iter().any(|kind| name.starts_with(kind))
}

/// The lights of the smaller studies: some of the usual ones by their names, and the first of others.
fn fewer(lights: &[Light]) -> Vec<Light> {
    let kept = |light: &&Light| light.name == SUN || FEWER.contains(&light.name.as_str());
    let named: Vec<Light> = lights.iter().filter(kept).cloned().collect();
    if lights.len() <= FEWER.len() || named.is_empty() {
        lights.iter().take(FEWER.len()).cloned().collect()
    } else {
        named
    }
}

/// The lights with a sun that is not clipped, or that of the project's own.
fn suns_among(lights: &[Light], options: &Options) -> Vec<Light> {
    let suns: Vec<Light> = lights.iter().filter(|light| is_sun(&light.name)).cloned().collect();
    if suns.is_empty() { vec![own_sun(options)] } else { suns }
}

/// Whether the light of this name has a sun that is not clipped.
pub fn is_sun(light: &str) -> bool {
    light == SUN || light.starts_with("rooitou")
}

/// A mesh of the data, if it is there.
fn mesh(options: &Options, name: &str) -> Option<PathBuf> {
    data::file("meshes", name).filter(|_| !options.quick)
}

fn lights(options: &Options) -> Result<Vec<Light>> {
    if !options.map.is_empty() {
        return options.map.iter().map(|path| Light::load(path)).collect();
    }
    let width = width(options);
    let maps = MAPS.into_iter().filter_map(|name| data::file("envmaps", name).filter(|_| !options.quick));
    let mut lights = maps.map(|map| Light::load(&map)).collect::<Result<Vec<_>>>()?;
    if lights.is_empty() {
        lights =
            if options.quick { vec![Light::windows(width)] } else { vec![Light::room(width), Light::field(width)] };
    }
    lights.push(own_sun(options));
    Ok(lights)
}

/// Texels in a row of a map that is made.
fn width(options: &Options) -> usize {
    if options.quick { 256 } else { 1024 }
}

fn own_sun(options: &Options) -> Light {
    let width = width(options);
    Light::unclipped(SUN, width, 2, [width / 10, width / 7])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(name: &str) -> Light {
        let mut light = Light::windows(16);
        light.name = name.into();
        light
    }

    /// Maps whose names no study knows leave none empty.
    #[test]
    fn other_maps_leave_no_study_empty() {
        let options = Options::parse_from(["report", "--quick"]);
        for count in [1, 3, 4, 9] {
            let lights: Vec<Light> = (0..count).map(|i| named(&format!("other {i}"))).collect();
            assert_eq!(fewer(&lights).len(), count.min(3));
            assert!(suns_among(&lights, &options).iter().all(|light| light.name == SUN));
        }
        let usual = ["forest_slope_1k", "rooitou_park_1k", "galileo_cross", "venice", SUN].map(named);
        assert_eq!((fewer(&usual).len(), suns_among(&usual, &options).len()), (2, 2));
    }
}
