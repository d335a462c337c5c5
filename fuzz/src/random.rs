//! Random numbers, and those that are hard on numerics and on checks. Bytes of a guided fuzzer may decide in their place.

use std::cell::RefCell;

thread_local! {
    /// What decides in place of the generator while it lasts, from its end on.
    static INPUT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// From now on these bytes decide, from the first on, and the generator when they are used up.
pub fn feed(bytes: &[u8]) {
    INPUT.with_borrow_mut(|input| {
        input.clear();
        input.extend(bytes.iter().rev());
    });
}

/// A number of so many bytes, if there are any left.
fn fed(bytes: usize) -> Option<u64> {
    INPUT.with_borrow_mut(|input| {
        let taken = input.len().min(bytes);
        let number =
            |input: &mut Vec<u8>| input.drain(input.len() - taken..).fold(0, |n, byte| n << 8 | u64::from(byte));
        (taken > 0).then(|| number(input))
    })
}

/// SplitMix64 (Steele et al. 2014).
#[derive(Clone, Copy, Debug)]
pub struct Random(pub u64);

const FLOATS: [f32; 20] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    0.999_999_94,
    1.000_000_1,
    2.0,
    f32::MIN_POSITIVE,
    1e-45,
    1e-38,
    1e-20,
    1e-7,
    1e8,
    1e20,
    1e38,
    f32::MAX,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
];

impl Random {
    pub fn bits(&mut self) -> u64 {
        fed(8).unwrap_or_else(|| self.generated())
    }

    fn generated(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// 0 to `end` - 1.
    pub fn below(&mut self, end: usize) -> usize {
        let bytes = match end {
            0..=0x100 => 1,
            0x101..=0x1_0000 => 2,
            _ => 8,
        };
        (fed(bytes).unwrap_or_else(|| self.generated()) % end.max(1) as u64) as usize
    }

    /// True once in so many times.
    pub fn one_in(&mut self, many: usize) -> bool {
        self.below(many) == 0
    }

    pub fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }

    /// In [0, 1), at times its ends.
    pub fn unit(&mut self) -> f32 {
        match self.below(32) {
            0 => 0.0,
            1 => 0.999_999_94,
            _ => fed(3).unwrap_or_else(|| self.generated() >> 40) as f32 / (1 << 24) as f32,
        }
    }

    /// Between two positive numbers, evenly in the logarithm.
    pub fn scale(&mut self, low: f32, high: f32) -> f32 {
        (f64::from(low) * f64::from(high / low).powf(f64::from(self.unit()))) as f32
    }

    /// A number that is hard, of any sign and class.
    pub fn hard(&mut self) -> f32 {
        if self.one_in(4) { f32::from_bits(self.bits() as u32) } else { self.pick(&FLOATS) }
    }

    /// A direction, at times along an axis or next to one.
    pub fn direction(&mut self) -> [f32; 3] {
        let mut v = [0.0; 3];
        let axis = self.below(3);
        match self.below(8) {
            0 => v[axis] = if self.one_in(2) { 1.0 } else { -1.0 },
            1 => {
                v = [self.unit() - 0.5, self.unit() - 0.5, self.unit() - 0.5].map(|x| x * 1e-3);
                v[axis] = 1.0;
            }
            _ => v = [self.unit() - 0.5, self.unit() - 0.5, self.unit() - 0.5],
        }
        let length = v.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
        if length < 1e-6 { [0.0, 0.0, 1.0] } else { v.map(|x| (f64::from(x) / length) as f32) }
    }

    /// A rotation or reflection, row by row.
    pub fn frame(&mut self) -> [f32; 9] {
        let wide = |v: [f32; 3]| v.map(f64::from);
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let unit = |v: [f64; 3]| {
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            v.map(|x| x / length)
        };
        let (x, other) = (unit(wide(self.direction())), wide(self.direction()));
        let across = cross(x, other);
        let y = if across.iter().map(|x| x * x).sum::<f64>() > 1e-4 {
            unit(across)
        } else {
            let away = if x[0].abs() < 0.5 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
            unit(cross(x, away))
        };
        let sign = self.pick(&[1.0, -1.0]);
        let z = cross(x, y).map(|value| sign * value);
        [x, y, z].concat().iter().map(|value| *value as f32).collect::<Vec<_>>().try_into().expect("nine")
    }
}
