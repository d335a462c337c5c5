//! Processor time: what other programs take of a shared machine does not count.

use rustix::time::{ClockId, clock_gettime};

/// Seconds that this thread has computed.
pub fn seconds() -> f64 {
    of(ClockId::ThreadCPUTime)
}

/// Seconds that all threads of this program have computed.
pub fn of_all_threads() -> f64 {
    of(ClockId::ProcessCPUTime)
}

fn of(clock: ClockId) -> f64 {
    let now = clock_gettime(clock);
    now.tv_sec as f64 + now.tv_nsec as f64 / 1e9
}
