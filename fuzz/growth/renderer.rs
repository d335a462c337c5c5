//! Curves of wis.h and wis_lights.h.

use crate::world::{Values, World, directions, numbers};
use std::ffi::{c_int, c_void};

/// Texels of maps: 16 x 8 to 256 x 128.
const TEXELS: [usize; 4] = [512, 2048, 8192, 32768];
const COUNTS: [usize; 4] = [64, 256, 1024, 4096];
/// Texels of whole builds, whose 128 cells are most of the work of small ones.
const BUILDS: [usize; 3] = [2048, 32768, 131072];
/// Texels of maps that have as many strata as there can be.
const DETAILED: [usize; 2] = [131_072, 524_288];
const LOBES: [usize; 2] = [1, 4];

pub fn constant(_: f64) -> f64 {
    1.0
}

pub fn linear(n: f64) -> f64 {
    n
}

pub fn run(w: &mut World) {
    small(w);
    environments(w);
    samplers(w);
    rays(w);
    products(w);
    points(w);
    strata(w);
}

/// A lat-long map of noise with a sun, RGB, twice as wide as high; texels: a square times two.
pub fn map<'a>(w: &mut World, texels: usize) -> Values<'a> {
    let height = ((texels / 2) as f64).sqrt();
    let mut pixels = numbers(1, 3 * texels);
    pixels[0] = 1e4;
    let (layout, format) = (w.constant("WIS_LAYOUT_LATLONG"), w.constant("WIS_FORMAT_F32"));
    let size = [("layout", layout), ("width", 2.0 * height), ("height", height)];
    [&size[..], &[("channels", 3.0), ("format", format), ("pixels", w.floats(&pixels))]].concat()
}

fn config(w: &mut World, texels: usize) -> f64 {
    let map = map(w, texels);
    w.of("wis_environment_config", &map)
}

fn built(w: &mut World, texels: usize) -> f64 {
    let config = config(w, texels);
    w.call("wis_environment_init", &vec![("config", config)])
}

fn light(w: &mut World, texels: usize) -> f64 {
    w.once(format!("light {texels}"), |w| built(w, texels))
}

fn small(w: &mut World) {
    w.curve("wis_status_string", "status", &[1, 1000], constant, |_, n| vec![("status", n as f64)]);
    w.curve("wis_version", "call", &[1, 4], constant, |_, _| vec![]);
    w.curve("wis_visibility_key", "position", &[1, 1 << 30], constant, |w, n| {
        vec![("position", w.floats(&[n as f32; 3])), ("normal", w.floats(&[0.0, 0.0, 1.0])), ("cell", 1.0)]
    });
    w.at_most("wis_material_init", "lobes", &LOBES, linear, |w, n| vec![("material", shapes(w, n))]);
}

fn environments(w: &mut World) {
    w.curve("wis_base", "texels", &TEXELS, constant, |w, n| {
        vec![("environment", light(w, n)), ("radiance", w.floats(&[n as f32; 3]))]
    });
    w.curve("wis_environment_size", "texels", &TEXELS, constant, |w, n| vec![("config", config(w, n))]);
    for input in ["bytes by texels", "scratch by texels"] {
        w.curve("wis_environment_size", input, &[32768, 131072, 524288], linear, |w, n| vec![("config", config(w, n))]);
    }
    w.at_most("wis_environment_open", "texels", &BUILDS, linear, |w, n| {
        vec![("memory", light(w, n)), ("bytes", w.sizes[0] as f64)]
    });
    w.curve("wis_environment_describe", "texels", &TEXELS, constant, |w, n| vec![("environment", light(w, n))]);
    w.curve("wis_environment_turn", "texels", &TEXELS, constant, |w, n| {
        vec![("memory", built(w, n)), ("bytes", w.sizes[0] as f64)]
    });
    // Strata take as long as hundreds of thousands of texels.
    w.at_most("wis_environment_init", "texels", &BUILDS, linear, |w, n| vec![("config", config(w, n))]);
    w.at_most("wis_environment_init", "texels, budget", &TEXELS, linear, |w, n| {
        let map = [map(w, n), vec![("error_budget", 0.01)]].concat();
        vec![("config", w.of("wis_environment_config", &map))]
    });
    w.at_most("wis_environment_init", "texels, nearest", &TEXELS, linear, |w, n| {
        let (filter, flags) = (w.constant("WIS_FILTER_NEAREST"), w.constant("WIS_ENVIRONMENT_COMPENSATED"));
        let map = [map(w, n), vec![("filter", filter), ("flags", flags)]].concat();
        vec![("config", w.of("wis_environment_config", &map))]
    });
    w.at_most("wis_environment_begin", "rows^2", &TEXELS, f64::sqrt, |w, n| vec![("config", config(w, n))]);
    let passes =
        ["texels, pass 0", "texels, pass 1", "texels, pass 2", "texels, pass 3", "texels, pass 4", "texels, pass 5"];
    for (pass, input) in (0..).zip(passes) {
        let sizes = if pass < 3 { &TEXELS[1..] } else { &DETAILED };
        w.at_most("wis_environment_run", input, sizes, linear, |w, n| {
            let (build, items) = begun(w, n, pass);
            [build, vec![("pass", f64::from(pass)), ("first", 0.0), ("count", items[pass as usize])]].concat()
        });
    }
    w.at_most("wis_environment_finish", "texels", &BUILDS, linear, |w, n| begun(w, n, 6).0);
}

