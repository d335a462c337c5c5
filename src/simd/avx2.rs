//! Lanes as one register of AVX2. What computes with them must be inlined into a function that is compiled for AVX2.

use super::{Apart, LANES, Lanes};
use core::arch::x86_64::{
    __m256, _CMP_LE_OQ, _CMP_LT_OQ, _mm_loadu_ps, _mm_storeu_ps, _mm256_add_epi32, _mm256_add_ps, _mm256_and_ps,
    _mm256_and_si256, _mm256_andnot_ps, _mm256_blendv_ps, _mm256_castps_si256, _mm256_castps128_ps256,
    _mm256_castps256_ps128, _mm256_castsi256_ps, _mm256_cmp_ps, _mm256_cmpeq_epi32, _mm256_cmpgt_epi32,
    _mm256_cvtepi32_ps, _mm256_cvttps_epi32, _mm256_div_ps, _mm256_extractf128_ps, _mm256_insertf128_ps,
    _mm256_loadu_ps, _mm256_max_ps, _mm256_min_ps, _mm256_movemask_ps, _mm256_mul_ps, _mm256_or_ps, _mm256_set_epi32,
    _mm256_set1_epi32, _mm256_set1_ps, _mm256_shuffle_ps, _mm256_slli_epi32, _mm256_sqrt_ps, _mm256_srli_epi32,
    _mm256_storeu_ps, _mm256_sub_epi32, _mm256_sub_ps, _mm256_unpackhi_ps, _mm256_unpacklo_ps, _mm256_xor_si256,
};
use core::ops::{Add, Div, Mul, Sub};

/// Eight numbers in a register.
///
/// A value exists only on a processor with AVX2: only `level` names the type, to enter kernels at a level that was
/// detected.
#[derive(Clone, Copy, Debug)]
pub(super) struct Avx2(__m256);

macro_rules! operator {
    ($operator:ident, $name:ident, $instruction:ident) => {
        impl $operator for Avx2 {
            type Output = Avx2;

            #[inline(always)]
            fn $name(self, b: Avx2) -> Avx2 {
                // SAFETY: the value shows that there is AVX2.
                Avx2(unsafe { $instruction(self.0, b.0) })
            }
        }
    };
}

operator!(Add, add, _mm256_add_ps);
operator!(Sub, sub, _mm256_sub_ps);
operator!(Mul, mul, _mm256_mul_ps);
operator!(Div, div, _mm256_div_ps);

/// # Safety
/// The processor has AVX2.
#[target_feature(enable = "avx2")]
#[inline(never)]
unsafe fn apart<K: Apart<Avx2>>(computation: K) -> K::Output {
    computation.run()
}

impl Lanes for Avx2 {
    type Mask = Avx2;
    type Index = Avx2;

