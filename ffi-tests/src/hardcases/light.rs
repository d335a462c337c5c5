//! What a lit map must answer: alone, and in the product with a diffuse surface.

use super::laws::{self, ensure};
use super::maps::Image;
use super::peers::Answers;
use super::table::Table;
use crate::client::{self, Environment, Map, Preparation, Product, raw};

/// A normal that is aligned with no axis, texel or edge.
pub const TILTED: [f32; 3] = [0.36, 0.48, 0.8];

/// What `lit` promises.
pub const LEGAL: &str = "legal samples; pdf > 0 at lit texels; power exact to 1e-5";

/// A white diffuse surface.
pub fn diffuse(normal: [f32; 3]) -> raw::wis_wavelet_query {
    client::query(normal, normal, &[client::lambert([0.8; 3])])
}

fn cosine(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Samples of the light and of its product with a diffuse surface are legal, no lit texel is lost, and the power is
/// that of the texels.
pub fn lit(image: &Image, environment: &Environment) -> laws::Verdict {
    let nearest = environment.info.flags & raw::WIS_WAVELET_LIGHT_NEAREST != 0;
    let (power, exact) = (environment.info.power, if nearest { image.power_nearest() } else { image.power() });
    ensure((power / exact - 1.0).abs() <= 1e-5, || format!("power {power:e}, the texels have {exact:e}"))?;
    Ok(format!("{}; power {power:.5e}", reachable(image, environment)?))
}

/// As `lit`, without the power.
pub fn reachable(image: &Image, environment: &Environment) -> laws::Verdict {
    let light = environment.light(None);
    laws::legal(&light)?;
    let directions = image.lit();
    laws::positive(&light, directions.iter().copied())?;
    // A single texel may lie below the surface: then that looks the other way.
    let faces = |normal: [f32; 3]| directions.iter().any(|wi| cosine(*wi, normal) > 0.0);
    let normal = if faces(TILTED) { TILTED } else { TILTED.map(|x| -x) };
    let above = directions.iter().copied().filter(|wi| cosine(*wi, normal) > 0.0);
    let preparation = Preparation::default();
    let mut memory = preparation.memory()?;
    let product = Product::prepare(environment, &diffuse(normal), &preparation, &mut memory)?;
    let estimate = product.estimate()?;
    ensure(estimate.is_finite() && estimate > 0.0, || format!("estimate {estimate}"))?;
    laws::legal(&product)?;
    let count = laws::positive(&product, above)?;
    ensure(count > 0, || "no lit texel is above the surface".into())?;
    Ok(format!("legal; pdf > 0 at {} texels, {count} in the product", directions.len()))
}

/// A map, built as asked and judged, with the peers on the same texels beside it.
pub fn case(
    table: &mut Table,
    name: &str,
    expected: &str,
    image: &Image,
    change: impl Fn(Map<'_>) -> Map<'_>,
    judge: impl Fn(&Image, &Environment) -> laws::Verdict,
) {
    let verdict = Environment::new(&change(image.map())).map_err(String::from);
    let verdict = verdict.and_then(|environment| judge(image, &environment));
    table.add_beside(name, expected, verdict, Answers::of(image));
}
