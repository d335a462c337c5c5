//! Tables of measured BRDFs as a client builds them: one tree for each elevation of the view, about the mirror direction.

use crate::client::{self, Tree};
use glam::{DVec3, Vec3, dvec3};

/// A table and its trees.
pub struct Table {
    slices: Vec<Tree>,
}

impl std::fmt::Debug for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "Table({} slices, {} bytes)", self.slices.len(), self.bytes())
    }
}

impl Table {
    /// Tabulates BRDF x cosine, a function of wo and wi in a frame whose normal is +z. A pixel is the mean of
    /// `places` x `places` values, and each slice is pruned to the error budget.
    ///
    /// # Errors
    /// Those of the library.
    pub fn new(
        slices: u32,
        depth: u32,
        error_budget: f32,
        places: u32,
        value: impl Fn(DVec3, DVec3) -> f64,
    ) -> client::Result<Table> {
        let build = |slice| {
            let pixels = pixels(slice, slices, depth, places, &value)?;
            Tree::new(depth, error_budget, &pixels)
        };
        Ok(Table::of((0..slices).map(build).collect::<client::Result<Vec<Tree>>>()?))
    }

    /// A table of trees.
    pub fn of(slices: Vec<Tree>) -> Table {
        Table { slices }
    }

    /// BRDF x cosine of a view for world directions.
    ///
    /// # Errors
    /// Those of the library.
    pub fn eval(&self, normal: Vec3, wo: Vec3, wi: &[[f32; 3]], f_cos: &mut [f32]) -> client::Result<()> {
        let (slices, weights, frame) = client::table_view(self.slices.len() as u32, normal.to_array(), wo.to_array())?;
        for (wi, f_cos) in wi.iter().zip(f_cos) {
            let point = client::square_point(*wi, Some(&frame))?;
            let mut sum = 0.0;
            for (slice, weight) in slices.into_iter().zip(weights) {
                let tree = &self.slices[slice as usize];
                sum += weight * tree.info.average * f64::from(tree.pdf(point)?);
            }
            *f_cos = sum as f32;
        }
        Ok(())
    }

    /// The slices.
    pub fn slices(&self) -> &[Tree] {
        &self.slices
    }

    /// The bytes of all trees.
    pub fn bytes(&self) -> usize {
        self.slices.iter().map(|slice| slice.info.bytes as usize).sum()
    }
}

/// The pixels of one slice.
///
/// # Errors
/// Those of the library.
pub fn pixels(
    slice: u32,
    slices: u32,
    depth: u32,
    places: u32,
    value: impl Fn(DVec3, DVec3) -> f64,
) -> client::Result<Vec<f32>> {
    let side = 1u32 << depth;
    let angle = (f64::from(slice) + 0.5) / f64::from(slices) * std::f64::consts::FRAC_PI_2;
    let wo = dvec3(angle.sin(), 0.0, angle.cos());
    let (.., frame) = client::table_view(slices, [0.0, 0.0, 1.0], wo.as_vec3().to_array())?;
    let along = |k: u32| (k as f32 + 0.5) / (side * places) as f32;
    let mut sums = vec![0.0f64; (side * side) as usize];
    for (row, column) in (0..side * places).flat_map(|row| (0..side * places).map(move |column| (row, column))) {
        let [x, y, z] = client::square_direction([along(row), along(column)], Some(&frame))?;
        let wi = dvec3(x.into(), y.into(), z.into()).normalize();
        sums[(row / places * side + column / places) as usize] += value(wo, wi) / f64::from(places * places);
    }
    Ok(sums.into_iter().map(|sum| sum as f32).collect())
}
