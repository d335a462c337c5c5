//! The table of functions that are fuzzed: a function of the headers without a row fails, and so does a row that never succeeds.

use crate::case::Case;
use crate::laws;
use crate::oracle::Verdict;
use crate::pool::Pool;

/// A function of the headers.
pub struct Row {
    pub name: &'static str,
    /// How often it is drawn.
    pub share: usize,
    /// The query that tells how long its blocks must be.
    pub size: Option<&'static str>,
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

    const fn sized(mut self, query: &'static str) -> Row {
        self.size = Some(query);
        self
    }

    const fn law(mut self, law: fn(&Case) -> Verdict) -> Row {
        self.law = Some(law);
        self
    }
}

const fn row(name: &'static str) -> Row {
    Row { name, share: 4, size: None, law: None }
}

/// The row of a function that is no more: it is drawn and not called, so that older words give what they gave.
const GONE: Row = row("");

impl Row {
    /// Whether there is such a function, and all that it needs.
    pub fn is_possible(&self, pool: &Pool) -> bool {
        !self.name.is_empty() && needs(self.name).iter().all(|kind| !pool.of(kind).is_empty())
    }
}

/// The rows of functions that there are.
pub fn current() -> impl Iterator<Item = &'static Row> {
    ROWS.iter().filter(|row| !row.name.is_empty())
}

pub fn of(name: &str) -> &'static Row {
    current().find(|row| row.name == name).unwrap_or_else(|| panic!("{name} has no row"))
}

/// Kinds of objects that a call needs.
fn needs(name: &str) -> &'static [&'static str] {
    match name {
        "wis_environment_open" | "wis_environment_turn" | "wis_environment_describe" | "wis_base" => {
            &["wis_environment"]
        }
        "wis_sampler_begin_pixel" | "wis_sampler_fault" => &["wis_sampler"],
        "wis_visibility_cache_end_pass" => &["wis_visibility_cache"],
        "wis_direct" | "wis_direct_wave" | "wis_check" | "wis_check_point" | "wis_product_prepare" => {
            &["wis_sampler", "wis_environment"]
        }
        "wis_product_open" | "wis_product_describe" | "wis_product_covers" => &["wis_product", "wis_environment"],
        "wis_sample" | "wis_pdf" | "wis_invert" => &["wis_product", "wis_environment", "wis_sampler"],
        "wis_jitter_open" | "wis_jitter_sample" | "wis_jitter_pdf" => &["wis_jitter"],
        "wis_visibility_open" | "wis_visibility_integral" | "wis_visibility_product_integral" => {
            &["wis_visibility", "wis_tree"]
        }
        "wis_tree_size" | "wis_tree_init" => &[],
        name if name.starts_with("wis_tree_")
            || name.starts_with("wis_triple")
            || name.starts_with("wis_visibility_") =>
        {
            &["wis_tree"]
        }
        "wis_warp_in_place" => &["wis_tree"],
        _ => &[],
    }
}

pub const ROWS: &[Row] = &[
    row("wis_status_string").seldom(),
    row("wis_version").seldom(),
    row("wis_environment_size").law(laws::aligned),
    row("wis_environment_init").sized("wis_environment_size"),
    row("wis_environment_begin").sized("wis_environment_size"),
    row("wis_environment_run").often().sized("wis_environment_size"),
    row("wis_environment_finish").sized("wis_environment_size"),
    row("wis_environment_open").often(),
    row("wis_environment_describe"),
    row("wis_environment_turn"),
    row("wis_sampler_size").law(laws::aligned),
    row("wis_sampler_init").sized("wis_sampler_size"),
    row("wis_sampler_begin_pixel"),
    row("wis_sampler_fault"),
    row("wis_material_init"),
    row("wis_visibility_cache_size").law(laws::aligned),
    row("wis_visibility_cache_init").sized("wis_visibility_cache_size"),
    row("wis_visibility_cache_record"),
    row("wis_visibility_cache_end_pass"),
    row("wis_visibility_key").law(laws::key),
    row("wis_direct").often().law(laws::rays),
    row("wis_direct_wave").often(),
    row("wis_product_size").law(laws::aligned),
    row("wis_product_prepare").often().sized("wis_product_size"),
    row("wis_product_describe"),
    row("wis_product_covers").law(laws::yes_or_no),
    row("wis_sample").often().law(laws::drawn_by_light),
    row("wis_pdf").often().law(laws::densities),
    row("wis_invert").often().law(laws::inverted),
    row("wis_check").seldom(),
    GONE.law(laws::aligned),
    GONE,
    row("wis_pixel_seed").seldom(),
    row("wis_points_hammersley").law(laws::points),
    row("wis_points_sobol").law(laws::points),
    row("wis_strata_size").law(laws::aligned),
    row("wis_strata_lights").sized("wis_strata_size"),
    row("wis_jitter_size").law(laws::aligned),
    row("wis_jitter_init").sized("wis_jitter_size"),
    row("wis_jitter_sample").law(laws::jittered),
    row("wis_jitter_pdf").law(laws::densities),
    row("wis_strata_order").law(laws::permutation),
    GONE,
    GONE.seldom(),
    GONE.often(),
    GONE,
    GONE,
    GONE.often(),
    GONE,
    GONE,
    GONE.often(),
    GONE.often(),
    GONE.often(),
    row("wis_tree_size").law(laws::aligned),
    row("wis_tree_init").often().sized("wis_tree_size"),
    row("wis_tree_open").often(),
    GONE,
    row("wis_tree_product_integral"),
    row("wis_tree_sample").law(laws::in_tree),
    row("wis_tree_pdf").law(laws::densities),
    row("wis_tree_invert"),
    row("wis_warp_in_place"),
    GONE,
    GONE,
    GONE,
    GONE,
    GONE,
    GONE,
    GONE,
    row("wis_triple_terms"),
    GONE,
    GONE,
    GONE,
    GONE,
    GONE,
    GONE,
    GONE,
    GONE,
    GONE,
    GONE,
    GONE,
    row("wis_triple_integral"),
    row("wis_triple_select"),
    GONE,
    row("wis_triple_sublinear"),
    row("wis_triple_blend"),
    row("wis_visibility_size").law(laws::aligned),
    row("wis_visibility_init").sized("wis_visibility_size"),
    row("wis_visibility_open"),
    row("wis_visibility_integral"),
    row("wis_visibility_product_integral"),
    GONE,
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
