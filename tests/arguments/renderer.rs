//! The structs of wis.h: each field that can be wrong, levels that the processor lacks, and products of another light.

use super::block::Block;
use super::call::{Call, field};
use super::fields::{Fault, check};
use super::objects::function;
use super::objects::functions;
use super::scene::Scene;
use std::ffi::{c_int, c_void};
use wis::brdf::portal::Portal;
use wis::ffi::light::{LightConfig, WIS_ENVIRONMENT_EXACT_ZERO};
use wis::ffi::material::{MaterialData, PointData};
use wis::ffi::product::GridConfig;
use wis::ffi::sampler::{SamplerConfig, WIS_CPU_AVX2};
use wis::ffi::wave::{DirectWave, FloatsIn, IntsIn};
use wis::light::environment::turn;
use wis::simd::Level;
use wis::sphere::Frame;
use wis::status::Status;

const INVALID: Status = Status::InvalidArgument;
const TRANSFORM: Status = Status::InvalidTransform;

#[test]
fn samplers() {
    let faults: &[Fault<SamplerConfig>] = &[
        ("size", |c| c.size = 0, Status::InvalidStructSize),
        ("cpu_level", |c| c.cpu_level = WIS_CPU_AVX2 + 1, INVALID),
        ("cpu_level", |c| c.cpu_level = u32::MAX, INVALID),
        ("rays", |c| c.rays = 4097, INVALID),
        ("candidates_per_ray", |c| c.candidates_per_ray = 257, INVALID),
        ("reserved", |c| c.reserved = 1, INVALID),
    ];
    check(&["wis_sampler_size", "wis_sampler_init"], "config", faults);
}

/// A level that the build knows is accepted where the processor has it, and refused where it would be an illegal instruction.
#[test]
fn levels() {
    let scene = Scene::new();
    let mut call = Call::valid(&scene, function("wis_sampler_init"));
    call.edit("config", |config: &mut SamplerConfig| config.cpu_level = WIS_CPU_AVX2);
    if Level::detect() == Level::BASELINE {
        assert_eq!(field(&call.fails("lanes", INVALID, "config")), Some("cpu_level"));
    } else {
        call.succeeds("lanes");
    }
}

#[test]
fn products() {
    let faults: &[Fault<GridConfig>] = &[
        ("size", |c| c.size = 0, Status::InvalidStructSize),
        ("flags", |c| c.flags = 8, INVALID),
        ("divided_cells", |c| c.divided_cells = 25, INVALID),
        ("cone", |c| c.cone = -0.1, INVALID),
        ("cone", |c| c.cone = 1.6, INVALID),
        ("cone", |c| c.cone = f32::NAN, INVALID),
    ];
    check(&["wis_product_size", "wis_product_prepare"], "config", faults);
}

#[test]
fn materials() {
    let faults: &[Fault<MaterialData>] = &[
        ("size", |m| m.size = 0, Status::InvalidStructSize),
        ("lobe_count", |m| m.lobe_count = 5, INVALID),
        ("kind", |m| m.lobe[0].kind = 0, INVALID),
        ("kind", |m| m.lobe[0].kind = 4, INVALID),
        ("a", |m| (m.lobe[0].kind, m.lobe[0].a, m.lobe[0].b) = (2, 0.0, 0.5), INVALID),
        ("b", |m| (m.lobe[0].kind, m.lobe[0].a, m.lobe[0].b) = (2, 0.5, f32::NAN), INVALID),
        ("a", |m| (m.lobe[0].kind, m.lobe[0].a) = (3, -1.0), INVALID),
        ("eta", |m| (m.lobe[0].kind, m.lobe[0].a, m.lobe[0].b, m.lobe[0].eta) = (5, 0.5, 0.5, 1.0), INVALID),
    ];
    check(&["wis_material_init"], "material", faults);
}

#[test]
fn points() {
    let faults: &[Fault<PointData>] = &[
        ("size", |p| p.size = 0, Status::InvalidStructSize),
        ("flags", |p| p.flags = 16, INVALID),
        ("normal", |p| p.normal = [0.0; 3], TRANSFORM),
        ("wo", |p| p.wo = [f32::NAN, 0.0, 1.0], TRANSFORM),
        ("tangent", |p| p.tangent = [f32::INFINITY, 0.0, 0.0], TRANSFORM),
        ("weight", |p| p.weight[0] = [1.0, -1e-30, 1.0], INVALID),
        ("weight", |p| p.weight[0] = [f32::INFINITY; 3], INVALID),
    ];
    check(&["wis_direct", "wis_product_prepare", "wis_check_point"], "point", faults);
}

