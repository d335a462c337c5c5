//! The functions that are fuzzed, in the order of the headers: all of them. One that never succeeds fails the run.

use crate::case::Case;
use crate::header::{Function, Headers};
use crate::laws;
use crate::oracle::Verdict;
use crate::pool::KINDS;
use crate::world::World;
use std::sync::LazyLock;

/// A function of the headers.
pub struct Row {
    pub name: String,
    /// How often it is drawn.
    pub share: usize,
    /// What must hold between its results.
    pub law: Option<fn(&Case) -> Verdict>,
}

pub static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| {
    let names = Headers::read().functions.into_iter().map(|function| function.name);
    names.map(|name| Row { share: share(&name), law: law(&name), name }).collect()
});

fn share(name: &str) -> usize {
    match name {
        // A sentence, a number, and checks that cost a thousand times as much as a look-up.
        "wis_status_string" | "wis_version" | "wis_check" => 1,
        "wis_environment_run"
        | "wis_environment_open"
        | "wis_direct"
        | "wis_direct_wave"
        | "wis_product_prepare"
        | "wis_product_open"
        | "wis_sample"
        | "wis_pdf"
        | "wis_invert"
        | "wis_tree_init"
        | "wis_tree_open" => 8,
        _ => 4,
    }
}

fn law(name: &str) -> Option<fn(&Case) -> Verdict> {
    Some(match name {
        "wis_visibility_key" => laws::key,
        "wis_direct" => laws::rays,
        "wis_product_covers" => laws::yes_or_no,
        "wis_sample" => laws::drawn_by_light,
        "wis_invert" => laws::inverted,
        "wis_points_sobol" => laws::points,
        "wis_jitter_sample" => laws::jittered,
        "wis_strata_order" => laws::permutation,
        "wis_tree_sample" => laws::in_tree,
        "wis_grid_cells" => laws::weights,
        _ if name.ends_with("_pdf") => laws::densities,
        _ if name.ends_with("_size") => laws::aligned,
        _ => return None,
    })
}

impl Row {
    /// Whether all that a function needs is there.
    pub fn is_possible(&self, world: &World) -> bool {
        needs(world.function(&self.name)).all(|kind| !world.pool.of(kind).is_empty())
    }
}

/// Kinds of objects that a call takes, opens or turns.
fn needs(function: &Function) -> impl Iterator<Item = &'static str> {
    KINDS.into_iter().filter(|kind| match *kind {
        "wis_material" => false,
        "wis_environment" if function.name == "wis_environment_turn" => true,
        kind => {
            function.name.strip_suffix("_open") == Some(kind) || function.parameters.iter().any(|p| p.pointee == kind)
        }
    })
}
