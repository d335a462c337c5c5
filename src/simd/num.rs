//! Numbers of any width: one `f32`, or eight in lanes. A kernel that is generic over [`Num`] is written once; a call for
//! one element runs it at width 1, a batch at width 8, with the same bits.

use super::apart::{Apart, apart};
use super::{LANES, Lanes};
use crate::numeric;
use core::ops::{Add, Div, Mul, Sub};

/// One number, or one for each lane.
pub trait Num:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + 'static
{
    /// How many numbers stand side by side.
    const WIDTH: usize;
    /// A truth value for each lane.
    type Mask: Copy;
    /// The numbers as an array.
    type Floats: Copy + AsRef<[f32]> + AsMut<[f32]>;
    /// A whole number for each lane.
    type Ints: Copy + AsRef<[u32]> + AsMut<[u32]>;

    /// The same number in all lanes.
    fn splat(x: f32) -> Self;
    /// The numbers of an array.
    fn load(lanes: Self::Floats) -> Self;
    /// The numbers as an array.
    fn store(self) -> Self::Floats;
    /// The first numbers of a slice; zeros if it is too short.
    fn read(numbers: &[f32]) -> Self;
    /// The first whole numbers of a slice; zeros if it is too short.
    fn read_ints(numbers: &[u32]) -> Self::Ints;
    /// Zeros, to be filled lane by lane.
    fn floats() -> Self::Floats;
    /// Zeros, to be filled lane by lane.
    fn ints() -> Self::Ints;
    /// The square root.
    fn sqrt(self) -> Self;
    /// The number without its sign.
    fn abs(self) -> Self;
    /// The number with the sign of another.
    fn copysign(self, sign: Self) -> Self;
    /// The smaller of two, by comparison; `b` if either is NaN.
    fn min(self, b: Self) -> Self;
    /// The larger of two, by comparison; `b` if either is NaN.
    fn max(self, b: Self) -> Self;
    /// self < b.
    fn lt(self, b: Self) -> Self::Mask;
    /// self <= b.
    fn le(self, b: Self) -> Self::Mask;
    /// `a` where the mask is set, elsewhere `b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// Both.
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Either.
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// The lanes of a mask as bits, lane 0 lowest.
    fn bits(mask: Self::Mask) -> u32;
    /// The whole numbers below 2^31 in front of the fractions of numbers from 0 on; of others, anything.
    fn truncate(self) -> Self::Ints;
    /// The numbers nearest to whole numbers below 2^31.
    fn of_ints(ints: Self::Ints) -> Self;

    /// The low and the high half of each whole number, moved up by 12 bits and added to `add`: the bits of two numbers.
    fn halves(ints: Self::Ints, add: u32) -> [Self; 2];
    /// Runs a computation as a function of its own, compiled for these numbers.
    fn apart<K: Apart<Self>>(computation: K) -> K::Output;

    /// `a` where the mask is set, elsewhere 0.
    #[inline(always)]
    fn only(mask: Self::Mask, a: Self) -> Self {
        Self::select(mask, a, Self::splat(0.0))
    }

    /// A number for each lane, from its place.
    #[inline(always)]
    fn each(mut of: impl FnMut(usize) -> f32) -> Self {
        let mut lanes = Self::floats();
        for (lane, out) in lanes.as_mut().iter_mut().enumerate() {
            *out = of(lane);
        }
        Self::load(lanes)
    }

    /// A whole number for each lane, from its place.
    #[inline(always)]
    fn each_int(mut of: impl FnMut(usize) -> u32) -> Self::Ints {
        let mut lanes = Self::ints();
        for (lane, out) in lanes.as_mut().iter_mut().enumerate() {
            *out = of(lane);
        }
        lanes
    }
}

impl Num for f32 {
    const WIDTH: usize = 1;
    type Mask = bool;
    type Floats = [f32; 1];
    type Ints = [u32; 1];

    #[inline(always)]
    fn splat(x: f32) -> f32 {
        x
    }

    #[inline(always)]
    fn load([x]: [f32; 1]) -> f32 {
        x
    }

    #[inline(always)]
    fn store(self) -> [f32; 1] {
        [self]
    }

    #[inline(always)]
    fn read(numbers: &[f32]) -> f32 {
        numbers.first().copied().unwrap_or(0.0)
    }

    #[inline(always)]
    fn read_ints(numbers: &[u32]) -> [u32; 1] {
        [numbers.first().copied().unwrap_or(0)]
    }

    #[inline(always)]
    fn floats() -> [f32; 1] {
        [0.0]
    }

    #[inline(always)]
    fn ints() -> [u32; 1] {
        [0]
    }

    #[inline(always)]
    fn sqrt(self) -> f32 {
        super::sqrt(self)
    }

    #[inline(always)]
    fn abs(self) -> f32 {
        f32::abs(self)
    }

