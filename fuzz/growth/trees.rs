//! Curves of trees, visibility, lists of wavelets and their integrals.

use crate::renderer::{constant, linear};
use crate::world::{Values, World, numbers};

/// Pixels of planar trees.
const PIXELS: [usize; 4] = [64, 256, 1024, 4096];
const COUNTS: [usize; 3] = [64, 256, 1024];
/// The query and the build of a tree.
const VERBS: [&str; 2] = ["wis_tree_size", "wis_tree_init"];

pub fn run(w: &mut World) {
    builds(w);
    lookups(w);
    combined(w);
    integrals(w);
    selections(w);
    lists(w);
}

/// A tree of noise in which every square is kept.
fn noise<'a>(w: &mut World, axes: u32, depth: u32, seed: u64) -> Values<'a> {
    let pixels = w.floats(&numbers(seed, 1 << (axes * depth)));
    vec![(
        "config",
        w.of(
            "wis_tree_config",
            &vec![("dimensions", f64::from(axes)), ("depth", f64::from(depth)), ("pixels", pixels)],
        ),
    )]
}

pub fn stored(w: &mut World, axes: u32, depth: u32, seed: u64) -> f64 {
    w.once(format!("tree {axes} {depth} {seed}"), |w| {
        let config = noise(w, axes, depth, seed);
        w.call("wis_tree_init", &config)
    })
}

/// A planar tree of so many pixels.
fn planar(w: &mut World, pixels: usize, seed: u64) -> f64 {
    stored(w, 2, pixels.ilog2() / 2, seed)
}

fn visible(w: &mut World, pixels: usize, seed: u64) -> f64 {
    let tree = planar(w, pixels, seed);
    w.call("wis_visibility_init", &vec![("tree", tree)])
}

fn builds(w: &mut World) {
    w.curve("wis_tree_size", "pixels", &PIXELS, constant, |w, n| noise(w, 2, n.ilog2() / 2, 1));
    w.curve("wis_tree_size", "bytes by pixels", &PIXELS, linear, |w, n| noise(w, 2, n.ilog2() / 2, 1));
    let axes: [(&str, u32, &[usize]); 2] = [("pixels, 2 axes", 2, &PIXELS), ("pixels, 4 axes", 4, &[256, 4096])];
    for (input, axes, sizes) in axes {
        w.curve("wis_tree_init", input, sizes, linear, |w, n| noise(w, axes, n.ilog2() / axes, 1));
    }
    w.curve("wis_tree_open", "pixels", &PIXELS, linear, |w, n| {
        vec![("memory", planar(w, n, 1)), ("bytes", w.sizes[0] as f64)]
    });
    w.curve("wis_visibility_size", "pixels", &PIXELS, constant, |w, n| vec![("tree", planar(w, n, 1))]);
    w.curve("wis_visibility_size", "bytes by pixels", &PIXELS, linear, |w, n| vec![("tree", planar(w, n, 1))]);
    w.curve("wis_visibility_init", "pixels", &PIXELS, linear, |w, n| vec![("tree", planar(w, n, 1))]);
    w.curve("wis_visibility_open", "pixels", &PIXELS, linear, |w, n| {
        vec![("memory", visible(w, n, 1)), ("bytes", w.sizes[0] as f64)]
    });
}

fn lookups(w: &mut World) {
    for (function, input) in [("wis_tree_sample", "u"), ("wis_tree_pdf", "point"), ("wis_tree_invert", "point")] {
        w.curve(function, "pixels", &PIXELS, f64::log2, |w, n| {
            vec![("tree", planar(w, n, 1)), (input, w.floats(&[0.3, 0.7]))]
        });
    }
    for input in ["count", "count, all alike", "pixels"] {
        let stated = |n: f64| if input == "pixels" { n.log2() } else { n };
        w.curve("wis_warp_in_place", input, &PIXELS, stated, |w, n| {
            let (pixels, count) = if input == "pixels" { (n, 256) } else { (1024, n) };
            let points = if input == "count, all alike" { vec![0.3; 2 * count] } else { numbers(2, 2 * count) };
            let index: Vec<u32> = (0..count as u32).collect();
            let (points, index) = (w.floats(&points), w.integers(&index));
            vec![("tree", planar(w, pixels, 1)), ("points", points), ("index", index), ("count", count as f64)]
        });
    }
}

