//! What samples come with is what pdf answers, to the bit; and no width, level or number of directions changes a bit.

use super::built::{Built, Random, in_lanes};
use super::lookup::Map;
use super::maps::{descriptions, layouts, rough, suns};
use wis::light::batch::{Density, pdfs, samples};
use wis::light::plan::{Description, Filter};
use wis::sample::Sample;
use wis::simd::{GROUP, Level};
use wis::sphere::Frame;

/// The lights of all layouts and flags, an unclipped sun, and one with an error budget.
fn lights() -> Vec<Built> {
    let mut all = Vec::new();
    for (layout, width, height) in layouts(32) {
        let map = Map::of_directions(layout, width, height, rough);
        all.extend(descriptions(&map).iter().map(|of| Built::new(&map, of)));
        all.push(Built::new(&map, &Description { budget: 0.1, ..map.description(Filter::Bilinear) }));
    }
    for (_, map) in suns(64, 32) {
        all.extend([Filter::Nearest, Filter::Bilinear].map(|filter| Built::new(&map, &map.description(filter))));
    }
    all
}

fn bits((wi, pdf): ([f32; 3], f32)) -> [u32; 4] {
    [wi[0], wi[1], wi[2], pdf].map(f32::to_bits)
}

#[test]
fn a_sample_has_the_bits_of_its_pdf_under_any_matrix() {
    let mut random = Random(11);
    let edges = [0.0, 1.0 / 16_777_216.0, 0.5, 1.0 - f32::EPSILON / 2.0];
    for built in lights() {
        let environment = built.environment();
        let light = environment.light();
        for matrix in 0..100 {
            let frame = if matrix == 0 { Frame::IDENTITY } else { random.frame() };
            for i in 0..64 {
                let u = if i < 16 { [edges[i % 4], edges[i / 4]] } else { [random.unit(), random.unit()] };
                let (wi, pdf) = built.sample(&frame, u);
                let again = light.pdf::<f32>(&frame, wi);
                assert_eq!(pdf.to_bits(), again.to_bits(), "{:?} u {u:?} wi {wi:?}", environment.description());
                assert!(pdf > 0.0 && pdf.is_finite());
                let length = wi.iter().map(|x| x * x).sum::<f32>();
                assert!((length - 1.0).abs() < 1e-6, "{wi:?}");
            }
        }
    }
}

#[test]
fn lanes_have_the_bits_of_single_numbers() {
    let mut random = Random(12);
    for built in lights() {
        for _ in 0..20 {
            let frame = random.frame();
            let u: [[f32; 2]; GROUP] = std::array::from_fn(|_| [random.unit(), random.unit()]);
            for level in [Level::BASELINE, Level::detect()] {
                for ((wi, pdf, again), u) in in_lanes(level, &built, &frame, &u).into_iter().zip(u) {
                    assert_eq!(bits((wi, pdf)), bits(built.sample(&frame, u)));
                    assert_eq!(pdf.to_bits(), again.to_bits());
                }
            }
        }
    }
}

#[test]
fn batches_have_the_bits_of_single_calls_at_every_level() {
    let mut random = Random(13);
    for built in lights() {
        let environment = built.environment();
        let light = environment.light();
        let counts = [0, 1, 2, 3, 7, 8, 9, 31, 32, 33, 63, 64, 100].into_iter();
        for (count, level) in counts.flat_map(|count| [(count, Level::BASELINE), (count, Level::detect())]) {
            let frame = random.frame();
            let mut u: Vec<[f32; 2]> = (0..count).map(|_| [random.unit(), random.unit()]).collect();
            if let Some(first) = u.first_mut() {
                *first = [f32::NAN, 2.0];
            }
            let mut drawn = vec![Sample::default(); count];
            samples(level, &light, &frame, &u, &mut drawn);
            for (drawn, &u) in drawn.iter().zip(&u) {
                assert_eq!(bits((drawn.wi, drawn.pdf)), bits(built.sample(&frame, u)), "{count}");
            }
            let mut wi: Vec<[f32; 3]> = drawn.iter().map(|drawn| drawn.wi).collect();
            for wi in wi.iter_mut().skip(1).step_by(5) {
                // No direction: the density is 0.
                *wi = wi.map(|x| 1.01 * x);
            }
            let mut all = vec![-1.0; count];
            pdfs(level, &light, &frame, &wi, &mut all);
            for (i, (&pdf, &wi)) in all.iter().zip(&wi).enumerate() {
                assert_eq!(pdf.to_bits(), light.pdf::<f32>(&frame, wi).to_bits());
                assert_eq!(pdf == 0.0, i % 5 == 1);
            }
        }
    }
}
