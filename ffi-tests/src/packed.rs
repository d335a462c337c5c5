//! Sparse wavelets of a square as the papers store them: an index by difference, and 16 bits for a value of one scale a square.
//! Lists are unpacked one at a time, for the library to read.

use crate::client::raw;

/// Bits of the library's positions.
const MORTON_BITS: u32 = 24;
/// Bits of a byte of an index; the eighth tells that another byte follows.
const DIGIT: u32 = 7;

/// The average of a function on the square, and some of its wavelets.
pub struct Packed {
    depth: u32,
    average: f32,
    /// Of the largest orthonormal coefficient.
    scale: f32,
    bytes: Vec<u8>,
}

impl Packed {
    /// Those wavelets of a list, in order, whose orthonormal coefficient is at least `least`; one that is 0 is never kept.
    pub fn new(depth: u32, average: f64, list: &[raw::wis_wavelets], least: f32) -> Packed {
        let kept = |w: &raw::wis_wavelets| {
            let first = 3 * ordinal(depth, w.position, w.level);
            let orthonormal = w.detail.map(|d| d * 0.5f32.powi(w.level as i32));
            (0..3).map(move |f| (first + f, orthonormal[f as usize]))
        };
        let kept: Vec<(u32, f32)> = list.iter().flat_map(kept).filter(|c| c.1 != 0.0 && c.1.abs() >= least).collect();
        let scale = kept.iter().fold(f32::MIN_POSITIVE, |most, c| most.max(c.1.abs()));
        let (mut bytes, mut last) = (Vec::new(), 0);
        for (index, value) in kept {
            let mut gap = index - last;
            while gap >> DIGIT > 0 {
                bytes.push(gap as u8 | 1 << DIGIT);
                gap >>= DIGIT;
            }
            bytes.push(gap as u8);
            let level = (value / scale * f32::from(i16::MAX)).round() as i16;
            bytes.extend(level.to_le_bytes());
            last = index;
        }
        Packed { depth, average: average as f32, scale, bytes }
    }

    /// What it takes, with a length of 4 bytes.
    pub fn size(&self) -> usize {
        self.bytes.len() + 12
    }

    pub fn average(&self) -> f64 {
        self.average.into()
    }

    /// The squares in the order of the library, in a list that is used again.
    pub fn unpack(&self, list: &mut Vec<raw::wis_wavelets>) {
        list.clear();
        let (mut rest, mut index) = (self.bytes.iter().copied(), 0);
        let mut byte = || rest.next();
        while let Some(mut digit) = byte() {
            let (mut gap, mut shift) = (0u32, 0);
            while digit >> DIGIT > 0 {
                gap |= u32::from(digit & 0x7f) << shift;
                shift += DIGIT;
                digit = byte().unwrap_or(0);
            }
            index += gap | u32::from(digit) << shift;
            let value = i16::from_le_bytes([byte().unwrap_or(0), byte().unwrap_or(0)]);
            let (position, level) = place(self.depth, index / 3);
            if list.last().is_none_or(|w| (w.position, w.level) != (position, level)) {
                list.push(raw::wis_wavelets { position, level, detail: [0.0; 3] });
            }
            let detail = f32::from(value) / f32::from(i16::MAX) * self.scale * 2f32.powi(level as i32);
            list.last_mut().expect("pushed above").detail[index as usize % 3] = detail;
        }
    }
}

/// Squares inside one of a level, and it.
fn inside(depth: u32, level: u32) -> u32 {
    ((1 << (2 * (depth - level))) - 1) / 3
}

/// The number of a square in the order of the library's lists, in which a square stands before those inside it.
fn ordinal(depth: u32, position: u32, level: u32) -> u32 {
    let child = |k: u32| position >> (MORTON_BITS - 2 * k) & 3;
    (1..=level).map(|k| 1 + child(k) * inside(depth, k)).sum()
}

/// The square of a number.
fn place(depth: u32, mut ordinal: u32) -> (u32, u32) {
    let (mut position, mut level) = (0, 0);
    while ordinal > 0 {
        level += 1;
        let each = inside(depth, level);
        position |= ((ordinal - 1) / each) << (MORTON_BITS - 2 * level);
        ordinal = (ordinal - 1) % each;
    }
    (position, level)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::Tree;

    /// All wavelets of a square come back in order, each within half of a step of 16 bits.
    #[test]
    fn what_is_packed_comes_back() {
        let depth = 4;
        let pixels: Vec<f32> = (0..256u32).map(|i| (i.wrapping_mul(0x9e37_79b9) >> 16) as f32 / 65536.0).collect();
        let tree = Tree::new(depth, 0.0, &pixels).unwrap();
        let list = tree.largest(3 << (2 * depth)).unwrap();
        let packed = Packed::new(depth, tree.info.average, &list, 0.0);
        let mut back = Vec::new();
        packed.unpack(&mut back);
        assert!(back.len() == list.len() && packed.size() <= 12 + 4 * 3 * list.len());
        for (a, b) in list.iter().zip(&back) {
            assert!((a.position, a.level) == (b.position, b.level));
            let step = packed.scale * 2f32.powi(a.level as i32) / f32::from(i16::MAX);
            assert!(a.detail.iter().zip(b.detail).all(|(a, b)| (a - b).abs() <= 0.51 * step));
        }
    }
}
