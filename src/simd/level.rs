//! Which lanes a kernel runs on. Detection takes microseconds in a virtual machine, so its answer is kept by the caller,
//! and that a level was detected is said by its type.

use super::{Four, Num};

/// Instructions that this processor has: a level above [`Level::BASELINE`] comes from [`Level::detect`] alone, in safe code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level(Instructions);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Instructions {
    Baseline,
    #[cfg(all(target_arch = "x86_64", feature = "avx2"))]
    Avx2,
}

impl Level {
    /// What every processor of the target has.
    pub const BASELINE: Level = Level(Instructions::Baseline);

    /// The highest level that this processor, its operating system and this build have.
    pub fn detect() -> Level {
        #[cfg(all(target_arch = "x86_64", feature = "avx2"))]
        if has_avx2() {
            return Level(Instructions::Avx2);
        }
        Level::BASELINE
    }

    /// The level as a number that C code keeps. Numbers of levels above the baseline are letters, not 1, 2, 3: none is met
    /// by guessing, and checking one takes a comparison where asking the processor again takes microseconds.
    pub const fn code(self) -> u32 {
        match self.0 {
            Instructions::Baseline => 0,
            #[cfg(all(target_arch = "x86_64", feature = "avx2"))]
            Instructions::Avx2 => u32::from_le_bytes(*b"AVX2"),
        }
    }

    /// The level with a number; `None` for one that no level of this build has.
    ///
    /// # Safety
    /// A number other than 0 is that of a level which was detected on this processor.
    #[inline(always)]
    pub unsafe fn from_code(code: u32) -> Option<Level> {
        #[cfg(all(target_arch = "x86_64", feature = "avx2"))]
        if code == Level(Instructions::Avx2).code() {
            return Some(Level(Instructions::Avx2));
        }
        if code == 0 { Some(Level::BASELINE) } else { None }
    }
}

/// [`Level::code`] of [`Level::detect`].
pub fn detect() -> u32 {
    Level::detect().code()
}

/// A computation that is generic over numbers of any width. What it calls must be inlined into it to be fast.
pub trait Compute {
    /// What it answers.
    type Output;
    /// Computes on numbers of one kind.
    fn run<F: Num>(self) -> Self::Output;
}

/// Runs a computation on the numbers of a level.
#[inline(always)]
pub fn compute<K: Compute>(level: Level, computation: K) -> K::Output {
    match level.0 {
        Instructions::Baseline => compute_baseline(computation),
        #[cfg(all(target_arch = "x86_64", feature = "avx2"))]
        // SAFETY: a level of AVX2 was made by a detection that found it, or by who promised that to `from_code`.
        Instructions::Avx2 => unsafe { compute_avx2(computation) },
    }
}

/// Apart from its caller, as the other levels are: else the caller's stack would hold the lanes of this level below those of another.
#[inline(never)]
fn compute_baseline<K: Compute>(computation: K) -> K::Output {
    computation.run::<Four>()
}

/// # Safety
/// The processor has AVX2.
#[cfg(all(target_arch = "x86_64", feature = "avx2"))]
#[target_feature(enable = "avx2")]
unsafe fn compute_avx2<K: Compute>(computation: K) -> K::Output {
    computation.run::<super::x86::X8>()
}

/// Whether the processor has AVX2 and the operating system keeps its registers.
#[cfg(all(target_arch = "x86_64", feature = "avx2"))]
fn has_avx2() -> bool {
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
            return false;
        }
        enabled_state() & YMM_STATE == YMM_STATE && __cpuid_count(7, 0).ebx & (1 << 5) != 0
    }
}
