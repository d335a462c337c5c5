//! A host that flushes denormals, rounds otherwise or unmasks exceptions gets the same bits and keeps its control word.
//! It needs a processor: emulators that keep only the rounding mode fail here.

#[cfg(target_arch = "x86_64")]
mod word {
    use std::arch::asm;

    /// The flags of past exceptions are no control.
    pub const FLAGS: u32 = 0x3f;
    /// Flush to zero and denormals are zero, rounding towards 0; rounding up; rounding down with every exception
    /// unmasked.
    pub const HOSTS: [u32; 3] = [0xffc0, 0x5f80, 0x2000];

    pub fn read() -> u32 {
        let mut word = 0u32;
        // SAFETY: stores MXCSR.
        unsafe { asm!("stmxcsr [{}]", in(reg) &mut word, options(nostack)) };
        word
    }

    pub fn write(word: u32) {
        // SAFETY: loads MXCSR; nothing but a call of the library happens before it is put back.
        unsafe { asm!("ldmxcsr [{}]", in(reg) &word, options(nostack)) };
    }
}

#[cfg(target_arch = "aarch64")]
mod word {
    use std::arch::asm;

    pub const FLAGS: u64 = 0;
    /// Flush to zero, rounding towards 0; rounding up; rounding down.
    pub const HOSTS: [u64; 3] = [0x01c0_0000, 0x0040_0000, 0x0080_0000];

    pub fn read() -> u64 {
        let word: u64;
        // SAFETY: reads FPCR.
        unsafe { asm!("mrs {}, fpcr", out(reg) word, options(nostack)) };
        word
    }

    pub fn write(word: u64) {
        // SAFETY: writes FPCR; nothing but a call of the library happens before it is put back.
        unsafe { asm!("msr fpcr, {}", in(reg) word, options(nostack)) };
    }
}

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
#[test]
fn any_control_word() {
    use super::call::Call;
    use super::objects::functions;
    use super::scene::Scene;

    let scene = Scene::new();
    for function in functions().iter().filter(|function| function.answers_status) {
        let expected = Call::valid(&scene, function);
        expected.succeeds("default");
        for host in word::HOSTS {
            for spoiled in [None, function.parameters.iter().find(|parameter| parameter.is_pointer())] {
                let mut call = Call::valid(&scene, function);
                spoiled.into_iter().for_each(|parameter| call.set(&parameter.name, 0));
                let default = word::read();
                word::write(host);
                let answer = call.answer();
                let kept = word::read();
                word::write(default);
                assert_eq!(kept & !word::FLAGS, host, "{}", function.name);
                assert_eq!(answer == 0, spoiled.is_none(), "{}", function.name);
                for parameter in function.parameters.iter().filter(|p| spoiled.is_none() && p.is_result()) {
                    assert_eq!(call.result(&parameter.name), expected.result(&parameter.name), "{}", function.name);
                }
            }
        }
    }
}
