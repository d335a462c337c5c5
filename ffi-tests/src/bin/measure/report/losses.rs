//! Where the best peers are ahead: why, as far as the measured numbers tell, and what to call instead.

use super::gains::{self, PROSE, Scale, materials, of_study, ours, over, over_best, studies};
use std::fmt::Display;
use wis_ffi_tests::measure::{Cell, Errors};
use wis_ffi_tests::method::EXTENDED;
use wis_ffi_tests::page::{Part, Table, times};
use wis_ffi_tests::peers::Peer;
use wis_ffi_tests::statistics::geometric;

/// Rows at most: those with the largest losses.
const ROWS: usize = 12;
/// A change that counts: the intervals of smaller ones often hold 1.
const TELLS: f64 = 1.2;
/// A call with a smaller gain is no advice.
const POOR: f64 = 0.25;
/// Other ways to use the library, and how they are called.
const CALLS: [(&str, &str); 4] = [
    ("direct", "`wis_direct` without `u`"),
    ("product", "`wis_product_prepare`, `wis_sample`"),
    ("product + MIS", "the product in MIS of your own"),
    ("direct, target", "`target`"),
];

/// The heading, the table and what its words mean.
pub fn parts(cells: &[Cell]) -> Vec<Part> {
    let (mut rows, mut lost, mut all) = (Vec::new(), 0, 0);
    for study in studies(cells) {
        let of_study = of_study(cells, &study);
        for material in materials(&of_study) {
            let of: Vec<&Cell> = of_study.iter().copied().filter(|cell| cell.material == material).collect();
            let gains = gains_of(&of, ours(&study));
            let behind = gains.iter().filter(|gain| gain.0 < 1.0).count();
            (lost, all) = (lost + behind, all + gains.len());
            let Some(&(worst, count, scale)) = gains.first().filter(|_| behind > 0) else { continue };
            let loss = Loss::new(&of, ours(&study), count, scale);
            let range = format!("{} to {}", times(worst), times(gains[gains.len() - 1].0));
            let behind = format!("{behind} of {}", gains.len());
            rows.push((worst, loss.row(&study, &material, range, behind)));
        }
    }
    let heading = "Where does wis lose, and why?";
    let filled: [(&str, &dyn Display); 3] = [("baselines", &EXTENDED.each.len()), ("lost", &lost), ("all", &all)];
    let mut parts = vec![Part::Heading(heading.into()), PROSE.part(heading, &filled)];
    if rows.is_empty() {
        return parts;
    }
    rows.sort_by(|a: &(f64, Vec<String>), b| a.0.total_cmp(&b.0));
    rows.truncate(ROWS);
    let head = ["study", "lobe", "worst group", "best baselines there", "reason", "what helps"];
    let mut table = Table::new(head, ["gain there", "all gains", "behind"]);
    table.rows = rows.into_iter().map(|(_, row)| row).collect();
    let words = ["Names of baselines", "Words of reasons"].map(|heading| PROSE.part(heading, &[]));
    parts.extend([Part::Table(table)].into_iter().chain(words));
    parts
}

/// The gains over the best peer for every number of rays, metric and cost model, the worst first.
fn gains_of(cells: &[&Cell], ours: &str) -> Vec<(f64, usize, Scale)> {
    let groups = gains::counts(cells[0]).into_iter().flat_map(|n| Scale::all().map(move |scale| (n, scale)));
    let gain = |n, scale| {
        geometric(cells.iter().filter_map(|c| over_best(c, ours, &EXTENDED, n, scale)).map(|(_, gain)| gain[0]))
    };
    let mut gains: Vec<_> = groups.map(|(n, scale)| (gain(n, scale), n, scale)).filter(|g| g.0.is_finite()).collect();
    gains.sort_by(|a, b| a.0.total_cmp(&b.0));
    gains
}

