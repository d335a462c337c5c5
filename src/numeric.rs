//! Small numerical tools that every platform computes to the same bits: + - * / and square roots only.

/// Largest `f32` below 1: every coordinate of the unit square and every random number is at most this.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// Luminance of linear Rec. 709 RGB.
pub const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Luminance of a linear Rec. 709 colour.
pub fn luminance(rgb: [f32; 3]) -> f32 {
    let [r, g, b] = rgb;
    LUMINANCE[0] as f32 * r + LUMINANCE[1] as f32 * g + LUMINANCE[2] as f32 * b
}

/// Luminance of a linear Rec. 709 colour in f64.
pub fn luminance_f64(rgb: [f64; 3]) -> f64 {
    let [r, g, b] = rgb;
    LUMINANCE[0] * r + LUMINANCE[1] * g + LUMINANCE[2] * b
}

/// `a` if the condition holds, else `b`, without a branch: conditions on samples cannot be predicted.
#[inline(always)]
pub fn select(condition: bool, a: f32, b: f32) -> f32 {
    let mask = u32::from(condition).wrapping_neg();
    f32::from_bits((a.to_bits() & mask) | (b.to_bits() & !mask))
}

/// Square root, correctly rounded.
#[inline(always)]
pub fn sqrt(x: f32) -> f32 {
    libm::sqrtf(x)
}

/// The smaller of two numbers, by comparison; `b` if either is NaN.
#[inline(always)]
pub fn min<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// The larger of two numbers, by comparison; `b` if either is NaN.
#[inline(always)]
pub fn max<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// `2^exponent` for exponents of normal doubles.
pub fn exp2i(exponent: i32) -> f64 {
    let biased = exponent.clamp(-1022, 1023) + 1023;
    f64::from_bits((biased as u64) << 52)
}

/// `x 2^exponent`, infinite or 0 only where that is beyond a double.
pub fn times_power(x: f64, exponent: i32) -> f64 {
    libm::scalbn(x, exponent)
}

/// Whether a number stays finite as a float.
pub fn is_float(x: f64) -> bool {
    x.abs() <= f64::from(f32::MAX)
}

/// `2^-n` for n up to 126, without a division.
#[inline(always)]
pub fn inverse_power(n: u32) -> f32 {
    f32::from_bits(127u32.wrapping_sub(n).wrapping_shl(23))
}

/// The exponent e of a positive finite x, `2^e <= x < 2^(e+1)`; -1074 at the least.
pub fn exponent(x: f64) -> i32 {
    let normal = |bits: u64| ((bits >> 52) & 0x7ff) as i32 - 1023;
    if x < f64::MIN_POSITIVE { normal((x * exp2i(60)).to_bits()) - 60 } else { normal(x.to_bits()) }
}

/// A 64-bit content id: a multiply-xorshift hash of words, in order.
#[derive(Clone, Copy)]
pub struct ContentHash(u64);

impl ContentHash {
    /// The hash of no words.
    pub const fn new() -> Self {
        ContentHash(0x9e37_79b9_7f4a_7c15)
    }

    /// Adds one word.
    #[inline(always)]
    pub fn add(&mut self, word: u64) {
        let mixed = (self.0 ^ word).wrapping_mul(0xff51_afd7_ed55_8ccd);
        self.0 = mixed ^ (mixed >> 32);
    }

    /// Adds the bits of floats, one word each.
    pub fn add_floats(&mut self, values: &[f32]) {
        for value in values {
            self.add(value.to_bits().into());
        }
    }

    /// Adds bytes, eight by eight as little-endian words.
    pub fn add_bytes(&mut self, bytes: &[u8]) {
        // A word waits for the one before it in its stream only.
        let mut streams = [*self; STREAMS];
        for words in bytes.chunks(8 * STREAMS) {
            for (stream, word) in streams.iter_mut().zip(words.chunks(8)) {
                stream.add(little_endian(word));
            }
        }
        for stream in streams {
            self.add(stream.finish());
        }
    }

    /// The id; never 0, which stands for "no object".
    pub fn finish(self) -> u64 {
        self.0 | 1
    }
}

impl Default for ContentHash {
    fn default() -> Self {
        Self::new()
    }
}

/// Hashes that go on side by side.
const STREAMS: usize = 4;

/// The number that up to eight bytes hold, the lowest first.
#[inline(always)]
fn little_endian(word: &[u8]) -> u64 {
    let mut eight = [0; 8];
    match <&[u8; 8]>::try_from(word) {
        Ok(whole) => eight = *whole,
        Err(_) => eight.iter_mut().zip(word).for_each(|(out, &byte)| *out = byte),
    }
    u64::from_le_bytes(eight)
}

/// `u` moved into [0, 1 - 2^-24]; NaN counts as 1/2.
#[inline]
pub fn clamp_u(u: f32) -> f32 {
    if u.is_nan() { 0.5 } else { min(max(u, 0.0), ONE_MINUS_EPSILON) }
}
