//! Statistics of the tests and of the report.

use statrs::distribution::{ContinuousCDF, Normal, Uniform};
use statrs::statistics::{Data, Distribution, OrderStatistics};
use statrs::stats_tests::NaNPolicy;
use statrs::stats_tests::chisquare::chisquare;
use statrs::stats_tests::ks_test::{KSOneSampleAlternativeMethod, ks_onesample};

/// The mean of independent values and its standard error.
pub fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let data = Data::new(values.to_vec());
    let deviation = data.std_dev().unwrap_or(f64::NAN);
    (data.mean().unwrap_or(f64::NAN), deviation / (values.len() as f64).sqrt())
}

/// The two-sided z-test of the mean of independent values against the expected one: its p-value.
pub fn z_test(values: &[f64], expected: f64) -> f64 {
    let (mean, error) = mean_and_error(values);
    2.0 * Normal::standard().sf(((mean - expected) / error).abs())
}

/// The chi-square test of counts against probabilities, which are scaled to add up to 1: its p-value. Bins that expect
/// fewer than 10 are counted together.
pub fn chi_square(counts: &[usize], probabilities: &[f64]) -> f64 {
    let total: f64 = counts.iter().map(|&n| n as f64).sum();
    let scale = total / probabilities.iter().sum::<f64>();
    let bins = || counts.iter().zip(probabilities).map(|(&n, p)| (n, p * scale));
    let (mut observed, mut expected): (Vec<_>, Vec<_>) = bins().filter(|bin| bin.1 >= 10.0).unzip();
    let rare = bins().filter(|bin| bin.1 < 10.0).fold((0, 0.0), |sum, bin| (sum.0 + bin.0, sum.1 + bin.1));
    match (rare, expected.last_mut()) {
        ((_, rest), Some(last)) if rest < 10.0 => {
            *observed.last_mut().expect("as many counts") += rare.0;
            *last += rare.1;
        }
        _ => {
            observed.push(rare.0);
            expected.push(rare.1);
        }
    }
    chisquare(&observed, Some(&expected), None).map_or(0.0, |(_, p)| p)
}

/// The Kolmogorov-Smirnov test of independent values against the uniform distribution on [0, 1]: its p-value.
pub fn kolmogorov_smirnov(values: Vec<f64>) -> f64 {
    let method = KSOneSampleAlternativeMethod::TwoSidedAsymptotic;
    ks_onesample(values, &Uniform::standard(), method, NaNPolicy::Error).map_or(0.0, |(_, p)| p)
}

/// The relative shift of the mean that `z_test` at a significance finds with power .99.
pub fn smallest_fault(values: &[f64], expected: f64, significance: f64) -> f64 {
    let normal = Normal::standard();
    let reach = normal.inverse_cdf(1.0 - significance / 2.0) + normal.inverse_cdf(0.99);
    reach * mean_and_error(values).1 / expected.abs()
}

/// Which of several hypotheses Holm's method rejects at a significance for all of them together.
pub fn holm(p_values: &[f64], significance: f64) -> Vec<bool> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|&a, &b| p_values[a].total_cmp(&p_values[b]));
    let mut rejected = vec![false; p_values.len()];
    for (rank, &i) in order.iter().enumerate() {
        // A p-value that is not a number fails the comparison and is rejected.
        if p_values[i] > significance / (p_values.len() - rank) as f64 {
            break;
        }
        rejected[i] = true;
    }
    rejected
}

/// The median.
pub fn median(values: &[f64]) -> f64 {
    Data::new(values.to_vec()).median()
}

/// A quantile, 0 to 1.
pub fn quantile(values: &[f64], tau: f64) -> f64 {
    Data::new(values.to_vec()).quantile(tau)
}

/// The ratio of the means of two samples and its bootstrap interval of 95 %, from resamples of a fixed seed.
pub fn bootstrap_ratio(numerator: &[f64], denominator: &[f64]) -> [f64; 3] {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut resampled = |values: &[f64]| {
        let picks = values.iter().map(|_| values[(splitmix(&mut state) % values.len() as u64) as usize]);
        picks.sum::<f64>() / values.len() as f64
    };
    let ratios: Vec<f64> = (0..1000).map(|_| resampled(numerator) / resampled(denominator)).collect();
    [mean(numerator) / mean(denominator), quantile(&ratios, 0.025), quantile(&ratios, 0.975)]
}

/// SplitMix64 (Steele et al. 2014).
pub fn splitmix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The geometric mean.
pub fn geometric(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for value in values {
        (sum, count) = (sum + value.ln(), count + 1);
    }
    (sum / f64::from(count)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn z_test_finds_a_shift_and_passes_the_truth() {
        let uniform: Vec<f64> = (0..10_000).map(|i| (f64::from(i) + 0.5) / 1e4).collect();
        assert!(z_test(&uniform, 0.5) > 0.99);
        let fault = smallest_fault(&uniform, 0.5, 1e-3);
        assert!((0.02..0.04).contains(&fault) && z_test(&uniform, 0.5 * (1.0 + 2.0 * fault)) < 1e-3);
    }

    #[test]
    fn frequencies_and_distances_find_a_tilt_and_pass_the_truth() {
        let even = [2500; 4];
        assert!(chi_square(&even, &[0.25; 4]) > 0.99 && chi_square(&even, &[0.27, 0.25, 0.25, 0.23]) < 1e-6);
        let spread = |tilt: f64| (0..10_000).map(|i| ((f64::from(i) + 0.5) / 1e4).powf(tilt)).collect();
        assert!(kolmogorov_smirnov(spread(1.0)) > 0.99 && kolmogorov_smirnov(spread(1.1)) < 1e-6);
    }

    #[test]
    fn holm_stops_at_the_first_that_stands() {
        assert_eq!(holm(&[0.04, 0.001, 0.02, 0.3], 0.05), [false, true, false, false]);
        assert_eq!(holm(&[0.01, 0.01], 0.05), [true, true]);
    }

    #[test]
    fn bootstrap_interval_holds_the_ratio() {
        let (a, b) = ([2.0, 2.2, 1.8, 2.1, 1.9, 2.0], [1.0, 1.1, 0.9, 1.0, 1.05, 0.95]);
        let [ratio, low, high] = bootstrap_ratio(&a, &b);
        assert!((ratio - 2.0).abs() < 1e-9 && (1.7..2.0).contains(&low) && (2.0..2.3).contains(&high));
    }
}
