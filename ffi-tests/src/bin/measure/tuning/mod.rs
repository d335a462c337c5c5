//! Chooses constants of the library anew from measurements on development maps alone, and writes a page.
//!
//! A value is built into a library of its own, from the sources of the last commit. Each has a process, and these take turns of less than
//! a second, so that what else the machine does meets all of them alike. What was measured is kept in `build/tuning`.
//!
//! The rule is in `page::RULE`. It was committed before the first run.

mod constants;
mod page;

use anyhow::{Context, Result, bail, ensure};
use clap::Parser;
use constants::{CONSTANTS, Constant};
use page::{Cell, MAPS};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use wis_ffi_tests::data::{self, lights};
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::measure::{Effort, Truth, rows};
use wis_ffi_tests::method::Method;
use wis_ffi_tests::reference::Reference;
use wis_ffi_tests::scene::{Scene, View};
use wis_ffi_tests::setting::{Lit, Setting};
use wis_ffi_tests::timing::time;

/// Shading points of single hits.
const POINTS: usize = 400;
/// Pixels of many hits.
const PIXELS: usize = 48;
/// Turns in which a process times a row.
const ROUNDS: usize = 5;
/// Pixels that are timed in a turn: single hits, and pixels with many.
const TIMED: [usize; 2] = [16, 8];
/// The most samples of each technique in half of a reference.
const MOST: usize = 16384;
const FOLDER: &str = "build/tuning";

/// Constants chosen on development maps alone.
#[derive(Parser)]
pub struct Options {
    /// Where the page goes
    file: PathBuf,
    /// Only constants whose name holds this
    #[arg(long, default_value = "")]
    only: String,
    /// Measures a constant with the library that is loaded, and writes its cells to the file
    #[arg(long, hide = true)]
    measure: Option<usize>,
    /// Times alone, no errors
    #[arg(long, hide = true)]
    times: bool,
}

/// Measures and writes the page.
///
/// # Errors
/// Those of the library, of files and of builds.
pub fn run(options: Options) -> Result<()> {
    if let Some(number) = options.measure {
        let cells = measure(&CONSTANTS[number], options.times)?;
        return Ok(std::fs::write(&options.file, serde_json::to_vec(&cells)?)?);
    }
    let sources = Sources::new()?;
    let mut measured = Vec::new();
    for (number, constant) in CONSTANTS.iter().enumerate().filter(|(_, c)| c.what.contains(&options.only)) {
        let libraries = constant.values.iter().map(|value| sources.library(constant, value));
        let libraries = libraries.collect::<Result<Vec<_>>>()?;
        measured.push((constant, measured_with(number, &libraries)?));
        page::page(&measured, &sources.commit)?.write_markdown(&options.file)?;
    }
    Ok(())
}

/// A copy of the sources, in which constants are changed.
struct Sources {
    folder: PathBuf,
    commit: String,
    /// Of what the library is built from.
    trees: String,
}

impl Sources {
    fn new() -> Result<Sources> {
        let folder = std::path::absolute(FOLDER)?.join("source");
        std::fs::create_dir_all(&folder)?;
        let mut archive = Command::new("git").args(["archive", "HEAD"]).stdout(Stdio::piped()).spawn()?;
        let files = archive.stdout.take().context("git archive")?;
        finish(Command::new("tar").arg("-x").arg("-C").arg(&folder).stdin(files))?;
        ensure!(archive.wait()?.success(), "git archive fails");
        let (commit, trees) = (git(&["--short", "HEAD"])?, git(&["HEAD:src", "HEAD:capi", "HEAD:Cargo.lock"])?);
        Ok(Sources { folder, commit, trees })
    }

    /// The folder of a library with a value of a constant.
    fn library(&self, constant: &Constant, value: &str) -> Result<PathBuf> {
        let changed = (value != constant.values[0]).then(|| constant.with(value));
        let library = self.folder.with_file_name(format!("{:016x}", hash(&(&self.trees, changed))));
        if library.exists() {
            return Ok(library);
        }
        eprintln!("{}: {value}", constant.what);
        let target = self.folder.with_file_name("target");
        constant.edit(&self.folder, constant.values[0], value)?;
        let built = finish(
            Command::new("cargo")
                .args(["build", "--quiet", "--release", "--package", "wis-capi", "--no-default-features"])
                .args(["--features", "lights wavelets avx2", "--target-dir"])
                .arg(&target)
                .current_dir(&self.folder)
                .env_remove("RUSTFLAGS"),
        );
        constant.edit(&self.folder, value, constant.values[0])?;
        built?;
        std::fs::create_dir_all(&library)?;
        // As make lib names it.
        let name = concat!("libwis.so.", env!("CARGO_PKG_VERSION_MAJOR"), ".", env!("CARGO_PKG_VERSION_MINOR"));
        std::fs::copy(target.join("release/libwis.so"), library.join(name))?;
        Ok(library)
    }
}

