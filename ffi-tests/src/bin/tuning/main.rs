//! Chooses constants of the library anew from measurements on development maps alone, and writes a page: tuning <file>
//!
//! A value is built into a library of its own, from the sources of the last commit. Libraries are loaded one after the other, in several
//! rounds, so that what else the machine does meets all of them. What was measured is kept in `build/tuning`.
//!
//! The rule is in `page::RULE`. It was committed before the first run.

mod constants;
mod page;

use anyhow::{Context, Result, bail, ensure};
use clap::Parser;
use constants::{CONSTANTS, Constant};
use serde::{Deserialize, Serialize};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use wis_ffi_tests::data;
use wis_ffi_tests::estimator::{Lit, Setting};
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::measure::{Effort, Row, Truth, rows};
use wis_ffi_tests::method::Method;
use wis_ffi_tests::products::lights;
use wis_ffi_tests::reference::Reference;
use wis_ffi_tests::scene::{Scene, View};

/// The development maps. `forest_slope`, which older constants were tuned on, too, is not among them.
const MAPS: [&str; 4] =
    ["st_fagans_interior_1k.hdr", "studio_small_03_1k.hdr", "venice_sunset_1k.hdr", "rooitou_park_1k.hdr"];
/// Shading points of single hits.
const POINTS: usize = 400;
/// Pixels of many hits.
const PIXELS: usize = 48;
/// Independent repeats of single hits, and of pixels with many.
const REPEATS: [u32; 2] = [64, 64];
/// Rounds in which times are taken.
const ROUNDS: u32 = 3;
/// Pixels that are timed in a round: single hits, and pixels with many.
const TIMED: [usize; 2] = [24, 8];
/// The most samples of each technique in half of a reference.
const MOST: usize = 16384;
const FOLDER: &str = "build/tuning";

/// Constants chosen on development maps alone.
#[derive(Parser)]
struct Options {
    /// Where the page goes
    file: PathBuf,
    /// Only constants whose name holds this
    #[arg(long, default_value = "")]
    only: String,
    /// Measures a constant with the library that is loaded, and writes its cells to the file
    #[arg(long, hide = true)]
    measure: Option<usize>,
    /// The round of the measurement: errors are measured in the first alone
    #[arg(long, hide = true, default_value_t = 0)]
    round: u32,
}

/// What was measured on one map and material.
#[derive(Serialize, Deserialize)]
pub struct Cell {
    pub light: String,
    pub material: String,
    pub rows: Vec<Row>,
}

/// The rounds of a value.
pub type Rounds = Vec<Vec<Cell>>;

fn main() -> Result<()> {
    let options = Options::parse();
    if let Some(number) = options.measure {
        let cells = measure(&CONSTANTS[number], options.round)?;
        return Ok(std::fs::write(&options.file, serde_json::to_vec(&cells)?)?);
    }
    let sources = Sources::new()?;
    let mut measured = Vec::new();
    for (number, constant) in CONSTANTS.iter().enumerate().filter(|(_, c)| c.what.contains(&options.only)) {
        let libraries = constant.values.iter().map(|value| sources.library(constant, value));
        let libraries = libraries.collect::<Result<Vec<_>>>()?;
        let mut values: Vec<Rounds> = libraries.iter().map(|_| Vec::new()).collect();
        for round in 0..ROUNDS {
            for (library, rounds) in libraries.iter().zip(&mut values) {
                rounds.push(cells(number, library, round)?);
            }
        }
        measured.push((constant, values));
        std::fs::write(&options.file, page::page(&measured, &sources.commit)?)?;
    }
    Ok(())
}

/// A copy of the sources, in which constants are changed.
struct Sources {
    folder: PathBuf,
    commit: String,
}

impl Sources {
    fn new() -> Result<Sources> {
        let folder = std::path::absolute(FOLDER)?.join("source");
        std::fs::create_dir_all(&folder)?;
        let commit = Command::new("git").args(["rev-parse", "--short", "HEAD"]).output().context("git")?;
        let mut archive = Command::new("git").args(["archive", "HEAD"]).stdout(Stdio::piped()).spawn()?;
        let files = archive.stdout.take().context("git archive")?;
        run(Command::new("tar").arg("-x").arg("-C").arg(&folder).stdin(files))?;
        ensure!(archive.wait()?.success(), "git archive fails");
        Ok(Sources { folder, commit: String::from_utf8_lossy(&commit.stdout).trim().into() })
    }

