//! Bytes of version 0.1, of another kind of object and of another byte order: one status and the field `magic` tell them.
//!
//! The files of `version_0_1` are the smallest objects of each kind that version 0.1 could save, written by its library (4bfe238).

use super::{jitter, light, product, tree, visibility};
use std::ffi::{CStr, c_void};
use std::ptr::{null, null_mut};
use wis::ffi::Diagnostic;
use wis::ffi::light::wis_environment_open;
use wis::ffi::lights::wis_jitter_open;
use wis::ffi::product::wis_product_open;
use wis::ffi::wavelets::tree::wis_tree_open;
use wis::ffi::wavelets::visibility::wis_visibility_open;
use wis::status::Status;

const VERSION_0_1: [(&str, &[u8]); 3] = [
    ("tree", include_bytes!("version_0_1/tree.bin")),
    ("visibility", include_bytes!("version_0_1/visibility.bin")),
    ("jitter", include_bytes!("version_0_1/jitter.bin")),
];

/// Opens bytes in memory.
type Open = fn(*const c_void, usize, *mut Diagnostic) -> Status;

/// A call that opens, by its name, and an object that it accepts.
type Opening = (&'static str, Open, fn() -> Vec<u8>);

// SAFETY, of all: the memory is as long as stated, and the pointers are valid.
const OPENINGS: [Opening; 5] = [
    (
        "wis_environment_open",
        |m, n, d| unsafe { wis_environment_open(m, n, &mut null(), d) },
        || light::built(&[1.0, 2.0, 3.0, 4.0], [2, 2]),
    ),
    (
        "wis_product_open",
        |m, n, d| light::with(|light| unsafe { wis_product_open(light, m, n, &mut null(), d) }),
        || (product::KIND.objects)().remove(0),
    ),
    (
        "wis_jitter_open",
        |m, n, d| unsafe { wis_jitter_open(m, n, &mut null(), d) },
        || (jitter::KIND.objects)().remove(0),
    ),
    (
        "wis_tree_open",
        |m, n, d| unsafe { wis_tree_open(m, n, &mut null(), null_mut(), d) },
        || (tree::KIND.objects)().remove(0),
    ),
    (
        "wis_visibility_open",
        |m, n, d| unsafe { wis_visibility_open(m, n, &mut null(), d) },
        || (visibility::KIND.objects)().remove(0),
    ),
];

#[repr(align(64))]
#[derive(Clone, Copy)]
struct Line([u8; 64]);

/// Memory that is aligned to 64 bytes.
struct Lines(Vec<Line>);

impl Lines {
    /// Bytes, and zeros up to a length.
    fn new(bytes: &[u8], length: usize) -> Lines {
        let mut lines = vec![Line([0; 64]); length.max(bytes.len()).div_ceil(64)];
        lines.iter_mut().zip(bytes.chunks(64)).for_each(|(line, part)| line.0[..part.len()].copy_from_slice(part));
        Lines(lines)
    }

    fn pointer(&mut self) -> *mut c_void {
        self.0.as_mut_ptr().cast()
    }
}

/// Opens bytes of which `length` are claimed, behind them zeros.
fn opened(open: Open, bytes: &[u8], length: usize) -> (Status, Diagnostic) {
    let mut diagnostic = Diagnostic::default();
    (open(Lines::new(bytes, length).pointer(), length, &mut diagnostic), diagnostic)
}

/// WIS_CORRUPT, the argument that is the memory, and the field `magic`: in as many bytes as there are, and in more.
fn assert_told(name: &str, open: Open, bytes: &[u8], context: &str) {
    for length in [bytes.len(), bytes.len().next_multiple_of(64), 4096, 1 << 20] {
        let (status, diagnostic) = opened(open, bytes, length);
        assert_eq!(status, Status::Corrupt, "{name}: {context}, {length} bytes");
        assert!(!diagnostic.field.is_null(), "{name}: {context}, {length} bytes: no field");
        // SAFETY: the library gives a static string.
        let field = unsafe { CStr::from_ptr(diagnostic.field) };
        let memory = if name == "wis_product_open" { 2 } else { 1 };
        assert_eq!((diagnostic.argument, diagnostic.bytes_needed, field), (memory, 0, c"magic"), "{name}: {context}");
    }
}

#[test]
fn version_0_1_is_told() {
    for (kind, bytes) in VERSION_0_1 {
        assert!(bytes.len() % 8 == 0 && bytes.starts_with(b"wis-"), "{kind}");
        OPENINGS.iter().for_each(|(name, open, _)| assert_told(name, *open, bytes, kind));
    }
}

#[test]
fn other_kinds_are_told() {
    for (name, open, own) in OPENINGS {
        assert_eq!(opened(open, &own(), own().len()).0, Status::Ok, "{name}");
        for (other, _, object) in OPENINGS.iter().filter(|(other, ..)| *other != name) {
            assert_told(name, open, &object(), &format!("what {other} opens"));
        }
        assert_told(name, open, &[0; 8], "zeros");
        assert_told(name, open, &[0xff; 512], "ones");
    }
}

/// A machine of the other byte order writes each word the other way round, whichever widths the words have.
#[test]
fn other_byte_orders_are_told() {
    for (name, open, own) in OPENINGS {
        let object = own();
        let swapped = |width: usize, length: usize| {
            let mut bytes = object.clone();
            bytes[..length].chunks_exact_mut(width).for_each(<[u8]>::reverse);
            bytes
        };
        for width in [2, 4, 8] {
            for length in [8, 24, object.len()] {
                assert_told(name, open, &swapped(width, length), &format!("words of {width} in {length} bytes"));
            }
        }
    }
}

/// A byte that was changed behind the magic number is no other version: no field is named.
#[test]
fn changed_bytes_name_no_field() {
    for (name, open, own) in OPENINGS {
        let mut bytes = own();
        *bytes.last_mut().expect("bytes") ^= 1;
        let (status, diagnostic) = opened(open, &bytes, bytes.len());
        assert!(status == Status::Corrupt && diagnostic.field.is_null(), "{name}: {status:?}");
    }
}
