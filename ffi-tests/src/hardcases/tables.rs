//! Hard maps for the light in tables: whether samples are legal, and how far L / pdf is from constant.

use super::huge::Huge;
use super::laws::{self, Verdict, ensure, fails};
use super::maps::{Image, hot, sky};
use super::peers;
use super::table::{Accuracy, Light, Table};
use crate::client::{Density, raw};
use crate::environment::{self, Environment, Map};

/// Points that the accuracy of a case is measured with.
const POINTS: usize = 1 << 15;
/// Goals: the relative standard deviation of L / pdf, its maximum over its mean, and that mean over the power, less 1.
const DEVIATION: f64 = 0.01;
const MAXIMUM: f64 = 1.05;
const MEAN: f64 = 1e-3;

/// Adds the cases.
pub fn add(table: &mut Table) {
    let floored = [(raw::WIS_FILTER_BILINEAR, 0), (raw::WIS_FILTER_NEAREST, 0)];
    let uneven = |value: f32| Image::new(64, 32, move |x, y| value * ((1 + (x * 7 + y * 3) % 5) as f32 * 0.2));
    let gradient = |width, height| Image::new(width, height, |x, y| 1.0 + (x % 11) as f32 + 0.5 * (y % 7) as f32);
    let places = [
        ("at the pole and the seam", 0, 0),
        ("in the last column", 63, 15),
        ("in the middle", 32, 16),
        ("in the last row", 31, 31),
    ];
    for (place, x, y) in places {
        for (what, background) in
            [("one texel on black", 0.0), ("a texel of 1e5 beside 1", 0.01), ("a texel of 1e10 beside 1", 1e-7)]
        {
            both(table, &format!("{what}, {place}"), &hot(x, y, 1e3, background), &floored);
        }
    }
    both(table, "one texel on black that stays black", &hot(40, 9, 1e3, 0.0), &floored.map(exact_zero));
    both(table, "a texel of 1e30 beside 1e-30", &hot(17, 25, 1e30, 1e-30), &floored);
    both(table, "a texel of 1 beside 1e8", &hot(17, 25, 1.0, 1e8), &floored);
    both(
        table,
        "every other texel black, which stays black",
        &Image::new(64, 32, |x, y| ((x + y) % 2) as f32),
        &floored.map(exact_zero),
    );
    both(table, "light only in the first row", &Image::new(64, 32, |_, y| if y == 0 { 5.0 } else { 0.0 }), &floored);
    both(
        table,
        "light only in the rows beside the horizon",
        &Image::new(64, 32, |_, y| if y / 2 == 8 { 5.0 } else { 0.0 }),
        &floored,
    );
    for (name, value) in [
        ("map of 1e-42 (denormal)", 1e-42),
        ("map of 1e-30", 1e-30),
        ("map of 1e30", 1e30),
        ("map of 3e38 (its sums overflow)", 3e38),
    ] {
        both(table, name, &uneven(value), &floored);
    }
    let ladder = Image::new(64, 32, |x, y| 10.0f32.powi(-40 + ((x * 5 + y * 11) % 78) as i32));
    both(table, "every decade from 1e-40 to 1e37 side by side", &ladder, &floored);
    for (width, height) in [(1, 1), (1, 64), (64, 1), (37, 19), (1023, 511), (4096, 2)] {
        both(table, &format!("map of {width} x {height}"), &gradient(width, height), &floored);
    }
    both(
        table,
        "sky and ground, first and last row at the poles",
        &sky(),
        &floored.map(|(filter, flags)| (filter, flags | raw::WIS_ENVIRONMENT_ROWS_AT_POLES)),
    );
    huge(table);
    black(table);
    faces(table);
}

fn exact_zero((filter, flags): (u32, u32)) -> (u32, u32) {
    (filter, flags | raw::WIS_ENVIRONMENT_EXACT_ZERO)
}

fn map(image: &Image, (filter, flags): (u32, u32)) -> Map<'_> {
    Map { filter, flags, ..image.map() }
}

