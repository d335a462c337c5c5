//! A value for every parameter of the headers, by its name and type: valid ones, and hostile ones where it is spoiled.

use crate::case::{Case, Role, Span, bytes_of};
use crate::header::{Layout, Parameter, Scalar};
use crate::memory::CAPACITY;
use crate::pool::{KINDS, Object, corrupt};
use crate::random::Random;
use crate::structs;

/// The most elements of arrays.
pub const MOST: usize = 300;
/// The longest block of memory that a call is given.
const LONGEST: usize = CAPACITY - 128;

/// Puts the next argument.
pub fn give(case: &mut Case) {
    let parameter = case.parameter();
    let bits = if parameter.pointee.is_empty() {
        number(case, parameter)
    } else if nullable(&case.function.name, &parameter.name) && case.random.one_in(3)
        || case.is_spoiled() && case.random.one_in(6)
    {
        0
    } else {
        pointer(case, parameter)
    };
    case.push(bits);
}

/// Pointers that may be null, as their comments say.
fn nullable(function: &str, name: &str) -> bool {
    match name {
        "diagnostic" | "label" => true,
        "world_from_tree" => function != "wis_table_view",
        "product" => ["_sample", "_pdf", "_invert"].iter().any(|end| function.ends_with(end)),
        "world_from_map" => true,
        "info" => function.contains("_init") || function.contains("_open") || function.starts_with("wis_tree"),
        _ => false,
    }
}

fn pointer(case: &mut Case, parameter: &Parameter) -> u64 {
    let (name, pointee) = (parameter.name.as_str(), parameter.pointee.as_str());
    if case.function.name == "wis_warp_in_place" && name == "points" {
        let count = case.random.below(60) as u64;
        case.decide("count", count);
    }
    let layout = case.world.headers.pointed(parameter);
    if KINDS.contains(&pointee) {
        return if name == "material" { material(case, &layout) } else { object(case, parameter) };
    }
    match (pointee, name) {
        ("void", "memory") if parameter.is_input() => stored(case),
        // More lights than there is memory for.
        (_, "lights") if case.sizes.is_none_or(|[bytes, _]| bytes > LONGEST) => 0,
        ("void", _) => block(case, name),
        ("wis_diagnostic", "diagnostic") => {
            let bytes = case.garbage(layout.size);
            case.give_packed(Role::Diagnostic, &bytes, &layout)
        }
        ("wis_point", _) => {
            let count = length(case, name).min(MOST);
            let bytes: Vec<u8> = (0..count).flat_map(|_| structs::make(case, pointee)).collect();
            case.give_packed(Role::Input, &bytes, &layout)
        }
        ("wis_wavelets", _) if parameter.is_input() => {
            let bytes = std::mem::take(&mut case.list);
            case.give_packed(Role::Input, &bytes, &layout)
        }
        ("wis_wavelets *const", _) => lists(case),
        ("uint8_t", "packed") if parameter.is_input() => packed(case, &layout),
        _ if parameter.is_input() && layout.begins_with_size() => {
            let bytes = structs::make(case, pointee);
            case.give_packed(Role::Input, &bytes, &layout)
        }
        _ => array(case, parameter, &layout),
    }
}

/// How many elements stand behind a pointer.
fn length(case: &Case, name: &str) -> usize {
    let number = |name: &str| case.number(name).unwrap_or(1);
    let axes = || case.objects.last().map_or(2, |tree| tree.number);
    match (case.function.name.as_str(), name) {
        (_, "contribution" | "reached" | "status" | "offset" | "list_count" | "list") => number("count"),
        ("wis_product_prepare", "point") => number("count"),
        ("wis_direct", "ray") => number("rays"),
        ("wis_triple_blend", "weight") => number("count"),
        ("wis_strata_order" | "wis_warp_in_place", "index") => number("count"),
        ("wis_warp_in_place", "points") => number("count").saturating_mul(axes()),
        ("wis_tree_sample" | "wis_tree_pdf" | "wis_tree_invert", "u" | "point") => axes(),
        (_, "label") => case.texels,
        (_, "lights") => case.sizes.map_or(1, |[bytes, _]| bytes.min(LONGEST) / 36),
        (_, "pick") => number("picks"),
        ("wis_sparse_pack", "packed") => number("room"),
        (_, "wavelets") => case.number("keep").or(case.number("room")).unwrap_or(1),
        _ => 1,
    }
}

