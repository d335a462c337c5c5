//! Products as stored bytes.

use super::{CONTENT_ID, Kind, assert_refuses, assert_rejected, light, put, word};
use crate::arguments::block::Block;
use std::mem::offset_of;
use std::ptr::{dangling, null, null_mut};
use wis::ffi::material::*;
use wis::ffi::product::*;
use wis::ffi::sampler::{SamplerConfig, SamplerObject, wis_sampler_init, wis_sampler_size};
use wis::ffi::sampling::{wis_invert, wis_pdf, wis_sample};
use wis::ffi::{Diagnostic, MemorySize};
use wis::light::guide::value;
use wis::light::parts::PARTS;
use wis::product::info::GridInfo;
use wis::product::stored::{Header, Places, QUADS, QUADS_OF_PARTS, Quad};
use wis::sample::Sample;
use wis::status::Status;

pub const KIND: Kind = Kind { name: "wis_product", objects, open, exercise, header: size_of::<Header>(), memory: 2 };

/// A material, how many cells are divided at most, and flags of the point.
type Case = (&'static [(u32, f32, f32, f32)], u32, u32);

/// Every kind of lobe, narrow ones, both sides of the surface, no division, many divided cells, and no lobe at all.
const CASES: [Case; 7] = [
    (&[(WIS_LOBE_LAMBERT, 0.0, 0.0, 0.0)], 8, 0),
    (&[(WIS_LOBE_GGX, 0.05, 0.05, 0.0)], 8, 0),
    (&[(WIS_LOBE_LAMBERT, 0.0, 0.0, 0.0), (WIS_LOBE_GGX, 0.3, 0.02, 0.0)], 24, 0),
    (&[(WIS_LOBE_GGX_TRANSMISSION, 0.1, 0.1, 1.5), (WIS_LOBE_LAMBERT_TRANSMISSION, 0.0, 0.0, 0.0)], 12, 0),
    (&[(WIS_LOBE_PHONG, 300.0, 0.0, 0.0)], 0, WIS_POINT_COSINE_INCLUDED),
    (&[], 8, WIS_POINT_WHOLE_SPHERE),
    (&[], 8, 0),
];

fn objects() -> Vec<Vec<u8>> {
    CASES.into_iter().map(|case| product(case, WIS_PRODUCT_CHECKSUM)).collect()
}

fn product(case: Case, checksum: u32) -> Vec<u8> {
    products(case, checksum, 1).remove(0)
}

/// The bytes of products that were prepared together at equal points, under the light of [`light::with`].
fn products((lobes, divided, flags): Case, checksum: u32, count: usize) -> Vec<Vec<u8>> {
    let mut material = MaterialData { size: size_of::<MaterialData>() as u32, ..MaterialData::default() };
    material.lobe_count = lobes.len() as u32;
    for (out, &(kind, a, b, eta)) in material.lobe.iter_mut().zip(lobes) {
        *out = LobeData { kind, a, b, eta };
    }
    let mut point = PointData {
        size: size_of::<PointData>() as u32,
        flags,
        material: &material,
        normal: [0.0, 0.6, 0.8],
        tangent: [1.0, 0.0, 0.0],
        wo: [0.6, 0.0, 0.8],
        weight: [[0.7, 0.6, 0.5]; WIS_MAX_LOBES],
        f0: [[0.04; 3]; WIS_MAX_LOBES],
        seed: 0,
        sample: 0,
        bounce: 0,
        visibility_key: 0,
        portal_count: 0,
        visibility: null_mut(),
        target: None,
        target_user: null_mut(),
        portals: null(),
    };
    let undivided = if divided == 0 { WIS_PRODUCT_UNDIVIDED } else { 0 };
    let size_of_config = size_of::<GridConfig>() as u32;
    let config = GridConfig { size: size_of_config, flags: undivided | checksum, divided_cells: divided, cone: 0.0 };
    let (mut need, mut offsets, mut used) = (MemorySize::default(), vec![usize::MAX; count + 1], 0);
    // SAFETY: all pointers are valid, and the block is as long as stated.
    unsafe {
        assert_eq!(wis_material_init(&mut material, null_mut()), Status::Ok);
        point.material = &material;
        let points = vec![point; count];
        assert_eq!(wis_product_size(&config, &mut need, null_mut()), Status::Ok);
        let memory = Block::unwritten(count * need.bytes);
        let (place, bytes, points) = (memory.pointer().cast(), memory.len(), points.as_ptr());
        let offset = offsets.as_mut_ptr();
        let status = light::with(|light| {
            with_sampler(|sampler| {
                wis_product_prepare(sampler, light, &config, count, points, place, bytes, offset, &mut used)
            })
        });
        assert_eq!(status, Status::Ok);
        offsets[count] = used;
        offsets.windows(2).map(|ends| memory[ends[0]..ends[1]].to_vec()).collect()
    }
}

fn with_sampler<T>(call: impl FnOnce(*mut SamplerObject) -> T) -> T {
    let config = SamplerConfig { size: size_of::<SamplerConfig>() as u32, rays: 1, ..SamplerConfig::default() };
    let (mut need, mut handle) = (MemorySize::default(), null_mut());
    // SAFETY: all pointers are valid, and the block is as long as stated.
    unsafe {
        assert_eq!(wis_sampler_size(&config, &mut need, null_mut()), Status::Ok);
        let memory = Block::unwritten(need.bytes);
        let status = wis_sampler_init(&config, memory.pointer().cast(), need.bytes, &mut handle, null_mut());
        assert_eq!(status, Status::Ok);
        call(handle)
    }
}

fn open(block: &Block, bytes: usize) -> (Status, Diagnostic) {
    light::with(|light| {
        let untouched = dangling::<ProductObject>();
        let (mut handle, mut diagnostic) = (untouched, Diagnostic::default());
        // SAFETY: all pointers are valid; the tests claim more bytes only for blocks that hold a whole object.
        let status = unsafe { wis_product_open(light, block.pointer().cast(), bytes, &mut handle, &mut diagnostic) };
        let expected = if status == Status::Ok { block.pointer().cast_const().cast() } else { untouched };
        assert_eq!(handle, expected);
        (status, diagnostic)
    })
}

/// Draws, asks for the pdf of what was drawn and for its numbers, and describes the product.
fn exercise(block: &Block) {
    let product: *const ProductObject = block.pointer().cast_const().cast();
    let u: Vec<[f32; 2]> = (0..64u32).map(|k| [k as f32 / 64.0, (k * 37 % 64) as f32 / 64.0]).collect();
    let (mut drawn, mut pdf) = (vec![Sample::default(); 64], vec![f32::NAN; 64]);
    let (mut numbers, mut status) = (vec![[0.0f32; 2]; 64], vec![0u8; 64]);
    let mut info = GridInfo { size: size_of::<GridInfo>() as u32, ..GridInfo::default() };
    let stride = size_of::<Sample>();
    light::with(|light| {
        // SAFETY: the product was opened, and the arrays are as long as stated.
        with_sampler(|sampler| unsafe {
            let (u, out) = (u.as_ptr().cast(), drawn.as_mut_ptr());
            assert_eq!(wis_sample(sampler, light, product, 64, u, 0, out, 0), Status::Ok);
            let wi = drawn.as_ptr().cast();
            assert_eq!(wis_pdf(sampler, light, product, 64, wi, stride, pdf.as_mut_ptr(), 0), Status::Ok);
            let (u, status) = (numbers.as_mut_ptr().cast(), status.as_mut_ptr());
            assert_eq!(wis_invert(sampler, light, product, 64, wi, stride, u, 0, status), Status::Ok);
            assert_eq!(wis_product_describe(light, product, &mut info), Status::Ok);
        });
    });
    for (drawn, pdf) in drawn.iter().zip(pdf) {
        assert!(drawn.wi.iter().all(|x| x.is_finite()) && (0.0..f32::INFINITY).contains(&drawn.pdf), "{drawn:?}");
        assert_eq!(drawn.pdf.to_bits(), pdf.to_bits());
    }
    assert!(info.integral.is_finite() && info.rgb.iter().all(|x| x.is_finite()), "{info:?}");
}

/// Without the checksum a product can be used, not opened.
#[test]
fn what_is_not_to_be_stored_is_refused() {
    for case in CASES {
        let bytes = product(case, 0);
        exercise(&Block::new(&bytes, 0));
        assert_eq!(KIND.open(&bytes), Status::Corrupt);
        assert_eq!(KIND.open_sealed(&bytes), Status::Ok);
    }
}

/// Products that are prepared together are the bytes of single ones, each with a checksum of its own.
#[test]
fn many_are_as_many_single_ones() {
    for case in CASES {
        assert_eq!(products(case, WIS_PRODUCT_CHECKSUM, 3), vec![product(case, WIS_PRODUCT_CHECKSUM); 3]);
    }
}

#[test]
fn another_light_is_a_mismatch() {
    let other = Block::new(&light::built(&[1.0, 2.0, 3.0, 4.0], [2, 2]), 0);
    for object in objects() {
        let (block, mut handle, mut diagnostic) = (Block::new(&object, 0), null(), Diagnostic::default());
        let (light, place) = (other.pointer().cast_const().cast(), block.pointer().cast());
        // SAFETY: all pointers are valid.
        let status = unsafe { wis_product_open(light, place, object.len(), &mut handle, &mut diagnostic) };
        assert_eq!((status, diagnostic.argument), (Status::Mismatch, 1));
    }
}

/// The parts of a product with its header.
fn places(object: &[u8]) -> Places {
    let grid = [word(object, offset_of!(Header, grid)), word(object, offset_of!(Header, grid) + 4)];
    Places::new(grid, word(object, offset_of!(Header, divided)) as usize)
}

/// The first byte of what begins behind so many quads.
fn offset(quads: usize) -> usize {
    size_of::<Header>() + size_of::<Quad>() * quads
}

/// Where F is the same everywhere, a border can move with the end of its part: all tables still follow from the leaves.
#[test]
fn borders_that_the_light_does_not_have_are_refused() {
    let even = product((&[], 8, WIS_POINT_WHOLE_SPHERE | WIS_POINT_COSINE_INCLUDED), WIS_PRODUCT_CHECKSUM);
    // Of the first cell that is divided: the end of its first part along its row, and that part's border.
    let ends = offset(places(&even).divided + QUADS_OF_PARTS);
    let (end, border) = (ends + 4 * PARTS, offset(places(&even).borders) + 2 * PARTS);
    let number = |at| f32::from_bits(word(&even, at));
    let step = |at: usize| i16::from_ne_bytes(even[at..at + 2].try_into().unwrap());
    // F is even: a part has as much of its row's sum as of its width.
    assert_eq!(number(end), value(step(border)) * number(end + 4 * (PARTS - 1)));
    assert_eq!(KIND.open_sealed(&even), Status::Ok);
    let mut alone = even.clone();
    put(&mut alone, border, &(step(border) / 2).to_ne_bytes());
    assert_rejected(KIND.open_sealed(&alone), "a border");
    let mut moved = even.clone();
    put(&mut moved, end, &(0.5 * number(end)).to_ne_bytes());
    put(&mut moved, border, &(step(border) / 2).to_ne_bytes());
    assert_rejected(KIND.open_sealed(&moved), "a border with the end of its part");
}

/// Whatever the leaves do not give, and what no point has.
#[test]
fn products_that_no_point_has() {
    let object = product(CASES[2], WIS_PRODUCT_CHECKSUM);
    let refuses = |place, value: &[u8], what: &str| assert_refuses(&KIND, &object, place, value, what);
    for value in [f32::NAN, f32::INFINITY, -1.0, 0.5] {
        refuses(offset_of!(Header, scale), &value.to_ne_bytes(), "scale");
        refuses(offset_of!(Header, axes), &value.to_ne_bytes(), "axes");
        refuses(offset_of!(Header, local_wo), &(value + 0.25).to_ne_bytes(), "wo along the axes");
        refuses(offset_of!(Header, normal), &value.to_ne_bytes(), "normal");
    }
    for value in [f32::NAN, f32::INFINITY, -1.0, 1.0] {
        refuses(offset_of!(Header, peak), &value.to_ne_bytes(), "share of lobes");
    }
    for value in [f64::NAN, f64::INFINITY, -1.0, 3.0] {
        refuses(offset_of!(Header, integral), &value.to_ne_bytes(), "integral");
        refuses(offset_of!(Header, unit), &value.to_ne_bytes(), "unit");
    }
    for value in [0u32, 1, 25, u32::MAX] {
        refuses(offset_of!(Header, divided), &value.to_ne_bytes(), "divided cells");
        refuses(offset_of!(Header, grid), &value.to_ne_bytes(), "columns of cells");
        refuses(offset_of!(Header, lobes), &value.to_ne_bytes(), "lobes");
        refuses(offset_of!(Header, lobe), &(value + u32::from(value < 9)).wrapping_add(6).to_ne_bytes(), "kind");
    }
    refuses(offset_of!(Header, flags), &4u32.to_ne_bytes(), "flags");
    // One corner of a leaf that counts: the tables no longer follow.
    let leaves = size_of::<Header>();
    let lit = (0..128 * 4).map(|k| leaves + 2 * k).find(|&at| object[at..at + 2] != [0, 0]).expect("a leaf");
    let mut changed = object.clone();
    put(&mut changed, lit, &[object[lit] ^ 0x55, object[lit + 1] ^ 0x55]);
    assert_rejected(KIND.open_sealed(&changed), "a leaf");
    let Places { tops, divided: first, borders, .. } = places(&object);
    let divided = word(&object, offset_of!(Header, divided)) as usize;
    // Sums over rows, over the quads of a row, and over the cells of a quad.
    for index in [1, 9, 41] {
        refuses(offset(tops) + 4 * index, &f32::NAN.to_ne_bytes(), "a sum");
        refuses(offset(tops) + 4 * index, &1e9f32.to_ne_bytes(), "a sum");
    }
    for value in [f32::NAN, f32::INFINITY, -1.0, 0.5] {
        refuses(offset(first + QUADS_OF_PARTS) + 4, &value.to_ne_bytes(), "ends");
    }
    // The borders of a divided cell's parts are those of the light, with nothing behind each three.
    for (border, value) in (0..QUADS * divided * 4).flat_map(|border| [1i16, -1, i16::MAX].map(|value| (border, value)))
    {
        refuses(offset(borders) + 2 * border, &value.to_ne_bytes(), "a border");
    }
    assert!(CONTENT_ID == offset_of!(Header, checksum));
}
