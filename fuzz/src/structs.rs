//! What the configurations and points of the header are filled with.

use crate::building;
use crate::call::DEFAULT_CONTROL;
use crate::case::{Case, Fields, Role, Span, bytes_of};
use crate::maps;
use crate::pool::Object;
use crate::random::Random;
use crate::values::{MOST, list};
use std::ffi::{c_int, c_void};

/// The bytes of a struct that a call reads, valid or with a hostile field.
pub fn make(case: &mut Case, kind: &str) -> Vec<u8> {
    let mut fields = Fields::new(&case.world.headers.layouts[kind]);
    match kind {
        "wis_environment_config" => match building::config(case) {
            Some(config) => return config,
            None => environment(case, &mut fields),
        },
        "wis_wave" => wave(case, &mut fields),
        "wis_tree_config" => tree(case, &mut fields),
        "wis_jitter_config" => jitter(case, &mut fields),
        _ => {
            let fill = match kind {
                "wis_sampler_config" => sampler,
                "wis_point" => point,
                "wis_product_config" => product,
                "wis_check_config" => check,
                "wis_strata_config" => strata,
                _ => panic!("no rule for {kind}"),
            };
            fill(case, &mut fields);
            if case.is_spoiled() {
                fields.spoil(&mut case.random);
            }
        }
    }
    fields.bytes
}

fn frame(case: &mut Case, fields: &mut Fields, path: &str) {
    if case.random.one_in(2) && case.function.name != "wis_environment_begin" {
        let mut frame = case.random.frame();
        if case.is_spoiled() && case.random.one_in(4) {
            frame[case.random.below(9)] = case.random.hard();
        }
        fields.input(case, path, &bytes_of(&frame), 4);
    }
}

fn budget(random: &mut Random) -> f32 {
    match random.below(4) {
        0 => random.scale(1e-4, 1.0),
        _ => 0.0,
    }
}

fn environment(case: &mut Case, fields: &mut Fields) {
    let strata = case.function.has("map");
    let flags = if strata { 8 } else { case.random.below(32) as u64 };
    // Rows at the poles are a lat-long map's.
    let latlong = strata || flags & 1 != 0;
    let (sanitise, rays) = (case.random.one_in(2), !strata && case.random.one_in(8));
    fields.word("flags", flags | if sanitise { 8 } else { 0 } | if rays { 64 } else { 0 });
    fields.word("filter", case.random.below(2) as u64);
    fields.float("error_budget", budget(&mut case.random));
    frame(case, fields, "world_from_map");
    maps::describe(case, fields, latlong);
}

fn sampler(case: &mut Case, fields: &mut Fields) {
    let random = &mut case.random;
    fields.word("cpu_level", random.below(3) as u64);
    fields.word("rays", random.pick(&[0, 1, 2, 3, 4, 8, 16, 64]));
    fields.word("candidates_per_ray", random.pick(&[0, 0, 1, 8, 40]));
    fields.word("hits_per_pixel", random.pick(&[0, 1, 16, 100]));
}

/// A material before wis_material_init.
pub fn material(case: &mut Case) -> Vec<u8> {
    let mut fields = Fields::new(&case.world.headers.layouts["wis_material"]);
    let lobes = case.random.below(5);
    fields.word("lobe_count", lobes as u64);
    for k in 0..lobes {
        let kind = case.random.pick(&[1, 2, 3, 5, 6]);
        let (least, most) = if kind == 3 { (1e-3, 1e7) } else { (1e-5, 16.0) };
        let a = case.random.scale(least, most);
        let b = if case.random.one_in(3) { case.random.scale(least, most) } else { a };
        fields.word(&format!("lobe[{k}].kind"), kind);
        fields.float(&format!("lobe[{k}].a"), a);
        fields.float(&format!("lobe[{k}].b"), b);
        fields.float(&format!("lobe[{k}].eta"), case.random.pick(&[0.1, 0.66, 1.5, 1.01, 10.0]));
    }
    if case.is_spoiled() {
        fields.spoil(&mut case.random);
    }
    fields.bytes
}

