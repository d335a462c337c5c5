//! An environment: light from every direction, as a tree over the octahedral square in map space.
//!
//! Two storages stand behind one interface: the exact pyramid, and a sparse tree pruned by an error budget.
//! On its own an environment samples directions in proportion to its luminance.

mod build;
mod flags;
pub mod info;
mod integrate;
mod object;
mod polygon;
mod refine;
pub mod request;
mod spread;

pub use crate::light::pixels::{Format, Layout, Pixels, RowSummary, Rows, check};
pub use build::{Config, Decoded, Grid, Row, Trees, complete, copy_kept, decode, integrate, plan, write_kept};
pub use flags::*;
pub use integrate::Texels;
pub use refine::{Refinement, refine};
pub use spread::{Refined, Spread};

use crate::numeric::ContentHash;
use crate::object::Magic;
use crate::wavelets::descent::Density;
use crate::wavelets::lanes::{LANES, Lanes};
use crate::wavelets::tree::{Link, Mark, Tree};
use crate::wavelets::wide::{ALL, GROUPS, Walker, WideDensity};
use bytemuck::{Pod, Zeroable};

/// How a tree is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// Every square: 16 bytes for each four cells, and a third more; and squares below some cells.
    Pyramid,
    /// The squares that an error budget keeps: 24 bytes each.
    Sparse,
}

/// The first bytes of an environment: what it is, and every number that is not per square.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Header {
    /// Marks an environment of this version.
    pub magic: u64,
    /// Bytes of the whole.
    pub bytes: u64,
    /// A hash of everything else.
    pub content_id: u64,
    /// Texels that were negative, or sanitised.
    pub sanitised: u64,
    /// The integral of luminance over the sphere, in the units of the input.
    pub power: f64,
    /// The variance that pruning adds, relative.
    pub error: f64,
    /// WIS_STORAGE_*.
    pub storage: u32,
    /// WIS_WAVELET_LIGHT_*.
    pub flags: u32,
    /// The square has 2^depth cells per axis.
    pub depth: u32,
    /// Squares stored.
    pub squares: u32,
    /// The stored values are the input's times `2^-exponent`; their mean is in [1, 2).
    pub exponent: i32,
    /// The stored average.
    pub average: f32,
    /// The stored average of RGB.
    pub rgb_average: [f32; 3],
    /// Squares below the cells of a pyramid.
    pub refined: u32,
    /// Always 0: with these it is a multiple of 16 bytes long.
    pub reserved: [u32; 2],
}

impl Magic for Header {
    const MAGIC: u64 = u64::from_le_bytes(*b"wis-env\x04");
}

/// An environment in the caller's memory.
#[derive(Clone, Copy)]
pub struct Environment<'a> {
    /// Every number that is not per square.
    pub header: &'a Header,
    /// Child averages of luminance.
    pub squares: &'a [[f32; 4]],
    /// The cells of a pyramid that are refined; empty if none is.
    pub marks: &'a [Mark],
    /// The links of sparse storage, or of the squares below the cells of a pyramid.
    pub links: &'a [Link],
    /// Child averages of RGB; empty if not built.
    pub rgb: &'a [[[f32; 3]; 4]],
}

impl<'a> Environment<'a> {
    /// The luminance.
    #[inline(always)]
    pub fn light(&self) -> Tree<'a, 4> {
        let &Header { depth, average, .. } = self.header;
        if self.marks.is_empty() {
            Tree::trusted(depth, average, self.squares, self.links)
        } else {
            Tree::trusted_refined(depth, average, self.squares, self.marks, self.links)
        }
    }

    /// The stored RGB average of child `c` of a square, or of the whole square.
    pub fn rgb(&self, place: Option<(u32, u32)>) -> [f32; 3] {
        match place {
            None => self.header.rgb_average,
            Some((square, c)) => {
                self.rgb.get(square as usize).and_then(|quad| quad.get(c as usize)).copied().unwrap_or([0.0; 3])
            }
        }
    }

    /// The hash of everything but the id itself.
    pub fn content_id(&self) -> u64 {
        let h = self.header;
        let mut hash = ContentHash::new();
        for word in [h.magic, h.bytes, h.sanitised, h.power.to_bits(), h.error.to_bits(), h.exponent as u64] {
            hash.add(word);
        }
        for word in [h.storage, h.flags, h.depth, h.squares, h.refined, h.average.to_bits()] {
            hash.add(word.into());
        }
        hash.add_floats(&h.rgb_average);
        for square in self.squares {
            hash.add_floats(square);
        }
        for mark in self.marks {
            hash.add(u64::from(mark.before) << 32 | u64::from(mark.bits));
        }
        for link in self.links {
            hash.add(u64::from(link.first) << 32 | u64::from(link.mask));
        }
        for colour in self.rgb.iter().flatten() {
            hash.add_floats(colour);
        }
        hash.finish()
    }
}

