//! Gives the shared library its SONAME and names the C library that its memcpy comes from.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        let major = env!("CARGO_PKG_VERSION_MAJOR");
        println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libwis.so.{major}");
        println!("cargo::rustc-cdylib-link-arg=-lc");
    }
}
