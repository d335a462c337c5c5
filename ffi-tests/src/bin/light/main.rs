//! Measures the light of wis_environment beside that of version 0.1 and a table as pbrt builds it: light <page>
//!
//! With --quick it measures little, writes the page, and fails if a goal is missed by far.

mod equal;
mod fit;
mod page;
mod size;
mod speed;

use anyhow::{Result, ensure};
use clap::Parser;
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use wis_ffi_tests::client::Density;
use wis_ffi_tests::data;
use wis_ffi_tests::environment;
use wis_ffi_tests::layout::Layout;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::measure::Effort;
use wis_ffi_tests::piecewise::Piecewise;
use wis_ffi_tests::scene::View;

/// The light beside version 0.1 and a table as pbrt builds it.
#[derive(Parser)]
struct Options {
    /// The page to write
    page: PathBuf,
    /// Little of everything, in seconds; fails if a goal is missed by far
    #[arg(long)]
    quick: bool,
    /// Measures times alone, and prints them
    #[arg(long)]
    times: bool,
    /// Where references are kept
    #[arg(long, default_value = "build/light")]
    cache: PathBuf,
}

/// All that stands on the page.
pub struct Results {
    pub quick: bool,
    pub fits: Vec<Fits>,
    /// For a bilinear client and for a nearest one.
    pub speeds: [Vec<speed::Speed>; 2],
    pub timed: String,
    pub sizes: Vec<size::Size>,
    pub budgets: Vec<size::Budget>,
    pub cells: Vec<equal::Cell>,
    pub counts: Vec<usize>,
    pub points: usize,
    pub repeats: u32,
}

/// A map's fits by wis, version 0.1 and pbrt's table.
pub struct Fits {
    pub light: String,
    pub bilinear: bool,
    pub each: Vec<fit::Fit>,
}

fn main() -> Result<()> {
    let options = Options::parse();
    let quick = options.quick;
    if options.times {
        return times();
    }
    let (lights, points) = if quick { (quick_lights(), 1 << 17) } else { (lights()?, 1 << 20) };
    let fits = fits(&lights, points)?;
    let timed = if quick { Light::room(512) } else { data::light("venice_sunset_1k.hdr")? };
    let rounds = if quick { 24 } else { 100 };
    let speeds = [timed.clone().bilinear(), timed.clone()].map(|light| speeds(&light, rounds));
    let [bilinear, nearest] = speeds;
    let widths: Vec<usize> = (6..=if quick { 10 } else { 14 }).map(|k| 1 << k).collect();
    let sizes = size::sizes(&widths)?;
    let room = if quick { Light::room(256) } else { Light::room(1024) };
    let smooth = [Light::sky(1024), room].map(Light::bilinear);
    let steps: &[f32] = if quick { &[0.01] } else { &[0.0, 0.003, 0.01, 0.03, 0.1] };
    let budgets = size::budgets(&smooth, steps, points / 4)?;
    let (counts, repeats) = if quick { (vec![4], 4) } else { (vec![1, 4, 16], 8) };
    let effort = Effort { methods: Vec::new(), counts: counts.clone(), repeats, timed: if quick { 4 } else { 16 } };
    let (shaded, materials) = shaded(quick)?;
    let scene = data::scene("spot.obj", View::Points(if quick { 60 } else { 150 }))?;
    let cells = equal::cells(&scene, &shaded, &materials, &effort, (&options.cache, if quick { 512 } else { 4096 }))?;
    let speeds = [bilinear?, nearest?];
    let timed = timed.name;
    let points = scene.points.len();
    let results = Results { quick, fits, speeds, timed, sizes, budgets, cells, counts, points, repeats };
    let written = page::write(&results)?;
    print!("{written}");
    if let Some(folder) = options.page.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::write(&options.page, written)?;
    if quick { check(&results) } else { Ok(()) }
}

fn times() -> Result<()> {
    let light = data::light("venice_sunset_1k.hdr")?;
    for light in [light.clone().bilinear(), light] {
        for speed in speeds(&light, 100)? {
            println!("{speed:.0?}");
        }
    }
    Ok(())
}

