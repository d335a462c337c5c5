//! One register of SSE2 or of AVX2, from one text. What computes with AVX2 must be inlined into a function that is compiled for it.

use super::num::{all_below, methods, scalars};
use super::{Apart, Num, Whole};
use core::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Sub};

/// What SSE2 has, and what it is made of where it has nothing.
mod sse2 {
    pub use core::arch::x86_64::{
        __m128 as Floats, __m128i as Ints, _mm_add_epi32 as add_int, _mm_add_ps as add, _mm_and_ps as and,
        _mm_and_si128 as and_int, _mm_andnot_ps as and_not, _mm_castps_si128 as bits_of, _mm_castsi128_ps as of_bits,
        _mm_cmple_ps as le, _mm_cmplt_ps as lt, _mm_cvtepi32_ps as of_int, _mm_cvttps_epi32 as to_int,
        _mm_div_ps as div, _mm_loadu_ps as load, _mm_max_ps as max, _mm_min_ps as min, _mm_movemask_ps as movemask,
        _mm_mul_ps as mul, _mm_or_ps as or, _mm_or_si128 as or_int, _mm_set1_epi32 as splat_int, _mm_set1_ps as splat,
        _mm_slli_epi32 as shl, _mm_sqrt_ps as sqrt, _mm_srli_epi32 as shr, _mm_storeu_ps as store, _mm_sub_ps as sub,
        _mm_xor_si128 as xor_int,
    };
    use core::arch::x86_64::{
        _mm_loadl_epi64, _mm_movehl_ps, _mm_movelh_ps, _mm_mul_epu32, _mm_shuffle_epi32, _mm_slli_si128,
        _mm_srai_epi32, _mm_unpackhi_ps, _mm_unpacklo_epi16, _mm_unpacklo_epi32, _mm_unpacklo_ps,
    };

    #[inline(always)]
    pub unsafe fn apart<K: super::Apart<super::X4>>(computation: K) -> K::Output {
        crate::simd::num::apart(computation)
    }

    /// `a` where the mask is set, elsewhere `b`.
    #[inline(always)]
    pub unsafe fn select(mask: Floats, a: Floats, b: Floats) -> Floats {
        // SAFETY: SSE2 is part of x86-64.
        unsafe { or(and(mask, a), and_not(mask, b)) }
    }

    /// The bytes of each four numbers moved up by so many.
    #[inline(always)]
    pub unsafe fn up<const N: i32>(x: Floats) -> Floats {
        // SAFETY: SSE2 is part of x86-64.
        unsafe { of_bits(_mm_slli_si128::<N>(bits_of(x))) }
    }

    /// The lower halves of products.
    #[inline(always)]
    pub unsafe fn mul_int(a: Ints, b: Ints) -> Ints {
        // SAFETY: SSE2 is part of x86-64.
        unsafe {
            let even = _mm_mul_epu32(a, b);
            let odd = _mm_mul_epu32(_mm_shuffle_epi32::<0b11_11_01_01>(a), _mm_shuffle_epi32::<0b11_11_01_01>(b));
            let lower = |of| _mm_shuffle_epi32::<0b00_00_10_00>(of);
            _mm_unpacklo_epi32(lower(even), lower(odd))
        }
    }

    /// The bits of each byte from the other end, in steps of halves.
    #[inline(always)]
    pub unsafe fn reverse_bits(x: Ints) -> Ints {
        // SAFETY: SSE2 is part of x86-64.
        unsafe {
            let swap16 = or_int(shl::<16>(x), shr::<16>(x));
            let half = |x: Ints, mask: i32| {
                let mask = splat_int(mask);
                (and_int(x, mask), x, mask)
            };
            let (low, x, mask) = half(swap16, 0x00ff_00ff);
            let x = or_int(shl::<8>(low), and_int(shr::<8>(x), mask));
            let (low, x, mask) = half(x, 0x0f0f_0f0f);
            let x = or_int(shl::<4>(low), and_int(shr::<4>(x), mask));
            let (low, x, mask) = half(x, 0x3333_3333);
            let x = or_int(shl::<2>(low), and_int(shr::<2>(x), mask));
            let (low, x, mask) = half(x, 0x5555_5555);
            or_int(shl::<1>(low), and_int(shr::<1>(x), mask))
        }
    }

