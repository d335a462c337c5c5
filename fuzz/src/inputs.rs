//! Inputs of the guided fuzzer, which decide about calls.
//!
//! An input is a sequence of calls of at most [`CALL`] bytes each: the function, a seed, and one decision after the other. When
//! its bytes are used up, the seed decides. All inputs begin with the same objects.

use crate::building::Build;
use crate::oracle::Verdict;
use crate::pool::{KINDS, Object};
use crate::random::{self, Random};
use crate::rows::ROWS;
use crate::tally::Tally;
use crate::world::World;
use crate::{alarm, play};
use anyhow::{Result, ensure};
use std::sync::atomic::Ordering;

/// Bytes of a call.
const CALL: usize = 96;
/// What objects every input begins with follows from it: one that makes objects of every kind.
const SEED: u64 = 2;
/// Numbers of an input's own cases begin behind those that made the objects.
const FIRST: u64 = 1 << 20;

/// A library and the objects that each input finds in it.
pub struct Inputs {
    world: World,
    pub tally: Tally,
    objects: Vec<(Object, Vec<u8>)>,
    builds: Vec<Build>,
}

impl Inputs {
    /// Builds objects of every kind.
    pub fn new(library: &str) -> Result<Inputs> {
        let (mut world, mut tally) = (World::new(library)?, Tally::default());
        let words = play::Words { seed: SEED, epoch: 0, number: (play::ROUNDS * ROWS.len()) as u64 - 1 };
        play::play(&mut world, &words, &mut tally, false)?;
        ensure!(
            KINDS.iter().all(|kind| !world.pool.of(kind).is_empty()),
            "seed {SEED} does not make objects of every kind"
        );
        let (objects, builds) = (world.pool.snapshot(&world.memory), world.builds.clone());
        Ok(Inputs { world, tally, objects, builds })
    }

    /// Makes the calls of an input, up to one that breaks a law.
    pub fn run(&mut self, input: &[u8]) -> Verdict {
        let mut has_builds = false;
        for (call, number) in input.chunks(CALL).zip(FIRST..) {
            let [row, low, high, decisions @ ..] = call else { break };
            let index = usize::from(*row) % ROWS.len();
            let row = &ROWS[index];
            has_builds |= matches!(row.name.as_str(), "wis_environment_begin" | "wis_environment_run");
            for (slot, word) in alarm::CASE.iter().zip([SEED, 0, number, index as u64]) {
                slot.store(word, Ordering::Relaxed);
            }
            if !row.is_possible(&self.world) {
                continue;
            }
            random::feed(decisions);
            let random = Random(u64::from(*low) | u64::from(*high) << 8);
            play::one(&mut self.world, row, random, false, &mut self.tally, false)
                .map_err(|fault| format!("{fault}: call {} of the input, {}", number - FIRST, row.name))?;
        }
        random::feed(&[]);
        self.world.pool.restore(&self.world.memory, &self.objects);
        if has_builds {
            self.world.builds.clone_from(&self.builds);
        }
        Ok(())
    }
}
