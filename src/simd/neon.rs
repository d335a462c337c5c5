//! Lanes as two registers of NEON, which every AArch64 processor has.

use super::{LANES, Lanes};
use core::arch::aarch64::{
    float32x4_t, uint32x4_t, vabsq_f32, vaddq_f32, vaddq_u32, vaddvq_u32, vandq_u32, vbslq_f32, vbslq_u32, vcgtq_f32,
    vcleq_f32, vcltq_f32, vcltq_u32, vcvtq_f32_u32, vcvtq_u32_f32, vdivq_f32, vdupq_n_f32, vdupq_n_u32, vld1q_f32,
    vld1q_u32, vmulq_f32, vorrq_u32, vreinterpretq_f32_f64, vreinterpretq_f32_u32, vreinterpretq_f64_f32,
    vreinterpretq_u32_f32, vshlq_n_u32, vshrq_n_u32, vsqrtq_f32, vst1q_f32, vst1q_u32, vsubq_f32, vsubq_u32, vtstq_u32,
    vzip1q_f32, vzip1q_f64, vzip2q_f32, vzip2q_f64,
};
use core::ops::{Add, Div, Mul, Sub};

/// Eight numbers in two registers.
#[derive(Clone, Copy, Debug)]
pub struct Neon([float32x4_t; 2]);

/// Eight whole numbers in two registers; as a mask, each 0 or all ones.
#[derive(Clone, Copy, Debug)]
pub struct Whole([uint32x4_t; 2]);

/// The bit of each lane.
const LANE_BITS: [[u32; 4]; 2] = [[1, 2, 4, 8], [16, 32, 64, 128]];

impl Neon {
    #[inline(always)]
    fn with(self, b: Self, of: impl Fn(float32x4_t, float32x4_t) -> float32x4_t) -> Self {
        Neon([of(self.0[0], b.0[0]), of(self.0[1], b.0[1])])
    }

    #[inline(always)]
    fn compare(self, b: Self, of: impl Fn(float32x4_t, float32x4_t) -> uint32x4_t) -> Whole {
        Whole([of(self.0[0], b.0[0]), of(self.0[1], b.0[1])])
    }
}

impl Whole {
    #[inline(always)]
    fn splat(number: u32) -> Self {
        // SAFETY: NEON is part of AArch64.
        Whole([unsafe { vdupq_n_u32(number) }; 2])
    }

    #[inline(always)]
    fn with(self, b: Self, of: impl Fn(uint32x4_t, uint32x4_t) -> uint32x4_t) -> Self {
        Whole([of(self.0[0], b.0[0]), of(self.0[1], b.0[1])])
    }

    #[inline(always)]
    fn lane_bits() -> Self {
        // SAFETY: NEON is part of AArch64; each load is of an array of four.
        Whole(LANE_BITS.map(|bits| unsafe { vld1q_u32(bits.as_ptr()) }))
    }
}

macro_rules! operator {
    ($operator:ident, $name:ident, $instruction:ident) => {
        impl $operator for Neon {
            type Output = Neon;

            #[inline(always)]
            fn $name(self, b: Neon) -> Neon {
                // SAFETY: NEON is part of AArch64.
                self.with(b, |a, b| unsafe { $instruction(a, b) })
            }
        }
    };
}

operator!(Add, add, vaddq_f32);
operator!(Sub, sub, vsubq_f32);
operator!(Mul, mul, vmulq_f32);
operator!(Div, div, vdivq_f32);

