//! A wave is single calls in order, with `begin_pixel` where the seed changes: the same bits (rule 40). A bad point fails alone.

use super::light::Light;
use super::maps;
use crate::support::Random;
use crate::support::vector::{add, scale, single, unit};
use std::ffi::CStr;
use std::ptr::{null, null_mut};
use wis::brdf::portal::Portal;
use wis::direct::Ray;
use wis::ffi::direct::wis_direct;
use wis::ffi::material::*;
use wis::ffi::sampler::*;
use wis::ffi::wave::*;
use wis::ffi::{Diagnostic, MemorySize};
use wis::status::Status;

const POINTS: usize = 96;
const RAYS: usize = 3;
/// Normal, tangent, wo; weight and f0 of two lobes; position.
const NUMBERS: usize = 9 + 12 + 3;
/// Windows above all points.
const PORTALS: [Portal; 2] = [
    Portal { corner: [-1.0, -1.0, 2.0], edges: [[0.0, 3.0, 0.0], [1.0, 0.0, 0.0]] },
    Portal { corner: [1.0, 0.0, 1.5], edges: [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]] },
];

/// A sampler in memory of its own.
struct Thread {
    _memory: Vec<u128>,
    sampler: *mut SamplerObject,
}

impl Thread {
    fn new(hits_per_pixel: u32) -> Thread {
        let size = size_of::<SamplerConfig>() as u32;
        let config = SamplerConfig { size, rays: RAYS as u32, hits_per_pixel, ..SamplerConfig::default() };
        let (mut needed, mut sampler) = (MemorySize::default(), null_mut());
        // SAFETY: all pointers are valid, and the memory is as long as the size query says.
        unsafe {
            assert_eq!(wis_sampler_size(&config, &mut needed, null_mut()), Status::Ok);
            let mut memory = vec![0u128; needed.bytes.div_ceil(16)];
            let (start, bytes) = (memory.as_mut_ptr().cast(), 16 * memory.len());
            assert_eq!(wis_sampler_init(&config, start, bytes, &mut sampler, null_mut()), Status::Ok);
            Thread { _memory: memory, sampler }
        }
    }
}

fn material(lobes: &[LobeData]) -> MaterialData {
    let size = size_of::<MaterialData>() as u32;
    let mut data = MaterialData { size, lobe_count: lobes.len() as u32, ..MaterialData::default() };
    data.lobe[..lobes.len()].copy_from_slice(lobes);
    // SAFETY: the pointer is valid.
    assert_eq!(unsafe { wis_material_init(&mut data, null_mut()) }, Status::Ok);
    data
}

/// The numbers of all points, each of which begins at a multiple of `point` and goes on in steps of `number`.
fn floats(columns: &[f32], from: usize, [point, number]: [usize; 2]) -> FloatsIn {
    let first = columns[from * number..].as_ptr();
    FloatsIn { first, point: 4 * point as isize, number: 4 * number as isize }
}