/// Floats of an element of an array that has a stride.
fn width(name: &str) -> usize {
    match name {
        "wi" | "f_cos" => 3,
        "drawn" => 4,
        "u" | "out" => 2,
        _ => 1,
    }
}

/// The parameter that is the stride of an array.
fn stride_of(case: &Case, name: &str) -> Option<String> {
    let own = format!("{name}_stride");
    [own.as_str(), "stride"]
        .into_iter()
        .find(|stride| case.function.has(stride))
        .and_then(|stride| (stride != "stride" || name == "out").then(|| stride.to_string()))
}

fn array(case: &mut Case, parameter: &Parameter, layout: &Layout) -> u64 {
    let name = parameter.name.as_str();
    let is_info = layout.begins_with_size();
    let (elements, span) = match stride_of(case, name) {
        Some(stride) => {
            let count = case.number("count").unwrap_or(1);
            // A count that no memory holds must be refused before anything is read.
            let count = if count > 2 * MOST { 1 } else { count };
            let (width, gap) = (4 * width(name), 4 * case.random.below(3));
            let packed = gap == 0 && case.random.one_in(2);
            case.decide(&stride, if packed { 0 } else { (width + gap) as u64 });
            ((width + gap) * count - if count > 0 { gap } else { 0 }, Span { width, stride: width + gap, count })
        }
        None => {
            let count = parameter.elements.unwrap_or_else(|| length(case, name)).min(LONGEST / layout.size);
            (layout.size * count, Span { width: layout.size, stride: layout.size, count })
        }
    };
    if parameter.is_input() {
        let bytes = content(case, parameter, elements);
        return case.give(Role::Input, &bytes, layout.clone(), span);
    }
    let in_place = name == "points" || case.function.name == "wis_warp_in_place" && name == "index";
    let mut bytes = if in_place { content(case, parameter, elements) } else { case.garbage(elements) };
    if is_info && !(case.is_spoiled() && case.random.one_in(3)) {
        bytes[..4].copy_from_slice(&(layout.size as u32).to_le_bytes());
    }
    case.give(if in_place { Role::State } else { Role::Result }, &bytes, layout.clone(), span)
}

/// What an input array holds.
fn content(case: &mut Case, parameter: &Parameter, bytes: usize) -> Vec<u8> {
    let hostile = case.is_spoiled();
    let random = &mut case.random;
    let mut out = Vec::new();
    while out.len() < bytes {
        match (parameter.pointee.as_str(), parameter.name.as_str()) {
            ("uint8_t", _) => out.push(random.below(2) as u8),
            ("uint32_t", "list_count") if !case.list.is_empty() => out.append(&mut case.list),
            ("uint32_t", _) => out.extend((out.len() as u32 / 4).to_le_bytes()),
            ("double", name) => {
                let value = if hostile && random.one_in(4) { random.hard() } else { random.unit() };
                let value = if name == "weight" { value } else { value - 0.5 };
                out.extend(f64::from(value).to_le_bytes());
            }
            (_, name) => out.extend(bytes_of(&floats(random, name, hostile))),
        }
    }
    out.truncate(bytes);
    out
}

/// Some floats of an array.
fn floats(random: &mut Random, name: &str, hostile: bool) -> Vec<f32> {
    if hostile && random.one_in(3) || !name.starts_with("world_from_") && random.one_in(64) {
        return vec![random.hard(); 3];
    }
    match name {
        "world_from_map" | "world_from_tree" => random.frame().to_vec(),
        "wi" | "wo" | "normal" => random.direction().to_vec(),
        "position" => (0..3).map(|_| 200.0 * (random.unit() - 0.5)).collect(),
        "weight" | "contribution" => {
            vec![random.unit() * random.pick(&[0.0, 1.0, 1.0, 1e-40, 1e30])]
        }
        _ => vec![random.unit()],
    }
}

