//! Variances of estimates of one ray, and of their means over the hits of a pixel.

use super::both::{Lit, both, printed};
use anyhow::Result;
use glam::Vec3;
use std::f64::consts::TAU;
use std::path::Path;
use wis_ffi_tests::client::raw;
use wis_ffi_tests::directions::sphere;
use wis_ffi_tests::hardcases::brdf::{Hit, Lobe};
use wis_ffi_tests::page::{Part, Table};
use wis_ffi_tests::statistics::{bootstrap_ratio, geometric, splitmix};

const MATERIALS: [&str; 7] =
    ["Lambert", "GGX 0.5", "GGX 0.2", "GGX 0.05", "anisotropic (0.3, 0.05)", "mix", "transmission"];
/// Those that hits of a pixel are measured with, and how many hits.
const SHARED: [&str; 3] = ["Lambert", "GGX 0.2", "mix"];
const HITS: [usize; 5] = [1, 4, 16, 64, 256];
/// Candidates of one ray: 8 + 8 and 16 + 16.
const CANDIDATES: [usize; 2] = [16, 32];
const METRICS: [&str; 2] = ["absolute", "relative"];
pub const VIEWS: [&str; 2] = ["open", "six spheres"];
/// Seeds whose variance is one repeat of the bootstrap.
const GROUP: usize = 16;

/// The lobes of a material by its name.
pub fn lobes(material: &str) -> Vec<Lobe> {
    let ggx = |alpha: [f64; 2]| vec![Lobe::Ggx(alpha, 0.9)];
    match material {
        "Lambert" => vec![Lobe::Lambert(0.8)],
        "GGX 0.5" => ggx([0.5; 2]),
        "GGX 0.2" => ggx([0.2; 2]),
        "GGX 0.1" => ggx([0.1; 2]),
        "GGX 0.05" => ggx([0.05; 2]),
        "GGX 0.02" => ggx([0.02; 2]),
        "mix of GGX 0.3 and 0.05" => vec![Lobe::Ggx([0.3; 2], 0.9), Lobe::Ggx([0.05; 2], 0.9)],
        "mix" => vec![Lobe::Lambert(0.5), Lobe::Ggx([0.1; 2], 0.04)],
        "transmission" => vec![Lobe::Through([0.2; 2], 1.5)],
        _ => ggx([0.3, 0.05]),
    }
}

/// A number in [0, 1).
fn uniform(state: &mut u64) -> f64 {
    (splitmix(state) >> 11) as f64 / (1u64 << 53) as f64
}

fn direction(state: &mut u64) -> [f64; 3] {
    sphere([uniform(state), uniform(state)])
}

/// Random hits, whose viewer is at least 6 degrees above the surface.
fn hits(material: &str, count: usize) -> Vec<Hit> {
    let (lobes, mut state) = (lobes(material), 7);
    let hit = |_| {
        let cosine = 0.1 + 0.9 * uniform(&mut state);
        Hit::new(&lobes, direction(&mut state), cosine.acos().to_degrees(), TAU * uniform(&mut state))
    };
    (0..count).map(hit).collect()
}

/// The same as the library takes them.
pub fn points(material: &str, own: &raw::wis_material, count: usize) -> Vec<raw::wis_point> {
    hits(material, count).iter().map(|hit| hit.point(own)).collect()
}

/// Spheres at unit distance about each hit.
fn spheres(count: usize) -> Vec<[(Vec3, f32); 6]> {
    let mut state = 11;
    let mut sphere =
        || (Vec3::from_array(direction(&mut state).map(|x| x as f32)), 0.15 + 0.35 * uniform(&mut state) as f32);
    (0..count).map(|_| std::array::from_fn(|_| sphere())).collect()
}

fn blocked(spheres: &[(Vec3, f32); 6], wi: Vec3) -> bool {
    spheres.iter().any(|(centre, radius)| {
        let along = centre.dot(wi);
        along > 0.0 && 1.0 - along * along < radius * radius
    })
}

/// By number of hits, view and metric: the variance of each group of seeds, times the hits.
pub type Variances = Vec<[[Vec<f64>; METRICS.len()]; VIEWS.len()]>;

/// A direction and its weight, or none.
pub type Drawn = Option<([f32; 3], f32)>;

