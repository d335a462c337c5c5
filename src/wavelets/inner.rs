//! The integral of the product of two stored trees, exactly.
//!
//! The product's average on a square is not the product of the averages: a_E a_F misses the inner product of all
//! details inside it (Clarberg et al. 2005, Section 4.3), and two complementary checkerboards would give 1/4
//! instead of 0. One bottom-up pass over the squares that both trees keep sums the exact averages themselves,
//! which is that a_E a_F + D without its cancellation. Where one tree ends it is constant, and the other alone
//! decides. [`crate::wavelets::combine`] writes the product out as a tree.
//!
//! E has n axes and F the first m <= n of them; F is constant along the rest.

use crate::wavelets::tree::{MAX_DEPTH, Tree};

/// The child of F above child `c` of E: the bits of the first m axes are the most significant ones.
#[inline(always)]
fn f_child<const C: usize, const M: usize>(c: u32) -> u32 {
    const { assert!(M <= C && M.is_power_of_two() && C.is_power_of_two(), "F has at most the axes of E") };
    c >> (C / M).trailing_zeros()
}

/// A pair of squares whose children are being summed.
#[derive(Clone, Copy, Default)]
struct Visit {
    e: u32,
    f: u32,
    child: u32,
    sum: f64,
}

/// The integral of the product of two trees over the unit cube: exact but for the rounding of `f64` sums. Needs
/// no memory; costs one visit of each square that both trees keep, children before parents.
pub fn integral<const C: usize, const M: usize>(e: &Tree<C>, f: &Tree<M>) -> f64 {
    let (Some(e_root), Some(f_root)) = (e.root_square(), f.root_square()) else {
        return f64::from(e.average()) * f64::from(f.average());
    };
    let mut stack = [Visit::default(); MAX_DEPTH as usize];
    let mut level = 0;
    stack[0] = Visit { e: e_root, f: f_root, child: 0, sum: 0.0 };
    while let Some(visit) = stack.get_mut(level) {
        let c = visit.child;
        if c as usize == C {
            let average = visit.sum / C as f64;
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