/// A build whose first passes are done, and the items of each pass.
fn begun<'a>(w: &mut World, texels: usize, passes: u32) -> (Values<'a>, [f64; 6]) {
    let config = config(w, texels);
    w.call("wis_environment_size", &vec![("config", config)]);
    let [bytes, scratch_bytes] = w.sizes;
    let (memory, scratch, items) = (w.room(bytes), w.room(scratch_bytes), w.integers(&[0; 6]));
    let work = vec![("config", config), ("scratch", scratch), ("scratch_bytes", scratch_bytes as f64)];
    w.call("wis_environment_begin", &[work.clone(), vec![("items", items)]].concat());
    // SAFETY: six integers.
    let items = unsafe { *(items as usize as *const [u32; 6]) }.map(f64::from);
    let build = [work, vec![("memory", memory), ("bytes", bytes as f64)]].concat();
    for pass in 0..passes {
        let of_pass = vec![("pass", f64::from(pass)), ("first", 0.0), ("count", items[pass as usize])];
        w.call("wis_environment_run", &[build.clone(), of_pass].concat());
    }
    (build, items)
}

fn sampler_config(w: &mut World, rays: usize, candidates: usize) -> f64 {
    w.of("wis_sampler_config", &vec![("rays", rays as f64), ("candidates_per_ray", candidates as f64)])
}

fn sampler(w: &mut World, rays: usize, candidates: usize) -> f64 {
    let config = sampler_config(w, rays, candidates);
    w.call("wis_sampler_init", &vec![("config", config)])
}

fn samplers(w: &mut World) {
    w.curve("wis_sampler_size", "rays", &COUNTS, constant, |w, n| vec![("config", sampler_config(w, n, 0))]);
    w.at_most("wis_sampler_size", "bytes by rays", &COUNTS, linear, |w, n| vec![("config", sampler_config(w, n, 0))]);
    w.curve("wis_sampler_size", "bytes by candidates", &[16, 64, 256], linear, |w, n| {
        vec![("config", sampler_config(w, 16, n))]
    });
    w.at_most("wis_sampler_init", "bytes", &COUNTS, linear, |w, n| vec![("config", sampler_config(w, n, 0))]);
    w.curve("wis_sampler_begin_pixel", "rays", &COUNTS, constant, |w, n| vec![("sampler", sampler(w, n, 0))]);
    w.curve("wis_sampler_fault", "rays", &COUNTS, constant, |w, n| vec![("sampler", sampler(w, n, 0))]);
    let cache = |w: &mut World, places: usize| w.call("wis_visibility_cache_init", &vec![("places", places as f64)]);
    w.curve("wis_visibility_cache_size", "places", &COUNTS, constant, |_, n| vec![("places", n as f64)]);
    w.curve("wis_visibility_cache_size", "bytes by places", &COUNTS, linear, |_, n| vec![("places", n as f64)]);
    w.curve("wis_visibility_cache_init", "places", &COUNTS, linear, |_, n| vec![("places", n as f64)]);
    w.curve("wis_visibility_cache_end_pass", "places", &COUNTS, linear, |w, n| vec![("cache", cache(w, n))]);
    w.curve("wis_visibility_cache_record", "count", &COUNTS, linear, |w, n| {
        let (cache, reached) = (cache(w, 16), w.integers(&vec![0x0101_0101; n]));
        let point = point(w, 1, vec![("visibility", cache), ("visibility_key", 1.0)]);
        vec![("point", point), ("count", n as f64), ("wi", w.floats(&directions(1, n))), ("reached", reached)]
    });
}

