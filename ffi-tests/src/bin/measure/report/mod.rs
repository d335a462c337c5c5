//! Measures how well the library samples beside other ways, and writes a page with tables, plots and pictures. Cells that were
//! measured before with the same programs are read from the cache, so a run that was stopped goes on where it was.

pub mod gains;
mod goals;
mod losses;
mod plots;
mod studies;
pub mod tables;

pub use self::studies::Options;
use self::tables::Run;
use anyhow::{Context, Result, bail, ensure};
use indicatif::{ProgressBar, ProgressStyle};
use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;
use studies::Study;
use wis_ffi_tests::caches::CACHES;
use wis_ffi_tests::measure::{Cell, Effort, measure};
use wis_ffi_tests::method::Method;
use wis_ffi_tests::page;
use wis_ffi_tests::portal::Room;
use wis_ffi_tests::reference::Reference;
use wis_ffi_tests::scene::Scene;
use wis_ffi_tests::setting::{Lit, Setting};

/// Measures and writes the page.
///
/// # Errors
/// Those of the library, of files, and what a run must show.
pub fn run(options: Options) -> Result<()> {
    let studies = studies::all(&options)?;
    let (repeats, most) = if options.quick { (4, 1024) } else { (8, 4096) };
    let bench = Bench { cache: options.cache.clone(), most, repeats };
    let count = studies.iter().map(|study| study.lights.len() * study.materials.len()).sum::<usize>();
    let progress = ProgressBar::new(count as u64);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} {elapsed} of {eta} left  {msg}")?);
    let mut cells = Vec::new();
    for study in &studies {
        cells.extend(bench.study(study, &progress)?);
    }
    progress.finish_and_clear();
    let goals = goals::Measured::new(&studies, options.quick)?;
    let run = Run {
        machine: machine(),
        commit: page::commit(),
        command: std::env::args().skip(1).collect::<Vec<_>>().join(" "),
        made_from: page::made_from("report")?,
        points: studies[0].scene.points.len(),
        repeats,
    };
    let (suns, cells): (Vec<_>, Vec<_>) = cells.into_iter().partition(|cell| cell.study == studies::SUNS);
    let page = tables::page(&run, &cells, &suns, &goals)?;
    page.write(&options.out.join("report.md"))?;
    std::fs::write(options.out.join("cells.tsv"), tables::cells(&cells.iter().chain(&suns).collect::<Vec<_>>()))?;
    options.docs.as_ref().map_or(Ok(()), |file| page.write(file))?;
    check(&cells)?;
    check(&suns)
}

/// How cells are measured and kept.
pub struct Bench {
    cache: PathBuf,
    /// The most samples of each technique in half of a reference.
    most: usize,
    repeats: u32,
}

impl Bench {
    fn study(&self, study: &Study, progress: &ProgressBar) -> Result<Vec<Cell>> {
        let mut cells = Vec::new();
        for light in &study.lights {
            let light = if study.bilinear { light.clone().bilinear() } else { light.clone() };
            let lit = Lit::new(&light).with_context(|| format!("light {}", light.name))?;
            let room = Room::new(&study.scene.portals, study.scene.is_closed, &light);
            for material in &study.materials {
                progress.set_message(format!("{}, {}, {}", study.name, light.name, material.name));
                let setting = Setting::new(&lit, material).within(room.as_ref());
                cells.push(self.cell(study, &setting)?);
                progress.inc(1);
            }
        }
        Ok(cells)
    }

