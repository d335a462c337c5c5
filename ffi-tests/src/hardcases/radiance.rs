//! Light of any magnitude: black, one texel, denormal, huge, invalid, coloured, and exactly where a lobe ends.

use super::laws::{self, Verdict, ensure, fails};
use super::light::{LEGAL, case, diffuse, lit, reachable};
use super::maps::{Image, hot, sky};
use super::peers::Answers;
use super::table::Table;
use crate::client::{self, Environment, Map, Preparation, Product, raw};
use std::f64::consts::PI;

/// Adds the cases.
pub fn add(table: &mut Table) {
    black(table);
    hot_texels(table);
    magnitudes(table);
    invalid(table);
    places(table);
    colours(table);
}

fn plain(map: Map<'_>) -> Map<'_> {
    map
}

fn flags(flags: u32) -> impl Fn(Map<'_>) -> Map<'_> {
    move |map| Map { flags, ..map }
}

fn black(table: &mut Table) {
    let expected = "power 0; pdf 0 everywhere; invert ZERO_DENSITY; product likewise, estimate 0";
    for (name, value) in [("all-black map", 0.0), ("map of -0.0", -0.0)] {
        case(table, name, expected, &Image::new(64, 32, |_, _| value), plain, |_, environment| {
            let power = environment.info.power;
            ensure(power == 0.0, || format!("power {power}"))?;
            laws::nothing(&environment.light(None))?;
            nothing_in_product(environment, [0.0, 0.0, 1.0])
        });
    }
}

fn nothing_in_product(environment: &Environment, normal: [f32; 3]) -> Verdict {
    let preparation = Preparation::default();
    let mut memory = preparation.memory()?;
    let product = Product::prepare(environment, &diffuse(normal), &preparation, &mut memory)?;
    laws::nothing(&product)?;
    let estimate = product.estimate()?;
    ensure(estimate == 0.0, || format!("estimate {estimate}"))?;
    Ok("pdf 0, estimate 0".into())
}

fn hot_texels(table: &mut Table) {
    let places = [
        ("first texel of the first row (pole and seam)", 0, 0),
        ("last texel of the first row", 63, 0),
        ("first column (seam)", 0, 16),
        ("last column (seam)", 63, 15),
        ("in the middle", 32, 16),
        ("in the last row", 31, 31),
        ("last texel of the last row", 63, 31),
    ];
    for (place, x, y) in places {
        case(table, &format!("one hot texel: {place}"), LEGAL, &hot(x, y, 1000.0, 0.0), plain, lit);
    }
    let name = "one hot texel, looked up without filter, black stays black";
    let exact = flags(raw::WIS_WAVELET_LIGHT_NEAREST | raw::WIS_WAVELET_LIGHT_EXACT_ZERO);
    case(table, name, LEGAL, &hot(40, 9, 1000.0, 0.0), exact, lit);
    table.add("one hot texel: each of the 512 of 32 x 16 in turn", LEGAL, each_texel());
    case(table, "a texel of 1e10 beside 1", LEGAL, &hot(17, 5, 1e10, 1.0), plain, lit);
    case(table, "a texel of 1e10 beside 1, in the last column", LEGAL, &hot(63, 5, 1e10, 1.0), plain, lit);
    let name = "a texel of 1e10 beside 1, looked up without filter";
    case(table, name, LEGAL, &hot(17, 5, 1e10, 1.0), flags(raw::WIS_WAVELET_LIGHT_NEAREST), lit);
    case(table, "a texel of 1e30 beside 1e-30", LEGAL, &hot(17, 25, 1e30, 1e-30), plain, lit);
    case(table, "a texel of 1 beside 1e8, the rest of 1e8", LEGAL, &hot(17, 25, 1.0, 1e8), plain, lit);
}

fn each_texel() -> Verdict {
    for (x, y) in (0..16).flat_map(|y| (0..32).map(move |x| (x, y))) {
        let image = Image::new(32, 16, |i, j| if (i, j) == (x, y) { 5.0 } else { 0.0 });
        lit(&image, &Environment::new(&image.map())?).map_err(|fault| format!("texel {x}, {y}: {fault}"))?;
    }
    Ok("legal, all 512".into())
}

fn magnitudes(table: &mut Table) {
    let uneven = |value: f32| Image::new(64, 32, move |x, y| value * ((1 + (x * 7 + y * 3) % 5) as f32 * 0.2));
    for (name, value) in [
        ("map of 1e-42 (denormal)", 1e-42),
        ("map of 1e-30", 1e-30),
        ("map of 1e30", 1e30),
        ("map of 3e38 (its sums overflow)", 3e38),
    ] {
        case(table, name, LEGAL, &uneven(value), plain, lit);
    }
    let least = Image::new(64, 32, |x, y| if (x + y) % 3 == 0 { f32::from_bits(1) } else { 0.0 });
    case(table, "the smallest denormal, on a third of the texels", LEGAL, &least, plain, lit);
    let name = "f32::MAX in all channels";
    case(table, name, LEGAL, &Image::new(64, 32, |_, _| f32::MAX).coloured([1.0; 3]), plain, lit);
    let ladder = Image::new(64, 32, |x, y| 10.0f32.powi(-40 + ((x * 5 + y * 11) % 78) as i32));
    case(table, "every decade from 1e-40 to 1e37 side by side", LEGAL, &ladder, plain, lit);
    table.add("a map times 2^40 and 2^-40", "the bits of directions and pdfs unchanged (rule of scaling)", scaled());
}

fn scaled() -> Verdict {
    let reference = sampled(&sky())?;
    for scale in [1.099_511_6e12, 1.0 / 1.099_511_6e12] {
        let mut image = sky();
        image.texels.iter_mut().for_each(|texel| *texel *= scale);
        ensure(sampled(&image)? == reference, || format!("times {scale:e}: other bits"))?;
    }
    Ok("the same bits".into())
}

fn sampled(image: &Image) -> Result<Vec<[u32; 4]>, String> {
    let environment = Environment::new(&image.map())?;
    let light = environment.light(None);
    let bits = |sample: raw::wis_drawn| {
        let [x, y, z] = sample.wi;
        [x, y, z, sample.pdf].map(f32::to_bits)
    };
    laws::points().into_iter().map(|u| Ok(bits(client::Density::sample(&light, u)?))).collect()
}

fn invalid(table: &mut Table) {
    let (x, y) = (37, 11);
    let values = [
        ("NaN", f32::NAN, 0.0),
        ("+Inf", f32::INFINITY, 65504.0),
        ("-Inf", f32::NEG_INFINITY, 0.0),
        ("negative", -1.0, 0.0),
    ];
    for (name, value, replacement) in values {
        let mut image = sky();
        image.texels[(y * 64 + x) as usize] = value;
        let mut clean = sky();
        clean.texels[(y * 64 + x) as usize] = replacement;
        let peers = Answers::of(&image);
        if value.is_finite() {
            let verdict = Environment::new(&image.map()).map_err(String::from);
            let verdict = verdict.and_then(|environment| lit(&clean, &environment));
            table.add_beside(format!("{name} texel"), "as the map with 0", verdict, peers);
        } else {
            let rejected = fails(Environment::new(&image.map()), raw::WIS_INVALID_TEXEL).and_then(|failure| {
                let at = (failure.diagnostic.x, failure.diagnostic.y);
                ensure(at == (x, y), || format!("{at:?}"))?;
                Ok(format!("INVALID_TEXEL at {x}, {y}"))
            });
            table.add_beside(format!("{name} texel, rejected"), "INVALID_TEXEL and its place", rejected, peers);
        }
        let expected = "1 texel replaced; as the map with the replacement";
        let sanitised = Environment::new(&Map { flags: raw::WIS_WAVELET_LIGHT_SANITISE, ..image.map() });
        let verdict = sanitised.map_err(String::from).and_then(|environment| {
            ensure(environment.info.sanitised == 1, || format!("{} replaced", environment.info.sanitised))?;
            lit(&clean, &environment)
        });
        table.add(format!("{name} texel, sanitised"), expected, verdict);
    }
    for (name, value) in [("NaN", f32::NAN), ("-Inf", f32::NEG_INFINITY)] {
        let image = Image::new(8, 4, |_, _| value);
        let verdict = Environment::new(&Map { flags: raw::WIS_WAVELET_LIGHT_SANITISE, ..image.map() });
        let verdict = verdict.map_err(String::from).and_then(|environment| {
            ensure(environment.info.sanitised == 32, || format!("{} replaced", environment.info.sanitised))?;
            laws::nothing(&environment.light(None))?;
            Ok("32 replaced; pdf 0".into())
        });
        let expected = "all replaced by 0: a black map";
        table.add_beside(format!("all texels {name}, sanitised"), expected, verdict, Answers::of(&image));
    }
}

fn places(table: &mut Table) {
    let row = |lit: u32| Image::new(64, 32, move |_, y| if y == lit { 2.0 } else { 0.0 });
    case(table, "light only at the pole +z", LEGAL, &row(0), plain, lit);
    case(table, "light only at the pole -z", LEGAL, &row(31), plain, lit);
    let horizon = Image::new(64, 33, |_, y| if y == 16 { 2.0 } else { 0.0 });
    let expected = "legal samples; pdf > 0 wherever light and cosine are";
    case(table, "light exactly on the horizon of the surface", expected, &horizon, plain, |image, environment| {
        reachable(image, environment)?;
        horizon_product(environment)
    });
    let below = Image::new(64, 32, |_, y| if y >= 24 { 2.0 } else { 0.0 });
    let name = "light wholly below the surface, black stays black";
    let expected = "a tiny product or none: legal samples, estimate below 2^-10 of the power";
    case(table, name, expected, &below, flags(raw::WIS_WAVELET_LIGHT_EXACT_ZERO), |_, environment| {
        tiny_product(environment)
    });
    let nadir = Image::new(64, 32, |_, y| if y == 31 { 2.0 } else { 0.0 });
    let name = "light opposite to the normal, black stays black";
    let none = "product 0: pdf 0, estimate 0";
    case(table, name, none, &nadir, flags(raw::WIS_WAVELET_LIGHT_EXACT_ZERO), |_, environment| {
        nothing_in_product(environment, [0.0, 0.0, 1.0])
    });
    let name = "light wholly below the surface, floored";
    case(table, name, expected, &below, plain, |_, environment| tiny_product(environment));
}

/// Directions within a texel of the horizon, on its upper side.
fn horizon_product(environment: &Environment) -> Verdict {
    let preparation = Preparation::default();
    let mut memory = preparation.memory()?;
    let product = Product::prepare(environment, &diffuse([0.0, 0.0, 1.0]), &preparation, &mut memory)?;
    laws::legal(&product)?;
    let direction = |k: i32| {
        let (phi, elevation) = (0.618 * f64::from(k), PI / 66.0 * 0.7f64.powi(k % 40));
        [elevation.cos() * phi.cos(), elevation.cos() * phi.sin(), elevation.sin()].map(|x| x as f32)
    };
    let count = laws::positive(&product, (0..10_000).map(direction))?;
    Ok(format!("legal; pdf > 0 at {count} directions down to 3e-8 above the horizon"))
}

fn tiny_product(environment: &Environment) -> Verdict {
    let preparation = Preparation::default();
    let mut memory = preparation.memory()?;
    let product = Product::prepare(environment, &diffuse([0.0, 0.0, 1.0]), &preparation, &mut memory)?;
    laws::legal(&product)?;
    let share = product.estimate()? / environment.info.power;
    ensure((0.0..1.0 / 1024.0).contains(&share), || format!("estimate / power = {share:e}"))?;
    Ok(format!("legal; estimate / power = {share:.1e}"))
}

fn colours(table: &mut Table) {
    let blue = sky().coloured([0.0, 0.0, 1.0]);
    case(table, "pure blue light", LEGAL, &blue, plain, lit);
    let name = "pure blue light on white: RGB estimate";
    table.add(name, "0, 0, and the luminance / 0.0722", blue_on_white());
    let name = "pure blue light on pure red: RGB estimate";
    table.add(name, "0, 0, 0; samples legal, their weight 0", blue_on_red());
}

/// The estimates in RGB and of luminance.
fn blue_on(albedo: [f32; 3]) -> Result<([f64; 3], f64), String> {
    let blue = sky().coloured([0.0, 0.0, 1.0]);
    let environment = Environment::new(&Map { flags: raw::WIS_WAVELET_LIGHT_RGB, ..blue.map() })?;
    let preparation = Preparation::default();
    let mut memory = preparation.memory()?;
    let normal = [0.0, 0.0, 1.0];
    let query = client::query(normal, normal, &[client::lambert(albedo)]);
    let product = Product::prepare(&environment, &query, &preparation, &mut memory)?;
    laws::legal(&product)?;
    Ok((product.estimate_rgb()?, product.estimate()?))
}

fn blue_on_white() -> Verdict {
    let ([r, g, b], luminance) = blue_on([1.0; 3])?;
    let expected = luminance / 0.0722;
    let close = (b - expected).abs() <= 1e-5 * expected;
    ensure(r == 0.0 && g == 0.0 && close, || format!("{r}, {g}, {b}, not {expected}"))?;
    Ok(format!("legal; {r}, {g}, {b:.4}"))
}

fn blue_on_red() -> Verdict {
    let (rgb, _) = blue_on([1.0, 0.0, 0.0])?;
    ensure(rgb == [0.0; 3], || format!("{rgb:?}"))?;
    Ok("legal; 0, 0, 0".into())
}
