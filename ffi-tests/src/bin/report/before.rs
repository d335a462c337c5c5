//! Against version 0.1, whose clients chose a sampler for each hit and kept products themselves: what choosing and keeping by
//! `wis_direct` gains over that.

use crate::gains::{self, METRICS, Scale, geometric_mean, row};
use crate::studies::{HITS, MAIN, TEXTURED, is_sun};
use crate::tables::{of_study, ours, verdict};
use wis_ffi_tests::before::Before;
use wis_ffi_tests::cost::MODELS;
use wis_ffi_tests::kept;
use wis_ffi_tests::library::Mode;
use wis_ffi_tests::measure::Cell;
use wis_ffi_tests::method::Method;
use wis_ffi_tests::page::{Part, Table, times};
use wis_ffi_tests::peers::{Candidates, Peer};

/// Up to so many rays at a hit, the rule takes a pool.
const FEW: usize = 4;
/// From so many on, it prepares a product for narrow lobes, too.
const MANY: usize = 64;
/// The lobe of this page that is narrower than 0.1.
const NARROW: &str = "GGX 0.05";

/// The heading and both tables, of what was measured.
pub fn parts(cells: &[Cell]) -> Vec<Part> {
    let tables: Vec<Part> = ruled(&of_study(cells, MAIN)).into_iter().chain(kept_by_client(cells)).collect();
    let heading = (!tables.is_empty()).then(|| Part::Heading("Against version 0.1".into()));
    heading.into_iter().chain(tables).collect()
}

/// What a client of version 0.1 calls, as its header says: pools have candidates of the compensated light.
fn rule(cell: &Cell, rays: usize) -> Method {
    let is_narrow = cell.material == NARROW && rays < MANY;
    match rays {
        0..=FEW => Peer::Pool(8, Candidates::Compensated).into(),
        _ if is_narrow || is_sun(&cell.light) => Peer::Pool(4, Candidates::Compensated).into(),
        _ => Mode::Before(Before::Product).into(),
    }
}

/// `wis_direct` beside the rule at so many rays, in the mean over cells and both cost models.
struct Beside {
    /// The gain at equal time, in each metric.
    gains: [f64; METRICS.len()],
    /// The same for as many rays: the rule's variance over that of `wis_direct`.
    variance: [f64; METRICS.len()],
    /// Microseconds for a hit with its rays: of `wis_direct`, and of the rule.
    us: [f64; 2],
}

impl Beside {
    fn of(cells: &[&Cell], rays: usize) -> Beside {
        let ours = ours(MAIN);
        let groups = || cells.iter().flat_map(|cell| (0..MODELS.len()).map(move |model| (*cell, model)));
        let mean = |of: &dyn Fn(&Cell, &str, usize) -> Option<f64>| {
            geometric_mean(groups().filter_map(|(cell, model)| of(cell, &rule(cell, rays).name(), model)))
        };
        let scale = |metric, model| Scale { metric, model, ..Scale::default() };
        let us = |cell: &Cell, method: &str, model: usize| Some(row(cell, method, rays)?.times[0][model].ns() * 1e-3);
        Beside {
            gains: std::array::from_fn(|metric| {
                mean(&|cell, rule, model| Some(gains::over(cell, ours, rule, rays, scale(metric, model))?[0]))
            }),
            variance: std::array::from_fn(|metric| {
                mean(&|cell, rule, model| gains::in_time_of(cell, rule, ours, rule, rays, scale(metric, model)))
            }),
            us: [mean(&|cell, _, model| us(cell, ours, model)), mean(&|cell, rule, model| us(cell, rule, model))],
        }
    }
}

fn ruled(cells: &[&Cell]) -> Vec<Part> {
    let Some(first) = cells.first() else { return Vec::new() };
    let head = [
        "rays at a hit",
        "verdict",
        "absolute",
        "relative",
        "both metrics",
        "absolute, equal rays",
        "relative, equal rays",
        "us of `wis_direct`",
        "us of the rule",
    ];
    let (mut table, mut reached, counts) = (Table::new(2, &head), [0; 3], gains::counts(first));
    for &rays in &counts {
        let Beside { gains: [absolute, relative], variance, us } = Beside::of(cells, rays);
        let gains = [absolute, relative, (absolute * relative).sqrt()];
        reached.iter_mut().zip(gains).for_each(|(reached, gain)| *reached += usize::from(gain >= 1.0));
        let words = [rays.to_string(), verdict(gains[2] >= 1.0).into()];
        let numbers = gains.into_iter().chain(variance).map(times).chain(us.map(|us| format!("{us:.1}")));
        table.row(words.into_iter().chain(numbers));
    }
    let [absolute, relative, both] = reached;
    let text = format!(
        "**The rule of version 0.1.** Its clients chose a sampler for each hit. Up to {FEW} rays: a pool with 8 candidates of the compensated \
         light for each ray, of which there were 16 for one ray. More rays: `{}`, but under unclipped suns, and for lobes narrower than 0.1 \
         below {MANY} rays, a pool with 4. **`wis_direct` is at least as efficient in {both} of {n} rows**, in the mean of both metrics. In \
         the absolute metric that holds in {absolute} of {n}, in the relative one in {relative}.",
        Mode::Before(Before::Product).name(),
        n = counts.len()
    );
    let words = format!(
        "Gain of `wis_direct` over the rule at equal time with cold caches: above 1 it is ahead. A gain is the rule's variance over that of \
         `wis_direct` with as many rays, times the time of the rule over that of `wis_direct`: both have columns. Times are for a hit with \
         its rays. Each number is the geometric mean over {} cells of \"{MAIN}\" and both cost models. Reached: at least 1 in the mean of \
         both metrics.",
        cells.len()
    );
    vec![Part::Text(text), Part::Table(table), Part::Text(words)]
}