    /// The folder of a library with a value of a constant.
    fn library(&self, constant: &Constant, value: &str) -> Result<PathBuf> {
        let changed = (value != constant.values[0]).then(|| constant.with(value));
        let library = self.folder.with_file_name(format!("{:016x}", hash(&(&self.commit, changed))));
        if library.exists() {
            return Ok(library);
        }
        eprintln!("{}: {value}", constant.what);
        let target = self.folder.with_file_name("target");
        constant.edit(&self.folder, constant.values[0], value)?;
        let built = run(Command::new("cargo")
            .args(["build", "--quiet", "--release", "--package", "wis-capi", "--no-default-features"])
            .args(["--features", "lights wavelets avx2", "--target-dir"])
            .arg(&target)
            .current_dir(&self.folder)
            .env_remove("RUSTFLAGS"));
        constant.edit(&self.folder, value, constant.values[0])?;
        built?;
        std::fs::create_dir_all(&library)?;
        // As make lib names it.
        let name = concat!("libwis.so.", env!("CARGO_PKG_VERSION_MAJOR"), ".", env!("CARGO_PKG_VERSION_MINOR"));
        std::fs::copy(target.join("release/libwis.so"), library.join(name))?;
        Ok(library)
    }
}

fn run(command: &mut Command) -> Result<()> {
    let status = command.status().with_context(|| format!("{command:?}"))?;
    ensure!(status.success(), "{command:?} fails");
    Ok(())
}

/// The cells of a round, from a process that loads the library.
fn cells(number: usize, library: &Path, round: u32) -> Result<Vec<Cell>> {
    let file = library.join(format!("constant-{number}-round-{round}.json"));
    if !file.exists() {
        let (number, round) = (number.to_string(), round.to_string());
        let program = std::env::current_exe()?;
        eprintln!("{}, round {round}", library.display());
        run(Command::new(program)
            .args(["--measure", &number, "--round", &round])
            .arg(&file)
            .env("LD_LIBRARY_PATH", library))?;
    }
    Ok(serde_json::from_slice(&std::fs::read(file)?)?)
}

/// Measures the cells in which a constant acts.
fn measure(constant: &Constant, round: u32) -> Result<Vec<Cell>> {
    let mesh = Path::new(data::FOLDER).join("meshes/spot.obj");
    let many = usize::from(constant.hits > 1);
    let view = if many == 1 { View::Hits(PIXELS, constant.hits) } else { View::Points(POINTS) };
    let (scene, maps) = (Scene::from_file(&mesh, view)?, lights(&MAPS)?);
    if maps.len() != MAPS.len() {
        bail!("development maps are absent");
    }
    let repeats = if round == 0 { REPEATS[many] } else { 0 };
    let mut cells = Vec::new();
    for light in &maps {
        let environment = light.environment()?;
        let lit = Lit::new(light, &environment)?;
        for (material, counts) in (constant.cells)() {
            let setting = Setting::new(&lit, &material);
            let truth = Truth::new(&reference(&scene, light, &setting)?, scene.hits);
            let method = Method::from(constant.mode);
            let effort = Effort { methods: vec![method.name()], counts, repeats, timed: TIMED[many] };
            let rows = rows(&scene, &setting, &truth, std::iter::once(method), &effort)?;
            cells.push(Cell { light: light.name.clone(), material: material.name.clone(), rows });
        }
    }
    Ok(cells)
}

fn reference(scene: &Scene, light: &Light, setting: &Setting) -> Result<Reference> {
    let material: &Material = setting.material;
    let key = hash(&(scene.fingerprint(), light.fingerprint(), format!("{material:?}"), MOST));
    let file = Path::new(FOLDER).join(format!("reference-{key:016x}.json"));
    Reference::cached(&file, scene, setting, MOST)
}

fn hash(value: &impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}
