//! Bytes: the same for any memory, and opened without harm whatever they hold.

use super::built::{Built, Random, in_lanes};
use super::lookup::{Map, single};
use super::maps::{descriptions, layouts, rough, suns};
use crate::support::sign::{FRAME, HEADER, POWER, sign};
use wis::brdf::material::{Material, Shape};
use wis::brdf::point::Point;
use wis::direct::Ray;
use wis::direct::sampler::{Config, Sampler, Sequence};
use wis::light::batch::{Density, pdfs, samples};
use wis::light::chart::Layout;
use wis::light::density::Inverted;
use wis::light::environment::Environment;
use wis::light::guide;
use wis::light::parts::{BORDERS, MIDDLES};
use wis::light::plan::{Description, Filter};
use wis::sample::Sample;
use wis::simd::Level;
use wis::sphere::Frame;

#[test]
fn memory_of_any_content_gives_the_same_bytes() {
    for (layout, width, height) in layouts(48) {
        let map = Map::of_directions(layout, width, height, rough);
        for of in descriptions(&map) {
            for budget in [0.0, 0.05] {
                let of = Description { budget, ..of };
                let [a, b, c] = [0, 0xa5, 0xff].map(|filling| Built::over(&map, &of, false, filling).unwrap());
                assert!(a.bytes() == b.bytes() && b.bytes() == c.bytes(), "{of:?}");
                assert!(Environment::open(a.bytes()).is_ok());
            }
        }
    }
}

/// Uses everything; all numbers are finite.
fn exercise(environment: &Environment<'_>, random: &mut Random) {
    let light = environment.light();
    let frame = environment.frame();
    for _ in 0..40 {
        let (wi, pdf) = light.sample::<f32>(&frame, [random.unit(), random.unit()]);
        assert!(wi.iter().all(|x| x.is_finite()) && pdf.is_finite() && pdf >= 0.0, "{wi:?} {pdf}");
        assert_eq!(pdf.to_bits(), light.pdf::<f32>(&frame, wi).to_bits());
        let wi = single(random.direction());
        let pdf = light.pdf::<f32>(&frame, wi);
        assert!(pdf.is_finite() && pdf >= 0.0, "{wi:?} {pdf}");
        if let Inverted::To(u) = light.invert(&frame, wi) {
            assert!(u.iter().all(|u| (0.0..1.0).contains(u)), "{u:?}");
        }
    }
    let u: Vec<[f32; 2]> = (0..40).map(|_| [random.unit(), random.unit()]).collect();
    let mut drawn = vec![Sample::default(); u.len()];
    samples(Level::detect(), &light, &frame, &u, &mut drawn);
    let wi: Vec<[f32; 3]> = drawn.iter().map(|drawn| drawn.wi).collect();
    let mut pdf = vec![-1.0; u.len()];
    pdfs(Level::detect(), &light, &frame, &wi, &mut pdf);
    assert!(pdf.iter().zip(&drawn).all(|(pdf, drawn)| pdf.is_finite() && pdf.to_bits() == drawn.pdf.to_bits()));
    assert!(environment.colours().iter().flatten().all(|c| c.is_finite()));
    let config = Config { rays: 1, candidates_per_ray: 0, hits_per_pixel: 0, reserved: 0 };
    let mut memory = vec![0u128; config.bytes().div_ceil(16)];
    let mut sampler = Sampler::new(Level::detect(), config, bytemuck::cast_slice_mut(&mut memory)).unwrap();
    let material = Material::new(&[Shape::LAMBERT]).unwrap();
    let point = Point::new(&material, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]);
    let mut ray = [Ray::default()];
    for sample in 0..4 {
        let at = Sequence { seed: random.bits() as u32, sample, bounce: 0 };
        let count = sampler.direct(environment, &point, at, 1, &mut ray).unwrap();
        assert!(
            ray[..count].iter().all(|ray| ray.weight.is_finite() && ray.wi.iter().all(|x| x.is_finite())),
            "{ray:?}"
        );
    }
}

