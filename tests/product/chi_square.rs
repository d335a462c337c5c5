//! Samples against the density that pdf answers, by Pearson's chi-square test, and the density's integral.

use super::built::{Built, Random};
use super::lookup::{Map, direction, place_of, single};
use super::maps::{rough, suns};
use super::points::{materials, view};
use super::prepared::Prepared;
use super::statistics::{LARGEST_MISSED, chi_square, chi_square_smallest_fault, corrected};
use std::f64::consts::PI;
use wis::light::batch::samples;
use wis::light::chart::Layout;
use wis::light::plan::Filter;
use wis::sample::Sample;
use wis::simd::Level;

const COLUMNS: usize = 32;
const ROWS: usize = 16;
/// Points along each side of a bin, where its probability is measured.
const FINENESS: usize = 24;
const SAMPLES: usize = 1 << 20;
/// Lobes of which the bins' probabilities can be measured so.
const WIDE: [&str; 6] = ["Lambert", "GGX .5", "GGX .2", "GGX .1", "Phong 20", "Lambert + GGX .1"];

fn probabilities(prepared: &Prepared<'_>) -> Vec<f64> {
    let (columns, rows) = (COLUMNS * FINENESS, ROWS * FINENESS);
    let mut bins = vec![0.0; COLUMNS * ROWS];
    for j in 0..rows {
        let v = (j as f64 + 0.5) / rows as f64;
        let solid = 2.0 * PI / columns as f64 * PI / rows as f64 * (PI * v).sin();
        for i in 0..columns {
            let u = (i as f64 + 0.5) / columns as f64;
            let pdf = prepared.pdf(single(direction(Layout::LatLong, 0, [u, v])));
            bins[j / FINENESS * COLUMNS + i / FINENESS] += f64::from(pdf) * solid;
        }
    }
    bins
}

#[test]
fn samples_follow_the_density() {
    let mut maps = vec![Map::of_directions(Layout::LatLong, 64, 32, rough)];
    maps.push(suns(64, 32).swap_remove(9).1);
    let significance = corrected(maps.len() * WIDE.len());
    let mut random = Random(5);
    for map in maps {
        let built = Built::new(&map, &map.description(Filter::Bilinear));
        for (name, material) in materials().iter().filter(|(name, _)| WIDE.contains(name)) {
            let prepared = Prepared::new(&built, &view(material, [0.2, -0.4, 0.8], 50.0, 1.0));
            let bins = probabilities(&prepared);
            let total: f64 = bins.iter().sum();
            assert!((total - 1.0).abs() < 4e-3, "{name}: the density integrates to {total}");
            let mut counts = vec![0u64; bins.len()];
            let mut drawn = [Sample::default(); 64];
            for _ in 0..SAMPLES / 64 {
                let u: [[f32; 2]; 64] = std::array::from_fn(|_| [random.unit(), random.unit()]);
                samples(Level::detect(), &prepared.shaded(), &prepared.frame(), &u, &mut drawn);
                for drawn in &drawn {
                    let (_, [u, v]) = place_of(Layout::LatLong, drawn.wi.map(f64::from));
                    let (i, j) = ((u * COLUMNS as f64) as usize, (v * ROWS as f64) as usize);
                    counts[j.min(ROWS - 1) * COLUMNS + i.min(COLUMNS - 1)] += 1;
                }
            }
            let expected: Vec<f64> = bins.iter().map(|p| p / total * SAMPLES as f64).collect();
            let result = chi_square(&counts, &expected);
            let fault = chi_square_smallest_fault(result.degrees, SAMPLES as f64, significance);
            println!("{name}: p {:.4}, smallest fault {fault:.4}, integral {total:.5}", result.p_value);
            assert!(fault <= LARGEST_MISSED, "finds only faults of {fault}");
            assert!(result.p_value > significance, "{name}: p {}", result.p_value);
        }
    }
}
