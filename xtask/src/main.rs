//! Chores of the repository that need Rust: `cargo run -p xtask -- header [--check]`.

mod header;

use std::path::Path;
use std::process::ExitCode;

const USAGE: &str = "usage: cargo run -p xtask -- header [--check]
  header          writes the headers in include/ from the C boundary in src/
  header --check  fails if a header differs by a byte from what `header` would write";

fn main() -> ExitCode {
    // Set by `cargo run`; the value at compile time may be another checkout's that shares the target folder.
    let package = std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| "xtask".into());
    let root = Path::new(&package).join("..");
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let outcome = match arguments.as_slice() {
        ["header"] => header::write(&root),
        ["header", "--check"] => header::check(&root),
        _ => Err(USAGE.into()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