    fn cell(&self, study: &Study, setting: &Setting) -> Result<Cell> {
        let (measured, most) = (setting.material.measured.is_some(), self.most_of(setting));
        let is_shared = study.scene.hits > 1;
        let kept = |m: &Method| {
            (study.limit && !measured || !m.is_limit())
                && m.mode().is_none_or(|mode| mode.differs(is_shared, measured))
                && (setting.room.is_some() || !m.is_of_rooms())
        };
        let named = |name: &String| study.only.is_empty() || study.only.contains(&name.as_str());
        let methods = Method::all().filter(kept).map(Method::name).filter(named).collect();
        let (counts, repeats) = (study.counts.clone(), self.repeats * study.repeats);
        let effort = Effort { methods, counts, repeats, timed: study.timed, caches: CACHES.len() };
        let inputs = inputs(&study.scene, setting, most);
        let key = hash(&(study.name, inputs, format!("{effort:?}"), programs()?));
        let file = self.cache.join(format!("cell-{key:016x}.json"));
        if let Some(stored) = std::fs::read(&file).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok()) {
            return Ok(stored);
        }
        let reference = self.reference(&study.scene, setting, most)?;
        let cell = measure(study.name, &study.scene, setting, &reference, &effort)?;
        std::fs::write(file, serde_json::to_vec(&cell)?)?;
        Ok(cell)
    }

    /// Measured materials take longer to evaluate.
    fn most_of(&self, setting: &Setting) -> usize {
        if setting.material.measured.is_some() { self.most / 8 } else { self.most }
    }

    pub fn reference(&self, scene: &Scene, setting: &Setting, most: usize) -> Result<Reference> {
        let file = self.cache.join(format!("reference-{:016x}.json", inputs(scene, setting, most)));
        Reference::cached(&file, scene, setting, most)
    }
}

/// Tells references apart.
fn inputs(scene: &Scene, setting: &Setting, most: usize) -> u64 {
    hash(&(scene.fingerprint(), setting.light.fingerprint(), format!("{:?}", setting.material), most))
}

/// Tells apart this program and the libraries that it runs with: this version's, and 0.2's once it is loaded, in any order.
fn programs() -> Result<u64> {
    let maps = std::fs::read_to_string("/proc/self/maps")?;
    let paths = maps.lines().filter_map(|line| line.split_whitespace().last());
    let libraries: BTreeSet<&str> = paths.filter(|path| path.contains("libwis.so")).collect();
    ensure!(!libraries.is_empty(), "libwis.so is not loaded");
    let bytes = libraries.into_iter().map(std::fs::read).collect::<std::io::Result<Vec<_>>>()?;
    Ok(hash(&(std::fs::read(std::env::current_exe()?)?, bytes)))
}

fn hash(value: &impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}

fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find(|line| line.starts_with("model name")).and_then(|line| line.split(": ").nth(1));
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    format!("{}, {cores} cores, {}", model.unwrap_or("unknown processor"), std::env::consts::ARCH)
}

/// An error up to this many times the squared error of its reference may be the reference's: more samples do not make it less.
const NOISE: f64 = 2.0;

/// What a run must show whatever the times: every error is a number, more samples help, and weights are bounded.
fn check(cells: &[Cell]) -> Result<()> {
    for cell in cells {
        let name = format!("{}, {}, {}, {}", cell.study, cell.scene, cell.light, cell.material);
        let errors = cell.rows.iter().flat_map(|row| &row.repeats).map(|repeat| repeat.errors[0]);
        if errors.into_iter().any(|e| !(e.absolute + e.relative + e.unshadowed).is_finite()) {
            bail!("{name}: an error is not finite");
        }
        for method in ["direct", "product"] {
            let rows: Vec<_> = cell.rows.iter().filter(|row| row.method == method).collect();
            let unshadowed = rows.iter().map(|row| row.mean(|r| r.errors[0].unshadowed)).collect::<Vec<_>>();
            if !falls(&unshadowed, cell.reference.1) {
                bail!("{name}: the error of {method} does not fall: {unshadowed:?}");
            }
        }
        if studies::has_known_lobes(cell) && cell.max_weight > goals::LARGEST_WEIGHT {
            bail!("{name}: f L cos / (p I) reaches {:.1}, more than {}", cell.max_weight, goals::LARGEST_WEIGHT);
        }
    }
    Ok(())
}

/// Whether squared errors fall from the fewest samples to the most, or end as small as that of the reference.
fn falls(errors: &[f64], of_reference: f64) -> bool {
    match errors {
        [first, .., last] => last < first || *last <= NOISE * of_reference.powi(2),
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn errors_fall_until_they_are_those_of_the_reference() {
        assert!(super::falls(&[4e-2, 1e-2], 0.01) && super::falls(&[1e-4, 1.1e-4], 0.01) && super::falls(&[1.0], 0.0));
        assert!(!super::falls(&[4e-2, 4e-2], 0.01) && !super::falls(&[1e-4, 3e-4], 0.01));
    }
}
