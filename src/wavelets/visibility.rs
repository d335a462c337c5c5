//! Visibility in 8 bits: a tree of which each square takes 8 bytes, for one map a vertex (Ng et al. 2004, Section 7.1.1).
//!
//! A square keeps the averages of its four children as bytes, and where its kept children stand: an indexed look-up
//! without a hash. Where visibility is 0 or 1 nothing is lost; averages of larger squares are off by 1/510 at most.

use crate::blob::{Magic, Part, Size, header, write_header};
use crate::numeric::{ContentHash, inverse_power};
use crate::status::{Result, Status};
use crate::wavelets::tree::{MAX_DEPTH, Tree};
use crate::wavelets::triple::{Quadtree, WAITING};
use bytemuck::{Pod, Zeroable, try_cast_slice_mut};

/// The first bytes of a stored map; its nodes follow.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Header {
    magic: u64,
    nodes: u32,
    average: f32,
    checksum: u64,
}

impl Magic for Header {
    const MAGIC: u64 = u64::from_le_bytes(*b"wis-vis\x03");
}

impl Header {
    /// The bytes of the map that begins with this; `None` if none does.
    pub fn length(&self) -> Option<usize> {
        bytes(self.nodes as usize).filter(|_| self.magic == Header::MAGIC)
    }
}

/// The hash of everything but itself. Any share is a valid one, so that nothing else tells a changed byte.
fn checksum(average: f32, nodes: &[Node]) -> u64 {
    let mut hash = ContentHash::new();
    hash.add((nodes.len() as u64) << 32 | u64::from(average.to_bits()));
    for node in nodes {
        hash.add(u64::from(u32::from_le_bytes(node.average)) << 32 | u64::from(node.below));
    }
    hash.finish()
}

fn bytes(nodes: usize) -> Option<usize> {
    if nodes < MAX_NODES { Some(size_of::<Header>() + nodes * size_of::<Node>()) } else { None }
}

/// The bytes of the map of a tree; `None` if it has too many squares.
pub fn size(tree: &Tree<4>) -> Option<Size> {
    Some(Size { bytes: bytes(tree.squares().len())?, scratch: 0 })
}

/// Stores a tree, whose averages times `scale` are shares of what is seen, in as many bytes as [`size`] says.
///
/// # Errors
/// As [`compress`].
pub fn compress_in(tree: &Tree<4>, scale: f64, memory: &mut [u8]) -> Result<()> {
    let average = f64::from(tree.average()) * scale;
    if average > 1.0 + 1e-6 {
        return Err(Status::InvalidArgument);
    }
    let nodes = memory.get_mut(size_of::<Header>()..).and_then(|nodes| try_cast_slice_mut(nodes).ok());
    let nodes = nodes.unwrap_or(&mut []);
    compress(tree, scale, nodes)?;
    let average = if average < 1.0 { average as f32 } else { 1.0 };
    let (count, checksum) = (nodes.len() as u32, checksum(average, nodes));
    write_header(memory, &Header { magic: Header::MAGIC, nodes: count, average, checksum });
    Ok(())
}

/// A square.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Node {
    /// The averages of the children, 255 for 1.
    average: [u8; 4],
    /// Sixteen times the number of the first kept child, and a bit for each child that is kept.
    below: u32,
}

/// The most squares: their numbers have 28 bits.
pub const MAX_NODES: usize = 1 << 28;

impl Node {
    fn first(self) -> u32 {
        self.below >> 4
    }

    fn mask(self) -> u32 {
        self.below & 15
    }
}

/// A map of visibility.
#[derive(Clone, Copy, Debug)]
pub struct Visibility<'a> {
    average: f32,
    nodes: &'a [Node],
}

/// Writes a tree's squares as nodes. Its averages times `scale` are shares of what is seen.
///
/// # Errors
/// [`Status::InvalidArgument`] if a share is above 1 (by more than 1e-6) or there are not as many nodes as squares, or
/// too many.
pub fn compress(tree: &Tree<4>, scale: f64, nodes: &mut [Node]) -> Result<()> {
    let shares = |averages: [f32; 4]| averages.map(|average| f64::from(average) * scale);
    let sound = tree.squares().iter().all(|square| shares(*square).iter().all(|share| *share <= 1.0 + 1e-6));
    if nodes.len() != tree.squares().len() || nodes.len() >= MAX_NODES || !sound {
        return Err(Status::InvalidArgument);
    }
    for (square, node) in (0..).zip(nodes) {
        let kept = [0, 1, 2, 3].map(|c| tree.child_square(square, c));
        let mask = (0..).zip(&kept).fold(0, |mask, (c, child)| mask | u32::from(child.is_some()) << c);
        let first = kept.iter().flatten().next().copied().unwrap_or(0);
        let average = shares(tree.children(square)).map(|share| (share * 255.0 + 0.5) as u8);
        *node = Node { average, below: first << 4 | mask };
    }
    Ok(())
}

