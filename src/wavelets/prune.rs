//! Pruning a complete tree to an error budget.
//!
//! A sampler that follows the pruned density E' instead of E estimates the total with the extra variance
//! integral of E^2 / E' - integral of E (over the unit cube, average 1). A square that collapses to its average
//! a adds area (mean(E^2) / a - a): the costs of disjoint squares add up. A coarser collapse can cost less than a
//! finer one (a bright spot in a dark square beside a bright square), so a threshold on the costs alone would not
//! give a rooted tree. Instead each kept square has a price, and the tree of least cost plus price follows by one
//! bottom-up pass (Breiman et al. 1984, "Classification and Regression Trees", cost-complexity pruning). It is
//! the smallest of all rooted trees of whole squares with at most its error.

use crate::status::{Result, Status};
use crate::wavelets::tree::{Link, MAX_DEPTH, Tree, complete_len};

/// What a pruned tree holds and what it costs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pruning {
    /// The number of kept squares.
    pub squares: u32,
    /// The variance that the pruning adds to an estimate of the total, relative to the square of the total.
    pub error: f64,
}

/// Chooses the squares to keep: the smallest tree at a price per square whose error is at most `budget`. Budget 0
/// drops only constant squares. `savings` receives, per square of the complete tree, what keeping it saves: for
/// [`write()`].
///
/// # Errors
/// [`Status::InvalidArgument`] if the tree is not complete, `savings` has not one entry per square, or the budget
/// is negative or NaN.
pub fn plan<const C: usize>(tree: &Tree<C>, budget: f64, savings: &mut [f64]) -> Result<Pruning> {
    let complete = complete_len(C, tree.depth()) == Some(tree.squares().len());
    if !complete || !tree.links().is_empty() || savings.len() != tree.squares().len() || budget.is_nan() || budget < 0.0
    {
        return Err(Status::InvalidArgument);
    }
    let averages = tree.squares().as_flattened();
    let tree = Complete { children: C, depth: tree.depth(), average: tree.average().into(), averages };
    if budget <= 0.0 {
        return Ok(Pruning { squares: tree.keep_varying(savings), error: 0.0 });
    }
    tree.collapse_costs(savings);
    let price = tree.highest_price(savings, budget);
    Ok(tree.prune(price, savings, &|saving, value| *saving = value))
}

/// Writes the squares that [`plan`] chose, breadth-first.
///
/// # Errors
/// [`Status::InvalidArgument`] if `squares` or `links` has not the length that was planned.
pub fn write<const C: usize>(
    tree: &Tree<C>,
    savings: &[f64],
    squares: &mut [[f32; C]],
    links: &mut [Link],
) -> Result<()> {
    let mut written = u32::from(savings.first().is_some_and(|saving| *saving > 0.0));
    if links.len() != squares.len() || (written == 0) != links.is_empty() {
        return Err(Status::InvalidArgument);
    }
    // A link that is not yet written holds the square's number in the complete tree.
    links.fill(Link::default());
    for (slot, square) in squares.iter_mut().enumerate() {
        let source = links.get(slot).map_or(0, |link| link.first);
        let mut link = Link { first: written, mask: 0 };
        let first = C * source as usize + 1;
        let below = savings.get(first..first + C).unwrap_or_default();
        for (c, _) in (0..).zip(below).filter(|(_, saving)| **saving > 0.0) {
            links.get_mut(written as usize).ok_or(Status::InvalidArgument)?.first = first as u32 + c;
            link.mask |= 1 << c;
            written += 1;
        }
        if slot >= written as usize {
            return Err(Status::InvalidArgument);
        }
        *square = tree.children(source);
        if let Some(target) = links.get_mut(slot) {
            *target = if link.mask == 0 { Link::default() } else { link };
        }
    }
    if written as usize == squares.len() { Ok(()) } else { Err(Status::InvalidArgument) }
}

/// A complete tree of any number of axes. One copy of what follows serves all of them.
struct Complete<'a> {
    /// Of a square.
    children: usize,
    depth: u32,
    average: f64,
    /// Of the children of all squares, one behind the other.
    averages: &'a [f32],
}

