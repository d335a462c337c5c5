//! Eight numbers side by side, each lane with the bits of the scalar operation of the same name: + - * / and square
//! roots are correctly rounded everywhere, and minimum and maximum are comparisons, so no lane width and no processor
//! changes a result.
//!
//! Kernels are generic over [`Lanes`]. [`Portable`] runs anywhere and is what the others are tested against;
//! [`Native`] is the fastest that every processor of the target has. Lanes that only some processors have cannot be named:
//! a [`Kernel`] meets them in [`run`], at a [`Level`] that was detected.
//!
//! ```
//! use wis::simd::{Kernel, Lanes, Level, run};
//!
//! struct Sum;
//! impl Kernel for Sum {
//!     type Output = f32;
//!     fn run<F: Lanes>(self) -> f32 {
//!         (F::splat(1.0) + F::splat(2.0)).to_array().iter().sum()
//!     }
//! }
//! assert_eq!(run(Level::detect(), Sum), 24.0);
//! ```
//!
//! ```compile_fail
//! // The instructions might not exist: the type is private.
//! let lanes = <wis::simd::Avx2 as wis::simd::Lanes>::splat(1.0);
//! ```
//!
//! ```compile_fail
//! # use wis::simd::{Kernel, Lanes, run};
//! # struct Nothing;
//! # impl Kernel for Nothing {
//! #     type Output = ();
//! #     fn run<F: Lanes>(self) {}
//! # }
//! // A number is no level.
//! run(1, Nothing);
//! ```
//!
//! ```compile_fail
//! // That a number is of this processor is the word of `unsafe` code.
//! let level = wis::simd::Level::from_code(wis::simd::detect());
//! ```

mod apart;
mod array;
#[cfg(all(target_arch = "x86_64", feature = "avx2"))]
mod avx2;
mod level;
#[cfg(target_arch = "aarch64")]
mod neon;
mod num;
mod portable;
mod scalar;
#[cfg(target_arch = "x86_64")]
mod sse2;
mod table;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use apart::Apart;
pub use level::{Compute, Kernel, Level, compute, detect, run};
#[cfg(target_arch = "aarch64")]
pub use neon::Neon;
pub use num::{Num, Whole, places, sum};
pub use portable::Portable;
pub use scalar::{prefetch, rank, rank16, sqrt};
#[cfg(target_arch = "x86_64")]
pub use sse2::Sse2;
pub use table::{Blob, Table};

use core::ops::{Add, Div, Mul, Sub};

/// The lanes that every processor of this target has.
#[cfg(target_arch = "x86_64")]
pub type Native = Sse2;
/// The lanes that every processor of this target has.
#[cfg(target_arch = "aarch64")]
pub type Native = Neon;
/// The lanes that every processor of this target has.
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub type Native = Portable;

/// Four numbers, as every processor of this target has them.
#[cfg(target_arch = "x86_64")]
pub type Four = x86::X4;
/// Four numbers, as every processor of this target has them.
#[cfg(not(target_arch = "x86_64"))]
pub type Four = array::A4;

/// Numbers in a [`Lanes`].
pub const LANES: usize = 8;

/// Numbers that stand side by side in what is stored, and partial sums of a sum: a whole number of registers of any width.
pub const GROUP: usize = 8;

/// The most registers of a group.
pub const REGISTERS: usize = 2;

/// Numbers of a table that a search reads at once.
pub const WINDOW: usize = 16;