/// Those of the estimates that a call answers for points.
pub fn variances(
    lit: &Lit,
    material: &str,
    own: &raw::wis_material,
    (count, seeds, means): (usize, usize, &[usize]),
    call: &mut dyn FnMut(&raw::wis_point) -> Result<Drawn>,
) -> Result<Variances> {
    let (hits, spheres) = (hits(material, count), spheres(count));
    let mut values = vec![[const { Vec::new() }; VIEWS.len()]; means.len()];
    for (hit, spheres) in hits.iter().zip(&spheres) {
        let mut point = hit.point(own);
        for _ in 0..seeds {
            point.seed = (values[0][0].len() as u32).wrapping_mul(2_654_435_761);
            let (mut sum, mut next) = ([0.0; VIEWS.len()], 0);
            for sample in 0..means[means.len() - 1] {
                point.sample = sample as u32;
                if let Some((wi, weight)) = call(&point)? {
                    let direction = Vec3::from_array(wi);
                    let value = hit.f_cos(wi.map(f64::from)) * f64::from(lit.light.radiance(direction) * weight);
                    sum[0] += value;
                    sum[1] += if value > 0.0 && blocked(spheres, direction) { 0.0 } else { value };
                }
                if sample + 1 == means[next] {
                    let of_view = values[next].iter_mut().zip(sum);
                    of_view.for_each(|(values, sum)| values.push(sum / (sample + 1) as f64));
                    next += 1;
                }
            }
        }
    }
    let both = |(values, &hits): (&[Vec<f64>; VIEWS.len()], &usize)| {
        [0, 1].map(|view| by_group(&values[view], seeds).map(|all| all.iter().map(|v| v * hits as f64).collect()))
    };
    Ok(values.iter().zip(means).map(both).collect())
}

/// The mean variance over points in each group of seeds: over the squared mean of all, and of each point over its own.
fn by_group(values: &[f64], seeds: usize) -> [Vec<f64>; METRICS.len()] {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (all, points) = (mean(values), values.chunks(seeds).collect::<Vec<_>>());
    let groups = |scale: &dyn Fn(&[f64]) -> f64| {
        let variance = |group: &[f64]| {
            let own = mean(group);
            group.iter().map(|value| (value - own).powi(2)).sum::<f64>() / (group.len() - 1) as f64
        };
        let of = |g: usize| {
            let each = points.iter().map(|of| variance(&of[g * GROUP..][..GROUP]) / scale(of));
            each.sum::<f64>() / points.len() as f64
        };
        (0..seeds / GROUP).map(of).collect()
    };
    [groups(&|_| all * all), groups(&|of| mean(of).powi(2) + (0.01 * all).powi(2))]
}

/// Variances of 0.2 and of the current one.
fn compared(lit: &Lit, material: &str, candidates: usize, effort: (usize, usize, &[usize])) -> Result<[Variances; 2]> {
    let mut light = lit.each.iter();
    let [old, new] = both(&lobes(material), 1, candidates)?.map(|(mut sampler, own)| {
        let light = light.next().expect("two");
        variances(lit, material, &own, effort, &mut |point| {
            let mut ray = [raw::wis_ray::default()];
            let count = sampler.direct(light, point, None, &mut ray)?;
            Ok((count > 0).then_some((ray[0].wi, ray[0].weight)))
        })
    });
    Ok([old?, new?])
}

/// A ratio with its interval, in each metric.
pub type Ratios = [[f64; 3]; METRICS.len()];

pub fn ratios([old, new]: [&[Vec<f64>; METRICS.len()]; 2]) -> Ratios {
    [0, 1].map(|metric| bootstrap_ratio(&old[metric], &new[metric]))
}

/// The ratios of a map for one material, number of candidates, view and number of hits.
pub struct Cell<'a> {
    pub lit: &'a Lit,
    pub material: &'static str,
    pub candidates: usize,
    pub view: usize,
    pub hits: usize,
    pub ratios: Ratios,
}

/// The maps of a cell.
const MAPS: [&str; 2] = ["developer", "judged"];

impl Cell<'_> {
    fn maps(&self) -> &'static str {
        MAPS[usize::from(self.lit.is_judged)]
    }

    /// Its line beside the page.
    fn line(&self) -> String {
        let Cell { lit, material, candidates, view, hits, ratios } = self;
        let numbers: Vec<String> = ratios.iter().flatten().map(|x| format!("{x:.3}")).collect();
        let view = VIEWS[*view];
        format!("{}\t{}\t{material}\t{candidates}\t{view}\t{hits}\t{}", self.maps(), lit.light.name, numbers.join("\t"))
    }
}

/// The head of those lines.
const HEAD: &str = "maps\tmap\tmaterial\tcandidates\tview\thits\tabsolute\tfrom\tto\trelative\tfrom\tto";

