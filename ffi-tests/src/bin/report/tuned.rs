//! Which constants of the library were chosen by measurements, on which maps, and in which commit (rule 37).

use crate::gains::{Against, METRICS, Scale};
use crate::studies::SUN;
use wis_ffi_tests::measure::Cell;
use wis_ffi_tests::method::EXTENDED;
use wis_ffi_tests::page::{Part, Table, times};
use wis_ffi_tests::products::DEVELOPER;

/// A constant that was chosen by measurements.
struct Tuned {
    what: &'static str,
    file: &'static str,
    /// As the file has it: a test fails if it does not, since `commit` is then another.
    text: &'static str,
    /// The last that changed it.
    commit: &'static str,
    maps: &'static str,
    /// Whether maps of this report were among them that are no development maps.
    judged: bool,
}

const TUNED: [Tuned; 6] = [
    Tuned {
        what: "share of numbers that lobes of a product draw",
        file: "src/product/peak.rs",
        text: "Mixture { narrow: 0.15, share: 0.7, resolved: 0.08 }",
        commit: "0046edf",
        maps: "development maps",
        judged: false,
    },
    Tuned {
        what: "lobes of a product against its grid",
        file: "src/product/prepare.rs",
        text: "const REST: f32 = 2.0;",
        commit: "d91074e",
        maps: "development maps",
        judged: false,
    },
    Tuned {
        what: "rays that come from a product",
        file: "src/direct/several.rs",
        text: "const SEVERAL: usize = 4;",
        commit: "c50f0f8",
        maps: "st_fagans, rooitou",
        judged: false,
    },
    Tuned {
        what: "candidates of bright lights",
        file: "src/direct/effort.rs",
        text: "MOST >> [1.0, 2.0, 4.0]",
        commit: "86e2a52",
        maps: "two lights, not recorded which",
        judged: false,
    },
    Tuned {
        what: "candidates for a ray",
        file: "src/direct/mod.rs",
        text: "2..=31 => 8,",
        commit: "20e3cc8",
        maps: "eight lights of this report, pictures of the gallery",
        judged: true,
    },
    Tuned {
        what: "when hits share a product",
        file: "src/product/covers.rs",
        text: "const SHARES: f32 = 1.5;",
        commit: "4f775d1",
        maps: "four lights of the study of textures",
        judged: true,
    },
];

/// Rays for a hit that the two groups of maps are compared at.
const RAYS: [usize; 2] = [4, 16];

/// Which maps are which, what was tuned on them, and gains on both.
pub fn parts(main: &[&Cell], lights: &[String]) -> Vec<Part> {
    let is_developer = |light: &str| DEVELOPER.iter().any(|map| map.trim_end_matches(".hdr") == light);
    let list = |kept: &dyn Fn(&str) -> bool| {
        let names: Vec<&str> = lights.iter().map(String::as_str).filter(|light| kept(light)).collect();
        if names.is_empty() { "none".into() } else { names.join(", ") }
    };
    let late: Vec<&str> = TUNED.iter().filter(|tuned| tuned.judged).map(|tuned| tuned.what).collect();
    let text = format!(
        "Development maps: {}. Judged maps: {}. The light \"{SUN}\" is made by the project. {} of {} tuned constants were not chosen on \
         judged maps, as far as their files tell. **Chosen on judged maps, too: {}.** Only 0046edf is older than 37c4162, the first \
         report on judged maps: the others were not frozen before.",
        list(&is_developer),
        list(&|light| !is_developer(light) && light != SUN),
        TUNED.len() - late.len(),
        TUNED.len(),
        late.join("; ")
    );
    let mut constants = Table::new(5, &["constant", "file", "value", "chosen on", "last changed in"]);
    for Tuned { what, file, text, commit, maps, .. } in TUNED {
        constants.row([what.into(), format!("`{file}`"), format!("`{text}`"), maps.into(), commit.into()]);
    }
    let rivals = [Against::Method("MIS balance"), Against::Best(&EXTENDED)];
    let heads = rivals.iter().flat_map(|rival| METRICS.map(|metric| format!("{}, {}", rival.name(), metric.0)));
    let head: Vec<String> = ["maps", "rays"].map(String::from).into_iter().chain(heads).collect();
    let mut table = Table::new(2, &head);
    for (name, developer) in [("development", true), ("judged", false)] {
        let kept = |cell: &&&Cell| is_developer(&cell.light) == developer && cell.light != SUN;
        let of: Vec<&Cell> = main.iter().filter(kept).copied().collect();
        for rays in RAYS {
            let gain = |rival: &Against, scale| times(rival.mean(of.iter().copied(), "direct", rays, scale));
            let gains = rivals.iter().flat_map(|rival| Scale::of_model(1).map(|scale| gain(rival, scale)));
            table.row([name.into(), rays.to_string()].into_iter().chain(gains));
        }
    }
    let beside = "Gains of `direct` on both groups of maps, expensive costs, cold caches. A library that fits its development maps \
                  alone would be behind on the others.";
    vec![
        Part::Heading("Maps for tuning and maps for judging".into()),
        Part::Text(text),
        Part::Table(constants),
        Part::Text(beside.into()),
        Part::Table(table),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A constant that changed was tuned again: name its commit and the maps.
    #[test]
    fn constants_are_those_of_the_commits_that_are_named() {
        for Tuned { file, text, .. } in TUNED {
            let path = format!("{}/../{file}", env!("CARGO_MANIFEST_DIR"));
            assert!(std::fs::read_to_string(&path).unwrap().contains(text), "{file} no longer has {text}");
        }
    }
}