    /// Four short numbers from a place on, with their signs.
    #[inline(always)]
    pub unsafe fn shorts(start: *const i16) -> Ints {
        // SAFETY: SSE2 is part of x86-64; the caller's four numbers.
        unsafe {
            let four = _mm_loadl_epi64(start.cast());
            _mm_srai_epi32::<16>(_mm_unpacklo_epi16(four, four))
        }
    }

    /// Pairs of 16 bits that begin at these places.
    #[inline(always)]
    pub unsafe fn pairs(start: *const u16, index: Ints) -> Ints {
        // SAFETY: SSE2 is part of x86-64; the caller's places.
        unsafe {
            let mut places = [0u32; 4];
            store(places.as_mut_ptr().cast(), of_bits(index));
            for place in &mut places {
                *place = start.add(*place as usize).cast::<u32>().read_unaligned();
            }
            bits_of(load(places.as_ptr().cast()))
        }
    }

    /// Four rows as columns.
    #[inline(always)]
    pub unsafe fn transpose([a, b, c, d]: [*const f32; 4]) -> [Floats; 4] {
        // SAFETY: SSE2 is part of x86-64; the caller's rows.
        unsafe {
            let [a, b, c, d] = [load(a), load(b), load(c), load(d)];
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
}

/// What AVX2 has.
#[cfg(feature = "avx2")]
mod avx2 {
    pub use core::arch::x86_64::{
        __m256 as Floats, __m256i as Ints, _mm256_add_epi32 as add_int, _mm256_add_ps as add, _mm256_and_ps as and,
        _mm256_and_si256 as and_int, _mm256_andnot_ps as and_not, _mm256_castps_si256 as bits_of,
        _mm256_castsi256_ps as of_bits, _mm256_cvtepi32_ps as of_int, _mm256_cvttps_epi32 as to_int,
        _mm256_div_ps as div, _mm256_loadu_ps as load, _mm256_max_ps as max, _mm256_min_ps as min,
        _mm256_movemask_ps as movemask, _mm256_mul_ps as mul, _mm256_mullo_epi32 as mul_int, _mm256_or_ps as or,
        _mm256_or_si256 as or_int, _mm256_set1_epi32 as splat_int, _mm256_set1_ps as splat, _mm256_slli_epi32 as shl,
        _mm256_sqrt_ps as sqrt, _mm256_srli_epi32 as shr, _mm256_storeu_ps as store, _mm256_sub_ps as sub,
        _mm256_xor_si256 as xor_int,
    };
    use core::arch::x86_64::{
        _CMP_LE_OQ, _CMP_LT_OQ, _mm_loadu_ps, _mm_loadu_si128, _mm256_blendv_ps, _mm256_castps128_ps256, _mm256_cmp_ps,
        _mm256_cvtepi16_epi32, _mm256_i32gather_epi32, _mm256_insertf128_ps, _mm256_set1_epi8, _mm256_setr_epi8,
        _mm256_shuffle_epi8, _mm256_shuffle_ps, _mm256_slli_si256, _mm256_unpackhi_ps, _mm256_unpacklo_ps,
    };

    /// A function that is compiled for AVX2, too. Rust 1.95 does not tell LLVM of `inline(never)` where `target_feature` stands, so it stands
    /// at a function between.
    #[inline(never)]
    pub unsafe fn apart<K: super::Apart<super::X8>>(computation: K) -> K::Output {
        #[target_feature(enable = "avx2")]
        unsafe fn compiled<K: super::Apart<super::X8>>(computation: K) -> K::Output {
            computation.run()
        }
        // SAFETY: whoever has registers of AVX2 has AVX2.
        unsafe { compiled(computation) }
    }

    #[inline(always)]
    pub unsafe fn lt(a: Floats, b: Floats) -> Floats {
        // SAFETY: whoever has registers of AVX2 has AVX2.
        unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(a, b) }
    }

    #[inline(always)]
    pub unsafe fn le(a: Floats, b: Floats) -> Floats {
        // SAFETY: whoever has registers of AVX2 has AVX2.
        unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(a, b) }
    }

    #[inline(always)]
    pub unsafe fn select(mask: Floats, a: Floats, b: Floats) -> Floats {
        // SAFETY: whoever has registers of AVX2 has AVX2.
        unsafe { _mm256_blendv_ps(b, a, mask) }
    }

