//! Measures cells of scene, light and material, and writes a page with plots. Cells that were measured before with the
//! same programs are read from the cache, so a run that was stopped goes on where it was.

use anyhow::{Context, Result, bail};
use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;
use wis_ffi_tests::client::Environment;
use wis_ffi_tests::data;
use wis_ffi_tests::estimator::{Lit, Setting};
use wis_ffi_tests::library::Mode;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::measure::{Cell, Effort, measure};
use wis_ffi_tests::measured;
use wis_ffi_tests::method::{EXTENDED, Method};
use wis_ffi_tests::peers::{Candidates, Peer};
use wis_ffi_tests::reference::Reference;
use wis_ffi_tests::report::{BuiltLight, Run};
use wis_ffi_tests::scene::{Scene, View};
use wis_ffi_tests::{images, plot, report};

/// Speed against error of wis and of other ways to sample an environment.
#[derive(Parser)]
struct Options {
    /// Two small cells' worth of everything, for a check that takes less than two minutes
    #[arg(long)]
    quick: bool,
    /// A Radiance or OpenEXR map, lat-long or vertical cross; may be repeated
    #[arg(long)]
    map: Vec<PathBuf>,
    /// An OBJ or PLY mesh, y up; may be repeated
    #[arg(long)]
    mesh: Vec<PathBuf>,
    /// A material by its name (Lambert, "GGX 0.5", ...), or a measured one by its .bsdf or .brdf file; may be repeated
    #[arg(long)]
    material: Vec<String>,
    /// A peer by its name: "MIS balance", RIS8, "P(4)", ...; may be repeated
    #[arg(long)]
    peer: Vec<String>,
    /// Shading points in a scene
    #[arg(long)]
    points: Option<usize>,
    /// Where the page goes
    #[arg(long, default_value = "report")]
    out: PathBuf,
    /// Also writes a page without the sections of cells to this file, with the notes that stand beside it in
    /// report-notes.md and its pictures in report/
    #[arg(long)]
    docs: Option<PathBuf>,
    /// Where references and measured cells are kept
    #[arg(long, default_value = "build/report")]
    cache: PathBuf,
}

/// Maps and meshes that are measured if nothing else is asked for and they are there.
const MAPS: [&str; 7] = [
    "rooitou_park_1k.hdr",
    "studio_small_03_1k.hdr",
    "st_fagans_interior_1k.hdr",
    "venice_sunset_1k.hdr",
    "forest_slope_1k.hdr",
    "galileo_cross.hdr",
    "StageEnvLatLong.exr",
];
const MESH: &str = "spot.obj";

fn main() -> Result<()> {
    let options = Options::parse();
    let points = options.points.unwrap_or(if options.quick { 300 } else { 1000 });
    let (scenes, lights) = (scenes(&options, points)?, lights(&options)?);
    let (materials, effort) = (materials(&options)?, effort(&options)?);
    let progress = ProgressBar::new((scenes.len() * lights.len() * materials.len()) as u64);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} {elapsed} of {eta} left  {msg}")?);
    let bench = Bench { cache: options.cache.clone(), most: if options.quick { 4096 } else { 8192 }, effort };
    let (mut cells, mut built, mut pictures) = (Vec::new(), Vec::new(), Vec::new());
    for light in &lights {
        let (environment, description) = build(light)?;
        built.push(description);
        let lit = Lit::new(light, &environment)?;
        for (scene, material) in scenes.iter().flat_map(|s| materials.iter().map(move |m| (s, m))) {
            progress.set_message(format!("{}, {}, {}", scene.name, light.name, material.name));
            cells.push(bench.cell(scene, &Setting::new(&lit, material))?);
            progress.inc(1);
        }
        if let Some(material) = materials.last().filter(|m| !options.quick && m.measured.is_none()) {
            progress.set_message(format!("picture under {}", light.name));
            pictures.push(bench.picture(&picture_scene(&options)?, &Setting::new(&lit, material), &options.out)?);
        }
    }
    progress.finish_and_clear();
    let run = Run {
        machine: machine(),
        commit: commit(),
        command: std::env::args().collect::<Vec<_>>().join(" "),
        points,
        repeats: bench.effort.repeats,
        lights: built,
        pictures,
    };
    write(&options.out, &run, &cells)?;
    if let Some(file) = &options.docs {
        write_digest(file, &options.out, run, &cells)?;
    }
    check(&cells)
}

fn scenes(options: &Options, points: usize) -> Result<Vec<Scene>> {
    let mesh = Path::new(data::FOLDER).join("meshes").join(MESH);
    let meshes = match (options.mesh.is_empty(), options.quick || !mesh.exists()) {
        (false, _) => options.mesh.clone(),
        (true, true) => Vec::new(),
        (true, false) => vec![mesh],
    };
    Scene::of_report(&meshes, points, options.quick)
}

