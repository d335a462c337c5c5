//! Sparse sets of wavelets, not only rooted ones: their product without decompression, and the tree of what a set means,
//! which can be sampled.
//!
//! Free thresholding (Clarberg et al. 2005, Section 4.1; Ng et al. 2004) keeps single wavelets wherever they are. The sum of
//! such a set may be negative. Products and integrals take it as it is; a tree raises it to a floor, and then it is the
//! raised function that is sampled, whose pdf is told and whose averages are stored.

use crate::blob::Size;
use crate::numeric::{exp2i, exponent, is_float};
use crate::status::Status;
use crate::wavelets::morton::MAX_DEPTH;
use crate::wavelets::stored::{AnyTree, Facts, Header, Parts, Refused, mean_of, store};
use crate::wavelets::tree::Link;
use crate::wavelets::triple::{Wavelets, first_fault};

/// A function on the square: its average, and wavelets in order.
pub type Sparse<'a> = Set<'a, Wavelets>;

/// A function on the unit cube of n axes: its average, and wavelets in order.
#[derive(Clone, Copy, Debug)]
pub struct Set<'a, W> {
    /// Over the whole cube.
    pub average: f64,
    /// By position, and squares before those inside them.
    pub wavelets: &'a [W],
}

/// The wavelets of a square of n axes that a set keeps.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Details {
    /// The Morton code of the square's first pixel among 4096 along each axis: n bits a level, axis 1 the highest of each n.
    pub position: u64,
    /// The square has the width 2^-level.
    pub level: u32,
    /// Not read; 0 where the library writes.
    pub reserved: u32,
    /// Detail f, 1 to 2^n - 1, in value space: 2^(n level / 2) times the orthonormal coefficient of the wavelet that varies
    /// along the axes whose bits are set in f, axis 1 the highest of n. Others are not read; 0 where the library writes.
    pub detail: [f32; 16],
}

/// An element of a sparse set.
pub trait Element: Copy {
    /// Where the square is, and its level.
    fn key(&self) -> (u64, u32);
    /// Detail f, below 2^n.
    fn detail(&self, f: usize) -> f64;
    /// The wavelets of a square; detail 0 is not read.
    fn new(key: (u64, u32), details: &[f64; 16]) -> Self;
}

impl Element for Wavelets {
    fn key(&self) -> (u64, u32) {
        (self.position.into(), self.level)
    }

    fn detail(&self, f: usize) -> f64 {
        f.checked_sub(1).and_then(|f| self.detail.get(f)).map_or(0.0, |d| f64::from(*d))
    }

    fn new((position, level): (u64, u32), details: &[f64; 16]) -> Self {
        let [_, a, b, c, ..] = *details;
        Wavelets { position: position as u32, level, detail: [a, b, c].map(|d| d as f32) }
    }
}

impl Element for Details {
    fn key(&self) -> (u64, u32) {
        (self.position, self.level)
    }

    fn detail(&self, f: usize) -> f64 {
        self.detail.get(f).map_or(0.0, |d| f64::from(*d))
    }

    fn new((position, level): (u64, u32), details: &[f64; 16]) -> Self {
        let mut detail = details.map(|d| d as f32);
        detail[0] = 0.0;
        Details { position, level, reserved: 0, detail }
    }
}

/// Whether a list is in order, of squares of `axes` axes on the grid, with numbers.
pub fn is_ordered(list: &[Details], axes: u32) -> bool {
    disorder(list, axes).is_none()
}

/// The first element of a list that is not on the grid, no number, or not behind the one before it.
pub fn disorder(list: &[Details], axes: u32) -> Option<usize> {
    let on_grid = |w: &Details| {
        let used = w.detail.iter().take(1 << axes).skip(1);
        w.level < MAX_DEPTH
            && w.position >> (axes * MAX_DEPTH) == 0
            && w.position & ((1 << shift(axes, w.level)) - 1) == 0
            && used.copied().all(f32::is_finite)
    };
    first_fault(list, on_grid, Details::key)
}

/// Bits of a position below those of a level.
pub(crate) fn shift(axes: u32, level: u32) -> u32 {
    axes * MAX_DEPTH.saturating_sub(level)
}

/// A square of a function of some axes.
#[derive(Clone, Copy, Default)]
struct Place {
    axes: u32,
    key: (u64, u32),
}

impl Place {
    fn child(&self, c: u32) -> Place {
        let (position, level) = (self.key.0, self.key.1 + 1);
        Place { key: (position | u64::from(c) << shift(self.axes, level), level), ..*self }
    }

