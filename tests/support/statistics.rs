//! Statistical tests with their corrections for many comparisons, and the smallest fault that each of them finds.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

/// The chance that a family of tests rejects a sampler that is right.
pub const FAMILY_SIGNIFICANCE: f64 = 1e-4;
/// The chance that a test rejects a sampler with the smallest fault that it is said to find.
pub const POWER: f64 = 0.99;
/// The largest fault that a test may miss.
pub const LARGEST_MISSED: f64 = 0.02;

/// The significance of each of `tests` tests of a family (Sidak 1967).
pub fn corrected(tests: usize) -> f64 {
    -((-FAMILY_SIGNIFICANCE).ln_1p() / tests as f64).exp_m1()
}

/// The outcome of Pearson's chi-square test.
pub struct ChiSquare {
    pub statistic: f64,
    pub degrees: f64,
    pub p_value: f64,
}

/// Compares counts with what is expected.
pub fn chi_square(observed: &[u64], expected: &[f64]) -> ChiSquare {
    let bins = pooled(observed, expected);
    let statistic = bins.iter().map(|(o, e)| (o - e).powi(2) / e).sum();
    let degrees = bins.len().max(2) as f64 - 1.0;
    ChiSquare { statistic, degrees, p_value: ChiSquared::new(degrees).unwrap().sf(statistic) }
}

/// Bins joined, the smallest first, until at least 25 are expected in each.
fn pooled(observed: &[u64], expected: &[f64]) -> Vec<(f64, f64)> {
    const LEAST: f64 = 25.0;
    let mut bins: Vec<(f64, f64)> = observed.iter().map(|&o| o as f64).zip(expected.iter().copied()).collect();
    bins.sort_unstable_by(|a, b| a.1.total_cmp(&b.1));
    let mut joined: Vec<(f64, f64)> = Vec::new();
    for (o, e) in bins {
        match joined.last_mut() {
            Some(last) if last.1 < LEAST => *last = (last.0 + o, last.1 + e),
            _ => joined.push((o, e)),
        }
    }
    joined
}

/// The smallest fault that a chi-square test of `samples` samples finds: the root mean square, weighted by
/// probability, of the relative error of the bins' probabilities.
pub fn chi_square_smallest_fault(degrees: f64, samples: f64, significance: f64) -> f64 {
    let critical = ChiSquared::new(degrees).unwrap().inverse_cdf(1.0 - significance);
    let (mut low, mut high) = (0.0, 1e5);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if noncentral_sf(critical, degrees, middle) < POWER { low = middle } else { high = middle }
    }
    (high / samples).sqrt()
}

/// The survival function of the non-central chi-square distribution: a Poisson mixture of central ones.
fn noncentral_sf(x: f64, degrees: f64, noncentrality: f64) -> f64 {
    let mean = 0.5 * noncentrality;
    let spread = 12.0 * (mean.sqrt() + 1.0);
    let (first, last) = ((mean - spread).max(0.0) as u64, (mean + spread) as u64);
    let weight =
        |j: f64| (j * mean.max(f64::MIN_POSITIVE).ln() - mean - statrs::function::gamma::ln_gamma(j + 1.0)).exp();
    (first..=last).map(|j| weight(j as f64) * ChiSquared::new(degrees + 2.0 * j as f64).unwrap().sf(x)).sum()
}

/// A running mean and variance (Welford 1962).
#[derive(Clone, Copy, Default)]
pub struct Mean {
    pub count: f64,
    pub mean: f64,
    squares: f64,
}

impl Mean {
    pub fn add(&mut self, value: f64) {
        self.count += 1.0;
        let difference = value - self.mean;
        self.mean += difference / self.count;
        self.squares += difference * (value - self.mean);
    }

    pub fn standard_error(&self) -> f64 {
        (self.squares / (self.count - 1.0) / self.count).sqrt()
    }

    /// The two-sided p-value of the hypothesis that the mean is `reference` within `tolerance`, the accuracy to
    /// which the reference is known.
    pub fn p_value(&self, reference: f64, tolerance: f64) -> f64 {
        let beyond = ((self.mean - reference).abs() - tolerance).max(0.0);
        if beyond == 0.0 { 1.0 } else { 2.0 * standard_normal().sf(beyond / self.standard_error()) }
    }

    /// The smallest fault, relative to the mean, that the z-test finds.
    pub fn smallest_fault(&self, significance: f64) -> f64 {
        z_distance(significance) * self.standard_error() / self.mean
    }

    /// The samples after which the z-test finds [`LARGEST_MISSED`].
    pub fn samples_needed(&self, significance: f64) -> f64 {
        self.count * (self.smallest_fault(significance) / LARGEST_MISSED).powi(2)
    }
}

/// Standard errors between a reference and a mean that is found wrong with [`POWER`].
fn z_distance(significance: f64) -> f64 {
    standard_normal().inverse_cdf(1.0 - 0.5 * significance) + standard_normal().inverse_cdf(POWER)
}

fn standard_normal() -> Normal {
    Normal::new(0.0, 1.0).unwrap()
}
