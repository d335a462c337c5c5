//! Wavelet importance sampling as Clarberg et al. 2005 have it: the map rotated to directions of a grid, and at a point the product of
//! the nearest of these trees and of the BRDF in its frame.

use crate::client::{self, Block, Density, Tree, Turn, raw};
use crate::environment::Environment;
use crate::processor;
use glam::{Mat3, Vec3};
use std::f32::consts::PI;
use std::sync::Mutex;

/// The paper's smaller table: directions along an axis of the grid, and log2 of the pixels along an axis of a tree.
const GRID: u32 = 64;
const DEPTH: u32 = 6;
/// The variance that pruning may add to a tree of map or BRDF.
pub const BUDGET: f32 = 0.01;
/// Where samples are weighed by their pdf, pixels of the map and of the BRDF are no darker than this share of their mean, or the pdf could
/// be 0.
pub const FLOOR: f32 = 0.02;
/// Places along an axis of a pixel over which a BRDF is averaged.
const PLACES: u32 = 2;

/// The frame of a direction: its columns in world space, the third the direction itself.
pub fn frame(direction: Vec3) -> Mat3 {
    let (x, y) = direction.any_orthonormal_pair();
    Mat3::from_cols(x, y, direction)
}

/// Row by row.
fn rows(frame: Mat3) -> [f32; 9] {
    frame.transpose().to_cols_array()
}

/// A map about a direction, in squares of `2^depth` pixels along each axis, for samples that are weighed by their pdf.
///
/// # Errors
/// Those of the library.
pub fn turned(environment: &Environment, direction: Vec3, depth: u32) -> client::Result<Tree> {
    turned_to(environment, depth, FLOOR, rows(frame(direction)))
}

fn turned_to(environment: &Environment, depth: u32, least: f32, world_from_tree: [f32; 9]) -> client::Result<Tree> {
    Tree::of_environment(environment.handle(), &Turn { depth, error_budget: BUDGET, least, world_from_tree })
}

/// The map about the directions of a grid, each made when it is asked for.
pub struct Rotations {
    /// The map.
    pub environment: Environment,
    depth: u32,
    floor: f32,
    trees: Vec<Mutex<Option<Tree>>>,
    /// The places of a BRDF in the frame of a square, pixel row by pixel row.
    places: Vec<Vec3>,
}

impl Rotations {
    /// Of a map, for samples that are weighed by their pdf.
    ///
    /// # Errors
    /// Those of the library.
    pub fn new(environment: Environment) -> client::Result<Rotations> {
        Rotations::of(environment, DEPTH, FLOOR)
    }

    /// Of a map in squares of `2^depth` pixels along each axis, for the paper's estimate: the integral times the share of samples that is
    /// seen.
    ///
    /// # Errors
    /// Those of the library.
    pub fn integrated(environment: Environment, depth: u32) -> client::Result<Rotations> {
        Rotations::of(environment, depth, 0.0)
    }

    fn of(environment: Environment, depth: u32, floor: f32) -> client::Result<Rotations> {
        let side = PLACES << depth;
        let along = |k: u32| (k as f32 + 0.5) / side as f32;
        let place = |i: u32| Ok(Vec3::from_array(client::square_direction([along(i / side), along(i % side)], None)?));
        let places = (0..side * side).map(place).collect::<client::Result<_>>()?;
        let trees = (0..GRID * GRID).map(|_| Mutex::default()).collect();
        Ok(Rotations { environment, depth, floor, trees, places })
    }

    /// The map in a frame.
    ///
    /// # Errors
    /// Those of the library.
    pub fn turned(&self, world_from_tree: [f32; 9]) -> client::Result<Tree> {
        turned_to(&self.environment, self.depth, self.floor, world_from_tree)
    }

