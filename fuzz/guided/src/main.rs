//! The fuzzer's calls, guided by coverage: libFuzzer chooses the bytes that decide about arguments, and keeps those inputs that
//! reach something new in the kernel.
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
#[path = "../../src/inputs.rs"]
#[allow(dead_code)]
mod inputs;
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

use crate::inputs::Inputs;
use libfuzzer_sys::fuzz_target;
use std::cell::RefCell;

thread_local! {
    static INPUTS: RefCell<Option<Inputs>> = const { RefCell::new(None) };
}

/// Opens the library that `WIS_LIBRARY` names.
fn begin() {
    let library =
        std::env::var("WIS_LIBRARY").expect("WIS_LIBRARY names a library that was built to count what it runs");
    INPUTS.set(Some(Inputs::new(&library).expect("the library has all functions, and valid calls are sound")));
}

fuzz_target!(
    init: begin(),
    |input: &[u8]| {
        let verdict = INPUTS.with_borrow_mut(|inputs| inputs.as_mut().expect("begin was called").run(input));
        if let Err(fault) = verdict {
            eprintln!("FAILED {fault}");
            std::process::abort();
        }
    }
);
