//! Environments as stored bytes.

use super::{BYTES, Kind, NO_AMOUNTS, NO_LINKS, add_links, add_words, assert_refuses, long, put, word};
use crate::arguments::block::{Block, SENTINEL};
use crate::support::{Map, build, ggx, invert, lambert, pdf, product_config, query, sample};
use std::mem::offset_of;
use std::ptr::{dangling, null, null_mut};
use wis::ffi::wavelets::environment::*;
use wis::ffi::wavelets::product::*;
use wis::ffi::{Diagnostic, MemorySize};
use wis::numeric::ContentHash;
use wis::status::Status;
use wis::wavelets::environment::Header;

pub const KIND: Kind = Kind { objects, open, content_id, exercise, header: size_of::<Header>(), memory: 1 };

const SQUARES: usize = size_of::<Header>();

const ALL: u32 = WIS_WAVELET_LIGHT_RGB;

/// Some maps, with every storage, layout and flag.
fn objects() -> Vec<Vec<u8>> {
    let mut objects = vec![
        object(|c| c.storage = WIS_STORAGE_PYRAMID, varied),
        object(|c| (c.flags, c.resolution) = (WIS_WAVELET_LIGHT_EXACT_ZERO, 1), varied),
        object(|c| (c.resolution, c.error_budget) = (8, 0.05), varied),
        object(|c| (c.flags, c.error_budget) = (0, 0.1), varied),
        object(|c| c.error_budget = 1e30, varied),
        refined(),
        natural(),
        natural_cube(),
        object(|c| c.flags = ALL | WIS_WAVELET_LIGHT_SANITISE, |i| if i == 7 { f32::NAN } else { varied(i) }),
    ];
    for storage in [WIS_STORAGE_PYRAMID, WIS_STORAGE_SPARSE] {
        for (layout, width, height) in
            [(WIS_LAYOUT_LATLONG, 5, 3), (WIS_LAYOUT_CUBE, 2, 12), (WIS_LAYOUT_OCTAHEDRAL, 3, 3)]
        {
            for value in [0.0, 1e-45, f32::MAX] {
                let edit = |c: &mut EnvironmentConfig| {
                    (c.storage, c.layout, c.width, c.height, c.resolution) = (storage, layout, width, height, 2);
                };
                objects.push(object(edit, |_| value));
            }
        }
    }
    objects
}

fn varied(i: u32) -> f32 {
    0.1 + (i * i % 17) as f32
}

/// The bytes of an environment: sparse, of 5 x 3 texels, unless edited.
fn object(edit: impl FnOnce(&mut EnvironmentConfig), texel: impl Fn(u32) -> f32) -> Vec<u8> {
    let mut config = Map::latlong(5, 3, |_, _| 0.0).config(4, ALL);
    (config.channels, config.storage) = (3, WIS_STORAGE_SPARSE);
    edit(&mut config);
    let pixels: Vec<f32> = (0..config.width * config.height * config.channels).map(texel).collect();
    config.pixels = pixels.as_ptr().cast();
    let environment = build(&config).unwrap();
    environment.memory.bytes()[..environment.info.bytes as usize].to_vec()
}

fn open(block: &Block, bytes: usize) -> (Status, Diagnostic) {
    let untouched = dangling::<Environment>();
    let mut handle = untouched;
    let size = size_of::<EnvironmentInfo>() as u32;
    let mut info = EnvironmentInfo { size, content_id: SENTINEL.into(), ..EnvironmentInfo::default() };
    let mut diagnostic = Diagnostic::default();
    // SAFETY: all pointers are valid; the tests claim more bytes only for blocks that hold a whole object.
    let status =
        unsafe { wis_wavelet_light_open(block.pointer().cast(), bytes, &mut handle, &mut info, &mut diagnostic) };
    let is_written = [handle != untouched, info.content_id != SENTINEL.into()];
    assert_eq!(is_written, [status == Status::Ok; 2]);
    assert!(status != Status::Ok || handle == block.pointer().cast_const().cast());
    (status, diagnostic)
}

/// Where the parts behind the header stand, and where they end.
struct Parts {
    marks: usize,
    links: usize,
    rgb: usize,
    end: usize,
}

