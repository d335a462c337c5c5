//! Pictures of a renderer that is a client, and how far they scatter: for clients that are no part of the workspace.

/// Luminance pixel by pixel, and the least seconds of the processor that a picture took.
pub struct Pictures {
    pub of: Vec<Vec<f64>>,
    pub seconds: f64,
}

impl Pictures {
    /// The mean over a region, and its standard error.
    pub fn mean(&self, region: &[usize]) -> (f64, f64) {
        let means = self.of.iter().map(|picture| region.iter().map(|&i| picture[i]).sum::<f64>() / region.len() as f64);
        let (mean, variance) = moments(&means.collect::<Vec<f64>>());
        (mean, (variance / self.of.len() as f64).sqrt())
    }

    /// The relative and the absolute variance of a pixel, as means over a region. Relative: over the square of the mean + 1 %.
    pub fn variance(&self, region: &[usize], truth: &[f64]) -> [f64; 2] {
        let least = 0.01 * truth.iter().sum::<f64>() / truth.len() as f64;
        let mut sums = [0.0; 2];
        for &i in region {
            let (_, variance) = moments(&self.of.iter().map(|picture| picture[i]).collect::<Vec<f64>>());
            sums[0] += variance / (truth[i] + least).powi(2) / region.len() as f64;
            sums[1] += variance / region.len() as f64;
        }
        sums
    }
}

/// The mean and the variance of numbers.
fn moments(of: &[f64]) -> (f64, f64) {
    let mean = of.iter().sum::<f64>() / of.len() as f64;
    (mean, of.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (of.len() - 1) as f64)
}