#[test]
fn changed_bytes_with_the_right_hash_do_no_harm() {
    let mut random = Random(61);
    let mut accepted = 0;
    let mut lights: Vec<Built> = Vec::new();
    for (layout, width, height) in layouts(32) {
        let map = Map::of_directions(layout, width, height, rough);
        for filter in [Filter::Nearest, Filter::Bilinear] {
            for budget in [0.0, 0.1] {
                lights.push(Built::new(&map, &Description { budget, ..map.description(filter) }));
            }
        }
    }
    for built in &lights {
        let bytes = built.bytes();
        let mut words = vec![0u128; bytes.len().div_ceil(16)];
        for round in 0..1500 {
            let copy: &mut [u8] = &mut bytemuck::cast_slice_mut(&mut words)[..bytes.len()];
            copy.copy_from_slice(bytes);
            for _ in 0..1 + random.bits() % 3 {
                // The small tables in front as often as the large ones behind.
                let end = if round % 2 == 0 { bytes.len() } else { 16384.min(bytes.len()) };
                let at = (random.bits() % end as u64) as usize;
                copy[at] = if round % 3 == 0 { copy[at] ^ (1 << (random.bits() % 8)) } else { random.bits() as u8 };
            }
            sign("wis_environment", copy);
            if let Ok(environment) = Environment::open(copy) {
                accepted += 1;
                exercise(&environment, &mut random);
            }
        }
    }
    // Corners and colours of any value are a light.
    assert!(accepted > 100, "{accepted}");
}

/// Where the positions of the sections begin in the header: tops, two maps of cells, cells, colours, the product's
/// guide, starts, blocks, words, tiles and words of the texel map, strata and the end.
const SECTIONS: usize = 104;
const CELL: usize = 28;
const BLOCK: usize = 16;

fn section(bytes: &[u8], number: usize) -> usize {
    let at = SECTIONS + 8 * number;
    u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize
}

/// Signs, opens and, if that succeeds, exercises; whether it was accepted.
fn is_harmless(copy: &mut [u8], random: &mut Random) -> bool {
    sign("wis_environment", copy);
    let opened = Environment::open(copy);
    opened.iter().for_each(|environment| exercise(environment, random));
    opened.is_ok()
}

/// Not by chance: every field of the header, of the first and of the last cells and blocks, and whole tables, each set to what
/// does most harm.
#[test]
fn every_field_at_its_extremes_does_no_harm() {
    const EXTREMES: [u32; 10] =
        [0, 1, 2, 0x8000_0000, 0x7fff_ffff, 0xffff_ffff, 0x7fc0_0000, 0x7f80_0000, 0xff80_0000, 0x3f80_0000];
    let mut random = Random(62);
    for (layout, width, height) in layouts(32) {
        let map = Map::of_directions(layout, width, height, rough);
        let kinds = [(Filter::Bilinear, 0.1), (Filter::Bilinear, 0.0), (Filter::Nearest, 0.1)];
        for &(filter, budget) in &kinds[..if layout == Layout::LatLong { 3 } else { 1 }] {
            let built = Built::new(&map, &Description { budget, ..map.description(filter) });
            let bytes = built.bytes();
            let mut words = vec![0u128; bytes.len().div_ceil(16)];
            let copy: &mut [u8] = &mut bytemuck::cast_slice_mut(&mut words)[..bytes.len()];
            let [tops, map_of_cells, cells, colours] = [0, 1, 3, 4].map(|number| section(bytes, number));
            let [guide, starts, blocks, words_at] = [5, 6, 7, 8].map(|number| section(bytes, number));
            let [tiles, texels, strata, end] = [9, 10, 11, 12].map(|number| section(bytes, number));
            assert_eq!((cells % 64, end), (0, bytes.len()));
            let last_block = words_at - (words_at - blocks) % BLOCK - BLOCK;
            let fields = (POWER..FRAME)
                .chain(HEADER - 4..HEADER)
                .chain(cells..cells + CELL)
                .chain(colours - CELL..colours)
                .chain(guide..guide + 32)
                .chain(tops..tops + 64)
                .chain(starts..starts + 64)
                .chain(blocks..blocks + BLOCK)
                .chain(last_block..last_block + BLOCK)
                .chain(tiles..tiles + 16)
                .chain(strata..strata + 32);
            for at in fields.filter(|at| at % 4 == 0) {
                for extreme in EXTREMES {
                    for length in [1, 4] {
                        for shift in (0..4).step_by(length) {
                            copy.copy_from_slice(bytes);
                            let part = at + shift..at + shift + length;
                            // The highest bytes: the sign and the exponent of a number.
                            copy[part].copy_from_slice(&extreme.to_le_bytes()[4 - length..]);
                            is_harmless(copy, &mut random);
                        }
                    }
                }
            }
            let mut accepted = 0;
            for part in [tops..map_of_cells, map_of_cells..cells, cells..colours]
                .into_iter()
                .chain([colours..guide, guide..starts, starts..blocks, blocks..words_at, words_at..tiles])
                .chain([tiles..texels, texels..strata, strata..end])
            {
                for filling in [0, 1, 0x7f, 0x80, 0xff] {
                    copy.copy_from_slice(bytes);
                    copy[part.clone()].fill(filling);
                    accepted += u32::from(is_harmless(copy, &mut random));
                    // From the middle on, and reversed, which orders starts the wrong way round.
                    copy.copy_from_slice(bytes);
                    copy[part.start.midpoint(part.end)..part.end].fill(filling);
                    accepted += u32::from(is_harmless(copy, &mut random));
                }
                copy.copy_from_slice(bytes);
                copy[part].reverse();
                accepted += u32::from(is_harmless(copy, &mut random));
            }
            // Lines of zeros, for one, hold no light but are in order.
            assert!(accepted > 0);
        }
    }
}

