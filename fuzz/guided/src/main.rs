//! The fuzzer's calls, guided by coverage: libFuzzer chooses the bytes that decide about arguments, and keeps those inputs that
//! reach something new in the kernel.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::cell::RefCell;
use wis_fuzz::inputs::Inputs;

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
