//! What shading costs a client: the harness as it is, and a renderer whose evaluations and rays are expensive. The added
//! time is really spent, so that it stands in the measured times as any other work does.

use serde::{Deserialize, Serialize};
use std::hint::black_box;
use std::sync::OnceLock;
use std::time::Instant;

/// Nanoseconds that the client pays beyond what the harness itself takes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// For BRDF, radiance or both of one direction.
    pub evaluation: f64,
    /// For a ray that is traced.
    pub ray: f64,
}

impl Cost {
    pub const CHEAP: Cost = Cost { evaluation: 0.0, ray: 0.0 };
    pub const EXPENSIVE: Cost = Cost { evaluation: 150.0, ray: 500.0 };

    /// Spends what evaluations take.
    #[inline]
    pub fn evaluate(self, count: usize) {
        spend(self.evaluation * count as f64);
    }

    /// Spends what a ray takes.
    #[inline]
    pub fn trace(self) {
        spend(self.ray);
    }
}

/// Cost models that are measured side by side, by name.
pub const MODELS: [(&str, Cost); 2] = [("cheap", Cost::CHEAP), ("expensive", Cost::EXPENSIVE)];

#[inline]
fn spend(ns: f64) {
    if ns > 0.0 {
        spin((ns * *turns_per_ns()) as u64);
    }
}

/// Each turn waits for the one before, in registers: some processors forward what they store at once, others after five cycles, and some do
/// either. What follows waits for the last.
#[inline(never)]
fn spin(turns: u64) {
    let mut state = black_box(1u64);
    for _ in 0..turns {
        state = (state ^ state >> 29).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
    black_box(state);
    #[cfg(target_arch = "x86_64")]
    // SAFETY: every x86-64 processor has SSE2. Nothing begins before all that stands before the fence has ended.
    unsafe {
        std::arch::x86_64::_mm_lfence();
    }
}

/// Calibrates the spin, once: the fastest of many short rounds, in which nothing else ran.
fn turns_per_ns() -> &'static f64 {
    static TURNS: OnceLock<f64> = OnceLock::new();
    TURNS.get_or_init(|| {
        const TURNS: u64 = 20_000;
        let round = || {
            let start = Instant::now();
            spin(TURNS);
            TURNS as f64 / start.elapsed().as_secs_f64() / 1e9
        };
        (0..100).map(|_| round()).fold(0.0, f64::max)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The fastest of many rounds, in nanoseconds for one: other programs only make a round longer.
    fn fastest(mut spend: impl FnMut()) -> f64 {
        const ONES: u32 = 100;
        let round = |_| {
            let start = Instant::now();
            (0..ONES).for_each(|_| spend());
            start.elapsed().as_secs_f64() * 1e9 / f64::from(ONES)
        };
        (0..50).map(round).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn what_is_asked_for_is_spent() {
        let _ = turns_per_ns();
        let Cost { evaluation, ray } = Cost::EXPENSIVE;
        let spent = [fastest(|| Cost::EXPENSIVE.evaluate(1)), fastest(|| Cost::EXPENSIVE.evaluate(8))];
        let rays = fastest(|| Cost::EXPENSIVE.trace());
        for (spent, asked) in spent.into_iter().chain([rays]).zip([evaluation, 8.0 * evaluation, ray]) {
            assert!((0.9..1.3).contains(&(spent / asked)), "{spent} ns in place of {asked}");
        }
        assert!(fastest(|| Cost::CHEAP.evaluate(8)) < 10.0);
    }
}
