//! One point and its samples (Fig. 1), point sets (Fig. 4), and variance against samples (Fig. 6).

use crate::{Lit, estimate, middle, reflected, relative_variance, tilted};
use anyhow::Result;
use std::fmt::Write;
use wis_ffi_tests::client::{self, Block, Density, Tree};
use wis_ffi_tests::data;
use wis_ffi_tests::images::Sheet;
use wis_ffi_tests::material::{Bsdf, Material};
use wis_ffi_tests::paper::{Paper, Verdict, columns};
use wis_ffi_tests::points;
use wis_ffi_tests::processor;
use wis_ffi_tests::scene::View;
use wis_ffi_tests::structured::Raster;

const DEPTH: u32 = 7;
const SIDE: usize = 1 << DEPTH;
/// The paper's time for 100 samples, microseconds.
const TENTH: f64 = 100.0;
/// Pixels of a panel.
const PANEL: u32 = 480;
/// Dots stand out from the warm colours of the map.
const CYAN: [u8; 3] = [90, 255, 255];
/// The share of pixels that are drawn at full brightness: lamps are thousands of times brighter than the rest.
const BRIGHTEST: f64 = 0.01;

/// Fig. 1.
pub fn one_point(page: &mut Paper, lit: &Lit) -> Result<()> {
    const SAMPLES: usize = 100;
    let raster = Raster::new(&lit.light);
    page.heading("One point, 100 samples (Fig. 1)")?;
    columns(&mut page.text, 1, "material | BRDF | environment | product | multiply, us | warp 100 points, us")?;
    let mut rows = Vec::new();
    for material in [
        data::measured("acryl_blue.brdf")?,
        data::measured("cc_iris_purple_gem_rgb.bsdf")?,
        data::measured("satin_rosaline_rgb.bsdf")?,
        Material::ggx(0.2),
    ] {
        let (point, bsdf) = (tilted(), Bsdf::new(&material, &tilted()));
        let (wi, values) = reflected(&lit.light, &bsdf, 512);
        let of_bsdf = relative_variance(&wi, &values, |wi| Ok(f64::from(bsdf.eval_one(wi).1)))?;
        let of_light = relative_variance(&wi, &values, |wi| Ok(f64::from(lit.light.radiance(wi)) / raster.power()))?;
        let (mut prepare, mut sample, mut of_product) = (f64::MAX, f64::MAX, 0.0);
        let (mut u, mut out) = ([[0.0; 2]; SAMPLES], Vec::new());
        for round in 0..200 {
            points::sobol(round, 0, &mut u);
            let product = material.prepare(&lit.map, &point)?;
            prepare = prepare.min(product.seconds * 1e6);
            let start = processor::seconds();
            product.warp(&mut u, &mut out)?;
            sample = sample.min((processor::seconds() - start) * 1e6);
            if round == 0 {
                of_product = relative_variance(&wi, &values, |wi| Ok(f64::from(product.pdf(wi.to_array())?)))?;
            }
        }
        let name = &material.name;
        writeln!(
            page.text,
            "| {name} | {of_bsdf:.2} | {of_light:.2} | {of_product:.3} | {prepare:.1} | {sample:.1} |"
        )?;
        rows.push((material.name.clone(), [of_bsdf, of_light, of_product, prepare + sample]));
    }
    let list = |cell: &dyn Fn(&[f64; 4]) -> String| {
        rows.iter().map(|(name, row)| format!("{name} {}", cell(row))).collect::<Vec<_>>().join(", ")
    };
    let is_fast = rows.iter().all(|row| row.1[3] <= TENTH);
    page.claim("100 samples of the", is_fast, &[&list(&|row| format!("{:.0} us", row[3]))]);
    page.claim(
        "the product is a",
        rows.iter().all(|row| row.1[2] < row.1[0].min(row.1[1])),
        &[&list(&|row| format!("variance {:.2} (BRDF {:.0}, map {:.0})", row[2], row[0], row[1]))],
    );
    drawn(page, lit)
}