/// A group of cells in which peers are ahead.
struct Loss {
    count: usize,
    scale: Scale,
    gain: f64,
    /// The best peers, those of most cells first.
    peers: Vec<Peer>,
    /// Variance of the peer over that of wis with as many rays: with shadows, and without.
    variance: f64,
    unshadowed: f64,
    /// Microseconds for a hit: of wis, and of the peer.
    us: [f64; 2],
    /// The gain of the best of the library's other ways over the same peers, and its call.
    other: Option<(f64, &'static str)>,
    /// Variance of wis over that with `target`, where that was measured.
    target: Option<f64>,
    /// The share of the light that is not blocked.
    visible: f64,
    /// Candidates of wis for a ray; 0: samples of a product.
    candidates: f64,
}

/// What explains most of a loss.
enum Cause {
    /// It is small.
    Level,
    /// Its variance is lower.
    Time,
    /// Only with shadows its variance is higher.
    Blocked,
    /// A measured BRDF differs from the lobes that stand in for it: their values, or where they put candidates.
    Values(f64),
    Places(f64),
    /// A product that is coarser than the lobe.
    Product,
    /// The peer weighs more candidates.
    Candidates,
    Variance,
}

impl Loss {
    fn new(cells: &[&Cell], ours: &str, count: usize, scale: Scale) -> Loss {
        let best: Vec<(&Cell, String, f64)> = cells
            .iter()
            .filter_map(|cell| {
                over_best(cell, ours, &EXTENDED, count, scale).map(|(peer, gain)| (*cell, peer, gain[0]))
            })
            .collect();
        let ratio = |theirs: &dyn Fn(&Cell, &str) -> Option<f64>, ours: &dyn Fn(&Cell) -> Option<f64>| {
            geometric(best.iter().filter_map(|(cell, peer, _)| Some(theirs(cell, peer)? / ours(cell)?)))
        };
        let ns =
            |cell: &Cell, method: &str| Some(gains::row(cell, method, count)?.times[scale.caches][scale.model].ns());
        let variance = |cell: &Cell, method: &str| gains::variance(cell, method, count, scale.metric);
        let unshadowed = |cell: &Cell, method: &str| {
            let of = |errors: &Errors| errors.unshadowed;
            Some(gains::row(cell, method, count)?.mean(|repeat| of(&repeat.errors[0])))
        };
        let with = |&(method, call): &(&'static str, &'static str)| {
            let gains = best.iter().filter_map(|(cell, peer, _)| over(cell, method, peer, count, scale));
            (method != ours).then(|| (geometric(gains.map(|gain| gain[0])), call))
        };
        let gain = geometric(best.iter().map(|b| b.2));
        let us = [
            geometric(best.iter().filter_map(|(cell, ..)| ns(cell, ours))) / 1e3,
            geometric(best.iter().filter_map(|(cell, peer, _)| ns(cell, peer))) / 1e3,
        ];
        let target = ratio(&|cell, _| variance(cell, ours), &|cell| variance(cell, "direct, target"));
        let mean = |of: &dyn Fn(&Cell) -> f64| cells.iter().map(|cell| of(cell)).sum::<f64>() / cells.len() as f64;
        let drawn = |cell: &Cell| cell.candidates.iter().find(|of| of.0 == count).map_or(0.0, |of| of.1);
        Loss {
            count,
            scale,
            gain,
            peers: most_often(best.iter().map(|b| b.1.as_str())),
            variance: gain * us[0] / us[1],
            unshadowed: ratio(&unshadowed, &|cell| unshadowed(cell, ours)),
            us,
            other: CALLS.iter().filter_map(with).filter(|o| o.0.is_finite()).max_by(|a, b| a.0.total_cmp(&b.0)),
            target: target.is_finite().then_some(target),
            visible: mean(&|cell| cell.visible),
            candidates: if ours == "direct" { mean(&drawn) } else { 0.0 },
        }
    }

    fn cause(&self) -> Cause {
        match self.target {
            _ if self.gain >= 1.0 / TELLS => Cause::Level,
            _ if self.variance >= 1.0 => Cause::Time,
            _ if self.unshadowed >= 1.0 => Cause::Blocked,
            Some(target) if target >= TELLS => Cause::Values(target),
            Some(target) => Cause::Places(target),
            None if self.candidates == 0.0 => Cause::Product,
            None if candidates(self.peers[0]) as f64 > TELLS * self.candidates => Cause::Candidates,
            None => Cause::Variance,
        }
    }