/// A configuration of a tree from a source.
pub fn of<'a>(w: &mut World, source: &str, more: Values) -> Values<'a> {
    let source = vec![("source", w.constant(source))];
    vec![("config", w.of("wis_tree_config", &[source, more].concat()))]
}

fn combined(w: &mut World) {
    for function in VERBS {
        for (input, axes, sizes) in
            [("product, pixels", [2, 2], &PIXELS[..]), ("product, 4 x 2 axes", [4, 2], &[256, 4096])]
        {
            w.curve(function, input, sizes, linear, |w, n| {
                let depth = n.ilog2() / axes[0];
                let pair = [stored(w, axes[0], depth, 1), stored(w, axes[1], depth, 2)];
                let trees = w.addresses(&pair);
                of(w, "WIS_TREE_PRODUCT", vec![("tree_count", 2.0), ("trees", trees)])
            });
        }
        for (input, sizes) in [("blend, pixels", &PIXELS[..]), ("blend, trees", &[1, 4, 16])] {
            w.curve(function, input, sizes, linear, |w, n| {
                let (pixels, count) = if input == "blend, pixels" { (n, 4) } else { (1024, n) };
                let trees: Vec<f64> = (0..count as u64).map(|seed| planar(w, pixels, seed)).collect();
                let (trees, weight) = (w.addresses(&trees), w.doubles(&vec![0.25; count]));
                of(w, "WIS_TREE_BLEND", vec![("tree_count", count as f64), ("trees", trees), ("weight", weight)])
            });
        }
    }
}

fn integrals(w: &mut World) {
    w.curve("wis_tree_product_integral", "pixels", &PIXELS, linear, |w, n| {
        vec![("e", planar(w, n, 1)), ("f", planar(w, n, 2))]
    });
    w.curve("wis_triple_integral", "pixels", &PIXELS, linear, |w, n| {
        vec![("brdf", planar(w, n, 1)), ("light", planar(w, n, 2)), ("visibility", planar(w, n, 3))]
    });
    w.curve("wis_visibility_product_integral", "pixels", &PIXELS, linear, |w, n| {
        vec![("tree", planar(w, n, 1)), ("visibility", visible(w, n, 2))]
    });
}

fn selections(w: &mut World) {
    for (input, rule) in [("pixels, error", "WIS_TERMS_ERROR"), ("pixels, threshold", "WIS_TERMS_THRESHOLD")] {
        w.curve("wis_triple_terms", input, &PIXELS, linear, |w, n| {
            vec![("tree", planar(w, n, 1)), ("rule", w.constant(rule)), ("bound", 0.1)]
        });
    }
    for (input, rule, part) in
        [("pixels, wavelets", "WIS_SELECT_WAVELETS", 2), ("pixels, squares", "WIS_SELECT_SQUARES", 8)]
    {
        w.curve("wis_triple_select", input, &PIXELS, linear, |w, n| {
            vec![("tree", planar(w, n, 1)), ("rule", w.constant(rule)), ("keep", (n / part) as f64)]
        });
    }
}

/// A way to place squares: their positions and levels.
type Places = fn(usize) -> Vec<(u64, u32)>;

/// Squares of the level that is just fine enough, next to each other: their ancestors are few.
fn dense(count: usize) -> Vec<(u64, u32)> {
    let level = count.ilog2() / 2;
    (0..count as u64).map(|square| (square << (2 * (12 - level)), level)).collect()
}