/// GGX lobes of different widths, and Lambert's, which costs least, as the last.
fn shapes(w: &mut World, lobes: usize) -> f64 {
    let (lambert, ggx) = (w.constant("WIS_LOBE_LAMBERT"), w.constant("WIS_LOBE_GGX"));
    let mut fields = vec![("lobe_count", lobes as f64), ("lobe[3].kind", lambert)];
    let names = [
        ["lobe[0].kind", "lobe[0].a", "lobe[0].b"],
        ["lobe[1].kind", "lobe[1].a", "lobe[1].b"],
        ["lobe[2].kind", "lobe[2].a", "lobe[2].b"],
    ];
    for ([kind, a, b], alpha) in names.into_iter().zip([0.1, 0.4, 0.02]).take(lobes) {
        fields.extend([(kind, ggx), (a, alpha), (b, alpha)]);
    }
    w.of("wis_material", &fields)
}

fn material(w: &mut World, lobes: usize) -> f64 {
    let material = shapes(w, lobes);
    w.call("wis_material_init", &vec![("material", material)]);
    material
}

/// The fields of a point, whose lobes weigh the same.
fn fields<'a>(w: &mut World, lobes: usize, more: Values<'a>) -> Values<'a> {
    let mut fields =
        vec![("material", material(w, lobes)), ("normal[2]", 1.0), ("tangent[0]", 1.0), ("wo[0]", 0.6), ("wo[2]", 0.8)];
    fields.extend([("weight*", 0.25), ("f0*", 0.5)]);
    fields.extend(more);
    fields
}

fn point(w: &mut World, lobes: usize, more: Values) -> f64 {
    let fields = fields(w, lobes, more);
    w.of("wis_point", &fields)
}

fn direct<'a>(w: &mut World, texels: usize, rays: usize, candidates: usize, lobes: usize) -> Values<'a> {
    let (light, sampler, point) = (light(w, texels), sampler(w, rays, candidates), point(w, lobes, vec![]));
    vec![("sampler", sampler), ("environment", light), ("point", point), ("rays", rays as f64)]
}

fn rays(w: &mut World) {
    w.curve("wis_direct", "rays", &COUNTS, linear, |w, n| direct(w, 2048, n, 16, 4));
    w.curve("wis_direct", "candidates per ray", &[16, 64, 256], linear, |w, n| direct(w, 2048, 16, n, 4));
    w.curve("wis_direct", "rays of a product", &COUNTS, linear, |w, n| direct(w, 2048, n, 0, 1));
    w.at_most("wis_direct", "lobes", &LOBES, linear, |w, n| direct(w, 2048, 16, 16, n));
    w.curve("wis_direct", "texels", &TEXELS, constant, |w, n| direct(w, n, 16, 16, 4));
    w.curve("wis_direct_wave", "count", &COUNTS[..3], linear, |w, n| wave(w, n, 4));
    w.curve("wis_direct_wave", "rays", &[4, 16, 64], linear, |w, n| wave(w, 16, n));
    w.curve("wis_check", "texels", &[512, 32768], constant, |w, n| {
        let config = w.of("wis_check_config", &vec![("radiance", white as *const () as usize as f64)]);
        vec![("environment", light(w, n)), ("sampler", sampler(w, 16, 0)), ("config", config)]
    });
    w.curve("wis_check_point", "texels", &[512, 32768], constant, |w, n| {
        let point = point(w, 4, vec![("target", even as *const () as usize as f64)]);
        vec![("environment", light(w, n)), ("sampler", sampler(w, 16, 0)), ("point", point)]
    });
}

extern "C" fn even(_: *mut c_void, count: usize, _: *const f32, f_cos: *mut f32) -> c_int {
    // SAFETY: the library gives room for `count` values.
    unsafe { std::slice::from_raw_parts_mut(f_cos, count) }.fill(1.0);
    0
}

extern "C" fn white(user: *mut c_void, count: usize, wi: *const f32, rgb: *mut f32) -> c_int {
    even(user, 3 * count, wi, rgb)
}