    #[inline(always)]
    fn apart<K: Apart<Self>>(computation: K) -> K::Output {
        // SAFETY: whoever chose this type found AVX2.
        unsafe { apart(computation) }
    }

    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: whoever chose this type found AVX2.
        Avx2(unsafe { _mm256_set1_ps(x) })
    }

    #[inline(always)]
    fn from_array(lanes: [f32; LANES]) -> Self {
        // SAFETY: as in `splat`; the load is of the array.
        Avx2(unsafe { _mm256_loadu_ps(lanes.as_ptr()) })
    }

    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        let mut lanes = [0.0; LANES];
        // SAFETY: the value shows that there is AVX2; the store is to the array.
        unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), self.0) };
        lanes
    }

    #[inline(always)]
    fn transpose(rows: [&[f32; 4]; LANES]) -> [Self; 4] {
        let [a, b, c, d, e, f, g, h] = rows;
        // SAFETY: as in `splat`; each load is of the four numbers of a row.
        unsafe {
            // Lane i and lane i + 4 share a register, so that the transposition of both halves is one.
            let pair = |low: &[f32; 4], high: &[f32; 4]| {
                let low = _mm256_castps128_ps256(_mm_loadu_ps(low.as_ptr()));
                _mm256_insertf128_ps::<1>(low, _mm_loadu_ps(high.as_ptr()))
            };
            transpose_registers([pair(a, e), pair(b, f), pair(c, g), pair(d, h)]).map(Avx2)
        }
    }

    #[inline(always)]
    fn rows([a, b, c, d]: [Self; 4]) -> [[f32; 4]; LANES] {
        let mut rows = [[0.0; 4]; LANES];
        // Rows i and i + 4 share a register.
        for (i, pair) in transpose_registers([a.0, b.0, c.0, d.0]).into_iter().enumerate() {
            // SAFETY: the value shows that there is AVX2; the stores are to the rows.
            unsafe {
                _mm_storeu_ps(rows[i & 3].as_mut_ptr(), _mm256_castps256_ps128(pair));
                _mm_storeu_ps(rows[i & 3 | 4].as_mut_ptr(), _mm256_extractf128_ps::<1>(pair));
            }
        }
        rows
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: the value shows that there is AVX2.
        Avx2(unsafe { _mm256_sqrt_ps(self.0) })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: the value shows that there is AVX2.
        Avx2(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        // SAFETY: the value shows that there is AVX2.
        unsafe { Avx2(_mm256_or_ps(self.abs().0, _mm256_and_ps(_mm256_set1_ps(-0.0), sign.0))) }
    }

    #[inline(always)]
    fn before(self) -> Self {
        // SAFETY: the value shows that there is AVX2.
        unsafe {
            let less = _mm256_add_epi32(_mm256_castps_si256(self.0), _mm256_set1_epi32(-1));
            Avx2(_mm256_castsi256_ps(less))
        }
    }

    #[inline(always)]
    fn min(self, b: Self) -> Self {
        // SAFETY: the value shows that there is AVX2.
        Avx2(unsafe { _mm256_min_ps(self.0, b.0) })
    }

    #[inline(always)]
    fn max(self, b: Self) -> Self {
        // SAFETY: the value shows that there is AVX2.
        Avx2(unsafe { _mm256_max_ps(self.0, b.0) })
    }

    #[inline(always)]
    fn lt(self, b: Self) -> Self {
        // SAFETY: the value shows that there is AVX2.
        Avx2(unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, b.0) })
    }

    #[inline(always)]
    fn le(self, b: Self) -> Self {
        // SAFETY: the value shows that there is AVX2.
        Avx2(unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, b.0) })
    }

    #[inline(always)]
    fn select(mask: Self, a: Self, b: Self) -> Self {
        // SAFETY: the value shows that there is AVX2.
        Avx2(unsafe { _mm256_blendv_ps(b.0, a.0, mask.0) })
    }

    #[inline(always)]
    fn select_mask(mask: Self, a: Self, b: Self) -> Self {
        Self::select(mask, a, b)
    }

    #[inline(always)]
    fn and(a: Self, b: Self) -> Self {
        // SAFETY: the value shows that there is AVX2.
        Avx2(unsafe { _mm256_and_ps(a.0, b.0) })
    }

    #[inline(always)]
    fn or(a: Self, b: Self) -> Self {
        // SAFETY: the value shows that there is AVX2.
        Avx2(unsafe { _mm256_or_ps(a.0, b.0) })
    }

    #[inline(always)]
    fn index(numbers: [u32; LANES]) -> Self {
        Self::from_array(bytemuck::cast(numbers))
    }

    #[inline(always)]
    fn numbers(index: Self) -> [u32; LANES] {
        bytemuck::cast(index.to_array())
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
        // SAFETY: the value shows that there is AVX2.
        Avx2(unsafe { _mm256_castsi256_ps(_mm256_cvttps_epi32(self.0)) })
    }

    #[inline(always)]
    fn from_index(index: Self) -> Self {
        // SAFETY: the value shows that there is AVX2.
        Avx2(unsafe { _mm256_cvtepi32_ps(_mm256_castps_si256(index.0)) })
    }

    #[inline(always)]
    fn add_index(a: Self, b: Self) -> Self {
        // SAFETY: the value shows that there is AVX2.
        unsafe { Avx2(_mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(a.0), _mm256_castps_si256(b.0)))) }
    }

    #[inline(always)]
    fn with_bits(index: Self) -> Self {
        index
    }

    #[inline(always)]
    fn halves(index: Self, add: u32) -> [Self; 2] {
        // SAFETY: the value shows that there is AVX2.
        unsafe {
            let (bits, mask) = (_mm256_castps_si256(index.0), _mm256_set1_epi32(0xffff << 12));
            let add = _mm256_set1_epi32(add as i32);
            let low = _mm256_add_epi32(_mm256_and_si256(_mm256_slli_epi32::<12>(bits), mask), add);
            let high = _mm256_add_epi32(_mm256_and_si256(_mm256_srli_epi32::<4>(bits), mask), add);
            [Avx2(_mm256_castsi256_ps(low)), Avx2(_mm256_castsi256_ps(high))]
        }
    }

    #[inline(always)]
    fn below(index: Self, bound: u32) -> Self {
        // AVX2 compares signed numbers only: both are moved by half of the range.
        // SAFETY: the value shows that there is AVX2.
        unsafe {
            let half = _mm256_set1_epi32(i32::MIN);
            let bound = _mm256_xor_si256(_mm256_set1_epi32(bound as i32), half);
            let index = _mm256_xor_si256(_mm256_castps_si256(index.0), half);
            Avx2(_mm256_castsi256_ps(_mm256_cmpgt_epi32(bound, index)))
        }
    }

    #[inline(always)]
    fn highest_bits(index: Self) -> u32 {
        Self::bits(index)
    }

    #[inline(always)]
    fn child(squares: Self, [first, second]: [Self; 2]) -> Self {
        // SAFETY: the value shows that there is AVX2. A set mask is -1 as an integer.
        unsafe {
            let (first, second) = (_mm256_castps_si256(first.0), _mm256_castps_si256(second.0));
            let c = _mm256_sub_epi32(_mm256_sub_epi32(_mm256_set1_epi32(1), second), _mm256_add_epi32(first, first));
            let square = _mm256_slli_epi32::<2>(_mm256_castps_si256(squares.0));
            Avx2(_mm256_castsi256_ps(_mm256_add_epi32(square, c)))
        }
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
        // SAFETY: as in `splat`.
        unsafe {
            let lane = _mm256_set_epi32(128, 64, 32, 16, 8, 4, 2, 1);
            let set = _mm256_and_si256(_mm256_set1_epi32(bits as i32), lane);
            Avx2(_mm256_castsi256_ps(_mm256_cmpeq_epi32(set, lane)))
        }
    }

    #[inline(always)]
    fn bits(mask: Self) -> u32 {
        // SAFETY: the value shows that there is AVX2.
        unsafe { _mm256_movemask_ps(mask.0) as u32 }
    }
}

/// Both halves of four registers, each transposed. Whoever has registers of AVX2 has AVX2.
#[inline(always)]
fn transpose_registers([a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
    // SAFETY: the registers show that there is AVX2.
    unsafe {
        let (ab_low, ab_high) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
        let (cd_low, cd_high) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
        [
            _mm256_shuffle_ps::<0b01_00_01_00>(ab_low, cd_low),
            _mm256_shuffle_ps::<0b11_10_11_10>(ab_low, cd_low),
            _mm256_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high),
            _mm256_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high),
        ]
    }
}

super::num::scalars!(Avx2);