impl<'a> Visibility<'a> {
    /// The map that bytes hold, without a check of its nodes; `None` if they are of something else.
    pub fn view(bytes: &'a [u8]) -> Option<Visibility<'a>> {
        let header: &Header = header(bytes)?;
        header.length()?;
        let nodes = Part { offset: size_of::<Header>(), count: header.nodes as usize }.of(bytes);
        Some(Visibility::trusted(header.average, nodes))
    }

    /// The map that bytes hold, checked. Reads all bytes once.
    ///
    /// # Errors
    /// [`Status::Corrupt`].
    pub fn open(bytes: &'a [u8]) -> Result<Visibility<'a>> {
        let Visibility { average, nodes } = Visibility::view(bytes).ok_or(Status::Corrupt)?;
        let stated = header(bytes).map(|header: &Header| header.checksum);
        if stated == Some(checksum(average, nodes)) { Visibility::new(average, nodes) } else { Err(Status::Corrupt) }
    }

    /// Nodes that somebody stored.
    ///
    /// # Errors
    /// [`Status::Corrupt`] unless they are a tree of at most [`MAX_DEPTH`] levels in breadth-first order, and the average is
    /// a share.
    pub fn new(average: f32, nodes: &'a [Node]) -> Result<Visibility<'a>> {
        let (mut next, mut level, mut level_end) = (usize::from(!nodes.is_empty()), 1, usize::from(!nodes.is_empty()));
        for (number, node) in nodes.iter().enumerate() {
            if number == level_end {
                (level, level_end) = (level + 1, next);
            }
            let children = node.mask().count_ones() as usize;
            let in_order = if children == 0 { node.below == 0 } else { node.first() as usize == next };
            if !in_order || level > MAX_DEPTH || (level == MAX_DEPTH && children > 0) {
                return Err(Status::Corrupt);
            }
            next += children;
        }
        let share = (0.0..=1.0).contains(&average);
        if share && next == nodes.len() { Ok(Visibility { average, nodes }) } else { Err(Status::Corrupt) }
    }

    /// Nodes that [`compress`] wrote or [`Visibility::new`] accepted before. Others give meaningless values, no panic.
    pub fn trusted(average: f32, nodes: &'a [Node]) -> Visibility<'a> {
        Visibility { average, nodes }
    }

    /// The integral over the unit square of a tree that is seen through this map: a double product. One visit of each square
    /// that the map keeps, and exact where visibility is 0 or 1, since only squares on which it is constant add to the sum.
    pub fn product_integral(&self, tree: &Tree<4>) -> f64 {
        let average = tree.average();
        let Some(seen) = self.root_square() else { return f64::from(average) * f64::from(self.average) };
        let mut waiting = [Pair::default(); WAITING];
        let (mut next, mut count, mut sum) =
            (Some(Pair { seen, square: tree.root_square(), average, level: 1 }), 0usize, 0.0);
        while let Some(pair) = next {
            let (values, node) = (pair.values(tree), self.node(pair.seen));
            let mask = if pair.level < MAX_DEPTH { node.mask() } else { 0 };
            let mut ended = 0.0;
            for (c, (value, share)) in values.into_iter().zip(node.average).enumerate() {
                ended += if mask >> c & 1 == 0 { f64::from(value) * f64::from(share) } else { 0.0 };
            }
            let mut below = node.first().wrapping_add(mask.count_ones());
            for c in (0..4u32).rev().filter(|c| mask >> c & 1 == 1) {
                below = below.wrapping_sub(1);
                if let Some(slot) = waiting.get_mut(count) {
                    let square = pair.square.and_then(|square| tree.child_square(square, c));
                    *slot = Pair { seen: below, square, average: values[c as usize & 3], level: pair.level + 1 };
                    count += 1;
                }
            }
            sum += ended * f64::from(inverse_power(2 * pair.level));
            count = count.wrapping_sub(1);
            next = waiting.get(count).copied();
        }
        sum * (1.0 / 255.0)
    }

    fn node(&self, square: u32) -> Node {
        self.nodes.get(square as usize).copied().unwrap_or_default()
    }
}

/// A square of a map during a walk, and that of a tree, or the average of the tree where it has ended.
#[derive(Clone, Copy, Default)]
struct Pair {
    seen: u32,
    square: Option<u32>,
    average: f32,
    /// Of the children.
    level: u32,
}

impl Pair {
    #[inline(always)]
    fn values(&self, tree: &Tree<4>) -> [f32; 4] {
        self.square.map_or([self.average; 4], |square| tree.children(square))
    }
}

impl Quadtree for Visibility<'_> {
    #[inline(always)]
    fn average(&self) -> f32 {
        self.average
    }

    #[inline(always)]
    fn root_square(&self) -> Option<u32> {
        if self.nodes.is_empty() { None } else { Some(0) }
    }

    #[inline(always)]
    fn children(&self, square: u32) -> [f32; 4] {
        self.node(square).average.map(|share| f32::from(share) * (1.0 / 255.0))
    }

    #[inline(always)]
    fn child_square(&self, square: u32, c: u32) -> Option<u32> {
        let node = self.node(square);
        let bit = 1 << (c & 3);
        let before = (node.mask() & (bit - 1)).count_ones();
        if node.mask() & bit == 0 { None } else { Some(node.first().wrapping_add(before)) }
    }
}
