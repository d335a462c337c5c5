//! Lanes as two registers of SSE2, which every x86-64 processor has.

use super::{LANES, Lanes};
use core::arch::x86_64::{
    __m128, _mm_add_epi32, _mm_add_ps, _mm_and_ps, _mm_and_si128, _mm_andnot_ps, _mm_castps_si128, _mm_castsi128_ps,
    _mm_cmpeq_epi32, _mm_cmple_ps, _mm_cmplt_epi32, _mm_cmplt_ps, _mm_cvtepi32_ps, _mm_cvttps_epi32, _mm_div_ps,
    _mm_loadu_ps, _mm_max_ps, _mm_min_ps, _mm_movehl_ps, _mm_movelh_ps, _mm_movemask_ps, _mm_mul_ps, _mm_or_ps,
    _mm_set_epi32, _mm_set1_epi32, _mm_set1_ps, _mm_slli_epi32, _mm_sqrt_ps, _mm_srli_epi32, _mm_storeu_ps,
    _mm_sub_epi32, _mm_sub_ps, _mm_unpackhi_ps, _mm_unpacklo_ps, _mm_xor_si128,
};
use core::ops::{Add, Div, Mul, Sub};

/// Eight numbers in two registers.
#[derive(Clone, Copy, Debug)]
pub struct Sse2([__m128; 2]);

impl Sse2 {
    #[inline(always)]
    fn with(self, b: Self, of: impl Fn(__m128, __m128) -> __m128) -> Self {
        Sse2([of(self.0[0], b.0[0]), of(self.0[1], b.0[1])])
    }
}

macro_rules! operator {
    ($operator:ident, $name:ident, $instruction:ident) => {
        impl $operator for Sse2 {
            type Output = Sse2;

            #[inline(always)]
            fn $name(self, b: Sse2) -> Sse2 {
                // SAFETY: SSE2 is part of x86-64.
                self.with(b, |a, b| unsafe { $instruction(a, b) })
            }
        }
    };
}

operator!(Add, add, _mm_add_ps);
operator!(Sub, sub, _mm_sub_ps);
operator!(Mul, mul, _mm_mul_ps);
operator!(Div, div, _mm_div_ps);

