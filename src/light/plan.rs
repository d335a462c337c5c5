//! What a map becomes: its patches, its cells and its blocks, from sizes and filter alone.

use super::chart::{Axis, Chart, Layout};
use crate::status::{Error, Status};

/// The longest side of a map, in texels.
pub const MAX_SIDE: u32 = 32768;

/// log2 of the most patches along a side of a block.
pub const BLOCK_SIDE: u32 = 4;

/// The fewest columns and rows of a face: below, a face is refined by a power of two, so that cells hold patches and the sine of
/// the polar angle is a parabola inside each.
const FEWEST: [u32; 2] = [16, 32];

/// Whether anything in this library reads exact tables.
const EXACT: bool = cfg!(any(feature = "products", feature = "checks"));

/// How the renderer looks a map up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// The texel that holds the direction.
    Nearest,
    /// Linear between texel centres along both axes.
    Bilinear,
}

/// What to build.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Description {
    /// How directions are laid out.
    pub layout: Layout,
    /// Texels in a row.
    pub width: u32,
    /// Rows; of a cube map all six faces.
    pub height: u32,
    /// How the renderer looks it up.
    pub filter: Filter,
    /// Lat-long: the first and the last row lie at the poles.
    pub rows_at_poles: bool,
    /// Black keeps the density 0.
    pub exact_zero: bool,
    /// max(L - mean, L / 64) in place of the luminance L (Karlik et al. 2019).
    pub compensated: bool,
    /// No products will be prepared with it: what only they read is left out.
    pub light_only: bool,
    /// Only rays will be drawn with it: the exact tables are left out too.
    pub rays_only: bool,
    /// The relative standard deviation of L / pdf that may be added; 0 keeps every patch.
    pub budget: f32,
}

impl Description {
    /// Of a map that is built without any of the switches.
    pub const fn new(layout: Layout, [width, height]: [u32; 2], filter: Filter, budget: f32) -> Description {
        Description {
            layout,
            width,
            height,
            filter,
            rows_at_poles: false,
            exact_zero: false,
            compensated: false,
            light_only: false,
            rays_only: false,
            budget,
        }
    }

    /// The same as far as this library reads it: without products and checks nobody reads exact tables, and none are built.
    pub fn as_read(self) -> Description {
        Description { rays_only: self.rays_only || !EXACT, ..self }
    }

    /// Whether exact tables are built and read.
    #[inline(always)]
    pub fn is_exact(&self) -> bool {
        EXACT && !self.rays_only
    }

    fn switches(&mut self) -> [&mut bool; 5] {
        let Description { rows_at_poles, exact_zero, compensated, light_only, rays_only, .. } = self;
        [rows_at_poles, exact_zero, compensated, light_only, rays_only]
    }

    /// The same with the switches of these flags on, each with a bit of its own.
    pub fn switched(mut self, flags: u32, bits: [u32; 5]) -> Description {
        self.switches().into_iter().zip(bits).for_each(|(switch, bit)| *switch = flags & bit != 0);
        self
    }

    /// The flags of the switches that are on.
    pub fn flags(mut self, bits: [u32; 5]) -> u32 {
        self.switches().into_iter().zip(bits).map(|(switch, bit)| if *switch { bit } else { 0 }).sum()
    }
}

/// Sizes that follow from a description.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// What is built.
    pub of: Description,
    /// Texels along columns and rows of one face.
    pub texels: [u32; 2],
    /// Patches for each texel, along each axis.
    pub refined: u32,
    /// Directions and positions.
    pub chart: Chart,
    /// Cells along columns and rows of all faces.
    pub grid: [u32; 2],
    /// The smallest block has 2^side patches along each axis.
    pub side: [u32; 2],
}

