//! Isotropic BRDFs of the MERL database: dense tables over half and difference angles (Matusik et al. 2003).

use anyhow::{Context, Result, ensure};
use glam::{DVec3, dvec3};
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

/// Entries along the angle of the half vector, the difference angle and half of its azimuth.
const SHAPE: [usize; 3] = [90, 90, 180];
const ENTRIES: usize = SHAPE[0] * SHAPE[1] * SHAPE[2];
/// What the stored red, green and blue are multiplied by.
const SCALES: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// A measured BRDF: the luminances.
pub struct Merl {
    pub name: String,
    values: Vec<f32>,
}

impl Merl {
    /// Reads a `.binary` file.
    ///
    /// # Errors
    /// The file cannot be read, or is another kind of file.
    pub fn load(path: &Path) -> Result<Merl> {
        let bytes = std::fs::read(path).with_context(|| format!("{}", path.display()))?;
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        Merl::parse(name, &bytes)
    }

    fn parse(name: String, bytes: &[u8]) -> Result<Merl> {
        ensure!(bytes.len() == 12 + 3 * 8 * ENTRIES, "not as long as a table of MERL");
        let shape: Vec<u32> =
            bytes[..12].chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        ensure!(shape.iter().zip(SHAPE).all(|(a, b)| *a as usize == b), "another shape than MERL's");
        let number = |i: usize| {
            let at = 12 + 8 * i;
            f64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"))
        };
        // Entries below 0 could not be measured.
        let value = |i: usize| (0..3).map(|c| LUMINANCE[c] * SCALES[c] * number(c * ENTRIES + i).max(0.0)).sum::<f64>();
        Ok(Merl { name, values: (0..ENTRIES).map(|i| value(i) as f32).collect() })
    }

    /// The luminance of the BRDF x cosine of `wi`; 0 unless both directions are above the surface.
    pub fn eval(&self, wo: DVec3, wi: DVec3) -> f64 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let half = (wi + wo).normalize();
        let along = dvec3(half.x, half.y, 0.0).try_normalize().unwrap_or(DVec3::X);
        // The light in the frame of the half vector: its angle to it, and the azimuth from the plane of the normal.
        let tangent = (along * half.z - DVec3::Z * half.dot(along)).normalize();
        let (x, y) = (wi.dot(tangent), wi.dot(half.cross(tangent)));
        let difference = wi.dot(half).clamp(-1.0, 1.0).acos();
        let azimuth = y.atan2(x).rem_euclid(PI);
        let index = |x: f64, count: usize| (x * count as f64).max(0.0).min(count as f64 - 1.0) as usize;
        let h = index((half.z.clamp(-1.0, 1.0).acos() / FRAC_PI_2).sqrt(), SHAPE[0]);
        let d = index(difference / FRAC_PI_2, SHAPE[1]);
        let p = index(azimuth / PI, SHAPE[2]);
        f64::from(self.values[(h * SHAPE[1] + d) * SHAPE[2] + p]) * wi.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table whose red entries are 1500 times their own number over all, the others not measured.
    fn table() -> Vec<u8> {
        let mut bytes: Vec<u8> = SHAPE.iter().flat_map(|&n| (n as u32).to_le_bytes()).collect();
        (0..ENTRIES).for_each(|i| bytes.extend((1500.0 * i as f64 / ENTRIES as f64).to_le_bytes()));
        (0..2 * ENTRIES).for_each(|_| bytes.extend((-1.0f64).to_le_bytes()));
        bytes
    }

    #[test]
    fn entries_are_found_by_half_and_difference_angles() {
        let merl = Merl::parse("test".into(), &table()).unwrap();
        let entry = |wo: DVec3, wi: DVec3| (merl.eval(wo, wi) / wi.z / 0.2126 * ENTRIES as f64).round() as usize;
        let direction = |theta: f64, phi: f64| dvec3(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        // Mirrored directions: the half vector is the normal, and the difference angle is that of the light.
        let degrees = 40.5f64.to_radians();
        assert_eq!(entry(direction(degrees, PI), direction(degrees, 0.0)) / SHAPE[2], 40);
        // Both directions in one place: no difference, and the half vector's angle grows as the square of its index.
        let angle = (30.5f64 / 90.0).powi(2) * FRAC_PI_2;
        assert_eq!(entry(direction(angle, 1.0), direction(angle, 1.0)) / (SHAPE[1] * SHAPE[2]), 30);
        assert_eq!(merl.eval(direction(2.0, 0.0), DVec3::Z), 0.0);
        assert!(Merl::parse("short".into(), &table()[..1000]).is_err());
    }
}
