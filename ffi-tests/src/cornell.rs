//! Scattered isotropic measurements as Cornell's Program of Computer Graphics published them: text, one row for each pair
//! of directions.

use anyhow::{Context, Result, ensure};
use glam::DVec3;
use std::f64::consts::PI;
use std::path::Path;

/// A measured BRDF.
pub struct Scattered {
    pub name: String,
    /// Places and luminances.
    samples: Vec<([f64; 3], f64)>,
}

impl Scattered {
    /// Reads a file: wavelengths, then `theta_i phi_i theta_s phi_s` and a value for each wavelength.
    ///
    /// # Errors
    /// The file cannot be read, or is another kind of file.
    pub fn load(path: &Path) -> Result<Scattered> {
        let text = std::fs::read_to_string(path).with_context(|| format!("{}", path.display()))?;
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        Scattered::parse(name, &text)
    }

    pub(crate) fn parse(name: String, text: &str) -> Result<Scattered> {
        let lines = text.lines().filter(|line| !line.trim_start().starts_with('#'));
        let mut numbers = lines.flat_map(str::split_whitespace).map(|word| word.parse::<f64>());
        let count = numbers.next().context("no number of wavelengths")?? as usize;
        ensure!((1..1000).contains(&count), "no number of wavelengths");
        let numbers = numbers.collect::<Result<Vec<f64>, _>>()?;
        ensure!(numbers.len() > count && (numbers.len() - count) % (4 + count) == 0, "rows of another length");
        let weights: Vec<f64> = numbers[..count].iter().map(|&nm| luminous_efficiency(nm)).collect();
        let total: f64 = weights.iter().sum();
        let rows = numbers[count..].chunks_exact(4 + count);
        let sample = |row: &[f64]| {
            let value: f64 = row[4..].iter().zip(&weights).map(|(v, w)| v * w).sum();
            (place(row[0], row[2], row[1] - row[3]), value.max(0.0) / total)
        };
        Ok(Scattered { name, samples: rows.map(sample).collect() })
    }

    /// The luminance of the BRDF x cosine of `wi`; 0 unless both directions are above the surface. Between measurements:
    /// the nearest ones, by a Gaussian of the distance beyond that of the nearest.
    pub fn eval(&self, wo: DVec3, wi: DVec3) -> f64 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let theta = |d: DVec3| d.z.clamp(-1.0, 1.0).acos();
        let at = place(theta(wi), theta(wo), wi.y.atan2(wi.x) - wo.y.atan2(wo.x));
        let squared = |p: &[f64; 3]| p.iter().zip(at).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        let nearest = self.samples.iter().map(|(p, _)| squared(p)).fold(f64::INFINITY, f64::min);
        let (mut sum, mut weights) = (0.0, 0.0);
        for (p, value) in &self.samples {
            let beyond = squared(p) - nearest;
            if beyond < REACH {
                let weight = (-SHARPNESS * beyond).exp();
                (sum, weights) = (sum + weight * value, weights + weight);
            }
        }
        sum / weights * wi.z
    }
}

/// How fast the weight of a measurement falls with the squared distance, and where it ends.
const SHARPNESS: f64 = 100.0;
const REACH: f64 = 0.08;

/// Where a pair of directions stands: reciprocal, symmetric in the azimuth, and near pairs are near (Marschner 1998).
fn place(theta_i: f64, theta_o: f64, azimuth: f64) -> [f64; 3] {
    let turned = azimuth.rem_euclid(2.0 * PI);
    let apart = turned.min(2.0 * PI - turned);
    [theta_i.sin() * theta_o.sin(), apart / PI, theta_i.cos() * theta_o.cos()]
}

/// The photopic luminous efficiency at a wavelength in nm (fit by Wyman et al. 2013).
fn luminous_efficiency(nm: f64) -> f64 {
    let lobe = |peak: f64, left: f64, right: f64| {
        let t = (nm - peak) / if nm < peak { left } else { right };
        (-0.5 * t * t).exp()
    };
    0.821 * lobe(568.8, 46.9, 40.5) + 0.286 * lobe(530.9, 16.3, 31.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_are_met_and_means_lie_between() {
        let text = "# two\n2\n500 600\n0.5 0 0.5 3.14159265 2 2\n# between\n1.2 0 0.2 0 6 6\n";
        let measured = Scattered::parse("test".into(), text).unwrap();
        let direction =
            |theta: f64, phi: f64| DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        let (wi, wo) = (direction(0.5, 1.0), direction(0.5, 1.0 + PI));
        assert!((measured.eval(wo, wi) / wi.z - 2.0).abs() < 1e-6);
        let other = measured.eval(direction(0.9, 0.0), wi) / wi.z;
        assert!((1.999..6.001).contains(&other), "{other}");
        assert_eq!(measured.eval(direction(2.0, 0.0), wi), 0.0);
        assert!(Scattered::parse("short".into(), "2\n500 600\n1 2 3\n").is_err());
        assert!(Scattered::parse("empty".into(), "").is_err());
    }
}
