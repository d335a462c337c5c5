//! Environment maps: texels in read-only memory, of all shapes and all kinds of light.

use crate::case::{Case, Fields};
use crate::memory::{Memory, Place};
use crate::random::Random;
use std::ffi::c_void;

/// A map as configurations describe it.
#[derive(Clone, Copy, Debug)]
pub struct Map {
    pub layout: u32,
    pub width: usize,
    pub height: usize,
    pub channels: usize,
    /// Bytes of a channel: 4, or 2 for 16-bit floats.
    pub bytes: usize,
    pub place: Place,
}

impl Map {
    fn row(&self) -> usize {
        self.width * self.channels * self.bytes
    }
}

/// Maps for all calls of an epoch.
pub struct Maps {
    maps: Vec<Map>,
    first_region: usize,
}

impl Maps {
    pub const REGIONS: usize = 8;

    pub fn new(first_region: usize) -> Maps {
        Maps { maps: Vec::new(), first_region }
    }

    pub fn fill(&mut self, memory: &Memory, random: &mut Random) {
        self.maps = (0..Maps::REGIONS).map(|k| map(self.first_region + k, k, memory, random)).collect();
    }

    pub fn pick(&self, random: &mut Random, latlong: bool) -> Map {
        // The first maps are lat-long.
        random.pick(if latlong { &self.maps[..4] } else { &self.maps })
    }
}

fn map(region: usize, number: usize, memory: &Memory, random: &mut Random) -> Map {
    // One map of an epoch is larger.
    let most = if number == 0 { 160 } else { random.pick(&[2, 9, 40]) };
    let side = |random: &mut Random| 1 + random.below(most);
    let (layout, width, height) = match if number < 4 { 1 } else { 1 + random.below(3) } {
        1 => (1, side(random), side(random)),
        2 => {
            let side = 1 + random.below(most.min(40));
            (2, side, 6 * side)
        }
        _ => {
            let side = side(random);
            (3, side, side)
        }
    };
    let (channels, bytes) = (random.pick(&[1, 3, 4]), random.pick(&[4, 4, 2]));
    let values = texels(width * height * channels, random);
    let content: Vec<u8> = match bytes {
        4 => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        _ => values.iter().flat_map(|value| half(*value).to_le_bytes()).collect(),
    };
    let place = memory.place(region, content.len(), bytes, 0, random.one_in(2));
    memory.bytes(place).copy_from_slice(&content);
    Map { layout, width, height, channels, bytes, place }
}

/// Light of one of the kinds that are hard on tables: black, even, a sun, noise over many magnitudes, bad texels.
fn texels(count: usize, random: &mut Random) -> Vec<f32> {
    let scale = random.pick(&[1.0, 1.0, 1.0, 1e-44, 1e-30, 1e8, 1e30, 3e38]);
    let kind = random.below(8);
    let sun = random.below(count);
    let bad = random.one_in(8);
    let mut one = |i: usize| match kind {
        0 => 0.0,
        1 => 1.0,
        2 => (i == sun) as u32 as f32,
        3 => 0.1 + if i == sun { 1e8 } else { 0.0 },
        4 => random.scale(1e-30, 1.0),
        5 => f32::from(u8::from(random.one_in(2))),
        _ => random.unit(),
    };
    let mut values: Vec<f32> = (0..count).map(|i| (one(i) * scale).min(f32::MAX)).collect();
    if bad {
        values[sun] = random.hard();
    }
    values
}

/// Bits of a 16-bit float, rounded down.
fn half(value: f32) -> u16 {
    let bits = value.to_bits();
    let (sign, exponent, fraction) = ((bits >> 16 & 0x8000) as u16, (bits >> 23 & 255) as i32 - 112, bits & 0x7f_ffff);
    let magnitude = match exponent {
        143 => 0x7c00 | u16::from(fraction != 0),
        1..31 => (exponent as u16) << 10 | (fraction >> 13) as u16,
        31.. => 0x7bff,
        -9..=0 => ((fraction | 0x80_0000) >> (14 - exponent)) as u16,
        _ => 0,
    };
    sign | magnitude
}

/// Labels of texels that fit in a region.
const MOST_LABELS: usize = 200_000;

/// What `row` gives; beyond the map, and where a row is missing, nothing.
#[repr(C)]
struct Rows {
    pixels: *const u8,
    stride: usize,
    rows: u32,
    missing: u32,
}

extern "C" fn row(user: *mut c_void, y: u32) -> *const c_void {
    // SAFETY: the configuration hands its rows on, which a hostile case does not align.
    let rows = unsafe { user.cast::<Rows>().read_unaligned() };
    if y >= rows.rows || y == rows.missing {
        return std::ptr::null();
    }
    rows.pixels.wrapping_add(y as usize * rows.stride).cast()
}

/// Fills what wis_environment_config says of a map. A hostile one never claims more texels than
/// there are: it then has none.
pub fn describe(case: &mut Case, fields: &mut Fields, latlong: bool) {
    let map = case.world.maps.pick(&mut case.random, latlong);
    let pixels = case.world.memory.reader(map.place);
    case.map = Some(map);
    case.texels = map.width * map.height;
    let put = |fields: &mut Fields| {
        fields.word("layout", map.layout.into());
        fields.word("width", map.width as u64);
        fields.word("height", map.height as u64);
        fields.word("channels", map.channels as u64);
        fields.word("format", if map.bytes == 4 { 1 } else { 2 });
    };
    put(fields);
    match case.random.below(4) {
        // A build in parts outlives the rows.
        0 if case.function.name != "wis_environment_begin" => {
            let missing = if case.is_spoiled() { case.random.below(map.height) as u32 } else { u32::MAX };
            let rows = Rows { pixels, stride: map.row(), rows: map.height as u32, missing };
            // SAFETY: plain numbers.
            let bytes = unsafe { std::slice::from_raw_parts((&raw const rows).cast::<u8>(), size_of::<Rows>()) };
            fields.input(case, "row_user", bytes, 8);
            fields.word("row", row as *const () as u64);
        }
        1 => {
            // The last row first.
            fields.word("pixels", pixels as u64 + (map.row() * (map.height - 1)) as u64);
            fields.word("row_stride", (map.row() as u64).wrapping_neg());
        }
        _ => fields.word("pixels", pixels as u64),
    }
    if case.is_spoiled() {
        fields.spoil(&mut case.random);
        if !fits(fields, pixels as i128, map.place.len as i128) {
            fields.word("pixels", 0);
        }
        let texels = fields.get("width") as usize * fields.get("height") as usize;
        if row_bytes(fields) > map.row() as i128 || texels > MOST_LABELS {
            fields.word("row", 0);
        }
        // A call may take a number for each.
        case.texels = texels.min(MOST_LABELS);
    }
}

fn row_bytes(fields: &Fields) -> i128 {
    let bytes = if fields.get("format") == 2 { 2 } else { 4 };
    fields.get("width") as i128 * fields.get("channels") as i128 * bytes
}

/// Whether a configuration's rows lie in so many bytes from `start` on. An odd address is not read.
fn fits(fields: &Fields, start: i128, len: i128) -> bool {
    let (row, pixels) = (row_bytes(fields), fields.get("pixels") as i128);
    let stride = i128::from(fields.get("row_stride") as i64);
    let last = (fields.get("height") as i128 - 1) * if stride == 0 { row } else { stride };
    pixels % 2 == 1 || (pixels + last.min(0) >= start && pixels + last.max(0) + row <= start + len)
}
