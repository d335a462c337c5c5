//! Curves of lists of wavelets.

use crate::trees::{Stored, VERBS, made, of, visibility};
use crate::world::{World, counted};
use std::ptr::null_mut;
use wis::ffi::wavelets::sparse::*;
use wis::ffi::wavelets::tree::*;
use wis::ffi::wavelets::triple::*;
use wis::ffi::wavelets::visibility::*;
use wis::wavelets::sparse::Details;
use wis::wavelets::triple::Wavelets;
use wis::wavelets::tripling::BasisFunction;

const PIXELS: [usize; 4] = [64, 256, 1024, 4096];
const COUNTS: [usize; 3] = [64, 256, 1024];

fn constant(_: f64) -> f64 {
    1.0
}

fn linear(n: f64) -> f64 {
    n
}

pub fn run(w: &mut World) {
    selections(w);
    integrals(w);
    products(w);
    trees(w);
    coefficients(w);
}

fn selections(w: &mut World) {
    w.curve("wis_triple_terms", "pixels, error", &PIXELS, linear, |w, n| {
        let (tree, mut terms) = (Stored::planar(w, n, 1), 0);
        counted!(w, wis_triple_terms(tree.handle(), WIS_TERMS_ERROR, 0.1, &mut terms));
    });
    w.curve("wis_triple_terms", "pixels, threshold", &PIXELS, linear, |w, n| {
        let (tree, mut terms) = (Stored::planar(w, n, 1), 0);
        counted!(w, wis_triple_terms(tree.handle(), WIS_TERMS_THRESHOLD, 0.1, &mut terms));
    });
    w.curve("wis_triple_select", "pixels, wavelets", &PIXELS, linear, |w, n| {
        let (tree, mut out, mut count) = (Stored::planar(w, n, 1), vec![Wavelets::default(); n], 0);
        counted!(
            w,
            wis_triple_select(
                tree.handle(),
                WIS_SELECT_WAVELETS,
                n as u32 / 2,
                out.as_mut_ptr(),
                &mut count,
                null_mut()
            )
        );
    });
    w.curve("wis_triple_select", "pixels, squares", &PIXELS, linear, |w, n| {
        let (tree, mut out, mut count) = (Stored::planar(w, n, 1), vec![Wavelets::default(); n], 0);
        counted!(
            w,
            wis_triple_select(
                tree.handle(),
                WIS_SELECT_SQUARES,
                n as u32 / 8,
                out.as_mut_ptr(),
                &mut count,
                null_mut()
            )
        );
    });
    w.curve("wis_sparse_select", "pixels", &PIXELS, linear, |w, n| {
        let (tree, mut out, mut count) = (Stored::planar(w, n, 1), vec![Details::default(); n], 0);
        counted!(w, wis_sparse_select(tree.handle(), n as u32 / 2, out.as_mut_ptr(), &mut count, null_mut()));
    });
}

/// Squares of the level that is just fine enough, next to each other: their ancestors are few.
fn dense(count: usize) -> Vec<(u64, u32)> {
    let level = count.ilog2() / 2;
    (0..count as u64).map(|square| (square << (2 * (12 - level)), level)).collect()
}

/// Squares of the finest level, far from each other: each has ancestors of its own.
fn scattered(count: usize) -> Vec<(u64, u32)> {
    (0..count as u64).map(|square| ((square * ((1 << 24) / count as u64)) & !3, 11)).collect()
}

/// A way to place squares.
type Places = fn(usize) -> Vec<(u64, u32)>;

const PLACES: [(&str, Places); 2] = [("count", dense), ("count, scattered", scattered)];

fn wavelets(places: Places, count: usize, seed: f32) -> Vec<Wavelets> {
    let wavelet =
        |(position, level): (u64, u32)| Wavelets { position: position as u32, level, detail: [seed, 0.1, -seed] };
    places(count).into_iter().map(wavelet).collect()
}

fn details(places: Places, count: usize, seed: f32) -> Vec<Details> {
    let mut detail = [0.0; 16];
    detail[1..4].copy_from_slice(&[seed, 0.1, -seed]);
    let element = |(position, level)| Details { position, level, detail, ..Details::default() };
    places(count).into_iter().map(element).collect()
}

fn integrals(w: &mut World) {
    for (input, places) in PLACES {
        for function in ["wis_triple_sublinear", "wis_visibility_integral"] {
            w.curve(function, input, &COUNTS, linear, |w, n| integral(w, function, places, n, 1024));
        }
    }
    for function in ["wis_triple_sublinear", "wis_visibility_integral"] {
        w.curve(function, "pixels", &PIXELS, f64::log2, |w, n| integral(w, function, scattered, 64, n));
    }
}

