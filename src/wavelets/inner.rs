//! Exact averages of the product of two stored trees, and the product as something that the warp can descend.
//!
//! The product's average on a square is not the product of the averages: a_E a_F misses the inner product of all
//! details inside it (Clarberg et al. 2005, Section 4.3), and two complementary checkerboards would give 1/4
//! instead of 0. One bottom-up pass over the squares that both trees keep sums the exact averages themselves,
//! which is that a_E a_F + D without its cancellation. Where one tree ends it is constant, and the other alone
//! decides.
//!
//! E has n axes and F the first m <= n of them; F is constant along the rest.

use crate::numeric;
use crate::status::{Result, Status};
use crate::wavelets::tree::{MAX_DEPTH, Tree};
use crate::wavelets::warp::Hierarchy;

/// The product of two trees with its exact averages.
#[derive(Clone, Copy, Debug)]
pub struct Product<'a, const C: usize, const M: usize> {
    e: Tree<'a, C>,
    f: Tree<'a, M>,
    averages: &'a [f64],
    average: f64,
}

/// A square of E with the square of F above it, where the trees have one; at least one of the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node {
    e: Option<u32>,
    f: Option<u32>,
}

/// The integral of the product of two trees over the unit cube: exact but for the rounding of `f64` sums. Needs
/// no memory; costs one visit of each square that both trees keep.
pub fn integral<const C: usize, const M: usize>(e: &Tree<C>, f: &Tree<M>) -> f64 {
    average_squares(e, f, |_, _| ())
}

impl<'a, const C: usize, const M: usize> Product<'a, C, M> {
    /// Computes the averages of the product. `averages` has one entry per square of E; those where F has no
    /// square are not written.
    ///
    /// # Errors
    /// [`Status::InvalidArgument`] if `averages` is not as long as the squares of E.
    pub fn new(e: Tree<'a, C>, f: Tree<'a, M>, averages: &'a mut [f64]) -> Result<Self> {
        if averages.len() != e.squares().len() {
            return Err(Status::InvalidArgument);
        }
        let average = average_squares(&e, &f, |square, average| {
            if let Some(slot) = averages.get_mut(square as usize) {
                *slot = average;
            }
        });
        Ok(Product { e, f, averages, average })
    }

    /// The integral of the product over the unit cube.
    #[inline]
    pub fn average(&self) -> f64 {
        self.average
    }

    fn product_masses(&self, e: u32, f: u32) -> [f32; C] {
        let (e_children, f_children) = (self.e.children(e), self.f.children(f));
        let scale = numeric::exp2i(-numeric::exponent(self.stored(e)));
        let mut masses = [0.0; C];
        for (c, (mass, e_average)) in masses.iter_mut().zip(e_children).enumerate() {
            let average = match (self.e.child_square(e, c as u32), self.f.child_square(f, f_child::<C, M>(c as u32))) {
                (Some(e_child), Some(_)) => self.stored(e_child),
                _ => f64::from(e_average) * f64::from(f_children[f_child::<C, M>(c as u32) as usize & (M - 1)]),
            };
            *mass = relative_mass(average, scale);
        }
        masses
    }

    fn stored(&self, e_square: u32) -> f64 {
        self.averages.get(e_square as usize).copied().unwrap_or(0.0)
    }
}

impl<const C: usize, const M: usize> Hierarchy<C> for Product<'_, C, M> {
    type Node = Node;

    fn depth(&self) -> u32 {
        self.e.depth().max(self.f.depth())
    }

    fn has_mass(&self) -> bool {
        self.average > 0.0
    }

    fn root(&self) -> Option<Node> {
        node(self.e.root_square(), self.f.root_square())
    }

    #[inline]
    fn masses(&self, node: Node) -> [f32; C] {
        match (node.e, node.f) {
            (Some(e), Some(f)) => self.product_masses(e, f),
            (Some(e), None) => self.e.children(e),
            (None, Some(f)) => {
                let children = self.f.children(f);
                core::array::from_fn(|c| children[f_child::<C, M>(c as u32) as usize & (M - 1)])
            }
            (None, None) => [0.0; C],
        }
    }

    #[inline]
    fn child(&self, parent: Node, c: u32) -> Option<Node> {
        let e = parent.e.and_then(|e| self.e.child_square(e, c));
        let f = parent.f.and_then(|f| self.f.child_square(f, f_child::<C, M>(c)));
        node(e, f)
    }
}

fn node(e: Option<u32>, f: Option<u32>) -> Option<Node> {
    if e.is_some() || f.is_some() { Some(Node { e, f }) } else { None }
}

/// The child of F above child `c` of E: the bits of the first m axes are the most significant ones.
#[inline(always)]
fn f_child<const C: usize, const M: usize>(c: u32) -> u32 {
    const { assert!(M <= C && M.is_power_of_two() && C.is_power_of_two(), "F has at most the axes of E") };
    c >> (C / M).trailing_zeros()
}

/// A mass for the split rule. Products range further than `f32`; a side that has mass must keep some.
fn relative_mass(average: f64, scale: f64) -> f32 {
    let mass = (average * scale) as f32;
    if average > 0.0 { numeric::max(mass, f32::MIN_POSITIVE) } else { 0.0 }
}

/// A pair of squares whose children are being summed.
#[derive(Clone, Copy, Default)]
struct Visit {
    e: u32,
    f: u32,
    child: u32,
    sum: f64,
}

/// Visits the squares that both trees keep, children before parents, hands each one's average of the product to
/// `store`, and returns the average over the unit cube.
fn average_squares<const C: usize, const M: usize>(e: &Tree<C>, f: &Tree<M>, mut store: impl FnMut(u32, f64)) -> f64 {
    let (Some(e_root), Some(f_root)) = (e.root_square(), f.root_square()) else {
        return f64::from(e.average()) * f64::from(f.average());
    };
    let mut stack = [Visit::default(); MAX_DEPTH as usize];
    let mut level = 0;
    stack[0] = Visit { e: e_root, f: f_root, child: 0, sum: 0.0 };
    while let Some(visit) = stack.get_mut(level) {
        let c = visit.child;
        if c as usize == C {
            let (square, average) = (visit.e, visit.sum / C as f64);
            store(square, average);
            let Some(parent) = level.checked_sub(1).and_then(|above| stack.get_mut(above)) else {
                return average;
            };
            parent.sum += average;
            level -= 1;
            continue;
        }
        visit.child += 1;
        let fc = f_child::<C, M>(c);
        let squares = (e.child_square(visit.e, c), f.child_square(visit.f, fc), level + 1 < MAX_DEPTH as usize);
        if let (Some(e), Some(f), true) = squares {
            level += 1;
            if let Some(next) = stack.get_mut(level) {
                *next = Visit { e, f, child: 0, sum: 0.0 };
            }
        } else {
            let (e_children, f_children) = (e.children(visit.e), f.children(visit.f));
            let (a, b) = (e_children[c as usize & (C - 1)], f_children[fc as usize & (M - 1)]);
            visit.sum += f64::from(a) * f64::from(b);
        }
    }
    0.0
}