impl Complete<'_> {
    /// The averages of the children of a square.
    fn square(&self, square: usize) -> &[f32] {
        let first = square * self.children;
        self.averages.get(first..first + self.children).unwrap_or(&[])
    }

    /// Without a budget every square that is not constant is kept: says which, and answers how many.
    fn keep_varying(&self, savings: &mut [f64]) -> u32 {
        let mut kept = 0;
        for square in (0..savings.len()).rev() {
            let (children, first) = (self.square(square), self.children * square + 1);
            let below = savings.get(first..first + self.children).unwrap_or_default();
            let varies = children.iter().any(|child| Some(child) != children.first())
                || below.iter().any(|saving| *saving > 0.0);
            kept += u32::from(varies);
            if let Some(saving) = savings.get_mut(square) {
                *saving = f64::from(u8::from(varies));
            }
        }
        kept
    }

    /// Fills `costs` with the variance that each square adds if it collapses to its average. Variances are summed
    /// up from differences, so that they are 0 for a constant square and for no other.
    fn collapse_costs(&self, costs: &mut [f64]) {
        let total = if self.average > 0.0 { self.average } else { 1.0 };
        let count = self.children as f64;
        let mut level = self.depth;
        let mut level_first = costs.len();
        let mut weight = 1.0;
        for _ in 0..self.depth {
            weight /= count;
        }
        for square in (0..costs.len()).rev() {
            if square < level_first {
                level = level.saturating_sub(1);
                level_first = complete_len(self.children, level).unwrap_or(0);
                weight *= count;
            }
            let children = self.square(square);
            let mean = children.iter().map(|&child| f64::from(child)).sum::<f64>() / count;
            let mut variance = 0.0;
            for (c, average) in children.iter().map(|&child| f64::from(child)).enumerate() {
                let child = costs.get_mut(self.children * square + 1 + c);
                variance += (average - mean) * (average - mean);
                if let Some(inside) = child {
                    variance += *inside;
                    *inside = relative(*inside, average) * weight / count / total;
                }
            }
            if let Some(cost) = costs.get_mut(square) {
                *cost = variance / count;
            }
        }
        if let Some(cost) = costs.first_mut() {
            *cost = relative(*cost, total) / total;
        }
    }

    /// The highest price per square at which the best tree keeps to the budget, to 12 bits: bisection over the bits
    /// of positive numbers, which are ordered as the numbers are.
    fn highest_price(&self, costs: &mut [f64], budget: f64) -> f64 {
        let whole = costs.first().copied().unwrap_or(0.0);
        if whole <= budget {
            return f64::INFINITY;
        }
        // At this price all squares together would cost less than the budget, so what is not kept does.
        let least = 0.99 * budget / costs.len() as f64;
        let (mut affordable, mut excessive) = (least.to_bits(), whole.to_bits());
        while excessive - affordable > 1 << 40 {
            let middle = affordable + (excessive - affordable) / 2;
            if self.prune(f64::from_bits(middle), costs, &|_, _| ()).error <= budget {
                affordable = middle;
            } else {
                excessive = middle;
            }
        }
        f64::from_bits(affordable)
    }

    /// Finds the best tree at a price per square; `visit` receives the cost of each square and what keeping it saves.
    /// The squares come in the order in which a depth-first walk finishes them, so one sum per level is enough.
    fn prune(&self, price: f64, costs: &mut [f64], visit: &impl Fn(&mut f64, f64)) -> Pruning {
        let finest =
            self.depth.checked_sub(1).and_then(|coarser| complete_len(self.children, coarser)).unwrap_or(costs.len());
        let mut open = [Pruning::default(); MAX_DEPTH as usize];
        let mut best = Pruning::default();
        for first in finest..costs.len() {
            let mut square = first;
            let mut below = Pruning::default();
            for sum in open.iter_mut().take(self.depth as usize).rev() {
                let Some(cost) = costs.get_mut(square) else { break };
                best = choose(cost, below, price, visit);
                *sum = Pruning { squares: sum.squares.wrapping_add(best.squares), error: sum.error + best.error };
                if square == 0 || square & (self.children - 1) != 0 {
                    break;
                }
                square = (square - 1) >> self.children.trailing_zeros();
                below = core::mem::take(sum);
            }
        }
        best
    }
}

/// `variance / average`, 0 for a black square.
fn relative(variance: f64, average: f64) -> f64 {
    if variance > 0.0 { variance / average } else { 0.0 }
}

/// The cheaper of a collapsed square and one kept above the best subtrees of its children.
fn choose(cost: &mut f64, below: Pruning, price: f64, visit: &impl Fn(&mut f64, f64)) -> Pruning {
    let kept = Pruning { squares: below.squares.wrapping_add(1), error: below.error };
    let collapsed = Pruning { squares: 0, error: *cost };
    let saving = collapsed.error - (kept.error + price * f64::from(kept.squares));
    visit(cost, saving);
    if saving > 0.0 { kept } else { collapsed }
}
