//! Null and misaligned pointers, short blocks, wrong struct sizes and strides: the same faults at every function.

use super::block::{Block, SENTINEL};
use super::call::{Call, field};
use super::header::{Function, Parameter};
use super::objects::{functions, headers};
use super::scene::{SOURCES, Scene, numbers};
use wis::ffi::WIS_ALIGNMENT;
use wis::status::Status;

/// Calls `test` with every parameter of every function.
fn for_each_parameter(test: impl Fn(&Scene, &Function, &Parameter)) {
    let scene = Scene::new();
    for function in functions().iter().filter(|function| function.answers_status) {
        for parameter in &function.parameters {
            test(&scene, function, parameter);
        }
    }
}

/// The pointers of which the header says that they may be null.
fn is_optional(function: &Function, parameter: &Parameter) -> bool {
    match parameter.name.as_str() {
        "diagnostic" | "world_from_map" => true,
        "world_from_tree" => !parameter.is_result(),
        "product" => matches!(function.name.as_str(), "wis_sample" | "wis_pdf" | "wis_invert"),
        "label" => function.name == "wis_strata_lights",
        "info" => !matches!(function.name.as_str(), "wis_environment_describe" | "wis_product_describe" | "wis_check"),
        _ => false,
    }
}

/// The alignment of what a pointer points to: that of blocks, of objects, or what the header's own fields need.
fn alignment(parameter: &Parameter) -> usize {
    let layout = headers().pointed(parameter);
    if layout.fields.is_empty() { WIS_ALIGNMENT } else { layout.align }
}

#[test]
fn null_pointers() {
    for_each_parameter(|scene, function, parameter| {
        if parameter.is_pointer() {
            let mut call = Call::valid(scene, function);
            call.set(&parameter.name, 0);
            if is_optional(function, parameter) {
                call.succeeds("optional");
            } else {
                call.fails("null", Status::NullPointer, &parameter.name);
            }
        }
    });
}

#[test]
fn misaligned_pointers() {
    for_each_parameter(|scene, function, parameter| {
        if parameter.is_pointer() {
            let alignment = alignment(parameter);
            for offset in (1..alignment).filter(|offset| *offset < 4 || offset % 4 == 0) {
                let mut call = Call::valid(scene, function);
                call.misalign(&parameter.name, offset);
                call.fails(&format!("{offset} bytes off"), Status::Misaligned, &parameter.name);
            }
            let mut call = Call::valid(scene, function);
            call.misalign(&parameter.name, alignment);
            call.succeeds("aligned");
        }
    });
}

/// A block that is too short names the bytes that it lacks, and these are enough.
#[test]
fn short_blocks() {
    for_each_parameter(|scene, function, parameter| {
        let Some(block) = block_of(&parameter.name) else { return };
        for config in configurations(scene, function) {
            let call = |bytes: usize| {
                let mut call = Call::valid(scene, function);
                config.iter().for_each(|config| call.give("config", Block::new(config, 0)));
                give_bytes(&mut call, block, &parameter.name, bytes);
                call
            };
            let most = Call::valid(scene, function).number(&parameter.name);
            if call(0).answer() == Status::Ok as usize {
                // A tree of a list needs no scratch memory.
                assert_eq!((function.name.as_str(), block), ("wis_tree_init", "scratch"));
                continue;
            }
            let needed = least(most, |bytes| call(bytes).answer() == Status::Ok as usize);
            for bytes in [0, 1, needed / 2, needed - 1] {
                let diagnostic = call(bytes).fails(&format!("{bytes} bytes"), Status::MemoryTooSmall, block);
                let told = diagnostic.bytes_needed as usize;
                // What only its header measures cannot be measured before the header is there.
                let opens = function.takes("const void *memory") || function.name == "wis_environment_turn";
                let in_header = opens && bytes < told && told <= 512;
                // A sampler keeps it where there is no diagnostic.
                let kept = !function.takes("wis_diagnostic *diagnostic");
                assert!(told == needed || in_header || kept, "{}: {bytes} bytes: {told}", function.name);
            }
            call(needed).succeeds("exactly the bytes that are needed");
        }
    });
}

/// The block whose length a parameter tells.
fn block_of(length: &str) -> Option<&'static str> {
    match length {
        "bytes" => Some("memory"),
        "scratch_bytes" => Some("scratch"),
        _ => None,
    }
}

/// The configurations with which a function is tried; `None` as it comes.
pub fn configurations(scene: &Scene, function: &Function) -> Vec<Option<Vec<u8>>> {
    match function.name.as_str() {
        "wis_tree_init" => (0..SOURCES).map(|source| Some(scene.tree_config(source))).collect(),
        _ => vec![None],
    }
}

/// The least number of bytes that is enough.
fn least(most: usize, enough: impl Fn(usize) -> bool) -> usize {
    let (mut short, mut high) = (0, most);
    assert!(enough(high));
    while short + 1 < high {
        let middle = short + (high - short) / 2;
        if enough(middle) { high = middle } else { short = middle }
    }
    high
}

/// Gives a block of another length: the first bytes of the old one.
fn give_bytes(call: &mut Call, block: &str, length: &str, bytes: usize) {
    let mut content = call.bytes(block).to_vec();
    content.resize(bytes, SENTINEL);
    call.give(block, Block::new(&content, 0));
    call.set(length, bytes);
}

