//! Many shading points in one call: the bytes and bits of as many single calls.

use crate::support::{Environment, Memory, Random, ggx, lambert, maps, normalise, product_config, query};
use std::ptr::{null, null_mut};
use wis::ffi::wavelets::product::*;
use wis::ffi::{Diagnostic, MemorySize};
use wis::status::Status;
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
        wis_wavelet_product_prepare(
            environment.handle,
            config,
            queries.len(),
            queries.as_ptr(),
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
            for (k, single) in singles.iter().enumerate() {
                let sample = crate::support::sample(environment.handle, products.handles[k], None, u[k]);
                assert_eq!(sample, single.sample(u[k]));
                let asked = crate::support::pdf(environment.handle, products.handles[k], None, sample.wi);
                assert!(sample.pdf.to_bits() == asked.to_bits() || k % 5 == 3);
                assert_eq!(sample.pdf > 0.0, k % 5 != 3);
            }
        }
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
        assert_eq!((diagnostic.argument, diagnostic.y), (4, fault as u32));
    }
}
