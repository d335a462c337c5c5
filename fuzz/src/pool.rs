//! Objects that earlier calls built, in read-only memory, and corrupted ones with the right hash.

use crate::memory::{CAPACITY, Memory, Place};
use crate::random::Random;
use wis::blob::{CHECKSUM, checksum};
use wis::numeric::ContentHash;

/// An object for the arguments of later calls.
#[derive(Clone, Copy, Debug)]
pub struct Object {
    /// The type in the header: `wis_tree`.
    pub kind: &'static str,
    pub place: Place,
    /// The number of the case that made it.
    pub id: u64,
    /// The object that it was prepared with, which calls take beside it; 0: none.
    pub owner: u64,
    /// Axes of a tree, lights of a jitter.
    pub number: usize,
    /// It was corrupted, or made with one that was.
    pub is_altered: bool,
}

/// The objects of an epoch.
pub struct Pool {
    objects: Vec<Object>,
    first_region: usize,
}

/// Objects of a kind that are kept; a new one then replaces the oldest.
const KEPT: usize = 8;
/// Kinds of objects.
pub const KINDS: [&str; 8] = [
    "wis_environment",
    "wis_sampler",
    "wis_visibility_cache",
    "wis_product",
    "wis_jitter",
    "wis_tree",
    "wis_visibility",
    "wis_material",
];

impl Pool {
    pub const REGIONS: usize = KEPT * KINDS.len();

    pub fn new(first_region: usize) -> Pool {
        Pool { objects: Vec::new(), first_region }
    }

    pub fn clear(&mut self) {
        self.objects.clear();
    }

    /// Copies an object into memory of its own: all of it but `place` is known.
    pub fn keep(&mut self, memory: &Memory, object: Object, bytes: &[u8], random: &mut Random) {
        if bytes.is_empty() || bytes.len() + 64 > CAPACITY {
            return;
        }
        let index = KINDS.iter().position(|kind| *kind == object.kind).expect("a kind of objects");
        let count = self.of(object.kind).len();
        let slot = if count < KEPT { count } else { random.below(KEPT) };
        let place = memory.place(self.first_region + index * KEPT + slot, bytes.len(), 16, 0, random.one_in(2));
        memory.bytes(place).copy_from_slice(bytes);
        let object = Object { place, ..object };
        match self.position(object.kind, slot) {
            Some(position) => self.objects[position] = object,
            None => self.objects.push(object),
        }
    }

    /// All objects with their bytes.
    pub fn snapshot(&self, memory: &Memory) -> Vec<(Object, Vec<u8>)> {
        self.objects.iter().map(|object| (*object, memory.bytes(object.place).to_vec())).collect()
    }

    /// Forgets what was kept since: objects are told apart by their numbers.
    pub fn restore(&mut self, memory: &Memory, snapshot: &[(Object, Vec<u8>)]) {
        self.objects.truncate(snapshot.len());
        for (now, (before, bytes)) in self.objects.iter_mut().zip(snapshot) {
            if now.id != before.id {
                memory.bytes(before.place).copy_from_slice(bytes);
                *now = *before;
            }
        }
    }

    fn position(&self, kind: &str, slot: usize) -> Option<usize> {
        (0..self.objects.len()).filter(|&i| self.objects[i].kind == kind).nth(slot)
    }

    pub fn of(&self, kind: &str) -> Vec<Object> {
        self.objects.iter().copied().filter(|object| object.kind == kind).collect()
    }
}

/// Changes some bytes or words of an object, and signs it anew as an attacker would, nearly always.
pub fn corrupt(kind: &str, bytes: &mut [u8], random: &mut Random) {
    // A product may be without.
    if kind != "wis_product" || long(bytes, CHECKSUM.start) != 0 {
        let before = bytes.to_vec();
        sign(kind, bytes);
        assert!(before == bytes, "the signature of {kind} is not the library's");
    }
    // Headers and small tables as often as what stands behind them.
    for _ in 0..1 + random.below(3) {
        let end = random.pick(&[64, 320, 4096, usize::MAX]).min(bytes.len());
        let at = random.below(end);
        match random.below(4) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.bits() as u8,
            2 => put(bytes, at & !3, &random.hard().to_le_bytes()),
            _ => {
                let from = random.below(bytes.len()) & !3;
                let word: Vec<u8> = bytes[from..].iter().copied().take(4).collect();
                put(bytes, at & !3, &word);
            }
        }
    }
    if !random.one_in(16) {
        sign(kind, bytes);
    }
}