    /// The averages of the children of the square, if a set has wavelets in it; what the set has of the square itself is
    /// added to its average.
    fn children<W: Element>(&self, set: &Set<W>, average: f64) -> ([f64; 16], bool) {
        let first = set.wavelets.partition_point(|w| w.key() < self.key);
        let next = set.wavelets.get(first);
        let inside = next
            .is_some_and(|w| w.key().0 >> shift(self.axes, self.key.1) == self.key.0 >> shift(self.axes, self.key.1));
        let mut values = [0.0; 16];
        if let Some(own) = next.filter(|w| w.key() == self.key) {
            for (f, value) in values.iter_mut().enumerate().take(1 << self.axes).skip(1) {
                *value = own.detail(f);
            }
        }
        values[0] = average;
        transform(&mut values, self.axes);
        (values, inside)
    }
}

/// Sums over c of (-1)^popcount(f & c) value(c), for every f below 2^axes: averages from details, and, but for a factor
/// 2^axes, details from averages.
#[inline(never)]
pub(crate) fn transform(values: &mut [f64; 16], axes: u32) {
    for axis in 0..axes.min(4) {
        for c in (0..1usize << axes.min(4)).filter(|c| c >> axis & 1 == 0) {
            let (low, high) = (values[c & 15], values[(c | 1 << axis) & 15]);
            (values[c & 15], values[(c | 1 << axis) & 15]) = (low + high, low - high);
        }
    }
}

/// Why a product cannot be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unfit {
    /// It has so many squares.
    Room(u64),
    /// Its average is no double, or a detail no float; what was written means nothing.
    Range,
}

/// A square whose children are being multiplied.
#[derive(Clone, Copy, Default)]
struct Open {
    places: [Place; 2],
    /// The averages of both functions on the children.
    e: [f64; 16],
    f: [f64; 16],
    children: [f64; 16],
    next: u32,
    slot: usize,
}

/// How many squares the product of a function of n axes and one of the first m of them has: those that either has a wavelet
/// in, counted level by level. One square of m axes is 2^((n - m) level) of n axes.
pub fn count<W: Element, V: Element>((n, e): (u32, &[W]), (m, f): (u32, &[V])) -> u64 {
    let on_level = |level| {
        let both = above(n, e, level).filter(|square| holds(m, f, (first_axes(*square, n, m), level))).count();
        let of_f = (count_above(m, f, level) as u64) << ((n - m) * level);
        count_above(n, e, level) as u64 + of_f - both as u64
    };
    (0..MAX_DEPTH).map(on_level).sum()
}

/// The position of the square of the first m of n axes.
fn first_axes(position: u64, n: u32, m: u32) -> u64 {
    let on_level = |k: u32| (position >> (n * k) & ((1 << n) - 1)) >> (n - m) << (m * k);
    (0..MAX_DEPTH).map(on_level).sum()
}

/// Whether a list has wavelets in a square.
fn holds<W: Element>(axes: u32, list: &[W], key: (u64, u32)) -> bool {
    let next = list.get(list.partition_point(|w| w.key() < key));
    next.is_some_and(|w| w.key().0 >> shift(axes, key.1) == key.0 >> shift(axes, key.1))
}