/// The second of two portals is no rectangle, or there are none where it is said.
#[test]
fn portals() {
    static PORTALS: [Portal; 9] = {
        let portal = Portal { corner: [0.0, 0.0, 1.0], edges: [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]] };
        let slanted = Portal { edges: [[0.0, 1.0, 0.0], [1.0, 0.1, 0.0]], ..portal };
        [portal, slanted, portal, portal, portal, portal, portal, portal, portal]
    };
    let faults: &[Fault<PointData>] = &[
        ("portal_count", |p| (p.portal_count, p.portals) = (9, PORTALS.as_ptr()), INVALID),
        ("portals", |p| p.portal_count = 1, Status::NullPointer),
        ("portals", |p| (p.portal_count, p.portals) = (1, PORTALS.as_ptr().wrapping_byte_add(2)), Status::Misaligned),
        ("portals", |p| (p.portal_count, p.portals) = (2, PORTALS.as_ptr()), INVALID),
    ];
    check(&["wis_direct"], "point", faults);
    static COUNTS: [u32; 64] = [1; 64];
    const ODD: FloatsIn = FloatsIn { first: std::ptr::without_provenance(2), point: 0, number: 0 };
    let faults: &[Fault<DirectWave>] = &[
        ("portal", |w| w.portal_count = IntsIn { first: COUNTS.as_ptr(), point: 4 }, Status::NullPointer),
        ("portal", |w| w.portal = ODD, Status::Misaligned),
        ("position", |w| w.position = ODD, Status::Misaligned),
        ("portal_count", |w| w.portal_count = IntsIn { first: COUNTS.as_ptr(), point: 2 }, Status::Misaligned),
    ];
    check(&["wis_direct_wave"], "wave", faults);
}

/// Points of a wave whose numbers overlap: rays would be lost, and inputs are a mistake.
#[test]
fn waves() {
    const fn short(wide: FloatsIn) -> FloatsIn {
        FloatsIn { point: 4, number: 8, ..wide }
    }
    let faults: &[Fault<DirectWave>] = &[
        ("ray", |w| w.ray.point = 4, INVALID),
        ("ray", |w| w.ray.point = -28, INVALID),
        ("ray", |w| (w.ray.point, w.ray.number) = (4, 8), INVALID),
        ("ray", |w| w.ray.point = 0, INVALID),
        ("wo", |w| w.wo = short(w.wo), INVALID),
        ("weight", |w| w.weight = short(w.wo), INVALID),
    ];
    check(&["wis_direct_wave"], "wave", faults);
}

/// A comparison needs a BSDF that answers.
#[test]
fn compared_points() {
    extern "C" fn negative(_: *mut c_void, _: usize, _: *const f32, f_cos: *mut f32) -> c_int {
        // SAFETY: the library gives room for 40 values.
        unsafe { f_cos.add(4).write(-1.0) };
        0
    }
    extern "C" fn fails(_: *mut c_void, _: usize, _: *const f32, _: *mut f32) -> c_int {
        1
    }
    let faults: &[Fault<PointData>] = &[
        ("target", |p| p.target = None, Status::NullPointer),
        ("target", |p| p.target = Some(negative), Status::CallbackFailed),
        ("target", |p| p.target = Some(fails), Status::CallbackFailed),
    ];
    check(&["wis_check_point"], "point", faults);
}

/// A product answers only with the light that it was prepared with: neither with one of other pixels, nor with the same one turned.
#[test]
fn other_lights() {
    let scene = Scene::new();
    let mut call = Call::valid(&scene, function("wis_environment_init"));
    call.edit("config", |config: &mut LightConfig| config.flags ^= WIS_ENVIRONMENT_EXACT_ZERO);
    call.succeeds("another light");
    let other = call.bytes("memory").to_vec();
    let mut turned = Block::new(Call::valid(&scene, function("wis_product_describe")).bytes("environment"), 0);
    turn(&mut turned, &Frame::new(&[0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0]).expect("a rotation"));
    let all = functions();
    let taking: Vec<_> = all
        .iter()
        .filter(|f| f.takes("const wis_product *product") && f.takes("const wis_environment *environment"))
        .collect();
    assert!(taking.len() >= 4);
    for function in taking {
        Call::valid(&scene, function).succeeds("its own light");
        for bytes in [&other[..], &turned] {
            let mut call = Call::valid(&scene, function);
            call.give("environment", Block::new(bytes, 0));
            call.fails("another light", Status::Mismatch, "product");
        }
    }
}