/// What pictures show: the first mesh.
fn picture_scene(options: &Options) -> Result<Scene> {
    picture_mesh(options, View::Image(images::STEP))
}

fn picture_mesh(options: &Options, view: View) -> Result<Scene> {
    let mesh = options.mesh.first().cloned().unwrap_or_else(|| Path::new(data::FOLDER).join("meshes").join(MESH));
    if mesh.exists() { Scene::from_file(&mesh, view) } else { Scene::procedural(view) }
}

fn lights(options: &Options) -> Result<Vec<Light>> {
    if !options.map.is_empty() {
        return options.map.iter().map(|path| Light::load(path)).collect();
    }
    let mut lights = vec![Light::sun(512)];
    if options.quick {
        lights.push(Light::windows(512));
    } else {
        let maps = MAPS.map(|name| Path::new(data::FOLDER).join("envmaps").join(name));
        let there: Vec<&PathBuf> = maps.iter().filter(|map| map.exists()).collect();
        if there.is_empty() {
            lights.extend([Light::room(512), Light::field(512)]);
        }
        for map in there {
            lights.push(Light::load(map)?);
        }
    }
    Ok(lights)
}

fn materials(options: &Options) -> Result<Vec<Material>> {
    let all = Material::all();
    let by_name = |name: &String| {
        if measured::is_file(name) {
            return Material::measured(Path::new(name));
        }
        let found = all.iter().find(|m| m.name.eq_ignore_ascii_case(name)).cloned();
        found.with_context(|| format!("no material {name}; there are {}", join(all.iter().map(|m| m.name.clone()))))
    };
    match (options.material.is_empty(), options.quick) {
        (false, _) => options.material.iter().map(by_name).collect(),
        (true, true) => Ok(vec![Material::lambert(), Material::ggx(0.2)]),
        (true, false) => Ok(all),
    }
}

fn effort(options: &Options) -> Result<Effort> {
    let peers = || EXTENDED.each.iter().map(|peer| peer.name());
    if let Some(name) = options.peer.iter().find(|name| !peers().any(|peer| peer.eq_ignore_ascii_case(name))) {
        bail!("no peer {name}; there are {}", join(peers()));
    }
    let asked = |m: &Method| {
        let named = |name: &String| name.eq_ignore_ascii_case(&m.name());
        !m.is_peer() || options.peer.is_empty() || options.peer.iter().any(named)
    };
    let methods = Method::all().filter(asked).map(Method::name).collect();
    let (counts, repeats, timed) = if options.quick { (vec![1, 16], 4, 8) } else { (vec![1, 4, 16, 64], 8, 64) };
    Ok(Effort { methods, counts, repeats, timed })
}

fn join(names: impl Iterator<Item = String>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

fn build(light: &Light) -> Result<(Environment, BuiltLight)> {
    let start = Instant::now();
    let environment = light.environment().with_context(|| format!("light {}", light.name))?;
    let milliseconds = start.elapsed().as_secs_f64() * 1e3;
    let bytes = environment.info.bytes as usize;
    let description = BuiltLight { name: light.name.clone(), texels: light.luminance().len(), milliseconds, bytes };
    Ok((environment, description))
}

/// How cells are measured and kept.
struct Bench {
    cache: PathBuf,
    /// The most samples of each technique in half of a reference.
    most: usize,
    effort: Effort,
}

impl Bench {
    fn cell(&self, scene: &Scene, setting: &Setting) -> Result<Cell> {
        // Measured materials are evaluated one by one, and slowly: no limit, and references of fewer samples.
        let measured = setting.material.measured.is_some();
        let most = if measured { self.most / 8 } else { self.most };
        let inputs = inputs(scene, setting, most);
        let file =
            self.cache.join(format!("cell-{:016x}.json", hash(&(inputs, format!("{:?}", self.effort), programs()?))));
        if let Some(stored) = std::fs::read(&file).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok()) {
            return Ok(stored);
        }
        let kept = self.cache.join(format!("reference-{inputs:016x}.json"));
        let reference = Reference::cached(&kept, scene, setting, most)?;
        // Where a pixel has many hits, each has one sample.
        let mut effort = self.effort.clone();
        if scene.hits > 1 {
            effort.counts = vec![1];
        }
        if measured {
            let limits: Vec<String> = Method::all().filter(|m| m.is_limit()).map(Method::name).collect();
            effort.methods.retain(|name| !limits.contains(name));
        }
        let cell = measure(scene, setting, &reference, &effort)?;
        std::fs::write(file, serde_json::to_vec(&cell)?)?;
        Ok(cell)
    }

    /// Draws estimates of 16 samples; answers the file's name and caption.
    fn picture(&self, scene: &Scene, setting: &Setting, folder: &Path) -> Result<(String, String)> {
        const METHODS: [Method; 4] = [
            Method::Peer(Peer::MisBalance),
            Method::Peer(Peer::MisCompensated),
            Method::Peer(Peer::Pool(4, Candidates::Plain)),
            Method::Library(Mode::Product),
        ];
        // Errors below the reference's own are not seen.
        let most = 512;
        let kept = self.cache.join(format!("reference-{:016x}.json", inputs(scene, setting, most)));
        let reference = Reference::cached(&kept, scene, setting, most)?;
        let (light, material) = (&setting.light.name, &setting.material.name);
        let file = file_name(&format!("{}-{light}-{material}.png", scene.name));
        std::fs::create_dir_all(folder)?;
        images::sheet(scene, setting, &reference, &METHODS, 16)?.save(folder.join(&file))?;
        let names = join(METHODS.into_iter().map(Method::name));
        Ok((file, format!("{}, {light}, {material}, 16 samples: reference, {names}; errors below.", scene.name)))
    }
}

