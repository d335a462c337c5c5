//! A call by words: on a painted stack between guard pages, under a floating-point control word of choice.

use std::ptr::null_mut;

/// What the callee may use of the stack.
const STACK: usize = 64 << 10;
/// More arguments than any function has.
const MOST: usize = 16;
const PAINT: u64 = 0xa5a5_a5a5_a5a5_a5a5;
const PAGE: usize = 4096;

/// The default control word of SSE: round to nearest, denormals kept, exceptions masked.
pub const DEFAULT_CONTROL: u32 = 0x1f80;
/// The bits that record past exceptions.
const RECORD: u32 = 0x3f;

/// An argument by the class that the calling convention of x86-64 gives it.
#[derive(Clone, Copy, Debug)]
pub enum Word {
    Integer(u64),
    /// The bits of a float or a double.
    Float(u64),
}

/// What a call left.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    pub result: u64,
    pub control: u32,
    /// Bytes of stack, with the return address.
    pub stack: usize,
}

/// Read and written by `wis_fuzz_call`, by offset.
#[repr(C)]
struct Frame {
    function: usize,
    stack: usize,
    integers: [u64; 6],
    floats: [u64; 4],
    control: u32,
    left: u32,
    host: u32,
    _padding: u32,
    result: u64,
}

std::arch::global_asm!(
    ".globl wis_fuzz_call",
    "wis_fuzz_call:",
    "push rbx",
    "push r12",
    "mov rbx, rdi",
    "mov r12, rsp",
    "stmxcsr [rbx + 104]",
    "mov rsp, [rbx + 8]",
    "movsd xmm0, qword ptr [rbx + 64]",
    "movsd xmm1, qword ptr [rbx + 72]",
    "movsd xmm2, qword ptr [rbx + 80]",
    "movsd xmm3, qword ptr [rbx + 88]",
    "mov rdi, [rbx + 16]",
    "mov rsi, [rbx + 24]",
    "mov rdx, [rbx + 32]",
    "mov rcx, [rbx + 40]",
    "mov r8, [rbx + 48]",
    "mov r9, [rbx + 56]",
    "ldmxcsr [rbx + 96]",
    "call qword ptr [rbx]",
    "stmxcsr [rbx + 100]",
    "ldmxcsr [rbx + 104]",
    "mov rsp, r12",
    "mov [rbx + 112], rax",
    "pop r12",
    "pop rbx",
    "ret",
);

unsafe extern "C" {
    fn wis_fuzz_call(frame: *mut Frame);
}

/// The control bits of MXCSR now.
pub fn control() -> u32 {
    let mut word = 0u32;
    // SAFETY: stores the word into a local.
    unsafe { std::arch::asm!("stmxcsr [{}]", in(reg) &mut word, options(nostack, preserves_flags)) };
    word & !RECORD
}

/// The painted stack.
pub struct Stack {
    /// Painted words; behind them stand the arguments that registers do not hold.
    base: *mut u64,
}

impl Stack {
    pub fn new() -> Stack {
        // SAFETY: a private mapping whose first page is made inaccessible.
        unsafe {
            let (access, flags) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS);
            let block = libc::mmap(null_mut(), 2 * PAGE + STACK, access, flags, -1, 0).cast::<u8>();
            assert_eq!(libc::mprotect(block.cast(), PAGE, libc::PROT_NONE), 0);
            let base = block.add(PAGE).cast::<u64>();
            std::slice::from_raw_parts_mut(base, STACK / 8).fill(PAINT);
            Stack { base }
        }
    }

    /// Calls a function.
    ///
    /// # Safety
    /// The words are arguments of the function, and what they point to is as it says.
    pub unsafe fn call(&self, function: usize, words: &[Word], control: u32) -> Answer {
        // SAFETY: as many words as stand in the block; the callee's frames lie in the painted words.
        unsafe {
            let top = self.base.add(STACK / 8);
            let mut frame = Frame {
                function,
                stack: top as usize,
                integers: [0; 6],
                floats: [0; 4],
                control,
                left: 0,
                host: 0,
                _padding: 0,
                result: 0,
            };
            let (mut integers, mut floats, mut pushed) = (0, 0, 0);
            for word in words {
                match *word {
                    Word::Integer(bits) if integers < 6 => {
                        frame.integers[integers] = bits;
                        integers += 1;
                    }
                    Word::Integer(bits) => {
                        assert!(pushed < MOST);
                        top.add(pushed).write(bits);
                        pushed += 1;
                    }
                    Word::Float(bits) => {
                        frame.floats[floats] = bits;
                        floats += 1;
                    }
                }
            }
            wis_fuzz_call(&mut frame);
            let painted = std::slice::from_raw_parts_mut(self.base, STACK / 8);
            let untouched = painted.iter().position(|word| *word != PAINT).unwrap_or(painted.len());
            painted[untouched..].fill(PAINT);
            Answer { result: frame.result, control: frame.left & !RECORD, stack: STACK - 8 * untouched }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    extern "C" fn deep(a: u64, b: f64, c: u64, d: u64, e: u64, f: u64, g: u64, h: u64) -> u64 {
        let room = std::hint::black_box([1u8; 4000]);
        a + c + d + e + f + g + h + b as u64 + u64::from(room[17])
    }

    extern "C" fn leaves_another_control_word() {
        let word = DEFAULT_CONTROL | 0x2000;
        // SAFETY: the word masks all exceptions.
        unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &word, options(nostack)) };
    }

    #[test]
    fn arguments_arrive_and_the_stack_is_measured() {
        let words = [1, 2, 3, 4, 5, 6, 7].map(Word::Integer);
        let words = [&words[..1], &[Word::Float(0.5f64.to_bits())], &words[1..]].concat();
        // SAFETY: the words are the function's arguments.
        let answer = unsafe { Stack::new().call(deep as *const () as usize, &words, DEFAULT_CONTROL) };
        assert_eq!((answer.result, answer.control), (29, DEFAULT_CONTROL));
        assert!((4000..4600).contains(&answer.stack), "{}", answer.stack);
    }

    #[test]
    fn a_control_word_that_is_left_is_seen() {
        let function = leaves_another_control_word as *const () as usize;
        // SAFETY: the function takes nothing.
        let answer = unsafe { Stack::new().call(function, &[], DEFAULT_CONTROL) };
        assert_eq!(answer.control, DEFAULT_CONTROL | 0x2000);
    }
}
