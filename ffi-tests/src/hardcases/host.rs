//! Hosts that flush denormals, round otherwise or unmask exceptions.

use super::failing::TILTED;
use super::laws::{Verdict, ensure, points};
use super::maps::Image;
use super::table::Table;
use crate::client::{Block, Density, Texels, raw};
use crate::environment::{Environment, Light, Map, Sampler, material};
use std::cell::RefCell;

#[cfg(target_arch = "x86_64")]
mod word {
    use std::arch::asm;

    /// The flags of past exceptions are no control.
    pub const FLAGS: u64 = 0x3f;
    pub const FLUSH: u64 = 0x9fc0;
    pub const UP: u64 = 0x5f80;
    pub const DOWN: u64 = 0x3f80;
    pub const ZERO: u64 = 0x7f80;

    pub fn read() -> u64 {
        let mut word = 0u32;
        // SAFETY: stores MXCSR.
        unsafe { asm!("stmxcsr [{}]", in(reg) &mut word, options(nostack)) };
        word.into()
    }

    pub fn write(word: u64) {
        let word = word as u32;
        // SAFETY: loads MXCSR; only the library computes before it is put back.
        unsafe { asm!("ldmxcsr [{}]", in(reg) &word, options(nostack)) };
    }
}

#[cfg(target_arch = "aarch64")]
mod word {
    use std::arch::asm;

    pub const FLAGS: u64 = 0;
    pub const FLUSH: u64 = 0x0100_0000;
    pub const UP: u64 = 0x0040_0000;
    pub const DOWN: u64 = 0x0080_0000;
    pub const ZERO: u64 = 0x00c0_0000;

    pub fn read() -> u64 {
        let word: u64;
        // SAFETY: reads FPCR.
        unsafe { asm!("mrs {}, fpcr", out(reg) word, options(nostack)) };
        word
    }

    pub fn write(word: u64) {
        // SAFETY: writes FPCR; only the library computes before it is put back.
        unsafe { asm!("msr fpcr, {}", in(reg) word, options(nostack)) };
    }
}

/// Adds the cases.
pub fn add(table: &mut Table) {
    let modes = [
        ("flushes denormals to zero, on both sides", word::FLUSH),
        ("rounds up", word::UP),
        ("rounds down", word::DOWN),
        ("rounds towards zero", word::ZERO),
    ];
    for (name, mode) in modes {
        let expected = "the bits of the default mode, on a denormal map; the mode kept";
        table.add(format!("the host {name}"), expected, unchanged(mode));
    }
}

fn unchanged(mode: u64) -> Verdict {
    let default = word::read();
    let expected = bits()?;
    word::write(mode);
    let answered = bits();
    let kept = word::read();
    word::write(default);
    ensure(kept & !word::FLAGS == mode, || format!("the control word is {kept:#x}"))?;
    ensure(answered? == expected, || "other bits".into())?;
    Ok("the same bits; kept".into())
}

/// The bits of an environment's power and of samples of it and of a product.
fn bits() -> Result<Vec<u32>, String> {
    let image = Image::new(16, 8, |x, y| f32::from_bits(1 + (x * 7 + y * 3) % 100));
    let environment = Environment::new(&Map::latlong(16, 8, 1, Texels::F32(&image.texels)))?;
    let material = material(&[raw::wis_lobe { kind: raw::WIS_LOBE_LAMBERT, ..Default::default() }])?;
    let mut point = raw::wis_point {
        size: size_of::<raw::wis_point>() as u32,
        material: &material,
        normal: TILTED,
        wo: TILTED,
        ..Default::default()
    };
    point.weight[0] = [0.8; 3];
    let (own, other) = (RefCell::new(Sampler::new(1, 0, 0)?), RefCell::new(Sampler::new(1, 0, 0)?));
    let mut memory = Block::new(0);
    let product = Light::product(&environment, &own, &point, &mut memory)?;
    let light = Light::new(&environment, &other);
    let power = environment.info.power.to_bits();
    let mut bits = vec![power as u32, (power >> 32) as u32];
    for u in points() {
        for sample in [light.sample(u)?, product.sample(u)?] {
            bits.extend(sample.wi.map(f32::to_bits));
            bits.push(sample.pdf.to_bits());
        }
    }
    Ok(bits)
}