fn material(case: &mut Case, layout: &Layout) -> u64 {
    let bytes = structs::material(case);
    case.give_packed(Role::State, &bytes, layout)
}

/// Objects of a kind that fit those that were chosen before.
fn candidates(case: &Case, kind: &str) -> Vec<Object> {
    let pool = &case.world.pool;
    let all = pool.of(kind);
    let related = |object: &Object| case.objects.iter().any(|chosen| object.owner == chosen.id);
    let axes = |object: &Object| object.number;
    let takes_product = case.function.name == "wis_product_open"
        || case.function.parameters.iter().any(|parameter| parameter.pointee.ends_with("_product"));
    let fitting: Vec<Object> = match kind {
        "wis_product" => all.iter().copied().filter(related).collect(),
        // One that a product was prepared with, if there is a product to choose.
        "wis_environment" if takes_product => {
            let products = pool.of("wis_product");
            all.iter().copied().filter(|light| products.iter().any(|product| product.owner == light.id)).collect()
        }
        "wis_tree" => {
            let planar = ["wis_triple", "wis_visibility"].iter().any(|start| case.function.name.starts_with(start));
            let most = case.objects.last().map_or(4, axes);
            all.iter().copied().filter(|tree| if planar { tree.number == 2 } else { tree.number <= most }).collect()
        }
        _ => Vec::new(),
    };
    if fitting.is_empty() { all } else { fitting }
}

/// An object of the pool, or something else that is as long.
fn object(case: &mut Case, parameter: &Parameter) -> u64 {
    let kind = parameter.pointee.as_str();
    let fitting = candidates(case, kind);
    let fitting = if case.random.one_in(32) { case.world.pool.of(kind) } else { fitting };
    let chosen = case.choose(&fitting);
    let bytes = &*case.world.memory.bytes(chosen.place);
    let is_state = !parameter.declaration.starts_with("const");
    let layout = Layout { fields: Vec::new(), size: 1, align: 16 };
    let role = if is_state { Role::State } else { Role::Input };
    if case.is_spoiled() {
        let mut bytes = bytes.to_vec();
        match case.random.below(4) {
            0 => bytes.fill(0),
            1 => bytes.iter_mut().for_each(|byte| *byte = case.random.bits() as u8),
            _ => {}
        }
        return case.give_packed(role, &bytes, &layout);
    }
    if is_state { case.give_packed(role, bytes, &layout) } else { case.world.memory.reader(chosen.place) as u64 }
}

/// Bytes for a call that opens them: as they were built, cut, or changed.
fn stored(case: &mut Case) -> u64 {
    let kind = case.function.name.trim_end_matches("_open").to_string();
    let chosen = case.choose(&candidates(case, &kind));
    let mut bytes = case.world.memory.bytes(chosen.place).to_vec();
    match case.random.below(8) {
        0..=1 => {}
        2 => bytes.truncate(case.random.below(bytes.len())),
        _ => {
            case.is_altered = true;
            corrupt(&kind, &mut bytes, &mut case.random);
        }
    }
    case.decide("bytes", bytes.len() as u64);
    case.input(&bytes, 16)
}

