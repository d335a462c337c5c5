//! Bytes and build time against the size of the map, its format and the error budget.

use anyhow::Result;
use wis_ffi_tests::client::{Block, Texels, raw};
use wis_ffi_tests::environment::{Environment, Map};
use wis_ffi_tests::light::Light;
use wis_ffi_tests::processor;

/// What a map takes.
pub struct Size {
    pub width: usize,
    pub bytes: u64,
    pub scratch: usize,
    /// Milliseconds of processor time on one core, of 32-bit and of 16-bit RGB.
    pub build: [f64; 2],
}

/// What an error budget leaves.
pub struct Budget {
    pub light: String,
    pub budget: f32,
    pub bytes: u64,
    /// As the library states it.
    pub stated: f64,
    pub deviation: f64,
}

/// Rows that the callback hands out in turn.
const ROWS: usize = 61;
/// The fastest of so many builds counts; of maps wider than `LARGE` of one.
const BUILDS: usize = 5;
const LARGE: usize = 4096;

/// Maps of each width for a bilinear client; rows come by callback.
///
/// # Errors
/// Those of the library.
pub fn sizes(widths: &[usize]) -> Result<Vec<Size>> {
    let size = |&width: &usize| {
        let (rows, halves) = rows(width);
        let row_f32 = |y: u32| rows[y as usize % ROWS].as_ptr().cast();
        let row_f16 = |y: u32| halves[y as usize % ROWS].as_ptr().cast();
        let [w, h] = [width as u32, width as u32 / 2];
        let maps = [Texels::Rows(raw::WIS_FORMAT_F32, &row_f32), Texels::Rows(raw::WIS_FORMAT_F16, &row_f16)]
            .map(|texels| Map::latlong(w, h, 3, texels));
        let mut build = [f64::INFINITY; 2];
        let asked = Environment::size(&maps[0])?;
        let mut scratch = Block::new(asked.scratch_bytes);
        let mut bytes = 0;
        for _ in 0..if width > LARGE { 1 } else { BUILDS } {
            for (map, build) in maps.iter().zip(&mut build) {
                let memory = Block::new(asked.bytes);
                let start = processor_ms();
                let built = Environment::new_in(map, memory, &mut scratch)?;
                *build = build.min(processor_ms() - start);
                bytes = built.info.bytes;
            }
        }
        drop(scratch);
        Ok(Size { width, bytes, scratch: asked.scratch_bytes, build })
    };
    widths.iter().map(size).collect()
}

/// RGB rows with detail in every texel, and the bits of the same in 16-bit floats.
fn rows(width: usize) -> (Vec<Vec<f32>>, Vec<Vec<u16>>) {
    let noise = |i: usize| ((i as u32).wrapping_mul(0x9e37_79b9) >> 20) as f32 / 4096.0;
    // 16-bit floats of the numbers from 0.5 on: exponent 14 or 15, ten bits of fraction.
    let half = |i: usize| 0x3800u16 + (noise(i) * 2047.0) as u16;
    let of = |bits: u16| f32::from_bits((u32::from(bits) << 13) + (112 << 23));
    let halves: Vec<Vec<u16>> = (0..ROWS).map(|y| (0..3 * width).map(|x| half(y * 3 * width + x)).collect()).collect();
    (halves.iter().map(|row| row.iter().map(|&bits| of(bits)).collect()).collect(), halves)
}

/// What budgets leave of lights, for their clients.
///
/// # Errors
/// Those of the library.
pub fn budgets(lights: &[Light], budgets: &[f32], points: usize) -> Result<Vec<Budget>> {
    let mut all = Vec::new();
    for light in lights {
        for &budget in budgets {
            let environment = light.tables(raw::WIS_ENVIRONMENT_LIGHT_ONLY, budget)?;
            let density = wis_ffi_tests::environment::Light::new(&environment)?;
            let deviation = super::fit::fit(light, &[&density], points)?[0].deviation();
            let (bytes, stated) = (environment.info.bytes, environment.info.error);
            all.push(Budget { light: light.name.clone(), budget, bytes, stated, deviation });
        }
    }
    Ok(all)
}

fn processor_ms() -> f64 {
    1e3 * processor::seconds()
}