/// A struct of another version: only its size is read, or there.
#[test]
fn wrong_struct_sizes() {
    for_each_parameter(|scene, function, parameter| {
        if headers().pointed(parameter).begins_with_size() {
            let size = Call::valid(scene, function).bytes(&parameter.name).len() as u32;
            for wrong in [0, size - 4, size - 1, size + 1, size + 4, u32::MAX] {
                let mut call = Call::valid(scene, function);
                call.give(&parameter.name, Block::new(&wrong.to_ne_bytes(), 0));
                let diagnostic = call.fails(&format!("size {wrong}"), Status::InvalidStructSize, &parameter.name);
                assert!(!function.takes("wis_diagnostic *diagnostic") || field(&diagnostic) == Some("size"));
            }
        }
    });
}

/// The floats of an element of an array.
fn floats_of_element(array: &str) -> usize {
    match array {
        "pdf" | "weight" => 1,
        "u" | "out" => 2,
        "wi" | "f_cos" => 3,
        "drawn" => 4,
        other => panic!("{other} is no array"),
    }
}

/// The array that a stride belongs to.
fn array_of(stride: &Parameter) -> Option<&str> {
    if stride.name == "stride" { Some("out") } else { stride.name.strip_suffix("_stride") }
}

#[test]
fn strides() {
    for_each_parameter(|scene, function, parameter| {
        let Some(array) = array_of(parameter) else { return };
        let packed = 4 * floats_of_element(array);
        let try_stride = |stride: usize, status: Status| {
            let mut call = Call::valid(scene, function);
            call.set(&parameter.name, stride);
            call.fails(&format!("{array} {stride}"), status, &parameter.name);
        };
        for stride in 1..packed {
            try_stride(stride, Status::InvalidArgument);
        }
        for stride in [packed + 1, packed + 2, usize::MAX] {
            try_stride(stride, Status::Misaligned);
        }
        for stride in [usize::MAX - 3, usize::MAX / 2 - 3] {
            try_stride(stride, Status::Overflow);
        }
    });
}

/// A stride that is wider than the element leaves what is between untouched, and gives the same numbers.
#[test]
fn wide_strides() {
    for_each_parameter(|scene, function, parameter| {
        let Some(array) = array_of(parameter) else { return };
        let width = floats_of_element(array);
        let packed = Call::valid(scene, function);
        let mut wide = Call::valid(scene, function);
        let spread = |floats: &[f32], gap: f32| -> Vec<f32> {
            let elements = floats.chunks_exact(width);
            let mut spread: Vec<f32> = elements.flat_map(|e| e.iter().copied().chain([gap, gap])).collect();
            spread.truncate(spread.len() - 2);
            spread
        };
        let gap = f32::from_ne_bytes([SENTINEL; 4]);
        wide.give(array, Block::new(&numbers(&spread(&packed.floats(array), gap)), 0));
        wide.set(&parameter.name, 4 * width + 8);
        packed.succeeds("packed");
        wide.succeeds("wide");
        for result in &function.parameters {
            if result.name == array {
                assert_eq!(spread(&packed.floats(array), gap), wide.floats(array), "{}", function.name);
            } else if result.is_pointer() && !result.declaration.starts_with("const") {
                assert_eq!(packed.result(&result.name), wide.result(&result.name), "{}", function.name);
            }
        }
    });
}

/// More elements than an address space holds.
#[test]
fn overflowing_counts() {
    for_each_parameter(|scene, function, parameter| {
        let strided = function.parameters.iter().any(|parameter| array_of(parameter).is_some());
        if parameter.declaration == "size_t count" && (strided || function.name == "wis_warp_in_place") {
            for count in [usize::MAX, usize::MAX / 2, usize::MAX / 4 + 1] {
                let mut call = Call::valid(scene, function);
                call.set("count", count);
                call.fails(&format!("count {count}"), Status::Overflow, "count");
            }
        }
    });
}

/// Nothing to do is no fault, wherever the arrays are.
#[test]
fn zero_elements() {
    for_each_parameter(|scene, function, parameter| {
        if parameter.name == "count" {
            let mut call = Call::valid(scene, function);
            call.set("count", 0);
            for array in ["u", "wi", "pdf", "drawn", "point", "offset", "f_cos", "out", "points", "index"] {
                if function.has(array) {
                    call.set(array, 0);
                }
            }
            call.succeeds("count 0");
        }
    });
}

/// A handle that points to something else.
#[test]
fn other_objects() {
    for_each_parameter(|scene, function, parameter| {
        if matches!(
            parameter.pointee.as_str(),
            "wis_environment" | "wis_sampler" | "wis_visibility_cache" | "wis_product" | "wis_tree" | "wis_visibility"
        ) {
            let len = Call::valid(scene, function).bytes(&parameter.name).len();
            for other in [vec![0; len], vec![SENTINEL; len], scene.other_object(parameter.pointee.as_str())] {
                let mut call = Call::valid(scene, function);
                call.give(&parameter.name, Block::new(&other, 0));
                call.fails("another object", Status::Mismatch, &parameter.name);
            }
        }
    });
}