/// Memory to build in: as long as the size query says, or shorter.
fn block(case: &mut Case, name: &str) -> u64 {
    let layout = Layout { fields: Vec::new(), size: 1, align: 16 };
    if case.function.name == "wis_environment_turn" {
        let chosen = case.choose(&case.world.pool.of("wis_environment"));
        let bytes = &*case.world.memory.bytes(chosen.place);
        case.decide("bytes", bytes.len() as u64);
        return case.give_packed(Role::State, bytes, &layout);
    }
    if let Some((bytes, role)) = crate::building::block(case, name) {
        case.decide(if name == "memory" { "bytes" } else { "scratch_bytes" }, bytes.len() as u64);
        return case.give_packed(role, &bytes, &layout);
    }
    if case.sizes.is_none() {
        case.sizes = Some(case.query(&case.function.size_query()).unwrap_or([4096, 4096]));
    }
    let [mut bytes, scratch] = case.sizes.unwrap_or_default();
    if case.function.name.ends_with("product_prepare") {
        bytes = bytes.saturating_mul(case.number("count").unwrap_or(1));
    }
    // The memory of visibility caches and others is measured once; strata keep their lights elsewhere.
    let needed = if name == "memory" { bytes } else { scratch };
    let mut len = needed.min(LONGEST);
    if case.is_spoiled() {
        len = random_less(&mut case.random, len);
    }
    case.decide(if name == "memory" { "bytes" } else { "scratch_bytes" }, len as u64);
    let bytes = case.garbage(len);
    case.give_packed(Role::Work, &bytes, &layout)
}

fn random_less(random: &mut Random, len: usize) -> usize {
    if random.one_in(2) { len.saturating_sub(1 + random.below(64)) } else { random.below(len) }
}

/// An array of lists of wavelets, and of their lengths.
fn lists(case: &mut Case) -> u64 {
    let (mut pointers, mut counts) = (Vec::new(), Vec::new());
    for _ in 0..length(case, "list") {
        let hostile = case.is_spoiled() && case.random.one_in(4);
        let list = list(&mut case.random, hostile);
        counts.extend(((list.len() / 20) as u32).to_le_bytes());
        let address = case.input(&list, 4);
        pointers.extend(address.to_le_bytes());
    }
    case.list = counts;
    case.input(&pointers, 8)
}

/// Wavelets of a random set of squares, depth first; out of order if hostile.
pub fn list(random: &mut Random, hostile: bool) -> Vec<u8> {
    let count = random.pick(&[0, 1, 3, 12, 40]);
    let mut squares: Vec<(u64, u32)> = (0..count)
        .map(|_| {
            let most = random.pick(&[5, 5, 5, 12]);
            let level = random.below(most);
            let path = random.bits() & ((1 << (2 * level)) - 1);
            (path << (2 * (12 - level)), level as u32)
        })
        .collect();
    squares.sort_unstable();
    squares.dedup();
    if hostile {
        let count = squares.len().max(1);
        let (a, b) = (random.below(count), random.below(count));
        if a < squares.len() && random.one_in(2) {
            squares.swap(a, b);
        } else if a < squares.len() {
            squares[a] = (random.bits(), random.below(40) as u32);
        }
    }
    let scale = random.pick(&[1.0, 1.0, 1e-40, 1e20, 1e38]);
    let mut bytes = Vec::new();
    for (position, level) in squares {
        let mut detail = || if random.one_in(4) { 0.0 } else { (random.unit() - 0.5) * scale };
        bytes.extend((position as u32).to_le_bytes());
        bytes.extend(level.to_le_bytes());
        bytes.extend(bytes_of(&[detail(), detail(), detail()]));
    }
    bytes
}

/// What wis_sparse_pack writes, of any wavelets; its length is decided.
fn packed(case: &mut Case, layout: &Layout) -> u64 {
    let random = &mut case.random;
    let (count, depth) = (random.below(40), 7 + random.below(6));
    let mut bytes = [b"wp\x01", &[depth as u8][..], &[0; 4], &bytes_of(&[random.unit(), random.unit()])].concat();
    for _ in 0..count {
        bytes.push(1 + random.below(127) as u8);
        bytes.extend((random.bits() as i16).to_le_bytes());
    }
    let length = bytes.len();
    bytes[4..8].copy_from_slice(&(length as u32).to_le_bytes());
    case.decide("packed_bytes", length as u64);
    if case.is_spoiled() {
        let place = case.random.below(length);
        bytes[place] ^= 1 << case.random.below(8);
    }
    case.give_packed(Role::Input, &bytes, layout)
}

