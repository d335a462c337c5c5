//! Hosts that flush denormals or round otherwise get the same bits, and their control word back (MXCSR of x86-64).

use super::determinism::colourful;
use crate::support::scenes::{ShadingPoint, grid};
use crate::support::{Map, Random, eval};
use std::arch::asm;
use wis::ffi::wavelets::environment::WIS_WAVELET_LIGHT_RGB;

const DEFAULT: u32 = 0x1f80;
/// Denormal results and operands count as 0.
const FLUSH: u32 = 0x8040;
/// Flushing, and rounding down, up (with flushing) and towards 0.
const UNUSUAL: [u32; 4] = [DEFAULT | FLUSH, DEFAULT | 0x2000, DEFAULT | FLUSH | 0x4000, DEFAULT | 0x6000];
/// The bits that record past exceptions.
const RECORD: u32 = 0x3f;

fn read() -> u32 {
    let mut word = 0u32;
    // SAFETY: stores the word into a local.
    unsafe { asm!("stmxcsr [{}]", in(reg) &mut word, options(nostack)) };
    word
}

fn write(word: u32) {
    // SAFETY: the word masks all exceptions.
    unsafe { asm!("ldmxcsr [{}]", in(reg) &word, options(nostack)) };
}

/// Runs something under a control word, and gives its result and the control bits that it left.
fn under<T>(word: u32, run: impl FnOnce() -> T) -> (T, u32) {
    let host = read();
    write(word);
    let result = run();
    let left = read();
    write(host);
    (result, left & !RECORD)
}

/// Everything that a map and a shading point lead to, as bits: environment, product, and what is asked of them.
fn everything(map: &Map, point: &ShadingPoint, u: &[[f32; 2]]) -> (Vec<u8>, Vec<u8>, Vec<u64>) {
    let environment = map.build(32, WIS_WAVELET_LIGHT_RGB);
    let product = point.prepare(&environment);
    let matrix = Some(&point.world_from_map);
    let mut words = vec![environment.info.power.to_bits()];
    words.push(product.estimate().to_bits());
    words.extend(product.estimate_rgb().map(f64::to_bits));
    for &u in u {
        for sample in [product.sample(u)].into_iter().chain([environment.sample(matrix, u)]) {
            let wi = sample.wi;
            let back = [product.invert(wi), environment.invert(matrix, wi)];
            let pdf = [sample.pdf, product.pdf(wi), environment.pdf(matrix, wi)];
            let back = back.into_iter().flatten().flatten();
            let floats = wi.into_iter().chain(pdf).chain(eval(&point.query, wi)).chain(back);
            words.extend(floats.map(|f| u64::from(f.to_bits())));
        }
    }
    (environment.bytes().to_vec(), product.bytes().to_vec(), words)
}

#[test]
fn the_control_word_of_the_host_does_not_matter() {
    let mut random = Random(89);
    let mut map = colourful();
    map.pixels.iter_mut().step_by(7).for_each(|p| *p *= 1e-38);
    for point in &grid(&map) {
        let u: Vec<[f32; 2]> = (0..50).map(|_| [random.f32(), random.f32()]).collect();
        let usual = everything(&map, point, &u);
        for word in UNUSUAL {
            let (unusual, left) = under(word, || everything(&map, point, &u));
            assert!(usual == unusual, "control word {word:#x}");
            assert_eq!(left, word, "the control word is not put back");
        }
    }
}
