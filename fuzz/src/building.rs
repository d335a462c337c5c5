//! What successful calls leave for later ones: objects, and environments that are being built in parts.

use crate::case::{Case, Role};
use crate::memory::Place;
use crate::pool::{KINDS, Object};
use crate::world::World;

/// An environment between wis_environment_begin and wis_environment_finish.
#[derive(Clone, Debug)]
pub struct Build {
    config: Vec<u8>,
    texels: usize,
    memory: Vec<u8>,
    scratch: Vec<u8>,
    items: [u32; 6],
    /// The pass, and its items that are done.
    pass: usize,
    done: u32,
}

/// Builds that are under way at once.
const MOST: usize = 4;

/// The configuration of a build that is under way, for the calls that go on with one.
pub fn config(case: &mut Case) -> Option<Vec<u8>> {
    let wanted: fn(&Build) -> bool = match case.function.name.as_str() {
        "wis_environment_run" => |build: &Build| build.pass < build.items.len(),
        "wis_environment_finish" => |build: &Build| build.pass == build.items.len(),
        _ => return None,
    };
    let builds = &case.world.builds;
    let found: Vec<usize> = (0..builds.len()).filter(|&k| wanted(&builds[k])).collect();
    let chosen = if found.is_empty() { case.random.below(builds.len()) } else { case.random.pick(&found) };
    let build = builds.get(chosen)?;
    case.build = Some(chosen);
    case.texels = build.texels;
    Some(build.config.clone())
}

/// Memory and scratch memory of the build.
pub fn block(case: &Case, name: &str) -> Option<(Vec<u8>, Role)> {
    let build = &case.world.builds[case.build?];
    let mut bytes = if name == "memory" { build.memory.clone() } else { build.scratch.clone() };
    if case.is_spoiled() {
        bytes.truncate(bytes.len() / 2);
    }
    Some((bytes, Role::Work))
}

/// Pass, first item and number of items that come next, by the name of the parameter; and the most that may be asked for.
pub fn portion(case: &mut Case) -> (u64, u64) {
    let Some(build) = case.build.map(|build| case.world.builds[build].clone()) else { return (0, u64::MAX) };
    let left = build.items.get(build.pass).map_or(0, |items| items - build.done);
    let value = match case.parameter().name.as_str() {
        "pass" => build.pass as u64,
        "first" => build.done.into(),
        _ if case.random.one_in(2) => left.into(),
        _ => case.random.below(left as usize + 1) as u64,
    };
    (value, u64::MAX)
}

/// What a successful call leaves, taken from the case before its memory is used again.
pub enum Left {
    Object(Object, Vec<u8>),
    Begun(Build),
    Run { build: usize, memory: Vec<u8>, scratch: Vec<u8>, count: u32 },
}

pub fn left(case: &Case) -> Vec<Left> {
    let owner =
        case.objects.iter().find(|object| object.kind.ends_with("environment") || object.kind.ends_with("light"));
    let owner = owner.map_or(0, |light| light.id);
    let object = |kind: &str, bytes, owner, number| {
        let kind = KINDS.into_iter().find(|known| *known == kind).expect("a kind of objects");
        let (place, id, is_altered) = (Place::default(), case.id, case.is_altered);
        Left::Object(Object { kind, place, id, owner, number, is_altered }, bytes)
    };
    let memory = || case.bytes_of("memory").unwrap_or_default().to_vec();
    let scratch = || case.bytes_of("scratch").unwrap_or_default().to_vec();
    let long = |name: &str, at: usize| {
        case.bytes_of(name).map_or(0, |bytes| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight")))
    };
    match case.function.name.as_str() {
        "wis_environment_begin" => {
            let items = case.bytes_of("items").unwrap_or_default();
            let items = [0, 4, 8, 12, 16, 20].map(|at| u32::from_le_bytes(items[at..at + 4].try_into().expect("four")));
            let config = case.bytes_of("config").unwrap_or_default().to_vec();
            let bytes = case.query("wis_environment_size").map_or(0, |[bytes, _]| bytes.min(1 << 19));
            let (memory, scratch) = (vec![0xa5; bytes], scratch());
            vec![Left::Begun(Build { config, texels: case.texels, memory, scratch, items, pass: 0, done: 0 })]
        }
        "wis_environment_run" => {
            let (build, count) = (case.build.expect("a build"), case.number("count").unwrap_or(0) as u32);
            vec![Left::Run { build, memory: memory(), scratch: scratch(), count }]
        }
        "wis_product_prepare" if case.number("count") == Some(0) => Vec::new(),
        "wis_product_prepare" => {
            let mut bytes = memory();
            let next = if case.number("count") == Some(1) { long("bytes_used", 0) } else { long("offset", 8) };
            bytes.truncate(next as usize);
            bytes.drain(..long("offset", 0) as usize);
            vec![object("wis_product", bytes, owner, 0)]
        }
        "wis_material_init" => {
            let bytes = case.bytes_of("material").unwrap_or_default().to_vec();
            vec![object("wis_material", bytes, 0, 0)]
        }
        name => {
            let handle = case.function.parameters.iter().find(|parameter| parameter.is_handle());
            let Some(handle) = handle else { return Vec::new() };
            let mut bytes = memory();
            let kind = handle.pointee.trim_end_matches([' ', '*']).to_string();
            // These begin with what they are and their length.
            if matches!(kind.as_str(), "wis_environment" | "wis_tree" | "wis_jitter") {
                let length = u64::from_le_bytes(bytes[8..16].try_into().expect("eight"));
                bytes.truncate(length as usize);
            }
            let axes = |bytes: &[u8]| u32::from_le_bytes(bytes[40..44].try_into().expect("four")) as usize;
            let number = match kind.as_str() {
                "wis_tree" => axes(&bytes),
                "wis_jitter" => case.number("light_count").unwrap_or(1),
                _ => 0,
            };
            let owner = if name.contains("product") { owner } else { 0 };
            vec![object(&kind, bytes, owner, number)]
        }
    }
}

impl World {
    pub fn keep(&mut self, left: Vec<Left>, random: &mut crate::random::Random) {
        for left in left {
            match left {
                Left::Object(object, bytes) => self.pool.keep(&self.memory, object, &bytes, random),
                Left::Begun(build) if self.builds.len() < MOST => self.builds.push(build),
                Left::Begun(build) => {
                    let slot = random.below(MOST);
                    self.builds[slot] = build;
                }
                Left::Run { build, memory, scratch, count } => {
                    let build = &mut self.builds[build];
                    (build.memory, build.scratch) = (memory, scratch);
                    build.done += count;
                    if build.items.get(build.pass).is_some_and(|items| build.done >= *items) {
                        (build.pass, build.done) = (build.pass + 1, 0);
                    }
                }
            }
        }
    }
}
