//! Four numbers in an array: lanes for any processor, and what those of instruction sets are tested against.

use super::num::{all_below, methods, scalars};
use super::{Num, Whole};
use crate::numeric;
use core::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Sub};

/// Numbers side by side.
const WIDTH: usize = 4;

/// Four numbers.
#[derive(Clone, Copy, Debug)]
pub struct A4([f32; WIDTH]);

/// Four whole numbers.
#[derive(Clone, Copy, Debug)]
pub struct I4([u32; WIDTH]);

/// A value of each lane of two arrays.
#[inline(always)]
fn lanes<A: Copy, B: Copy, R: Copy>(a: [A; WIDTH], b: [B; WIDTH], of: impl Fn(A, B) -> R) -> [R; WIDTH] {
    let ([a0, a1, a2, a3], [b0, b1, b2, b3]) = (a, b);
    [of(a0, b0), of(a1, b1), of(a2, b2), of(a3, b3)]
}

macro_rules! operators {
    ($name:ident: $($operator:ident $method:ident $of:expr),*) => {$(
        impl $operator for $name {
            type Output = $name;

            #[inline(always)]
            fn $method(self, b: $name) -> $name {
                $name(lanes(self.0, b.0, $of))
            }
        }
    )*};
}

operators!(A4: Add add Add::add, Sub sub Sub::sub, Mul mul Mul::mul, Div div Div::div);
operators!(I4: Add add u32::wrapping_add, Mul mul u32::wrapping_mul);
operators!(I4: BitAnd bitand BitAnd::bitand, BitOr bitor BitOr::bitor, BitXor bitxor BitXor::bitxor);
scalars!(A4);

impl Whole for I4 {
    methods! {
        splat(x: u32) -> I4 = I4([x; WIDTH]);
        reverse_bits(self) -> I4 = I4(self.0.map(u32::reverse_bits));
        shl<N>(self) -> I4 = I4(self.0.map(|x| x << (N & 31)));
        shr<N>(self) -> I4 = I4(self.0.map(|x| x >> (N & 31)));
    }
}

impl Num for A4 {
    const WIDTH: usize = WIDTH;
    type Mask = [bool; WIDTH];
    type Whole = I4;
    type Floats = [f32; WIDTH];
    type Ints = [u32; WIDTH];

    methods! {
        up(self) -> A4 = A4([0.0, self.0[0], self.0[1], self.0[2]]);
        splat(x: f32) -> A4 = A4([x; WIDTH]);
        load(lanes: [f32; WIDTH]) -> A4 = A4(lanes);
        store(self) -> [f32; WIDTH] = self.0;
        whole(ints: [u32; WIDTH]) -> I4 = I4(ints);
        ints_of(whole: I4) -> [u32; WIDTH] = whole.0;
        to_bits(self) -> I4 = I4(self.0.map(f32::to_bits));
        from_bits(bits: I4) -> A4 = A4(bits.0.map(f32::from_bits));
        to_whole(self) -> I4 = I4(self.0.map(|x| x as i32 as u32));
        of_whole(whole: I4) -> A4 = A4(whole.0.map(|i| i as i32 as f32));
        sign_bits(whole: I4) -> u32 = Self::bits(whole.0.map(|i| i >> 31 == 1));
        sqrt(self) -> A4 = A4(self.0.map(super::sqrt));
        abs(self) -> A4 = A4(self.0.map(f32::abs));
        copysign(self, sign: A4) -> A4 = A4(lanes(self.0, sign.0, f32::copysign));
        min(self, b: A4) -> A4 = A4(lanes(self.0, b.0, numeric::min));
        max(self, b: A4) -> A4 = A4(lanes(self.0, b.0, numeric::max));
        lt(self, b: A4) -> [bool; WIDTH] = lanes(self.0, b.0, |a, b| a < b);
        le(self, b: A4) -> [bool; WIDTH] = lanes(self.0, b.0, |a, b| a <= b);
        select(mask: [bool; WIDTH], a: A4, b: A4) -> A4 =
            A4(lanes(mask, lanes(a.0, b.0, |a, b| (a, b)), |mask, (a, b)| numeric::select(mask, a, b)));
        and(a: [bool; WIDTH], b: [bool; WIDTH]) -> [bool; WIDTH] = lanes(a, b, |a, b| a & b);
        or(a: [bool; WIDTH], b: [bool; WIDTH]) -> [bool; WIDTH] = lanes(a, b, |a, b| a | b);
        bits(mask: [bool; WIDTH]) -> u32 = mask.iter().rev().fold(0, |bits, &set| bits << 1 | u32::from(set));
    }

    #[inline(always)]
    fn sums(self) -> A4 {
        let [a, b, c, d] = self.0;
        // As a register does it, into which zeros are moved.
        A4([a + 0.0, (b + a) + 0.0, (c + b) + a, (d + c) + (b + a)])
    }

    #[inline(always)]
    fn rows(table: &[[f32; 4]], index: I4) -> [A4; 4] {
        let inside = all_below::<A4>(index, table.len());
        let row = |i: u32| table.get(i as usize).filter(|_| inside).copied().unwrap_or([0.0; 4]);
        let [a, b, c, d] = index.0.map(row);
        let column = |k: usize| A4([a[k & 3], b[k & 3], c[k & 3], d[k & 3]]);
        [column(0), column(1), column(2), column(3)]
    }
}
