//! Rooms, with and without portals, beside what a renderer may do in them.

mod page;
mod passes;
mod renderer;
mod seen;
mod several;

use anyhow::Result;
use glam::Vec3;
use several::REFERENCES;
use std::path::Path;
use wis_ffi_tests::data;
use wis_ffi_tests::library::Mode;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::measure::{Cell, Effort, Truth, measure};
use wis_ffi_tests::method::Method;
use wis_ffi_tests::peers::Peer;
use wis_ffi_tests::portal::{Portal, Room};
use wis_ffi_tests::reference::Reference;
use wis_ffi_tests::scene::{Opening, Scene, Stage, View, WINDOW};
use wis_ffi_tests::setting::{Lit, Setting};

/// The first two are those that its developers never tuned on.
const MAPS: [&str; 3] = ["adams_place_bridge_1k.hdr", "potsdamer_platz_1k.hdr", "venice_sunset_1k.hdr"];
/// The disagreement of the halves of references at which they are good enough.
const BOUND: f64 = 0.003;
const RAYS: [usize; 3] = [1, 4, 16];
const METHODS: [Method; 9] = [
    Method::Peer(Peer::MisBalance),
    Method::Peer(Peer::MisCompensated),
    Method::Peer(Peer::Portals),
    Method::Peer(Peer::Windows),
    Method::Library(Mode::Direct),
    Method::Library(Mode::Portals),
    Method::Library(Mode::Complete),
    Method::Library(Mode::Few),
    Method::Library(Mode::Split),
];

/// Measures and writes the page.
///
/// # Errors
/// Those of the library and of files.
pub fn run(file: &Path, quick: bool) -> Result<()> {
    let (points, most) = if quick { (60, 512) } else { (240, 8192) };
    let (lights, sun) = (lights(quick)?, sun(quick));
    let materials = [Material::lambert(), Material::ggx(0.2), Material::mix(0.1)];
    let materials = if quick { &materials[..1] } else { &materials };
    let (mut cells, mut seen) = (Vec::new(), Vec::new());
    for (name, stage, under) in stages()? {
        let scene = Scene::of(name, &stage, View::Points(points))?;
        let taught = Scene::of(name, &stage, View::Image(if quick { 48 } else { seen::STEP }))?;
        let lights =
            if under == Under::Sun { std::slice::from_ref(&sun) } else { &lights[..lights.len().min(under.count())] };
        for light in lights {
            let (lit, room) = (Lit::new(light)?, Room::new(&scene.portals, scene.is_closed, light));
            for material in materials {
                let setting = Setting::new(&lit, material).within(room.as_ref());
                let reference = reference(&scene, &setting, most)?;
                cells.push(cell(&scene, &setting, &reference, if quick { 8 } else { 48 })?);
                if page::is_without_portals(name) {
                    seen.push(seen::measured(&scene, &taught, &setting, &Truth::new(&reference, 1))?);
                }
                eprintln!("{name}, {}, {}", light.name, material.name);
            }
        }
    }
    let passes = passes::measured(&lights, quick)?;
    let several = several::measured(&lights, points, quick)?;
    page::page(&cells, &seen, &passes, &several)?.write(file)
}

/// Which lights a scene has.
#[derive(Clone, Copy, PartialEq)]
enum Under {
    All,
    One,
    Sun,
}

impl Under {
    fn count(self) -> usize {
        if self == Under::All { MAPS.len() } else { 1 }
    }
}

fn lights(quick: bool) -> Result<Vec<Light>> {
    let there = if quick { Vec::new() } else { data::lights(&MAPS)? };
    let made = || [Light::room(256), Light::field(256)].map(Light::bilinear).into();
    Ok(if there.is_empty() { made() } else { there })
}

/// A sun that shines through the window, 36 degrees above the horizon.
fn sun(quick: bool) -> Light {
    let width = if quick { 128 } else { 1024 };
    Light::unclipped("a sun in the window", width, 2, [width * 31 / 32, width * 3 / 20]).bilinear()
}

/// A window of 20 x 15 degrees from the middle of the room.
const SMALL: Opening = Opening { wall: 0, across: [-0.35, 0.35], up: [1.0, 1.5] };
const THREE_AND_A_DOOR: [Opening; 4] = [
    Opening { wall: 0, across: [-1.6, -0.7], up: [0.8, 1.8] },
    Opening { wall: 0, across: [0.3, 1.5], up: [0.8, 1.8] },
    Opening { wall: 1, across: [-0.6, 0.6], up: [1.0, 1.9] },
    Opening { wall: 2, across: [-0.4, 0.5], up: [0.0, 2.0] },
];

/// What is looked at, by name, and under which lights.
fn stages() -> Result<Vec<(&'static str, Stage, Under)>> {
    let inside = |openings: &[Opening]| -> Result<Stage> { Ok(Stage::indoors(data::mesh("spot.obj")?, openings)) };
    let sky = Portal { corner: Vec3::new(-1e4, -1e4, 2.5), edges: [Vec3::Y * 2e4, Vec3::X * 2e4] };
    let behind = Portal { corner: Vec3::new(2.0, -0.8, 0.7), edges: [Vec3::Y * 1.6, Vec3::Z * 1.1] };
    Ok(vec![
        ("one window", inside(&[WINDOW])?, Under::All),
        ("a small window", inside(&[SMALL])?, Under::All),
        ("three windows and a door", inside(&THREE_AND_A_DOOR)?, Under::All),
        ("sun through the window", inside(&[WINDOW])?, Under::Sun),
        ("a portal before the whole sky", Stage::outdoors(data::mesh("spot.obj")?).with_portals(vec![sky]), Under::All),
        ("a portal that faces away", inside(&[WINDOW])?.with_portals(vec![behind]), Under::One),
    ])
}

fn reference(scene: &Scene, setting: &Setting, most: usize) -> Result<Reference> {
    let name = [&scene.name, &setting.light.name, &setting.material.name].map(|name| name.replace(' ', "_")).join("-");
    let file = Path::new(REFERENCES).join(format!("{name}-{:x}.json", scene.fingerprint()));
    Reference::to(BOUND, &file, scene, setting, most)
}

/// Errors of one ray are heavy-tailed in rooms: eight repeats left a factor of three between two runs.
const REPEATS: u32 = 32;

fn cell(scene: &Scene, setting: &Setting, reference: &Reference, timed: usize) -> Result<Cell> {
    let kept = |method: &&Method| scene.is_closed || **method != Method::Library(Mode::Complete);
    let methods = METHODS.iter().filter(kept).map(|method| method.name()).collect();
    let effort = Effort { methods, counts: RAYS.into(), repeats: REPEATS, timed, caches: 1 };
    measure("rooms", scene, setting, reference, &effort)
}