    #[inline(always)]
    pub unsafe fn up<const N: i32>(x: Floats) -> Floats {
        // SAFETY: whoever has registers of AVX2 has AVX2.
        unsafe { of_bits(_mm256_slli_si256::<N>(bits_of(x))) }
    }

    #[inline(always)]
    pub unsafe fn reverse_bits(x: Ints) -> Ints {
        // SAFETY: whoever has registers of AVX2 has AVX2.
        unsafe {
            #[rustfmt::skip]
            let (bytes, nibbles) = (
                _mm256_setr_epi8(
                    3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12,
                    3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12,
                ),
                _mm256_setr_epi8(
                    0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15,
                    0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15,
                ),
            );
            let (x, low) = (_mm256_shuffle_epi8(x, bytes), _mm256_set1_epi8(15));
            let upper = _mm256_shuffle_epi8(nibbles, and_int(x, low));
            let lower = _mm256_shuffle_epi8(nibbles, and_int(shr::<4>(x), low));
            or_int(shl::<4>(upper), lower)
        }
    }

    #[inline(always)]
    pub unsafe fn shorts(start: *const i16) -> Ints {
        // SAFETY: whoever has registers of AVX2 has AVX2; the caller's eight numbers.
        unsafe { _mm256_cvtepi16_epi32(_mm_loadu_si128(start.cast())) }
    }

    #[inline(always)]
    pub unsafe fn pairs(start: *const u16, index: Ints) -> Ints {
        // SAFETY: whoever has registers of AVX2 has AVX2; the caller's places.
        unsafe { _mm256_i32gather_epi32::<2>(start.cast(), index) }
    }