/// Factors of lobes: mostly of a size that materials have.
fn factors(random: &mut Random, count: usize, most: f32) -> Vec<f32> {
    let scale = if most > 1.0 { random.pick(&[1.0, 1.0, 0.0, 1e-30, 1e-45, 1e20]) } else { 1.0 };
    (0..count).map(|_| random.unit() * scale).collect()
}

/// The address of an object of the pool, or null.
fn object(case: &mut Case, kind: &str) -> u64 {
    let objects = case.world.pool.of(kind);
    if objects.is_empty() { 0 } else { case.world.memory.reader(case.random.pick(&objects).place) as u64 }
}

/// A cache that the call may write, and that points hold by its address.
fn cache(case: &mut Case) -> u64 {
    let objects = case.world.pool.of("wis_visibility_cache");
    if objects.is_empty() || case.random.one_in(3) {
        return 0;
    }
    if case.function.name != "wis_visibility_cache_record" {
        return object(case, "wis_visibility_cache");
    }
    let bytes = case.world.memory.bytes(case.random.pick(&objects).place).to_vec();
    let layout = crate::header::Layout { fields: Vec::new(), size: 1, align: 16 };
    case.give_packed(Role::State, &bytes, &layout)
}

fn point(case: &mut Case, fields: &mut Fields) {
    fields.word("flags", case.random.below(4) as u64);
    let material = object(case, "wis_material");
    fields.word("material", if case.random.one_in(8) { 0 } else { material });
    fields.floats("normal", &case.random.direction());
    fields.floats("tangent", &case.random.direction());
    fields.floats("wo", &case.random.direction());
    fields.floats("weight", &factors(&mut case.random, 12, 2.0));
    fields.floats("f0", &factors(&mut case.random, 12, 1.0));
    for path in ["seed", "sample", "bounce"] {
        fields.word(path, case.random.bits());
    }
    fields.word("visibility_key", case.random.below(4) as u64);
    fields.word("visibility", cache(case));
    if case.random.one_in(4) {
        callback(case, fields, "target", values);
    }
    if case.random.one_in(4) {
        let portals = bytes_of(&portals(&mut case.random));
        fields.input(case, "portals", &portals, 4);
        fields.word("portal_count", 1 + case.random.below(PORTALS) as u64);
        fields.word("flags", fields.get("flags") | case.random.pick(&[0, 8]));
    }
}

/// Portals of a point or a wave: as many as there may be, so that no count is too large for their memory.
const PORTALS: usize = 8;

/// Rectangles about a point, at any distance and of any size, of which now and then one is none.
fn portals(random: &mut Random) -> Vec<f32> {
    let mut portal = |_| {
        let [x, y, z] = random.direction();
        let [u, v, w] = random.direction();
        let (far, width, height) = (random.scale(1e-3, 1e3), random.scale(1e-3, 1e3), random.scale(1e-3, 1e3));
        let across = [y * w - z * v, z * u - x * w, x * v - y * u];
        let corner = random.direction().map(|x| far * x);
        let mut numbers = [corner, [x, y, z].map(|x| width * x), across.map(|x| height * x)].concat();
        if random.one_in(50) {
            numbers[random.below(9)] = random.hard();
        }
        numbers
    };
    (0..PORTALS).flat_map(&mut portal).collect()
}