impl Parts {
    fn of(bytes: &[u8]) -> Parts {
        let squares = word(bytes, offset_of!(Header, squares)) as usize;
        let flags = word(bytes, offset_of!(Header, flags));
        let when = |condition: bool, bytes_each: usize| {
            if condition { (squares * bytes_each).next_multiple_of(16) } else { 0 }
        };
        let refined = word(bytes, offset_of!(Header, refined)) as usize;
        let cells = 4usize.saturating_pow(word(bytes, offset_of!(Header, depth)));
        let marks = SQUARES + 16 * squares;
        let links = marks.saturating_add(if refined > 0 {
            cells.div_ceil(32).saturating_mul(8).saturating_add(8) & !15
        } else {
            0
        });
        let sparse = word(bytes, offset_of!(Header, storage)) == WIS_STORAGE_SPARSE;
        let rgb = links.saturating_add(if sparse { when(true, 8) } else { (8 * refined).next_multiple_of(16) });
        let end = rgb.saturating_add(when(flags & WIS_WAVELET_LIGHT_RGB != 0, 48));
        Parts { marks, links, rgb, end }
    }

    /// How many marks and links there are.
    fn counts(bytes: &[u8]) -> [usize; 2] {
        let refined = word(bytes, offset_of!(Header, refined)) as usize;
        let cells = 4usize.saturating_pow(word(bytes, offset_of!(Header, depth)));
        if word(bytes, offset_of!(Header, storage)) == WIS_STORAGE_SPARSE {
            [0, word(bytes, offset_of!(Header, squares)) as usize]
        } else {
            [if refined > 0 { cells.div_ceil(32) } else { 0 }, refined]
        }
    }
}

fn content_id(bytes: &[u8]) -> Option<u64> {
    let header = bytes.get(..SQUARES)?;
    let mut hash = ContentHash::new();
    for offset in [0, BYTES, offset_of!(Header, sanitised), offset_of!(Header, power), offset_of!(Header, error)] {
        hash.add(long(header, offset));
    }
    hash.add(i64::from(word(header, offset_of!(Header, exponent)) as i32) as u64);
    for offset in [
        offset_of!(Header, storage),
        offset_of!(Header, flags),
        offset_of!(Header, depth),
        offset_of!(Header, squares),
        offset_of!(Header, refined),
        offset_of!(Header, average),
    ] {
        hash.add(word(header, offset).into());
    }
    add_words(&mut hash, header, offset_of!(Header, rgb_average), 3)?;
    let (parts, squares) = (Parts::of(bytes), word(header, offset_of!(Header, squares)) as usize);
    add_words(&mut hash, bytes, SQUARES, 4 * squares)?;
    let [marks, links] = Parts::counts(bytes);
    // A mark is hashed as a link is, but with its halves the other way round.
    let words = bytes.get(parts.marks..parts.marks.checked_add(marks.checked_mul(8)?)?)?;
    words.chunks_exact(8).for_each(|mark| hash.add(u64::from(word(mark, 4)) << 32 | u64::from(word(mark, 0))));
    add_links(&mut hash, bytes, parts.links, links)?;
    add_words(&mut hash, bytes, parts.rgb, (parts.end - parts.rgb) / 4)?;
    Some(hash.finish())
}

const RANDOM: [[f32; 2]; 5] = [[0.0, 0.0], [0.5, 0.25], [0.99, 0.99], [0.1, 0.8], [0.7, 0.3]];

/// Samples the light and a product with it.
fn exercise(block: &Block) {
    let handle = block.pointer().cast_const().cast::<Environment>();
    RANDOM.into_iter().for_each(|u| exercise_light(handle, u));
    exercise_product(handle);
}

fn exercise_light(handle: *const Environment, u: [f32; 2]) {
    let drawn = sample(handle, null(), None, u);
    if drawn.pdf != 0.0 {
        assert_eq!(pdf(handle, null(), None, drawn.wi).to_bits(), drawn.pdf.to_bits());
        invert(handle, null(), None, drawn.wi);
    }
}

fn exercise_product(environment: *const Environment) {
    let config = ProductConfig { max_squares: 24, ..product_config() };
    let query = query([0.0, 0.6, 0.8], [0.0, 0.0, 1.0], &[lambert(0.5), ggx(0.1)]);
    let mut size = MemorySize::default();
    let mut product = null();
    let (mut info, mut rgb) = (ProductInfo { size: size_of::<ProductInfo>() as u32, ..Default::default() }, [0.0; 3]);
    // SAFETY: all pointers are valid, the handle was opened.
    unsafe {
        assert_eq!(wis_wavelet_product_size(&config, &mut size, null_mut()), Status::Ok);
        let memory = Block::unwritten(size.bytes);
        let (place, bytes, none) = (memory.pointer().cast(), size.bytes, null_mut());
        let status = wis_wavelet_product_prepare(environment, &config, 1, &query, place, bytes, &mut product, none);
        assert_eq!(status, Status::Ok);
        assert_eq!(wis_wavelet_product_describe(environment, product, &mut info), Status::Ok);
        let status = wis_wavelet_product_estimate_rgb(environment, product, null(), &mut rgb);
        assert!(matches!(status, Status::Ok | Status::NotBuilt));
        for u in RANDOM {
            let drawn = sample(environment, product, None, u);
            if drawn.pdf != 0.0 {
                invert(environment, product, None, drawn.wi);
            }
        }
    }
}

