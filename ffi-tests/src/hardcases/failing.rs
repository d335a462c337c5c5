//! Callbacks of the client that fail half way: each call of a callback in turn. A status, nothing written, and the next call as if
//! nothing had been.

use super::laws::{Verdict, ensure, fails};
use super::maps::sky;
use super::table::Table;
use crate::client::{Block, Texels, raw};
use crate::environment::{Environment, Map, Sampler, material};
use std::sync::atomic::{AtomicU32, Ordering};

/// A normal that is aligned with no axis, texel or edge.
pub const TILTED: [f32; 3] = [0.36, 0.48, 0.8];

/// How a callback fails.
#[derive(Clone, Copy)]
enum Way {
    Code,
    Value(f32),
}

const WAYS: [(&str, Way); 4] = [
    ("reports a failure", Way::Code),
    ("writes NaN", Way::Value(f32::NAN)),
    ("writes +Inf", Way::Value(f32::INFINITY)),
    ("writes -1e-30", Way::Value(-1e-30)),
];

/// Adds the cases.
pub fn add(table: &mut Table) {
    for (name, way) in WAYS {
        for rays in [1, 4, 16] {
            let expected =
                "CALLBACK_FAILED, no ray and no count written; the next call has the bits of one that none preceded";
            let case = format!("`target` of a call with {rays} rays {name}, each of its calls in turn");
            table.add(case, expected, target(rays, way));
        }
    }
    let expected = "CALLBACK_FAILED and the row; a build in the same memory has the same bits";
    table.add("row callback of `wis_environment_init` fails, each of its calls in turn", expected, rows());
}

/// Fails in call `at`, counted from 0, in its last element.
fn failing<'a>(at: usize, way: Way, calls: &'a mut usize) -> impl FnMut(&[[f32; 3]], &mut [f32]) -> bool + 'a {
    move |wi, f_cos| {
        wi.iter().zip(&mut *f_cos).for_each(|(wi, f_cos)| *f_cos = wi[2].max(0.0) + 0.1);
        *calls += 1;
        match way {
            Way::Code => *calls != at + 1,
            Way::Value(value) => {
                if *calls == at + 1 {
                    f_cos[f_cos.len() - 1] = value;
                }
                true
            }
        }
    }
}

fn target(rays: usize, way: Way) -> Verdict {
    let image = sky();
    let environment = Environment::new(&image.map())?;
    let material = material(&[raw::wis_lobe { kind: raw::WIS_LOBE_GGX, a: 0.3, b: 0.3, eta: 1.0 }])?;
    let mut point = raw::wis_point {
        size: size_of::<raw::wis_point>() as u32,
        material: &material,
        normal: TILTED,
        wo: [0.0, 0.0, 1.0],
        seed: 5,
        ..Default::default()
    };
    (point.weight[0], point.f0[0]) = ([1.0; 3], [0.8; 3]);
    let bits = |ray: &[raw::wis_ray]| {
        ray.iter().flat_map(|ray| [ray.wi[0], ray.wi[1], ray.wi[2], ray.weight].map(f32::to_bits)).collect::<Vec<_>>()
    };
    let mut expected = vec![raw::wis_ray::default(); rays];
    let mut calls = 0;
    let mut sound = failing(usize::MAX - 1, way, &mut calls);
    let count = Sampler::new(rays, 0, 0)?.direct(&environment, &point, Some(&mut sound), &mut expected)?;
    drop(sound);
    let total = calls;
    ensure(count > 0 && total > 0, || format!("{count} rays, {total} calls"))?;
    let mut sampler = Sampler::new(rays, 0, 0)?;
    let untouched = raw::wis_ray { wi: [7.0; 3], weight: 9.0 };
    for at in 0..total {
        let (mut calls, mut ray, mut written) = (0, vec![untouched; rays], 77);
        let mut brdf = failing(at, way, &mut calls);
        let answer = sampler.direct_into(&environment, &point, Some(&mut brdf), &mut ray, &mut written);
        drop(brdf);
        fails(answer, raw::WIS_CALLBACK_FAILED).map_err(|fault| format!("call {at}: {fault}"))?;
        ensure(calls == at + 1, || format!("{calls} calls, of which number {at} failed"))?;
        ensure(bits(&ray) == bits(&vec![untouched; rays]) && written == 77, || {
            format!("call {at}: something is written")
        })?;
        let (mut calls, mut ray) = (0, vec![untouched; rays]);
        let mut sound = failing(usize::MAX - 1, way, &mut calls);
        let again = sampler.direct(&environment, &point, Some(&mut sound), &mut ray)?;
        ensure(again == count && bits(&ray[..count]) == bits(&expected[..count]), || {
            format!("other rays after call {at}")
        })?;
    }
    Ok(format!("CALLBACK_FAILED, all {total}"))
}

fn rows() -> Verdict {
    let (image, none) = (sky(), AtomicU32::new(u32::MAX));
    let row = |y: u32| {
        let row = image.texels[(y * 64) as usize..].as_ptr();
        if y == none.load(Ordering::Relaxed) { std::ptr::null() } else { row.cast() }
    };
    let map = Map::latlong(64, 32, 1, Texels::Rows(raw::WIS_FORMAT_F32, &row));
    let size = Environment::size(&map)?;
    let expected = Environment::new(&map)?;
    let mut scratch = Block::new(size.scratch_bytes);
    for y in 0..32 {
        none.store(y, Ordering::Relaxed);
        let memory = Block::new(size.bytes);
        let failure = fails(Environment::new_in(&map, memory, &mut scratch), raw::WIS_CALLBACK_FAILED)?;
        ensure(failure.diagnostic.y == y, || format!("row {} in place of {y}", failure.diagnostic.y))?;
        none.store(u32::MAX, Ordering::Relaxed);
        let again = Environment::new_in(&map, Block::new(size.bytes), &mut scratch)?;
        ensure(again.bytes() == expected.bytes(), || format!("another environment after row {y}"))?;
    }
    Ok("CALLBACK_FAILED at each of 32 rows".into())
}