/// A row for each group of cells with the same words, in their order: the mean of each metric, and the least with its interval and map.
fn grouped(head: &[&str], cells: &[&Cell], words: impl Fn(&Cell) -> Vec<String>) -> Table {
    let mut table = Table::new(head, ["absolute", "least", "relative", "least"]);
    let mut groups: Vec<(Vec<String>, Vec<&Cell>)> = Vec::new();
    for cell in cells {
        let words = words(cell);
        match groups.iter_mut().find(|(of, _)| *of == words) {
            Some((_, group)) => group.push(cell),
            None => groups.push((words, vec![cell])),
        }
    }
    for (words, group) in groups {
        let numbers = [0, 1].map(|metric| {
            let mean = geometric(group.iter().map(|cell| cell.ratios[metric][0]));
            [format!("{mean:.2}"), least(&group, metric)]
        });
        table.row(words, numbers.into_iter().flatten());
    }
    table
}

/// The least ratio of a group with its interval and map.
pub fn least(group: &[&Cell], metric: usize) -> String {
    let least = group.iter().min_by(|a, b| a.ratios[metric][0].total_cmp(&b.ratios[metric][0]));
    least.map(|cell| format!("{} {}", printed(cell.ratios[metric]), cell.lit.light.name)).unwrap_or_default()
}

/// The tables, what is reached first; every cell goes into a file beside the page.
///
/// # Errors
/// Those of the library and of files.
pub fn parts(lights: &[Lit], quick: bool, beside: &Path) -> Result<Vec<Part>> {
    let mut cells: Vec<Cell> = Vec::new();
    let mut measure = |materials: &[&'static str], counts: &[usize], effort: (usize, usize, &[usize])| {
        for (lit, material) in lights.iter().flat_map(|lit| materials.iter().map(move |material| (lit, *material))) {
            for &candidates in counts {
                let [old, new] = compared(lit, material, candidates, effort)?;
                for (view, (i, &hits)) in
                    (0..VIEWS.len()).flat_map(|v| effort.2.iter().enumerate().map(move |i| (v, i)))
                {
                    let ratios = ratios([&old[i][view], &new[i][view]]);
                    cells.push(Cell { lit, material, candidates, view, hits, ratios });
                }
            }
        }
        anyhow::Ok(cells.len())
    };
    let of_one = measure(&MATERIALS, &CANDIDATES, if quick { (24, 64, &[1]) } else { (96, 512, &[1]) })?;
    measure(&SHARED, &CANDIDATES[1..], if quick { (8, 32, &HITS) } else { (24, 96, &HITS) })?;
    let lines = cells.iter().map(Cell::line);
    let lines: Vec<String> = std::iter::once(HEAD.to_string()).chain(lines).collect();
    std::fs::write(beside, lines.join("\n") + "\n")?;
    let (one, shared) = cells.split_at(of_one);
    let one: Vec<&Cell> = one.iter().collect();
    let judged: Vec<&Cell> = shared.iter().filter(|cell| HITS[2..].contains(&cell.hits)).collect();
    let view = |cell: &Cell| VIEWS[cell.view].to_string();
    let summary = grouped(&["maps", "view", "goal"], &one, |cell| {
        let goal = format!("mean {}, least 0.8", ["0.95", "1"][cell.view]);
        vec![cell.maps().into(), view(cell), goal]
    });
    let by_material =
        grouped(&["material", "view", "maps"], &one, |cell| vec![cell.material.into(), view(cell), cell.maps().into()]);
    let over_hits = grouped(&["material", "view", "hits", "maps"], &judged, |cell| {
        vec![cell.material.into(), view(cell), cell.hits.to_string(), cell.maps().into()]
    });
    let file = beside.file_name().unwrap_or_default().to_string_lossy();
    let text = format!(
        "Variance of one ray with as many candidates: absolute over the squared mean of all points, relative of each point over its own square. \
         Six spheres of random places and sizes block the light. Means are over maps and over 8 + 8 and 16 + 16 candidates. Every map and material \
         stands in [{file}]({file}) with its interval."
    );
    let hits = "Samples 0, 1, 2 ... of one pixel: the variance of their mean times their number, with 16 + 16 candidates. Goal: at least 1 \
                with spheres at 16, 64 and 256 hits, and 0.83 in the open.";
    Ok(vec![
        Part::Heading("Variance with as many candidates".into()),
        Part::Text(text),
        Part::Table(summary),
        Part::Table(by_material),
        Part::Heading("Variance over the hits of a pixel".into()),
        Part::Text(hits.into()),
        Part::Table(over_hits),
    ])
}
