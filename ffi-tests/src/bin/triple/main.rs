//! Measures triple product integrals (Ng et al. 2004) on a real light, real visibility and analytic BRDFs: triple <page>

mod approximation;
mod domain;
mod fields;
mod relighting;
mod sampling;
mod spherical;
mod terms;
mod threads;

use anyhow::{Context, Result};
use glam::Vec3;
use std::fmt::Write;
use std::path::Path;
use wis_ffi_tests::data;
use wis_ffi_tests::light::octahedral_direction;
use wis_ffi_tests::material::Bsdf;

const DEPTH: u32 = 7;
const SIDE: usize = 1 << DEPTH;

fn main() -> Result<()> {
    let page = std::env::args().nth(1).context("usage: triple <page>")?;
    let light = data::light("grace_latlong.exr")?;
    let mut out = String::from(INTRODUCTION);
    counts(&mut out)?;
    approximation::write(&mut out, &light)?;
    spherical::write(&mut out)?;
    sampling::write(&mut out, &light)?;
    relighting::write(&mut out, &light)?;
    let beside = Path::new(&page).parent().unwrap_or(Path::new("."));
    fields::write(&mut out, &light, &beside.join("triple-2004"))?;
    print!("{out}");
    Ok(std::fs::write(page, out)?)
}

const INTRODUCTION: &str = "# Triple product wavelet integrals

Written by `make triple`. Ng et al. 2004, \"Triple Product Wavelet Integrals for All-Frequency Relighting\": the
integrals, their coefficients and the sublinear algorithm (`wis_triple_*`, `wis_tripling_coefficient`), and the product as
something to sample (`wis_tree_multiply`). `make relight` relights the vertices of a mesh.

| claim | paper | here | holds |
|---|---|---|---|
| wavelets approximate all frequencies, harmonics do not (6.1) | curves | 400 terms: Haar .004 to .29, harmonics .12 to .73, pixels .01 to .91 | yes |
| non-zero tripling coefficients (4) | 2 - N + 3 N log4 N | 8 - 7 N + 9 N log4 N, ordered | O(N log N) does |
| visibility is sparse on a cube (7.1.1) | .8 to 6.2 % | 1.5 to 1.7 % at 6 x 64 x 64, .4 % at 6 x 256 x 256 | yes |
| .1 to 1 % of BRDF and light suffice (8.1) | pictures | 1 % of the terms: 5 % of error (Lambert) to 12 % (Phong 200); .1 %: 19 to 78 % | 1 % does |
| 10 to 30 times faster than pixels at 1 % of error (Fig. 3) | yes | pixels win | no |
| 3 to 5 s a frame, 100 to 300 thousand vertices (8.2) | 2004 | .1 s and .24 s with .1 % of the terms (15 and 21 % of error); by products .26 s and .8 s at 4 to 5 %, .5 s and 1.7 s at 1 % | yes |

What does not hold: 10 to 30 times faster than a sum over pixels at 1 % of error. A term costs about 30 ns, a pixel 0.3 ns
in eight lanes, and 1 % of error takes 3 to 10 % of the terms of these inputs; wavelets are ahead below .5 % of the terms,
where the error is 6 % (Lambert on six faces) and more. Against pixels that are stored as wavelets and must be decompressed
first (30 to 40 us) they win 26 to 54 times at .1 % of the terms, 8 to 12 times at .5 %, 4 to 7 times at 1 %, and lose a
little at 1 % of error. What they save is memory: 1 to 2 kB a vertex in place of 64 to 98.

What helps more than dropping terms: where many vertices share a BRDF, as all of one normal or one reflected direction do,
light x BRDF is multiplied once for a frame, and each vertex adds up what it sees of the product, exactly, in 2 to 4 us (six faces).

The octahedral square needs more of its wavelets than six faces do: its axes lie askew to the horizon, so that visibility
has more squares for its pixels, and its 64 x 64 or 128 x 128 pixels are fewer than 24576.

Time grows as the .8th to .94th power of the terms over three decades (Fig. 3 has slope 1), error falls as the .9th to 1.2th.

Operations of the linear algorithm: 12.3 a pixel (a test counts 21 multiplications and 14 additions a square, and area and
sum); the paper says 13, its form takes 16.3 when factored. Averages are stored, which makes the parent sums free.

What the paper does not have: sampling with visibility. A density that believes an estimate of visibility wins 1.4 to 3
times in the penumbra and 5 to 9 times in the umbra, and loses where everything is seen, where there was little to win.

![A frame of make relight](triple-2004/relight.png)
";

/// The counts of non-zero coefficients, beside the paper's.
fn counts(out: &mut String) -> Result<()> {
    writeln!(out, "\n## Tripling coefficients that are not 0 (Section 4.6)\n")?;
    writeln!(out, "Ordered triples of N functions on a square, enumerated (N up to 64: a test does) or by")?;
    writeln!(out, "8 - 7 N + 9 N log4 N; unordered ones; and what Eq. 19 of the paper says, 2 - N + 3 N log4 N.\n")?;
    writeln!(out, "| N | ordered | unordered | paper |\n|---:|---:|---:|---:|")?;
    for depth in 1..=8u64 {
        let n = 1u64 << (2 * depth);
        let (ordered, log) = (8 + 9 * n * depth - 7 * n, depth);
        let unordered = 1 + (n - 1) / 3 + 3 * (1 + n * log - n);
        writeln!(out, "| {n} | {ordered} | {unordered} | {} |", 2 + 3 * n * log - n)?;
    }
    Ok(())
}

/// The direction of a place in a pixel.
fn pixel(i: usize, parts: [f32; 2]) -> Vec3 {
    let at = |c: usize, part: f32| (c as f32 + part) / SIDE as f32;
    octahedral_direction(at(i % SIDE, parts[0]), at(i / SIDE, parts[1]))
}

/// BRDF x cosine, the mean of four places in a pixel.
fn mean_on_pixel(bsdf: &Bsdf, i: usize) -> f32 {
    let quarters = [[0.25, 0.25], [0.25, 0.75], [0.75, 0.25], [0.75, 0.75]];
    quarters.iter().map(|&parts| bsdf.eval_one(pixel(i, parts)).0).sum::<f32>() / 4.0
}
