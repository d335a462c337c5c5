//! Curves of wavelet lights, their products and tables.

use crate::renderer::{self, constant, inputs, linear};
use crate::trees::{of, stored};
use crate::world::{Values, World, directions};

const TEXELS: [usize; 3] = [128, 512, 2048];
const COUNTS: [usize; 3] = [64, 256, 1024];
const LOBES: [usize; 2] = [1, 4];

pub fn run(w: &mut World) {
    lights(w);
    products(w);
    tables(w);
    rotated(w);
}

fn config<'a>(w: &mut World, texels: usize, storage: &str, flags: &str) -> Values<'a> {
    let (storage, flags) = (w.constant(storage), if flags.is_empty() { 0.0 } else { w.constant(flags) });
    let fields = [renderer::map(w, texels), vec![("storage", storage), ("flags", flags)]].concat();
    vec![("config", w.of("wis_wavelet_light_config", &fields))]
}

fn light(w: &mut World, texels: usize) -> f64 {
    let config = config(w, texels, "WIS_STORAGE_PYRAMID", "WIS_WAVELET_LIGHT_RGB");
    w.call("wis_wavelet_light_init", &config)
}

fn lights(w: &mut World) {
    w.curve("wis_wavelet_light_size", "texels", &TEXELS, constant, |w, n| config(w, n, "WIS_STORAGE_SPARSE", ""));
    for (input, storage) in
        [("bytes by texels, pyramid", "WIS_STORAGE_PYRAMID"), ("bytes by texels, sparse", "WIS_STORAGE_SPARSE")]
    {
        w.curve("wis_wavelet_light_size", input, &TEXELS, linear, |w, n| config(w, n, storage, ""));
    }
    w.curve("wis_wavelet_light_init", "texels, pyramid", &TEXELS, linear, |w, n| {
        config(w, n, "WIS_STORAGE_PYRAMID", "WIS_WAVELET_LIGHT_RGB")
    });
    w.curve("wis_wavelet_light_init", "texels, sparse", &TEXELS, linear, |w, n| config(w, n, "WIS_STORAGE_SPARSE", ""));
    // The finest cells of a sun take as much room in a small map as in a large one.
    w.at_most("wis_wavelet_light_init", "texels, nearest", &TEXELS, linear, |w, n| {
        config(w, n, "WIS_STORAGE_PYRAMID", "WIS_WAVELET_LIGHT_NEAREST")
    });
    w.curve("wis_wavelet_light_open", "texels", &TEXELS, linear, |w, n| {
        vec![("memory", light(w, n)), ("bytes", w.sizes[0] as f64)]
    });
}

/// The fields of a query: Lambert's lobe and narrower ones.
fn query<'a>(w: &mut World, lobes: usize) -> Values<'a> {
    const NAMES: [[&str; 5]; 4] = [
        ["lobe[0].kind", "lobe[0].weight*", "lobe[0].f0*", "lobe[0].a", "lobe[0].b"],
        ["lobe[1].kind", "lobe[1].weight*", "lobe[1].f0*", "lobe[1].a", "lobe[1].b"],
        ["lobe[2].kind", "lobe[2].weight*", "lobe[2].f0*", "lobe[2].a", "lobe[2].b"],
        ["lobe[3].kind", "lobe[3].weight*", "lobe[3].f0*", "lobe[3].a", "lobe[3].b"],
    ];
    let (lambert, ggx) = (w.constant("WIS_WAVELET_LOBE_LAMBERT"), w.constant("WIS_WAVELET_LOBE_GGX"));
    let mut fields = vec![("lobe_count", lobes as f64), ("normal[2]", 1.0), ("wo[0]", 0.6), ("wo[2]", 0.8)];
    for (names, alpha) in NAMES.into_iter().zip([0.0, 0.4, 0.1, 0.02]).take(lobes) {
        let is_lambert = alpha == 0.0;
        let values = if is_lambert { [lambert, 0.5, 0.0, 0.0, 0.0] } else { [ggx, 0.25, 0.5, alpha, alpha] };
        fields.extend(names.into_iter().zip(values));
    }
    fields
}

/// What is prepared: products of queries that are alike.
fn preparation<'a>(w: &mut World, texels: usize, count: usize, lobes: usize, squares: usize) -> Values<'a> {
    let (light, squares) = (light(w, texels), squares as f64);
    let config = w.of("wis_wavelet_product_config", &vec![("max_squares", squares), ("max_evaluations", squares)]);
    let query = query(w, lobes);
    let queries = w.list("wis_wavelet_query", &vec![query; count]);
    vec![("environment", light), ("config", config), ("count", count as f64), ("query", queries)]
}

fn prepared<'a>(w: &mut World, texels: usize, squares: usize) -> Values<'a> {
    let mut values = preparation(w, texels, 1, 4, squares);
    let product = w.call("wis_wavelet_product_prepare", &values);
    values.retain(|value| value.0 != "count");
    values.push(("product", product));
    values
}

