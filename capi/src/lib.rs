//! The static and the shared C library: a panic handler for the kernel, which never panics.
#![no_std]

extern crate wis as _;

#[panic_handler]
fn unreachable(_: &core::panic::PanicInfo) -> ! {
    loop {}
}
