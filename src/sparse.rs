//! Sparse sets of wavelets, not only rooted ones: their product without decompression, how many an error needs, and the
//! tree of what a set means, which can be sampled.
//!
//! Free thresholding (Clarberg et al. 2005, Section 4.1; Ng et al. 2004) keeps single wavelets wherever they are. The sum of
//! such a set may be negative. Products and integrals take it as it is; a tree raises it to a floor, and then it is the
//! raised function that is sampled, whose pdf is told and whose averages are stored.

use crate::haar::analyse;
use crate::morton::MAX_DEPTH;
use crate::tree::{Link, Tree};
use crate::triple::{Wavelets, value};

/// A function on the square: its average, and wavelets in order.
#[derive(Clone, Copy, Debug)]
pub struct Sparse<'a> {
    /// Over the whole square.
    pub average: f64,
    /// In order ([`crate::triple::is_ordered`]).
    pub wavelets: &'a [Wavelets],
}

/// Takes the wavelets of a square off the front of a list, if they are the first.
fn take(list: &mut &[Wavelets], square: &Wavelets) -> [f64; 3] {
    match list.split_first() {
        Some((first, rest)) if (first.position, first.level) == (square.position, square.level) => {
            *list = rest;
            first.detail.map(f64::from)
        }
        _ => [0.0; 3],
    }
}

/// Whether a list goes on with something in a square.
fn enters(list: &[Wavelets], square: &Wavelets) -> bool {
    list.first().is_some_and(|first| first.level >= square.level && first.is_in(square))
}

/// A square whose children are being multiplied.
#[derive(Clone, Copy, Default)]
struct Open {
    square: Wavelets,
    functions: [[f64; 4]; 2],
    children: [f64; 4],
    next: u32,
    slot: usize,
}

/// The product of two functions: its wavelets in order as far as there is room, its average, and how many squares it has.
/// Each square that either function has a wavelet in is visited once, and only those.
pub fn multiply(e: Sparse, f: Sparse, out: &mut [Wavelets]) -> (f64, usize) {
    let mut rest = [e.wavelets, f.wavelets];
    let mut open = [Open::default(); MAX_DEPTH as usize + 1];
    let (mut depth, mut count) = (0usize, 0usize);
    let mut finished: Option<f64> = None;
    let mut enter = Some((Wavelets::default(), [e.average, f.average]));
    loop {
        if let Some((square, averages)) = enter.take() {
            let inside = rest.iter().any(|list| enters(list, &square));
            match open.get_mut(depth).filter(|_| inside) {
                Some(slot) => {
                    let mut functions = [[0.0; 4]; 2];
                    for ((function, list), average) in functions.iter_mut().zip(&mut rest).zip(averages) {
                        let [a, b, c] = take(list, &square);
                        *function = [average, a, b, c];
                    }
                    *slot = Open { square, functions, children: [0.0; 4], next: 0, slot: count };
                    (depth, count) = (depth + 1, count + 1);
                }
                None => finished = Some(averages[0] * averages[1]),
            }
        }
        let Some(here) = depth.checked_sub(1).and_then(|top| open.get_mut(top)) else {
            return (finished.unwrap_or(0.0), count);
        };
        if let Some(average) = finished.take() {
            here.children[here.next as usize & 3] = average;
            here.next += 1;
        }
        if here.next < 4 {
            let c = here.next;
            enter = Some((here.square.child(c), here.functions.map(|function| value(function, c))));
            continue;
        }
        let [average, details @ ..] = analyse(here.children);
        if let Some(slot) = out.get_mut(here.slot) {
            *slot = Wavelets { detail: details.map(|d| d as f32), ..here.square };
        }
        finished = Some(average);
        depth -= 1;
    }
}

/// The squares that the tree of a set has: those of its wavelets and all above them.
pub fn squares(list: &[Wavelets]) -> usize {
    (0..MAX_DEPTH).map(|level| above(list, level).count()).sum()
}

/// The squares of a level that hold wavelets of a list, in order.
fn above(list: &[Wavelets], level: u32) -> impl Iterator<Item = Wavelets> {
    let mut last = None;
    list.iter().filter(move |w| w.level >= level).filter_map(move |w| {
        let square = w.ancestor(level);
        let is_new = last != Some(square.position);
        last = Some(square.position);
        is_new.then_some(square)
    })
}

