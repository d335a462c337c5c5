//! The ids and checksums that stored objects would have if they had been built so: bytes that were changed are signed by them, as an
//! attacker would. For the fuzzer and for the tests, and written apart from the library's own.

use std::mem::offset_of;
use wis::blob::{CHECKSUM, checksum};
use wis::numeric::ContentHash;
use wis::product::stored::Header;

/// Where objects say how long they are.
const LENGTH: usize = 8;
/// Where the parts of an environment's header stand that its hashes cover, and where it ends.
const TABLES_HASH: usize = 24;
pub const POWER: usize = 32;
pub const FRAME: usize = 304;
pub const HEADER: usize = 344;
/// Where nodes of visibility begin, and their bytes.
const NODES: usize = 24;
const NODE: usize = 8;

/// The id of what bytes of a kind say they are; none if they are too few for that, or are of a kind that is never opened.
pub fn content_id(kind: &str, bytes: &[u8]) -> Option<u64> {
    match kind {
        "wis_environment" => environment(bytes).map(|[_, id]| id),
        "wis_visibility" => {
            let nodes = (word(bytes, LENGTH)? as usize).checked_mul(NODE)?;
            Some(checksum(bytes.get(..nodes.checked_add(NODES)?)?))
        }
        "wis_product" => {
            let length = word(bytes.get(..size_of::<Header>())?, offset_of!(Header, bytes))?;
            Some(checksum(bytes.get(..length as usize)?))
        }
        "wis_tree" | "wis_jitter" => Some(checksum(bytes.get(..(long(bytes, LENGTH)? as usize).min(bytes.len()))?)),
        _ => None,
    }
}

/// Writes the hashes that belong to the bytes: all kinds keep theirs in the same place.
pub fn sign(kind: &str, bytes: &mut [u8]) {
    let (tables, id) = match (kind, environment(bytes)) {
        ("wis_environment", Some([tables, id])) => (Some(tables), Some(id)),
        _ => (None, content_id(kind, bytes)),
    };
    for (at, hash) in [(TABLES_HASH, tables), (CHECKSUM.start, id)] {
        hash.iter().for_each(|hash| bytes[at..at + 8].copy_from_slice(&hash.to_le_bytes()));
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn long(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// The hash of an environment's tables, and its id.
fn environment(bytes: &[u8]) -> Option<[u64; 2]> {
    // How long it is depends on its pixels: memory may be longer.
    let end = (long(bytes, LENGTH)? as usize).min(bytes.len());
    let mut tables = ContentHash::new();
    for part in [bytes.get(POWER..FRAME)?, bytes.get(HEADER..end.max(HEADER))?] {
        // Word k goes into stream k % 4.
        let mut streams = [tables; 4];
        for (k, word) in part.chunks(8).enumerate() {
            let mut eight = [0; 8];
            eight[..word.len()].copy_from_slice(word);
            streams[k % 4].add(u64::from_le_bytes(eight));
        }
        streams.iter().for_each(|stream| tables.add(stream.finish()));
    }
    let (tables, mut hash) = (tables.finish(), ContentHash::new());
    hash.add(tables);
    bytes
        .get(FRAME..FRAME + 36)?
        .chunks_exact(4)
        .filter_map(|four| word(four, 0))
        .for_each(|word| hash.add(word.into()));
    Some([tables, hash.finish()])
}
