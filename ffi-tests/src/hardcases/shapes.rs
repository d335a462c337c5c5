//! Maps of any shape, format and storage.

use super::laws::{self, Verdict, ensure, fails};
use super::light::{LEGAL, case, lit, reachable};
use super::maps::{Image, available_memory, hot, sky};
use super::table::Table;
use crate::client::{Environment, Map, Texels, raw};
use std::ptr::null;

/// Adds the cases.
pub fn add(table: &mut Table) {
    sizes(table);
    layouts(table);
    resolutions(table);
    sparse(table);
    sources(table);
    huge(table);
}

fn gradient(width: u32, height: u32) -> Image {
    Image::new(width, height, |x, y| 1.0 + (x % 11) as f32 + 0.5 * (y % 7) as f32)
}

fn sizes(table: &mut Table) {
    for (width, height) in [(1, 1), (1, 64), (64, 1), (2, 1), (37, 19), (17, 33), (1023, 511), (4096, 2)] {
        let name = format!("map of {width} x {height}");
        case(table, &name, LEGAL, &gradient(width, height), |map| map, lit);
    }
    for (width, height) in [(0, 32), (64, 0)] {
        let verdict = fails(Environment::size(&Map { width, height, ..sky().map() }), raw::WIS_INVALID_ARGUMENT);
        table.add(format!("map of {width} x {height}"), "INVALID_ARGUMENT", verdict.map(|_| "INVALID_ARGUMENT".into()));
    }
    let verdict =
        fails(Environment::size(&Map { width: u32::MAX, height: u32::MAX, ..sky().map() }), raw::WIS_OVERFLOW);
    table.add("map of 4294967295 x 4294967295", "OVERFLOW", verdict.map(|_| "OVERFLOW".into()));
}

fn layouts(table: &mut Table) {
    for (name, layout, width, height) in [
        ("cube map of one texel a face", raw::WIS_LAYOUT_CUBE, 1, 6),
        ("cube map of 5 x 5 a face", raw::WIS_LAYOUT_CUBE, 5, 30),
        ("octahedral map of one texel", raw::WIS_LAYOUT_OCTAHEDRAL, 1, 1),
        ("octahedral map of 7 x 7", raw::WIS_LAYOUT_OCTAHEDRAL, 7, 7),
    ] {
        let image = gradient(width, height);
        let map = Map { layout, ..image.map() };
        let expected = "legal samples; density integrates to 1";
        table.add(name, expected, Environment::new(&map).map_err(String::from).and_then(|e| integrates(&e)));
    }
    for (name, layout, width, height) in [
        ("cube map that is not six squares", raw::WIS_LAYOUT_CUBE, 5, 29),
        ("octahedral map that is not square", raw::WIS_LAYOUT_OCTAHEDRAL, 7, 8),
    ] {
        let verdict =
            fails(Environment::size(&Map { layout, width, height, ..sky().map() }), raw::WIS_INVALID_ARGUMENT);
        table.add(name, "INVALID_ARGUMENT", verdict.map(|_| "INVALID_ARGUMENT".into()));
    }
}

fn integrates(environment: &Environment) -> Verdict {
    let light = environment.light(None);
    laws::legal(&light)?;
    // Finer than the cells: those in which light varies are divided further.
    let mass = laws::mass(&light, environment.info.resolution.max(2048))?;
    ensure((mass - 1.0).abs() < 1e-5, || format!("it integrates to {mass}"))?;
    Ok(format!("legal; integral {mass:.5}"))
}

fn resolutions(table: &mut Table) {
    let image = hot(17, 5, 1000.0, 0.01);
    for resolution in [1, 2, 1024] {
        let name = format!("a hot texel at a resolution of {resolution}");
        case(table, &name, LEGAL, &image, |map| Map { resolution, ..map }, lit);
    }
    for resolution in [3, 8192] {
        let verdict = fails(Environment::size(&Map { resolution, ..image.map() }), raw::WIS_INVALID_ARGUMENT);
        table.add(format!("resolution {resolution}"), "INVALID_ARGUMENT", verdict.map(|_| "INVALID_ARGUMENT".into()));
    }
}