/// The product of a function of n axes and one of the first m of them: writes its wavelets in order, and answers its average
/// and how many squares it has. Each square that either function has a wavelet in is visited once, and only those. If there
/// is no room for all, nothing is visited.
///
/// # Errors
/// [`Unfit`].
pub fn multiply<W: Element, V: Element>(
    (n, e): (u32, Set<W>),
    (m, f): (u32, Set<V>),
    out: &mut [W],
) -> core::result::Result<(f64, usize), Unfit> {
    let squares = self::count((n, e.wavelets), (m, f.wavelets));
    if squares > out.len() as u64 {
        return Err(Unfit::Room(squares));
    }
    let root = |axes| Place { axes, key: (0, 0) };
    let mut open = [Open::default(); MAX_DEPTH as usize + 1];
    let (mut depth, mut count) = (0usize, 0usize);
    let mut finished: Option<f64> = None;
    let mut enter = Some(([root(n), root(m)], [e.average, f.average]));
    loop {
        if let Some((places, averages)) = enter.take() {
            let (of_e, e_inside) = places[0].children(&e, averages[0]);
            let (of_f, f_inside) = places[1].children(&f, averages[1]);
            match open.get_mut(depth).filter(|_| e_inside || f_inside) {
                Some(slot) => {
                    *slot = Open { places, e: of_e, f: of_f, children: [0.0; 16], next: 0, slot: count };
                    (depth, count) = (depth + 1, count + 1);
                }
                None => finished = Some(averages[0] * averages[1]),
            }
        }
        let Some(here) = depth.checked_sub(1).and_then(|top| open.get_mut(top)) else {
            let average = finished.unwrap_or(0.0);
            return if average.is_finite() { Ok((average, count)) } else { Err(Unfit::Range) };
        };
        if let Some(average) = finished.take() {
            here.children[here.next as usize & 15] = average;
            here.next += 1;
        }
        if here.next < 1 << n {
            let (c, below) = (here.next, here.next >> (n - m));
            let averages = [here.e[c as usize & 15], here.f[below as usize & 15]];
            enter = Some(([here.places[0].child(c), here.places[1].child(below)], averages));
            continue;
        }
        let scale = 1.0 / f64::from(1u32 << n);
        transform(&mut here.children, n);
        let details = here.children.map(|sum| sum * scale);
        if !details.iter().skip(1).all(|d| is_float(*d)) {
            return Err(Unfit::Range);
        }
        if let Some(slot) = out.get_mut(here.slot) {
            *slot = W::new(here.places[0].key, &details);
        }
        finished = Some(details[0]);
        depth -= 1;
    }
}

/// The squares that the tree of a set of some axes has: those of its wavelets and all above them.
pub fn squares<W: Element>(axes: u32, list: &[W]) -> usize {
    (0..MAX_DEPTH).map(|level| count_above(axes, list, level)).sum()
}

/// The number of squares of a level that hold wavelets of a list. Not in line: one copy serves all levels.
#[inline(never)]
fn count_above<W: Element>(axes: u32, list: &[W], level: u32) -> usize {
    above(axes, list, level).count()
}

/// The level below the finest square of a set.
pub fn depth<W: Element>(list: &[W]) -> u32 {
    list.iter().map(|w| w.key().1 + 1).max().unwrap_or(0)
}

/// The positions of the squares of a level that hold wavelets of a list, in order.
fn above<W: Element>(axes: u32, list: &[W], level: u32) -> impl Iterator<Item = u64> {
    let (mut last, shift) = (None, shift(axes, level));
    list.iter().map(W::key).filter(move |key| key.1 >= level).filter_map(move |(position, _)| {
        let square = position >> shift << shift;
        let is_new = last != Some(square);
        last = Some(square);
        is_new.then_some(square)
    })
}

/// The bytes of the tree of a set of some axes; `None` if no memory is as long.
pub fn size<W: Element>(axes: u32, list: &[W]) -> Option<Size> {
    Some(Size { bytes: Parts::new(axes, squares(axes, list))?.bytes, scratch: 0 })
}

/// Stores the tree of a set of some axes, whose values are raised to `least`, 0 or more.
///
/// # Errors
/// [`Refused`]: of the input [`Status::InvalidArgument`], if values are too large beside the average.
pub fn build_in<W: Element>(
    axes: u32,
    set: Set<W>,
    least: f64,
    memory: &mut [u8],
) -> core::result::Result<Header, Refused> {
    // -0 counts as 0, or it would be stored.
    let least = max_f64(least, 0.0);
    store(memory, axes, squares(axes, set.wavelets), |averages, links| {
        let raised = max_f64(set.average, least);
        let power = if raised > 0.0 { exponent(raised).clamp(-1000, 1000) } else { 0 };
        let mean = to_tree(axes, set, least, exp2i(-power), averages, links);
        let (depth, average) = (depth(set.wavelets), mean as f32);
        if !AnyTree::trusted(axes, depth, average, averages, links).is_sound() {
            return Err(Refused::Input(Status::InvalidArgument));
        }
        Ok(Facts { depth, mean: mean_of(mean, power, power)?, error: 0.0, exponent: power, average })
    })
}