impl Lanes for Neon {
    type Mask = Whole;
    type Index = Whole;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: NEON is part of AArch64.
        Neon([unsafe { vdupq_n_f32(x) }; 2])
    }

    #[inline(always)]
    fn from_array(lanes: [f32; LANES]) -> Self {
        let start = lanes.as_ptr();
        // SAFETY: NEON is part of AArch64; both loads lie in the array.
        unsafe { Neon([vld1q_f32(start), vld1q_f32(start.add(4))]) }
    }

    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        let mut lanes = [0.0; LANES];
        let start = lanes.as_mut_ptr();
        // SAFETY: NEON is part of AArch64; both stores lie in the array.
        unsafe {
            vst1q_f32(start, self.0[0]);
            vst1q_f32(start.add(4), self.0[1]);
        }
        lanes
    }

    #[inline(always)]
    fn transpose(rows: [&[f32; 4]; LANES]) -> [Self; 4] {
        let [a, b, c, d, e, f, g, h] = rows;
        let (low, high) = (transpose4([a, b, c, d]), transpose4([e, f, g, h]));
        [Neon([low[0], high[0]]), Neon([low[1], high[1]]), Neon([low[2], high[2]]), Neon([low[3], high[3]])]
    }

    #[inline(always)]
    fn rows([a, b, c, d]: [Self; 4]) -> [[f32; 4]; LANES] {
        let mut rows = [[0.0; 4]; LANES];
        for half in [0, 1] {
            let four = transpose_registers([a.0[half], b.0[half], c.0[half], d.0[half]]);
            for (row, register) in rows.iter_mut().skip(4 * half).zip(four) {
                // SAFETY: NEON is part of AArch64; the store is to the row.
                unsafe { vst1q_f32(row.as_mut_ptr(), register) };
            }
        }
        rows
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: NEON is part of AArch64.
        Neon(self.0.map(|a| unsafe { vsqrtq_f32(a) }))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: NEON is part of AArch64.
        Neon(self.0.map(|a| unsafe { vabsq_f32(a) }))
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        // SAFETY: NEON is part of AArch64.
        self.with(sign, |a, sign| unsafe { vbslq_f32(vdupq_n_u32(1 << 31), sign, a) })
    }

    #[inline(always)]
    fn before(self) -> Self {
        // SAFETY: NEON is part of AArch64.
        Neon(self.0.map(|a| unsafe { vreinterpretq_f32_u32(vsubq_u32(vreinterpretq_u32_f32(a), vdupq_n_u32(1))) }))
    }

    // The minimum and maximum of NEON answer NaN where a number is one.
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        // SAFETY: NEON is part of AArch64.
        self.with(b, |a, b| unsafe { vbslq_f32(vcltq_f32(a, b), a, b) })
    }

    #[inline(always)]
    fn max(self, b: Self) -> Self {
        // SAFETY: NEON is part of AArch64.
        self.with(b, |a, b| unsafe { vbslq_f32(vcgtq_f32(a, b), a, b) })
    }

    #[inline(always)]
    fn lt(self, b: Self) -> Whole {
        // SAFETY: NEON is part of AArch64.
        self.compare(b, |a, b| unsafe { vcltq_f32(a, b) })
    }

    #[inline(always)]
    fn le(self, b: Self) -> Whole {
        // SAFETY: NEON is part of AArch64.
        self.compare(b, |a, b| unsafe { vcleq_f32(a, b) })
    }

    #[inline(always)]
    fn select(mask: Whole, a: Self, b: Self) -> Self {
        let ([m, n], [a, c], [b, d]) = (mask.0, a.0, b.0);
        // SAFETY: NEON is part of AArch64.
        unsafe { Neon([vbslq_f32(m, a, b), vbslq_f32(n, c, d)]) }
    }

    #[inline(always)]
    fn select_mask(mask: Whole, a: Whole, b: Whole) -> Whole {
        let ([m, n], [a, c], [b, d]) = (mask.0, a.0, b.0);
        // SAFETY: NEON is part of AArch64.
        unsafe { Whole([vbslq_u32(m, a, b), vbslq_u32(n, c, d)]) }
    }

    #[inline(always)]
    fn and(a: Whole, b: Whole) -> Whole {
        // SAFETY: NEON is part of AArch64.
        a.with(b, |a, b| unsafe { vandq_u32(a, b) })
    }

    #[inline(always)]
    fn or(a: Whole, b: Whole) -> Whole {
        // SAFETY: NEON is part of AArch64.
        a.with(b, |a, b| unsafe { vorrq_u32(a, b) })
    }

    #[inline(always)]
    fn index(numbers: [u32; LANES]) -> Whole {
        let start = numbers.as_ptr();
        // SAFETY: NEON is part of AArch64; both loads lie in the array.
        unsafe { Whole([vld1q_u32(start), vld1q_u32(start.add(4))]) }
    }

    #[inline(always)]
    fn numbers(index: Whole) -> [u32; LANES] {
        let mut numbers = [0; LANES];
        let start = numbers.as_mut_ptr();
        // SAFETY: NEON is part of AArch64; both stores lie in the array.
        unsafe {
            vst1q_u32(start, index.0[0]);
            vst1q_u32(start.add(4), index.0[1]);
        }
        numbers
    }

    #[inline(always)]
    fn transpose_index(rows: [&[u32; 4]; LANES]) -> [Whole; 4] {
        // SAFETY: numbers of both kinds have the same size and alignment, and any bits are one.
        let columns = Self::transpose(rows.map(|row| unsafe { &*row.as_ptr().cast() }));
        // SAFETY: NEON is part of AArch64.
        columns.map(|column| Whole(column.0.map(|a| unsafe { vreinterpretq_u32_f32(a) })))
    }

    #[inline(always)]
    fn select_index(mask: Whole, a: Whole, b: Whole) -> Whole {
        Self::select_mask(mask, a, b)
    }

    #[inline(always)]
    fn truncate(self) -> Whole {
        // SAFETY: NEON is part of AArch64.
        Whole(self.0.map(|a| unsafe { vcvtq_u32_f32(a) }))
    }

    #[inline(always)]
    fn from_index(index: Whole) -> Self {
        // SAFETY: NEON is part of AArch64.
        Neon(index.0.map(|a| unsafe { vcvtq_f32_u32(a) }))
    }

    #[inline(always)]
    fn add_index(a: Whole, b: Whole) -> Whole {
        // SAFETY: NEON is part of AArch64.
        a.with(b, |a, b| unsafe { vaddq_u32(a, b) })
    }

    #[inline(always)]
    fn with_bits(index: Whole) -> Self {
        // SAFETY: NEON is part of AArch64.
        Neon(index.0.map(|a| unsafe { vreinterpretq_f32_u32(a) }))
    }

    #[inline(always)]
    fn halves(index: Whole, add: u32) -> [Self; 2] {
        // SAFETY: NEON is part of AArch64.
        unsafe {
            let (mask, add) = (vdupq_n_u32(0xffff << 12), vdupq_n_u32(add));
            let number = |bits| vreinterpretq_f32_u32(vaddq_u32(vandq_u32(bits, mask), add));
            [Neon(index.0.map(|a| number(vshlq_n_u32::<12>(a)))), Neon(index.0.map(|a| number(vshrq_n_u32::<4>(a))))]
        }
    }

    #[inline(always)]
    fn below(index: Whole, bound: u32) -> Whole {
        // SAFETY: NEON is part of AArch64.
        index.with(Whole::splat(bound), |a, bound| unsafe { vcltq_u32(a, bound) })
    }

    #[inline(always)]
    fn highest_bits(index: Whole) -> u32 {
        // SAFETY: NEON is part of AArch64.
        Self::bits(index.with(Whole::splat(1 << 31), |a, bit| unsafe { vtstq_u32(a, bit) }))
    }

    #[inline(always)]
    fn child(squares: Whole, [first, second]: [Whole; 2]) -> Whole {
        // SAFETY: NEON is part of AArch64.
        let c = first.with(second, |first, second| unsafe {
            vaddq_u32(vshlq_n_u32::<1>(vshrq_n_u32::<31>(first)), vshrq_n_u32::<31>(second))
        });
        // SAFETY: as above.
        squares.with(c, |square, c| unsafe { vaddq_u32(vshlq_n_u32::<2>(square), vaddq_u32(c, vdupq_n_u32(1))) })
    }

    #[inline(always)]
    fn gather(rows: &[[f32; 4]], index: Whole) -> [Self; 4] {
        let exist = Self::bits(Self::below(index, rows.len().min(u32::MAX as usize) as u32));
        if exist != 0xff {
            return Self::gather_each(rows, index);
        }
        let start = rows.as_ptr();
        // SAFETY: every number is below the number of rows.
        Self::transpose(Self::numbers(index).map(|number| unsafe { &*start.add(number as usize) }))
    }

    #[inline(always)]
    fn mask(bits: u32) -> Whole {
        // SAFETY: NEON is part of AArch64.
        Whole::splat(bits).with(Whole::lane_bits(), |bits, lane| unsafe { vtstq_u32(bits, lane) })
    }

    #[inline(always)]
    fn bits(mask: Whole) -> u32 {
        let [low, high] = Self::and(mask, Whole::lane_bits()).0;
        // SAFETY: NEON is part of AArch64.
        unsafe { vaddvq_u32(vorrq_u32(low, high)) }
    }
}

/// Columns of four rows.
#[inline(always)]
fn transpose4(rows: [&[f32; 4]; 4]) -> [float32x4_t; 4] {
    // SAFETY: NEON is part of AArch64; each load is of the four numbers of a row.
    transpose_registers(rows.map(|row| unsafe { vld1q_f32(row.as_ptr()) }))
}

#[inline(always)]
fn transpose_registers([a, b, c, d]: [float32x4_t; 4]) -> [float32x4_t; 4] {
    // SAFETY: NEON is part of AArch64.
    unsafe {
        let pairs = |a, b| (vreinterpretq_f64_f32(vzip1q_f32(a, b)), vreinterpretq_f64_f32(vzip2q_f32(a, b)));
        let ((ab_low, ab_high), (cd_low, cd_high)) = (pairs(a, b), pairs(c, d));
        let columns = [
            vzip1q_f64(ab_low, cd_low),
            vzip2q_f64(ab_low, cd_low),
            vzip1q_f64(ab_high, cd_high),
            vzip2q_f64(ab_high, cd_high),
        ];
        columns.map(|column| vreinterpretq_f32_f64(column))
    }
}

super::num::scalars!(Neon);
