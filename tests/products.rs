//! Many shading points in one call: the bytes and bits of as many single calls.

use crate::support::{Environment, Memory, Random, ggx, lambert, maps, normalise, product_config, query};
use std::ptr::{null, null_mut};
use wis::ffi::wavelets::product::*;
use wis::ffi::wavelets::products::*;
use wis::ffi::{Diagnostic, MemorySize};
use wis::status::Status;
use wis::wavelets::descent::Sample;
use wis::wavelets::query::Query;

/// Shading points of every kind, one in five of which reflects nothing.
fn queries(count: usize) -> Vec<Query> {
    let mut random = Random(5);
    let lobes = [vec![lambert(0.7)], vec![ggx(0.3)], vec![ggx(0.04)], vec![], vec![lambert(0.2), ggx(0.1)]];
    let query = |k: usize| {
        let normal = random.direction();
        let wo = random.direction();
        let upper: f64 = normal.iter().zip(&wo).map(|(n, w)| n * w).sum();
        query(normalise(normal), normalise(wo.map(|w| if upper < 0.0 { -w } else { w })), &lobes[k % 5])
    };
    (0..count).map(query).collect()
}

/// Products in one block.
struct Products {
    memory: Memory,
    each: usize,
    handles: Vec<*const Product>,
}

fn size(config: &ProductConfig) -> MemorySize {
    let mut size = MemorySize::default();
    // SAFETY: both are live.
    assert_eq!(unsafe { wis_wavelet_product_size(config, &mut size, null_mut()) }, Status::Ok);
    size
}

fn prepare(environment: &Environment, queries: &[Query], config: &ProductConfig) -> Result<Products, Diagnostic> {
    let each = size(config).bytes;
    let mut memory = Memory::filled(each * queries.len(), 0xa5);
    let mut handles = vec![null(); queries.len()];
    let mut diagnostic = Diagnostic::default();
    // SAFETY: the block is as long as stated, and the arrays hold an element for each query.
    let status = unsafe {
        wis_wavelet_products_prepare(
            environment.handle,
            queries.len(),
            queries.as_ptr(),
            config,
            memory.pointer(),
            each * queries.len(),
            handles.as_mut_ptr(),
            &mut diagnostic,
        )
    };
    if status == Status::Ok { Ok(Products { memory, each, handles }) } else { Err(diagnostic) }
}

