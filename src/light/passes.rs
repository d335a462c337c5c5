//! A build in three passes that threads may share: where they keep what they find, and what is done. Each item of a pass (a row
//! of texels, then a cell, then a cell again) has elements of its own in every array that the pass writes; what a pass reads,
//! an earlier one wrote.

use super::blocks::Steps;
use super::build::{CellWork, full_lengths};
use super::decode::RowSummary;
use super::map;
use super::plan::Plan;
use super::strata;
use crate::object::{Layout, Part};

/// Rows of texels are decoded; grids of cells are chosen; tables of cells are written.
pub const PASSES: usize = 3;

/// How many items each pass has.
pub fn items(plan: &Plan) -> [u32; PASSES] {
    [plan.rows(), plan.cells(), plan.cells()]
}

/// The first words of a scratch block in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct Begun {
    magic: u64,
    fingerprint: u64,
}

impl Begun {
    /// Those of a build with this fingerprint.
    pub fn new(fingerprint: u64) -> Begun {
        Begun { magic: u64::from_le_bytes(*b"wis-lit\x02"), fingerprint }
    }
}

/// The largest luminance of a row, and the light of a cell, until that item is done.
pub const UNFINISHED: f64 = -1.0;
/// The level of a cell until its grids are chosen.
const UNCHOSEN: u64 = u64::MAX;

/// Where the arrays of a scratch block stand.
#[derive(Clone, Copy, Debug)]
pub struct Arrays {
    /// A [`RowSummary`] of each row.
    pub rows: Part,
    /// The colour of each row in each column of cells.
    pub rgb: Part,
    /// The weights of each row of patches.
    pub weights: Part,
    /// A [`CellWork`] for each cell.
    pub work: Part,
    /// The light of each block.
    pub block_light: Part,
    /// The luminance of each texel.
    pub luminance: Part,
    /// The grid of each block.
    pub steps: Part,
    /// The step of each tile of the texel map, cell by cell.
    pub tile_steps: Part,
    /// The light of each cell.
    pub cell_light: Part,
    /// Of the whole block.
    pub bytes: usize,
}

impl Arrays {
    /// The arrays of a build; `None` if no memory is as long.
    pub fn of(plan: &Plan) -> Option<Arrays> {
        let (rows, cells, blocks) = (u64::from(plan.rows()), u64::from(plan.cells()), full_lengths(plan).blocks as u64);
        // Sums of the strata stand there when all is decoded.
        let luminance = (rows * u64::from(plan.of.width)).max(strata::room(plan) as u64);
        let mut whole = Layout::behind::<Begun>();
        let arrays = Arrays {
            rows: whole.part::<RowSummary>(rows),
            rgb: whole.part::<[f64; 3]>(rows * u64::from(plan.grid[0])),
            weights: whole.part::<[f64; 2]>(plan.chart.axes[1].patches.into()),
            work: whole.part::<CellWork>(cells),
            block_light: whole.part::<f64>(blocks),
            luminance: whole.part::<f32>(luminance),
            steps: whole.part::<Steps>(blocks),
            tile_steps: whole.part::<u8>(map::tile_count(plan) as u64),
            cell_light: whole.part::<f64>(cells),
            bytes: 0,
        };
        Some(Arrays { bytes: whole.bytes()?, ..arrays })
    }
}

/// Marks all items as not done.
pub fn begin(rows: &mut [RowSummary], work: &mut [CellWork], cell_light: &mut [f64]) {
    rows.fill(RowSummary { brightest: UNFINISHED, ..RowSummary::default() });
    work.fill(CellWork { level: UNCHOSEN, ..CellWork::default() });
    cell_light.fill(UNFINISHED);
}

/// Whether all rows are decoded.
pub fn decoded(rows: &[RowSummary]) -> bool {
    rows.iter().all(|row| row.brightest != UNFINISHED)
}

/// Whether the grids of all cells are chosen.
pub fn chosen(work: &[CellWork]) -> bool {
    work.iter().all(|cell| cell.level != UNCHOSEN)
}

/// Whether the tables of all cells are written.
pub fn written(cell_light: &[f64]) -> bool {
    cell_light.iter().all(|light| *light != UNFINISHED)
}
