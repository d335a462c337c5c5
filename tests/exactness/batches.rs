//! Batches with strides of any size give the bits of single calls.

use super::{DISTRIBUTIONS, bits, maps};
use crate::support::scenes::grid;
use crate::support::{Environment, Product, Random, build};
use wis::ffi::wavelets::environment::{
    EnvironmentConfig, WIS_STORAGE_SPARSE, WIS_WAVELET_LIGHT_COMPENSATED, WIS_WAVELET_LIGHT_EXACT_ZERO,
    WIS_WAVELET_LIGHT_NEAREST, wis_wavelet_light_pdf_lanes, wis_wavelet_light_pdf_n, wis_wavelet_light_sample_lanes,
    wis_wavelet_light_sample_n,
};
use wis::ffi::wavelets::product::{
    wis_wavelet_product_pdf_lanes, wis_wavelet_product_pdf_n, wis_wavelet_product_sample_lanes,
    wis_wavelet_product_sample_n,
};
use wis::status::Status;
use wis::wavelets::descent::Sample;

/// An array of elements of `N` floats a stride apart, in which untouched floats stay NaN.
struct Strided<const N: usize> {
    floats: Vec<f32>,
    stride: usize,
}

impl<const N: usize> Strided<N> {
    fn new(count: usize, stride: usize) -> Self {
        Strided { floats: vec![f32::NAN; count * stride], stride }
    }

    fn set(&mut self, index: usize, element: [f32; N]) {
        self.floats[index * self.stride..][..N].copy_from_slice(&element);
    }

    fn get(&self, index: usize) -> [f32; N] {
        self.floats[index * self.stride..][..N].try_into().unwrap()
    }

    /// The first element and the stride in bytes.
    fn parts(&mut self) -> (*mut f32, usize) {
        (self.floats.as_mut_ptr(), 4 * self.stride)
    }

    fn gaps_are_untouched(&self) -> bool {
        self.floats.chunks(self.stride).all(|element| element[N..].iter().all(|f| f.is_nan()))
    }
}

/// The arrays of one batch.
struct Batch {
    count: usize,
    u: Strided<2>,
    wi: Strided<3>,
    pdf: Strided<1>,
    asked: Strided<1>,
}

impl Batch {
    /// Random numbers, and up to three floats of room behind each element.
    fn new(random: &mut Random, count: usize) -> Batch {
        let mut stride = |least: usize| least + random.bits() as usize % 4;
        let (u, wi) = (Strided::new(count, stride(2)), Strided::new(count, stride(3)));
        let (pdf, asked) = (Strided::new(count, stride(1)), Strided::new(count, stride(1)));
        let mut batch = Batch { count, u, wi, pdf, asked };
        (0..count).for_each(|k| batch.u.set(k, [random.f32(), random.f32()]));
        batch
    }

    /// Compares with single calls.
    fn check(&self, single: impl Fn([f32; 2]) -> Sample) {
        for k in 0..self.count {
            let [pdf] = self.pdf.get(k);
            assert_eq!(bits(Sample { wi: self.wi.get(k), pdf }), bits(single(self.u.get(k))));
            assert_eq!(pdf.to_bits(), self.asked.get(k)[0].to_bits());
        }
        assert!(self.wi.gaps_are_untouched() && self.pdf.gaps_are_untouched() && self.asked.gaps_are_untouched());
    }

    /// The baseline by the call without a level, others by name.
    fn run_product(&mut self, level: Option<u32>, product: &Product) {
        let (e, p, n) = (product.environment.handle, product.handle, self.count);
        let (u, wi, pdf) = (self.u.parts(), self.wi.parts(), self.pdf.parts());
        let asked = self.asked.parts();
        // SAFETY: all arrays have n elements.
        unsafe {
            let [sampled, asked] = match level {
                None => [
                    wis_wavelet_product_sample_n(e, p, n, u.0, u.1, wi.0, wi.1, pdf.0, pdf.1),
                    wis_wavelet_product_pdf_n(e, p, n, wi.0, wi.1, asked.0, asked.1),
                ],
                Some(l) => [
                    wis_wavelet_product_sample_lanes(e, p, l, n, u.0, u.1, wi.0, wi.1, pdf.0, pdf.1),
                    wis_wavelet_product_pdf_lanes(e, p, l, n, wi.0, wi.1, asked.0, asked.1),
                ],
            };
            assert_eq!((sampled, asked), (Status::Ok, Status::Ok));
        }
    }

