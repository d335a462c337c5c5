//! Calls every function of the headers with valid and hostile arguments, and checks what must hold afterwards.
//!
//! The functions are called in a built shared library by the calling convention of x86-64 Linux. Everything follows from the
//! seed: a failure names the words that reproduce it. The guided fuzzer and the growth of work use the same headers and calls.

#![cfg(target_arch = "x86_64")]

pub mod again;
pub mod alarm;
mod building;
mod call;
mod case;
pub mod header;
pub mod inputs;
mod laws;
mod maps;
mod memory;
mod oracle;
pub mod play;
mod pool;
mod random;
pub mod rows;
mod sign;
mod structs;
pub mod tally;
mod values;
pub mod world;

#[cfg(test)]
mod tests {
    use super::*;

    /// The parser of headers agrees with a compiler on what it reads.
    #[test]
    fn layouts_are_those_of_the_binary_interface() {
        let headers = header::Headers::read();
        let abi = include_str!("../../packaging/abi.txt");
        let mut seen = 0;
        for line in abi.lines().filter_map(|line| line.strip_prefix("struct ")) {
            let Some((name, size)) = line.split_once(": ").filter(|(name, _)| !name.contains('.')) else { continue };
            let layout = &headers.layouts[name];
            assert_eq!(size, format!("{} bytes, alignment {}", layout.size, layout.align), "{name}");
            seen += 1;
        }
        assert!(seen >= 15, "{seen}");
    }
}