impl Plan {
    /// The plan of a description.
    ///
    /// # Errors
    /// [`Error`] names the field: [`Status::InvalidArgument`] for sides that do not fit the layout or a budget that is none,
    /// [`Status::Overflow`] for sides above [`MAX_SIDE`].
    pub fn new(of: &Description) -> Result<Plan, Error> {
        let faces = if of.layout == Layout::Cube { 6 } else { 1 };
        Error::first([
            (of.width > 0, c"width"),
            (of.height > 0 && of.layout.fits(of.width, of.height), c"height"),
            (!of.rows_at_poles || of.layout == Layout::LatLong, c"flags"),
            ((0.0..=1.0).contains(&of.budget), c"error_budget"),
        ])?;
        let texels = [of.width, of.height / faces];
        for (side, field) in texels.into_iter().zip([c"width", c"height"]) {
            if side > MAX_SIDE {
                return Err(Error::new(Status::Overflow, 0).of(field));
            }
        }
        // Rows at the poles are half rows: a row fewer.
        let at_poles = of.rows_at_poles && texels[1] > 1;
        let spans = [texels[0], texels[1] - u32::from(at_poles)];
        let mut refined = 1;
        while spans[0] * refined < FEWEST[0] || spans[1] * refined < FEWEST[1] {
            refined *= 2;
        }
        let latlong = of.layout == Layout::LatLong;
        let bilinear = of.filter == Filter::Bilinear;
        let axis = |k: usize| {
            // Whether the first and the last patch are half as wide as the others.
            let halves = if bilinear { !(latlong && (k == 0 || at_poles)) } else { at_poles && k == 1 };
            let between = halves && refined == 1;
            let length = spans[k] * refined;
            Axis { patches: length + u32::from(between), length: length as f32, shift: if between { 0.5 } else { 0.0 } }
        };
        let offset = if bilinear && latlong { 0.5 * refined as f32 } else { 0.0 };
        let chart = Chart { layout: of.layout, axes: [axis(0), axis(1)], offset };
        let face_grid = if of.layout == Layout::Cube { [4, 4] } else { [16, 8] };
        let side = [0, 1].map(|k: usize| {
            let fits = |s: &u32| chart.axes[k].patches.div_ceil(1 << s) >= face_grid[k];
            (0..=BLOCK_SIDE).rev().find(fits).unwrap_or(0)
        });
        Ok(Plan { of: *of, texels, refined, chart, grid: [face_grid[0], face_grid[1] * faces], side })
    }

    /// The same without compensation.
    pub fn plain(&self) -> Plan {
        Plan { of: Description { compensated: false, ..self.of }, ..*self }
    }

    /// Cells of all faces.
    pub fn cells(&self) -> u32 {
        self.grid[0] * self.grid[1]
    }

    /// Rows of texels of all faces.
    pub fn rows(&self) -> u32 {
        self.of.height
    }

    /// Cells along columns and rows of one face.
    pub fn face_grid(&self) -> [u32; 2] {
        [self.grid[0], self.grid[1] / self.chart.faces().max(1)]
    }

    /// The smallest blocks along an axis of a face.
    pub fn small_blocks(&self, axis: usize) -> u32 {
        self.chart.axes[axis].patches.div_ceil(1 << self.side[axis])
    }

    /// The small block with which cell `i` of a face begins along an axis.
    fn boundary(&self, axis: usize, i: u32) -> u32 {
        (u64::from(i) * u64::from(self.small_blocks(axis)) / u64::from(self.face_grid()[axis]).max(1)) as u32
    }

    /// The cell along an axis in which a small block of a face lies.
    pub fn cell_of(&self, axis: usize, small: u32) -> u32 {
        let n = self.face_grid()[axis];
        (0..n).rev().find(|&i| self.boundary(axis, i) <= small).unwrap_or(0)
    }

    /// The face of a cell, its first patch, and its patches along columns and rows.
    #[inline(never)]
    pub fn cell(&self, index: u32) -> (u32, [u32; 2], [u32; 2]) {
        let face_grid = self.face_grid();
        let (row, column) = (index / self.grid[0].max(1), index % self.grid[0].max(1));
        let at = [column, row % face_grid[1].max(1)];
        let edge = |k: usize, i: u32| (self.boundary(k, i) << self.side[k]).min(self.chart.axes[k].patches);
        let origin = [0, 1].map(|k: usize| edge(k, at[k]));
        (row / face_grid[1].max(1), origin, [0, 1].map(|k: usize| edge(k, at[k] + 1) - origin[k]))
    }

    /// How often the blocks of a cell can be doubled: the last level has a single block.
    pub fn levels(&self, patches: [u32; 2]) -> u32 {
        let along = |k: usize| patches[k].div_ceil(1 << self.side[k]).next_power_of_two().trailing_zeros();
        along(0).max(along(1))
    }

    /// log2 of the patches along a side of a cell's blocks that were doubled `level` times.
    pub fn block_side(&self, level: u32) -> [u32; 2] {
        self.side.map(|s| s + level)
    }
}