/// Arrays of a wave: each shared by its points, packed, or inside larger structures.
fn wave(case: &mut Case, fields: &mut Fields) {
    let count = case.number("count").unwrap_or(0).min(MOST);
    let rays = 1 + case.random.below(4);
    fields.word("flags", case.random.below(4) as u64);
    fields.word("rays", rays as u64);
    let material = object(case, "wis_material");
    fields.word("materials", material);
    fields.word("material_count", u64::from(material != 0));
    for (path, numbers, optional) in
        [("normal", 3, false), ("tangent", 3, true), ("wo", 3, false), ("weight", 12, true), ("f0", 12, true)]
    {
        if optional && case.random.one_in(2) {
            continue;
        }
        let (gap, is_shared) = (4 * case.random.below(3), case.random.one_in(4));
        let stride = 4 * numbers + gap;
        let element = |random: &mut Random| match path {
            "weight" | "f0" => factors(random, numbers, 1.0),
            _ => random.direction().to_vec(),
        };
        let elements = if is_shared { 1 } else { count.max(1) };
        let mut bytes = Vec::new();
        for _ in 0..elements {
            bytes.extend(bytes_of(&element(&mut case.random)));
            bytes.resize(bytes.len() + gap, 0xff);
        }
        bytes.truncate(stride * elements - gap);
        fields.array(case, path, &bytes, if is_shared { 0 } else { stride });
    }
    for path in ["seed", "sample", "bounce", "visibility_key"] {
        let bytes: Vec<u8> = (0..count).flat_map(|i| (i as u32 / 3).to_le_bytes()).collect();
        fields.array(case, path, &bytes, 4);
    }
    if case.random.one_in(3) {
        let mask: Vec<u8> = (0..count).map(|_| u8::from(!case.random.one_in(3))).collect();
        fields.input(case, "mask", &mask, 1);
    }
    if case.random.one_in(3) {
        fields.word("flags", fields.get("flags") | case.random.pick(&[0, 8]));
        let portals = bytes_of(&portals(&mut case.random));
        fields.input(case, "portal.first", &portals, 4);
        let counts: Vec<u8> = (0..count).flat_map(|i| (i as u32 % 10).to_le_bytes()).collect();
        fields.array(case, "portal_count", &counts, 4);
        let positions: Vec<u8> = (0..count).flat_map(|_| bytes_of(&case.random.direction())).collect();
        fields.array(case, "position", &positions, 12);
    }
    fields.word("visibility", cache(case));
    let (width, gap) = (16 * rays, 4 * case.random.below(3));
    let floats = crate::header::Layout { size: width, align: 4, fields: Vec::new() };
    let stride = width + gap;
    let bytes = case.garbage((stride * count).saturating_sub(gap));
    let span = Span { width, stride, count };
    let ray = case.give(Role::Result, &bytes, floats, span);
    fields.word("ray.first", ray);
    fields.word("ray.point", stride as u64);
    let (bytes, layouts) = (case.garbage(4 * count), &case.world.headers.layouts);
    fields.word("count", case.give_packed(Role::Result, &bytes, &layouts["uint32_t"]));
    if case.random.one_in(2) {
        let bytes = case.garbage(count);
        fields.word("status", case.give_packed(Role::Result, &bytes, &layouts["uint8_t"]));
    }
    if case.is_spoiled() {
        // Fields that say how much memory there is stay true.
        match case.random.below(8) {
            0 => fields.word("size", case.random.bits()),
            1 => fields.word("flags", case.random.bits()),
            2 => fields.word("rays", case.random.pick(&[0, 65, 5000, u64::from(u32::MAX)])),
            3 => fields.word("ray.point", case.random.pick(&[0, 2])),
            4 => fields.word("material_count", 0),
            5 => fields.word("ray.number", case.random.pick(&[1, 2])),
            _ => {
                let path =
                    case.random.pick(&["normal.first", "wo.first", "ray.first", "count", "materials", "seed.first"]);
                fields.word(path, case.random.pick(&[0, 1]));
            }
        }
    }
}

fn product(case: &mut Case, fields: &mut Fields) {
    fields.word("flags", case.random.below(4) as u64);
    fields.word("divided_cells", case.random.pick(&[0, 0, 1, 8, 24]));
    fields.float("cone", case.random.pick(&[0.0, 0.05, 0.3, 1.5]));
}

fn check(case: &mut Case, fields: &mut Fields) {
    callback(case, fields, "radiance", colours);
}

fn strata(case: &mut Case, fields: &mut Fields) {
    fields.word("count", 1 + case.random.below(60) as u64);
    fields.word("levels", case.random.pick(&[0, 1, 6, 64]));
    fields.float("angle_limit", case.random.pick(&[0.0, 0.01, 12.6, 1e-20]));
    if case.random.one_in(2) {
        let exponents = [8.0 * case.random.unit(), 8.0 * case.random.unit()];
        fields.input(case, "exponents", &bytes_of(&exponents), 4);
    }
}

