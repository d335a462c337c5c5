//! A function on the square as the papers store it: its average and any of its wavelets, in three to four bytes each.
//!
//! Each wavelet is an index by difference, in bytes of seven bits, and a coefficient of 16 bits of one scale for all (Clarberg et
//! al. 2005 and Ng et al. 2004 count 4 to 5 bytes). Indices number the wavelets of the complete tree depth first, so that a list
//! comes back in its order. Bytes may come from a file: what is read is checked on the way, and costs a step for each.

use crate::numeric::{exp2i, is_float};
use crate::status::{Result, Status};
use crate::wavelets::morton::MAX_DEPTH;
use crate::wavelets::triple::{Wavelets, shift};

/// What such bytes begin with: a name and a version.
const MAGIC: [u8; 3] = *b"wp\x01";
/// Bytes before the wavelets: the name, the depth of the tree, the length of all bytes, the average, and the scale.
const HEAD: usize = 16;
/// Bits of a byte of an index; the eighth tells that another byte follows.
const DIGIT: u32 = 7;
/// The largest coefficient has this value.
const LARGEST: f64 = 32767.0;

/// Writes a function of this average and these wavelets, in order, as far as there is room, and answers how many bytes it takes.
/// Coefficients below half of a step of the scale are dropped.
pub fn pack(average: f32, list: &[Wavelets], out: &mut [u8]) -> usize {
    let depth = list.iter().map(|w| w.level + 1).max().unwrap_or(0);
    let largest = list.iter().flat_map(coefficients).fold(0.0, |most, c| if c.abs() > most { c.abs() } else { most });
    let scale = (largest / LARGEST) as f32;
    let mut bytes = Written { out, used: HEAD };
    let mut last = 0;
    for w in list {
        let first = 3 * ordinal(depth, w);
        for (index, coefficient) in (first..).zip(coefficients(w)) {
            let value = quantised(coefficient, scale.into());
            if value != 0 {
                bytes.push_index(index - last);
                bytes.push(&value.to_le_bytes());
                last = index;
            }
        }
    }
    let length = bytes.used;
    bytes.used = 0;
    bytes.push(&MAGIC);
    bytes.push(&[depth as u8]);
    bytes.push(&(length as u32).to_le_bytes());
    bytes.push(&average.to_le_bytes());
    bytes.push(&scale.to_le_bytes());
    length
}

/// The orthonormal coefficients of a square.
fn coefficients(w: &Wavelets) -> [f64; 3] {
    w.detail.map(|d| f64::from(d) * exp2i(-(w.level as i32)))
}

/// A coefficient in steps of the scale.
fn quantised(coefficient: f64, scale: f64) -> i16 {
    let steps = if scale > 0.0 { coefficient / scale } else { 0.0 };
    let half = if steps < 0.0 { -0.5 } else { 0.5 };
    // A cast cuts the fraction off.
    (steps + half) as i16
}

/// Bytes that are being written, as far as there is room.
struct Written<'o> {
    out: &'o mut [u8],
    used: usize,
}

impl Written<'_> {
    fn push(&mut self, bytes: &[u8]) {
        let room = self.out.get_mut(self.used..).unwrap_or_default();
        if bytes.len() <= room.len() {
            room.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        }
        self.used = self.used.saturating_add(bytes.len());
    }

    fn push_index(&mut self, mut gap: u32) {
        while gap >> DIGIT > 0 {
            self.push(&[gap as u8 | 1 << DIGIT]);
            gap >>= DIGIT;
        }
        self.push(&[gap as u8]);
    }
}

/// Reads what [`pack`] wrote: writes its squares in order, as far as there is room, and answers the average and how many they are.
///
/// # Errors
/// [`Status::Corrupt`] if the bytes are none of these.
pub fn unpack(bytes: &[u8], out: &mut [Wavelets]) -> Result<(f32, usize)> {
    let head = Head::read(bytes).ok_or(Status::Corrupt)?;
    let mut rest = bytes.get(HEAD..head.length).ok_or(Status::Corrupt)?;
    let (mut index, mut place, mut count) = (None, None, 0);
    while !rest.is_empty() {
        let (gap, value) = next(&mut rest).ok_or(Status::Corrupt)?;
        let behind = gap > 0 || index.is_none();
        let here = index.unwrap_or(0u32).saturating_add(gap);
        if !behind || here / 3 >= inside(head.depth, 0) {
            return Err(Status::Corrupt);
        }
        let (position, level) = square(head.depth, here / 3);
        if place != Some((position, level)) {
            (place, count) = (Some((position, level)), count + 1);
            if let Some(slot) = out.get_mut(count - 1) {
                *slot = Wavelets { position, level, detail: [0.0; 3] };
            }
        }
        let detail = f64::from(value) * f64::from(head.scale) * exp2i(level as i32);
        if !is_float(detail) {
            return Err(Status::Corrupt);
        }
        if let Some(slot) = out.get_mut(count - 1).and_then(|w| w.detail.get_mut(here as usize % 3)) {
            *slot = detail as f32;
        }
        index = Some(here);
    }
    Ok((head.average, count))
}

/// What stands before the wavelets.
struct Head {
    depth: u32,
    length: usize,
    average: f32,
    scale: f32,
}

impl Head {
    fn read(bytes: &[u8]) -> Option<Head> {
        let rest = bytes.strip_prefix(&MAGIC)?;
        let (depth, rest) = rest.split_first()?;
        let (length, rest) = rest.split_first_chunk()?;
        let (average, rest) = rest.split_first_chunk()?;
        let scale = rest.first_chunk()?;
        let head = Head {
            depth: u32::from(*depth),
            length: u32::from_le_bytes(*length) as usize,
            average: f32::from_le_bytes(*average),
            scale: f32::from_le_bytes(*scale),
        };
        let known = head.depth <= MAX_DEPTH && head.average.is_finite() && (0.0..=f32::MAX).contains(&head.scale);
        known.then_some(head)
    }
}

/// The next wavelet: how far it is behind the last one, and its value.
fn next(rest: &mut &[u8]) -> Option<(u32, i16)> {
    let mut gap = 0;
    for place in 0..4 {
        let (digit, behind) = rest.split_first()?;
        *rest = behind;
        gap |= u32::from(digit & 0x7f) << (DIGIT * place);
        if digit >> DIGIT == 0 {
            let (value, behind) = rest.split_first_chunk()?;
            *rest = behind;
            return Some((gap, i16::from_le_bytes(*value)));
        }
    }
    None
}

/// The squares of the complete tree inside one of a level, and it.
fn inside(depth: u32, level: u32) -> u32 {
    ((1 << (2 * depth.saturating_sub(level))) - 1) / 3
}

/// The number of a square of the complete tree, depth first.
fn ordinal(depth: u32, w: &Wavelets) -> u32 {
    (1..=w.level).map(|level| 1 + (w.position >> shift(level) & 3) * inside(depth, level)).sum()
}

/// The position and level of the square of a number.
fn square(depth: u32, mut ordinal: u32) -> (u32, u32) {
    let (mut position, mut level) = (0, 0);
    while let Some(behind) = ordinal.checked_sub(1).filter(|_| level < depth) {
        level += 1;
        // Below the finest level nothing is left.
        let each = inside(depth, level).max(1);
        position |= (behind / each) << shift(level);
        ordinal = behind % each;
    }
    (position, level)
}
