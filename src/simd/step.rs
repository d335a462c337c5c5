//! Functions inside kernels: what is inlined wherever it is used multiplies the size of the library.

/// A step of a kernel that is compiled once for each kind of numbers and called there: `Num::call`. What is inlined
/// wherever it is used multiplies the library's size, by levels and by widths.
pub trait Step {
    /// What it answers.
    type Output;
    /// Computes. What it calls must be inlined into it, or be a step of its own.
    fn run(self) -> Self::Output;
}

/// Runs a step at the level that every processor has.
#[inline(never)]
pub(super) fn call<S: Step>(step: S) -> S::Output {
    step.run()
}

/// # Safety
/// The processor has AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline(never)]
pub(super) unsafe fn call_avx2<S: Step>(step: S) -> S::Output {
    step.run()
}