fn wave<'a>(w: &mut World, count: usize, rays: usize) -> Values<'a> {
    let (light, sampler, materials) = (light(w, 2048), sampler(w, rays, 16), material(w, 2));
    let (normal, wo, seeds) = (w.floats(&[0.0, 0.0, 1.0]), w.floats(&[0.6, 0.0, 0.8]), w.integers(&vec![1; count]));
    let (ray, counts) = (w.room(16 * rays * count), w.room(4 * count));
    let arrays = [
        ("materials", materials),
        ("normal.first", normal),
        ("wo.first", wo),
        ("seed.first", seeds),
        ("seed.point", 4.0),
    ];
    let rest = [
        ("material_count", 1.0),
        ("rays", rays as f64),
        ("ray.first", ray),
        ("ray.point", 16.0 * rays as f64),
        ("count", counts),
    ];
    let wave = w.of("wis_wave", &[arrays, rest].concat());
    vec![("sampler", sampler), ("environment", light), ("count", count as f64), ("wave", wave)]
}

/// What is prepared: products of points that are alike.
fn preparation<'a>(w: &mut World, texels: usize, count: usize, lobes: usize, more: Values<'a>) -> Values<'a> {
    let (light, sampler, config) = (light(w, texels), sampler(w, 16, 0), w.of("wis_product_config", &more));
    let point = fields(w, lobes, vec![]);
    let points = w.list("wis_point", &vec![point; count]);
    vec![("sampler", sampler), ("environment", light), ("config", config), ("count", count as f64), ("point", points)]
}

/// The same and the product of one point.
fn prepared<'a>(w: &mut World, texels: usize, lobes: usize, more: Values<'a>) -> Values<'a> {
    let mut values = preparation(w, texels, 1, lobes, more);
    let memory = w.call("wis_product_prepare", &values);
    values.extend([("memory", memory), ("bytes", w.sizes[0] as f64), ("product", memory)]);
    values
}

fn cells<'a>(n: usize) -> Values<'a> {
    vec![("divided_cells", n as f64)]
}

fn products(w: &mut World) {
    let config = |w: &mut World, n: usize| vec![("config", w.of("wis_product_config", &cells(n)))];
    w.curve("wis_product_size", "divided cells", &[6, 24], constant, config);
    w.at_most("wis_product_size", "bytes by divided cells", &[6, 24], linear, config);
    w.curve("wis_product_prepare", "count", &[4, 16, 64], linear, |w, n| preparation(w, 2048, n, 4, vec![]));
    w.at_most("wis_product_prepare", "lobes", &LOBES, linear, |w, n| preparation(w, 2048, 4, n, vec![]));
    w.at_most("wis_product_prepare", "divided cells", &[6, 24], linear, |w, n| preparation(w, 2048, 4, 4, cells(n)));
    w.curve("wis_product_prepare", "texels", &TEXELS, constant, |w, n| preparation(w, n, 4, 4, vec![]));
    w.at_most("wis_product_open", "divided cells", &[6, 24], linear, |w, n| {
        let flags = w.constant("WIS_PRODUCT_CHECKSUM");
        let mut values = prepared(w, 2048, 4, [cells(n), vec![("flags", flags)]].concat());
        values.retain(|value| value.0 != "product");
        values
    });
    w.at_most("wis_product_describe", "divided cells", &[6, 24], linear, |w, n| prepared(w, 2048, 4, cells(n)));
    w.at_most("wis_product_covers", "lobes", &LOBES, linear, |w, n| prepared(w, 2048, n, vec![]));
    for function in ["wis_sample", "wis_pdf", "wis_invert"] {
        w.at_most(function, "lobes", &LOBES, linear, |w, n| drawn(w, function, 2048, 256, n));
        for (by_count, by_texels, lobes) in [("count", "texels", 0), ("count, product", "texels, product", 4)] {
            w.curve(function, by_count, &COUNTS, linear, |w, n| drawn(w, function, 2048, n, lobes));
            w.curve(function, by_texels, &TEXELS, f64::log2, |w, n| drawn(w, function, n, 256, lobes));
        }
    }
}

/// Samples, densities and inverses of a light, or of a product.
fn drawn<'a>(w: &mut World, function: &str, texels: usize, count: usize, lobes: usize) -> Values<'a> {
    let mut values = prepared(w, texels, lobes.max(1), vec![]);
    values.retain(|value| value.0 != "count" && (lobes > 0 || value.0 != "product"));
    values.extend(inputs(w, function, count));
    values
}

/// How many numbers or directions, and these.
pub fn inputs<'a>(w: &mut World, function: &str, count: usize) -> Values<'a> {
    let input = if function.ends_with("_sample") {
        ("u", w.floats(&numbers(2, 2 * count)))
    } else {
        ("wi", w.floats(&directions(3, count)))
    };
    vec![("count", count as f64), input]
}

