//! What the tests of the tree modules share: vectors, reproducible random images, trees in `Vec`s.
#![allow(dead_code)]

pub use crate::support::Random;
use serde_json::Value;
use wis::wavelets::prune::{self, Pruning};
use wis::wavelets::tree::{self, Link, Tree};
use wis::wavelets::{image, morton, warp};

/// Rounding unit of `f32`.
pub const EPS: f64 = 1.0 / 16_777_216.0;

/// A file of tests/vectors.
pub fn vectors(file: &str) -> Value {
    let path = format!("{}/tests/vectors/{file}", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The cases of a file of tests/vectors.
pub fn cases(file: &str) -> Vec<Value> {
    vectors(file)["cases"].as_array().unwrap().clone()
}

pub fn integer(value: &Value) -> u32 {
    u32::try_from(value.as_u64().unwrap()).unwrap()
}

/// A number, or one of the strings "nan", "inf", "-inf".
pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| value.as_str().unwrap().parse().unwrap())
}

pub fn doubles(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(number).collect()
}

pub fn floats(value: &Value) -> Vec<f32> {
    doubles(value).iter().map(|&x| x as f32).collect()
}

pub fn array<const N: usize>(values: &[f64]) -> [f64; N] {
    values.try_into().unwrap()
}

impl Random {
    pub fn point<const N: usize>(&mut self) -> [f32; N] {
        std::array::from_fn(|_| self.unit())
    }

    /// A texel of a map with a high dynamic range, a quarter of them black.
    pub fn texel(&mut self) -> f32 {
        if self.unit() < 0.25 { 0.0 } else { (14.0 * self.unit() - 7.0).exp() }
    }

    pub fn image(&mut self, len: usize) -> Vec<f32> {
        (0..len).map(|_| self.texel()).collect()
    }

    /// An image in which most squares are constant.
    pub fn blocky<const N: usize>(&mut self, depth: u32) -> Vec<f32> {
        let mut image = vec![0.0; 1 << (N as u32 * depth)];
        self.fill_block::<N>(depth, depth, [0; N], &mut image);
        image
    }

    fn fill_block<const N: usize>(&mut self, depth: u32, size: u32, at: [u32; N], image: &mut [f32]) {
        if size > 0 && (size == depth || self.unit() < 0.5) {
            for c in 0..1u32 << N {
                let half = |axis: usize| ((c >> (N - 1 - axis)) & 1) << (size - 1);
                self.fill_block::<N>(depth, size - 1, std::array::from_fn(|axis| at[axis] + half(axis)), image);
            }
            return;
        }
        let value = self.texel();
        for cell in 0..1usize << (N as u32 * size) {
            let inner = morton::c_order_cell::<N>(cell, size);
            image[pixel_index::<N>(std::array::from_fn(|axis| at[axis] + inner[axis]), depth)] = value;
        }
    }
}

/// The position of a pixel in C order.
pub fn pixel_index<const N: usize>(t: [u32; N], depth: u32) -> usize {
    t.iter().fold(0, |index, &t| (index << depth) | t as usize)
}

/// The pixel that contains a point of the unit cube.
pub fn pixel_of<const N: usize>(point: [f32; N], depth: u32) -> [u32; N] {
    point.map(|y| warp::locate(y, depth).0)
}

/// The centre of each pixel, in C order.
pub fn centres<const N: usize>(depth: u32) -> impl Iterator<Item = [f32; N]> {
    let centre = move |i| morton::c_order_cell::<N>(i, depth).map(|t| warp::place(t, 0.5, depth));
    (0..1usize << (N as u32 * depth)).map(centre)
}

/// The same bits in every coordinate.
pub fn bits<const N: usize>(point: [f32; N]) -> [u32; N] {
    point.map(f32::to_bits)
}

/// A tree and its storage.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored<const C: usize> {
    pub depth: u32,
    /// Pixels are 2^exponent times the stored averages.
    pub exponent: i32,
    pub average: f32,
    pub squares: Vec<[f32; C]>,
    pub links: Vec<Link>,
}

impl<const C: usize> Stored<C> {
    /// The complete tree of an image in C order.
    pub fn complete<const N: usize>(depth: u32, pixels: &[f32]) -> Self {
        let mut squares = vec![[0.0; C]; tree::complete_len(C, depth).unwrap()];
        let scale = image::build::<N, C>(depth, pixels, &mut squares).unwrap();
        Stored { depth, exponent: scale.exponent, average: scale.average, squares, links: Vec::new() }
    }

    pub fn pruned(&self, budget: f64) -> (Self, Pruning) {
        let mut savings = vec![0.0; self.squares.len()];
        let pruning = prune::plan(&self.tree(), budget, &mut savings).unwrap();
        (self.keep(&savings, pruning.squares as usize), pruning)
    }

    /// The tree of the squares with positive savings, of which `count` have no dropped ancestor.
    pub fn keep(&self, savings: &[f64], count: usize) -> Self {
        let mut squares = vec![[0.0; C]; count];
        let mut links = vec![Link::default(); count];
        prune::write(&self.tree(), savings, &mut squares, &mut links).unwrap();
        Stored { squares, links, ..self.clone() }
    }

    pub fn tree(&self) -> Tree<'_, C> {
        if self.links.is_empty() && !self.squares.is_empty() {
            Tree::complete(self.depth, self.average, &self.squares).unwrap()
        } else {
            Tree::sparse(self.depth, self.average, &self.squares, &self.links).unwrap()
        }
    }

    /// The stored value at every pixel, C order, unscaled: the naive way, one walk per pixel.
    pub fn pixels<const N: usize>(&self) -> Vec<f64> {
        let (tree, scale) = (self.tree(), 2f64.powi(self.exponent));
        let value = |i| f64::from(value_at(&tree, morton::c_order_cell::<N>(i, self.depth))) * scale;
        (0..1usize << (N as u32 * self.depth)).map(value).collect()
    }
}

/// The stored value of the finest cell `t`.
pub fn value_at<const C: usize, const N: usize>(tree: &Tree<C>, t: [u32; N]) -> f32 {
    let mut value = tree.average();
    let mut square = tree.root_square();
    for bit in (0..tree.depth()).rev() {
        let Some(here) = square else { break };
        let c = t.iter().fold(0, |c, t| 2 * c + ((t >> bit) & 1));
        value = tree.children(here)[c as usize];
        square = tree.child_square(here, c);
    }
    value
}