/// What the library writes itself is finite throughout, also for the darkest and the brightest maps.
#[test]
fn estimates_are_finite() {
    for object in objects() {
        let block = Block::new(&object, 0);
        let environment = crate::support::Environment {
            memory: crate::support::Memory::new(0),
            handle: block.pointer().cast_const().cast(),
            info: EnvironmentInfo::default(),
        };
        let query = query([0.0, 0.6, 0.8], [0.0, 0.0, 1.0], &[lambert(0.5), ggx(0.1)]);
        let product = environment.prepare(&query, &product_config());
        assert!(product.estimate().is_finite());
        for u in RANDOM {
            let sample = product.sample(u);
            assert!(sample.pdf == 0.0 || product.pdf(sample.wi).to_bits() == sample.pdf.to_bits());
            assert!(sample.pdf.is_finite());
        }
    }
}

fn sparse() -> Vec<u8> {
    object(|c| c.resolution = 8, varied)
}

fn pyramid() -> Vec<u8> {
    object(|c| c.storage = WIS_STORAGE_PYRAMID, varied)
}

/// A pyramid whose cells go on below.
fn refined() -> Vec<u8> {
    let edit = |c: &mut EnvironmentConfig| {
        (c.storage, c.layout, c.width, c.height) = (WIS_STORAGE_PYRAMID, WIS_LAYOUT_OCTAHEDRAL, 6, 6);
        (c.resolution, c.flags) = (0, ALL | WIS_WAVELET_LIGHT_NEAREST);
    };
    // Little enough to end after two levels.
    object(edit, |i| if i / 3 == 14 { 1.9 } else { 1.0 })
}

/// A pyramid of a resolution that is left to the library.
fn natural() -> Vec<u8> {
    object(|c| (c.storage, c.resolution, c.flags) = (WIS_STORAGE_PYRAMID, 0, ALL | WIS_WAVELET_LIGHT_NEAREST), varied)
}

/// The same of a cube map.
fn natural_cube() -> Vec<u8> {
    let size = |c: &mut EnvironmentConfig| (c.layout, c.width, c.height) = (WIS_LAYOUT_CUBE, 2, 12);
    let edit = |c: &mut EnvironmentConfig| {
        size(c);
        (c.storage, c.resolution, c.flags) = (WIS_STORAGE_PYRAMID, 0, ALL | WIS_WAVELET_LIGHT_NEAREST);
    };
    object(edit, varied)
}

/// Marks and links of refined cells that lead nowhere, twice to the same square, or back.
#[test]
fn refinements() {
    let object = refined();
    let (parts, [marks, links]) = (Parts::of(&object), Parts::counts(&object));
    assert!(marks == 2 && (9..99).contains(&links), "{marks} {links}");
    for mark in 0..marks {
        for (offset, number) in [(0, 0), (0, u32::MAX), (4, 1000), (4, u32::MAX)] {
            if word(&object, parts.marks + 8 * mark + offset) == number {
                continue;
            }
            assert_refuses(&KIND, &object, parts.marks + 8 * mark + offset, &u32::to_ne_bytes(number), "mark");
        }
    }
    for link in (0..links).filter(|link| word(&object, parts.links + 8 * link + 4) != 0) {
        for number in [0, 1, links as u32, u32::MAX] {
            assert_refuses(&KIND, &object, parts.links + 8 * link, &number.to_ne_bytes(), "link");
        }
        assert_refuses(&KIND, &object, parts.links + 8 * link + 4, &16u32.to_ne_bytes(), "mask");
    }
    for number in [0, 1, links as u32 - 1, links as u32 + 1, u32::MAX] {
        assert_refuses(&KIND, &object, offset_of!(Header, refined), &number.to_ne_bytes(), "refined");
    }
}