/// Samples of BRDF, map and product over the product, as in the paper.
fn drawn(page: &mut Paper, lit: &Lit) -> Result<()> {
    let material = data::measured("acryl_blue.brdf")?;
    let bsdf = Bsdf::new(&material, &tilted());
    let light = lit.light.on_octahedron(SIDE, 4);
    let brdf: Vec<f32> = (0..SIDE * SIDE).map(|i| bsdf.eval_one(middle(i, SIDE)).0).collect();
    let (light_tree, brdf_tree) = (Tree::new(DEPTH, 0.0, &light)?, Tree::new(DEPTH, 0.0, &brdf)?);
    let product = light_tree.multiply(&brdf_tree, None, &mut Block::new(0))?;
    let grey: Vec<[f64; 3]> = brdf.iter().map(|b| [f64::from(*b); 3]).collect();
    let mut sheet = Sheet::of_panels([3, 1], [PANEL; 2], 1.0);
    for (column, (name, tree, pixels)) in (0..).zip([
        ("BRDF", &brdf_tree, grey),
        ("map", &light_tree, colours(lit, None)),
        ("product", &product, colours(lit, Some(&brdf))),
    ]) {
        let mut points = vec![[0.0; 2]; 100];
        client::hammersley(&mut points);
        tree.warp(&mut points, &mut (0..100).collect::<Vec<u32>>())?;
        draw(&mut sheet, [column, 0], &pixels, name);
        points.iter().for_each(|point| sheet.dot([column, 0], [point[1], point[0]], CYAN));
    }
    page.save("point.png", &sheet)?;
    writeln!(
        page.text,
        "\n100 samples each of acryl_blue, of the map, and of their product, over what they are samples of."
    )?;
    Ok(())
}

/// A function on the octahedral square, brighter by the cube root; the brightest pixels are cut.
fn draw(sheet: &mut Sheet, at: [u32; 2], pixels: &[[f64; 3]], name: &str) {
    let mut sorted: Vec<f64> = pixels.iter().map(|pixel| pixel.iter().copied().fold(0.0, f64::max)).collect();
    sorted.sort_by(|a, b| b.total_cmp(a));
    let white = sorted[(BRIGHTEST * sorted.len() as f64) as usize].max(1e-30);
    let colour = |place: [f32; 2]| {
        let [x, y] = place.map(|c| ((c * SIDE as f32) as usize).min(SIDE - 1));
        pixels[y * SIDE + x].map(|c| 0.9 * (c / white).clamp(0.0, 1.0).cbrt())
    };
    sheet.map(at, colour, name);
}

/// The map's colours on the octahedral square, each pixel times a factor.
fn colours(lit: &Lit, factor: Option<&[f32]>) -> Vec<[f64; 3]> {
    let channels = lit.colours.each_ref().map(|colour| colour.on_octahedron(SIDE, 4));
    let times = |i: usize| factor.map_or(1.0, |factor| f64::from(factor[i]));
    (0..SIDE * SIDE).map(|i| channels.each_ref().map(|c| f64::from(c[i]) * times(i))).collect()
}

/// Fig. 4.
pub fn point_sets(page: &mut Paper, lit: &Lit) -> Result<()> {
    const POINTS: usize = 256;
    page.heading("Point sets (Fig. 4)")?;
    columns(&mut page.text, 2, "function | points | before | after, by area | after, by mass")?;
    let light = lit.light.on_octahedron(SIDE, 4);
    let bsdf = Bsdf::new(&Material::ggx(0.5), &tilted());
    let brdf: Vec<f32> = (0..SIDE * SIDE).map(|i| bsdf.eval_one(middle(i, SIDE)).0).collect();
    let (light_tree, brdf_tree) = (Tree::new(DEPTH, 0.0, &light)?, Tree::new(DEPTH, 0.0, &brdf)?);
    let product = light_tree.multiply(&brdf_tree, None, &mut Block::new(0))?;
    let pixels: Vec<f32> = light.iter().zip(&brdf).map(|(l, b)| l * b).collect();
    let shown = [colours(lit, None), colours(lit, Some(&brdf))];
    let (mut sheet, mut after_all, mut most) = (Sheet::of_panels([2, 2], [PANEL; 2], 1.0), Vec::new(), 0.0f64);
    for (row, (name, tree, pixels)) in
        (0..).zip([("the map", &light_tree, &light), ("its product with GGX 0.5", &product, &pixels)])
    {
        let mut hammersley = vec![[0.0; 2]; POINTS];
        client::hammersley(&mut hammersley);
        let sobol = points::of(1, POINTS);
        let (masses, mut afters) = (Masses::new(pixels), [0.0; 3]);
        let sets = [("random", random(7, POINTS)), ("Hammersley", hammersley), ("Owen-scrambled Sobol", sobol)];
        for (column, (kind, set)) in (0..).zip(sets) {
            let mut warped = set.clone();
            tree.warp(&mut warped, &mut (0..POINTS as u32).collect::<Vec<_>>())?;
            let before = discrepancy(&set, |x, y| x * y);
            let plain = discrepancy(&warped, |x, y| x * y);
            let after = discrepancy(&warped, |x, y| masses.below(x, y));
            writeln!(page.text, "| {name} | {kind} | {before:.3} | {plain:.3} | {after:.3} |")?;
            afters[column as usize] = after;
            most = if column == 1 { most.max(after / before) } else { most };
            if column < 2 {
                let name = format!("{}, {kind}", ["map", "product"][row as usize]);
                draw(&mut sheet, [column, row], &shown[row as usize], &name);
                warped.iter().for_each(|point| sheet.dot([column, row], [point[1], point[0]], CYAN));
            }
        }
        after_all.push(afters);
    }
    page.save("points.png", &sheet)?;
    writeln!(
        page.text,
        "\n{POINTS} warped points over the map, and over its product with GGX 0.5. Brightness is the cube root.\n\
         The brightest {:.0} % of the pixels are cut.",
        100.0 * BRIGHTEST
    )?;
    page.claim(
        "the warp keeps the",
        after_all.iter().all(|after| 2.0 * after[1] <= after[0]),
        &[&after_all[0][1], &after_all[1][1], &after_all[0][0], &after_all[1][0], &most],
    );
    Ok(())
}