fn put(bytes: &mut [u8], at: usize, value: &[u8]) {
    bytes[at..].iter_mut().zip(value).for_each(|(slot, byte)| *slot = *byte);
}

fn word(bytes: &[u8], at: usize) -> u64 {
    bytes.get(at..at + 4).map_or(0, |word| u64::from(u32::from_le_bytes(word.try_into().expect("four"))))
}

fn long(bytes: &[u8], at: usize) -> u64 {
    word(bytes, at) | word(bytes, at + 4) << 32
}

/// Where the nodes of visibility begin.
const VISIBILITY_NODES: usize = 24;

/// Writes the hashes that the bytes would have if they had been built so: all kinds keep theirs in the same place.
fn sign(kind: &str, bytes: &mut [u8]) {
    let id = match kind {
        "wis_environment" if bytes.len() > ENVIRONMENT.header => sign_environment(bytes),
        "wis_tree" if bytes.len() >= 64 => tree_id(bytes),
        "wis_visibility" if bytes.len() >= VISIBILITY_NODES => visibility_checksum(bytes),
        "wis_product" | "wis_jitter" if bytes.len() >= CHECKSUM.end => checksum(bytes),
        // The others are not opened.
        _ => return,
    };
    put(bytes, CHECKSUM.start, &id.to_le_bytes());
}

/// Where an environment says how long it is.
const LENGTH: usize = 8;

/// Where the parts of an environment's header stand that its hashes cover.
struct EnvironmentHeader {
    tables_hash: usize,
    power: usize,
    frame: usize,
    header: usize,
}

const ENVIRONMENT: EnvironmentHeader = EnvironmentHeader { tables_hash: 24, power: 32, frame: 304, header: 344 };

fn sign_environment(bytes: &mut [u8]) -> u64 {
    let EnvironmentHeader { tables_hash, power, frame, header } = ENVIRONMENT;
    let mut tables = ContentHash::new();
    // How long it is depends on its pixels: memory may be longer.
    let end = (long(bytes, LENGTH) as usize).clamp(header, bytes.len());
    for part in [&bytes[power..frame], &bytes[header..end]] {
        // Word k goes into stream k % 4.
        let mut streams = [tables; 4];
        for (k, word) in part.chunks(8).enumerate() {
            let mut eight = [0; 8];
            put(&mut eight, 0, word);
            streams[k % 4].add(u64::from_le_bytes(eight));
        }
        streams.iter().for_each(|stream| tables.add(stream.finish()));
    }
    let tables = tables.finish();
    put(bytes, tables_hash, &tables.to_le_bytes());
    let mut hash = ContentHash::new();
    hash.add(tables);
    (0..9).for_each(|k| hash.add(word(bytes, frame + 4 * k)));
    hash.finish()
}

fn tree_id(bytes: &[u8]) -> u64 {
    let mut hash = ContentHash::new();
    [0, 8, 24, 32].iter().for_each(|at| hash.add(long(bytes, *at)));
    hash.add(word(bytes, 52) as u32 as i32 as i64 as u64);
    [40, 44, 48, 56].iter().for_each(|at| hash.add(word(bytes, *at)));
    let (children, squares) = (1usize << (word(bytes, 40) % 5), word(bytes, 48) as usize);
    let links = 64 + 4 * children * squares;
    if squares <= bytes.len() {
        (64..links.min(bytes.len())).step_by(4).for_each(|at| hash.add(word(bytes, at)));
        (links..(links + 8 * squares).min(bytes.len()))
            .step_by(8)
            .for_each(|at| hash.add(word(bytes, at) << 32 | word(bytes, at + 4)));
    }
    hash.finish()
}

fn visibility_checksum(bytes: &[u8]) -> u64 {
    let mut hash = ContentHash::new();
    hash.add(word(bytes, 8) << 32 | word(bytes, 12));
    let nodes = bytes[VISIBILITY_NODES..].chunks_exact(8).take(word(bytes, 8) as usize);
    nodes.for_each(|node| hash.add(word(node, 0) << 32 | word(node, 4)));
    hash.finish()
}