    /// The product of the map and of BRDF x cosine, which `values` evaluates, about a direction.
    ///
    /// # Errors
    /// Those of the library.
    pub fn product(&self, about: Vec3, mut values: impl FnMut(&[[f32; 3]], &mut [f32])) -> client::Result<Product> {
        let (cells, weights) = client::grid_cells(GRID, about.to_array())?;
        let nearest = (0..4).max_by(|&a, &b| f32::total_cmp(&weights[a], &weights[b])).unwrap_or(0);
        let cell = cells[nearest];
        let frame = rows(frame(Vec3::from_array(client::grid_direction(GRID, cell)?)));
        let mut kept = self.trees[cell as usize].lock().expect("no thread panics");
        if kept.is_none() {
            *kept = Some(self.turned(frame)?);
        }
        let brdf = self.slice(&frame, &mut values)?;
        Product::new(kept.as_ref().expect("made above"), &brdf, frame)
    }

    /// BRDF x cosine over the square of a frame.
    ///
    /// # Errors
    /// Those of the library.
    pub fn slice(&self, frame: &[f32; 9], values: &mut impl FnMut(&[[f32; 3]], &mut [f32])) -> client::Result<Tree> {
        let world_from_tree = Mat3::from_cols_array(frame).transpose();
        let side = 1usize << self.depth;
        let row = side * PLACES as usize;
        let mut pixels = vec![0.0f32; side * side];
        let (mut wi, mut out) = (vec![[0.0; 3]; row], vec![0.0; row]);
        for (number, places) in self.places.chunks(row).enumerate() {
            wi.iter_mut().zip(places).for_each(|(wi, place)| *wi = (world_from_tree * *place).to_array());
            values(&wi, &mut out);
            let pixels = &mut pixels[number / PLACES as usize * side..][..side];
            for (pixel, out) in pixels.iter_mut().zip(out.chunks(PLACES as usize)) {
                *pixel += out.iter().sum::<f32>() / (PLACES * PLACES) as f32;
            }
        }
        let least = self.floor * pixels.iter().sum::<f32>() / pixels.len() as f32;
        pixels.iter_mut().for_each(|pixel| *pixel += least);
        Tree::new(self.depth, BUDGET, &pixels)
    }
}

/// The product at a point as a density of directions.
pub struct Product {
    /// Over the square.
    pub tree: Tree,
    frame: [f32; 9],
    /// The integral over all directions: what arrives if nothing is hidden.
    pub integral: f64,
    /// Processor seconds of the multiplication alone: map and BRDF are tables in the paper.
    pub seconds: f64,
}

impl Product {
    /// Of a map and a BRDF in one frame.
    ///
    /// # Errors
    /// Those of the library.
    pub fn new(map: &Tree, brdf: &Tree, frame: [f32; 9]) -> client::Result<Product> {
        let mut scratch = Block::new(0);
        let start = processor::seconds();
        let tree = map.multiply(brdf, None, &mut scratch)?;
        let seconds = processor::seconds() - start;
        let integral = tree.info.average * 4.0 * std::f64::consts::PI;
        Ok(Product { tree, frame, integral, seconds })
    }

    /// The directions of points, which the tree warps.
    ///
    /// # Errors
    /// Those of the library.
    pub fn warp(&self, u: &mut [[f32; 2]], wi: &mut Vec<Vec3>) -> client::Result<()> {
        let mut index: Vec<u32> = (0..u.len() as u32).collect();
        wi.clear();
        if self.integral > 0.0 {
            self.tree.warp(u, &mut index)?;
            for point in u.iter() {
                wi.push(Vec3::from_array(client::square_direction(*point, Some(&self.frame))?));
            }
        }
        Ok(())
    }
}

impl Density for Product {
    fn sample(&self, u: [f32; 2]) -> client::Result<raw::wis_drawn> {
        let (point, pdf) = self.tree.sample(u)?;
        Ok(raw::wis_drawn { wi: client::square_direction(point, Some(&self.frame))?, pdf: pdf / (4.0 * PI) })
    }

    fn pdf(&self, wi: [f32; 3]) -> client::Result<f32> {
        Ok(self.tree.pdf(client::square_point(wi, Some(&self.frame))?)? / (4.0 * PI))
    }

    fn invert(&self, wi: [f32; 3]) -> client::Result<[f32; 2]> {
        self.tree.invert(client::square_point(wi, Some(&self.frame))?)
    }
}
