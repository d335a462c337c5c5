//! Curves of rotated maps, tables and directions of the square.

use crate::renderer::{self, constant, linear};
use crate::trees::of;
use crate::world::{Values, World};

pub fn run(w: &mut World) {
    w.curve("wis_table_view", "slices", &[4, 16, 256], constant, |w, n| {
        let (normal, wo) = (w.floats(&[0.0, 0.0, 1.0]), w.floats(&[0.6, 0.0, 0.8]));
        vec![("slice_count", n as f64), ("normal", normal), ("wo", wo)]
    });
    w.curve("wis_grid_cells", "side", &[8, 512], constant, |w, n| {
        vec![("side", n as f64), ("wi", w.floats(&[0.6, 0.0, 0.8]))]
    });
    w.curve("wis_square_direction", "point", &[2, 64], constant, |w, n| {
        vec![("point", w.floats(&[1.0 / n as f32; 2]))]
    });
    w.curve("wis_square_point", "call", &[1, 4], constant, |w, _| vec![("wi", w.floats(&[0.6, 0.0, 0.8]))]);
    let cells = [4096, 16384, 65536];
    w.curve("wis_tree_size", "environment, 4^depth", &cells, constant, |w, n| rotated(w, 0.0, n));
    // Of a small map the pixels are most of the work, of a large one the texels.
    for (input, sizes) in [("environment, 4^depth", cells), ("environment, texels", [32768, 131072, 524288])] {
        w.at_most("wis_tree_init", input, &sizes, linear, |w, n| {
            let (texels, cells) = if input.ends_with("texels") { (n, 1024) } else { (2048, n) };
            let map = renderer::map(w, texels);
            let config = w.of("wis_environment_config", &map);
            let light = w.call("wis_environment_init", &vec![("config", config)]);
            rotated(w, light, cells)
        });
    }
}

/// A light about a direction on so many pixels.
fn rotated<'a>(w: &mut World, light: f64, cells: usize) -> Values<'a> {
    let more = vec![("depth", f64::from(cells.ilog2() / 2)), ("least", 0.25), ("environment", light)];
    of(w, "WIS_TREE_ENVIRONMENT", more)
}
