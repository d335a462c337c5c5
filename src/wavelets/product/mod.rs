//! The product of an environment and a BRDF x cosine at one shading point, as a density on the square.
//!
//! A rooted quadtree of world-space cells, refined where the product is large and varies. In a leaf the BRDF is
//! bilinear between its values at the corners, and the environment goes on down to its texels; a child's mass is
//! its light times the BRDF at its centre. Linear leaves have 2 to 6 times less variance than constant ones at
//! the same number of BRDF evaluations.

mod base;
mod build;
mod cells;
mod peak;
mod start;
mod weigh;

pub use build::{Budget, Built, build};
pub use cells::{Cell, Room, Scratch};

use crate::numeric::{inverse_power, max, select};
use crate::wavelets::descent::{Density, lerp};
use crate::wavelets::environment::Descent;
use crate::wavelets::lanes::{LANES, Lanes};
use crate::wavelets::tree::{MAX_DEPTH, NO_SQUARE, Tree};
use crate::wavelets::wide::{self, ALL, GROUPS, Walker, WideDensity};
use bytemuck::{Pod, Zeroable};

/// Set in a link that leads to a leaf.
const LEAF: u32 = 1 << 31;

/// No point of a leaf that reaches above the horizon is darker than this share of its largest corner.
const LEAF_FLOOR: f32 = 0.05;

/// A node of the tree: four numbers and four words.
///
/// A square, an inner node, holds the average products of its four children and their links: where they stand, with
/// `LEAF` set if they are leaves. A leaf, a cell in which the BRDF is bilinear but nowhere below its floor, holds BRDF x
/// cosine at its corners, which may be negative below the horizon; the environment's square for it, or [`NO_SQUARE`]; four
/// times the environment's square above it plus the child that contains it, or [`NO_SQUARE`]; its index along axis 1, plus
/// 2^16 times that along axis 2; and its level: it is one of 2^level cells along each axis.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Node {
    values: [f32; 4],
    links: [u32; 4],
}

impl Node {
    /// A leaf without light.
    const NOTHING: Node = Node { values: [0.0; 4], links: [NO_SQUARE, NO_SQUARE, 0, 0] };

    /// A leaf that is the whole square.
    const ROOT: Node = Node { values: [0.0; 4], links: [0, NO_SQUARE, 0, 0] };

    /// The environment's square for a leaf.
    #[inline(always)]
    fn square(&self) -> u32 {
        self.links[0]
    }

    /// The place of a leaf along both axes.
    #[inline(always)]
    fn index(&self) -> [u16; 2] {
        [self.links[2] as u16, (self.links[2] >> 16) as u16]
    }

    /// The level of a leaf.
    #[inline(always)]
    fn level(&self) -> u32 {
        self.links[3]
    }

    /// The centre of a leaf in the square.
    pub fn centre(&self) -> [f32; 2] {
        let width = inverse_power(self.level());
        self.index().map(|i| (f32::from(i) + 0.5) * width)
    }

    /// The environment's square above a leaf and the child that contains it; `None` for the whole square.
    pub fn light(&self) -> Option<(u32, u32)> {
        let light = self.links[1];
        if light == NO_SQUARE { None } else { Some((light / 4, light % 4)) }
    }
}

/// A product over its environment's tree.
#[derive(Clone, Copy)]
pub struct Product<'a> {
    /// The environment's tree.
    pub light: Tree<'a, 4>,
    /// Squares and leaves; the root first.
    pub nodes: &'a [Node],
    /// How many squares stand at the front; a later square q stands at node `4 q + 1`.
    pub base: u32,
    /// Squares.
    pub squares: u32,
    /// The average of the product over the square; 0 if there is nothing to sample.
    pub average: f32,
}

impl Product<'_> {
    /// Every leaf with its share of the average.
    pub fn shares(&self) -> impl Iterator<Item = (&Node, f32)> {
        let place = |square: u32| if square < self.base { square } else { square.wrapping_mul(4).wrapping_add(1) };
        let squares = (0..self.squares).filter_map(move |square| self.nodes.get(place(square) as usize));
        let linked = squares.flat_map(|square| square.links.into_iter().zip(square.values));
        linked.filter(|(link, _)| *link & LEAF != 0).filter_map(|(link, weight)| {
            let leaf = self.nodes.get((link & !LEAF) as usize)?;
            Some((leaf, weight * inverse_power(2 * leaf.level())))
        })
    }
}

/// A part of a leaf: the leaf's corners, where in the leaf the part lies, and its light.
#[derive(Clone, Copy)]
pub struct Part {
    corners: [f32; 4],
    floor: f32,
    origin: [f32; 2],
    size: f32,
    square: u32,
}

