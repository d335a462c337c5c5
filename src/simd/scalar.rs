//! What single numbers and short tables gain from vector instructions that every processor of the target has.

use super::WINDOW;

/// How many numbers at the beginning of a window are at most `x`.
#[inline(always)]
pub fn rank(window: &[f32; WINDOW], x: f32) -> usize {
    #[cfg(target_arch = "x86_64")]
    {
        use core::arch::x86_64::{
            _mm_castps_si128, _mm_cmple_ps, _mm_loadu_ps, _mm_movemask_epi8, _mm_packs_epi16, _mm_packs_epi32,
            _mm_set1_ps,
        };
        // SAFETY: SSE2 is part of x86-64; the loads are of the four quarters of the window.
        let holds = unsafe {
            let x = _mm_set1_ps(x);
            let quarter = |k: usize| _mm_castps_si128(_mm_cmple_ps(_mm_loadu_ps(window.as_ptr().add(4 * k)), x));
            let low = _mm_packs_epi32(quarter(0), quarter(1));
            _mm_movemask_epi8(_mm_packs_epi16(low, _mm_packs_epi32(quarter(2), quarter(3)))) as u32
        };
        holds.trailing_ones() as usize
    }
    #[cfg(not(target_arch = "x86_64"))]
    window.iter().take_while(|&&start| start <= x).count()
}

/// How many numbers at the beginning of the first `limit` of a window, at most 16, are at most `x`.
#[inline(always)]
pub fn rank16(window: &[u16; WINDOW], x: u16, limit: usize) -> usize {
    #[cfg(target_arch = "x86_64")]
    {
        use core::arch::x86_64::{
            __m128i, _mm_cmpeq_epi16, _mm_loadu_si128, _mm_movemask_epi8, _mm_packs_epi16, _mm_set1_epi16,
            _mm_setzero_si128, _mm_subs_epu16,
        };
        // SAFETY: SSE2 is part of x86-64; the loads are of both halves of the window.
        let holds = unsafe {
            let x = _mm_set1_epi16(x as i16);
            let load = |k: usize| _mm_loadu_si128(window.as_ptr().add(8 * k).cast::<__m128i>());
            // A difference that saturates at 0: the start is at most x.
            let half = |k: usize| _mm_cmpeq_epi16(_mm_subs_epu16(load(k), x), _mm_setzero_si128());
            _mm_movemask_epi8(_mm_packs_epi16(half(0), half(1))) as u32
        };
        (holds & !(u32::MAX << (limit & 31))).trailing_ones() as usize
    }
    #[cfg(not(target_arch = "x86_64"))]
    window.iter().take(limit).take_while(|&&start| start <= x).count()
}

/// Asks for the cache line of an element; nothing happens if there is none.
#[inline(always)]
pub fn prefetch<T>(table: &[T], index: usize) {
    prefetch_behind(table, 0, index);
}

/// As [`prefetch`], counted from another element.
#[inline(always)]
pub fn prefetch_behind<T>(table: &[T], other: usize, index: usize) {
    ask(table.as_ptr().wrapping_add(other).wrapping_add(index));
}

/// Asks for all cache lines of what a pointer points to, if anything.
#[inline(always)]
pub fn prefetch_all<T>(start: *const T) {
    for line in (0..size_of::<T>()).step_by(64) {
        ask(start.cast::<u8>().wrapping_add(line));
    }
}

#[inline(always)]
fn ask<T>(place: *const T) {
    #[cfg(target_arch = "x86_64")]
    {
        use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: SSE is part of x86-64; a prefetch reads nothing, so any address will do.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(place.cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = place;
}

/// The square root, correctly rounded, in the encoding of the function that it is inlined into: mixing encodings of vector
/// instructions costs dearly on some processors.
#[inline(always)]
pub fn sqrt(x: f32) -> f32 {
    #[cfg(target_arch = "x86_64")]
    {
        use core::arch::x86_64::{_mm_cvtss_f32, _mm_set_ss, _mm_sqrt_ss};
        // SAFETY: SSE is part of x86-64.
        unsafe { _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(x))) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    crate::numeric::sqrt(x)
}

/// The whole number in front of the fraction of a number from 0 to below 2^31; of others, anything.
#[inline(always)]
pub fn truncate(x: f32) -> u32 {
    #[cfg(target_arch = "x86_64")]
    {
        use core::arch::x86_64::{_mm_cvttss_si32, _mm_set_ss};
        // SAFETY: SSE is part of x86-64.
        unsafe { _mm_cvttss_si32(_mm_set_ss(x)) as u32 }
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        x as i32 as u32
    }
}