#[test]
fn many_are_as_many_single_calls() {
    let environment = maps::sun(64, 32).build(64, 0);
    let turned = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut random = Random(9);
    for count in [1, 2, 7, 8, 9, 37] {
        for frame in [null(), turned.as_ptr()] {
            let config = ProductConfig { world_from_map: frame, ..product_config() };
            let queries = queries(count);
            let products = prepare(&environment, &queries, &config).unwrap();
            let singles: Vec<_> = queries.iter().map(|query| environment.prepare(query, &config)).collect();
            for (k, single) in singles.iter().enumerate() {
                assert_eq!(products.handles[k].addr(), products.memory.bytes().as_ptr().addr() + k * products.each);
                let bytes = single.info().bytes as usize;
                assert!(products.memory.bytes()[k * products.each..][..bytes] == single.bytes()[..bytes], "{k}");
            }
            let u: Vec<[f32; 2]> = (0..count).map(|_| [random.f32(), random.f32()]).collect();
            // One float of room behind each direction.
            let (mut wi, mut pdf, mut asked) = (vec![[f32::NAN; 4]; count], vec![f32::NAN; count], vec![0.0; count]);
            let (light, handles) = (environment.handle, products.handles.as_ptr());
            let (place, stride) = (wi.as_mut_ptr().cast(), 16);
            // SAFETY: all arrays hold an element for each product.
            unsafe {
                let random = u.as_ptr().cast();
                let status =
                    wis_wavelet_products_sample(light, count, handles, random, 0, place, stride, pdf.as_mut_ptr(), 0);
                assert_eq!(status, Status::Ok);
                let status = wis_wavelet_products_pdf(light, count, handles, place, stride, asked.as_mut_ptr(), 0);
                assert_eq!(status, Status::Ok);
            }
            let (mut wider, mut wider_pdf, level) = (vec![[0.0f32; 3]; count], vec![0.0; count], wis::simd::detect());
            let (place, probability) = (wider.as_mut_ptr().cast(), wider_pdf.as_mut_ptr());
            // SAFETY: as above.
            unsafe {
                let random = u.as_ptr().cast();
                let sampled = wis_wavelet_products_sample_lanes(
                    light,
                    level,
                    count,
                    handles,
                    random,
                    0,
                    place,
                    0,
                    probability,
                    0,
                );
                assert_eq!(sampled, Status::Ok);
                assert!(wider_pdf.iter().zip(&pdf).all(|(a, b)| a.to_bits() == b.to_bits()));
                assert!(wider.iter().zip(&wi).all(|(a, b)| a[..] == b[..3]));
                let asked = wis_wavelet_products_pdf_lanes(light, level, count, handles, place, 0, probability, 0);
                assert_eq!(asked, Status::Ok);
                assert!(wider_pdf.iter().zip(&pdf).all(|(a, b)| a.to_bits() == b.to_bits()));
            }
            for (k, single) in singles.iter().enumerate() {
                let expected = single.sample(u[k]);
                let [x, y, z, gap] = wi[k];
                assert_eq!(Sample { wi: [x, y, z], pdf: pdf[k] }, expected);
                assert_eq!(pdf[k].to_bits(), asked[k].to_bits());
                assert_eq!(pdf[k] > 0.0, k % 5 != 3);
                assert!(gap.is_nan());
            }
        }
    }
}

/// Products that turn the map differently cannot share lanes; they share a call.
#[test]
fn frames_may_differ() {
    let environment = maps::sun(64, 32).build(64, 0);
    let turned = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let queries = queries(6);
    let config = |k: usize| ProductConfig {
        world_from_map: if k % 2 == 0 { null() } else { turned.as_ptr() },
        ..product_config()
    };
    let products: Vec<_> = queries.iter().enumerate().map(|(k, q)| environment.prepare(q, &config(k))).collect();
    let handles: Vec<_> = products.iter().map(|product| product.handle).collect();
    let u = [[0.3f32, 0.6]; 6];
    let (mut wi, mut pdf, mut asked) = ([[0.0f32; 3]; 6], [0.0f32; 6], [0.0f32; 6]);
    let place = wi.as_mut_ptr().cast();
    // SAFETY: all arrays hold six elements.
    unsafe {
        let (light, handles, u) = (environment.handle, handles.as_ptr(), u.as_ptr().cast());
        assert_eq!(wis_wavelet_products_sample(light, 6, handles, u, 0, place, 0, pdf.as_mut_ptr(), 0), Status::Ok);
        assert_eq!(wis_wavelet_products_pdf(light, 6, handles, place, 0, asked.as_mut_ptr(), 0), Status::Ok);
    }
    for (k, product) in products.iter().enumerate() {
        assert_eq!(Sample { wi: wi[k], pdf: pdf[k] }, product.sample(u[k]));
        assert_eq!(pdf[k].to_bits(), asked[k].to_bits());
    }
}

#[test]
fn a_query_at_fault_is_named() {
    let environment = maps::sun(64, 32).build(64, 0);
    for (fault, spoil) in [
        (3, (|query| query.normal = [0.0; 3]) as fn(&mut Query)),
        (0, |query| query.lobe_count = 9),
        (4, |query| query.size = 1),
    ] {
        let mut queries = queries(5);
        spoil(&mut queries[fault]);
        let diagnostic = prepare(&environment, &queries, &product_config()).err().unwrap();
        assert_eq!((diagnostic.argument, diagnostic.y), (3, fault as u32));
    }
}