fn git(names: &[&str]) -> Result<String> {
    let output = Command::new("git").arg("rev-parse").args(names).output().context("git")?;
    ensure!(output.status.success(), "git rev-parse {names:?} fails");
    Ok(String::from_utf8_lossy(&output.stdout).trim().into())
}

fn finish(command: &mut Command) -> Result<()> {
    let status = command.status().with_context(|| format!("{command:?}"))?;
    ensure!(status.success(), "{command:?} fails");
    Ok(())
}

/// The cells of a constant with each library; the times are those of all processes.
fn measured_with(number: usize, libraries: &[PathBuf]) -> Result<Vec<Vec<Cell>>> {
    let mut all = together(number, libraries, 0)?;
    for process in 1..CONSTANTS[number].processes {
        for (cells, more) in all.iter_mut().zip(together(number, libraries, process)?) {
            let rows = cells.iter_mut().zip(more).flat_map(|(cell, more)| cell.times.iter_mut().zip(more.times));
            rows.for_each(|(times, more)| times.extend(more));
        }
    }
    Ok(all)
}

/// The cells of a constant with each library, from processes that take turns. Only the first measure errors.
fn together(number: usize, libraries: &[PathBuf], process: usize) -> Result<Vec<Vec<Cell>>> {
    let key = hash(&std::fs::read(std::env::current_exe()?)?);
    let name = format!("constant-{number}-{process}-{key:016x}.json");
    let files: Vec<PathBuf> = libraries.iter().map(|library| library.join(&name)).collect();
    if !files.iter().all(|file| file.exists()) {
        let program = std::env::current_exe()?;
        let mut processes = Vec::new();
        for (library, file) in libraries.iter().zip(&files) {
            let mut command = Command::new(&program);
            command
                .args(["tuning", "--measure", &number.to_string()])
                .args((process > 0).then_some("--times"))
                .arg(file)
                .env("LD_LIBRARY_PATH", library);
            processes.push(command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?);
        }
        let ends = |child: &mut Child| Some((child.stdin.take()?, BufReader::new(child.stdout.take()?)));
        let mut ends = processes.iter_mut().map(ends).collect::<Option<Vec<_>>>().context("a pipe")?;
        let mut line = String::new();
        let mut going = true;
        while going {
            for (turns, answers) in &mut ends {
                writeln!(turns)?;
                line.clear();
                going &= answers.read_line(&mut line)? > 0;
            }
        }
        drop(ends);
        for mut child in processes {
            ensure!(child.wait()?.success(), "a measurement of {} fails", CONSTANTS[number].what);
        }
    }
    files.iter().map(|file| Ok(serde_json::from_slice(&std::fs::read(file)?)?)).collect()
}

/// Ends this process's turn and waits for the next.
fn turn() -> Result<()> {
    println!();
    std::io::stdout().flush()?;
    std::io::stdin().read_line(&mut String::new())?;
    Ok(())
}

/// Measures the cells in which a constant acts.
fn measure(constant: &Constant, times_alone: bool) -> Result<Vec<Cell>> {
    std::io::stdin().read_line(&mut String::new())?;
    let mesh = Path::new(data::FOLDER).join("meshes/spot.obj");
    let many = usize::from(constant.hits > 1);
    let view = if many == 1 { View::Hits(PIXELS, constant.hits) } else { View::Points(POINTS) };
    let (scene, maps) = (Scene::from_file(&mesh, view)?, lights(&MAPS)?);
    if maps.len() != MAPS.len() {
        bail!("development maps are absent");
    }
    let (method, repeats) = (Method::from(constant.mode), if times_alone { 0 } else { constant.repeats });
    let mut cells = Vec::new();
    for light in &maps {
        let lit = Lit::new(light)?;
        for (material, counts) in (constant.cells)() {
            let setting = Setting::new(&lit, &material);
            let truth = Truth::new(&reference(&scene, light, &setting)?, scene.hits);
            let effort = Effort { methods: vec![method.name()], counts, repeats, timed: 1 };
            let rows = rows(&scene, &setting, &truth, std::iter::once(method), &effort)?;
            let mut times = Vec::new();
            for &count in &effort.counts {
                let mut rounds = Vec::new();
                for _ in 0..ROUNDS {
                    turn()?;
                    rounds.push(time(&scene, &setting, method, count, TIMED[many])?);
                }
                times.push(rounds);
            }
            cells.push(Cell { light: light.name.clone(), rows, times });
            turn()?;
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
