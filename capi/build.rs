//! Gives the shared library its SONAME and names the C library that its memcpy comes from.
//!
//! `flags` is for rustc as it compiles all that the library is made of: builders and checks for size. Lanes of kernels are written out, so that
//! the compiler finds no others to gain by; its copies of loops and of functions, and what aligns loops, are a tenth of the code. What is hot says
//! `inline`.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        // What may break the binary interface: a minor version before 1.0, a major version from then on.
        let abi = match (env!("CARGO_PKG_VERSION_MAJOR"), env!("CARGO_PKG_VERSION_MINOR")) {
            ("0", minor) => format!("0.{minor}"),
            (major, _) => major.into(),
        };
        println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libwis.so.{abi}");
        println!("cargo::rustc-cdylib-link-arg=-lc");
    }
}
