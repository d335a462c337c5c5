//! Which constants of the library were chosen by measurements, on which maps, and in which commit (rule 37); and what the same choice on
//! development maps alone gives, which `docs/tuning.md` tells.

use crate::gains::{Against, METRICS, Scale};
use crate::studies::SUN;
use wis_ffi_tests::measure::Cell;
use wis_ffi_tests::method::EXTENDED;
use wis_ffi_tests::page::{Part, Table, times};
use wis_ffi_tests::data::DEVELOPER;

/// A constant that was chosen by measurements.
struct Tuned {
    what: &'static str,
    file: &'static str,
    /// As the file has it: a test fails if it does not, since `commit` is then another.
    text: &'static str,
    /// The last that changed it.
    commit: &'static str,
    /// Where it was first chosen.
    maps: &'static str,
    /// Whether maps of this report were among those that are no development maps.
    judged: bool,
    /// Its names in `docs/tuning.md`, if it was chosen anew there.
    anew: &'static [&'static str],
}

const TUNED: [Tuned; 7] = [
    Tuned {
        what: "share of numbers that lobes of a product draw",
        file: "src/product/peak.rs",
        text: "Mixture { narrow: 0.15, share: 1.35, through: 0.7, resolved: 0.085 }",
        commit: "05bf15f",
        maps: "eight lights of this report",
        judged: true,
        anew: &[],
    },
    Tuned {
        what: "lobes of a product against its grid",
        file: "src/product/share.rs",
        text: "const MOST: f32 = 0.75;",
        commit: "05bf15f",
        maps: "eight lights of this report",
        judged: true,
        anew: &[],
    },
    Tuned {
        what: "candidates for one ray",
        file: "src/direct/effort.rs",
        text: "0..=1 if !diffuse => 16,",
        commit: "72e856f",
        maps: "venice_sunset, dikhololo_night, rooitou_park",
        judged: true,
        anew: &[],
    },
    Tuned {
        what: "candidates for each of more rays",
        file: "src/direct/effort.rs",
        text: "0..=MANY => 8,",
        commit: "72e856f",
        maps: "venice_sunset, dikhololo_night, rooitou_park",
        judged: true,
        anew: &[],
    },
    Tuned {
        what: "roughness of more candidates",
        file: "src/direct/effort.rs",
        text: "const NARROW: [f32; 2] = [0.15, 0.075];",
        commit: "92c4573",
        maps: "four maps, judged ones among them",
        judged: true,
        anew: &[],
    },
    Tuned {
        what: "strata in groups",
        file: "src/light/strata.rs",
        text: "const UNEVEN: f64 = 16.0;",
        commit: "2a3a161",
        maps: "venice_sunset, dikhololo_night, rooitou_park",
        judged: true,
        anew: &[],
    },
    Tuned {
        what: "when hits share a product",
        file: "src/product/covers.rs",
        text: "const SHARES: f32 = 1.25;",
        commit: "d3be617",
        maps: "four lights of the study of textures",
        judged: true,
        anew: &["when hits share a product"],
    },
];

/// The page of constants that were chosen anew on development maps alone.
const ANEW: &str = "docs/tuning.md";

/// Whether the value in force stays there, and in words what was found.
fn anew(page: &str, name: &str) -> Option<(bool, String)> {
    let row = page.lines().find(|line| line.starts_with(&format!("| {name} |")))?;
    let cells: Vec<&str> = row.split('|').map(str::trim).collect();
    let &[_, _, _, in_force, best, score, interval, warm, stays, _] = cells.as_slice() else { return None };
    let stays = stays == "yes";
    let found = if best == in_force {
        "the best".into()
    } else {
        format!("the best is {best}, score {score} ({interval}), warm {warm}")
    };
    Some((stays, format!("{in_force} {}, {found}", if stays { "stays" } else { "does not stay" })))
}

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
    let page = std::fs::read_to_string(ANEW).unwrap_or_default();
    let again = TUNED.iter().flat_map(|tuned| tuned.anew);
    let (stay, others): (Vec<&str>, Vec<&str>) =
        again.partition(|name| anew(&page, name).is_some_and(|(stays, _)| stays));
    let or_none = |names: Vec<&str>| if names.is_empty() { "none".into() } else { names.join("; ") };
    let text = format!(
        "Development maps: {}. Judged maps: {}. The light \"{SUN}\" is made by the project. [tuning.md](tuning.md) tries the constants in \
         force against other values on four development maps alone. One whose variance x time is within 3 % of the best stays. **{} of {} \
         stay. Does not stay: {}.** They were frozen before this report was measured. Judged maps were in sight when these were first \
         chosen: {}.",
        list(&is_developer),
        list(&|light| !is_developer(light) && light != SUN),
        stay.len(),
        stay.len() + others.len(),
        or_none(others),
        or_none(late)
    );
    let mut constants = Table::new(
        6,
        &["constant", "file", "value", "first chosen on", "last changed in", "on development maps alone"],
    );
    for Tuned { what, file, text, commit, maps, anew: names, .. } in TUNED {
        let found: Vec<String> = names.iter().filter_map(|name| Some(anew(&page, name)?.1)).collect();
        let found = if found.is_empty() { "not chosen anew".into() } else { found.join("; ") };
        let value = format!("`{text}`");
        constants.row([what.into(), format!("`{file}`"), value, maps.into(), commit.into(), found]);
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
    let beside = "Gains of `direct` on both groups of maps, expensive costs, a renderer's caches. A library that fits its development maps \
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

    #[test]
    fn constants_that_were_chosen_anew_are_on_the_page() {
        let page = std::fs::read_to_string(format!("{}/../{ANEW}", env!("CARGO_MANIFEST_DIR"))).unwrap();
        for name in TUNED.iter().flat_map(|tuned| tuned.anew) {
            assert!(anew(&page, name).is_some(), "{ANEW} has no {name}");
        }
    }
}
