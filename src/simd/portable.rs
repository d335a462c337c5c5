//! Lanes as an array: what any compiler makes of it, and the oracle of the other kinds.

use super::{LANES, Lanes};
use crate::numeric::{max, min, select, sqrt};
use core::ops::{Add, Div, Mul, Sub};

/// Eight numbers in an array.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Portable([f32; LANES]);

impl Portable {
    #[inline(always)]
    fn each(self, of: impl Fn(f32) -> f32) -> Self {
        Portable(self.0.map(of))
    }

    #[inline(always)]
    fn with(self, b: Self, of: impl Fn(f32, f32) -> f32) -> Self {
        let mut lanes = self.0;
        for (a, b) in lanes.iter_mut().zip(b.0) {
            *a = of(*a, b);
        }
        Portable(lanes)
    }

    #[inline(always)]
    fn compare(self, b: Self, of: impl Fn(f32, f32) -> bool) -> u32 {
        self.0.iter().zip(b.0).rev().fold(0, |bits, (&a, b)| bits << 1 | u32::from(of(a, b)))
    }
}

macro_rules! operator {
    ($operator:ident, $name:ident) => {
        impl $operator for Portable {
            type Output = Portable;

            #[inline(always)]
            fn $name(self, b: Portable) -> Portable {
                self.with(b, f32::$name)
            }
        }
    };
}

operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl Lanes for Portable {
    type Mask = u32;
    type Index = [u32; LANES];

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Portable([x; LANES])
    }

    #[inline(always)]
    fn from_array(lanes: [f32; LANES]) -> Self {
        Portable(lanes)
    }

    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        self.0
    }

    #[inline(always)]
    fn transpose(rows: [&[f32; 4]; LANES]) -> [Self; 4] {
        let [a, b, c, d] = [0, 1, 2, 3];
        [a, b, c, d].map(|k: usize| Portable(rows.map(|row| row[k & 3])))
    }

    #[inline(always)]
    fn rows(columns: [Self; 4]) -> [[f32; 4]; LANES] {
        let mut rows = [[0.0; 4]; LANES];
        for (i, row) in rows.iter_mut().enumerate() {
            *row = columns.map(|column| column.0[i & (LANES - 1)]);
        }
        rows
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.each(sqrt)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.each(f32::abs)
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        self.with(sign, f32::copysign)
    }

    #[inline(always)]
    fn before(self) -> Self {
        self.each(|x| f32::from_bits(x.to_bits().wrapping_sub(1)))
    }

    #[inline(always)]
    fn min(self, b: Self) -> Self {
        self.with(b, min)
    }

    #[inline(always)]
    fn max(self, b: Self) -> Self {
        self.with(b, max)
    }

    #[inline(always)]
    fn lt(self, b: Self) -> u32 {
        self.compare(b, |a, b| a < b)
    }

    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        self.compare(b, |a, b| a <= b)
    }

    #[inline(always)]
    fn select(mask: u32, a: Self, b: Self) -> Self {
        let mut lanes = a.0;
        for ((i, a), b) in lanes.iter_mut().enumerate().zip(b.0) {
            *a = select(mask >> i & 1 == 1, *a, b);
        }
        Portable(lanes)
    }

    #[inline(always)]
    fn select_mask(mask: u32, a: u32, b: u32) -> u32 {
        (mask & a) | (!mask & b)
    }

    #[inline(always)]
    fn and(a: u32, b: u32) -> u32 {
        a & b
    }

    #[inline(always)]
    fn or(a: u32, b: u32) -> u32 {
        a | b
    }

    #[inline(always)]
    fn index(numbers: [u32; LANES]) -> [u32; LANES] {
        numbers
    }

    #[inline(always)]
    fn numbers(index: [u32; LANES]) -> [u32; LANES] {
        index
    }

    #[inline(always)]
    fn transpose_index(rows: [&[u32; 4]; LANES]) -> [[u32; LANES]; 4] {
        let [a, b, c, d] = [0, 1, 2, 3];
        [a, b, c, d].map(|k: usize| rows.map(|row| row[k & 3]))
    }

    #[inline(always)]
    fn select_index(mask: u32, a: [u32; LANES], b: [u32; LANES]) -> [u32; LANES] {
        let mut lanes = b;
        for ((i, lane), a) in lanes.iter_mut().enumerate().zip(a) {
            *lane = if mask >> i & 1 == 1 { a } else { *lane };
        }
        lanes
    }

    #[inline(always)]
    fn truncate(self) -> [u32; LANES] {
        self.0.map(|x| x as u32)
    }

    #[inline(always)]
    fn from_index(index: [u32; LANES]) -> Self {
        Portable(index.map(|number| number as f32))
    }

    #[inline(always)]
    fn add_index(a: [u32; LANES], b: [u32; LANES]) -> [u32; LANES] {
        let mut lanes = a;
        for (a, b) in lanes.iter_mut().zip(b) {
            *a = a.wrapping_add(b);
        }
        lanes
    }

    #[inline(always)]
    fn with_bits(index: [u32; LANES]) -> Self {
        Portable(index.map(f32::from_bits))
    }

    #[inline(always)]
    fn halves(index: [u32; LANES], add: u32) -> [Self; 2] {
        let number = |half: u32| f32::from_bits((half << 12).wrapping_add(add));
        [Portable(index.map(|i| number(i & 0xffff))), Portable(index.map(|i| number(i >> 16)))]
    }

    #[inline(always)]
    fn below(index: [u32; LANES], bound: u32) -> u32 {
        index.iter().rev().fold(0, |bits, &number| bits << 1 | u32::from(number < bound))
    }

    #[inline(always)]
    fn highest_bits(index: [u32; LANES]) -> u32 {
        index.iter().rev().fold(0, |bits, &number| bits << 1 | number >> 31)
    }

    #[inline(always)]
    fn child(squares: [u32; LANES], sides: [u32; 2]) -> [u32; LANES] {
        let mut children = squares;
        for (i, child) in children.iter_mut().enumerate() {
            let c = 2 * (sides[0] >> i & 1) + (sides[1] >> i & 1);
            *child = child.wrapping_mul(4).wrapping_add(1 + c);
        }
        children
    }

    #[inline(always)]
    fn gather(rows: &[[f32; 4]], index: [u32; LANES]) -> [Self; 4] {
        Self::gather_each(rows, index)
    }

    #[inline(always)]
    fn mask(bits: u32) -> u32 {
        bits & 0xff
    }

    #[inline(always)]
    fn bits(mask: u32) -> u32 {
        mask
    }
}

super::num::scalars!(Portable);