/// A tree of any source: of pixels where there is nothing else to make it of.
fn tree(case: &mut Case, fields: &mut Fields) {
    let (trees, lights) = (case.world.pool.of("wis_tree"), case.world.pool.of("wis_environment"));
    let source = match case.random.below(6) {
        source @ (1 | 2) if !trees.is_empty() => source,
        3 => 3,
        4 if !lights.is_empty() => 4,
        _ => 0,
    };
    fields.word("source", source as u64);
    // Where there is a field that says how many elements there are, and the pointer to them.
    let mut most = ("count", 0, "wavelets");
    match source {
        1 | 2 => most = ("tree_count", combined(case, fields, &trees, source == 1), "trees"),
        3 => most = ("count", listed(case, fields), "wavelets"),
        4 => rotated(case, fields, &lights),
        _ => return pixels(case, fields),
    }
    if case.is_spoiled() {
        let given = fields.get("trees");
        fields.spoil(&mut case.random);
        let (count, true_count, pointer) = most;
        if fields.get(count) > true_count {
            fields.word(pointer, 0);
        }
        // A list off its alignment that is moved by a byte may be aligned again: its handles would be parts of two addresses.
        let moved = fields.get("trees");
        if moved != given && moved % 8 == 0 {
            fields.word("trees", 0);
        }
    }
}

/// The address of an object, or of something else that is as long.
fn handle(case: &mut Case, among: &[Object]) -> u64 {
    let chosen = case.choose(among);
    if !(case.is_spoiled() && case.random.one_in(6)) {
        return case.world.memory.reader(chosen.place) as u64;
    }
    let mut bytes = case.world.memory.bytes(chosen.place).to_vec();
    match case.random.below(3) {
        0 => bytes.fill(0),
        1 => bytes.iter_mut().for_each(|byte| *byte = case.random.bits() as u8),
        _ => return 0,
    }
    case.input(&bytes, 16)
}

/// Trees that are multiplied or added up; how many.
fn combined(case: &mut Case, fields: &mut Fields, trees: &[Object], is_product: bool) -> u64 {
    let count = if is_product { 2 + case.random.below(2) } else { 1 + case.random.below(5) };
    let first = case.random.pick(trees).number;
    let fits = |tree: &&Object| tree.number == first || is_product && tree.number < first;
    let alike: Vec<Object> = trees.iter().filter(|tree| tree.number == first).copied().collect();
    let fitting: Vec<Object> = trees.iter().filter(fits).copied().collect();
    let mut bytes = handle(case, &alike).to_le_bytes().to_vec();
    for _ in 1..count {
        let any = if case.random.one_in(32) { trees } else { &fitting };
        bytes.extend(handle(case, any).to_le_bytes());
    }
    fields.input(case, "trees", &bytes, 8);
    fields.word("tree_count", count as u64);
    if !is_product {
        let hostile = case.is_spoiled() && case.random.one_in(3);
        let weight = |random: &mut Random| f64::from(if hostile { random.hard() } else { random.unit() }).to_le_bytes();
        let bytes: Vec<u8> = (0..count).flat_map(|_| weight(&mut case.random)).collect();
        fields.input(case, "weight", &bytes, 8);
    }
    count as u64
}

/// Strata of a map, and the stratum of each texel.
fn jitter(case: &mut Case, fields: &mut Fields) {
    let lights = 1 + case.random.below(40);
    fields.word("light_count", lights as u64);
    fields.word("distribution", case.random.below(2) as u64);
    let hostile = case.is_spoiled() && case.random.one_in(3);
    let label = |random: &mut Random| {
        if hostile && random.one_in(8) { random.bits() as u32 } else { random.below(lights) as u32 }
    };
    let bytes: Vec<u8> = (0..case.texels).flat_map(|_| label(&mut case.random).to_le_bytes()).collect();
    fields.input(case, "label", &bytes, 4);
    if case.is_spoiled() {
        fields.spoil(&mut case.random);
    }
}