    /// Why, from the numbers alone.
    fn reason(&self) -> String {
        let [own, theirs] = self.us;
        let (higher, without) = (times(1.0 / self.variance), times(1.0 / self.unshadowed));
        let peers = candidates(self.peers[0]);
        let time = format!("wis takes {own:.1} us, the baseline {theirs:.1} us");
        let reason = match self.cause() {
            Cause::Level => return format!("Nearly level: {time}."),
            Cause::Time => return format!("Time: {time}. Variance is {} lower.", times(self.variance)),
            Cause::Blocked => format!(
                "Blocked light: variance is {higher} higher, but {} lower without shadows. {:.0} % of the light is visible.",
                times(self.unshadowed),
                100.0 * self.visible
            ),
            Cause::Values(target) => format!(
                "Values of the fitted lobes: variance is {higher} higher. `target`, the BRDF itself, makes it {} lower.",
                times(target)
            ),
            Cause::Places(target) => format!(
                "Candidates of the fitted lobes: wis weighs {:.0} a ray, the baseline {peers} of the BRDF itself. Variance is {higher} higher; \
                 `target` changes it by {} only.",
                self.candidates,
                times(target)
            ),
            Cause::Product => {
                format!(
                    "Samples of a product: variance is {higher} higher, {without} without shadows. The baseline weighs {peers} candidates \
                     a ray."
                )
            }
            Cause::Candidates => format!(
                "Candidates: wis weighs {:.0} a ray, the baseline {peers}. Variance is {higher} higher, {without} without shadows.",
                self.candidates
            ),
            Cause::Variance => format!("Variance is {higher} higher, {without} without shadows."),
        };
        if own > TELLS * theirs { format!("{reason} Time: {time}.") } else { reason }
    }

    /// What is better there: a call or a setting, or the peer and what it does better.
    fn advice(&self) -> String {
        let peer = self.peers[0];
        let own = match self.cause() {
            Cause::Level => "no change".into(),
            Cause::Time => format!("{}, which takes {:.1} us", peer.name(), self.us[1]),
            Cause::Blocked => format!("a visibility cache (`visibility` of the point); without one {}", peer.name()),
            _ => match candidates(peer) {
                1 => format!("{}, which takes {:.1} us", peer.name(), self.us[1]),
                n => format!("resample {n} candidates of your own a ray"),
            },
        };
        match self.other {
            Some((gain, call)) if gain >= 1.0 => format!("{call} ({})", times(gain)),
            Some((gain, call)) if gain >= POOR.max(TELLS * self.gain) => format!("{call} ({}); {own}", times(gain)),
            _ => own,
        }
    }

    fn row(&self, study: &str, material: &str, range: String, behind: String) -> Vec<String> {
        let group = format!("{}, {} ray{}", self.scale.name(), self.count, if self.count == 1 { "" } else { "s" });
        let peers = self.peers.iter().take(2).map(|peer| peer.name()).collect::<Vec<_>>().join(", ");
        let words = [study.into(), material.into(), group, peers, self.reason(), self.advice()];
        words.into_iter().chain([times(self.gain), range, behind]).collect()
    }
}

/// Peers by how often their names come.
pub fn most_often<'a>(names: impl Iterator<Item = &'a str>) -> Vec<Peer> {
    let names: Vec<&str> = names.collect();
    let often = |peer: &Peer| names.iter().filter(|name| **name == peer.name()).count();
    let mut peers: Vec<Peer> = EXTENDED.each.iter().copied().filter(|peer| often(peer) > 0).collect();
    peers.sort_by_key(|peer| std::cmp::Reverse(often(peer)));
    peers
}

/// Directions that a peer evaluates for a ray.
fn candidates(peer: Peer) -> usize {
    match peer {
        Peer::Ris(count, _) | Peer::Pool(count, _) => count,
        _ => 1,
    }
}
