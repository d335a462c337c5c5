//! How well densities fit the light as its client looks it up: w = L / pdf over the power, which is 1 where the density is exact.

use anyhow::Result;
use wis_ffi_tests::bilinear::direction;
use wis_ffi_tests::client::Density;
use wis_ffi_tests::light::Light;

/// What w is like under a density.
#[derive(Clone, Copy, Debug)]
pub struct Fit {
    /// E[w^2] / E[w]^2 for samples of the density.
    pub ratio: f64,
    /// The largest w.
    pub maximum: f64,
    /// The share of the light that has a pdf of 0.
    pub missed: f64,
    /// The integral of the pdf over the sphere.
    pub total: f64,
}

impl Fit {
    /// The relative standard deviation of w.
    pub fn deviation(&self) -> f64 {
        (self.ratio - 1.0).max(0.0).sqrt()
    }
}

#[derive(Default)]
struct Sums {
    light: f64,
    missed: f64,
    pdf: f64,
    squares: f64,
    maximum: f64,
}

/// Integrates over `points` directions or more, a whole even number of them along each side of a texel.
///
/// # Errors
/// Those of the library.
pub fn fit(light: &Light, densities: &[&dyn Density], points: usize) -> Result<Vec<Fit>> {
    let [width, height] = light.size();
    let k = (((points as f64) / (width * height) as f64).sqrt() / 2.0).ceil().clamp(1.0, 8.0) as usize * 2;
    let mut sums: Vec<Sums> = densities.iter().map(|_| Sums::default()).collect();
    let (mut wi, mut lit, mut pdf) = (Vec::new(), Vec::new(), Vec::new());
    for row in 0..height * k {
        wi.clear();
        lit.clear();
        for column in 0..width * k {
            let at = [column, row].map(|c| (c as f64 + offset(row * 7 + column)) / k as f64);
            let (d, angle) = direction(light.layout(), light.size(), at);
            let world = light.to_world(d).as_vec3();
            wi.push(world.to_array());
            lit.push((light.exact(world), angle / (k * k) as f64));
        }
        pdf.resize(wi.len(), 0.0);
        for (density, sums) in densities.iter().zip(&mut sums) {
            density.pdf_n(&wi, &mut pdf)?;
            for (&(l, angle), &pdf) in lit.iter().zip(&pdf) {
                sums.add(l, f64::from(pdf), angle);
            }
        }
    }
    Ok(sums.iter().map(Sums::fit).collect())
}

/// Places inside a part of a texel, never at its border, where rounding chooses between two texels.
fn offset(i: usize) -> f64 {
    0.1 + 0.8 * (i as f64 * 0.618_033_988_749_895).fract()
}

impl Sums {
    fn add(&mut self, l: f64, pdf: f64, angle: f64) {
        self.light += l * angle;
        self.pdf += pdf * angle;
        if l > 0.0 && pdf > 0.0 {
            self.squares += l * (l / pdf) * angle;
            self.maximum = self.maximum.max(l / pdf);
        } else if l > 0.0 {
            self.missed += l * angle;
        }
    }

    fn fit(&self) -> Fit {
        assert!(self.light > 0.0, "a light that is lit");
        // The mean of w over samples is the light that the density reaches.
        let mean = self.light - self.missed;
        Fit {
            // Numerator and denominator have the same points, so that a density which is exact has exactly 1.
            ratio: self.squares * self.pdf / (mean * mean),
            maximum: self.maximum * self.pdf / mean,
            missed: self.missed / self.light,
            total: self.pdf,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wis_ffi_tests::piecewise::Piecewise;

    /// A table of the texels is exact for a client who takes texels, but for the sine within a row; for one who interpolates
    /// it is not.
    #[test]
    fn an_exact_density_has_no_deviation() {
        let (nearest, smooth) = (Light::windows(64), Light::windows(64).bilinear());
        let table = Piecewise::new(&nearest);
        let exact = fit(&nearest, &[&table], 1 << 16).unwrap()[0];
        assert!(exact.deviation() < 0.02 && exact.missed == 0.0 && (exact.total - 1.0).abs() < 1e-3, "{exact:?}");
        let coarse = fit(&smooth, &[&table], 1 << 16).unwrap()[0];
        assert!(coarse.deviation() > 0.2 && coarse.maximum > 2.0, "{coarse:?}");
    }
}
