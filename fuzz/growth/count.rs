//! Instructions of a call, counted by valgrind's callgrind: the same number on a busy machine as on an idle one.

use std::arch::asm;
use std::collections::BTreeMap;
use std::ffi::CString;
use std::path::Path;
use std::{fs, io};

/// Requests of valgrind's own, and of callgrind (its header callgrind.h).
const RUNNING_ON_VALGRIND: u64 = 0x1001;
const TOGGLE_COLLECT: u64 = 0x4354_0002;
const DUMP_STATS_AT: u64 = 0x4354_0003;
const START_INSTRUMENTATION: u64 = 0x4354_0004;
const STOP_INSTRUMENTATION: u64 = 0x4354_0005;

/// Asks valgrind for something; 0 where the program does not run under it.
fn request(code: u64, argument: u64) -> u64 {
    let words = [code, argument, 0, 0, 0, 0];
    let mut answer = 0;
    // SAFETY: the rotations add up to two whole turns, and the exchange is with itself: nothing changes but the answer.
    unsafe {
        asm!(
            "rol rdi, 3", "rol rdi, 13", "rol rdi, 61", "rol rdi, 51", "xchg rbx, rbx",
            inout("rax") words.as_ptr() => _, inout("rdx") answer, options(nostack)
        );
    }
    answer
}

/// Whether instructions are counted.
pub fn is_possible() -> bool {
    request(RUNNING_ON_VALGRIND, 0) != 0
}

/// Counts the instructions of a call, under a label. What is not counted runs ten times as fast.
pub fn count<R>(label: &str, call: impl FnOnce() -> R) -> R {
    request(START_INSTRUMENTATION, 0);
    request(TOGGLE_COLLECT, 0);
    let answer = call();
    request(TOGGLE_COLLECT, 0);
    let label = CString::new(label).expect("no zero in a label");
    request(DUMP_STATS_AT, label.as_ptr() as u64);
    request(STOP_INSTRUMENTATION, 0);
    answer
}

/// The counts that callgrind wrote into a folder, by their labels.
pub fn read(folder: &Path) -> io::Result<BTreeMap<String, u64>> {
    let mut counts = BTreeMap::new();
    for entry in fs::read_dir(folder)? {
        let text = fs::read_to_string(entry?.path())?;
        let label = text.lines().find_map(|line| line.strip_prefix("desc: Trigger: Client Request: "));
        let total = text.lines().find_map(|line| line.strip_prefix("totals: ")?.split(' ').next()?.parse().ok());
        if let (Some(label), Some(total)) = (label, total) {
            counts.insert(label.to_string(), total);
        }
    }
    Ok(counts)
}
