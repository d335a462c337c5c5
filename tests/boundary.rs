//! The C boundary: every argument that can be wrong, and every stored byte.

mod arguments;
mod blobs;
mod support;