    #[inline(always)]
    fn copysign(self, sign: f32) -> f32 {
        f32::copysign(self, sign)
    }

    #[inline(always)]
    fn min(self, b: f32) -> f32 {
        numeric::min(self, b)
    }

    #[inline(always)]
    fn max(self, b: f32) -> f32 {
        numeric::max(self, b)
    }

    #[inline(always)]
    fn lt(self, b: f32) -> bool {
        self < b
    }

    #[inline(always)]
    fn le(self, b: f32) -> bool {
        self <= b
    }

    #[inline(always)]
    fn select(mask: bool, a: f32, b: f32) -> f32 {
        numeric::select(mask, a, b)
    }

    #[inline(always)]
    fn and(a: bool, b: bool) -> bool {
        a & b
    }

    #[inline(always)]
    fn or(a: bool, b: bool) -> bool {
        a | b
    }

    #[inline(always)]
    fn apart<K: Apart<f32>>(computation: K) -> K::Output {
        apart(computation)
    }

    #[inline(always)]
    fn bits(mask: bool) -> u32 {
        mask.into()
    }

    #[inline(always)]
    fn truncate(self) -> [u32; 1] {
        [self as i32 as u32]
    }

    #[inline(always)]
    fn of_ints([i]: [u32; 1]) -> f32 {
        i as i32 as f32
    }

    #[inline(always)]
    fn halves([i]: [u32; 1], add: u32) -> [f32; 2] {
        [f32::from_bits(((i & 0xffff) << 12).wrapping_add(add)), f32::from_bits(((i >> 16) << 12).wrapping_add(add))]
    }
}

impl<F: Lanes> Num for F {
    const WIDTH: usize = LANES;
    type Mask = <F as Lanes>::Mask;
    type Floats = [f32; LANES];
    type Ints = [u32; LANES];

    #[inline(always)]
    fn splat(x: f32) -> F {
        <F as Lanes>::splat(x)
    }

    #[inline(always)]
    fn load(lanes: [f32; LANES]) -> F {
        F::from_array(lanes)
    }

    #[inline(always)]
    fn store(self) -> [f32; LANES] {
        self.to_array()
    }

    #[inline(always)]
    fn read(numbers: &[f32]) -> F {
        F::from_array(numbers.first_chunk().copied().unwrap_or([0.0; LANES]))
    }

    #[inline(always)]
    fn read_ints(numbers: &[u32]) -> [u32; LANES] {
        numbers.first_chunk().copied().unwrap_or([0; LANES])
    }

    #[inline(always)]
    fn floats() -> [f32; LANES] {
        [0.0; LANES]
    }

    #[inline(always)]
    fn ints() -> [u32; LANES] {
        [0; LANES]
    }

    #[inline(always)]
    fn sqrt(self) -> F {
        <F as Lanes>::sqrt(self)
    }

    #[inline(always)]
    fn abs(self) -> F {
        <F as Lanes>::abs(self)
    }

    #[inline(always)]
    fn copysign(self, sign: F) -> F {
        <F as Lanes>::copysign(self, sign)
    }

    #[inline(always)]
    fn min(self, b: F) -> F {
        <F as Lanes>::min(self, b)
    }

    #[inline(always)]
    fn max(self, b: F) -> F {
        <F as Lanes>::max(self, b)
    }

    #[inline(always)]
    fn lt(self, b: F) -> <F as Lanes>::Mask {
        <F as Lanes>::lt(self, b)
    }

    #[inline(always)]
    fn le(self, b: F) -> <F as Lanes>::Mask {
        <F as Lanes>::le(self, b)
    }

    #[inline(always)]
    fn select(mask: <F as Lanes>::Mask, a: F, b: F) -> F {
        <F as Lanes>::select(mask, a, b)
    }

    #[inline(always)]
    fn and(a: <F as Lanes>::Mask, b: <F as Lanes>::Mask) -> <F as Lanes>::Mask {
        <F as Lanes>::and(a, b)
    }

    #[inline(always)]
    fn or(a: <F as Lanes>::Mask, b: <F as Lanes>::Mask) -> <F as Lanes>::Mask {
        <F as Lanes>::or(a, b)
    }

    #[inline(always)]
    fn bits(mask: <F as Lanes>::Mask) -> u32 {
        <F as Lanes>::bits(mask)
    }

    #[inline(always)]
    fn truncate(self) -> [u32; LANES] {
        F::numbers(<F as Lanes>::truncate(self))
    }

    #[inline(always)]
    fn of_ints(ints: [u32; LANES]) -> F {
        F::from_index(F::index(ints))
    }

    #[inline(always)]
    fn apart<K: Apart<F>>(computation: K) -> K::Output {
        <F as Lanes>::apart(computation)
    }

    #[inline(always)]
    fn halves(ints: [u32; LANES], add: u32) -> [F; 2] {
        <F as Lanes>::halves(F::index(ints), add)
    }
}
