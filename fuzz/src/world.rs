//! What calls happen in: the library, memory, a stack, and the objects that were built so far.

use crate::building::Build;
use crate::call::{Answer, Stack, Word};
use crate::header::{Function, Headers};
use crate::maps::Maps;
use crate::memory::Memory;
use crate::pool::Pool;
use crate::random::Random;
use anyhow::{Context, Result};
use libloading::os::unix::{Library, RTLD_NOW};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};

/// Calls so far: what the watchdog sees move.
pub static CALLS: AtomicU64 = AtomicU64::new(0);

/// Where a shared library has the functions of the headers.
///
/// # Errors
/// It is none, or lacks one.
pub fn addresses(library: &str, headers: &Headers) -> Result<BTreeMap<String, usize>> {
    // SAFETY: the library has no initialisers.
    let opened = Box::leak(Box::new(unsafe { Library::open(Some(library), RTLD_NOW) }?));
    let address = |function: &Function| {
        // SAFETY: nothing is called here, and nothing closes the library.
        let symbol = unsafe { opened.get::<*const ()>(function.name.as_bytes()) }?;
        Ok((function.name.clone(), *symbol as usize))
    };
    headers.functions.iter().map(address).collect()
}

/// Everything that lasts longer than a call.
pub struct World {
    pub headers: Headers,
    pub memory: Memory,
    pub pool: Pool,
    pub maps: Maps,
    pub builds: Vec<Build>,
    stack: Stack,
    addresses: BTreeMap<String, usize>,
}

impl World {
    /// Regions of one call's arguments.
    const ARGUMENTS: usize = 64;
    /// Where a size query answers.
    pub const QUERY: usize = World::ARGUMENTS;
    /// Where checks that make calls of their own place things.
    pub const CHECK: usize = World::ARGUMENTS + 1;
    const CHECKS: usize = 4;

    pub fn new(library: &str) -> Result<World> {
        let headers = Headers::read();
        let addresses = addresses(library, &headers)?;
        let maps = World::CHECK + World::CHECKS;
        let memory = Memory::new(maps + Maps::REGIONS + Pool::REGIONS);
        let pool = Pool::new(maps + Maps::REGIONS);
        Ok(World { headers, memory, pool, maps: Maps::new(maps), builds: Vec::new(), stack: Stack::new(), addresses })
    }

    /// Begins anew: what follows depends on nothing before.
    pub fn begin(&mut self, random: &mut Random) {
        self.pool.clear();
        self.builds.clear();
        self.maps.fill(&self.memory, random);
    }

    pub fn function(&self, name: &str) -> &Function {
        let found = self.headers.functions.iter().find(|function| function.name == name);
        found.with_context(|| format!("no function {name}")).expect("a name of the headers")
    }

    pub fn call(&self, function: &Function, words: &[Word], control: u32) -> Answer {
        CALLS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the words are what the header declares; pointers are null, or to blocks that are as long as it says.
        unsafe { self.stack.call(self.addresses[&function.name], words, control) }
    }
}