/// What a tree is raised to, an average and a list of wavelets; how many.
fn listed(case: &mut Case, fields: &mut Fields) -> u64 {
    fields.word("least", case.random.pick(&[0.0, 1e-3, 1.0f64]).to_bits());
    let hostile = case.is_spoiled() && case.random.one_in(3);
    let bytes = list(&mut case.random, hostile);
    let layout = &case.world.headers.layouts["wis_wavelets"];
    let (count, align) = ((bytes.len() / layout.size) as u64, layout.align);
    fields.input(case, "wavelets", &bytes, align);
    fields.word("count", count);
    fields.word("average", f64::from(case.random.unit()).to_bits());
    count
}

fn pixels(case: &mut Case, fields: &mut Fields) {
    let dimensions = case.random.pick(&[2, 2, 2, 4]);
    let depth = case.random.below(1 + 10 / dimensions);
    let scale = case.random.pick(&[1.0, 1.0, 1e-44, 1e30, 3e38]);
    let hostile = case.is_spoiled() && case.random.one_in(3);
    let mut values = vec![0.0f32; 1 << (dimensions * depth)];
    for value in &mut values {
        let one = if case.random.one_in(3) { 0.0 } else { case.random.unit() * scale };
        *value = if hostile && case.random.one_in(4) { case.random.hard() } else { one };
    }
    fields.word("dimensions", dimensions as u64);
    fields.word("depth", depth as u64);
    fields.float("error_budget", budget(&mut case.random));
    fields.input(case, "pixels", &bytes_of(&values), 4);
    let given = fields.get("pixels");
    if case.is_spoiled() && !hostile {
        fields.spoil(&mut case.random);
        let wanted = fields.get("dimensions").saturating_mul(fields.get("depth"));
        if wanted > (dimensions * depth) as u64 && fields.get("pixels") == given {
            fields.word("pixels", 0);
        }
        // Another source has a list of no elements.
        fields.word("count", 0);
    }
}

fn rotated(case: &mut Case, fields: &mut Fields, lights: &[Object]) {
    fields.word("depth", case.random.below(5) as u64);
    fields.float("error_budget", budget(&mut case.random));
    fields.word("least", case.random.pick(&[0.0, 1e-3, 1.0, 1e6f64]).to_bits());
    fields.word("environment", handle(case, lights));
    frame(case, fields, "world_from_tree");
}

/// How a client's callback behaves: it answers well, fails, or writes what is no value.
fn callback(case: &mut Case, fields: &mut Fields, path: &str, function: Callback) {
    let manner = case.random.below(if case.is_spoiled() { 6 } else { 2 }) as u32;
    fields.input(case, &format!("{path}_user"), &manner.to_le_bytes(), 4);
    fields.word(path, function as *const () as u64);
}

type Callback = extern "C" fn(*mut c_void, usize, *const f32, *mut f32) -> c_int;

extern "C" fn values(user: *mut c_void, count: usize, wi: *const f32, out: *mut f32) -> c_int {
    answer(user, count, wi, out, 1)
}

extern "C" fn colours(user: *mut c_void, count: usize, wi: *const f32, out: *mut f32) -> c_int {
    answer(user, count, wi, out, 3)
}

fn answer(user: *mut c_void, count: usize, wi: *const f32, out: *mut f32, width: usize) -> c_int {
    // SAFETY: the library hands on `user`, which a hostile case does not align, directions and room for so many results.
    let (manner, wi, out) = unsafe {
        (
            user.cast::<u32>().read_unaligned(),
            std::slice::from_raw_parts(wi, 3 * count),
            std::slice::from_raw_parts_mut(out, width * count),
        )
    };
    if crate::call::control() != DEFAULT_CONTROL {
        crate::alarm::die("a callback runs under the host's control word");
    }
    for (slot, k) in out.iter_mut().zip(0..) {
        let z = wi[k / width * 3 + 2];
        *slot = match manner {
            1 => z.abs() * z.abs() + 0.01,
            3 => f32::NAN,
            4 => -1.0,
            5 => f32::MAX,
            _ => 1.0,
        };
    }
    c_int::from(manner == 2)
}
