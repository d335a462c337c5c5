//! The static and the shared C library: a panic handler for the kernel, which never panics.
#![no_std]

#[cfg(panic = "unwind")]
compile_error!(
    "wis-capi aborts on panic, which only its release profile says: cargo build --release --package wis-capi"
);

extern crate wis as _;

#[cfg(not(panic = "unwind"))]
#[panic_handler]
fn unreachable(_: &core::panic::PanicInfo) -> ! {
    loop {}
}