/// Writes the tree of a set of some axes: on each of its finest cells the function, raised to `least` and times `scale`,
/// and above them the true averages of that. Returns the average.
///
/// `averages` has 2^axes numbers for each of `links`, which are as many as [`squares`] says; the tree's depth is [`depth`].
pub fn to_tree<W: Element>(
    axes: u32,
    set: Set<W>,
    least: f64,
    scale: f64,
    averages: &mut [f32],
    links: &mut [Link],
) -> f64 {
    let mut squares = averages.chunks_exact_mut(1 << axes);
    for level in 0..MAX_DEPTH {
        let mut way = Way::new(axes, set);
        for (position, square) in above(axes, set.wavelets, level).zip(&mut squares) {
            let children = way.on((position, level));
            for (average, child) in square.iter_mut().zip(children) {
                *average = (max_f64(child, least) * scale) as f32;
            }
        }
    }
    link(axes, set.wavelets, links);
    // Below a kept square the averages are those of what is below, children before parents.
    for parent in (0..links.len()).rev() {
        let Link { first, mask } = links.get(parent).copied().unwrap_or_default();
        for (below, c) in (first as usize..).zip((0..1usize << axes).filter(|c| mask >> c & 1 == 1)) {
            let mean = mean(axes, averages, below).unwrap_or(0.0);
            if let Some(slot) = averages.get_mut((parent << axes) + c) {
                *slot = mean as f32;
            }
        }
    }
    mean(axes, averages, 0).unwrap_or(max_f64(set.average, least) * scale)
}

/// The average of a square from those of its children.
fn mean(axes: u32, averages: &[f32], square: usize) -> Option<f64> {
    let children = averages.get(square << axes..(square + 1) << axes)?;
    Some(children.iter().map(|&x| f64::from(x)).sum::<f64>() / f64::from(1u32 << axes))
}

fn max_f64(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Writes where the children of each square stand, level by level.
fn link<W: Element>(axes: u32, list: &[W], links: &mut [Link]) {
    let (mut slots, mut child) = (links.iter_mut(), usize::from(!list.is_empty()));
    for level in 0..MAX_DEPTH {
        let (shift, shift_below) = (shift(axes, level), shift(axes, level + 1));
        let mut below = above(axes, list, level + 1).peekable();
        for (square, slot) in above(axes, list, level).zip(&mut slots) {
            let mut link = Link { first: child as u32, mask: 0 };
            while let Some(next) = below.next_if(|next| next >> shift == square >> shift) {
                link.mask |= 1 << (next >> shift_below & ((1 << axes) - 1));
                child += 1;
            }
            *slot = if link.mask == 0 { Link::default() } else { link };
        }
    }
}

/// Follows a set down to squares of one level, in order.
struct Way<'a, W> {
    axes: u32,
    rest: &'a [W],
    /// The squares of the set that hold the present one, and the averages of their children.
    stack: [((u64, u32), [f64; 16]); MAX_DEPTH as usize],
    depth: usize,
    average: f64,
}

impl<'a, W: Element> Way<'a, W> {
    fn new(axes: u32, set: Set<'a, W>) -> Self {
        let stack = [((0, 0), [0.0; 16]); MAX_DEPTH as usize];
        Way { axes, rest: set.wavelets, stack, depth: 0, average: set.average }
    }

    /// The averages of the children of a square. Not in line: one copy serves all numbers of axes.
    #[inline(never)]
    fn on(&mut self, key: (u64, u32)) -> [f64; 16] {
        while let Some((next, rest)) = self.rest.split_first().filter(|(next, _)| next.key() < key) {
            let children = self.children(next.key(), Some(next));
            if let Some(slot) = self.stack.get_mut(self.depth) {
                (*slot, self.depth) = ((next.key(), children), self.depth + 1);
            }
            self.rest = rest;
        }
        let own = self.rest.first().filter(|w| w.key() == key);
        self.children(key, own)
    }

    /// The averages of the children of a square with these wavelets, after those that do not hold it have left the stack.
    #[inline(never)]
    fn children(&mut self, key: (u64, u32), own: Option<&W>) -> [f64; 16] {
        let mut average = self.average;
        while let Some((top, children)) = self.depth.checked_sub(1).and_then(|top| self.stack.get(top)) {
            if top.1 < key.1 && (top.0 ^ key.0) >> shift(self.axes, top.1) == 0 {
                let c = key.0 >> shift(self.axes, top.1 + 1) & ((1 << self.axes) - 1);
                average = children[c as usize & 15];
                break;
            }
            self.depth -= 1;
        }
        let mut values = [0.0; 16];
        for (f, value) in values.iter_mut().enumerate().take(1 << self.axes).skip(1) {
            *value = own.map_or(0.0, |own| own.detail(f));
        }
        values[0] = average;
        transform(&mut values, self.axes);
        values
    }
}
