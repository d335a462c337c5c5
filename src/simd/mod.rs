//! Numbers side by side, each lane with the bits of the scalar operation of the same name: + - * / and square
//! roots are correctly rounded everywhere, and minimum and maximum are comparisons, so no width and no processor
//! changes a result.
//!
//! Kernels are generic over [`Num`], whose width is that of a register. [`A4`] runs anywhere and is what the others are tested
//! against; [`Four`] is the fastest that every processor of the target has. Numbers that only some processors have cannot be
//! named: a [`Compute`] meets them in [`compute`], at a [`Level`] that was detected.
//!
//! ```
//! use wis::simd::{Compute, Level, Num, compute};
//!
//! struct Sum;
//! impl Compute for Sum {
//!     type Output = f32;
//!     fn run<F: Num>(self) -> f32 {
//!         (F::splat(1.0) + 2.0).store().as_ref().iter().sum::<f32>() / F::WIDTH as f32
//!     }
//! }
//! assert_eq!(compute(Level::detect(), Sum), 3.0);
//! ```
//!
//! ```compile_fail
//! // The instructions might not exist: the type is private.
//! let numbers = <wis::simd::x86::X8 as wis::simd::Num>::splat(1.0);
//! ```
//!
//! ```compile_fail
//! # use wis::simd::{Compute, Num, compute};
//! # struct Nothing;
//! # impl Compute for Nothing {
//! #     type Output = ();
//! #     fn run<F: Num>(self) {}
//! # }
//! // A number is no level.
//! compute(1, Nothing);
//! ```
//!
//! ```compile_fail
//! // That a number is of this processor is the word of `unsafe` code.
//! let level = wis::simd::Level::from_code(wis::simd::detect());
//! ```

mod array;
mod level;
#[cfg(target_arch = "aarch64")]
mod neon;
mod num;
mod scalar;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use array::A4;
pub use level::{Compute, Level, compute, detect};
pub use num::{Apart, GROUP, Num, REGISTERS, Whole, places, sum};
pub use scalar::{prefetch, prefetch_all, prefetch_behind, rank, rank16, sqrt, truncate};

// Four numbers, as every processor of this target has them.
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub use array::A4 as Four;
#[cfg(target_arch = "aarch64")]
pub use neon::N4 as Four;
#[cfg(target_arch = "x86_64")]
pub use x86::X4 as Four;

/// Numbers of a table that a search reads at once.
pub const WINDOW: usize = 16;
