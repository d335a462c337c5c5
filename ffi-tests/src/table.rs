//! Tables of measured BRDFs as a client builds them: one tree for each elevation of the view, about the mirror direction.

use crate::client::{self, Tree, raw};
use glam::{DVec3, dvec3};

/// A table and its trees.
pub struct Table {
    slices: Vec<Tree>,
    handles: Vec<*const raw::wis_tree>,
}

// SAFETY: the trees are never changed once they are built, and the handles point to their memory on the heap.
unsafe impl Send for Table {}
// SAFETY: as above.
unsafe impl Sync for Table {}

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
        let handles = slices.iter().map(Tree::handle).collect();
        Table { slices, handles }
    }

    /// As the library takes it.
    pub fn raw(&self) -> raw::wis_wavelet_table {
        raw::wis_wavelet_table {
            size: size_of::<raw::wis_wavelet_table>() as u32,
            slice_count: self.handles.len() as u32,
            slice: self.handles.as_ptr(),
            colour: [std::ptr::null(); 3],
        }
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
    let mut sums = vec![0.0f64; 1 << (2 * depth)];
    for place in 0..places * places {
        let offset = [place / places, place % places].map(|k| (k as f32 + 0.5) / places as f32);
        let (wo, wi) = client::table_directions(slice, slices, depth, offset)?;
        let double = |v: [f32; 3]| dvec3(v[0].into(), v[1].into(), v[2].into()).normalize();
        for (sum, wi) in sums.iter_mut().zip(wi) {
            *sum += value(double(wo), double(wi)) / f64::from(places * places);
        }
    }
    Ok(sums.into_iter().map(|sum| sum as f32).collect())
}