fn integral(w: &mut World, function: &str, places: Places, count: usize, pixels: usize) {
    let (brdf, kept) = (wavelets(places, count, 0.2), wavelets(places, count, 0.3));
    let (light, seen, mut out) = (Stored::planar(w, pixels, 1), Stored::planar(w, pixels, 2), 0.0);
    let (n, brdf, kept, light, none) = (count as u32, brdf.as_ptr(), kept.as_ptr(), light.handle(), null_mut());
    if function == "wis_triple_sublinear" {
        counted!(w, wis_triple_sublinear(1.0, n, brdf, n, kept, light, seen.handle(), &mut out, none));
    } else {
        let seen = visibility(w, &seen);
        counted!(w, wis_visibility_integral(1.0, n, brdf, n, kept, light, seen.of(), &mut out, none));
    }
}

fn set(list: &[Wavelets]) -> WaveletSet {
    let (size, count) = (size_of::<WaveletSet>() as u32, list.len() as u32);
    WaveletSet { size, count, average: 1.0, wavelets: list.as_ptr() }
}

fn detail_set(list: &[Details]) -> DetailSet {
    let (size, count) = (size_of::<DetailSet>() as u32, list.len() as u32);
    DetailSet { size, axes: 2, count, reserved: 0, average: 1.0, details: list.as_ptr() }
}

fn products(w: &mut World) {
    for (input, places) in PLACES {
        w.curve("wis_triple_multiply", input, &COUNTS, linear, |w, n| {
            let (e, f) = (wavelets(places, n, 0.2), wavelets(places, n, 0.3));
            let (mut out, mut count, mut average) = (vec![Wavelets::default(); 24 * n], 0, 0.0);
            let (e, f, room, out) = (set(&e), set(&f), out.len() as u32, out.as_mut_ptr());
            counted!(w, wis_triple_multiply(&e, &f, room, out, &mut count, &mut average, null_mut()));
        });
        w.curve("wis_sparse_multiply", input, &COUNTS, linear, |w, n| {
            let (e, f) = (details(places, n, 0.2), details(places, n, 0.3));
            let (mut out, mut count, mut average) = (vec![Details::default(); 24 * n], 0, 0.0);
            let (e, f, room, out) = (detail_set(&e), detail_set(&f), out.len() as u32, out.as_mut_ptr());
            counted!(w, wis_sparse_multiply(&e, &f, room, out, &mut count, &mut average, null_mut()));
        });
    }
    w.curve("wis_triple_blend", "elements", &COUNTS, linear, |w, n| blend(w, 4, n));
    w.curve("wis_triple_blend", "lists", &[1, 4, 16], linear, |w, n| blend(w, n, 256));
}

fn blend(w: &mut World, lists: usize, count: usize) {
    let list = wavelets(dense, count, 0.2);
    let (pointers, counts, weights) = (vec![list.as_ptr(); lists], vec![count as u32; lists], vec![0.25; lists]);
    let (mut out, mut written) = (vec![Wavelets::default(); lists * count], 0);
    let (pointers, counts, weights, room) = (pointers.as_ptr(), counts.as_ptr(), weights.as_ptr(), out.len() as u32);
    let (lists, out, none) = (lists as u32, out.as_mut_ptr(), null_mut());
    counted!(w, wis_triple_blend(lists, pointers, counts, weights, room, out, &mut written, none));
}

fn trees(w: &mut World) {
    for (input, places) in PLACES {
        for (function, is_query) in VERBS {
            w.curve(function, &format!("wavelets, {input}"), &COUNTS, linear, |w, n| {
                let list = wavelets(places, n, 0.2);
                let (count, wavelets) = (n as u32, list.as_ptr());
                let config = TreeConfig { count, wavelets, average: 1.0, least: 0.1, ..of(WIS_TREE_WAVELETS) };
                made(w, &config, is_query);
            });
            w.curve(function, &format!("details, {input}"), &COUNTS, linear, |w, n| {
                let list = details(places, n, 0.2);
                let (dimensions, count, details) = (2, n as u32, list.as_ptr());
                let config =
                    TreeConfig { dimensions, count, details, average: 1.0, least: 0.1, ..of(WIS_TREE_DETAILS) };
                made(w, &config, is_query);
            });
        }
    }
}

fn coefficients(w: &mut World) {
    w.curve("wis_tripling_coefficient", "level", &[4, 16, 31], constant, |w, n| {
        let function = |level: u32| BasisFunction { level, translation: [0; 4], wavelet: 1 };
        let (i, j, k, mut coefficient) = (function(n as u32), function(n as u32), function(0), 0.0);
        counted!(w, wis_tripling_coefficient(4, 4, &i, &j, &k, &mut coefficient));
    });
}