/// For a bilinear and for a nearest client; the common sampler stands beside the first.
fn both(table: &mut Table, name: &str, image: &Image, kinds: &[(u32, u32)]) {
    for (i, &kind) in kinds.iter().enumerate() {
        let client = if kind.0 == raw::WIS_FILTER_NEAREST { "nearest" } else { "bilinear" };
        let accuracy = judge(image, kind);
        let got = accuracy.as_ref().map(|_| "legal".to_string()).map_err(String::clone);
        let common = if i == 0 { peers::judge(image).unwrap_or_else(|fault| fault.to_string()) } else { "-".into() };
        table.lights.push(Light { accuracy: accuracy.ok(), common, ..Light::new(name, client, got) });
    }
}

/// Legal samples, a density at every corner, edge and half-texel shift of lit texels, and the accuracy.
fn judge(image: &Image, kind: (u32, u32)) -> Result<Accuracy, String> {
    let environment = Environment::new(&map(image, kind))?;
    let density = environment::Light::new(&environment)?;
    laws::legal(&density)?;
    let bilinear = kind.0 == raw::WIS_FILTER_BILINEAR;
    let at_poles = kind.1 & raw::WIS_ENVIRONMENT_ROWS_AT_POLES != 0;
    let exact = kind.1 & raw::WIS_ENVIRONMENT_EXACT_ZERO != 0;
    let least = if exact { 0.0 } else { environment.info.mean / 65536.0 };
    let radiance = |wi| image.radiance(bilinear, at_poles, least, wi);
    for wi in image.around_lit() {
        let pdf = density.pdf(wi)?;
        ensure(pdf > 0.0 && pdf.is_finite() || radiance(wi) == 0.0, || format!("pdf({wi:?}) = {pdf} where light is"))?;
    }
    accuracy(&density, environment.info.power, exact, radiance)
}

/// How even L / pdf is.
fn accuracy(
    density: &impl Density,
    power: f64,
    exact: bool,
    radiance: impl Fn([f32; 3]) -> f64,
) -> Result<Accuracy, String> {
    let u = crate::points::of(3, POINTS);
    let mut drawn = vec![raw::wis_drawn::default(); POINTS];
    density.sample_n(&u, &mut drawn)?;
    let all = || drawn.iter().map(|drawn| radiance(drawn.wi) / (f64::from(drawn.pdf) * power));
    // Black texels beside lit ones have a pdf for the sake of rounding.
    let weights = || all().filter(|w| !exact || *w > 0.0);
    let lit = weights().count() as f64;
    let mean = weights().sum::<f64>() / lit;
    let variance = weights().map(|w| (w - mean) * (w - mean)).sum::<f64>() / lit;
    let accuracy = Accuracy {
        deviation: variance.sqrt() / mean,
        maximum: weights().fold(0.0, f64::max) / mean,
        mean: (mean - 1.0).abs(),
    };
    ensure(accuracy.deviation <= DEVIATION && accuracy.maximum <= MAXIMUM && accuracy.mean <= MEAN, || {
        format!("{accuracy:?}")
    })?;
    Ok(accuracy)
}

/// A sun of 1e8 in four texels of 16384 x 8192; the radiance is integrated apart from the library.
fn huge(table: &mut Table) {
    let judge = |huge: &Huge| -> Result<Accuracy, String> {
        let environment = huge.environment();
        let (power, exact) = (environment.info.power, huge.power());
        ensure((power / exact - 1.0).abs() <= 1e-5, || format!("power {power}, the texels have {exact}"))?;
        let density = environment::Light::new(environment)?;
        laws::legal(&density)?;
        let least = environment.info.mean / 65536.0;
        let accuracy = accuracy(&density, power, false, |wi| huge.radiance(least, wi.map(f64::from)))?;
        // A random number of its own for each sample, so that the share of the sun is binomial.
        let mut state = 1;
        let mut bits = || (crate::statistics::splitmix(&mut state) >> 40) as f32 / 16_777_216.0;
        let mut hits = 0;
        for _ in 0..POINTS {
            let wi = density.sample([bits(), bits()])?.wi.map(f64::from);
            hits += usize::from(huge.radiance(0.0, wi) > 2.0);
        }
        let (share, samples) = (1.0 - huge.dim_power() / exact, POINTS as f64);
        let off = hits as f64 / samples - share;
        ensure(off.abs() <= 4.5 * (share * (1.0 - share) / samples).sqrt() + 1e-3, || {
            format!("{hits} of {POINTS} samples in the sun, whose share is {share:.4}")
        })?;
        Ok(accuracy)
    };
    let (accuracy, skipped) = match Huge::get() {
        Ok(Some(huge)) => (judge(huge), false),
        Ok(None) => (Err(String::new()), true),
        Err(fault) => (Err(fault), false),
    };
    let got = if skipped {
        Ok("not run: too little memory".into())
    } else {
        accuracy.as_ref().map(|_| "legal; the sun has its share of samples".into()).map_err(String::clone)
    };
    let row = Light::new(super::scenes::HUGE, "bilinear", got);
    table.lights.push(Light { accuracy: accuracy.ok(), skipped, ..row });
}