fn products(w: &mut World) {
    const SQUARES: [usize; 3] = [64, 256, 1024];
    let config = |w: &mut World, n: usize| {
        vec![("config", w.of("wis_wavelet_product_config", &vec![("max_squares", n as f64)]))]
    };
    w.curve("wis_wavelet_product_size", "squares", &SQUARES, constant, config);
    w.curve("wis_wavelet_product_size", "bytes by squares", &SQUARES, linear, config);
    w.curve("wis_wavelet_product_prepare", "count", &[4, 16, 64], linear, |w, n| preparation(w, 2048, n, 4, 0));
    w.curve("wis_wavelet_product_prepare", "squares", &SQUARES, linear, |w, n| preparation(w, 8192, 4, 4, n));
    w.curve("wis_wavelet_product_prepare", "texels", &[2048, 8192, 32768], constant, |w, n| preparation(w, n, 4, 4, 0));
    // Narrow lobes ask for evaluations of their own.
    w.at_most("wis_wavelet_product_prepare", "lobes", &LOBES, linear, |w, n| {
        let mut values = preparation(w, 2048, 4, n, 0);
        let (product, info) =
            (w.call("wis_wavelet_product_prepare", &values), w.of("wis_wavelet_product_info", &vec![]));
        w.call("wis_wavelet_product_describe", &vec![values[0], ("product", product), ("info", info)]);
        let [squares, evaluations] =
            ["squares", "evaluations"].map(|name| w.field("wis_wavelet_product_info", info, name));
        values.push(("stated", f64::from(squares + evaluations) * n as f64));
        values
    });
    w.curve("wis_wavelet_product_describe", "squares", &SQUARES, constant, |w, n| prepared(w, 2048, n));
    w.curve("wis_wavelet_product_estimate_rgb", "squares", &SQUARES, linear, |w, n| prepared(w, 8192, n));
    for function in ["wis_wavelet_sample", "wis_wavelet_pdf", "wis_wavelet_invert"] {
        let alone = |w: &mut World, texels: usize, count: usize| {
            [vec![("environment", light(w, texels))], inputs(w, function, count)].concat()
        };
        w.curve(function, "count", &COUNTS, linear, |w, n| alone(w, 2048, n));
        w.curve(function, "count, product", &COUNTS, linear, |w, n| {
            [prepared(w, 2048, 128), inputs(w, function, n)].concat()
        });
        w.curve(function, "texels", &TEXELS, f64::log2, |w, n| alone(w, n, 256));
        w.curve(function, "squares", &SQUARES, f64::log2, |w, n| {
            [prepared(w, 8192, n), inputs(w, function, 256)].concat()
        });
    }
}

fn evaluated<'a>(w: &mut World, count: usize, lobes: usize) -> Values<'a> {
    let query = query(w, lobes);
    vec![("query", w.of("wis_wavelet_query", &query)), ("count", count as f64), ("wi", w.floats(&directions(3, count)))]
}

/// A table of equal slices.
fn tabulated<'a>(w: &mut World, slices: usize, depth: u32) -> Values<'a> {
    let tree = stored(w, 2, depth, 1);
    let slice = w.addresses(&vec![tree; slices]);
    let table = w.of("wis_wavelet_table", &vec![("slice_count", slices as f64), ("slice", slice)]);
    let fields = [query(w, 1), vec![("lobe[0].kind", w.constant("WIS_WAVELET_LOBE_TABLE"))]].concat();
    let query = w.of("wis_wavelet_query", &fields);
    vec![("query", query), ("table", table), ("count", 64.0), ("wi", w.floats(&directions(3, 64)))]
}

fn tables(w: &mut World) {
    w.curve("wis_wavelet_query_eval", "count", &COUNTS, linear, |w, n| evaluated(w, n, 4));
    w.at_most("wis_wavelet_query_eval", "lobes", &LOBES, linear, |w, n| evaluated(w, 256, n));
    w.curve("wis_wavelet_query_eval", "slices", &[4, 16, 256], constant, |w, n| tabulated(w, n, 2));
    w.at_most("wis_wavelet_query_eval", "depth of slices", &[2, 4, 6], linear, |w, n| tabulated(w, 2, n as u32));
    w.curve("wis_wavelet_table_directions", "4^depth", &COUNTS, linear, |w, n| {
        let (offset, depth) = (w.floats(&[0.5; 2]), f64::from(n.ilog2() / 2));
        vec![("slice", 0.0), ("slice_count", 8.0), ("depth", depth), ("offset", offset)]
    });
    w.curve("wis_grid_direction", "side", &[8, 512], constant, |_, n| {
        vec![("side", n as f64), ("cell", (n * n / 3) as f64)]
    });
    w.curve("wis_grid_cells", "side", &[8, 512], constant, |w, n| {
        vec![("side", n as f64), ("wi", w.floats(&[0.6, 0.0, 0.8]))]
    });
}

fn rotated(w: &mut World) {
    let tree = |w: &mut World, depth: u32, places: u32, light: f64| {
        let more =
            vec![("depth", f64::from(depth)), ("places", f64::from(places)), ("least", 0.25), ("environment", light)];
        of(w, "WIS_TREE_ENVIRONMENT", more)
    };
    w.curve("wis_tree_size", "environment, 4^depth", &COUNTS, constant, |w, n| tree(w, n.ilog2() / 2, 2, 0.0));
    w.curve("wis_tree_init", "environment, 4^depth", &COUNTS, linear, |w, n| {
        let light = light(w, 2048);
        tree(w, n.ilog2() / 2, 2, light)
    });
    w.curve("wis_tree_init", "environment, places^2", &[4, 16, 64], linear, |w, n| {
        let light = light(w, 2048);
        tree(w, 4, 1 << (n.ilog2() / 2), light)
    });
}
