//! The tables above the leaves: running sums of weights, which a sample searches and nobody normalises.

use super::stored::PART_ENDS;
use crate::light::parts::{BORDERS, MIDDLES, PARTS};
use crate::simd::{GROUP, Num};

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

/// The widths of the four parts that three borders make, of the cells from place `first` of a group on.
#[inline(always)]
pub fn widths<F: Num>(borders: &[[f32; GROUP]], first: usize) -> [F; PARTS] {
    let (zero, one) = (F::splat(0.0), F::splat(1.0));
    let mut ends = [zero, one, one, one, one];
    for (end, border) in ends.iter_mut().skip(1).take(PARTS - 1).zip(borders) {
        *end = F::at(border, first);
    }
    [ends[1] - ends[0], ends[2] - ends[1], ends[3] - ends[2], ends[4] - ends[3]]
}

/// Writes the ends of rows and parts of the divided cells from place `first` of a group on for the means of their parts. Answers the means
/// of the cells.
#[inline(always)]
pub fn write_parts<F: Num>(
    means: &[F; MIDDLES],
    borders: &[[f32; GROUP]; BORDERS],
    ends: &mut [[f32; GROUP]],
    first: usize,
) -> F {
    let (of_rows, of_parts) = ends.split_at_mut_checked(PART_ENDS - MIDDLES).unwrap_or_default();
    let (rows, columns) = borders.split_at(PARTS - 1);
    let heights = widths::<F>(rows, first);
    let mut total = F::splat(0.0);
    let parts = of_parts.chunks_exact_mut(PARTS).zip(means.chunks_exact(PARTS)).zip(columns.chunks_exact(PARTS - 1));
    for ((end, height), ((parts, means), columns)) in of_rows.iter_mut().zip(heights).zip(parts) {
        let mut sum = F::splat(0.0);
        for ((end, &mean), width) in parts.iter_mut().zip(means).zip(widths::<F>(columns, first)) {
            sum = sum + mean * width;
            sum.write(end, first);
        }
        total = total + sum * height;
        total.write(end, first);
    }
    total
}
