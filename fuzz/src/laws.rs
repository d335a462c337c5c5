//! What must hold between the results of single functions, beyond what holds for all.

use crate::call::{DEFAULT_CONTROL, Word};
use crate::case::Case;
use crate::oracle::{Verdict, must};
use crate::pool::Object;
use crate::world::World;

pub fn drawn_by_light(case: &Case) -> Verdict {
    drawn(case, "wis_pdf")
}

pub fn densities(case: &Case) -> Verdict {
    let densities = elements(case, "pdf", "pdf_stride", 1);
    must!(densities.iter().flatten().all(|pdf| *pdf >= 0.0), "a pdf below 0");
    Ok(())
}

pub fn jittered(case: &Case) -> Verdict {
    let drawn = floats(case, "sample");
    one_pdf(case, "wis_jitter_pdf", &case.words[..2], &drawn[..3], drawn[3])
}

pub fn in_tree(case: &Case) -> Verdict {
    one_pdf(case, "wis_tree_pdf", &case.words[..1], &floats(case, "point"), floats(case, "pdf")[0])
}

pub fn points(case: &Case) -> Verdict {
    let points = elements(case, "out", "stride", 2);
    must!(points.iter().flatten().all(|x| *x > 0.0 && *x < 1.0), "a point on the border");
    Ok(())
}

pub fn permutation(case: &Case) -> Verdict {
    let mut index = words(case, "index");
    index.sort_unstable();
    must!(index.iter().enumerate().all(|(k, index)| k == *index as usize), "no permutation");
    must!(count(case, "traced") <= index.len(), "more than there are");
    Ok(())
}

pub fn weights(case: &Case) -> Verdict {
    let sum: f32 = floats(case, "weights").iter().sum();
    must!((sum - 1.0).abs() < 1e-5, "weights add up to {sum}");
    Ok(())
}

pub fn key(case: &Case) -> Verdict {
    must!(count(case, "visibility_key") != 0, "the key of no place");
    Ok(())
}

pub fn yes_or_no(case: &Case) -> Verdict {
    must!(count(case, "covers") <= 1, "neither yes nor no");
    Ok(())
}

pub fn aligned(case: &Case) -> Verdict {
    must!(case.bytes_of("size").is_some_and(|size| size[8] == 16), "an alignment other than 16");
    Ok(())
}

fn words(case: &Case, name: &str) -> Vec<u32> {
    let bytes = case.bytes_of(name).unwrap_or_default();
    bytes.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().expect("four"))).collect()
}

fn count(case: &Case, name: &str) -> usize {
    words(case, name)[0] as usize
}

fn floats(case: &Case, name: &str) -> Vec<f32> {
    words(case, name).into_iter().map(f32::from_bits).collect()
}

/// The elements of an array with a stride.
fn elements(case: &Case, name: &str, stride: &str, width: usize) -> Vec<Vec<f32>> {
    let stride = case.number(stride).unwrap_or(0);
    // Of no elements the stride does not matter, nor whether it is one.
    let stride = if stride < 4 { width } else { stride / 4 };
    floats(case, name).chunks(stride).map(|element| element[..width.min(element.len())].to_vec()).collect()
}

fn is_unit(wi: &[f32]) -> bool {
    (wi.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt() - 1.0).abs() < 1e-3
}

/// Whether an environment was built with WIS_ENVIRONMENT_EXACT_ZERO. Texels of 1e-30 beside one of 3e38 then have densities below
/// the smallest float, and samples there the pdf 0: docs/trust.md.
fn keeps_black(case: &Case, object: &Object) -> bool {
    const FLAGS: usize = 188;
    const EXACT_ZERO: u8 = 4;
    object.kind == "wis_environment" && case.world.memory.bytes(object.place)[FLAGS] & EXACT_ZERO != 0
}