/// Tells references apart.
fn inputs(scene: &Scene, setting: &Setting, most: usize) -> u64 {
    hash(&(scene.fingerprint(), setting.light.fingerprint(), format!("{:?}", setting.material), most))
}

/// Tells apart this program and the library that it runs with.
fn programs() -> Result<u64> {
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let library =
        maps.lines().filter_map(|line| line.split_whitespace().last()).find(|path| path.contains("libwis.so"));
    let library = library.context("libwis.so is not loaded")?;
    Ok(hash(&(std::fs::read(std::env::current_exe()?)?, std::fs::read(library)?)))
}

fn hash(value: &impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}

fn write(folder: &Path, run: &Run, cells: &[Cell]) -> Result<()> {
    std::fs::create_dir_all(folder)?;
    for cell in cells {
        plot::write(cell, &folder.join(plot_name(cell)))?;
    }
    let mut page = String::new();
    report::write(&mut page, run, cells, plot_name)?;
    let file = folder.join("report.md");
    std::fs::write(&file, page)?;
    println!("The report is {}", file.display());
    Ok(())
}

/// Writes the digest beside its notes, with three of the pictures.
fn write_digest(file: &Path, folder: &Path, run: Run, cells: &[Cell]) -> Result<()> {
    let beside = file.parent().unwrap_or(Path::new("."));
    let notes = std::fs::read_to_string(beside.join("report-notes.md")).unwrap_or_default();
    std::fs::create_dir_all(beside.join("report"))?;
    let mut pictures = run.pictures.clone();
    pictures.truncate(4);
    for (name, _) in &mut pictures {
        std::fs::copy(folder.join(&*name), beside.join("report").join(&*name))?;
        *name = format!("report/{name}");
    }
    let mut page = String::new();
    report::digest(&mut page, &Run { pictures, ..run }, cells, &notes)?;
    std::fs::write(file, page)?;
    Ok(())
}

fn plot_name(cell: &Cell) -> String {
    file_name(&format!("{}-{}-{}.svg", cell.scene, cell.light, cell.material))
}

fn file_name(name: &str) -> String {
    name.replace(|c: char| !c.is_ascii_alphanumeric() && !"-.".contains(c), "_")
}

fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find(|line| line.starts_with("model name")).and_then(|line| line.split(": ").nth(1));
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    format!("{}, {cores} cores, {}", model.unwrap_or("unknown processor"), std::env::consts::ARCH)
}

fn commit() -> String {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).output().ok().filter(|o| o.status.success())?;
        Some(String::from_utf8_lossy(&output.stdout).trim().to_string())
    };
    let changed = git(&["status", "--porcelain"]).is_some_and(|lines| !lines.is_empty());
    git(&["rev-parse", "--short", "HEAD"]).unwrap_or("unknown".into()) + if changed { ", with changes" } else { "" }
}

/// What a run must show whatever the times: every error is a number, and more samples help wis.
fn check(cells: &[Cell]) -> Result<()> {
    for cell in cells {
        let name = format!("{}, {}, {}", cell.scene, cell.light, cell.material);
        let errors = cell.rows.iter().flat_map(|row| &row.repeats).map(|repeat| repeat.errors[0]);
        if errors.into_iter().any(|e| !(e.absolute + e.relative + e.unshadowed).is_finite()) {
            bail!("{name}: an error is not finite");
        }
        let wis: Vec<_> = cell.rows.iter().filter(|row| row.method == "wis").collect();
        let unshadowed = wis.iter().map(|row| row.median(|r| r.errors[0].unshadowed)).collect::<Vec<_>>();
        if unshadowed.len() > 1 && unshadowed.first() <= unshadowed.last() {
            bail!("{name}: the error of wis does not fall: {unshadowed:?}");
        }
        if let Some(bound) = cell.costs.weight_bound.filter(|&bound| cell.costs.max_weight > bound) {
            bail!("{name}: f L / (p I) reaches {:.1}, more than {bound}", cell.costs.max_weight);
        }
    }
    Ok(())
}