fn points(w: &mut World) {
    w.curve("wis_points_sobol", "count", &COUNTS, linear, |_, n| {
        vec![("seed", 1.0), ("first", 0.0), ("count", n as f64)]
    });
    w.curve("wis_points_sobol", "first", &[1, 1 << 30], constant, |_, n| {
        vec![("seed", 1.0), ("first", n as f64), ("count", 64.0)]
    });
}

fn strata(w: &mut World) {
    const TEXELS: [usize; 3] = [2048, 8192, 32768];
    const COUNTS: [usize; 4] = [16, 64, 256, 1024];
    let lights = |w: &mut World, texels: usize, lights: usize, levels: usize| {
        let of = w.of("wis_strata_config", &vec![("count", lights as f64), ("levels", levels as f64)]);
        vec![("map", config(w, texels)), ("config", of)]
    };
    w.curve("wis_strata_size", "texels", &TEXELS, constant, |w, n| lights(w, n, 64, 0));
    w.curve("wis_strata_size", "bytes by lights", &COUNTS, linear, |w, n| lights(w, 2048, n, 0));
    w.curve("wis_strata_size", "scratch by texels", &TEXELS, linear, |w, n| lights(w, n, 64, 0));
    w.curve("wis_strata_lights", "texels", &TEXELS, linear, |w, n| lights(w, n, 16, 0));
    w.curve("wis_strata_lights", "lights", &COUNTS[..3], linear, |w, n| lights(w, 2048, n, 0));
    w.at_most("wis_strata_lights", "levels", &[4, 16, 64], linear, |w, n| lights(w, 2048, 64, n));
    let jitter = |w: &mut World, texels: usize, lights: usize| {
        let labels: Vec<u32> = (0..texels as u32).map(|i| i % lights as u32).collect();
        let (label, distribution) = (w.integers(&labels), w.constant("WIS_JITTER_ENERGY"));
        let of = w.of(
            "wis_jitter_config",
            &vec![("light_count", lights as f64), ("distribution", distribution), ("label", label)],
        );
        vec![("map", config(w, texels)), ("config", of)]
    };
    w.curve("wis_jitter_size", "texels", &TEXELS, constant, |w, n| jitter(w, n, 64));
    w.curve("wis_jitter_size", "bytes by texels", &TEXELS, linear, |w, n| jitter(w, n, 64));
    w.curve("wis_jitter_init", "texels", &TEXELS, linear, |w, n| jitter(w, n, 64));
    w.curve("wis_jitter_init", "texels, 1 light", &TEXELS, linear, |w, n| jitter(w, n, 1));
    w.curve("wis_jitter_init", "texels and lights", &TEXELS, linear, |w, n| jitter(w, n, n));
    let made = |w: &mut World, texels: usize, lights: usize| {
        let values = jitter(w, texels, lights);
        let memory = w.call("wis_jitter_init", &values);
        vec![("memory", memory), ("bytes", w.sizes[0] as f64), ("jitter", memory), ("light", 0.0)]
    };
    w.curve("wis_jitter_open", "texels", &TEXELS, linear, |w, n| {
        let mut values = made(w, n, 64);
        values.retain(|value| value.0 != "jitter");
        values
    });
    w.curve("wis_jitter_sample", "texels", &TEXELS, f64::log2, |w, n| {
        [made(w, n, 1), vec![("u", w.floats(&[0.3, 0.7]))]].concat()
    });
    w.curve("wis_jitter_pdf", "texels", &TEXELS, f64::log2, |w, n| {
        [made(w, n, 1), vec![("wi", w.floats(&[0.6, 0.0, 0.8]))]].concat()
    });
    // All are sorted, in the orders that are hard for one or another way to sort.
    type Order = fn(usize) -> Vec<f32>;
    fn rising(n: usize) -> impl DoubleEndedIterator<Item = f32> {
        (0..n).map(|i| i as f32)
    }
    let orders: [(&str, Order); 5] = [
        ("count", |n| numbers(5, n)),
        ("count, rising", |n| rising(n).collect()),
        ("count, falling", |n| rising(n).rev().collect()),
        ("count, equal", |n| vec![1.0; n]),
        ("count, pipe", |n| rising(n / 2).chain(rising(n / 2).rev()).collect()),
    ];
    for (input, order) in orders {
        w.curve(
            "wis_strata_order",
            input,
            &COUNTS,
            |n| n * n.log2(),
            |w, n| vec![("count", n as f64), ("contribution", w.floats(&order(n))), ("threshold", 0.0)],
        );
    }
}
