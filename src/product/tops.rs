//! The tables above the leaves: running sums of weights, which a sample searches and nobody normalises.

use super::stored::PART_ENDS;
use crate::light::parts::{BORDERS, MIDDLES, PARTS};
use crate::simd::{LANES, Lanes, Num};

/// Writes the starts of rows, then of the cells of each row, for the weights of all cells. Answers their sum.
#[inline(always)]
pub fn write(weights: &[f32], [columns, rows]: [u32; 2], tops: &mut [f32]) -> f32 {
    let (columns, rows) = (columns.max(1) as usize, rows as usize);
    let (of_rows, of_cells) = tops.split_at_mut_checked(rows + 1).unwrap_or_default();
    let mut total = 0.0;
    // Ranges in place of chunks, whose length the compiler would divide by, and could not show to be above 0.
    for (row, start) in of_rows.iter_mut().enumerate().take(rows) {
        let line =
            of_cells.get_mut(row * (columns + 1)..).and_then(|cells| cells.get_mut(..=columns)).unwrap_or_default();
        let weights = weights.get(row * columns..).and_then(|cells| cells.get(..columns)).unwrap_or_default();
        *start = total;
        let mut sum = 0.0;
        for (start, weight) in line.iter_mut().zip(weights) {
            *start = sum;
            sum += weight;
        }
        if let Some(end) = line.last_mut() {
            *end = sum;
        }
        total += sum;
    }
    if let Some(end) = of_rows.last_mut() {
        *end = total;
    }
    total
}

/// The widths of the four parts that three borders make, of eight cells.
#[inline(always)]
pub fn widths<F: Lanes>(borders: &[[f32; LANES]]) -> [F; PARTS] {
    let (zero, one) = (<F as Num>::splat(0.0), <F as Num>::splat(1.0));
    let mut ends = [zero, one, one, one, one];
    for (end, border) in ends.iter_mut().skip(1).take(PARTS - 1).zip(borders) {
        *end = <F as Num>::load(*border);
    }
    [ends[1] - ends[0], ends[2] - ends[1], ends[3] - ends[2], ends[4] - ends[3]]
}

/// Writes the ends of rows and parts of eight divided cells for the means of their parts. Answers the means of the cells.
#[inline(always)]
pub fn write_parts<F: Lanes>(means: &[F; MIDDLES], borders: &[[f32; LANES]; BORDERS], ends: &mut [[f32; LANES]]) -> F {
    let (of_rows, of_parts) = ends.split_at_mut_checked(PART_ENDS - MIDDLES).unwrap_or_default();
    let (rows, columns) = borders.split_at(PARTS - 1);
    let heights = widths::<F>(rows);
    let mut total = <F as Num>::splat(0.0);
    let parts = of_parts.chunks_exact_mut(PARTS).zip(means.chunks_exact(PARTS)).zip(columns.chunks_exact(PARTS - 1));
    for ((end, height), ((parts, means), columns)) in of_rows.iter_mut().zip(heights).zip(parts) {
        let mut sum = <F as Num>::splat(0.0);
        for ((end, &mean), width) in parts.iter_mut().zip(means).zip(widths::<F>(columns)) {
            sum = sum + mean * width;
            *end = Num::store(sum);
        }
        total = total + sum * height;
        *end = Num::store(total);
    }
    total
}
