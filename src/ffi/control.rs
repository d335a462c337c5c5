//! The floating-point control word: hosts that flush denormals or round otherwise get the same bits.

/// Holds the default control word in force; puts the host's back when dropped.
pub(crate) struct FloatControl {
    host: Word,
}

impl FloatControl {
    /// Sets the default control word, if it is not in force already.
    #[inline(always)]
    pub(crate) fn set_default() -> FloatControl {
        let host = read();
        if !is_default(host) {
            write(DEFAULT);
        }
        FloatControl { host }
    }
}

impl Drop for FloatControl {
    #[inline(always)]
    fn drop(&mut self) {
        if !is_default(self.host) {
            write(self.host);
        }
    }
}

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
mod word {
    //! MXCSR of SSE.
    pub type Word = u32;

    /// All exceptions masked, round to nearest, denormals kept.
    pub const DEFAULT: Word = 0x1f80;

    /// Whether the control bits are the default; the lowest six bits are flags of past exceptions.
    #[inline(always)]
    pub fn is_default(word: Word) -> bool {
        word & !0x3f == DEFAULT
    }

    #[inline(always)]
    pub fn read() -> Word {
        let mut word: Word = 0;
        // SAFETY: stores MXCSR into a local of 4 bytes.
        unsafe { core::arch::asm!("stmxcsr [{}]", in(reg) &mut word, options(nostack, preserves_flags)) };
        word
    }

    #[inline(always)]
    pub fn write(word: Word) {
        // SAFETY: loads MXCSR with the default or with what `read` gave. Rust assumes the default word, which is
        // in force wherever this library computes.
        unsafe { core::arch::asm!("ldmxcsr [{}]", in(reg) &word, options(nostack, preserves_flags)) };
    }
}

#[cfg(target_arch = "aarch64")]
mod word {
    //! FPCR of AArch64.
    pub type Word = u64;

    /// Round to nearest, denormals kept, no alternative formats.
    pub const DEFAULT: Word = 0;

    #[inline(always)]
    pub fn is_default(word: Word) -> bool {
        word == DEFAULT
    }

    #[inline(always)]
    pub fn read() -> Word {
        let word: Word;
        // SAFETY: reads FPCR.
        unsafe { core::arch::asm!("mrs {}, fpcr", out(reg) word, options(nomem, nostack, preserves_flags)) };
        word
    }

    #[inline(always)]
    pub fn write(word: Word) {
        // SAFETY: writes the default or what `read` gave.
        unsafe { core::arch::asm!("msr fpcr, {}", in(reg) word, options(nostack, preserves_flags)) };
    }
}

#[cfg(not(any(target_arch = "x86", target_arch = "x86_64", target_arch = "aarch64")))]
mod word {
    //! Targets whose floating point has no control word that this library knows.
    pub type Word = ();
    pub const DEFAULT: Word = ();

    pub fn is_default(_: Word) -> bool {
        true
    }

    pub fn read() -> Word {}

    pub fn write(_: Word) {}
}

use word::{DEFAULT, Word, is_default, read, write};