/// Two starts inside a table change places, in the tables of cells and of blocks: none is opened.
#[test]
fn starts_that_descend_are_refused() {
    for (layout, width, height) in layouts(256) {
        let map = Map::of_directions(layout, width, height, rough);
        let built = Built::new(&map, &map.description(Filter::Bilinear));
        let mut words = vec![0u128; built.bytes().len().div_ceil(16)];
        let copy: &mut [u8] = &mut bytemuck::cast_slice_mut(&mut words)[..built.bytes().len()];
        for table in [0, 6] {
            copy.copy_from_slice(built.bytes());
            let (from, end) = (section(copy, table), section(copy, table + 1));
            let inside = |pair: &[f32]| 0.0 < pair[0] && pair[0] < pair[1] && pair[1] < 1.0;
            let starts: &[f32] = bytemuck::cast_slice(&built.bytes()[from..end - end % 4]);
            let pairs: Vec<usize> = (1..starts.len()).filter(|&k| inside(&starts[k - 1..=k])).collect();
            assert!(pairs.len() > 8, "{layout:?} has no tables of three starts");
            for &k in pairs.iter().step_by(pairs.len() / 8) {
                copy.copy_from_slice(built.bytes());
                copy[from + 4 * k - 4..from + 4 * k + 4].rotate_left(4);
                sign("wis_environment", copy);
                assert!(Environment::open(copy).is_err(), "{layout:?}, table {table}, starts {} and {k}", k - 1);
            }
        }
    }
}

/// The borders of a cell's parts: none is opened whose parts have no width.
#[test]
fn parts_without_a_width_are_refused() {
    /// Where the borders of the first cell begin in the guide, in bytes: behind the middles of its parts.
    const FIRST: usize = 2 * 3 * MIDDLES;
    for (layout, width, height) in layouts(64) {
        let map = Map::of_directions(layout, width, height, rough);
        let built = Built::new(&map, &map.description(Filter::Bilinear));
        let mut words = vec![0u128; built.bytes().len().div_ceil(16)];
        let copy: &mut [u8] = &mut bytemuck::cast_slice_mut(&mut words)[..built.bytes().len()];
        let first = section(built.bytes(), 5) + FIRST;
        for (border, value) in (0..BORDERS).flat_map(|border| [0, -1, guide::Short::MIN].map(|value| (border, value))) {
            copy.copy_from_slice(built.bytes());
            copy[first + 2 * border..][..2].copy_from_slice(&value.to_le_bytes());
            sign("wis_environment", copy);
            assert!(Environment::open(copy).is_err(), "{layout:?}: border {border} is {value}");
        }
    }
}

#[test]
fn signing_is_what_a_build_does() {
    let (_, map) = suns(64, 32).swap_remove(0);
    let built = Built::new(&map, &map.description(Filter::Bilinear));
    let mut words = vec![0u128; built.bytes().len().div_ceil(16)];
    let copy: &mut [u8] = &mut bytemuck::cast_slice_mut(&mut words)[..built.bytes().len()];
    copy.copy_from_slice(built.bytes());
    sign("wis_environment", copy);
    assert!(copy == built.bytes());
    copy[HEADER + 5] ^= 1;
    assert!(Environment::open(copy).is_err());
}

#[test]
fn bytes_that_end_early_are_no_environment() {
    let map = Map::latlong(64, 32, |x, y| (x + y) as f32);
    let built = Built::new(&map, &map.description(Filter::Bilinear));
    let words: Vec<u128> = bytemuck::pod_collect_to_vec(built.bytes());
    let bytes: &[u8] = bytemuck::cast_slice(&words);
    for length in [0, 1, 31, HEADER - 1, HEADER, 4000, built.bytes().len() - 1] {
        assert!(Environment::open(&bytes[..length]).is_err(), "{length}");
    }
    // Lanes of an opened light are those of the built one.
    let opened = Environment::open(bytes).unwrap();
    let u = [[0.3, 0.7]; 8];
    let (wi, pdf, _) = in_lanes(Level::BASELINE, &built, &Frame::IDENTITY, &u)[0];
    assert_eq!(opened.light().pdf::<f32>(&Frame::IDENTITY, wi), pdf);
}
