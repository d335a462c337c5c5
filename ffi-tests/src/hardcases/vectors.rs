//! The shared vectors of degenerate images (`tests/vectors/hard.json`), as trees and as octahedral maps.

use super::laws::{self, Verdict, ensure, fails};
use super::table::Table;
use crate::client::{self, Texels, Tree, raw};
use crate::environment::{Environment, Light, Map};
use serde_json::Value;

const VECTORS: &str = include_str!("../../../tests/vectors/hard.json");

/// Adds the cases.
pub fn add(table: &mut Table) {
    let vectors: Value = serde_json::from_str(VECTORS).expect("hard.json is JSON");
    for case in list(&vectors["cases"]) {
        let name = case["name"].as_str().unwrap_or_default().replace('_', " ");
        let name = format!("vectors: {name}");
        match case["expect"].as_str() {
            Some("ok") => {
                let expected = "as a tree: exact cells and densities; as a map: legal samples";
                table.add(name, expected, answers(case));
            }
            Some("invalid") => table.add(name, "INVALID_TEXEL", invalid(case)),
            _ => table.add(name, "no distribution: pdf 0, integral 0", nothing(case)),
        }
    }
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn number(value: &Value) -> f64 {
    match value.as_str() {
        Some("nan") => f64::NAN,
        Some("inf") => f64::INFINITY,
        Some("-inf") => f64::NEG_INFINITY,
        _ => value.as_f64().unwrap_or(f64::NAN),
    }
}

fn pixels(case: &Value, image: &str) -> Vec<f32> {
    list(&case[image]).iter().map(|value| number(value) as f32).collect()
}

fn pair(value: &Value) -> [f64; 2] {
    [0, 1].map(|axis| number(&value[axis]))
}

fn depth(case: &Value) -> u32 {
    case["L"].as_u64().unwrap_or(0) as u32
}

fn tree(case: &Value, image: &str) -> Result<Tree, String> {
    Ok(Tree::new(depth(case), 0.0, &pixels(case, image))?)
}

fn answers(case: &Value) -> Verdict {
    let (tree, image) = (tree(case, "image")?, pixels(case, "image"));
    legal_tree(&tree, case, &image)?;
    let exact = exact(&tree, case, &image)?;
    let environment = environment(case)?;
    laws::legal(&Light::new(&environment)?)?;
    Ok(format!("legal; {exact} points exact"))
}

/// The image as an octahedral map for a nearest client, whose black stays black.
fn environment(case: &Value) -> client::Result<Environment> {
    let (side, texels) = (1 << depth(case), pixels(case, "image"));
    let (layout, filter) = (raw::WIS_LAYOUT_OCTAHEDRAL, raw::WIS_FILTER_NEAREST);
    let map = Map::latlong(side, side, 1, Texels::F32(&texels));
    Environment::new(&Map { layout, filter, flags: raw::WIS_ENVIRONMENT_EXACT_ZERO, ..map })
}

/// The position in the image of the cell that holds a point.
fn index(point: [f32; 2], depth: u32) -> usize {
    let side = 1usize << depth;
    let [i, j] = point.map(|x| (x * side as f32) as usize);
    i * side + j
}

fn legal_tree(tree: &Tree, case: &Value, image: &[f32]) -> Result<(), String> {
    let mut batch = laws::points();
    let mut order: Vec<u32> = (0u32..).take(batch.len()).collect();
    tree.warp(&mut batch, &mut order)?;
    let given = laws::points();
    for (warped, number) in batch.iter().zip(order) {
        let u = given[number as usize];
        let (point, pdf) = tree.sample(u)?;
        let at = || format!("u = {u:?}: {point:?}, pdf {pdf}");
        ensure(point.iter().all(|x| (0.0..1.0).contains(x)) && pdf > 0.0 && pdf.is_finite(), at)?;
        ensure(image[index(point, depth(case))] > 0.0, || format!("{} in a black cell", at()))?;
        ensure(tree.pdf(point)?.to_bits() == pdf.to_bits(), at)?;
        ensure(point.map(f32::to_bits) == warped.map(f32::to_bits), || format!("{} not as in place", at()))?;
        let back = tree.invert(point)?;
        ensure(back.iter().all(|u| (0.0..1.0).contains(u)), || format!("{}, invert {back:?}", at()))?;
    }
    Ok(())
}

/// Compares with rational arithmetic where no split on the way is less probable than 2^-22.
fn exact(tree: &Tree, case: &Value, image: &[f32]) -> Result<usize, String> {
    const EPSILON: f64 = 1.0 / 16_777_216.0;
    let total: f64 = list(&case["image"]).iter().map(number).sum();
    let mut compared = 0;
    for row in list(&case["exact"]) {
        let (point, pdf) = tree.sample(pair(&row["x"]).map(|x| x as f32))?;
        let probability = f64::from(image[index(point, depth(case))]) / total;
        if probability < 4.0 * EPSILON {
            continue;
        }
        compared += 1;
        let [i, j] = pair(&row["cell"]);
        let cell = (i as usize) << depth(case) | j as usize;
        let relative = (f64::from(pdf) / number(&row["pdf"]) - 1.0).abs();
        let near = index(point, depth(case)) == cell && relative <= (24.0 + 2.0 / probability) * EPSILON;
        ensure(near, || format!("{row}: {point:?}, pdf {pdf}"))?;
    }
    ensure(compared > 0, || "no point is likely enough to be compared".into())?;
    Ok(compared)
}

fn nothing(case: &Value) -> Verdict {
    if case["E"].is_array() {
        let integral = tree(case, "E")?.product_integral(&tree(case, "F")?)?;
        ensure(integral == 0.0, || format!("integral {integral}"))?;
        return Ok("integral of the product 0".into());
    }
    let tree = tree(case, "image")?;
    for u in laws::points() {
        let (_, pdf) = tree.sample(u)?;
        ensure(pdf == 0.0, || format!("u = {u:?}: pdf {pdf}"))?;
    }
    let failure = fails(tree.invert([0.3, 0.7]), raw::WIS_ZERO_DENSITY)?;
    let environment = environment(case)?;
    laws::nothing(&Light::new(&environment)?)?;
    Ok(format!("pdf 0; invert: {failure}"))
}

fn invalid(case: &Value) -> Verdict {
    let pixels = pixels(case, "image");
    let (side, depth) = (1usize << depth(case), depth(case));
    let bad = pixels.iter().position(|p| !p.is_finite() || *p < 0.0).unwrap_or(0);
    let mut failures = vec![fails(Tree::new(depth, 0.0, &pixels), raw::WIS_INVALID_TEXEL)?];
    let environment = environment(case);
    // What is negative is no fault of a map.
    if pixels[bad].is_finite() {
        ensure(environment?.info.sanitised == 1, || "not counted".into())?;
    } else {
        failures.push(fails(environment, raw::WIS_INVALID_TEXEL)?);
    }
    for failure in failures {
        let at = (failure.diagnostic.x as usize, failure.diagnostic.y as usize);
        ensure(at == (bad % side, bad / side), || format!("at {at:?}"))?;
    }
    Ok(format!("INVALID_TEXEL at {}, {}", bad % side, bad / side))
}