impl Part {
    /// A whole leaf.
    fn whole(leaf: &Node) -> Part {
        let [a, b, c, d] = leaf.values;
        let floor = LEAF_FLOOR * max(max(a, b), max(c, d));
        Part { corners: leaf.values, floor, origin: [0.0; 2], size: 1.0, square: leaf.square() }
    }

    /// The BRDF at (x0, y0), (x0, y1), (x1, y0), (x1, y1), in units of the part.
    #[inline(always)]
    fn values(&self, low: f32, high: f32) -> [f32; 4] {
        let [c00, c01, c10, c11] = self.corners;
        let [x, y] = self.origin;
        let (x0, x1) = (x + low * self.size, x + high * self.size);
        let (y0, y1) = (y + low * self.size, y + high * self.size);
        let (left0, right0) = (lerp(x0, c00, c10), lerp(x0, c01, c11));
        let (left1, right1) = (lerp(x1, c00, c10), lerp(x1, c01, c11));
        let (a, b) = (lerp(y0, left0, right0), lerp(y1, left0, right0));
        let (c, d) = (lerp(y0, left1, right1), lerp(y1, left1, right1));
        [max(a, self.floor), max(b, self.floor), max(c, self.floor), max(d, self.floor)]
    }

    /// The masses of the children: their light times the BRDF at their centres.
    #[inline(always)]
    fn masses(&self, light: [f32; 4]) -> [f32; 4] {
        let [f0, f1, f2, f3] = self.values(0.25, 0.75);
        let [l0, l1, l2, l3] = light;
        [l0 * f0, l1 * f1, l2 * f2, l3 * f3]
    }

    #[inline(always)]
    fn child(&self, c: u32, square: u32) -> Part {
        let size = 0.5 * self.size;
        let [x, y] = self.origin;
        let half = |upper: u32| select(upper == 1, size, 0.0);
        let origin = [x + half(c >> 1 & 1), y + half(c & 1)];
        Part { origin, size, square, ..*self }
    }
}

impl Density for Product<'_> {
    fn is_positive(&self) -> bool {
        self.average > 0.0
    }

    #[inline(always)]
    fn walk(&self, mut choose: impl FnMut([f32; 4]) -> Option<u32>) -> Option<[f32; 4]> {
        let (mut link, mut levels) = (0, 0);
        // A damaged tree may lead in circles.
        while link & LEAF == 0 && levels < MAX_DEPTH {
            let square = self.nodes.get(link as usize)?;
            link = *square.links.get(choose(square.values)? as usize)?;
            levels += 1;
        }
        let leaf = self.nodes.get((link & !LEAF) as usize)?;
        let mut part = Part::whole(leaf);
        while part.square != NO_SQUARE {
            let c = choose(part.masses(self.light.children(part.square)))?;
            part = part.child(c, self.light.child_square(part.square, c).unwrap_or(NO_SQUARE));
        }
        Some(part.values(0.0, 1.0))
    }
}

/// Parts of eight leaves.
struct Parts<F> {
    corners: [F; 4],
    floor: F,
    origin: [F; 2],
    size: F,
}

impl<F: Lanes> Parts<F> {
    /// Whole leaves.
    #[inline(always)]
    fn whole(corners: [F; 4]) -> Self {
        let [a, b, c, d] = corners;
        let floor = F::splat(LEAF_FLOOR) * a.max(b).max(c.max(d));
        Parts { corners, floor, origin: [F::splat(0.0); 2], size: F::splat(1.0) }
    }

    /// As [`Part::values`].
    #[inline(always)]
    fn values(&self, low: f32, high: f32) -> [F; 4] {
        let [c00, c01, c10, c11] = self.corners;
        let [x, y] = self.origin;
        let (low, high) = (F::splat(low) * self.size, F::splat(high) * self.size);
        let (x0, x1, y0, y1) = (x + low, x + high, y + low, y + high);
        let (left0, right0) = (wide::lerp(x0, c00, c10), wide::lerp(x0, c01, c11));
        let (left1, right1) = (wide::lerp(x1, c00, c10), wide::lerp(x1, c01, c11));
        let (a, b) = (wide::lerp(y0, left0, right0), wide::lerp(y1, left0, right0));
        let (c, d) = (wide::lerp(y0, left1, right1), wide::lerp(y1, left1, right1));
        [a.max(self.floor), b.max(self.floor), c.max(self.floor), d.max(self.floor)]
    }

    /// As [`Part::masses`].
    #[inline(always)]
    fn masses(&self, light: [F; 4]) -> [F; 4] {
        let [f0, f1, f2, f3] = self.values(0.25, 0.75);
        let [l0, l1, l2, l3] = light;
        [l0 * f0, l1 * f1, l2 * f2, l3 * f3]
    }

