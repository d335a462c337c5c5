//! Objects that earlier calls built, in read-only memory, and corrupted ones with the right hash.

use crate::memory::{CAPACITY, Memory, Place};
use crate::random::Random;
use crate::sign::sign;
use wis::blob::CHECKSUM;

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
    if kind != "wis_product" || bytes.get(CHECKSUM).is_some_and(|id| id != [0; 8]) {
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
