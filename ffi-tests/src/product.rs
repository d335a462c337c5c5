//! Wavelet importance sampling as Clarberg et al. 2005 have it: the map rotated to directions of a grid, and at a point the product of
//! the nearest of these trees and of the BRDF in its frame.

use crate::client::{self, Block, Density, Tree, Turn, raw};
use crate::environment::Environment;
use glam::{Mat3, Vec3};
use std::f32::consts::PI;
use std::sync::Mutex;

/// The paper's smaller table: directions along an axis of the grid, and log2 of the pixels along an axis of a tree.
const GRID: u32 = 64;
const DEPTH: u32 = 6;
/// The variance that pruning may add to a rotated map.
const BUDGET: f32 = 0.001;
/// Pixels of the map and of the BRDF are no darker than this share of their mean, so that the product's pdf is above 0.
const FLOOR: f32 = 0.02;
/// Places along an axis of a pixel over which a BRDF is averaged.
const PLACES: u32 = 2;

/// Row by row, the frame of a direction, which is its third axis.
pub fn frame(direction: Vec3) -> [f32; 9] {
    let (x, y) = direction.any_orthonormal_pair();
    Mat3::from_cols(x, y, direction).transpose().to_cols_array()
}

/// The map about the directions of a grid, each made when it is asked for.
pub struct Rotations {
    /// The map.
    pub environment: Environment,
    trees: Vec<Mutex<Option<Tree>>>,
}

impl Rotations {
    /// Of a map.
    pub fn new(environment: Environment) -> Rotations {
        Rotations { environment, trees: (0..GRID * GRID).map(|_| Mutex::default()).collect() }
    }

    /// The product of the map and of BRDF x cosine, which `values` evaluates, about a direction.
    ///
    /// # Errors
    /// Those of the library.
    pub fn product(&self, about: Vec3, mut values: impl FnMut(&[[f32; 3]], &mut [f32])) -> client::Result<Product> {
        let (cells, weights) = client::grid_cells(GRID, about.to_array())?;
        let nearest = (0..4).max_by(|&a, &b| f32::total_cmp(&weights[a], &weights[b])).unwrap_or(0);
        let cell = cells[nearest];
        let frame = frame(Vec3::from_array(client::grid_direction(GRID, cell)?));
        let mut kept = self.trees[cell as usize].lock().expect("no thread panics");
        if kept.is_none() {
            let turn = Turn { depth: DEPTH, error_budget: BUDGET, least: FLOOR, world_from_tree: frame };
            *kept = Some(Tree::of_environment(self.environment.handle(), &turn)?);
        }
        let brdf = slice(&frame, &mut values)?;
        let tree = kept.as_ref().expect("made above").multiply(&brdf, None, &mut Block::new(0))?;
        Ok(Product { tree, frame })
    }
}

/// BRDF x cosine over the square of a frame.
fn slice(frame: &[f32; 9], values: &mut impl FnMut(&[[f32; 3]], &mut [f32])) -> client::Result<Tree> {
    let side = 1u32 << DEPTH;
    let along = |k: u32| (k as f32 + 0.5) / (side * PLACES) as f32;
    let mut pixels = vec![0.0f32; (side * side) as usize];
    let (mut wi, mut out) = (vec![[0.0; 3]; (side * PLACES) as usize], vec![0.0; (side * PLACES) as usize]);
    for row in 0..side * PLACES {
        for (column, wi) in (0..).zip(&mut wi) {
            *wi = client::square_direction([along(row), along(column)], Some(frame))?;
        }
        values(&wi, &mut out);
        let pixels = &mut pixels[(row / PLACES * side) as usize..][..side as usize];
        for (pixel, out) in pixels.iter_mut().zip(out.chunks(PLACES as usize)) {
            *pixel += out.iter().sum::<f32>() / (PLACES * PLACES) as f32;
        }
    }
    let least = FLOOR * pixels.iter().sum::<f32>() / pixels.len() as f32;
    pixels.iter_mut().for_each(|pixel| *pixel += least);
    Tree::new(DEPTH, 0.0, &pixels)
}

/// The product at a point as a density of directions.
pub struct Product {
    /// Over the square.
    pub tree: Tree,
    frame: [f32; 9],
}

impl Density for Product {
    fn sample(&self, u: [f32; 2]) -> client::Result<raw::wis_drawn> {
        let (point, pdf) = self.tree.sample(u)?;
        Ok(raw::wis_drawn { wi: client::square_direction(point, Some(&self.frame))?, pdf: pdf / (4.0 * PI) })
    }

    fn sample_n(&self, u: &[[f32; 2]], wi: &mut [[f32; 3]], pdf: &mut [f32]) -> client::Result<()> {
        for ((u, wi), pdf) in u.iter().zip(wi).zip(pdf) {
            let drawn = self.sample(*u)?;
            (*wi, *pdf) = (drawn.wi, drawn.pdf);
        }
        Ok(())
    }

    fn pdf(&self, wi: [f32; 3]) -> client::Result<f32> {
        Ok(self.tree.pdf(client::square_point(wi, Some(&self.frame))?)? / (4.0 * PI))
    }

    fn pdf_n(&self, wi: &[[f32; 3]], pdf: &mut [f32]) -> client::Result<()> {
        wi.iter().zip(pdf).try_for_each(|(wi, pdf)| {
            *pdf = self.pdf(*wi)?;
            Ok(())
        })
    }

    fn invert(&self, wi: [f32; 3]) -> client::Result<[f32; 2]> {
        self.tree.invert(client::square_point(wi, Some(&self.frame))?)
    }
}
