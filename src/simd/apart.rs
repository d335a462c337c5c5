//! Parts of kernels as functions of their own.

/// A computation on numbers of one kind that runs as a function of its own: what many kernels share, or few calls reach. Cold
/// code costs as much as cold tables, so it pays to have it once. What it calls must be inlined into it to be fast.
pub trait Apart<F> {
    /// What it answers.
    type Output;
    /// Computes.
    fn run(self) -> Self::Output;
}

/// Runs a computation in a function of its own.
#[inline(never)]
pub(super) fn apart<F, K: Apart<F>>(computation: K) -> K::Output {
    computation.run()
}
