//! Sparse wavelets of a square as the papers store them, by `wis_sparse_pack` and `wis_sparse_unpack`: one function at a time.

use crate::client::{self, Tree, raw};
use std::ptr::null_mut;

/// The sum of the squares of the orthonormal coefficients of a square: value space weighted by area.
pub fn energy(w: &raw::wis_wavelets) -> f64 {
    w.detail.iter().map(|d| f64::from(*d).powi(2)).sum::<f64>() * 0.25f64.powi(w.level as i32)
}

/// The average of a function on the square, and some of its wavelets.
pub struct Packed(Vec<u8>);

impl Packed {
    /// Those wavelets of a list, in order, whose orthonormal coefficient is at least `least`.
    ///
    /// # Errors
    /// Those of the library.
    pub fn new(average: f64, list: &[raw::wis_wavelets], least: f32) -> client::Result<Packed> {
        let mut list = list.to_vec();
        for w in &mut list {
            let size = 0.5f32.powi(w.level as i32);
            w.detail.iter_mut().filter(|d| (**d * size).abs() < least).for_each(|d| *d = 0.0);
        }
        let (mut bytes, mut used) = (vec![0; 16 + 18 * list.len()], 0);
        let (count, room, packed) = (list.len() as u32, bytes.len(), bytes.as_mut_ptr());
        // SAFETY: list and room are as long as stated.
        client::check(unsafe {
            raw::wis_sparse_pack(average, count, list.as_ptr(), room, packed, &mut used, null_mut())
        })?;
        bytes.truncate(used);
        Ok(Packed(bytes))
    }

    /// Bytes.
    pub fn size(&self) -> usize {
        self.0.len()
    }

    /// The squares in the order of the library, in a list that is used again; the average.
    ///
    /// # Errors
    /// Those of the library.
    pub fn unpack(&self, list: &mut Vec<raw::wis_wavelets>) -> client::Result<f64> {
        // At most a third of the bytes.
        list.resize(self.0.len() / 3, raw::wis_wavelets::default());
        let (mut count, mut average) = (0, 0.0);
        let (packed, bytes, room) = (self.0.as_ptr(), self.0.len(), list.len() as u32);
        // SAFETY: as above.
        client::check(unsafe {
            raw::wis_sparse_unpack(packed, bytes, room, list.as_mut_ptr(), &mut count, &mut average, null_mut())
        })?;
        list.truncate(count as usize);
        Ok(average)
    }

    /// The energy of a list, in order, that is not given back.
    ///
    /// # Errors
    /// Those of the library.
    pub fn lost(&self, list: &[raw::wis_wavelets]) -> client::Result<f64> {
        let mut back = Vec::new();
        self.unpack(&mut back)?;
        let mut kept = back.iter().peekable();
        let off = |w: &raw::wis_wavelets| {
            let there = kept.next_if(|b| (b.position, b.level) == (w.position, w.level)).map_or([0.0; 3], |b| b.detail);
            energy(&raw::wis_wavelets { detail: std::array::from_fn(|k| w.detail[k] - there[k]), ..*w })
        };
        Ok(list.iter().map(off).sum())
    }

    /// The tree, ready to multiply and to sample.
    ///
    /// # Errors
    /// Those of the library.
    pub fn tree(&self) -> client::Result<Tree> {
        let mut list = Vec::new();
        let average = self.unpack(&mut list)?;
        Tree::of_wavelets(average, &list, 0.0)
    }
}