/// Writes the tree of a set: on each of its finest cells the function, raised to `least` and times `scale`, and above
/// them the true averages of that. Returns the average.
///
/// `squares` and `links` are as long as [`squares`] says; the tree's depth is that of the finest square plus 1.
pub fn to_tree(set: Sparse, least: f64, scale: f64, squares: &mut [[f32; 4]], links: &mut [Link]) -> f64 {
    let mut count = 0;
    for level in 0..MAX_DEPTH {
        let mut way = Way::new(set);
        for square in above(set.wavelets, level) {
            let function = way.on(&square);
            if let Some(slot) = squares.get_mut(count) {
                *slot = [0, 1, 2, 3].map(|c| (max_f64(value(function, c), least) * scale) as f32);
            }
            count += 1;
        }
    }
    link(set.wavelets, links);
    // Below a kept square the averages are those of what is below, children before parents.
    let mut average = max_f64(set.average, least) * scale;
    for parent in (0..squares.len()).rev() {
        let Link { first, mask } = links.get(parent).copied().unwrap_or_default();
        let mut below = first as usize;
        for c in 0..4usize {
            if mask >> c & 1 == 1 {
                let mean = squares.get(below).map_or(0.0, mean);
                if let Some(square) = squares.get_mut(parent) {
                    square[c] = mean as f32;
                }
                below += 1;
            }
        }
        if parent == 0 {
            average = squares.first().map_or(average, mean);
        }
    }
    average
}

fn mean(square: &[f32; 4]) -> f64 {
    square.iter().map(|&x| f64::from(x)).sum::<f64>() * 0.25
}

fn max_f64(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Writes where the children of each square stand, level by level.
fn link(list: &[Wavelets], links: &mut [Link]) {
    let (mut parent, mut child) = (0usize, usize::from(!list.is_empty()));
    for level in 0..MAX_DEPTH {
        let mut below = above(list, level + 1).peekable();
        for square in above(list, level) {
            let mut link = Link { first: child as u32, mask: 0 };
            while let Some(next) = below.next_if(|next| next.is_in(&square)) {
                link.mask |= 1 << next.child_of(&square);
                child += 1;
            }
            if let Some(slot) = links.get_mut(parent) {
                *slot = if link.mask == 0 { Link::default() } else { link };
            }
            parent += 1;
        }
    }
}

/// Follows a set down to squares of one level, in order.
struct Way<'a> {
    rest: &'a [Wavelets],
    /// The squares of the set that hold the present one.
    stack: [(Wavelets, [f64; 4]); MAX_DEPTH as usize],
    depth: usize,
    average: f64,
}

impl<'a> Way<'a> {
    fn new(set: Sparse<'a>) -> Self {
        let nothing = (Wavelets::default(), [0.0; 4]);
        Way { rest: set.wavelets, stack: [nothing; MAX_DEPTH as usize], depth: 0, average: set.average }
    }

    /// The function on a square.
    fn on(&mut self, square: &Wavelets) -> [f64; 4] {
        while let Some((next, rest)) = self.rest.split_first() {
            if (next.position, next.level) >= (square.position, square.level) {
                break;
            }
            let function = self.function(next, next.detail.map(f64::from));
            if let Some(slot) = self.stack.get_mut(self.depth) {
                (*slot, self.depth) = ((*next, function), self.depth + 1);
            }
            self.rest = rest;
        }
        let own = self.rest.first().filter(|w| (w.position, w.level) == (square.position, square.level));
        self.function(square, own.map_or([0.0; 3], |own| own.detail.map(f64::from)))
    }

    /// The average on a square, after those that do not hold it have left the stack, and its details.
    fn function(&mut self, square: &Wavelets, [a, b, c]: [f64; 3]) -> [f64; 4] {
        while let Some((top, function)) = self.depth.checked_sub(1).and_then(|top| self.stack.get(top)) {
            if top.level < square.level && square.is_in(top) {
                return [value(*function, square.child_of(top)), a, b, c];
            }
            self.depth -= 1;
        }
        [self.average, a, b, c]
    }
}

/// The fewest of a tree's largest wavelets that leave a relative L2 error of at most `error`.
pub fn terms(tree: &Tree<4>, error: f64) -> u32 {
    // Energies are ordered as the bits of their sizes: bisection finds the size down to which wavelets are needed.
    let above = |threshold: u32| {
        let (mut count, mut kept, mut all) = (0u32, 0.0f64, f64::from(tree.average()) * f64::from(tree.average()));
        crate::triple::each_size(tree, |size| {
            let energy = f64::from(size) * f64::from(size);
            all += energy;
            if size > 0.0 && size.to_bits() >= threshold {
                (count, kept) = (count + 1, kept + energy);
            }
        });
        let mean = f64::from(tree.average());
        (count, max_f64(all - mean * mean - kept, 0.0), all)
    };
    let (_, _, all) = above(0);
    let allowed = error * error * all;
    let (mut low, mut high) = (0u32, f32::INFINITY.to_bits());
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        (low, high) = if above(middle).1 <= allowed { (middle, high) } else { (low, middle) };
    }
    let (count, lost, _) = above(low);
    // Of those that are just as large as the last one some may still go.
    let each = f64::from(f32::from_bits(low)) * f64::from(f32::from_bits(low));
    let ties = count - above(high).0;
    let spare = if each > 0.0 { (max_f64(allowed - lost, 0.0) / each) as u32 } else { 0 };
    count - spare.min(ties)
}
