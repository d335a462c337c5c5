//! The table of functions that are fuzzed: a function of the headers without a row fails, and so does a row that never succeeds.

use crate::case::Case;
use crate::header::Function;
use crate::laws;
use crate::oracle::Verdict;
use crate::pool::KINDS;
use crate::world::World;
use std::sync::LazyLock;

/// A function of the headers.
#[derive(Clone, Copy)]
pub struct Row {
    pub name: &'static str,
    /// Rows that it stands for.
    rows: usize,
    /// How often it is drawn.
    pub share: usize,
    /// What must hold between its results.
    pub law: Option<fn(&Case) -> Verdict>,
}

impl Row {
    const fn often(mut self) -> Row {
        self.share = 8;
        self
    }

    /// Builds and checks that cost a thousand times as much as a look-up.
    const fn seldom(mut self) -> Row {
        self.share = 1;
        self
    }

    const fn law(mut self, law: fn(&Case) -> Verdict) -> Row {
        self.law = Some(law);
        self
    }
}

const fn row(name: &'static str) -> Row {
    Row { name, rows: 1, share: 4, law: None }
}

/// The rows of functions that are no more, and how often all of them are drawn: they are not called, and older words give what they gave.
const fn gone(rows: usize, share: usize) -> Row {
    Row { name: "", rows, share, law: None }
}

impl Row {
    /// Whether all that a function needs is there.
    pub fn is_possible(&self, world: &World) -> bool {
        !self.name.is_empty() && needs(world.function(self.name)).all(|kind| !world.pool.of(kind).is_empty())
    }
}

/// The rows of functions that there are.
pub fn current() -> impl Iterator<Item = &'static Row> {
    ROWS.iter().filter(|row| !row.name.is_empty())
}

/// Kinds of objects that a call takes, opens or turns.
fn needs(function: &Function) -> impl Iterator<Item = &'static str> {
    KINDS.into_iter().filter(|kind| match *kind {
        "wis_material" => false,
        // Calls on visibility come when there are trees: older words give what they gave.
        "wis_tree" if function.name.starts_with("wis_visibility_") => true,
        "wis_environment" if function.name == "wis_environment_turn" => true,
        kind => {
            function.name.strip_suffix("_open") == Some(kind) || function.parameters.iter().any(|p| p.pointee == kind)
        }
    })
}

/// One row after the other: of those that are gone, the first has all of their share.
pub static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| {
    let each = |row: &'static Row| (0..row.rows).map(|k| Row { share: if k == 0 { row.share } else { 0 }, ..*row });
    TABLE.iter().flat_map(each).collect()
});

const TABLE: &[Row] = &[
    row("wis_status_string").seldom(),
    row("wis_version").seldom(),
    row("wis_environment_size").law(laws::aligned),
    row("wis_environment_init"),
    row("wis_environment_begin"),
    row("wis_environment_run").often(),
    row("wis_environment_finish"),
    row("wis_environment_open").often(),
    row("wis_environment_describe"),
    row("wis_environment_turn"),
    row("wis_sampler_size").law(laws::aligned),
    row("wis_sampler_init"),
    row("wis_sampler_begin_pixel"),
    row("wis_sampler_fault"),
    row("wis_material_init"),
    row("wis_visibility_cache_size").law(laws::aligned),
    row("wis_visibility_cache_init"),
    row("wis_visibility_cache_record"),
    row("wis_visibility_cache_end_pass"),
    row("wis_visibility_key").law(laws::key),
    row("wis_direct").often().law(laws::rays),
    row("wis_direct_wave").often(),
    row("wis_product_size").law(laws::aligned),
    row("wis_product_prepare").often(),
    row("wis_product_describe"),
    row("wis_product_covers").law(laws::yes_or_no),
    row("wis_sample").often().law(laws::drawn_by_light),
    row("wis_pdf").often().law(laws::densities),
    row("wis_invert").often().law(laws::inverted),
    row("wis_check").seldom(),
    gone(4, 13),
    row("wis_points_sobol").law(laws::points),
    row("wis_strata_size").law(laws::aligned),
    row("wis_strata_lights"),
    row("wis_jitter_size").law(laws::aligned),
    row("wis_jitter_init"),
    row("wis_jitter_sample").law(laws::jittered),
    row("wis_jitter_pdf").law(laws::densities),
    row("wis_strata_order").law(laws::permutation),
    gone(11, 61),
    row("wis_tree_size").law(laws::aligned),
    row("wis_tree_init").often(),
    row("wis_tree_open").often(),
    gone(1, 4),
    row("wis_tree_product_integral"),
    row("wis_tree_sample").law(laws::in_tree),
    row("wis_tree_pdf").law(laws::densities),
    row("wis_tree_invert"),
    row("wis_warp_in_place"),
    gone(7, 28),
    row("wis_triple_terms"),
    gone(11, 44),
    row("wis_triple_integral"),
    row("wis_triple_select"),
    gone(1, 4),
    row("wis_triple_sublinear"),
    row("wis_triple_blend"),
    row("wis_visibility_size").law(laws::aligned),
    row("wis_visibility_init"),
    row("wis_visibility_open"),
    row("wis_visibility_integral"),
    row("wis_visibility_product_integral"),
    gone(1, 4),
    row("wis_grid_cells").law(laws::weights),
    // Functions that came later: replays of older cases end above.
    row("wis_product_open").often(),
    row("wis_jitter_open"),
    row("wis_check_point"),
    row("wis_base"),
    row("wis_table_view"),
    row("wis_square_direction"),
    row("wis_square_point"),
    row("wis_sparse_pack"),
    row("wis_sparse_unpack"),
];
