//! Rule 3: objects, then config, count, inputs and blocks, then outputs, then the diagnostic; strides and sizes behind their pointer.

use super::header::{Function, Parameter};
use super::objects::functions;

/// What handles point to, and the one struct that a call completes in place.
const OBJECTS: [&str; 8] = [
    "wis_environment",
    "wis_sampler",
    "wis_visibility_cache",
    "wis_product",
    "wis_jitter",
    "wis_tree",
    "wis_visibility",
    "wis_material",
];

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Class {
    Object,
    Input,
    Output,
    Diagnostic,
}

fn class(parameter: &Parameter) -> Class {
    let handle = parameter.declaration.contains("**");
    let block = parameter.declaration.starts_with("void *");
    if parameter.name == "diagnostic" {
        Class::Diagnostic
    } else if OBJECTS.contains(&parameter.pointee.as_str()) {
        Class::Object
    } else if handle || (parameter.is_result() && !block) {
        Class::Output
    } else {
        Class::Input
    }
}

/// The pointer that a stride or a size belongs to.
fn owner(name: &str) -> Option<&str> {
    match name {
        "bytes" => Some("memory"),
        "scratch_bytes" => Some("scratch"),
        "stride" => Some("out"),
        _ => name.strip_suffix("_stride"),
    }
}

/// Points that are warped in place are inputs and outputs; two integrals name the approximations of BRDF and light first.
const OTHERWISE: [&str; 3] = ["wis_warp_in_place", "wis_triple_sublinear", "wis_visibility_integral"];

fn assert_ordered(function: &Function) {
    let name = &function.name;
    let others: Vec<&Parameter> = function.parameters.iter().filter(|p| owner(&p.name).is_none()).collect();
    let classes: Vec<Class> = others.iter().map(|parameter| class(parameter)).collect();
    assert!(classes.is_sorted() || OTHERWISE.contains(&name.as_str()), "{name}: {classes:?}");
    let position = |name: &str| function.parameters.iter().position(|parameter| parameter.name == name);
    for (at, parameter) in function.parameters.iter().enumerate() {
        let Some(owner) = owner(&parameter.name) else { continue };
        assert_eq!(position(owner), at.checked_sub(1), "{name}: {} does not follow {owner}", parameter.name);
        let is_strided = parameter.name.ends_with("stride");
        assert!(!is_strided || position("count").is_none_or(|count| count < at), "{name}: count follows {owner}");
    }
}

/// More arguments than this are a struct.
const MOST: usize = 9;

#[test]
fn functions_take_few_arguments() {
    for function in functions() {
        let count = function.parameters.len();
        assert!(count <= MOST, "{} takes {count} arguments", function.name);
    }
}

#[test]
fn arguments_follow_one_order() {
    let all = functions();
    assert!(all.len() > 62 && OTHERWISE.iter().all(|name| all.iter().any(|function| function.name == *name)));
    all.iter().for_each(assert_ordered);
}
