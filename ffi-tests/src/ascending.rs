//! Rows of ascending numbers, such as cumulative sums, in which a weighted sum of rows is searched without branches: eight
//! numbers in one step.

use crate::lanes::{F8, LANES};
use wide::CmpLe;

/// Rows of equal length.
pub struct Ascending {
    /// Of each row: every eighth number, then all of them. Both are filled up with infinity.
    blocks: Vec<F8>,
    /// Blocks of every eighth number in a row.
    coarse: usize,
    /// Blocks in a row.
    stride: usize,
}

impl Ascending {
    pub fn new(length: usize, numbers: impl Iterator<Item = f32>) -> Ascending {
        let fine = length.div_ceil(LANES);
        let coarse = fine.div_ceil(LANES);
        let numbers: Vec<f32> = numbers.collect();
        let block = |row: &[f32], first: usize, step: usize| {
            F8::new(std::array::from_fn(|i| row.get(first + i * step).copied().unwrap_or(f32::INFINITY)))
        };
        let blocks = numbers.chunks_exact(length).flat_map(|row| {
            let every_eighth = (0..coarse).map(move |b| block(row, b * LANES * LANES, LANES));
            every_eighth.chain((0..fine).map(move |b| block(row, b * LANES, 1)))
        });
        Ascending { blocks: blocks.collect(), coarse, stride: coarse + fine }
    }

    /// The last index at which a sum of rows, each times a factor, is at most a target; 0 if there is none.
    #[inline]
    pub fn find<const N: usize>(&self, rows: [usize; N], factors: [f32; N], target: f32) -> usize {
        let target = F8::splat(target);
        let count = |block: usize| {
            let mut sum = F8::ZERO;
            for k in 0..N {
                sum = self.blocks[rows[k] * self.stride + block].mul_add(F8::splat(factors[k]), sum);
            }
            // Infinity times 0 is no number, and not counted either.
            sum.cmp_le(target).move_mask().count_ones() as usize
        };
        let mut coarse = 0;
        for block in 0..self.coarse {
            coarse += count(block);
        }
        let block = coarse.max(1) - 1;
        block * LANES + count(self.coarse + block).max(1) - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_found_is_the_last_of_those_below() {
        for length in [2, 8, 9, 64, 65, 128, 200] {
            let number = |row: usize, i: usize| (i * i) as f32 * [1.0, 0.5][row];
            let rows = Ascending::new(length, (0..2 * length).map(|i| number(i / length, i % length)));
            for (a, b) in [(1.0, 0.0), (0.25, 0.75)] {
                for target in (0..2 * length * length).step_by(7).map(|t| t as f32 - 3.0) {
                    let is_below = |&i: &usize| a * number(0, i) + b * number(1, i) <= target;
                    let expected = (0..length).rfind(is_below).unwrap_or(0);
                    assert_eq!(rows.find([0, 1], [a, b], target), expected, "{target} among {length}");
                }
            }
        }
    }
}