#[test]
fn waves_are_single_calls() {
    let light = Light::of(&maps()[1].1);
    let mut copy = vec![0u128; light.environment().as_bytes().len().div_ceil(16)];
    bytemuck::cast_slice_mut(&mut copy)[..light.environment().as_bytes().len()]
        .copy_from_slice(light.environment().as_bytes());
    let environment = copy.as_ptr().cast();
    let lobe = |kind, a| LobeData { kind, a, b: a, eta: 0.0 };
    let materials =
        [material(&[lobe(WIS_LOBE_LAMBERT, 0.0)]), material(&[lobe(WIS_LOBE_LAMBERT, 0.0), lobe(WIS_LOBE_GGX, 0.2)])];
    // Structures, and columns.
    for layout in [[NUMBERS, 1], [1, POINTS]] {
        for (hits, with_portals) in [(0, false), (16, false), (16, true)] {
            let mut random = Random(7);
            let mut columns = vec![0.0f32; POINTS * NUMBERS];
            let mut kind = vec![0u32; POINTS];
            for i in 0..POINTS {
                // Close together: hits of a pixel share products, and the next pixel's would if they were not forgotten.
                let normal = single(unit(add([0.0, 0.0, 1.0], scale(random.direction(), 0.05))));
                let (tangent, wo) = (single(random.direction()), normal);
                let rest = (0..NUMBERS - 9).map(|_| random.f32());
                // Point 40 has no normal.
                let normal = if i == 40 { [0.0; 3] } else { normal };
                for (k, x) in normal.into_iter().chain(tangent).chain(wo).chain(rest).enumerate() {
                    columns[i * layout[0] + k * layout[1]] = x;
                }
                kind[i] = (i % 2) as u32;
            }
            let seed: Vec<u32> = (0..POINTS as u32).map(|i| i / 16).collect();
            let sample: Vec<u32> = (0..POINTS as u32).map(|i| i % 16).collect();
            // Point 41 has too many.
            let portals: Vec<u32> = (0..POINTS as u32).map(|i| if i == 41 { 9 } else { i % 3 }).collect();
            let mask: Vec<u8> = (0..POINTS).map(|i| u8::from(i % 7 != 3)).collect();
            let mut rays = vec![0.0f32; 4 * RAYS * POINTS];
            let (mut count, mut status) = (vec![9u32; POINTS], vec![99u8; POINTS]);
            let ints = |values: &[u32]| IntsIn { first: values.as_ptr(), point: 4 };
            let zero = IntsIn { first: null(), point: 0 };
            let wave = DirectWave {
                size: size_of::<DirectWave>() as u32,
                flags: 0,
                material_count: 2,
                rays: RAYS as u32,
                materials: materials.as_ptr(),
                material: ints(&kind),
                mask: mask.as_ptr(),
                normal: floats(&columns, 0, layout),
                tangent: floats(&columns, 3, layout),
                wo: floats(&columns, 6, layout),
                weight: floats(&columns, 9, layout),
                f0: floats(&columns, 15, layout),
                seed: ints(&seed),
                sample: ints(&sample),
                bounce: zero,
                visibility_key: zero,
                portal_count: if with_portals { ints(&portals) } else { zero },
                portal: FloatsIn { first: PORTALS.as_ptr().cast(), point: 0, number: 0 },
                position: floats(&columns, 21, layout),
                visibility: null_mut(),
                ray: FloatsOut { first: rays.as_mut_ptr(), point: 16 * RAYS as isize, number: 0 },
                count: count.as_mut_ptr(),
                status: status.as_mut_ptr(),
            };
            let (waves, singles) = (Thread::new(hits), Thread::new(hits));
            // SAFETY: all arrays hold `POINTS` points.
            assert_eq!(unsafe { wis_direct_wave(waves.sampler, environment, POINTS, &wave) }, Status::Ok);
            let at = |i: usize, k: usize| columns[i * layout[0] + k * layout[1]];
            let mut last = None;
            for i in 0..POINTS {
                if mask[i] == 0 {
                    assert_eq!((count[i], status[i]), (0, 0));
                    continue;
                }
                let three = |k| [at(i, k), at(i, k + 1), at(i, k + 2)];
                let position = three(21);
                let relative = PORTALS.map(|portal| {
                    let corner = portal.corner;
                    Portal { corner: [0, 1, 2].map(|k| corner[k] - position[k]), ..portal }
                });
                let mut point = PointData {
                    size: size_of::<PointData>() as u32,
                    flags: 0,
                    material: &materials[kind[i] as usize],
                    normal: three(0),
                    tangent: three(3),
                    wo: three(6),
                    weight: [[0.0; 3]; WIS_MAX_LOBES],
                    f0: [[0.0; 3]; WIS_MAX_LOBES],
                    seed: seed[i],
                    sample: sample[i],
                    bounce: 0,
                    visibility_key: 0,
                    portal_count: if with_portals { portals[i] } else { 0 },
                    visibility: null_mut(),
                    target: None,
                    target_user: null_mut(),
                    portals: relative.as_ptr(),
                };
                (point.weight[0], point.weight[1]) = (three(9), three(12));
                (point.f0[0], point.f0[1]) = (three(15), three(18));
                let (mut got, mut out) = (0u32, [Ray::default(); RAYS]);
                // SAFETY: all pointers are valid.
                let answer = unsafe {
                    if last != Some(seed[i]) {
                        assert_eq!(wis_sampler_begin_pixel(singles.sampler), Status::Ok);
                        last = Some(seed[i]);
                    }
                    let rays = RAYS as u32;
                    wis_direct(singles.sampler, environment, &point, rays, out.as_mut_ptr(), &mut got)
                };
                assert_eq!((status[i], answer == Status::Ok), (answer as u8, i != 40 && (i != 41 || !with_portals)));
                assert_eq!(count[i], got, "point {i}");
                for (r, ray) in out.iter().take(got as usize).enumerate() {
                    let own = &rays[4 * (i * RAYS + r)..][..4];
                    let [x, y, z] = ray.wi;
                    assert_eq!(own.to_vec(), [x, y, z, ray.weight], "point {i}");
                }
                if point.portal_count == 2 {
                    let slanted = [relative[0], Portal { edges: [[1.0, 0.1, 0.0], [0.0, 1.0, 0.0]], ..relative[1] }];
                    point.portals = slanted.as_ptr();
                    let (mut ray, mut fault) = (Ray::default(), Diagnostic::default());
                    // SAFETY: all pointers are valid.
                    let (answer, field) = unsafe {
                        let answer = wis_direct(singles.sampler, environment, &point, 1, &mut ray, &mut got);
                        assert_eq!(wis_sampler_fault(singles.sampler, &mut fault), Status::Ok);
                        (answer, CStr::from_ptr(fault.field))
                    };
                    assert_eq!((answer, fault.argument, fault.y, field), (Status::InvalidArgument, 3, 1, c"portals"));
                }
            }
        }
    }
}
