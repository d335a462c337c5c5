//! Tripling and coupling coefficients of Haar functions: the integrals of products of three and of two of them.
//!
//! Clarberg et al. 2005, "Wavelet Importance Sampling", the theorem of Section 4.1, Eq. 5 and Appendix A; in two
//! dimensions the cases of Ng et al. 2004, "Triple Product Wavelet Integrals", Section 4.5. One rule covers all of them:
//! on the support of the finest function the coarser ones are constants, so only the finest wavelets decide whether the
//! integral vanishes.

use crate::wavelets::morton::MAX_DEPTH;

/// A Haar function of one variable: `2^(level/2) phi(2^level x - translation)`, or the wavelet psi in place of phi.
/// psi is 1 on the lower and -1 on the upper half.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Function {
    /// The support has the width 2^-level.
    pub level: u32,
    /// It begins at translation 2^-level.
    pub translation: u32,
    /// psi instead of phi.
    pub wavelet: bool,
}

impl Function {
    /// 1 on [0, 1).
    pub const ONE: Function = Function { level: 0, translation: 0, wavelet: false };
}

/// `sign 2^(exponent / 2)`: every coefficient is of that form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Value {
    /// -1, 0 or 1.
    pub sign: i32,
    /// Meaningless if the sign is 0.
    pub exponent: i32,
}

impl Value {
    /// The integral of a product over different variables.
    fn times(self, other: Value) -> Value {
        Value { sign: self.sign * other.sign, exponent: self.exponent + other.exponent }
    }

    /// The number.
    pub fn to_f64(self) -> f64 {
        let whole = crate::numeric::exp2i(self.exponent.div_euclid(2));
        let root = if self.exponent.rem_euclid(2) == 1 { core::f64::consts::SQRT_2 } else { 1.0 };
        f64::from(self.sign) * whole * root
    }
}

/// The integral of the product of three functions of one variable.
pub fn tripling(functions: [Function; 3]) -> Value {
    let finest = functions.iter().fold(Function::ONE, |a, b| if b.level > a.level { *b } else { a });
    let (mut sign, mut wavelets, mut exponent) = (1, 0, -2 * finest.level as i32);
    for function in functions {
        let coarser = finest.level.wrapping_sub(function.level);
        if finest.translation.checked_shr(coarser).unwrap_or(0) != function.translation {
            return Value::default();
        }
        exponent += function.level as i32;
        if function.wavelet && coarser == 0 {
            wavelets += 1;
        } else if function.wavelet {
            let upper = finest.translation.checked_shr(coarser - 1).unwrap_or(0) & 1;
            sign *= 1 - 2 * upper as i32;
        }
    }
    // psi and psi^3 have no mean; psi^2 is phi.
    if wavelets % 2 == 1 { Value::default() } else { Value { sign, exponent } }
}

/// The integral of the product of two functions of one variable: the non-standard coupling coefficient, which is not 0
/// either where the finer one is a scaling function on the support of the other.
pub fn coupling(functions: [Function; 2]) -> Value {
    tripling([functions[0], functions[1], Function::ONE])
}

/// A non-standard Haar function of n variables: the product of functions of one level.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BasisFunction {
    /// The support is a cube of the width 2^-level, at most 31.
    pub level: u32,
    /// Where it stands among 2^level along each axis; axes beyond the dimensions are not read.
    pub translation: [u32; 4],
    /// psi instead of phi: bit n - 1 along axis 1, and so on to bit 0 along axis n.
    pub wavelet: u32,
}

impl BasisFunction {
    /// The factor along an axis (0..dimensions).
    fn along(&self, axis: usize, dimensions: usize) -> Function {
        let bit = dimensions.saturating_sub(1 + axis) as u32;
        let translation = self.translation.get(axis).copied().unwrap_or(0);
        Function { level: self.level, translation, wavelet: self.wavelet >> (bit & 31) & 1 == 1 }
    }

    /// Whether it is a function of so many variables on the unit cube.
    pub fn is_valid(&self, dimensions: usize) -> bool {
        let inside = |t: &u32| u64::from(*t) < 1 << self.level;
        self.level < 32 && self.wavelet >> dimensions == 0 && self.translation.iter().take(dimensions).all(inside)
    }
}

/// The integral of the product of two functions of n variables and one of the first m of them (Clarberg et al. 2005,
/// Eq. 5 and 15).
pub fn generalised(n: usize, m: usize, [i, j, k]: [&BasisFunction; 3]) -> Value {
    (0..n).fold(Value { sign: 1, exponent: 0 }, |product, axis| {
        let [i, j] = [i.along(axis, n), j.along(axis, n)];
        product.times(if axis < m { tripling([i, j, k.along(axis, m)]) } else { coupling([i, j]) })
    })
}

/// How many of the `(4^depth)^3` ordered triples of the functions on a square of 2^depth pixels along each axis have a
/// coefficient that is not 0: 8 - 7 N + 9 N log4 N with N = 4^depth. Ng et al. 2004, Eq. 19, has another number, which
/// enumeration does not confirm.
pub fn nonzero_triples(depth: u32) -> u64 {
    let depth = u64::from(if depth < MAX_DEPTH { depth } else { MAX_DEPTH });
    let n = 1u64 << (2 * depth);
    (8 + 9 * n * depth).saturating_sub(7 * n)
}