fn number(case: &mut Case, parameter: &Parameter) -> u64 {
    if let Some(decided) = case.number(&parameter.name) {
        return strided(case, parameter, decided as u64);
    }
    let hostile = case.is_spoiled();
    if parameter.scalar.is_float() {
        let value = if hostile { case.random.hard() } else { case.random.unit() };
        return if parameter.scalar == Scalar::F32 { value.to_bits().into() } else { f64::from(value).to_bits() };
    }
    let (value, most) = whole(case, parameter);
    if !hostile {
        return value;
    }
    let bits = case.random.bits() >> 32;
    // A value beyond the most is hostile already.
    if value > most {
        value
    } else {
        case.random.pick(&[0, 1, value + 1, 1 << 31, u64::from(u32::MAX), bits]).min(most)
    }
}

/// A stride or a length that an array decided, or a hostile one.
fn strided(case: &mut Case, parameter: &Parameter, decided: u64) -> u64 {
    if case.is_spoiled() && parameter.name.ends_with("stride") {
        return case.random.pick(&[1, 2, 3, decided | 1, decided | 2, 1 << 63, u64::MAX, u64::MAX - 3]);
    }
    if case.is_spoiled() && parameter.name == "count" { u64::MAX / 2 } else { decided }
}

/// The length of a list that is the next argument, which is made with it.
fn list_length(case: &mut Case) -> Option<u64> {
    let next = case.function.parameters.get(case.words.len() + 1)?;
    if !next.is_input() || next.pointee != "wis_wavelets" {
        return None;
    }
    let hostile = case.spoiled == Some(case.words.len() + 1) && case.random.one_in(2);
    case.list = list(&mut case.random, hostile);
    Some((case.list.len() / case.world.headers.layouts[&next.pointee].size) as u64)
}

/// A valid whole number, and the largest hostile one that the memory beside it allows: [`u64::MAX`] if none depends on it.
fn whole(case: &mut Case, parameter: &Parameter) -> (u64, u64) {
    if let Some(count) = list_length(case) {
        return (count, count);
    }
    if case.function.name == "wis_environment_run" {
        return crate::building::portion(case);
    }
    let name = case.function.name.as_str();
    let mut random = case.random;
    let value = match parameter.name.as_str() {
        "count" if name == "wis_triple_blend" => (1 + random.below(5) as u64, 20),
        "count" if name == "wis_product_prepare" => (1 + random.below(5) as u64, 5),
        "count" if name == "wis_direct_wave" => (random.below(40) as u64, 100),
        "count" => {
            let count = random.pick(&[0, 1, 1, 2, 3, 7, 8, 9, 16, 17, 64, 100]) as u64;
            let strided = case.function.parameters.iter().any(|parameter| parameter.name.ends_with("stride"));
            if case.is_spoiled() && strided && random.one_in(2) {
                (random.pick(&[u64::MAX, u64::MAX / 2, u64::MAX / 4 + 1, 1 << 62]), count)
            } else {
                (count, 100)
            }
        }
        "rays" => (1 + random.below(8) as u64, 4999),
        "picks" => (random.below(40) as u64, 100),
        "keep" | "room" => (random.pick(&[0, 1, 10, 60, 2000]), 2000),
        "light_count" | "places" => (1 + random.below(12) as u64, u64::MAX),
        "light" => {
            let lights = case.objects.last().map_or(1, |jitter| jitter.number);
            (random.below(lights) as u64, u64::MAX)
        }
        "rule" | "distribution" => (random.below(2) as u64, u64::MAX),
        "side" => (1 + random.below(64) as u64, u64::MAX),
        "slice_count" => (1 + random.below(28) as u64, u64::MAX),
        _ => (random.bits() >> 32 >> random.below(32), u64::MAX),
    };
    case.random = random;
    value
}
