//! What samples come with is what pdf answers, to the bit; and no width, level or number of directions changes a bit.

use super::built::{Built, Random};
use super::lookup::Map;
use super::maps::{layouts, rough, suns};
use super::points::{materials, view};
use super::prepared::Prepared;
use bytemuck::{Zeroable, bytes_of_mut};
use wis::light::batch::{Density, pdfs, samples};
use wis::light::plan::{Description, Filter};
use wis::product::prepare::{Config, Task, Work};
use wis::product::stored::{MAX_DIVIDED, most_bytes};
use wis::sample::Sample;
use wis::simd::Level;

/// The lights of all layouts and filters, an unclipped sun, and one with an error budget.
fn lights() -> Vec<Built> {
    let mut all = Vec::new();
    for (layout, width, height) in layouts(32) {
        let map = Map::of_directions(layout, width, height, rough);
        all.extend([Filter::Nearest, Filter::Bilinear].map(|filter| Built::new(&map, &map.description(filter))));
        all.push(Built::new(&map, &Description { budget: 0.1, ..map.description(Filter::Bilinear) }));
    }
    for (_, map) in suns(64, 32).into_iter().step_by(3) {
        all.push(Built::new(&map, &map.description(Filter::Bilinear)));
    }
    all
}

fn bits((wi, pdf): ([f32; 3], f32)) -> [u32; 4] {
    [wi[0], wi[1], wi[2], pdf].map(f32::to_bits)
}

#[test]
fn a_sample_has_the_bits_of_its_pdf() {
    let mut random = Random(11);
    let edges = [0.0, 1.0 / 16_777_216.0, 0.5, 1.0 - f32::EPSILON / 2.0];
    for built in lights() {
        for (name, material) in materials() {
            for degrees in [0.0, 50.0, 85.0] {
                let prepared = Prepared::new(&built, &view(&material, random.direction(), degrees, random.f64()));
                let shaded = prepared.shaded();
                for i in 0..200 {
                    let frame = random.frame();
                    let u = if i < 16 { [edges[i % 4], edges[i / 4]] } else { [random.unit(), random.unit()] };
                    let (wi, pdf) = shaded.sample::<f32>(&frame, u);
                    let again = shaded.pdf::<f32>(&frame, wi);
                    assert_eq!(pdf.to_bits(), again.to_bits(), "{name} {degrees} u {u:?} wi {wi:?}");
                    assert!(pdf > 0.0 && pdf.is_finite(), "{name} {degrees} u {u:?} wi {wi:?}: {pdf}");
                    let length = wi.iter().map(|x| x * x).sum::<f32>();
                    assert!((length - 1.0).abs() < 1e-5, "{wi:?}");
                }
            }
        }
    }
}

#[test]
fn batches_have_the_bits_of_single_calls_at_every_level() {
    let mut random = Random(13);
    for built in lights() {
        for (_, material) in materials() {
            let prepared = Prepared::new(&built, &view(&material, random.direction(), 40.0, 1.0));
            let shaded = prepared.shaded();
            let counts = [0, 1, 2, 3, 8, 9, 64, 65].into_iter();
            for (count, level) in counts.flat_map(|count| [(count, Level::BASELINE), (count, Level::detect())]) {
                let frame = random.frame();
                let mut u: Vec<[f32; 2]> = (0..count).map(|_| [random.unit(), random.unit()]).collect();
                if let Some(first) = u.first_mut() {
                    *first = [f32::NAN, 2.0];
                }
                let mut drawn = vec![Sample::default(); count];
                samples(level, &shaded, &frame, &u, &mut drawn);
                for (drawn, &u) in drawn.iter().zip(&u) {
                    assert_eq!(bits((drawn.wi, drawn.pdf)), bits(shaded.sample::<f32>(&frame, u)), "{count}");
                }
                let mut wi: Vec<[f32; 3]> = drawn.iter().map(|drawn| drawn.wi).collect();
                for wi in wi.iter_mut().skip(1).step_by(5) {
                    // No direction: the density is 0.
                    *wi = wi.map(|x| 1.01 * x);
                }
                let mut all = vec![-1.0; count];
                pdfs(level, &shaded, &frame, &wi, &mut all);
                for (i, (&pdf, &wi)) in all.iter().zip(&wi).enumerate() {
                    assert_eq!(pdf.to_bits(), shaded.pdf::<f32>(&frame, wi).to_bits());
                    assert_eq!(pdf == 0.0, i % 5 == 1);
                }
            }
        }
    }
}

#[test]
fn levels_and_former_bytes_change_no_bit_of_a_product() {
    let mut random = Random(17);
    for built in lights() {
        for (name, material) in materials() {
            let point = view(&material, random.direction(), 60.0, 2.0);
            for config in [Config::default(), Config { divided: 24, cone: 0.1 }] {
                let first = Prepared::over(Level::BASELINE, &built, &point, &config, 0).unwrap();
                let second = Prepared::over(Level::detect(), &built, &point, &config, 0xff).unwrap();
                assert!(first.bytes() == second.bytes(), "{name}");
            }
        }
    }
}

#[test]
fn memory_for_work_leaves_no_trace() {
    let mut random = Random(19);
    let mut work = Work::zeroed();
    for built in lights() {
        for (name, material) in materials() {
            let point = view(&material, random.direction(), 40.0, 1.0);
            let expected = Prepared::new(&built, &point);
            // A large positive number in each place.
            bytes_of_mut(&mut work).fill(0x7e);
            let mut words = vec![0u128; most_bytes(MAX_DIVIDED) / 16];
            let memory = bytemuck::cast_slice_mut(&mut words);
            let (level, environment) = (Level::detect(), &built.environment());
            let task = Task { level, environment, point: &point, config: &Config::default() };
            let bytes = task.prepare(Some(&mut work), memory).expect("the point is valid");
            assert!(memory[..bytes] == *expected.bytes(), "{name}");
        }
    }
}
