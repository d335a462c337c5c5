//! The rows that the client gives.

use super::block::Block;
use super::call::Call;
use super::objects::function;
use super::scene::Scene;
use std::ffi::c_void;
use std::ptr::null;
use wis::ffi::wavelets::environment::*;
use wis::status::Status;

/// Rows from a callback, of which `user` tells the first that is missing.
struct Supply {
    pixels: *const u8,
    row_bytes: usize,
    missing: u32,
}

unsafe extern "C" fn supply(user: *mut c_void, y: u32) -> *const c_void {
    // SAFETY: `user` is the supply.
    let supply = unsafe { &*user.cast::<Supply>() };
    if y == supply.missing {
        return null();
    }
    supply.pixels.wrapping_add(y as usize * supply.row_bytes).cast()
}

/// Rows of a callback give what an array gives; a row that is missing is named.
#[test]
fn rows_of_a_callback() {
    let scene = Scene::new();
    let init = function("wis_wavelet_light_init");
    let expected = Call::valid(&scene, &init);
    expected.succeeds("an array");
    for missing in [0, 1, 2, u32::MAX] {
        let mut supplied = Supply { pixels: null(), row_bytes: 6 * 12, missing };
        let mut call = Call::valid(&scene, &init);
        call.edit("config", |c: &mut EnvironmentConfig| {
            supplied.pixels = std::mem::replace(&mut c.pixels, null()).cast();
            c.row = Some(supply);
            c.row_user = (&raw mut supplied).cast();
        });
        if missing == u32::MAX {
            call.succeeds("every row");
            assert_eq!(call.bytes("memory"), expected.bytes("memory"));
        } else {
            let diagnostic = call.fails("a row is missing", Status::CallbackFailed, "config");
            assert_eq!((diagnostic.x, diagnostic.y), (0, missing));
        }
    }
}

/// Rows may stand at any address, in any order and at any distance.
#[test]
fn strides_of_rows() {
    let scene = Scene::new();
    let init = function("wis_wavelet_light_init");
    let expected = Call::valid(&scene, &init);
    expected.succeeds("packed");
    for (stride, address) in [(72, 0), (72, 4), (76, 12), (400, 8), (-72, 0), (-80, 4)] {
        let mut call = Call::valid(&scene, &init);
        let mut rows = Block::new(&[0xff; 1024], 0);
        call.edit("config", |c: &mut EnvironmentConfig| {
            let start = if stride < 0 { 512 } else { address };
            for y in 0..3isize {
                // SAFETY: the map has three rows of 72 bytes.
                let row = unsafe { std::slice::from_raw_parts(c.pixels.cast::<u8>().add(72 * y as usize), 72) };
                let at = (start as isize + y * stride) as usize;
                rows[at..at + 72].copy_from_slice(row);
            }
            (c.pixels, c.row_stride) = (rows.pointer().wrapping_add(start).cast(), stride);
        });
        call.succeeds("strided rows");
        assert_eq!(call.bytes("memory"), expected.bytes("memory"), "stride {stride}");
    }
}

/// Texels that are not light: rejected and named, or replaced and counted.
#[test]
fn bad_texels() {
    let (scene, init) = (Scene::new(), function("wis_wavelet_light_init"));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for (x, y, channel) in [(0, 0, 0), (5, 0, 2), (3, 1, 1), (0, 2, 0), (5, 2, 2)] {
            let mut pixels = vec![1.0f32; 6 * 3 * 3];
            pixels[(y * 6 + x) * 3 + channel] = bad;
            let mut call = Call::valid(&scene, &init);
            call.edit("config", |c: &mut EnvironmentConfig| c.pixels = pixels.as_ptr().cast());
            let diagnostic = call.fails(&format!("{bad}"), Status::InvalidTexel, "config");
            assert_eq!((diagnostic.x as usize, diagnostic.y as usize), (x, y));
            call.edit("config", |c: &mut EnvironmentConfig| c.flags |= WIS_WAVELET_LIGHT_SANITISE);
            call.succeeds("sanitised");
            call.edit("info", |info: &mut EnvironmentInfo| assert_eq!(info.sanitised, 1));
        }
    }
    for harmless in [0.0, -0.0, -1.0, f32::MAX, 1e-45] {
        let pixels = vec![harmless; 6 * 3 * 3];
        let mut call = Call::valid(&scene, &init);
        call.edit("config", |c: &mut EnvironmentConfig| c.pixels = pixels.as_ptr().cast());
        call.succeeds("a texel");
    }
}

/// Alpha is not light: any bits will do.
#[test]
fn alpha_is_ignored() {
    let (scene, init) = (Scene::new(), function("wis_wavelet_light_init"));
    let build = |alpha: f32| {
        let pixels: Vec<f32> = (0..6 * 3).flat_map(|i| [1.0 + i as f32, 2.0, 0.5, alpha]).collect();
        let mut call = Call::valid(&scene, &init);
        call.edit("config", |c: &mut EnvironmentConfig| {
            (c.channels, c.pixels) = (4, pixels.as_ptr().cast());
        });
        call.succeeds("four channels");
        call.bytes("memory").to_vec()
    };
    let expected = build(1.0);
    assert!([f32::NAN, f32::INFINITY, -1.0].into_iter().all(|alpha| build(alpha) == expected));
}