/// Numbers that cannot be, wherever they stand.
#[test]
fn amounts() {
    let constant = object(|c| (c.flags, c.error_budget) = (0, 1e30), varied);
    assert_eq!(constant.len(), SQUARES);
    for object in [sparse(), pyramid(), constant] {
        let parts = Parts::of(&object);
        for no_amount in NO_AMOUNTS {
            for offset in [offset_of!(Header, power), offset_of!(Header, error)] {
                assert_refuses(&KIND, &object, offset, &no_amount.to_ne_bytes(), "power or error");
            }
            let average = offset_of!(Header, average);
            for offset in (average..offset_of!(Header, refined)).step_by(4) {
                assert_refuses(&KIND, &object, offset, &(no_amount as f32).to_ne_bytes(), "average");
            }
            for offset in (SQUARES..parts.marks).chain(parts.rgb..parts.end).step_by(4) {
                assert_refuses(&KIND, &object, offset, &(no_amount as f32).to_ne_bytes(), "square");
            }
        }
    }
}

#[test]
fn headers() {
    for object in [sparse(), pyramid()] {
        for (offset, numbers) in [
            (offset_of!(Header, storage), &[0, 3, u32::MAX][..]),
            (offset_of!(Header, flags), &[16, 1 << 31, u32::MAX, 0, WIS_WAVELET_LIGHT_NEAREST]),
            (offset_of!(Header, depth), &[0, 1, 13, 32, u32::MAX]),
            (offset_of!(Header, squares), &[0, 1, 4, 6, 1_000_000, 1 << 31, u32::MAX]),
            (offset_of!(Header, reserved), &[1, u32::MAX]),
            (BYTES, &[0, 95, 96, 1_000_000, u32::MAX]),
            (0, &[0, 1, u32::MAX]),
        ] {
            for number in numbers {
                assert_refuses(&KIND, &object, offset, &number.to_ne_bytes(), &format!("{offset}: {number}"));
            }
        }
    }
}

/// One kind of storage under the name of the other, and a depth that the squares do not have.
#[test]
fn other_storage() {
    let constant = object(|c| (c.flags, c.error_budget) = (0, 1e30), varied);
    assert_refuses(&KIND, &constant, offset_of!(Header, storage), &WIS_STORAGE_PYRAMID.to_ne_bytes(), "a pyramid");
    let plain = object(|c| (c.flags, c.storage) = (0, WIS_STORAGE_PYRAMID), varied);
    let mut renamed = plain.clone();
    put(&mut renamed, offset_of!(Header, storage), &WIS_STORAGE_SPARSE.to_ne_bytes());
    renamed.resize(plain.len() + 48, 0);
    let len = renamed.len() as u64;
    assert_refuses(&KIND, &renamed, BYTES, &len.to_ne_bytes(), "links that are all 0");
    let deep = object(|c| (c.flags, c.storage, c.resolution) = (0, WIS_STORAGE_PYRAMID, 1), varied);
    for depth in 1..=12u32 {
        assert_refuses(&KIND, &deep, offset_of!(Header, depth), &depth.to_ne_bytes(), "no squares");
    }
}

#[test]
fn links() {
    let object = sparse();
    let parts = Parts::of(&object);
    for (offset, value, context) in NO_LINKS {
        assert_refuses(&KIND, &object, parts.links + offset, &value.to_ne_bytes(), context);
    }
    // Every link in turn leads back to the root, to itself, or beyond the end.
    let squares = word(&object, offset_of!(Header, squares));
    for square in (0..squares).filter(|square| word(&object, parts.links + 8 * *square as usize + 4) != 0) {
        for target in [0, square, squares, squares - 1] {
            let offset = parts.links + 8 * square as usize;
            if word(&object, offset) != target {
                assert_refuses(&KIND, &object, offset, &target.to_ne_bytes(), &format!("{square} to {target}"));
            }
        }
    }
}

/// Exponents that no map of such a power has.
#[test]
fn exponents() {
    for object in [object(|c| c.storage = WIS_STORAGE_PYRAMID, varied), object(|_| (), varied), object(|_| (), |_| 0.0)]
    {
        let own = word(&object, offset_of!(Header, exponent)) as i32;
        for exponent in [own + 1, own - 1, -2000, 129, 1024, i32::MAX, i32::MIN] {
            let context = format!("exponent {exponent}");
            assert_refuses(&KIND, &object, offset_of!(Header, exponent), &exponent.to_ne_bytes(), &context);
        }
    }
}
