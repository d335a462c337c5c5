//! Eight numbers or directions side by side: what the renderer's own code and the peers compute with. The instructions
//! are those that the program is compiled for.

use glam::Vec3;
use wide::{CmpLt, f32x8};

/// Eight numbers.
pub type F8 = f32x8;

/// Numbers that are computed on together.
pub const LANES: usize = 8;

/// Eight directions.
#[derive(Clone, Copy, Debug)]
pub struct V8 {
    pub x: F8,
    pub y: F8,
    pub z: F8,
}

impl V8 {
    #[inline]
    pub fn new(x: F8, y: F8, z: F8) -> V8 {
        V8 { x, y, z }
    }

    #[inline]
    pub fn splat(v: Vec3) -> V8 {
        V8::new(F8::splat(v.x), F8::splat(v.y), F8::splat(v.z))
    }

    /// From one direction for each lane.
    #[inline]
    pub fn each(v: [Vec3; LANES]) -> V8 {
        V8::new(F8::new(v.map(|v| v.x)), F8::new(v.map(|v| v.y)), F8::new(v.map(|v| v.z)))
    }

    /// The direction of a lane.
    #[inline]
    pub fn get(self, i: usize) -> Vec3 {
        Vec3::new(self.x.as_array_ref()[i], self.y.as_array_ref()[i], self.z.as_array_ref()[i])
    }

    #[inline]
    pub fn dot(self, v: V8) -> F8 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    #[inline]
    pub fn length(self) -> F8 {
        self.dot(self).sqrt()
    }

    #[inline]
    pub fn plus(self, v: V8) -> V8 {
        V8::new(self.x + v.x, self.y + v.y, self.z + v.z)
    }

    #[inline]
    pub fn minus(self, v: V8) -> V8 {
        V8::new(self.x - v.x, self.y - v.y, self.z - v.z)
    }

    #[inline]
    pub fn scale(self, s: F8) -> V8 {
        V8::new(self.x * s, self.y * s, self.z * s)
    }

    #[inline]
    pub fn normalize(self) -> V8 {
        self.scale(F8::ONE / self.length())
    }

    /// Where `mask` is set, `self`; elsewhere `other`.
    #[inline]
    pub fn or(self, mask: F8, other: V8) -> V8 {
        V8::new(mask.blend(self.x, other.x), mask.blend(self.y, other.y), mask.blend(self.z, other.z))
    }
}

/// Directions of any number, component by component. There is always room for whole lanes.
#[derive(Clone, Debug, Default)]
pub struct Directions {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
}

impl Directions {
    /// Keeps what is there and makes room for `count`.
    pub fn resize(&mut self, count: usize) {
        for column in [&mut self.x, &mut self.y, &mut self.z] {
            column.resize(padded(count), 0.0);
        }
    }

    #[inline]
    pub fn get(&self, i: usize) -> Vec3 {
        Vec3::new(self.x[i], self.y[i], self.z[i])
    }

    #[inline]
    pub fn set(&mut self, i: usize, [x, y, z]: [f32; 3]) {
        (self.x[i], self.y[i], self.z[i]) = (x, y, z);
    }

    /// Those from number `i` on.
    #[inline]
    pub fn load(&self, i: usize) -> V8 {
        V8::new(load(&self.x, i), load(&self.y, i), load(&self.z, i))
    }

    #[inline]
    pub fn store(&mut self, i: usize, v: V8) {
        store(&mut self.x, i, v.x);
        store(&mut self.y, i, v.y);
        store(&mut self.z, i, v.z);
    }
}

/// The length of a column for `count` numbers: lanes may begin at any of them.
pub fn padded(count: usize) -> usize {
    count + LANES
}

/// The numbers from `i` on.
#[inline]
pub fn load(column: &[f32], i: usize) -> F8 {
    let mut lanes = [0.0; LANES];
    lanes.copy_from_slice(&column[i..i + LANES]);
    F8::new(lanes)
}

#[inline]
pub fn store(column: &mut [f32], i: usize, lanes: F8) {
    column[i..i + LANES].copy_from_slice(lanes.as_array_ref());
}

/// sin and cos of a turn, 0 to 1, for numbers from -1 to 1.
#[inline]
pub fn sin_cos_turn(turn: F8) -> (F8, F8) {
    (turn * F8::splat(std::f32::consts::TAU)).sin_cos()
}

/// The angle of (x, y) as a turn, at least 0 and below 1 but for rounding.
#[inline]
pub fn turn(x: F8, y: F8) -> F8 {
    let turn = y.atan2(x) * F8::splat(std::f32::consts::TAU.recip());
    turn.cmp_lt(F8::ZERO).blend(turn + F8::ONE, turn)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_and_their_sines_are_accurate() {
        let angle = |i: usize| (i as f32 + 0.5) / 64.0;
        let turns = F8::new(std::array::from_fn(|i| angle(8 * i)));
        let (sin, cos) = sin_cos_turn(turns);
        let back = turn(cos, sin);
        for i in 0..LANES {
            let exact = f64::from(angle(8 * i)) * std::f64::consts::TAU;
            assert!((f64::from(sin.as_array_ref()[i]) - exact.sin()).abs() < 3e-7);
            assert!((back.as_array_ref()[i] - angle(8 * i)).abs() < 3e-7);
        }
    }
}