/// The environment's light as a density: constant within a cell.
#[derive(Clone, Copy)]
pub struct Light<'a>(pub Tree<'a, 4>);

impl Density for Light<'_> {
    fn is_positive(&self) -> bool {
        self.0.average() > 0.0
    }

    #[inline(always)]
    fn walk(&self, mut choose: impl FnMut([f32; 4]) -> Option<u32>) -> Option<[f32; 4]> {
        let mut square = self.0.root_square();
        while let Some(here) = square {
            let c = choose(self.0.children(here))?;
            square = self.0.child_square(here, c);
        }
        Some([1.0; 4])
    }
}

/// Eight places in a tree.
pub(crate) struct Descent<'a, F: Lanes> {
    tree: Tree<'a, 4>,
    squares: F::Index,
    /// The lanes that stand at a square, as bits.
    pub walks: u32,
}

impl<'a, F: Lanes> Descent<'a, F> {
    /// Starts at squares; those of lanes that are not in `walks` do not matter.
    #[inline(always)]
    pub fn from(tree: Tree<'a, 4>, squares: [u32; LANES], walks: u32) -> Self {
        let squares = F::select_index(F::mask(walks), F::index(squares), F::index([0; LANES]));
        Descent { tree, squares, walks }
    }

    /// The averages of the children, child by child.
    #[inline(always)]
    pub fn children(&self) -> [F; 4] {
        F::gather(self.tree.squares(), self.squares)
    }

    /// Goes to the children on the sides; lanes whose child is a cell stay and end there.
    #[inline(always)]
    pub fn step(&mut self, sides: [F::Mask; 2]) {
        let children = F::child(self.squares, sides);
        let in_heap = F::below(children, self.tree.heap());
        let walks = F::bits(in_heap) & self.walks;
        let leaving = self.walks & !walks;
        if leaving == 0 && walks == ALL {
            self.squares = children;
            return;
        }
        self.squares = F::select_index(F::mask(walks), children, self.squares);
        self.walks = walks;
        if leaving != 0 && !self.tree.links().is_empty() {
            self.leave(sides, F::numbers(children), leaving);
        }
    }

    /// Lanes that leave the heap, or are behind it, ask one by one.
    #[inline(always)]
    fn leave(&mut self, sides: [F::Mask; 2], children: [u32; LANES], leaving: u32) {
        let sides = [F::bits(sides[0]), F::bits(sides[1])];
        let mut squares = F::numbers(self.squares);
        for (i, (square, child)) in squares.iter_mut().zip(children).enumerate() {
            // Most cells of the heap are not refined.
            let asks = leaving >> i & 1 == 1 && self.tree.may_have(*square, child);
            let c = 2 * (sides[0] >> i & 1) + (sides[1] >> i & 1);
            if let Some(child) = asks.then(|| self.tree.child_square(*square, c)).flatten() {
                *square = child;
                self.walks |= 1 << i;
            }
        }
        self.squares = F::index(squares);
    }
}

impl WideDensity for Light<'_> {
    #[inline(always)]
    fn walk_wide<F: Lanes>(
        &self,
        walks: [u32; GROUPS],
        walkers: &mut [impl Walker<F>; GROUPS],
    ) -> [([F; 4], u32); GROUPS] {
        let tree = self.0;
        let starts = walks.map(|walks| if tree.root_square().is_some() { walks } else { 0 });
        let mut descents = starts.map(|starts| Descent::<F>::from(tree, [0; LANES], starts));
        let (mut levels, mut walks) = (0, true);
        while walks && levels < crate::wavelets::tree::MAX_REFINED {
            walks = false;
            for (descent, walker) in descents.iter_mut().zip(walkers.iter_mut()) {
                if descent.walks != 0 {
                    let sides = walker.choose(descent.walks, descent.children());
                    descent.step(sides);
                    walks |= descent.walks != 0;
                }
            }
            levels += 1;
        }
        descents.map(|descent| ([F::splat(1.0); 4], descent.walks))
    }
}
