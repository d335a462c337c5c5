//! The page: verdicts first, then the tables that they come from.

use super::passes::{PASSES, PLACES, Passes, WAYS};
use super::seen::{RAYS, Seen, WAYS as SEEN};
use super::several::Several;
use crate::report::gains::{METRICS, Scale, distinct, metrics, over, row, variance};
use crate::report::tables::verdict;
use anyhow::Result;
use std::fmt::Display;
use wis_ffi_tests::cost::MODELS;
use wis_ffi_tests::measure::{Cell, FEW, REGIONS};
use wis_ffi_tests::page::{Page, Part, Prose, Table, times};
use wis_ffi_tests::statistics::geometric;

const PROSE: Prose = Prose(include_str!("page.md"));

/// Goals, absolute and relative: over MIS without portals, and over MIS with a uniform sample of the portals.
const OVER_MIS: [f64; 2] = [10.0, 10.0];
const OVER_UNIFORM: [f64; 2] = [4.0, 1.2];
/// Of a visibility cache in passes, where some of the light is hidden and where most of it is.
const OF_CACHE: f64 = 1.5;
/// What one call for several environments must save to be worth its code: a third of the error at equal time.
const SAVES: f64 = 1.5;

/// What calls are compared with.
const RIVALS: [&str; 5] = ["MIS balance", "MIS compensated", "uniform in portals", "pbrt-v4's windows", "direct"];
/// Calls without portals: as they are, with fewer candidates, and with rays of the BRDF for the light below the mean.
const BARE: [&str; 3] = ["direct", "direct, 4 candidates", "direct and BRDF"];
const OURS: [&str; 3] = ["direct", "direct, portals", "direct, complete portals"];
/// Scenes that light comes into by portals alone.
const ROOMS: [&str; 4] = ["one window", "a small window", "three windows and a door", "sun through the window"];

/// A scene that light comes into from everywhere.
const OPEN: [&str; 1] = ["a portal before the whole sky"];

/// Whether a scene is one that calls without portals are judged in.
pub fn is_without_portals(scene: &str) -> bool {
    ROOMS.contains(&scene) || OPEN.contains(&scene)
}

/// The gain of a method over another, as the geometric mean over some cells.
fn gain(cells: &[&Cell], ours: &str, theirs: &str, rays: usize, scale: Scale) -> f64 {
    geometric(cells.iter().filter_map(|cell| over(cell, ours, theirs, rays, scale)).map(|gain| gain[0]))
}

fn within<'a>(cells: &'a [Cell], scene: &str) -> Vec<&'a Cell> {
    cells.iter().filter(|cell| cell.scene == scene).collect()
}

pub fn page(cells: &[Cell], seen: &[Seen], passes: &[Passes], several: &[Several]) -> Result<Page> {
    let scenes = distinct(cells.iter().map(|cell| &cell.scene));
    let lights = distinct(cells.iter().map(|cell| &cell.light)).join(", ");
    let mut parts = vec![
        Part::List(verdicts(cells, seen, passes, several)),
        PROSE.part("Gains", &[]),
        Part::Table(summary(cells, &scenes, &[4])),
    ];
    parts.extend(PROSE.section("Without portals", &[], bare(cells)));
    parts.extend(PROSE.section("Without portals, with a visibility cache", &[], of_seen(seen)));
    let filled: [(&str, &dyn Display); 2] = [("PASSES", &PASSES), ("FEW", &FEW)];
    parts.extend(PROSE.section("Passes of one ray, with a visibility cache", &filled, of_passes(passes)));
    parts.extend([PROSE.part("Where light is visible", &filled), Part::Table(by_region(passes))]);
    parts.extend(PROSE.section("Several environments", &[], of_several(several)));
    parts.extend([Part::Heading("1 and 16 rays".into()), Part::Table(summary(cells, &scenes, &[1, 16]))]);
    parts.extend(PROSE.section("Each light and material", &[], each(cells)));
    parts.push(Part::Heading("How it was measured".into()));
    parts.push(PROSE.part("How it was measured", &[("lights", &lights)]));
    Page::measured("Rooms: portals", parts, "rooms")
}

