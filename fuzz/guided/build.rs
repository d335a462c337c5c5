//! The kernel is a shared library that is opened at run time: it must find the engine's counters in this program.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-link-arg-bins=-rdynamic");
}
