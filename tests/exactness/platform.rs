//! Every platform computes the same bits: digests of environments, products, samples and pdfs, on record. Where the
//! library is changed on purpose they change, on all platforms alike (`make check-aarch64` looks at another).

use super::bits;
use crate::support::{Environment, Map, build, ggx, lambert, product_config, query};
use wis::ffi::wavelets::environment::{
    EnvironmentConfig, WIS_STORAGE_SPARSE, WIS_WAVELET_LIGHT_NEAREST, WIS_WAVELET_LIGHT_RGB,
};
use wis::ffi::wavelets::product::ProductConfig;
use wis::numeric::ContentHash;
use wis::points::sobol;
use wis::wavelets::query::{Lobe, WIS_WAVELET_LOBE_PHONG};

/// A map made by sums and products alone: the mathematical functions of a platform are not the library's.
fn map() -> Map {
    Map::latlong(96, 48, |x, y| {
        let bright = if (x + 96 * y) % 211 == 0 { 700.0 } else { 0.0 };
        0.1 + ((x * 7 + y * 13) % 17) as f32 * 0.3 + bright
    })
}

/// The digest of bytes. Memory is read as the numbers of little-endian processors.
fn digest(bytes: &[u8]) -> u64 {
    let mut hash = ContentHash::new();
    for eight in bytes.chunks(8) {
        let mut word = [0; 8];
        word[..eight.len()].copy_from_slice(eight);
        hash.add(u64::from_le_bytes(word));
    }
    hash.finish()
}

fn lobes() -> [Vec<Lobe>; 5] {
    let phong = Lobe { kind: WIS_WAVELET_LOBE_PHONG, a: 300.0, ..lambert(0.9) };
    [vec![lambert(0.8)], vec![ggx(0.5)], vec![ggx(0.2), lambert(0.1)], vec![ggx(0.01)], vec![phong]]
}

/// Adds the digest of a product for each material, and that of what is drawn from them.
fn add_products(environment: &Environment, digests: &mut Vec<u64>) {
    let world_from_map = [0.6, -0.8, 0.0, 0.8, 0.6, 0.0, 0.0, 0.0, 1.0];
    let config = ProductConfig { world_from_map: world_from_map.as_ptr(), ..product_config() };
    let mut drawn = ContentHash::new();
    for lobes in lobes() {
        let product = environment.prepare(&query([0.6, 0.0, 0.8], [0.36, 0.48, 0.8], &lobes), &config);
        for i in 0..200 {
            let sample = product.sample(sobol(7, i));
            bits(sample).into_iter().for_each(|word| drawn.add(word.into()));
            drawn.add(product.pdf(sample.wi).to_bits().into());
        }
        digests.push(digest(product.bytes()));
    }
    digests.push(drawn.finish());
}

/// Environments in both storages, what is drawn from the first, and products of each.
#[test]
fn bits_are_on_record() {
    const RECORD: [u64; 17] = [
        0x03d1_7337_011e_d91f,
        0x75b7_d09e_f752_e587,
        0x1aa2_5ae8_6d2f_6e19,
        0x706e_7737_7c56_402d,
        0x54d0_a50d_f030_7b29,
        0x3523_7c16_78fc_0d9b,
        0x8999_689e_743f_f217,
        0x136d_98b1_d07f_d535,
        0x735a_5e3d_49ac_6fd1,
        0xf83e_8310_83e7_465f,
        0xfcda_c39e_b560_425f,
        0x64f3_ff53_3f56_7d91,
        0xfdee_9420_962b_af27,
        0xd76c_85d5_1244_1e35,
        0xb3d6_0eb6_6650_1b25,
        0xb268_c361_5e4e_5137,
        0x912b_8b59_7037_5313,
    ];
    let map = map();
    let config = map.config(64, WIS_WAVELET_LIGHT_RGB);
    let sparse = EnvironmentConfig { storage: WIS_STORAGE_SPARSE, error_budget: 0.01, ..config };
    let environments = [config, sparse].map(|config| build(&config).unwrap());
    let mut digests: Vec<u64> = environments.iter().map(|environment| digest(environment.bytes())).collect();
    let mut drawn = ContentHash::new();
    for i in 0..200 {
        let sample = environments[0].sample(None, sobol(3, i));
        bits(sample).into_iter().for_each(|word| drawn.add(word.into()));
    }
    digests.push(drawn.finish());
    environments.iter().for_each(|environment| add_products(environment, &mut digests));
    // Cells that go on below.
    let natural = map.build(0, WIS_WAVELET_LIGHT_NEAREST);
    let mut drawn = ContentHash::new();
    for i in 0..200 {
        let sample = natural.sample(None, sobol(5, i));
        bits(sample).into_iter().for_each(|word| drawn.add(word.into()));
    }
    digests.extend([digest(natural.bytes()), drawn.finish()]);
    assert!(digests == RECORD, "{digests:#018x?}");
}
