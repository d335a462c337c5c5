//! Parts of kernels as functions of their own.

/// A computation on numbers of one kind that runs as a function of its own: what many kernels share, or few calls reach. Cold
/// code costs as much as cold tables, so it pays to have it once. What it calls must be inlined into it to be fast.
pub trait Apart<F> {
    /// What it answers.
    type Output;
    /// Computes.
    fn run(self) -> Self::Output;
}

/// A closure runs as it is. On registers that only some processors have it must be a type of its own, whose `run` is inlined: the
/// compiler may leave a closure to the baseline's instructions.
impl<F, T, C: FnOnce() -> T> Apart<F> for C {
    type Output = T;

    #[inline(always)]
    fn run(self) -> T {
        self()
    }
}

/// Runs a computation in a function of its own.
#[inline(never)]
pub(super) fn apart<F, K: Apart<F>>(computation: K) -> K::Output {
    computation.run()
}