    fn run_light(&mut self, level: Option<u32>, environment: &Environment, distribution: u32, matrix: &[f32; 9]) {
        let (e, d, n) = (environment.handle, distribution, self.count);
        let (u, wi, pdf) = (self.u.parts(), self.wi.parts(), self.pdf.parts());
        let asked = self.asked.parts();
        // SAFETY: all arrays have n elements.
        unsafe {
            let [sampled, asked] = match level {
                None => [
                    wis_wavelet_light_sample_n(e, d, matrix, n, u.0, u.1, wi.0, wi.1, pdf.0, pdf.1),
                    wis_wavelet_light_pdf_n(e, d, matrix, n, wi.0, wi.1, asked.0, asked.1),
                ],
                Some(l) => [
                    wis_wavelet_light_sample_lanes(e, d, matrix, l, n, u.0, u.1, wi.0, wi.1, pdf.0, pdf.1),
                    wis_wavelet_light_pdf_lanes(e, d, matrix, l, n, wi.0, wi.1, asked.0, asked.1),
                ],
            };
            assert_eq!((sampled, asked), (Status::Ok, Status::Ok));
        }
    }
}

/// Batches give the bits of single calls in the order of u, whatever the count and the strides.
#[test]
fn batches_are_single_calls() {
    let mut random = Random(71);
    let flags = WIS_WAVELET_LIGHT_EXACT_ZERO | WIS_WAVELET_LIGHT_COMPENSATED;
    for (map, flags) in
        maps().into_iter().flat_map(|map| [(map.clone(), flags), (map, flags | WIS_WAVELET_LIGHT_NEAREST)])
    {
        // Without filter and of a resolution that is left to the library, the compensated distribution keeps texels.
        let environment = map.build(if flags & WIS_WAVELET_LIGHT_NEAREST != 0 { 0 } else { 64 }, flags);
        for (point, count) in grid(&map).iter().zip([0, 1, 2, 3, 7, 8, 9, 31, 64, 100].into_iter().cycle()) {
            let mut batch = Batch::new(&mut random, count);
            let product = point.prepare(&environment);
            for level in [None, Some(0), Some(wis::simd::detect())] {
                batch.run_product(level, &product);
                batch.check(|u| product.sample(u));
                for distribution in DISTRIBUTIONS {
                    batch.run_light(level, &environment, distribution, &point.world_from_map);
                    batch.check(|u| environment.sample(distribution, Some(&point.world_from_map), u));
                }
            }
        }
    }
}

/// So they do where lanes leave the heap of a tree: below cells that are refined, and in sparse trees.
#[test]
fn lanes_that_leave_the_heap_are_single_calls() {
    let mut random = Random(72);
    let mut refined = 0;
    for map in maps() {
        let flags = WIS_WAVELET_LIGHT_NEAREST | WIS_WAVELET_LIGHT_COMPENSATED;
        let sparse = EnvironmentConfig {
            storage: WIS_STORAGE_SPARSE,
            error_budget: 0.001,
            ..map.config(64, WIS_WAVELET_LIGHT_COMPENSATED)
        };
        for environment in [map.build(0, flags), build(&sparse).expect("the map is valid")] {
            let cells = u64::from(environment.info.resolution).pow(2);
            refined += u32::from(environment.info.squares > cells / 3);
            for point in grid(&map).iter().take(12) {
                let mut batch = Batch::new(&mut random, 64);
                let product = point.prepare(&environment);
                for level in [None, Some(wis::simd::detect())] {
                    batch.run_product(level, &product);
                    batch.check(|u| product.sample(u));
                    for distribution in DISTRIBUTIONS {
                        batch.run_light(level, &environment, distribution, &point.world_from_map);
                        batch.check(|u| environment.sample(distribution, Some(&point.world_from_map), u));
                    }
                }
            }
        }
    }
    assert!(refined > 0, "no map has refined cells");
}