/// Samples have a pdf above 0, the very bits that the pdf's function answers; all of them, or none.
fn drawn(case: &Case, pdf: &str) -> Verdict {
    let drawn = elements(case, "drawn", "drawn_stride", 4);
    let some = drawn.iter().filter(|drawn| drawn[3] > 0.0).count();
    let is_distribution = !case.is_altered && !case.objects.iter().any(|object| keeps_black(case, object));
    must!(some == 0 || some == drawn.len() || !is_distribution, "{some} of {} samples", drawn.len());
    must!(drawn.iter().all(|drawn| drawn[3] >= 0.0), "a pdf below 0");
    if some == 0 {
        return Ok(());
    }
    must!(drawn.iter().all(|drawn| drawn[3] == 0.0 || is_unit(&drawn[..3])), "no direction of unit length");
    let memory = &case.world.memory;
    let place = memory.place(World::CHECK, 4 * drawn.len(), 4, 0, true);
    let count = drawn.len() as u64;
    let source = memory.reader(case.block("drawn").expect("a block").place) as u64;
    let stride = case.number("drawn_stride").filter(|stride| *stride > 0).unwrap_or(16) as u64;
    let rest = [count, source, stride, memory.writer(place) as u64, 0].map(Word::Integer);
    let words = [&case.words[..3], &rest[..]].concat();
    let status = case.world.call(case.world.function(pdf), &words, DEFAULT_CONTROL).result as u32;
    must!(status == 0, "{pdf} answers {status} for samples");
    for (k, (bytes, drawn)) in memory.bytes(place).chunks_exact(4).zip(&drawn).enumerate() {
        let again = f32::from_le_bytes(bytes.try_into().expect("four"));
        must!(
            again.to_bits() == drawn[3].to_bits() || drawn[3] == 0.0,
            "sample {k}: pdf {}, asked again {again}",
            drawn[3]
        );
    }
    Ok(())
}

/// The same for one sample.
fn one_pdf(case: &Case, pdf: &str, objects: &[Word], at: &[f32], expected: f32) -> Verdict {
    must!(expected >= 0.0, "a pdf below 0");
    if expected == 0.0 {
        return Ok(());
    }
    let memory = &case.world.memory;
    let (source, target) =
        (memory.place(World::CHECK, 4 * at.len(), 4, 0, true), memory.place(World::CHECK + 1, 4, 4, 0, true));
    memory.bytes(source).copy_from_slice(&crate::case::bytes_of(at));
    let rest = [memory.reader(source) as u64, memory.writer(target) as u64].map(Word::Integer);
    let words = [objects, &rest[..]].concat();
    let status = case.world.call(case.world.function(pdf), &words, DEFAULT_CONTROL).result as u32;
    must!(status == 0, "{pdf} answers {status} for a sample");
    let again = f32::from_le_bytes(memory.bytes(target)[..4].try_into().expect("four"));
    must!(again.to_bits() == expected.to_bits(), "pdf {expected}, asked again {again}");
    Ok(())
}

/// Where there is a u it lies in [0, 1); where there is none nothing was written.
pub fn inverted(case: &Case) -> Verdict {
    let (Some(status), Some(given)) = (case.bytes_of("status"), case.block("u")) else { return Ok(()) };
    let bytes = &*case.world.memory.bytes(given.place);
    for (k, (status, u)) in status.iter().zip(elements(case, "u", "u_stride", 2)).enumerate() {
        let at = k * given.span.stride;
        match status {
            0 => must!(u.iter().all(|u| (0.0..1.0).contains(u)), "u {u:?} of direction {k}"),
            8 | 11 | 14 => must!(bytes[at..at + 8] == given.before[at..at + 8], "u of direction {k} was written"),
            _ => return Err(format!("status {status} of direction {k}")),
        }
    }
    Ok(())
}

pub fn rays(case: &Case) -> Verdict {
    let (count, most) = (count(case, "ray_count"), case.number("rays").unwrap_or(0));
    must!(count <= most, "{count} rays of {most}");
    for ray in floats(case, "ray").chunks_exact(4).take(count) {
        must!(is_unit(&ray[..3]), "no direction of unit length: {ray:?}");
        must!(ray[3] >= 0.0 && ray[3].is_finite(), "a weight of {}", ray[3]);
    }
    Ok(())
}