    /// Eight rows as columns.
    #[inline(always)]
    pub unsafe fn transpose([a, b, c, d, e, f, g, h]: [*const f32; 8]) -> [Floats; 4] {
        // SAFETY: whoever names this type has AVX2; the caller's rows.
        unsafe {
            // Rows i and i + 4 share a register, so that the transposition of both halves is one.
            let pair =
                |low, high| _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(_mm_loadu_ps(low)), _mm_loadu_ps(high));
            let [a, b, c, d] = [pair(a, e), pair(b, f), pair(c, g), pair(d, h)];
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
}

/// Numbers and whole numbers in one register of an instruction set.
macro_rules! lanes {
    ($name:ident, $whole:ident, $isa:ident, $width:literal, $doc:literal) => {
        #[doc = $doc]
        #[derive(Clone, Copy, Debug)]
        pub struct $name($isa::Floats);

        #[doc = $doc]
        #[derive(Clone, Copy, Debug)]
        pub struct $whole($isa::Ints);

        lanes!(@operators $name, $isa, [Add add add, Sub sub sub, Mul mul mul, Div div div]);
        scalars!($name);
        lanes!(@operators $whole, $isa,
            [Add add add_int, BitAnd bitand and_int, BitOr bitor or_int, BitXor bitxor xor_int, Mul mul mul_int]);

        impl Whole for $whole {
            methods! { unsafe
                splat(x: u32) -> Self = $whole($isa::splat_int(x as i32));
                shl<N>(self) -> Self = $whole($isa::shl::<N>(self.0));
                shr<N>(self) -> Self = $whole($isa::shr::<N>(self.0));
                reverse_bits(self) -> Self = $whole($isa::reverse_bits(self.0));
            }
        }

        impl Num for $name {
            const WIDTH: usize = $width;
            type Mask = $name;
            type Whole = $whole;
            type Floats = [f32; $width];
            type Ints = [u32; $width];

            methods! {
                whole(ints: [u32; $width]) -> $whole = Self::load(bytemuck::cast(ints)).to_bits();
                ints_of(whole: $whole) -> [u32; $width] = bytemuck::cast(Self::from_bits(whole).store());
                only(mask: Self, a: Self) -> Self = Self::and(mask, a);
                sign_bits(whole: $whole) -> u32 = Self::bits(Self::from_bits(whole));
            }

            methods! { unsafe
                splat(x: f32) -> Self = $name($isa::splat(x));
                load(lanes: [f32; $width]) -> Self = $name($isa::load(lanes.as_ptr()));
                to_bits(self) -> $whole = $whole($isa::bits_of(self.0));
                from_bits(bits: $whole) -> Self = $name($isa::of_bits(bits.0));
                to_whole(self) -> $whole = $whole($isa::to_int(self.0));
                of_whole(whole: $whole) -> Self = $name($isa::of_int(whole.0));
                sqrt(self) -> Self = $name($isa::sqrt(self.0));
                abs(self) -> Self = $name($isa::and_not($isa::splat(-0.0), self.0));
                copysign(self, sign: Self) -> Self = $name($isa::or(self.abs().0, $isa::and($isa::splat(-0.0), sign.0)));
                min(self, b: Self) -> Self = $name($isa::min(self.0, b.0));
                max(self, b: Self) -> Self = $name($isa::max(self.0, b.0));
                lt(self, b: Self) -> Self = $name($isa::lt(self.0, b.0));
                le(self, b: Self) -> Self = $name($isa::le(self.0, b.0));
                select(mask: Self, a: Self, b: Self) -> Self = $name($isa::select(mask.0, a.0, b.0));
                and(a: Self, b: Self) -> Self = $name($isa::and(a.0, b.0));
                or(a: Self, b: Self) -> Self = $name($isa::or(a.0, b.0));
                bits(mask: Self) -> u32 = $isa::movemask(mask.0) as u32;
                up(self) -> Self = $name($isa::up::<4>(self.0));
            }

            #[inline(always)]
            fn store(self) -> [f32; $width] {
                let mut lanes = [0.0; $width];
                // SAFETY: whoever names this type has its instructions; the store is to the array.
                unsafe { $isa::store(lanes.as_mut_ptr(), self.0) };
                lanes
            }

            #[inline(always)]
            fn sums(self) -> Self {
                // SAFETY: whoever names this type has its instructions.
                unsafe {
                    let two = self + self.up();
                    $name($isa::add(two.0, $isa::up::<8>(two.0)))
                }
            }

            #[inline(always)]
            fn rows(table: &[[f32; 4]], index: $whole) -> [Self; 4] {
                // The bytes before a row fit into 32 bits.
                const MOST: usize = 1 << 28;
                if !all_below::<Self>(index, table.len().min(MOST)) {
                    return [Self::splat(0.0); 4];
                }
                let start = table.as_ptr().cast::<u8>();
                let mut rows = [start.cast(); $width];
                // A loop in place of `map`, which would be compiled for the baseline's instructions.
                for (row, before) in rows.iter_mut().zip(Self::ints_of(index.shl::<4>())) {
                    *row = start.wrapping_add(before as usize).cast();
                }
                // SAFETY: whoever names this type has its instructions; each row is one of the table.
                let [a, b, c, d] = unsafe { $isa::transpose(rows) };
                [$name(a), $name(b), $name(c), $name(d)]
            }

            #[inline(always)]
            fn shorts(numbers: &[i16]) -> Self {
                let Some(numbers) = numbers.get(..Self::WIDTH) else { return Self::splat(0.0) };
                // SAFETY: whoever names this type has its instructions; the load is of that many numbers.
                $name(unsafe { $isa::of_int($isa::shorts(numbers.as_ptr())) })
            }

            #[inline(always)]
            fn pairs(table: &[u16], index: $whole) -> $whole {
                let start = table.as_ptr();
                if !all_below::<Self>(index, table.len().saturating_sub(1)) {
                    return $whole::splat(0);
                }
                // SAFETY: whoever names this type has its instructions; each pair begins before the last number of the table.
                $whole(unsafe { $isa::pairs(start, index.0) })
            }

            #[inline(always)]
            fn apart<K: Apart<Self>>(computation: K) -> K::Output {
                // SAFETY: whoever names this type has its instructions.
                unsafe { $isa::apart(computation) }
            }
        }
    };
    (@operators $name:ident, $isa:ident, [$($operator:ident $method:ident $instruction:ident),*]) => {$(
        impl $operator for $name {
            type Output = $name;

            #[inline(always)]
            fn $method(self, b: $name) -> $name {
                // SAFETY: whoever has values of this type has its instructions.
                $name(unsafe { $isa::$instruction(self.0, b.0) })
            }
        }
    )*};
}

lanes!(X4, W4, sse2, 4, "Four numbers in a register of SSE2, which every x86-64 processor has.");
#[cfg(feature = "avx2")]
lanes!(X8, W8, avx2, 8, "Eight numbers in a register of AVX2.");