/// Gains of `wis_direct` with numbers of the client's own over products that the client keeps.
fn over_kept<'a>(cells: &[&'a Cell], scale: Scale) -> Vec<(&'a Cell, f64)> {
    let (shared, kept) = (Mode::Shared.name(), Mode::Kept.name());
    let gains = |cell: &&'a Cell| {
        let of = |rays| Some((*cell, gains::over(cell, shared, kept, rays, scale)?[0]));
        gains::counts(cell).into_iter().filter_map(of).collect::<Vec<_>>()
    };
    cells.iter().flat_map(gains).collect()
}

fn kept_by_client(cells: &[Cell]) -> Vec<Part> {
    let head = ["study", "metric, costs", "verdict", "worst cell", "mean over cells", "worst cell's gain"];
    let (mut table, mut reached) = (Table::new(4, &head), 0);
    for (study, scale) in [HITS, TEXTURED].into_iter().flat_map(|study| Scale::all().map(move |scale| (study, scale))) {
        let gains = over_kept(&of_study(cells, study), scale);
        let Some((worst, least)) = gains.iter().min_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
        let mean = geometric_mean(gains.iter().map(|gain| gain.1));
        reached += usize::from(mean >= 1.0);
        let place = format!("{}, {}", worst.light, worst.material);
        let words = [study.into(), scale.name(), verdict(mean >= 1.0).into(), place];
        table.row(words.into_iter().chain([mean, *least].map(times)));
    }
    if table.rows.is_empty() {
        return Vec::new();
    }
    let text = format!(
        "**Products kept by the client.** A client can share products itself (`{}`). It keeps the last {} of a pixel, prepared with a cone \
         of {} radians. A hit draws from one that `wis_product_covers` allows, or else prepares another. **`wis_direct` with `u` is at least \
         as efficient in {reached} of {} rows**, in the mean over cells.",
        Mode::Kept.name(),
        kept::MOST,
        kept::CONE,
        table.rows.len()
    );
    let words = "Gain of `wis_direct` with `u` over that at equal time with cold caches: above 1 it is ahead. Both have the same \
                 well-spread numbers. Means are geometric. Reached: the mean is at least 1.";
    vec![Part::Text(text), Part::Table(table), Part::Text(words.into())]
}

#[cfg(test)]
mod tests {
    use super::*;
    use wis_ffi_tests::measure::{Errors, Repeat, Row};
    use wis_ffi_tests::timing::Time;

    const RAYS: usize = 16;

    /// A cell of methods at so many rays, by what each takes; the variances of all are 1.
    fn cell(study: &str, light: &str, methods: &[(&str, f64)]) -> Cell {
        let errors = Errors { absolute: 1.0, relative: 1.0, ..Errors::default() };
        let row = |&(method, ns): &(&str, f64)| Row {
            method: method.into(),
            count: RAYS,
            times: [[Time { sampling: ns, rays: 0.0 }; MODELS.len()]; 2],
            repeats: vec![Repeat { errors: [errors; 4] }],
        };
        Cell {
            study: study.into(),
            scene: String::new(),
            light: light.into(),
            material: "Lambert".into(),
            pixels: [0; 4],
            reference: (0, 0.0),
            max_weight: 0.0,
            visible: 1.0,
            candidates: Vec::new(),
            rows: methods.iter().map(row).collect(),
        }
    }

    #[test]
    fn the_rule_takes_a_pool_for_few_rays_and_under_suns() {
        let methods = [("direct", 1.0), ("P(4) comp.", 2.0), ("wavelet product", 8.0)];
        let [sun, sky] = [crate::studies::SUN, "sky"].map(|light| cell(MAIN, light, &methods));
        assert_eq!([1, 4, 16].map(|rays| rule(&sky, rays).name()), ["P(8) comp.", "P(8) comp.", "wavelet product"]);
        assert_eq!(rule(&sun, 64).name(), "P(4) comp.");
        let narrow = Cell { material: NARROW.into(), ..cell(MAIN, "sky", &methods) };
        assert_eq!([16, 64].map(|rays| rule(&narrow, rays).name()), ["P(4) comp.", "wavelet product"]);
        let Beside { gains, variance, us } = Beside::of(&[&sun, &sky], RAYS);
        assert!(gains.iter().all(|gain| (gain - 4.0).abs() < 1e-9), "{gains:?}");
        assert!(variance.iter().all(|ratio| (ratio - 1.0).abs() < 1e-9), "{variance:?}");
        assert!((us[0] - 1e-3).abs() < 1e-12 && (us[1] - 4e-3).abs() < 1e-12, "{us:?}");
    }

    #[test]
    fn the_worst_cell_and_the_mean_are_those_of_kept_products() {
        let of = |light, ns| cell(HITS, light, &[("direct, shared", 1.0), ("product, kept", ns)]);
        let parts = kept_by_client(&[of("sky", 8.0), of("room", 0.5)]);
        let Some(Part::Table(table)) = parts.get(1) else { panic!("no table") };
        assert_eq!(table.rows.len(), 4);
        assert_eq!(table.rows[0][2..], ["reached", "room, Lambert", "2.00x", "0.50x"]);
    }
}