/// Eight numbers.
pub trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f32, Output = Self>
    + Sub<f32, Output = Self>
    + Mul<f32, Output = Self>
    + Div<f32, Output = Self>
    + 'static
{
    /// A truth value for each lane.
    type Mask: Copy;
    /// An unsigned whole number for each lane.
    type Index: Copy;

    /// The same number in all lanes.
    fn splat(x: f32) -> Self;
    /// One number for each lane.
    fn from_array(lanes: [f32; LANES]) -> Self;
    /// The numbers of all lanes.
    fn to_array(self) -> [f32; LANES];
    /// Element `k` of lane `i`'s row in lane `i` of result `k`.
    fn transpose(rows: [&[f32; 4]; LANES]) -> [Self; 4];
    /// The inverse of [`Lanes::transpose`].
    fn rows(columns: [Self; 4]) -> [[f32; 4]; LANES];
    /// The square root.
    fn sqrt(self) -> Self;
    /// The number without its sign.
    fn abs(self) -> Self;
    /// The number with the sign of another.
    fn copysign(self, sign: Self) -> Self;
    /// The next smaller number, of a positive one.
    fn before(self) -> Self;
    /// The smaller of two, by comparison; `b` if either is NaN.
    fn min(self, b: Self) -> Self;
    /// The larger of two, by comparison; `b` if either is NaN.
    fn max(self, b: Self) -> Self;
    /// self < b.
    fn lt(self, b: Self) -> Self::Mask;
    /// self <= b.
    fn le(self, b: Self) -> Self::Mask;
    /// `a` where the mask is set, elsewhere `b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// `a` where the mask is set, elsewhere `b`.
    fn select_mask(mask: Self::Mask, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Both.
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Either.
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// One whole number for each lane.
    fn index(numbers: [u32; LANES]) -> Self::Index;
    /// The whole numbers of all lanes.
    fn numbers(index: Self::Index) -> [u32; LANES];
    /// As [`Lanes::transpose`].
    fn transpose_index(rows: [&[u32; 4]; LANES]) -> [Self::Index; 4];
    /// `a` where the mask is set, elsewhere `b`.
    fn select_index(mask: Self::Mask, a: Self::Index, b: Self::Index) -> Self::Index;
    /// The whole numbers below 2^31 in front of the fractions of numbers from 0 on; of others, anything.
    fn truncate(self) -> Self::Index;
    /// The numbers nearest to whole numbers below 2^31; of others, anything.
    fn from_index(index: Self::Index) -> Self;
    /// The sum, wrapping.
    fn add_index(a: Self::Index, b: Self::Index) -> Self::Index;
    /// Numbers with the bits of whole numbers, which mean nothing as numbers: to be moved together with some that do.
    fn with_bits(index: Self::Index) -> Self;
    /// The low and the high half of each whole number, moved up by 12 bits and added to `add`: the bits of two numbers.
    fn halves(index: Self::Index, add: u32) -> [Self; 2];
    /// index < bound.
    fn below(index: Self::Index, bound: u32) -> Self::Mask;
    /// The highest bits of the whole numbers as bits, lane 0 lowest.
    fn highest_bits(index: Self::Index) -> u32;
    /// Four times each number, plus 1, plus 2 where the first mask is set, plus 1 where the second is: the child of a
    /// square in heap order.
    fn child(squares: Self::Index, sides: [Self::Mask; 2]) -> Self::Index;
    /// The transposed rows of these numbers; 0 for a row that does not exist.
    fn gather(rows: &[[f32; 4]], index: Self::Index) -> [Self; 4];
    /// The mask with the lanes whose bits are set, lane 0 lowest.
    fn mask(bits: u32) -> Self::Mask;
    /// The lanes of a mask as bits, lane 0 lowest.
    fn bits(mask: Self::Mask) -> u32;

    /// Runs a computation as a function of its own, compiled for these lanes.
    #[inline(always)]
    fn apart<K: Apart<Self>>(computation: K) -> K::Output {
        apart::apart(computation)
    }

    /// As [`Lanes::gather`], row by row.
    #[inline(always)]
    fn gather_each(rows: &[[f32; 4]], index: Self::Index) -> [Self; 4] {
        Self::transpose(Self::numbers(index).map(|number| rows.get(number as usize).unwrap_or(&[0.0; 4])))
    }

    /// `a` where the mask is set, elsewhere 0.
    #[inline(always)]
    fn only(mask: Self::Mask, a: Self) -> Self {
        Self::select(mask, a, Self::splat(0.0))
    }

    /// 1 where the mask is set, elsewhere 0.
    #[inline(always)]
    fn unit(mask: Self::Mask) -> Self {
        Self::only(mask, Self::splat(1.0))
    }
}
