//! Batches with strides of any size give the bits of single calls.

use super::{bits, maps};
use crate::support::scenes::grid;
use crate::support::{Environment, Product, Random, build};
use std::ptr::null;
use wis::ffi::wavelets::environment::{
    EnvironmentConfig, WIS_STORAGE_SPARSE, WIS_WAVELET_LIGHT_EXACT_ZERO, WIS_WAVELET_LIGHT_NEAREST,
};
use wis::ffi::wavelets::sampling::{wis_wavelet_invert, wis_wavelet_pdf, wis_wavelet_sample};
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
    drawn: Strided<4>,
    asked: Strided<1>,
    back: Strided<2>,
}

impl Batch {
    /// Random numbers, and up to three floats of room behind each element.
    fn new(random: &mut Random, count: usize) -> Batch {
        let mut stride = |least: usize| least + random.bits() as usize % 4;
        let (u, drawn) = (Strided::new(count, stride(2)), Strided::new(count, stride(4)));
        let (asked, back) = (Strided::new(count, stride(1)), Strided::new(count, stride(2)));
        let mut batch = Batch { count, u, drawn, asked, back };
        (0..count).for_each(|k| batch.u.set(k, [random.f32(), random.f32()]));
        batch
    }

    /// Compares with single calls.
    fn check(&self, single: impl Fn([f32; 2]) -> Sample, invert: impl Fn([f32; 3]) -> Option<[f32; 2]>) {
        for k in 0..self.count {
            let [x, y, z, pdf] = self.drawn.get(k);
            assert_eq!(bits(Sample { wi: [x, y, z], pdf }), bits(single(self.u.get(k))));
            assert_eq!(pdf.to_bits(), self.asked.get(k)[0].to_bits());
            assert_eq!(Some(self.back.get(k)).filter(|u| !u[0].is_nan()), invert([x, y, z]));
        }
        assert!(self.drawn.gaps_are_untouched() && self.asked.gaps_are_untouched() && self.back.gaps_are_untouched());
    }

    /// A product, or the light alone.
    fn run(&mut self, environment: &Environment, product: Option<&Product>, matrix: &[f32; 9]) {
        let (e, p, n) = (environment.handle, product.map_or(null(), |product| product.handle), self.count);
        let (u, drawn, asked, back) = (self.u.parts(), self.drawn.parts(), self.asked.parts(), self.back.parts());
        self.back.floats.fill(f32::NAN);
        let mut statuses = vec![99; n];
        // SAFETY: all arrays have n elements.
        unsafe {
            let to = drawn.0.cast();
            assert_eq!(wis_wavelet_sample(e, p, matrix, n, u.0, u.1, to, drawn.1), Status::Ok);
            assert_eq!(wis_wavelet_pdf(e, p, matrix, n, drawn.0, drawn.1, asked.0, asked.1), Status::Ok);
            let statuses = statuses.as_mut_ptr();
            let status = wis_wavelet_invert(e, p, matrix, n, drawn.0, drawn.1, back.0, back.1, statuses);
            assert_eq!(status, Status::Ok);
        }
    }
}

/// Batches give the bits of single calls in the order of u, whatever the count and the strides.
#[test]
fn batches_are_single_calls() {
    let mut random = Random(71);
    let flags = WIS_WAVELET_LIGHT_EXACT_ZERO;
    for (map, flags) in
        maps().into_iter().flat_map(|map| [(map.clone(), flags), (map, flags | WIS_WAVELET_LIGHT_NEAREST)])
    {
        // Without filter and of a resolution that is left to the library, cells go on below.
        let environment = map.build(if flags & WIS_WAVELET_LIGHT_NEAREST != 0 { 0 } else { 64 }, flags);
        for (point, count) in grid(&map).iter().zip([0, 1, 2, 3, 7, 8, 9, 31, 64, 100].into_iter().cycle()) {
            let mut batch = Batch::new(&mut random, count);
            let product = point.prepare(&environment);
            batch.run(&environment, Some(&product), &point.world_from_map);
            batch.check(|u| product.sample(u), |wi| product.invert(wi));
            batch.run(&environment, None, &point.world_from_map);
            let matrix = Some(&point.world_from_map);
            batch.check(|u| environment.sample(matrix, u), |wi| environment.invert(matrix, wi));
        }
    }
}

/// So they do where lanes leave the heap of a tree: below cells that are refined, and in sparse trees.
#[test]
fn lanes_that_leave_the_heap_are_single_calls() {
    let mut random = Random(72);
    let mut refined = 0;
    for map in maps() {
        let flags = WIS_WAVELET_LIGHT_NEAREST;
        let sparse = EnvironmentConfig { storage: WIS_STORAGE_SPARSE, error_budget: 0.001, ..map.config(64, 0) };
        for environment in [map.build(0, flags), build(&sparse).expect("the map is valid")] {
            let cells = u64::from(environment.info.resolution).pow(2);
            refined += u32::from(environment.info.squares > cells / 3);
            for point in grid(&map).iter().take(12) {
                let mut batch = Batch::new(&mut random, 64);
                let product = point.prepare(&environment);
                batch.run(&environment, Some(&product), &point.world_from_map);
                batch.check(|u| product.sample(u), |wi| product.invert(wi));
                batch.run(&environment, None, &point.world_from_map);
                let matrix = Some(&point.world_from_map);
                batch.check(|u| environment.sample(matrix, u), |wi| environment.invert(matrix, wi));
            }
        }
    }
    assert!(refined > 0, "no map has refined cells");
}