fn black(table: &mut Table) {
    let image = Image::new(64, 32, |_, _| 0.0);
    for (kind, client) in [(raw::WIS_FILTER_BILINEAR, "bilinear"), (raw::WIS_FILTER_NEAREST, "nearest")] {
        let verdict = || -> Verdict {
            let environment = Environment::new(&map(&image, (kind, 0)))?;
            ensure(environment.info.power == 0.0, || format!("power {}", environment.info.power))?;
            laws::nothing(&environment::Light::new(&environment)?)?;
            Ok("power 0, pdf 0, invert ZERO_DENSITY".into())
        };
        table.lights.push(Light::new("all-black map", client, verdict()));
    }
    for (name, value, replaced) in [("NaN", f32::NAN, 0.0), ("+Inf", f32::INFINITY, 65504.0), ("negative", -1.0, 0.0)] {
        let mut image = Image::new(64, 32, |x, _| 1.0 + (x % 2) as f32);
        let good = {
            let mut good = image.clone();
            good.texels[11 * 64 + 37] = replaced;
            good
        };
        image.texels[11 * 64 + 37] = value;
        let verdict = || -> Verdict {
            let built = Environment::new(&map(&image, (raw::WIS_FILTER_BILINEAR, 0)));
            let at_once = if value.is_finite() { "built" } else { "INVALID_TEXEL at 37, 11" };
            if value.is_finite() {
                ensure(built?.info.sanitised == 1, || "not counted".into())?;
            } else {
                let failure = fails(built, raw::WIS_INVALID_TEXEL)?;
                let place = (failure.diagnostic.x, failure.diagnostic.y);
                ensure(place == (37, 11), || format!("{place:?}"))?;
            }
            let kind = (raw::WIS_FILTER_BILINEAR, raw::WIS_ENVIRONMENT_SANITISE);
            let [mended, good] = [&image, &good].map(|image| Environment::new(&map(image, kind)));
            let (mended, good) = (mended?.info, good?.info);
            ensure(mended.sanitised == 1 && mended.power == good.power, || {
                format!("{} replaced, power {}", mended.sanitised, mended.power)
            })?;
            Ok(format!("{at_once}; sanitised: one replaced"))
        };
        table.lights.push(Light::new(format!("a texel that is {name}"), "bilinear", verdict()));
    }
}

/// Other layouts, down to one texel a face; their accuracy is measured by the crate's own tests.
fn faces(table: &mut Table) {
    for (name, layout, width, height) in [
        ("cube map of one texel a face", raw::WIS_LAYOUT_CUBE, 1, 6),
        ("cube map of 5 x 5 a face", raw::WIS_LAYOUT_CUBE, 5, 30),
        ("octahedral map of one texel", raw::WIS_LAYOUT_OCTAHEDRAL, 1, 1),
        ("octahedral map of 7 x 7", raw::WIS_LAYOUT_OCTAHEDRAL, 7, 7),
    ] {
        let image = Image::new(width, height, |x, y| 1.0 + (3 * x + y) as f32);
        for (kind, client) in [(raw::WIS_FILTER_BILINEAR, "bilinear"), (raw::WIS_FILTER_NEAREST, "nearest")] {
            let verdict = || -> Verdict {
                let environment = Environment::new(&Map { layout, ..map(&image, (kind, 0)) })?;
                let density = environment::Light::new(&environment)?;
                laws::legal(&density)?;
                let mass = laws::mass(&density, 512)?;
                ensure((mass - 1.0).abs() < 2e-3, || format!("it integrates to {mass}"))?;
                Ok("legal; the density integrates to 1 within 2e-3".into())
            };
            table.lights.push(Light::new(name, client, verdict()));
        }
    }
}
