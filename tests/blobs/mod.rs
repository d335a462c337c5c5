//! Stored bytes that were cut or changed: the calls that open them answer WIS_CORRUPT or ask for more bytes and
//! write nothing; whatever they do accept can be used without harm.

mod jitter;
mod light;
mod product;
mod tree;
mod versions;
mod visibility;

use crate::arguments::block::Block;
use crate::support::Random;
use crate::support::sign::{content_id, sign};
use wis::ffi::Diagnostic;
use wis::status::Status;

/// A kind of stored object.
struct Kind {
    /// Some objects of the kind.
    objects: fn() -> Vec<Vec<u8>>,
    /// Opens a block that claims to be so many bytes long. On failure asserts that no result was written.
    open: fn(&Block, usize) -> (Status, Diagnostic),
    /// As the header has it.
    name: &'static str,
    /// Calls everything that takes the object.
    exercise: fn(&Block),
    /// Bytes of the header.
    header: usize,
    /// The number of the argument that is the memory.
    memory: u32,
}

const KINDS: [Kind; 4] = [jitter::KIND, product::KIND, tree::KIND, visibility::KIND];
/// Every kind of object stores its content id here, and environments and trees their length.
const BYTES: usize = 8;
const CONTENT_ID: usize = 16;

fn word(bytes: &[u8], offset: usize) -> u32 {
    u32::from_ne_bytes(bytes[offset..offset + 4].try_into().unwrap())
}

fn long(bytes: &[u8], offset: usize) -> u64 {
    u64::from_ne_bytes(bytes[offset..offset + 8].try_into().unwrap())
}

fn put(bytes: &mut [u8], offset: usize, value: &[u8]) {
    bytes[offset..offset + value.len()].copy_from_slice(value);
}

impl Kind {
    fn open(&self, bytes: &[u8]) -> Status {
        (self.open)(&Block::new(bytes, 0), bytes.len()).0
    }

    /// Opens sealed bytes and, if they are accepted, uses them.
    fn open_sealed(&self, bytes: &[u8]) -> Status {
        let mut bytes = bytes.to_vec();
        sign(self.name, &mut bytes);
        let block = Block::new(&bytes, 0);
        let (status, _) = (self.open)(&block, bytes.len());
        if status == Status::Ok {
            (self.exercise)(&block);
        }
        status
    }
}

#[test]
fn what_is_built_opens_anywhere() {
    for kind in KINDS {
        for object in (kind.objects)() {
            let block = Block::new(&object, 16);
            assert_eq!((kind.open)(&block, object.len()).0, Status::Ok);
            assert_eq!((kind.open)(&block, usize::MAX).0, Status::Ok);
            (kind.exercise)(&block);
        }
    }
}

/// The test's own content id is the library's; the tests with sealed bytes rest on it.
#[test]
fn content_ids() {
    for kind in KINDS {
        for object in (kind.objects)() {
            assert_eq!(content_id(kind.name, &object), Some(long(&object, CONTENT_ID)));
        }
    }
}

/// Every length that is too short is answered with the length of the object, or at first of its header.
#[test]
fn cut_bytes() {
    for kind in KINDS {
        for object in (kind.objects)() {
            for len in 0..object.len() {
                let (status, diagnostic) = (kind.open)(&Block::new(&object[..len], 0), len);
                assert_eq!(status, Status::MemoryTooSmall);
                let needed = if len < kind.header { kind.header } else { object.len() };
                assert_eq!((diagnostic.argument, diagnostic.bytes_needed), (kind.memory, needed as u64));
            }
        }
    }
}

fn assert_rejected(status: Status, context: &str) {
    assert!(matches!(status, Status::Corrupt | Status::MemoryTooSmall), "{context}: {status:?}");
}

/// No bit is without meaning: every one of the first 512 bytes, then every 61st, so that all places in a word have their turn.
#[test]
fn one_bit() {
    for kind in KINDS {
        for mut object in (kind.objects)() {
            let headers = 8 * object.len().min(512);
            for bit in (0..headers).chain((headers..8 * object.len()).step_by(61)) {
                object[bit / 8] ^= 1 << (bit % 8);
                assert_rejected(kind.open(&object), &format!("byte {} of {}", bit / 8, object.len()));
                object[bit / 8] ^= 1 << (bit % 8);
            }
        }
    }
}

#[test]
fn many_bytes() {
    for kind in KINDS {
        for object in (kind.objects)() {
            for seed in 0..2000 {
                let mut random = Random(seed);
                let mut changed = object.clone();
                for _ in 0..1 + random.bits() % 16 {
                    let place = random.bits() as usize % changed.len();
                    changed[place] = random.bits() as u8;
                }
                if changed != object {
                    assert_rejected(kind.open(&changed), &format!("seed {seed}"));
                }
            }
        }
    }
}

/// Numbers that are likely to break something.
const NUMBERS: [u32; 16] = [
    0,
    1,
    2,
    3,
    4,
    12,
    13,
    15,
    16,
    0x7f7f_ffff,
    0x7f80_0000,
    0x7fc0_0000,
    0x8000_0000,
    0xbf80_0000,
    0x7fff_ffff,
    0xffff_ffff,
];

/// Changed words under a content id that fits: most are refused, the rest may be nonsense, but does no harm.
#[test]
fn sealed_words() {
    let mut accepted = 0;
    for kind in KINDS {
        for object in (kind.objects)() {
            for seed in 0..1000 {
                let mut random = Random(seed);
                let mut changed = object.clone();
                for _ in 0..1 + random.bits() % 3 {
                    let in_header = random.bits() % 2 == 0;
                    let place = 4 * (random.bits() as usize % (if in_header { kind.header } else { object.len() } / 4));
                    let number = NUMBERS[random.bits() as usize % NUMBERS.len()];
                    put(&mut changed, place, &number.to_ne_bytes());
                }
                let status = kind.open_sealed(&changed);
                let refused = matches!(status, Status::Corrupt | Status::MemoryTooSmall | Status::Mismatch);
                assert!(status == Status::Ok || refused, "{status:?}");
                accepted += u32::from(status == Status::Ok);
            }
        }
    }
    assert!(accepted > 100, "the content ids fit: {accepted}");
}

/// A sealed object that is changed at one place is refused.
fn assert_refuses(kind: &Kind, object: &[u8], offset: usize, value: &[u8], context: &str) {
    let mut changed = object.to_vec();
    put(&mut changed, offset, value);
    assert_ne!(changed, object, "{context}");
    assert_rejected(kind.open_sealed(&changed), context);
}

/// Numbers that no average, power or error can be.
const NO_AMOUNTS: [f64; 4] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0];

/// An array of links behind which nothing is a tree: offsets of `first` and `mask` in a link, and values.
const NO_LINKS: [(usize, u32, &str); 8] = [
    (0, 0, "the root is its own child"),
    (0, 2, "the first child is left out"),
    (0, 1_000_000, "children out of range"),
    (0, u32::MAX, "children far out of range"),
    (4, 0, "children without a parent"),
    (4, 1 << 16, "a child that no square has"),
    (4, u32::MAX, "more children than a square has"),
    (4, 1, "fewer children than squares"),
];