/// What even few samples on a busy machine must show.
fn check(results: &Results) -> Result<()> {
    for fits in &results.fits {
        let (deviation, maximum) = (fits.each[0].deviation(), fits.each[0].maximum);
        ensure!(deviation < 0.03 && maximum < 1.2, "{}: deviation {deviation}, largest {maximum}", fits.light);
    }
    let [own, pyramid] = [0, 1].map(|i| results.speeds[0][i].cold[0]);
    ensure!(own < 3.0 * pyramid, "a cold sample in 64 takes {own} ns, with version 0.1 {pyramid} ns");
    for size in results.sizes.iter().filter(|size| size.width == 1024) {
        ensure!(size.bytes <= 3_720_000, "a 1k map takes {} bytes", size.bytes);
        ensure!(size.build[0] < 150.0, "a 1k map is built in {} ms", size.build[0]);
    }
    for budget in results.budgets.iter().filter(|budget| budget.light == "sky") {
        ensure!(budget.bytes <= 40_960, "a smooth sky takes {} bytes", budget.bytes);
    }
    Ok(())
}

/// Every map that is there, and those of the project's own.
fn lights() -> Result<Vec<Light>> {
    let folder = Path::new(data::FOLDER).join("envmaps");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .map(|entries| entries.filter_map(|entry| Some(entry.ok()?.path())).collect())
        .unwrap_or_default();
    files.sort();
    let mut lights = Vec::new();
    for file in files {
        let light = Light::load(&file)?;
        // No client interpolates light probes: their light is taken as a lat-long map.
        lights.push(if light.layout() == Layout::Angular { light.to_latlong(512) } else { light });
    }
    lights.extend([Light::room(1024), Light::field(1024)]);
    lights.extend(suns(512));
    Ok(lights)
}

fn quick_lights() -> Vec<Light> {
    let mut lights = suns(256);
    lights.push(Light::room(256));
    lights
}

/// Unclipped suns of one and of four texels at the horizon, at the zenith and on the seam.
fn suns(width: usize) -> Vec<Light> {
    let places = [("horizon", [width / 3, width / 4]), ("zenith", [width / 5, 0]), ("seam", [width - 1, width / 6])];
    let sun = |(name, at), side| Light::unclipped(&format!("sun of {} at the {name}", side * side), width, side, at);
    places.into_iter().flat_map(|place| [1, 2].map(|side| sun(place, side))).collect()
}

/// Fits for clients who interpolate and for those who do not.
fn fits(lights: &[Light], points: usize) -> Result<Vec<Fits>> {
    let mut fits = Vec::new();
    for light in lights {
        for light in [light.clone().bilinear(), light.clone()] {
            let bilinear = light.is_bilinear();
            eprintln!("{}, {}", light.name, if bilinear { "bilinear" } else { "nearest" });
            let each = with_densities(&light, |densities| fit::fit(&light, densities, points))?;
            fits.push(Fits { light: light.name.clone(), bilinear, each });
        }
    }
    Ok(fits)
}

fn speeds(light: &Light, rounds: usize) -> Result<Vec<speed::Speed>> {
    with_densities(light, |densities| speed::speed(densities, rounds))
}

/// Hands out the light by wis, version 0.1 and pbrt's table.
fn with_densities<T>(light: &Light, run: impl FnOnce(&[&dyn Density]) -> Result<T>) -> Result<T> {
    let (tables, pyramid, piecewise) = (light.tables(0, 0.0)?, light.environment()?, Piecewise::plain(light));
    let sampler = RefCell::new(environment::Sampler::new(1, 0, 0)?);
    let own = environment::Light::new(&tables, &sampler);
    let pyramid = light.distribution(&pyramid);
    run(&[&own, &pyramid, &piecewise])
}

/// Lights, each with whether it has an unclipped sun, and materials.
type Shaded = (Vec<(Light, bool)>, Vec<Material>);

/// Lights that shade, and whether they are suns of a few texels; materials.
fn shaded(quick: bool) -> Result<Shaded> {
    let sun = |width| {
        let places = [("horizon", 1, [width / 3, width / 5]), ("seam", 2, [width - 1, width / 6])];
        let name = |side: usize, name: &str| format!("sun of {} near the {name}", side * side);
        places.map(|(place, side, at)| (Light::unclipped(&name(side, place), width, side, at).bilinear(), true))
    };
    if quick {
        return Ok((sun(256)[..1].to_vec(), vec![Material::lambert()]));
    }
    let maps =
        ["venice_sunset", "rooitou_park", "st_fagans_interior", "studio_small_03", "forest_slope", "potsdamer_platz"];
    let mut lights = Vec::new();
    for map in maps.map(|map| Path::new(data::FOLDER).join("envmaps").join(format!("{map}_1k.hdr"))) {
        if map.exists() {
            lights.push((Light::load(&map)?.bilinear(), false));
        }
    }
    lights.push((Light::room(1024).bilinear(), false));
    lights.extend(sun(512));
    lights.push((Light::field(1024).bilinear(), true));
    Ok((lights, vec![Material::lambert(), Material::ggx(0.2)]))
}
