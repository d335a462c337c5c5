//! What must hold after every call, whatever its arguments were.

use crate::call::Answer;
use crate::case::{Case, Given, Role};
use crate::header::Scalar;
use std::ffi::CStr;

pub const OK: u32 = 0;
const MEMORY_TOO_SMALL: u32 = 4;
const OVERFLOW: u32 = 6;
const CORRUPT: u32 = 10;

/// What is wrong, in a sentence.
pub type Verdict = Result<(), String>;

macro_rules! must {
    ($condition:expr, $($text:tt)*) => {{
        let holds: bool = $condition;
        if !holds {
            return Err(format!($($text)*));
        }
    }};
}
pub(crate) use must;

/// Checks what a call answered and wrote.
pub fn check(case: &Case, answer: Answer, control: u32) -> Verdict {
    let name = &case.function.name;
    must!(answer.control == control, "the control word {control:x} became {:x}", answer.control);
    let status = if case.function.answers_status { answer.result as u32 } else { OK };
    must!(documented(case, status), "status {status} is not what the header says of {name}");
    for given in &case.given {
        let parameter = &case.function.parameters[given.parameter].name;
        must!(case.world.memory.is_intact(given.place), "bytes beside {parameter} were written");
        written(case, given, status).map_err(|fault| format!("{parameter}: {fault}"))?;
    }
    if status == OK { handles(case) } else { Ok(()) }
}

/// Statuses that any call may answer: the header says so once, and of ranges and sizes in the comments of arguments.
const ANY: [&str; 8] = [
    "WIS_OK",
    "WIS_NULL_POINTER",
    "WIS_INVALID_ARGUMENT",
    "WIS_INVALID_STRUCT_SIZE",
    "WIS_MEMORY_TOO_SMALL",
    "WIS_MISALIGNED",
    "WIS_OVERFLOW",
    "WIS_MISMATCH",
];

/// Whether the comment of the function names the status, or that of a struct that it takes.
fn documented(case: &Case, status: u32) -> bool {
    let headers = &case.world.headers;
    let Some(name) = headers.statuses.get(status as usize) else { return false };
    let takes =
        |kinds: &[&str]| case.function.parameters.iter().any(|parameter| kinds.contains(&parameter.pointee.as_str()));
    let maps = ["wis_environment_config", "wis_tree_config"];
    ANY.contains(&name.as_str())
        || case.function.statuses.contains(name)
        || match name.as_str() {
            "WIS_INVALID_TEXEL" => takes(&maps),
            "WIS_CALLBACK_FAILED" => takes(&maps) || takes(&["wis_point"]),
            "WIS_INVALID_TRANSFORM" => takes(&maps) || takes(&["wis_point", "float"]),
            _ => false,
        }
}

/// Checks the bytes of a block that the call could write.
fn written(case: &Case, given: &Given, status: u32) -> Verdict {
    let bytes = &*case.world.memory.bytes(given.place);
    let parameter = &case.function.parameters[given.parameter];
    match given.role {
        Role::Input | Role::Work => Ok(()),
        Role::State if status != OK => {
            let keeps = matches!(parameter.pointee.as_str(), "wis_sampler" | "void");
            must!(keeps || bytes == given.before, "written although the status is {status}");
            Ok(())
        }
        Role::Result if status != OK => {
            must!(
                bytes == given.before || undefined(&case.function.name, &parameter.name, status),
                "written although the status is {status}"
            );
            Ok(())
        }
        Role::Diagnostic if status == OK || bytes.as_ptr().addr() % given.layout.align != 0 => {
            must!(bytes == given.before, "written although nothing failed, or not aligned");
            Ok(())
        }
        Role::Diagnostic => diagnostic(case, bytes, status),
        Role::State | Role::Result => {
            let stray = (0..bytes.len()).find(|&at| bytes[at] != given.before[at] && !given.may_change(at));
            must!(stray.is_none(), "byte {} between the elements was written", stray.unwrap_or(0));
            finite(given, bytes)
        }
    }
}

/// Results that the header leaves undefined after a failure.
fn undefined(function: &str, parameter: &str, status: u32) -> bool {
    match status {
        MEMORY_TOO_SMALL => {
            parameter.ends_with("_count")
                || ["wis_triple_blend", "wis_sparse_pack", "wis_sparse_unpack"].contains(&function)
        }
        CORRUPT => function == "wis_sparse_unpack" && parameter == "wavelets",
        OVERFLOW => parameter == "wavelets",
        _ => false,
    }
}

