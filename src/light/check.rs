//! Whether bytes hold an environment that every call can use: what is opened need not be what was written.

use super::environment::Environment;
use super::plan::Plan;
use super::search::cell;
use super::tables::{Light, line_words};

/// Whether header, hash, positions and tables are all sound.
pub fn is_sound(environment: &Environment<'_>) -> bool {
    if !environment.header_is_sound() {
        return false;
    }
    let Ok(plan) = Plan::new(&environment.description()) else { return false };
    let light = environment.light();
    let columns = plan.grid[0] as usize;
    let rows = plan.grid[1] as usize;
    let black = environment.header().power == 0.0;
    let tables = [light.tops.get(..rows)].into_iter().chain((0..rows).map(|row| {
        let first = rows + row * columns;
        light.tops.get(first..first + columns)
    }));
    let tops = black || tables.into_iter().all(|table| table.is_some_and(starts_are_sound));
    let maps = (0..2).all(|k| {
        let of = light.cell_of[k];
        (0..plan.small_blocks(k)).all(|small| of.get(small as usize) == Some(&(plan.cell_of(k, small) as u8)))
    });
    tops && maps && (0..plan.cells()).all(|index| cell_is_sound(&plan, &light, index))
}

fn starts_are_sound(starts: &[f32]) -> bool {
    let ordered = starts.windows(2).all(|pair| matches!(pair, [a, b] if a <= b));
    ordered && starts.first() == Some(&0.0) && starts.iter().all(|s| (0.0..=1.0).contains(s))
}

fn cell_is_sound(plan: &Plan, light: &Light<'_>, index: u32) -> bool {
    let Some(c) = light.cells.get(index as usize) else { return false };
    let (face, origin, patches) = plan.cell(index);
    let level = u32::from(c.side[0]).wrapping_sub(plan.side[0]);
    let doubled = level <= plan.levels(patches) && plan.block_side(level) == c.side.map(u32::from);
    let expected = [0, 1].map(|k: usize| patches[k].div_ceil(1 << (c.side[k] & 31)));
    let fits = u32::from(c.face) == face
        && c.origin.map(u32::from) == origin
        && c.patches.map(u32::from) == patches
        && c.reserved == 0
        && c.padding == 0;
    if !fits || !doubled || c.blocks.map(u32::from) != expected || !(0.0..=1.0).contains(&c.probability) {
        return false;
    }
    let [columns, rows] = c.blocks.map(usize::from);
    let Some(starts) = light.starts.get(c.starts as usize..) else { return false };
    let Some(block_rows) = starts.get(..rows) else { return false };
    starts_are_sound(block_rows)
        && (0..rows).all(|row| {
            let first = rows + row * columns;
            let Some(line) = starts.get(first..first + columns) else { return false };
            let width = cell(block_rows, 0, rows, row).1;
            starts_are_sound(line)
                && (0..columns).all(|column| {
                    let share = width * cell(line, 0, columns, column).1;
                    block_is_sound(light, index, [column, row], share)
                })
        })
}

fn block_is_sound(light: &Light<'_>, index: u32, [column, row]: [usize; 2], share: f32) -> bool {
    let Some(c) = light.cells.get(index as usize) else { return false };
    let number = c.first as usize + row * usize::from(c.blocks[0]) + column;
    let Some(block) = light.blocks.get(number) else { return false };
    let at = [column as u32, row as u32];
    let grid_fits = (0..2).all(|k| {
        let begin = at[k] << c.side[k];
        let patches = (u32::from(c.patches[k]).saturating_sub(begin)).min(1 << c.side[k]);
        block.step[k] <= c.side[k] && patches.div_ceil(1 << (block.step[k] & 31)) == u32::from(block.grid[k])
    });
    let [columns, rows] = block.grid.map(usize::from);
    if !grid_fits || columns == 0 || columns > 16 || rows == 0 || rows > 16 || block.share != share {
        return false;
    }
    let words = line_words(columns, light.bilinear);
    let lines = (rows + usize::from(light.bilinear)) * words;
    let Some(row_starts) = light.rows.get(block.rows as usize..block.rows as usize + rows) else { return false };
    let Some(lines) = light.lines.get(block.lines as usize..block.lines as usize + lines) else { return false };
    let ordered = |starts: &[u16]| starts.windows(2).all(|pair| matches!(pair, [a, b] if a <= b));
    ordered(row_starts.get(..rows - 1).unwrap_or(&[]))
        && lines.chunks_exact(words).take(rows).all(|line| ordered(line.get(..columns - 1).unwrap_or(&[])))
}
