//! The fuzzer's calls, guided by coverage: libFuzzer chooses the bytes that decide about arguments, and keeps those inputs that
//! reach something new in the kernel.
//!
//! An input is a sequence of calls of at most [`CALL`] bytes each: the function, a seed, and one decision after the other. When
//! its bytes are used up, the seed decides. All inputs begin with the same objects.
#![no_main]

#[path = "../../src/alarm.rs"]
#[allow(dead_code)]
mod alarm;
#[path = "../../src/building.rs"]
mod building;
#[path = "../../src/call.rs"]
mod call;
#[path = "../../src/case.rs"]
mod case;
#[path = "../../src/header.rs"]
mod header;
#[path = "../../src/laws.rs"]
mod laws;
#[path = "../../src/maps.rs"]
mod maps;
#[path = "../../src/memory.rs"]
mod memory;
#[path = "../../src/oracle.rs"]
mod oracle;
#[path = "../../src/play.rs"]
mod play;
#[path = "../../src/pool.rs"]
mod pool;
#[path = "../../src/random.rs"]
mod random;
#[path = "../../src/rows.rs"]
mod rows;
#[path = "../../src/structs.rs"]
mod structs;
#[path = "../../src/tally.rs"]
#[allow(dead_code)]
mod tally;
#[path = "../../src/values.rs"]
mod values;
#[path = "../../src/world.rs"]
mod world;

use crate::building::Build;
use crate::pool::Object;
use crate::random::Random;
use crate::rows::ROWS;
use crate::tally::Tally;
use crate::world::World;
use libfuzzer_sys::fuzz_target;
use std::cell::RefCell;
use std::sync::atomic::Ordering;

/// Bytes of a call.
const CALL: usize = 96;
/// What objects every input begins with follows from it.
const SEED: u64 = 1;
/// Numbers of an input's own cases begin behind those that made the objects.
const FIRST: u64 = 1 << 20;

struct Guided {
    world: World,
    tally: Tally,
    objects: Vec<(Object, Vec<u8>)>,
    builds: Vec<Build>,
}

thread_local! {
    static GUIDED: RefCell<Option<Guided>> = const { RefCell::new(None) };
}

/// Opens the library that `WIS_LIBRARY` names, and builds objects of every kind in it.
fn begin() {
    let library =
        std::env::var("WIS_LIBRARY").expect("WIS_LIBRARY names a library that was built to count what it runs");
    let mut world = World::new(&library).expect("the library has all functions");
    let mut tally = Tally::default();
    let count = (play::ROUNDS * ROWS.len()) as u64;
    play::play(&mut world, SEED, 0, count, &mut tally, false).expect("valid calls are sound");
    let (objects, builds) = (world.pool.snapshot(&world.memory), world.builds.clone());
    GUIDED.set(Some(Guided { world, tally, objects, builds }));
}

impl Guided {
    fn run(&mut self, input: &[u8]) {
        let mut has_builds = false;
        for (call, number) in input.chunks(CALL).zip(FIRST..) {
            let [row, low, high, decisions @ ..] = call else { break };
            let index = usize::from(*row) % ROWS.len();
            let row = &ROWS[index];
            has_builds |= matches!(row.name, "wis_environment_begin" | "wis_environment_run");
            for (slot, word) in alarm::CASE.iter().zip([SEED, 0, number, index as u64]) {
                slot.store(word, Ordering::Relaxed);
            }
            if !rows::needs(row.name).iter().all(|kind| !self.world.pool.of(kind).is_empty()) {
                continue;
            }
            random::feed(decisions);
            let random = Random(u64::from(*low) | u64::from(*high) << 8);
            if let Err(fault) = play::one(&mut self.world, row, random, false, &mut self.tally, false) {
                eprintln!("FAILED {fault}: call {} of the input, {}", number - FIRST, row.name);
                std::process::abort();
            }
        }
        random::feed(&[]);
        self.world.pool.restore(&self.world.memory, &self.objects);
        if has_builds {
            self.world.builds.clone_from(&self.builds);
        }
    }
}

fuzz_target!(
    init: begin(),
    |input: &[u8]| {
        GUIDED.with_borrow_mut(|guided| guided.as_mut().expect("begin was called").run(input));
    }
);