fn sparse(table: &mut Table) {
    let expected = "legal samples; pdf > 0 at lit texels; integral 1";
    let images = [
        ("a hot texel on black", hot(17, 5, 1000.0, 0.0)),
        ("1e10 beside 1", hot(17, 5, 1e10, 1.0)),
        ("a constant map", Image::new(64, 32, |_, _| 3.0)),
    ];
    for (name, image) in &images {
        for error_budget in [0.0, 0.01, 10.0] {
            let storage = raw::WIS_STORAGE_SPARSE;
            let name = format!("sparse storage, budget {error_budget}: {name}");
            let map = Map { storage, error_budget, ..image.map() };
            let verdict = Environment::new(&map).map_err(String::from).and_then(|environment| {
                reachable(image, &environment)?;
                let text = integrates(&environment)?;
                Ok(format!("{text}; {} squares", environment.info.squares))
            });
            table.add(name, expected, verdict);
        }
    }
    for error_budget in [-1.0, f32::NAN] {
        let map = Map { storage: raw::WIS_STORAGE_SPARSE, error_budget, ..images[0].1.map() };
        let verdict = fails(Environment::new(&map), raw::WIS_INVALID_ARGUMENT);
        let name = format!("sparse storage, budget {error_budget}");
        table.add(name, "INVALID_ARGUMENT", verdict.map(|_| "INVALID_ARGUMENT".into()));
    }
}

fn sources(table: &mut Table) {
    // 65504, 2^-24 and 1 as 16-bit floats.
    let values = [0x7bff, 0x0001, 0x3c00];
    let halves: Vec<u16> = (0..64 * 32).map(|k| values[k % 3]).collect();
    let image = Image::new(64, 32, |x, y| [65504.0, 1.0 / 16_777_216.0, 1.0][((y * 64 + x) % 3) as usize]);
    let verdict = Environment::new(&Map { texels: Texels::F16(&halves), ..image.map() });
    let verdict = verdict.map_err(String::from).and_then(|environment| lit(&image, &environment));
    table.add("16-bit floats, the largest beside the smallest denormal", LEGAL, verdict);
    let rows = |y: u32| if y == 20 { null() } else { image.texels.as_ptr() };
    let verdict =
        fails(Environment::new(&Map { texels: Texels::RowsF32(&rows), ..image.map() }), raw::WIS_CALLBACK_FAILED);
    let verdict = verdict.and_then(|failure| {
        ensure(failure.diagnostic.y == 20, || format!("row {}", failure.diagnostic.y))?;
        Ok("CALLBACK_FAILED at row 20".into())
    });
    table.add("a row callback that has no row 20", "CALLBACK_FAILED and the row", verdict);
}

/// 16k x 8k, from a callback that keeps two rows, on all threads: the bits do not depend on how many.
fn huge(table: &mut Table) {
    let (name, expected) =
        ("map of 16384 x 8192, one hot texel in its last row", "legal samples; pdf > 0 at the hot texel");
    let (plain, hot) = (vec![1.0f32; 16384], {
        let mut row = vec![1.0f32; 16384];
        row[12345] = 1e8;
        row
    });
    let rows = |y: u32| if y == 8191 { hot.as_ptr() } else { plain.as_ptr() };
    let map = Map { texels: Texels::RowsF32(&rows), resolution: 256, ..Map::latlong(16384, 8192, 1, &[]) };
    match Environment::size(&map) {
        Ok(size) if available_memory().is_some_and(|free| free < 2 * (size.bytes + size.scratch_bytes) as u64) => {
            table.skip(name, expected);
        }
        _ => {
            let verdict = Environment::new(&map).map_err(String::from).and_then(|environment| {
                let light = environment.light(None);
                laws::legal(&light)?;
                let place = Image { width: 16384, height: 8192, channels: 1, texels: Vec::new() };
                laws::positive(&light, [place.centre(12345, 8191), [0.0, 0.0, 1.0]])?;
                Ok(format!("legal; power {:.5}", environment.info.power))
            });
            table.add(name, expected, verdict);
        }
    }
}
