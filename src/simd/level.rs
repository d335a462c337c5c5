//! Which lanes a kernel runs on: the caller says what the processor has, since asking it is slow.

use super::{Lanes, Native};

/// What every processor of the target has.
pub const BASELINE: u32 = 0;
/// x86-64 with AVX2.
pub const AVX2: u32 = 1;

/// A computation that is generic over lanes. What it calls must be inlined into it to be fast.
pub trait Kernel {
    /// What it answers.
    type Output;
    /// Computes on lanes of one kind.
    fn run<F: Lanes>(self) -> Self::Output;
}

/// Runs a kernel on the lanes of a level; levels that this build does not know count as the highest that it does.
///
/// The level must not promise more than [`detect`] found: it is the caller's word.
#[inline(always)]
pub fn run<K: Kernel>(level: u32, kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if level >= AVX2 {
        // SAFETY: the caller of the library says that the processor has AVX2.
        return unsafe { run_avx2(kernel) };
    }
    let _ = level;
    kernel.run::<Native>()
}

/// # Safety
/// The processor has AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<super::Avx2>()
}

/// The highest level that this processor, its operating system and this build have.
#[cfg(target_arch = "x86_64")]
pub fn detect() -> u32 {
    use core::arch::x86_64::{__cpuid, __cpuid_count, _xgetbv};
    const OSXSAVE_AND_AVX: u32 = 1 << 27 | 1 << 28;
    const YMM_STATE: u64 = 0b110;
    /// # Safety
    /// The operating system has enabled XGETBV.
    #[target_feature(enable = "xsave")]
    unsafe fn enabled_state() -> u64 {
        // SAFETY: the caller's contract.
        unsafe { _xgetbv(0) }
    }
    // SAFETY: every x86-64 processor has CPUID; XGETBV is asked only where CPUID says that it is enabled.
    unsafe {
        if __cpuid(0).eax < 7 || __cpuid(1).ecx & OSXSAVE_AND_AVX != OSXSAVE_AND_AVX {
            return BASELINE;
        }
        let enabled = enabled_state() & YMM_STATE == YMM_STATE;
        if enabled && __cpuid_count(7, 0).ebx & (1 << 5) != 0 { AVX2 } else { BASELINE }
    }
}

/// The highest level that this processor, its operating system and this build have.
#[cfg(not(target_arch = "x86_64"))]
pub fn detect() -> u32 {
    BASELINE
}