/// Squares of the finest level, far from each other: each has ancestors of its own.
fn scattered(count: usize) -> Vec<(u64, u32)> {
    (0..count as u64).map(|square| ((square * ((1 << 24) / count as u64)) & !3, 11)).collect()
}

const PLACES: [(&str, Places); 2] = [("count", dense), ("count, scattered", scattered)];

/// Wavelets whose details are a seed, 0.1 and the negative seed.
fn elements(w: &mut World, places: Places, count: usize, seed: f64) -> f64 {
    let element = |(position, level): (u64, u32)| {
        let place = [("position", position as f64), ("level", f64::from(level))];
        [&place[..], &[("detail[0]", seed), ("detail[1]", 0.1), ("detail[2]", -seed)]].concat()
    };
    let all: Vec<Values> = places(count).into_iter().map(element).collect();
    w.list("wis_wavelets", &all)
}

fn integral<'a>(w: &mut World, function: &str, places: Places, count: usize, pixels: usize) -> Values<'a> {
    let [brdf, kept] = [0.2, 0.3].map(|seed| elements(w, places, count, seed));
    let visibility = if function == "wis_visibility_integral" { visible(w, pixels, 2) } else { planar(w, pixels, 2) };
    let (light, count) = (planar(w, pixels, 1), count as f64);
    let lists =
        [("brdf_average", 1.0), ("brdf_count", count), ("brdf", brdf), ("light_count", count), ("kept_light", kept)];
    [&lists[..], &[("light", light), ("visibility", visibility)]].concat()
}

fn lists(w: &mut World) {
    for function in ["wis_triple_sublinear", "wis_visibility_integral"] {
        for (input, places) in PLACES {
            w.curve(function, input, &COUNTS, linear, |w, n| integral(w, function, places, n, 1024));
        }
        w.curve(function, "pixels", &PIXELS, f64::log2, |w, n| integral(w, function, scattered, 64, n));
    }
    for (input, places) in PLACES {
        w.curve("wis_sparse_pack", input, &COUNTS, linear, |w, n| {
            let wavelets = elements(w, places, n, 0.2);
            let packed = w.room(16 + 18 * n);
            vec![
                ("average", 1.0),
                ("count", n as f64),
                ("wavelets", wavelets),
                ("room", (16 + 18 * n) as f64),
                ("packed", packed),
            ]
        });
        w.curve("wis_sparse_unpack", input, &COUNTS, linear, |w, n| {
            let (wavelets, bytes) = (elements(w, places, n, 0.2), (16 + 18 * n) as f64);
            let (packed, list) = (w.room(16 + 18 * n), w.room(20 * n));
            let written =
                [("average", 1.0), ("count", n as f64), ("wavelets", wavelets), ("room", bytes), ("packed", packed)];
            w.call("wis_sparse_pack", &written.to_vec());
            vec![("packed", packed), ("packed_bytes", bytes), ("room", n as f64), ("wavelets", list)]
        });
        for function in VERBS {
            w.curve(function, &format!("wavelets, {input}"), &COUNTS, linear, |w, n| {
                let list = elements(w, places, n, 0.2);
                of(
                    w,
                    "WIS_TREE_WAVELETS",
                    vec![("count", n as f64), ("wavelets", list), ("average", 1.0), ("least", 0.1)],
                )
            });
        }
    }
    for (input, sizes) in [("elements", COUNTS), ("lists", [1, 4, 16])] {
        w.curve("wis_triple_blend", input, &sizes, linear, |w, n| {
            let (lists, count) = if input == "lists" { (n, 256) } else { (4, n) };
            let list = elements(w, dense, count, 0.2);
            let (list, counts) = (w.addresses(&vec![list; lists]), w.integers(&vec![count as u32; lists]));
            let weight = w.doubles(&vec![0.25; lists]);
            let room = (lists * count) as f64;
            vec![("count", lists as f64), ("list", list), ("list_count", counts), ("weight", weight), ("room", room)]
        });
    }
}
