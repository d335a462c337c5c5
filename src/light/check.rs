//! Whether bytes hold an environment that every call can use: what is opened need not be what was written.

use super::blocks::CellBlocks;
use super::environment::Environment;
use super::plan::Plan;
use super::search::stored_cell;
use super::tables::{BLOCK, Cell, Light, line_words};

/// Whether header, hash, positions and tables are all sound.
pub fn is_sound(environment: &Environment<'_>) -> bool {
    let Some(plan) = environment.sound_plan() else { return false };
    let light = environment.light();
    let rays = super::map::is_sound(&plan, &light) && super::strata::are_sound(&light);
    if !rays || !plan.of.is_exact() {
        return rays;
    }
    let tops = tables_are_sound(light.tops.beginnings(), plan.grid.map(|n| n as usize));
    let maps = (0..2).all(|k| {
        let of = light.cell_of[k];
        (0..plan.small_blocks(k)).all(|small| of.get(small as usize) == Some(&(plan.cell_of(k, small) as u8)))
    });
    let colours = environment.colours().iter().flatten().all(|c| c.is_finite());
    tops && maps
        && colours
        && environment.guide().is_none_or(|guide| guide.is_sound())
        && (0..plan.cells()).all(|index| cell_is_sound(&plan, &light, index))
}

/// Whether the table of rows, and of the columns of each row, ascend from 0 to 1.
fn tables_are_sound(tables: &[f32], [columns, rows]: [usize; 2]) -> bool {
    let sound =
        |table: &[f32]| table.is_sorted_by(|a, b| a <= b) && table.first() == Some(&0.0) && table.last() == Some(&1.0);
    let end = rows + 1 + rows * (columns + 1);
    tables.get(..rows + 1).is_some_and(sound)
        && tables.get(rows + 1..end).is_some_and(|tables| tables.chunks_exact((columns + 1).max(1)).all(sound))
}

fn cell_is_sound(plan: &Plan, light: &Light<'_>, index: u32) -> bool {
    let Some(c) = light.cells.get(index as usize) else { return false };
    let level = u32::from(c.side[0]).wrapping_sub(plan.side[0]);
    let (_, _, patches) = plan.cell(index);
    if level > if light.exact { 0 } else { plan.levels(patches) } {
        return false;
    }
    let blocks = CellBlocks::new(plan, index, level);
    let expected = Cell { starts: c.starts, first: c.first, probability: c.probability, ..blocks.record() };
    if *c != expected || !(0.0..=1.0).contains(&c.probability) {
        return false;
    }
    let [columns, rows] = c.blocks.map(usize::from);
    let Some(starts) = light.starts.beginnings().get(c.starts as usize..) else { return false };
    tables_are_sound(starts, [columns, rows])
        && (0..rows).all(|row| {
            let [top, bottom] = stored_cell(starts, row);
            (0..columns).all(|column| {
                let [left, right] = stored_cell(starts, rows + 1 + row * (columns + 1) + column);
                let share = (bottom - top) * (right - left);
                block_is_sound(light, &blocks, c.first as usize, row * columns + column, share)
            })
        })
}

fn block_is_sound(light: &Light<'_>, cell: &CellBlocks, first: usize, number: usize, share: f32) -> bool {
    let Some(block) = light.blocks.get(first + number) else { return false };
    let steps = [block.step(0), block.step(1)];
    let grid = cell.tile(number, steps).grid;
    let fits = |k: usize| u32::from(steps[k]) <= if light.exact { 0 } else { cell.side[k] } && grid[k] <= BLOCK as u32;
    if !fits(0)
        || !fits(1)
        || grid != block.grid.map(u32::from)
        || !(0.0..f32::INFINITY).contains(&block.brightest)
        || block.to_ends > 1
        || block.share != share
    {
        return false;
    }
    let [columns, rows] = block.grid.map(usize::from);
    let words = line_words(columns, light.bilinear);
    let lines = (rows + usize::from(light.bilinear)) * words;
    let words_at = |first: usize, count: usize| light.words.beginnings().get(first..first + count);
    let (Some(row_starts), Some(lines)) =
        (words_at(block.rows as usize, rows), words_at(block.line(0, light.bilinear), lines))
    else {
        return false;
    };
    row_starts.get(..rows - 1).unwrap_or(&[]).is_sorted_by(|a, b| a <= b)
        && lines.chunks_exact(words.max(1)).take(rows).all(|line| {
            let starts = line.get(block.corners(light.bilinear)..).unwrap_or(&[]);
            starts.get(..columns - 1).unwrap_or(&[]).is_sorted_by(|a, b| a <= b)
        })
}