/// Fig. 6.
pub fn convergence(page: &mut Paper, lit: &Lit) -> Result<()> {
    const COUNTS: [usize; 10] = [1, 2, 4, 8, 16, 32, 64, 128, 256, 512];
    let scene = data::scene("spot.obj", View::Points(300))?;
    let material = Material::lambert();
    page.heading("Variance against samples (Fig. 6)")?;
    columns(&mut page.text, 0, "samples | random | Hammersley | Owen-scrambled Sobol")?;
    let mut errors = [[0.0; 3]; COUNTS.len()];
    for (number, point) in (0..).zip(&scene.points) {
        let product = material.prepare(&lit.integrated, point)?;
        let mut many = points::of(u32::MAX - number, 1 << 15);
        let exact = estimate(&scene, point, &product, &mut many)?;
        if exact <= 0.0 {
            continue;
        }
        for (errors, count) in errors.iter_mut().zip(COUNTS) {
            let mut hammersley = vec![[0.0; 2]; count];
            client::hammersley(&mut hammersley);
            // Rotated by a random vector, or all pixels would have the same points.
            let turn = random(2 * number + 1, 1)[0];
            for u in &mut hammersley {
                *u = [0, 1].map(|axis| (u[axis] + turn[axis]).fract());
            }
            let sobol = points::of(number, count);
            for (error, mut set) in errors.iter_mut().zip([random(2 * number, count), hammersley, sobol]) {
                *error += (estimate(&scene, point, &product, &mut set)? / exact - 1.0).powi(2);
            }
        }
    }
    let variances = errors.map(|row| row.map(|error| error / scene.points.len() as f64));
    for (row, count) in variances.iter().zip(COUNTS) {
        writeln!(page.text, "| {count} | {} |", row.map(|variance| format!("{variance:.5}")).join(" | "))?;
    }
    let at =
        |samples: usize| variances[COUNTS.iter().position(|count| *count == samples).expect("a count of the table")];
    let ([random, few, _], [many, ..]) = (at(64), at(512));
    let verdict = Verdict::Untested.unless(few < many);
    page.claim("64 Hammersley points have", verdict, &[&few, &many, &(random / many), &(random / few)]);
    Ok(())
}

/// Numbers from a congruential generator.
fn random(seed: u32, count: usize) -> Vec<[f32; 2]> {
    let mut state = u64::from(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678_9abc_def1;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mixed = (state ^ (state >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
        (mixed >> 40) as f32 / (1 << 24) as f32
    };
    (0..count).map(|_| [next(), next()]).collect()
}

/// The largest difference between the share of points below a corner and what it ought to be.
fn discrepancy(points: &[[f32; 2]], share: impl Fn(f64, f64) -> f64) -> f64 {
    let corners = (0..64 * 64).map(|i| [(i % 64 + 1) as f32 / 64.0, (i / 64 + 1) as f32 / 64.0]);
    let difference = |corner: [f32; 2]| {
        let below = points.iter().filter(|p| p[0] < corner[0] && p[1] < corner[1]).count();
        (below as f64 / points.len() as f64 - share(corner[0].into(), corner[1].into())).abs()
    };
    corners.map(difference).fold(0.0, f64::max)
}

/// The shares of a function's mass below points; axis 1 is that of the rows.
struct Masses(Vec<f64>);

impl Masses {
    fn new(pixels: &[f32]) -> Masses {
        let side = SIDE + 1;
        let mut sums = vec![0.0; side * side];
        for (i, &value) in pixels.iter().enumerate() {
            let (y, x) = (i / SIDE + 1, i % SIDE + 1);
            sums[y * side + x] =
                f64::from(value) + sums[(y - 1) * side + x] + sums[y * side + x - 1] - sums[(y - 1) * side + x - 1];
        }
        Masses(sums)
    }

    fn below(&self, x: f64, y: f64) -> f64 {
        let at = |c: f64| (c * SIDE as f64).round() as usize;
        self.0[at(x) * (SIDE + 1) + at(y)] / self.0[self.0.len() - 1]
    }
}