fn verdicts(cells: &[Cell], seen: &[Seen], passes: &[Passes], several: &[Several]) -> Vec<String> {
    let rooms: Vec<&Cell> = cells.iter().filter(|cell| ROOMS.contains(&cell.scene.as_str())).collect();
    let both = |theirs: &str, ours: &str, model: usize| {
        Scale::of_model(model).map(|scale| gain(&rooms, ours, theirs, 4, scale))
    };
    let says = |[a, b]: [f64; 2]| format!("{} absolute and {} relative", times(a), times(b));
    let under_both = |[cheap, expensive]: [[f64; 2]; 2]| {
        format!("{} ({}), {} ({})", says(cheap), MODELS[0].0, says(expensive), MODELS[1].0)
    };
    let mut list = Vec::new();
    for (theirs, name, goal) in [
        ("MIS balance", "MIS without portals", OVER_MIS),
        ("uniform in portals", "MIS with a uniform sample of the portals", OVER_UNIFORM),
        ("pbrt-v4's windows", "pbrt-v4's windows", [1.0; 2]),
    ] {
        let found = [0, 1].map(|model| both(theirs, "direct, complete portals", model));
        let reached = found.iter().all(|gains| gains.iter().zip(goal).all(|(gain, goal)| *gain >= goal));
        let (found, goal, verdict) = (under_both(found), says(goal), verdict(reached));
        list.push(format!("In rooms with portals, 4 rays, over {name}: {found}. The goal of {goal} is {verdict}."));
    }
    for (ours, how) in
        [("direct, 4 candidates", "`candidates_per_ray` = 4"), ("direct", "the library's choice of candidates")]
    {
        let without = [0, 1].map(|model| both("MIS balance", ours, model));
        let reached = without.iter().flatten().all(|gain| *gain >= 1.0);
        let (found, verdict) = (under_both(without), verdict(reached));
        list.push(format!(
            "Without portals in the same rooms, 4 rays, with {how}, over MIS: {found}. The goal of 1 is {verdict}."
        ));
    }
    let learnt = [0, 1].map(|model| {
        [0, 1]
            .map(|metric| gain_of_seen(seen.iter().filter(|of| of.is_closed), (1, SEEN.len() - 1), metric, Some(model)))
    });
    let verdict_of_seen = verdict(learnt.iter().flatten().all(|gain| *gain >= 1.0));
    list.push(format!(
        "Without portals in the same rooms, 4 rays, with a visibility cache that has learnt, over MIS: {}. The goal of 1 is {verdict_of_seen}.",
        under_both(learnt)
    ));
    for region in [2, 3] {
        let gains = [0, 1].map(|model| geometric(passes.iter().filter_map(|of| of.gain(region, model))));
        let reached = verdict(gains.iter().all(|gain| *gain >= OF_CACHE));
        list.push(format!(
            "A visibility cache in {PASSES} passes of one ray, relative error in the {}: {} ({}), {} ({}). The goal of {OF_CACHE} is {reached}.",
            REGIONS[region],
            times(gains[0]),
            MODELS[0].0,
            times(gains[1]),
            MODELS[1].0
        ));
    }
    let saves: Vec<f64> = several.iter().flat_map(gains_of_sum).collect();
    list.push(format!(
        "Several environments: one call for a map of their sum has {} the efficiency of a call for each, and saves a third of the error in {} of {} \
         cases. Add maps that do not move against each other; no call for several could do better.",
        times(geometric(saves.iter().copied())),
        saves.iter().filter(|gain| **gain >= SAVES).count(),
        saves.len()
    ));
    list
}

/// A line for each scene, number of rays, cost model and call.
fn summary(cells: &[Cell], scenes: &[String], counts: &[usize]) -> Table {
    let over = RIVALS.map(|rival| if rival == "direct" { "no portals" } else { rival });
    let mut table = Table::new(["scene", "rays", "costs", "call"], over.into_iter().flat_map(metrics));
    for scene in scenes {
        let here = within(cells, scene);
        for &rays in counts {
            for (model, (costs, _)) in MODELS.into_iter().enumerate() {
                for ours in OURS.into_iter().filter(|ours| row(here[0], ours, rays).is_some()) {
                    let gains = RIVALS.into_iter().flat_map(|theirs| {
                        Scale::of_model(model).map(|scale| {
                            if theirs == ours { "-".into() } else { times(gain(&here, ours, theirs, rays, scale)) }
                        })
                    });
                    table.row([scene, &rays.to_string(), costs, ours], gains);
                }
            }
        }
    }
    table
}

/// A table of gains in each metric: in each cost model, and with as many rays.
fn of_gains(words: [&str; 3]) -> Table {
    Table::new(words, MODELS.iter().map(|model| model.0).chain(["equal rays"]).flat_map(metrics))
}

/// A line for each place, number of rays and call.
fn bare(cells: &[Cell]) -> Table {
    let mut table = of_gains(["where", "rays", "call"]);
    for (place, scenes) in [("rooms", &ROOMS[..]), ("in the open", &OPEN)] {
        let here: Vec<&Cell> = cells.iter().filter(|cell| scenes.contains(&cell.scene.as_str())).collect();
        for rays in [1, 4, 16] {
            for ours in BARE {
                let at_equal_time = [0, 1]
                    .into_iter()
                    .flat_map(|model| Scale::of_model(model).map(|scale| gain(&here, ours, RIVALS[0], rays, scale)));
                let ratio = |metric| {
                    let of = |cell: &&Cell| {
                        Some(variance(cell, RIVALS[0], rays, metric)? / variance(cell, ours, rays, metric)?)
                    };
                    geometric(here.iter().filter_map(of))
                };
                let gains = at_equal_time.chain([0, 1].map(ratio)).map(times);
                table.row([place, &rays.to_string(), ours], gains);
            }
        }
    }
    table
}

