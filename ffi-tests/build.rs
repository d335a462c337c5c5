//! Generates the bindings from the headers that clients read, and links the library that they link.
//!
//! The shared library comes from WIS_LIB_DIR, or from the `build/lib` that `make lib` fills; programs find it there
//! again at run time.

use std::env;
use std::path::{Path, PathBuf};

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    println!("cargo::rerun-if-changed=build.rs");
    bindings(&["wis.h", "wis_lights.h", "wis_wavelets.h"].map(|file| root.join("include").join(file)));
    link(&root.join("build/lib"));
    // embree3-sys leaves the library out where the variable CI is set.
    println!("cargo::rustc-link-lib=dylib=embree3");
}

fn bindings(headers: &[PathBuf]) {
    for header in headers {
        println!("cargo::rerun-if-changed={}", header.display());
    }
    let target = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR")).join("wis.rs");
    bindgen::builder()
        .headers(headers.iter().map(|header| header.display().to_string()))
        .allowlist_item("(wis|WIS)_.*")
        .prepend_enum_name(false)
        .derive_default(true)
        .generate()
        .expect("bindings of the headers")
        .write_to_file(target)
        .expect("a writable OUT_DIR");
}

fn link(default: &Path) {
    println!("cargo::rerun-if-env-changed=WIS_LIB_DIR");
    let folder = env::var_os("WIS_LIB_DIR").map_or(default.to_path_buf(), PathBuf::from);
    println!("cargo::rerun-if-changed={}", folder.join("libwis.so").display());
    println!("cargo::rustc-link-search=native={}", folder.display());
    println!("cargo::rustc-link-lib=dylib=wis");
    println!("cargo::rustc-link-arg=-Wl,-rpath,{}", folder.display());
}
