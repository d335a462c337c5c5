//! Visibility in 8 bits: a tree of which each square takes 8 bytes, for one map a vertex (Ng et al. 2004, Section 7.1.1).
//!
//! A square keeps the averages of its four children as bytes, and where its kept children stand: an indexed look-up
//! without a hash. Where visibility is 0 or 1 nothing is lost; averages of larger squares are off by 1/510 at most.

use crate::blob::{Magic, Part, Size, has_checksum, header, write_checksum, write_header};
use crate::numeric::inverse_power;
use crate::status::{Result, Status};
use crate::wavelets::tree::{MAX_DEPTH, NO_SQUARE, Spot, Tree, is_tree};
use crate::wavelets::triple::Quadtree;
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
    const MAGIC: u64 = u64::from_le_bytes(*b"wis-vis\x04");
}

impl Header {
    /// The bytes of the map that begins with this; `None` if none does.
    pub fn length(&self) -> Option<usize> {
        bytes(self.nodes as usize).filter(|_| self.magic == Header::MAGIC)
    }
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
    let header = Header { magic: Header::MAGIC, nodes: nodes.len() as u32, average, checksum: 0 };
    write_header(memory, &header);
    write_checksum(memory);
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
        Some(Visibility { average: header.average, nodes })
    }

    /// The map that bytes hold, checked. Reads all bytes once.
    ///
    /// # Errors
    /// [`Status::Corrupt`].
    pub fn open(bytes: &'a [u8]) -> Result<Visibility<'a>> {
        // Any share is a valid one, so that nothing but the checksum tells a changed byte.
        let Visibility { average, nodes } =
            Visibility::view(bytes).filter(|_| has_checksum(bytes)).ok_or(Status::Corrupt)?;
        Visibility::new(average, nodes)
    }

    /// Nodes that somebody stored.
    ///
    /// # Errors
    /// [`Status::Corrupt`] unless they are a tree of at most [`MAX_DEPTH`] levels in breadth-first order, and the average is
    /// a share.
    pub fn new(average: f32, nodes: &'a [Node]) -> Result<Visibility<'a>> {
        let ended = nodes.iter().all(|node| node.mask() != 0 || node.below == 0);
        let is_tree = is_tree(MAX_DEPTH, nodes.iter().map(|node| (node.first(), node.mask())));
        let sound = ended && is_tree && (0.0..=1.0).contains(&average);
        if sound { Ok(Visibility { average, nodes }) } else { Err(Status::Corrupt) }
    }

    /// The integral over the unit square of a tree that is seen through this map: a double product. One visit of each square
    /// that the map keeps, and exact where visibility is 0 or 1, since only squares on which it is constant add to the sum.
    pub fn product_integral(&self, tree: &Tree<4>) -> f64 {
        let (seen, mut sum) = (self.root(), 0.0);
        if !seen.varies() {
            return f64::from(tree.average()) * f64::from(self.average);
        }
        self.add_product(tree, seen, tree.root(), 1, &mut sum);
        sum * (1.0 / 255.0)
    }

    /// Adds 255 times the integral over a square of the map, where the tree is at this spot; `level` is that of the children.
    fn add_product(&self, tree: &Tree<4>, seen: Spot, spot: Spot, level: u32, sum: &mut f64) {
        let node = self.node(seen.square);
        let of_tree = tree.all_below(spot);
        let mask = if level < MAX_DEPTH { node.mask() } else { 0 };
        let mut ended = 0.0;
        for (c, (spot, share)) in of_tree.iter().zip(node.average).enumerate() {
            ended += if mask >> c & 1 == 0 { f64::from(spot.average) * f64::from(share) } else { 0.0 };
        }
        *sum += ended * f64::from(inverse_power(2 * level));
        for (c, spot) in (0..4).zip(of_tree).filter(|(c, _)| mask >> c & 1 == 1) {
            self.add_product(tree, self.below(seen, c), spot, level + 1, sum);
        }
    }

    fn node(&self, square: u32) -> Node {
        self.nodes.get(square as usize).copied().unwrap_or_default()
    }
}

impl Quadtree for Visibility<'_> {
    fn root(&self) -> Spot {
        Spot { square: if self.nodes.is_empty() { NO_SQUARE } else { 0 }, average: self.average }
    }

    fn below(&self, spot: Spot, c: u32) -> Spot {
        let node = self.node(spot.square);
        let bit = 1 << (c & 3);
        let child = node.first().wrapping_add((node.mask() & (bit - 1)).count_ones());
        let average = self.children(spot.square)[c as usize & 3];
        Spot { square: if node.mask() & bit == 0 { NO_SQUARE } else { child }, average }
    }

    fn children(&self, square: u32) -> [f32; 4] {
        self.node(square).average.map(|share| f32::from(share) * (1.0 / 255.0))
    }
}