/// Every float that was written is finite.
fn finite(given: &Given, bytes: &[u8]) -> Verdict {
    if given.layout.fields.is_empty() || given.span.count == 0 {
        return Ok(());
    }
    let floats: Vec<_> = given.layout.fields.iter().filter(|field| field.scalar.is_float()).collect();
    for start in (0..bytes.len()).step_by(given.span.stride) {
        let end = bytes.len().min(start + given.span.width);
        for at in (start..end).step_by(given.layout.size) {
            for field in &floats {
                let place = at + field.offset..at + field.offset + field.scalar.size();
                let value = number(&bytes[place.clone()], field.scalar);
                // What is as it was may never have been written.
                must!(
                    value.is_finite() || bytes[place.clone()] == given.before[place],
                    "{} of {at} is {value}",
                    field.path
                );
            }
        }
    }
    Ok(())
}

/// What a field holds.
pub fn number(bytes: &[u8], scalar: Scalar) -> f64 {
    let four = || bytes[..4].try_into().expect("four");
    let eight = || bytes[..8].try_into().expect("eight");
    match scalar {
        Scalar::U8 => bytes[0].into(),
        Scalar::U32 => u32::from_le_bytes(four()).into(),
        Scalar::F32 => f32::from_le_bytes(four()).into(),
        Scalar::F64 => f64::from_le_bytes(eight()),
        Scalar::U64 | Scalar::Pointer => u64::from_le_bytes(eight()) as f64,
    }
}

/// A diagnostic names an argument, a field that there is, and enough bytes.
pub fn diagnostic(case: &Case, bytes: &[u8], status: u32) -> Verdict {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"));
    let long = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight"));
    let (argument, reserved, needed, field) = (word(0) as usize, word(12), long(16), long(24));
    must!(argument <= case.function.parameters.len(), "argument {argument} of {status}");
    must!(reserved == 0, "reserved is {reserved}");
    let blamed = argument.checked_sub(1).map(|index| &case.function.parameters[index]);
    if let Some(parameter) = blamed.filter(|_| status == MEMORY_TOO_SMALL) {
        let told = match parameter.name.as_str() {
            "memory" => case.number("bytes"),
            "scratch" => case.number("scratch_bytes"),
            _ => None,
        };
        must!(told.is_none_or(|told| needed as usize > told), "{needed} bytes are needed of {told:?}");
    }
    if field != 0 {
        // SAFETY: the header says that it is a static string.
        let text = unsafe { CStr::from_ptr(field as *const _) }.to_string_lossy();
        // A field of a struct that a field points to is named as one of its own: `table.slice`.
        let layouts = &case.world.headers.layouts;
        let is_there =
            |part: &str| layouts.values().flat_map(|layout| &layout.fields).any(|field| field.path.starts_with(part));
        let is_magic = text == "magic" && blamed.is_some_and(|parameter| parameter.name == "memory");
        must!(is_magic || is_there(&text) || text.split('.').all(is_there), "there is no field {text:?}");
    }
    Ok(())
}

/// A handle is the address of its memory; those of an array lie inside.
fn handles(case: &Case) -> Verdict {
    let Some(handle) = case.function.parameters.iter().find(|parameter| parameter.is_handle()) else { return Ok(()) };
    let (Some(bytes), Some(memory)) = (case.bytes_of(&handle.name), case.block("memory")) else { return Ok(()) };
    let writer = case.world.memory.writer(memory.place) as u64;
    let start = if memory.role == Role::Input { case.world.memory.reader(memory.place) as u64 } else { writer };
    for (k, word) in bytes.chunks_exact(8).enumerate() {
        let address = u64::from_le_bytes(word.try_into().expect("eight"));
        let inside = (start..start + memory.place.len as u64).contains(&address) && address % 16 == 0;
        must!(inside && (k > 0 || address == start), "handle {k} is {address:x}, the memory {start:x}");
    }
    Ok(())
}

/// What a call wrote, to compare it with what it writes under another control word, into memory of other content.
pub fn outcome(case: &Case, answer: Answer) -> (u64, Vec<Vec<u8>>) {
    let written = |given: &&Given| matches!(given.role, Role::Result | Role::State | Role::Diagnostic);
    let mut blocks: Vec<Vec<u8>> =
        case.given.iter().filter(written).map(|given| case.world.memory.bytes(given.place).to_vec()).collect();
    if answer.result as u32 == OK && case.function.answers_status && case.build.is_none() {
        for left in crate::building::left(case) {
            if let crate::building::Left::Object(_, bytes) = left {
                blocks.push(bytes);
            }
        }
    }
    (answer.result, blocks)
}
