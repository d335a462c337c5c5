//! The constants that are chosen anew: their values, and the cells in which they act.

use anyhow::{Result, ensure};
use std::path::Path;
use wis_ffi_tests::library::Mode;
use wis_ffi_tests::material::Material;

/// A constant of the library and the values that are tried.
pub struct Constant {
    pub what: &'static str,
    pub file: &'static str,
    /// As the file has it.
    pub text: &'static str,
    /// The value in force is the first.
    pub values: &'static [&'static str],
    /// Only where it acts: elsewhere all values take the same rays.
    pub cells: fn() -> Vec<(Material, Vec<usize>)>,
    pub mode: Mode,
    /// Hits of a pixel.
    pub hits: usize,
    /// Independent repeats: errors under lamps have long tails.
    pub repeats: u32,
    /// Processes of each library in which times are taken: where their memory lies changes cold times by 5 %.
    pub processes: usize,
}

pub const CONSTANTS: [Constant; 5] = [
    Constant {
        what: "candidates of each source for one ray",
        file: "src/direct/effort.rs",
        text: "0..=1 if !diffuse => 16,",
        values: &["16", "8", "32"],
        cells: || narrow(&[1]),
        mode: Mode::Direct,
        hits: 1,
        repeats: 512,
        processes: 1,
    },
    Constant {
        what: "candidates of each source for each of 16 rays or fewer",
        file: "src/direct/effort.rs",
        text: "0..=MANY => 8,",
        values: &["8", "4", "16"],
        cells: || [wide(&[1, 4, 16]), narrow(&[4, 16])].concat(),
        mode: Mode::Direct,
        hits: 1,
        repeats: 256,
        processes: 1,
    },
    Constant {
        what: "candidates of each source for each of more rays",
        file: "src/direct/effort.rs",
        text: "_ => 4,",
        values: &["4", "2", "8"],
        cells: || [wide(&[64]), narrow(&[64])].concat(),
        mode: Mode::Direct,
        hits: 1,
        repeats: 256,
        processes: 1,
    },
    Constant {
        what: "the roughness below which candidates are doubled",
        file: "src/direct/effort.rs",
        text: "const NARROW: f32 = 0.15;",
        values: &["0.15", "0.0", "0.3"],
        cells: || narrow(&[1, 4, 16]),
        mode: Mode::Direct,
        hits: 1,
        repeats: 256,
        processes: 1,
    },
    Constant {
        what: "when hits share a product",
        file: "src/product/covers.rs",
        text: "const SHARES: f32 = 1.25;",
        values: &["1.25", "1.1", "1.5", "2.0"],
        cells: || {
            let mixes = [Material::mix(0.1), Material::mix(0.1).textured(), Material::mix(0.3).textured()];
            mixes.map(|material| (material, vec![1])).into()
        },
        mode: Mode::Shared,
        hits: 64,
        repeats: 64,
        processes: 4,
    },
];

fn wide(rays: &[usize]) -> Vec<(Material, Vec<usize>)> {
    [Material::lambert(), Material::ggx(0.5)].map(|material| (material, rays.to_vec())).into()
}

fn narrow(rays: &[usize]) -> Vec<(Material, Vec<usize>)> {
    [Material::ggx(0.2), Material::ggx(0.05), Material::mix(0.1)].map(|material| (material, rays.to_vec())).into()
}

impl Constant {
    /// The text with another value.
    pub fn with(&self, value: &str) -> String {
        self.text.replace(self.values[0], value)
    }

    /// Changes it in a copy of the sources, from one value to another.
    ///
    /// # Errors
    /// The file has another text.
    pub fn edit(&self, sources: &Path, from: &str, to: &str) -> Result<()> {
        let file = sources.join(self.file);
        let (text, from) = (std::fs::read_to_string(&file)?, self.with(from));
        ensure!(text.matches(&from).count() == 1, "{} has not one {from}", self.file);
        Ok(std::fs::write(file, text.replace(&from, &self.with(to)))?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_in_force_are_those_of_the_sources() {
        for constant in CONSTANTS {
            let path = format!("{}/../{}", env!("CARGO_MANIFEST_DIR"), constant.file);
            assert_eq!(std::fs::read_to_string(&path).unwrap().matches(constant.text).count(), 1, "{}", constant.text);
            assert_eq!(constant.text.matches(constant.values[0]).count(), 1, "{}", constant.text);
        }
    }
}
