//! What ends the program when a call does not come back: a fault of memory, or a call that takes too long.

use crate::world::CALLS;
use std::mem::MaybeUninit;
use std::ptr::null_mut;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

/// The case that is under way: seed, epoch and number, and the row.
pub static CASE: [AtomicU64; 4] = [const { AtomicU64::new(0) }; 4];
/// The input of the guided fuzzer that is under way: its file. Empty: there is none.
pub static INPUT: Mutex<String> = Mutex::new(String::new());
/// Processor time that a call may take. The slowest valid one, a build of 25000 texels with a budget, takes 0.1 s.
const MOST_SECONDS: f64 = 10.0;

/// Whether faults end the program here.
static IS_SET: AtomicBool = AtomicBool::new(false);

/// The words that reproduce the case that is under way.
pub fn reproduce() -> String {
    let [seed, epoch, number, row] = CASE.each_ref().map(|word| word.load(Ordering::Relaxed));
    let name = &crate::rows::ROWS[row as usize].name;
    match INPUT.try_lock() {
        Ok(input) if !input.is_empty() => format!("{name} --corpus {input}"),
        _ => format!("{name} --replay {seed}:{epoch}:{number}"),
    }
}

pub fn die(fault: &str) -> ! {
    // Formatting allocates, which a signal handler must not do in general; the fault is in the library, which never allocates.
    eprintln!("FAILED {fault}: {}", reproduce());
    if !IS_SET.load(Ordering::Relaxed) {
        // A guided fuzzer keeps the input of a program that aborts.
        std::process::abort();
    }
    // SAFETY: ends the process without running anything else.
    unsafe { libc::_exit(1) }
}

extern "C" fn handler(signal: i32, info: *mut libc::siginfo_t, _: *mut libc::c_void) {
    // SAFETY: the kernel gives the information of the fault.
    let address = unsafe { (*info).si_addr() } as usize;
    die(&format!("signal {signal} at {address:#x}"));
}

/// Whether someone asked the program to come to an end.
pub static STOP: AtomicBool = AtomicBool::new(false);

extern "C" fn stop(_: i32) {
    STOP.store(true, Ordering::Relaxed);
}

/// From now on faults of memory and slow calls of this thread end the program with the words that reproduce them.
pub fn set() {
    const SIGNAL_STACK: usize = 64 << 10;
    IS_SET.store(true, Ordering::Relaxed);
    // SAFETY: the stack is leaked, the structs are zeros where they are not set.
    unsafe {
        let stack = Box::leak(vec![0u8; SIGNAL_STACK].into_boxed_slice());
        let stack = libc::stack_t { ss_sp: stack.as_mut_ptr().cast(), ss_flags: 0, ss_size: SIGNAL_STACK };
        assert_eq!(libc::sigaltstack(&stack, null_mut()), 0);
        let mut action: libc::sigaction = MaybeUninit::zeroed().assume_init();
        action.sa_sigaction = handler as *const () as usize;
        action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
        for signal in [libc::SIGSEGV, libc::SIGBUS, libc::SIGILL, libc::SIGFPE, libc::SIGABRT] {
            assert_eq!(libc::sigaction(signal, &action, null_mut()), 0);
        }
        // On its own stack, too: on that of a call it would count as the call's.
        action.sa_sigaction = stop as *const () as usize;
        action.sa_flags = libc::SA_ONSTACK | libc::SA_RESTART;
        for signal in [libc::SIGTERM, libc::SIGINT] {
            assert_eq!(libc::sigaction(signal, &action, null_mut()), 0);
        }
        let mut clock = 0;
        assert_eq!(libc::pthread_getcpuclockid(libc::pthread_self(), &mut clock), 0);
        std::thread::spawn(move || watch(clock));
    }
}

/// Seconds of a clock.
pub fn seconds(clock: libc::clockid_t) -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is valid.
    unsafe { libc::clock_gettime(clock, &mut time) };
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

fn watch(clock: libc::clockid_t) {
    let (mut calls, mut since) = (0, 0.0);
    loop {
        std::thread::sleep(Duration::from_millis(200));
        let (now, time) = (CALLS.load(Ordering::Relaxed), seconds(clock));
        if now != calls {
            (calls, since) = (now, time);
        } else if time - since > MOST_SECONDS {
            die(&format!("a call takes more than {MOST_SECONDS} s"));
        }
    }
}