impl Lanes for Sse2 {
    type Mask = Sse2;
    type Index = Sse2;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        let register = unsafe { _mm_set1_ps(x) };
        Sse2([register; 2])
    }

    #[inline(always)]
    fn from_array(lanes: [f32; LANES]) -> Self {
        let start = lanes.as_ptr();
        // SAFETY: SSE2 is part of x86-64; both loads lie in the array.
        unsafe { Sse2([_mm_loadu_ps(start), _mm_loadu_ps(start.add(4))]) }
    }

    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        let mut lanes = [0.0; LANES];
        let start = lanes.as_mut_ptr();
        // SAFETY: SSE2 is part of x86-64; both stores lie in the array.
        unsafe {
            _mm_storeu_ps(start, self.0[0]);
            _mm_storeu_ps(start.add(4), self.0[1]);
        }
        lanes
    }

    #[inline(always)]
    fn transpose(rows: [&[f32; 4]; LANES]) -> [Self; 4] {
        let [a, b, c, d, e, f, g, h] = rows;
        let (low, high) = (transpose4([a, b, c, d]), transpose4([e, f, g, h]));
        [Sse2([low[0], high[0]]), Sse2([low[1], high[1]]), Sse2([low[2], high[2]]), Sse2([low[3], high[3]])]
    }

    #[inline(always)]
    fn rows([a, b, c, d]: [Self; 4]) -> [[f32; 4]; LANES] {
        let mut rows = [[0.0; 4]; LANES];
        for half in [0, 1] {
            let four = transpose_registers([a.0[half], b.0[half], c.0[half], d.0[half]]);
            for (row, register) in rows.iter_mut().skip(4 * half).zip(four) {
                // SAFETY: SSE2 is part of x86-64; the store is to the row.
                unsafe { _mm_storeu_ps(row.as_mut_ptr(), register) };
            }
        }
        rows
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        Sse2(self.0.map(|a| unsafe { _mm_sqrt_ps(a) }))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        self.with(Self::splat(-0.0), |a, sign| unsafe { _mm_andnot_ps(sign, a) })
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        let only_sign = sign.with(Self::splat(-0.0), |a, bit| unsafe { _mm_and_ps(bit, a) });
        // SAFETY: as above.
        self.abs().with(only_sign, |a, b| unsafe { _mm_or_ps(a, b) })
    }

    #[inline(always)]
    fn before(self) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        Sse2(self.0.map(|a| unsafe { _mm_castsi128_ps(_mm_add_epi32(_mm_castps_si128(a), _mm_set1_epi32(-1))) }))
    }

    #[inline(always)]
    fn min(self, b: Self) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        self.with(b, |a, b| unsafe { _mm_min_ps(a, b) })
    }

    #[inline(always)]
    fn max(self, b: Self) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        self.with(b, |a, b| unsafe { _mm_max_ps(a, b) })
    }

    #[inline(always)]
    fn lt(self, b: Self) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        self.with(b, |a, b| unsafe { _mm_cmplt_ps(a, b) })
    }

    #[inline(always)]
    fn le(self, b: Self) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        self.with(b, |a, b| unsafe { _mm_cmple_ps(a, b) })
    }

    #[inline(always)]
    fn select(mask: Self, a: Self, b: Self) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        let chosen = mask.with(a, |mask, a| unsafe { _mm_and_ps(mask, a) });
        // SAFETY: as above.
        let others = mask.with(b, |mask, b| unsafe { _mm_andnot_ps(mask, b) });
        // SAFETY: as above.
        chosen.with(others, |a, b| unsafe { _mm_or_ps(a, b) })
    }

    #[inline(always)]
    fn select_mask(mask: Self, a: Self, b: Self) -> Self {
        Self::select(mask, a, b)
    }

    #[inline(always)]
    fn and(a: Self, b: Self) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        a.with(b, |a, b| unsafe { _mm_and_ps(a, b) })
    }

    #[inline(always)]
    fn or(a: Self, b: Self) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        a.with(b, |a, b| unsafe { _mm_or_ps(a, b) })
    }

    #[inline(always)]
    fn index(numbers: [u32; LANES]) -> Self {
        Self::from_array(numbers.map(f32::from_bits))
    }

    #[inline(always)]
    fn numbers(index: Self) -> [u32; LANES] {
        index.to_array().map(f32::to_bits)
    }

    #[inline(always)]
    fn transpose_index(rows: [&[u32; 4]; LANES]) -> [Self; 4] {
        // SAFETY: numbers of both kinds have the same size and alignment, and any bits are one.
        Self::transpose(rows.map(|row| unsafe { &*row.as_ptr().cast() }))
    }

    #[inline(always)]
    fn select_index(mask: Self, a: Self, b: Self) -> Self {
        Self::select(mask, a, b)
    }

    #[inline(always)]
    fn truncate(self) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        Sse2(self.0.map(|a| unsafe { _mm_castsi128_ps(_mm_cvttps_epi32(a)) }))
    }

    #[inline(always)]
    fn from_index(index: Self) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        Sse2(index.0.map(|a| unsafe { _mm_cvtepi32_ps(_mm_castps_si128(a)) }))
    }

    #[inline(always)]
    fn add_index(a: Self, b: Self) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        a.with(b, |a, b| unsafe { _mm_castsi128_ps(_mm_add_epi32(_mm_castps_si128(a), _mm_castps_si128(b))) })
    }

    #[inline(always)]
    fn with_bits(index: Self) -> Self {
        index
    }

    #[inline(always)]
    fn halves(index: Self, add: u32) -> [Self; 2] {
        // SAFETY: SSE2 is part of x86-64.
        unsafe {
            let (mask, add) = (_mm_set1_epi32(0xffff << 12), _mm_set1_epi32(add as i32));
            let low = |a| _mm_add_epi32(_mm_and_si128(_mm_slli_epi32::<12>(_mm_castps_si128(a)), mask), add);
            let high = |a| _mm_add_epi32(_mm_and_si128(_mm_srli_epi32::<4>(_mm_castps_si128(a)), mask), add);
            let [first, second] = index.0;
            [
                Sse2([_mm_castsi128_ps(low(first)), _mm_castsi128_ps(low(second))]),
                Sse2([_mm_castsi128_ps(high(first)), _mm_castsi128_ps(high(second))]),
            ]
        }
    }

    #[inline(always)]
    fn below(index: Self, bound: u32) -> Self {
        // SSE2 compares signed numbers only: both are moved by half of the range.
        // SAFETY: SSE2 is part of x86-64.
        unsafe {
            let half = _mm_set1_epi32(i32::MIN);
            let bound = _mm_xor_si128(_mm_set1_epi32(bound as i32), half);
            Sse2(index.0.map(|a| {
                let index = _mm_xor_si128(_mm_castps_si128(a), half);
                _mm_castsi128_ps(_mm_cmplt_epi32(index, bound))
            }))
        }
    }

    #[inline(always)]
    fn highest_bits(index: Self) -> u32 {
        Self::bits(index)
    }

    #[inline(always)]
    fn child(squares: Self, [first, second]: [Self; 2]) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        let of = |square, first, second| unsafe {
            // A set mask is -1 as an integer.
            let (first, second) = (_mm_castps_si128(first), _mm_castps_si128(second));
            let c = _mm_sub_epi32(_mm_sub_epi32(_mm_set1_epi32(1), second), _mm_add_epi32(first, first));
            _mm_castsi128_ps(_mm_add_epi32(_mm_slli_epi32::<2>(_mm_castps_si128(square)), c))
        };
        let ([a, b], [c, d], [e, f]) = (squares.0, first.0, second.0);
        Sse2([of(a, c, e), of(b, d, f)])
    }

    #[inline(always)]
    fn gather(rows: &[[f32; 4]], index: Self) -> [Self; 4] {
        let exist = Self::bits(Self::below(index, rows.len().min(u32::MAX as usize) as u32));
        if exist != 0xff {
            return Self::gather_each(rows, index);
        }
        let start = rows.as_ptr();
        // SAFETY: every number is below the number of rows.
        Self::transpose(Self::numbers(index).map(|number| unsafe { &*start.add(number as usize) }))
    }

    #[inline(always)]
    fn mask(bits: u32) -> Self {
        // SAFETY: SSE2 is part of x86-64.
        unsafe {
            let bits = _mm_set1_epi32(bits as i32);
            let lanes = [_mm_set_epi32(8, 4, 2, 1), _mm_set_epi32(128, 64, 32, 16)];
            Sse2(lanes.map(|lane| _mm_castsi128_ps(_mm_cmpeq_epi32(_mm_and_si128(bits, lane), lane))))
        }
    }

    #[inline(always)]
    fn bits(mask: Self) -> u32 {
        // SAFETY: SSE2 is part of x86-64.
        let [low, high] = mask.0.map(|a| unsafe { _mm_movemask_ps(a) });
        (low | high << 4) as u32
    }
}

/// Columns of four rows.
#[inline(always)]
fn transpose4(rows: [&[f32; 4]; 4]) -> [__m128; 4] {
    // SAFETY: SSE2 is part of x86-64; each load is of the four numbers of a row.
    transpose_registers(rows.map(|row| unsafe { _mm_loadu_ps(row.as_ptr()) }))
}

#[inline(always)]
fn transpose_registers([a, b, c, d]: [__m128; 4]) -> [__m128; 4] {
    // SAFETY: SSE2 is part of x86-64.
    unsafe {
        let (ab_low, ab_high) = (_mm_unpacklo_ps(a, b), _mm_unpackhi_ps(a, b));
        let (cd_low, cd_high) = (_mm_unpacklo_ps(c, d), _mm_unpackhi_ps(c, d));
        [
            _mm_movelh_ps(ab_low, cd_low),
            _mm_movehl_ps(cd_low, ab_low),
            _mm_movelh_ps(ab_high, cd_high),
            _mm_movehl_ps(cd_high, ab_high),
        ]
    }
}

super::num::scalars!(Sse2);