    /// As [`Part::child`], for the lanes that walk.
    #[inline(always)]
    fn step(&mut self, walks: u32, sides: [F::Mask; 2]) {
        let half = F::splat(0.5) * self.size;
        if walks == ALL {
            for axis in [0, 1] {
                self.origin[axis] = self.origin[axis] + F::only(sides[axis], half);
            }
            self.size = half;
            return;
        }
        let walks = F::mask(walks);
        for axis in [0, 1] {
            self.origin[axis] = self.origin[axis] + F::only(F::and(walks, sides[axis]), half);
        }
        self.size = F::select(walks, half, self.size);
    }
}

impl<'a> WideDensity for Product<'a> {
    #[inline(always)]
    fn walk_wide<F: Lanes>(
        &self,
        walks: [u32; GROUPS],
        walkers: &mut [impl Walker<F>; GROUPS],
    ) -> [([F; 4], u32); GROUPS] {
        let mut above = walks.map(|walks| Above::<F>::root(self, walks));
        let (mut levels, mut going) = (0, true);
        while going && levels < MAX_DEPTH {
            going = false;
            for (above, walker) in above.iter_mut().zip(walkers.iter_mut()) {
                if above.walks != 0 {
                    above.step(walker);
                    going |= above.walks != 0;
                }
            }
            levels += 1;
        }
        let mut below = above.map(|above| above.leaf());
        going = true;
        while going && levels < 2 * MAX_DEPTH {
            going = false;
            for (below, walker) in below.iter_mut().zip(walkers.iter_mut()) {
                let walks = below.descent.walks;
                if walks != 0 {
                    let sides = walker.choose(walks, below.parts.masses(below.descent.children()));
                    below.parts.step(walks, sides);
                    below.descent.step(sides);
                    going |= below.descent.walks != 0;
                }
            }
            levels += 1;
        }
        below.map(|below| (below.parts.values(0.0, 1.0), below.failed | below.descent.walks))
    }
}

/// Where eight lanes stand in the squares of a product.
struct Above<'p, 'a, F: Lanes> {
    product: &'p Product<'a>,
    links: F::Index,
    /// The lanes that stand at a square, as bits.
    walks: u32,
}

/// Where eight lanes stand below their leaves.
struct Below<'a, F: Lanes> {
    parts: Parts<F>,
    descent: Descent<'a, F>,
    failed: u32,
}

impl<'p, 'a, F: Lanes> Above<'p, 'a, F> {
    #[inline(always)]
    fn root(product: &'p Product<'a>, walks: u32) -> Self {
        let links = F::select_index(F::mask(walks), F::index([0; LANES]), F::index([u32::MAX; LANES]));
        Above { product, links, walks }
    }

    #[inline(always)]
    fn step(&mut self, walker: &mut impl Walker<F>) {
        // A damaged tree ends in a leaf that does not exist.
        const NOTHING: Node = Node { values: [0.0; 4], links: [u32::MAX; 4] };
        let mut squares = [&NOTHING; LANES];
        // Lanes that have arrived look at the root: whether a node exists is then always foreseen.
        let links = F::numbers(F::select_index(F::mask(self.walks), self.links, F::index([0; LANES])));
        for (square, link) in squares.iter_mut().zip(links) {
            *square = self.product.nodes.get(link as usize).unwrap_or(&NOTHING);
        }
        let [s1, s2] = walker.choose(self.walks, F::transpose(squares.map(|square| &square.values)));
        let [a, b, c, d] = F::transpose_index(squares.map(|square| &square.links));
        let next = F::select_index(s1, F::select_index(s2, d, c), F::select_index(s2, b, a));
        self.links = if self.walks == ALL { next } else { F::select_index(F::mask(self.walks), next, self.links) };
        self.walks = ALL & !F::highest_bits(self.links);
    }

    /// Goes on below the leaves.
    #[inline(always)]
    fn leaf(self) -> Below<'a, F> {
        let (mut leaves, mut failed) = ([&Node::NOTHING; LANES], self.walks);
        for (i, (slot, link)) in leaves.iter_mut().zip(F::numbers(self.links)).enumerate() {
            match self.product.nodes.get((link & !LEAF) as usize) {
                Some(leaf) => *slot = leaf,
                None => failed |= 1 << i,
            }
        }
        let squares = leaves.map(|leaf| leaf.square());
        let lit = ALL & !F::highest_bits(F::index(squares)) & !failed;
        Below {
            parts: Parts::whole(F::transpose(leaves.map(|leaf| &leaf.values))),
            descent: Descent::from(self.product.light, squares, lit),
            failed,
        }
    }
}
