//! Degenerate inputs: black, hot, huge, denormal and contradictory images.

use crate::stored;
use crate::stored::{EPS, Stored, array, bits, doubles, floats, integer, number, vectors};
use wis::wavelets::combine;
use wis::wavelets::warp;

fn points(case: &serde_json::Value) -> Vec<[f32; 2]> {
    let given = vectors("hard.json")["edge_samples"].as_array().unwrap().clone();
    let exact = case["exact"].as_array().cloned().unwrap_or_default();
    given.iter().chain(exact.iter().map(|row| &row["x"])).map(point).collect()
}

fn point(x: &serde_json::Value) -> [f32; 2] {
    array::<2>(&doubles(x)).map(|x| x as f32)
}

fn expected(kind: &str) -> Vec<serde_json::Value> {
    let all = stored::cases("hard.json");
    all.into_iter().filter(|case| case["expect"].as_str() == Some(kind)).collect()
}

fn stored(case: &serde_json::Value, image: &str) -> Stored<4> {
    Stored::complete::<2>(integer(&case["L"]), &floats(&case[image]))
}

#[test]
fn every_result_is_lit_finite_and_in_range() {
    for case in expected("ok") {
        let (stored, image) = (stored(&case, "image"), floats(&case["image"]));
        for u in points(&case) {
            let sampled = warp::sample(&stored.tree(), u).unwrap();
            let pixel = stored::pixel_index(stored::pixel_of(sampled.point, stored.depth), stored.depth);
            assert!(sampled.point.iter().all(|y| (0.0..1.0).contains(y)), "{}", case["name"]);
            assert!(image[pixel] > 0.0 && sampled.pdf > 0.0 && sampled.pdf.is_finite(), "{}", case["name"]);
            assert_eq!(warp::pdf(&stored.tree(), sampled.point).to_bits(), sampled.pdf.to_bits());
            warp::invert(&stored.tree(), sampled.point).unwrap();
        }
    }
}

/// Where no split on the way is less probable than 2^-22, the results are those of rational arithmetic.
#[test]
fn results_are_those_of_rational_arithmetic() {
    let mut compared = 0;
    for case in expected("ok") {
        let (stored, image) = (stored(&case, "image"), doubles(&case["image"]));
        let total: f64 = image.iter().sum();
        for row in case["exact"].as_array().unwrap() {
            let sampled = warp::sample(&stored.tree(), point(&row["x"])).unwrap();
            let cell = stored::pixel_of(sampled.point, stored.depth);
            let probability = image[stored::pixel_index(cell, stored.depth)] / total;
            if probability < 1.0 / 4_194_304.0 {
                continue;
            }
            compared += 1;
            assert_eq!(cell.map(f64::from), array(&doubles(&row["cell"])), "{} {row}", case["name"]);
            let relative = (f64::from(sampled.pdf) / number(&row["pdf"]) - 1.0).abs();
            assert!(relative <= (24.0 + 2.0 / probability) * EPS, "{} {relative}", case["name"]);
            for (y, exact) in sampled.point.iter().zip(doubles(&row["y"])) {
                assert!((f64::from(*y) - exact).abs() <= (2.0 / probability + 1.0) * EPS);
            }
        }
    }
    assert!(compared > 100, "{compared}");
}

#[test]
fn black_has_no_distribution() {
    for case in expected("no_distribution") {
        if case["E"].is_array() {
            let (e, f) = (stored(&case, "E"), stored(&case, "F"));
            assert_eq!(combine::integral(&e.tree(), &f.tree()), 0.0);
        } else {
            let stored = stored(&case, "image");
            assert!(points(&case).into_iter().all(|u| warp::sample(&stored.tree(), u).is_none()));
            assert_eq!(warp::pdf(&stored.tree(), [0.3, 0.7]), 0.0);
            assert_eq!(stored.pruned(0.0).1, wis::wavelets::prune::Pruning { squares: 0, error: 0.0 });
        }
    }
}

#[test]
fn hard_images_survive_pruning_and_batches() {
    for case in expected("ok") {
        let complete = stored(&case, "image");
        for budget in [0.0, 0.01, 10.0] {
            let sparse = complete.pruned(budget).0;
            let mut batch = points(&case);
            let mut index: Vec<u32> = (0..batch.len() as u32).collect();
            warp::warp_in_place(&sparse.tree(), &mut batch, &mut index).unwrap();
            for (point, i) in batch.into_iter().zip(index) {
                let single = warp::sample(&sparse.tree(), points(&case)[i as usize]).unwrap();
                assert_eq!(bits(point), bits(single.point));
                assert!(single.pdf > 0.0 && single.pdf.is_finite());
            }
        }
    }
}