/// The gain over MIS of a number of rays and a way, at equal time in a cost model or with as many rays.
fn gain_of_seen<'a>(
    seen: impl Iterator<Item = &'a Seen>,
    (rays, way): (usize, usize),
    metric: usize,
    model: Option<usize>,
) -> f64 {
    let cost =
        |of: &Seen, way: usize| of.errors[rays][way][metric] * model.map_or(1.0, |model| of.times[rays][way][model]);
    geometric(seen.map(|of| cost(of, 0) / cost(of, way)))
}

/// A line for each place, number of rays and way.
fn of_seen(seen: &[Seen]) -> Table {
    let mut table = of_gains(["where", "rays", "with"]);
    for (place, is_closed) in [("rooms", true), ("in the open", false)] {
        for (number, rays) in RAYS.into_iter().enumerate() {
            for (way, name) in SEEN.into_iter().enumerate().skip(1) {
                let here = || seen.iter().filter(|of| of.is_closed == is_closed);
                let models = [Some(0), Some(1), None];
                let gains = models
                    .into_iter()
                    .flat_map(|model| [0, 1].map(|metric| gain_of_seen(here(), (number, way), metric, model)));
                table.row([place, &rays.to_string(), name], gains.map(times));
            }
        }
    }
    table
}

/// A line for each way and cost model.
fn of_passes(passes: &[Passes]) -> Table {
    let mut table = Table::new(["with", "costs"], ["absolute", "relative", "ns a point and a pass"]);
    let here = || passes.iter().filter(|of| of.place == PLACES[1]);
    for (way, (name, _)) in WAYS.into_iter().enumerate() {
        for (model, (costs, _)) in MODELS.into_iter().enumerate() {
            let gain = |metric: usize| {
                let cost = |of: &Passes, way: usize| METRICS[metric].1(&of.errors[way][0]) * of.times[way][model];
                times(geometric(here().map(|of| cost(of, 0) / cost(of, way))))
            };
            let ns = geometric(here().map(|of| of.times[way][model]));
            table.row([name, costs], [gain(0), gain(1), format!("{ns:.0}")]);
        }
    }
    table
}

/// A line for each place and region.
fn by_region(passes: &[Passes]) -> Table {
    let mut table = Table::new(["where", "region"], ["cells", MODELS[0].0, "worst", MODELS[1].0, "worst"]);
    for place in PLACES {
        for (region, name) in REGIONS.into_iter().enumerate().skip(1) {
            let gains =
                |model: usize| passes.iter().filter_map(move |of| of.gain(region, model).filter(|_| of.place == place));
            if gains(0).count() > 0 {
                let numbers = [0, 1].map(|model| [geometric(gains(model)), gains(model).fold(f64::INFINITY, f64::min)]);
                let count = gains(0).count().to_string();
                table.row([place, name], [count].into_iter().chain(numbers.concat().into_iter().map(times)));
            }
        }
    }
    table
}

/// In each metric and cost model.
fn gains_of_sum(of: &Several) -> impl Iterator<Item = f64> {
    let cost = |way: usize, metric: usize, model: usize| of.errors[way][metric] * of.times[way][model];
    let places = [0, 1].into_iter().flat_map(|metric| [0, 1].map(|model| (metric, model)));
    let gains: Vec<f64> = places.map(|(metric, model)| cost(0, metric, model) / cost(1, metric, model)).collect();
    gains.into_iter()
}

fn of_several(several: &[Several]) -> Table {
    let columns = METRICS.iter().flat_map(|(metric, _)| MODELS.map(|(costs, _)| format!("{metric}, {costs}")));
    let mut table = Table::new(["environments, material", "rays in all"], columns);
    for of in several {
        table.row([&of.name, &of.rays.to_string()], gains_of_sum(of).map(times));
    }
    table
}

/// A line for each cell.
fn each(cells: &[Cell]) -> Table {
    let ours = OURS.into_iter().flat_map(metrics);
    let mut table = Table::new(["scene", "light", "material"], ["visible".into()].into_iter().chain(ours));
    for cell in cells {
        let visible = format!("{:.1} %", 100.0 * cell.visible);
        let gains = OURS.into_iter().flat_map(|ours| {
            Scale::of_model(0)
                .map(|scale| over(cell, ours, RIVALS[0], 4, scale).map_or("-".into(), |gain| times(gain[0])))
        });
        table.row([&cell.scene, &cell.light, &cell.material], [visible].into_iter().chain(gains));
    }
    table
}
