//! Maps for these tests: own ones, and the real ones that stand beside the crate.

use super::lookup::{Map, V3, unit};
use std::path::PathBuf;
use wis::light::chart::Layout;
use wis::light::plan::{Description, Filter};

/// A smooth sky over darker ground.
pub fn sky(d: V3) -> f64 {
    0.2 + if d[2] > 0.0 { d[2] * (1.0 + 0.3 * d[1].atan2(d[0]).sin() * (1.0 - d[2])) } else { 0.0 }
}

/// A sky with structure in every texel.
pub fn rough(d: V3) -> f64 {
    sky(d) * (1.3 + (40.0 * d[0]).sin() * (33.0 * d[1]).cos() + 0.2 * (200.0 * d[2]).sin())
}

/// The layouts, with sides for faces of about `side` texels.
pub fn layouts(side: u32) -> [(Layout, u32, u32); 3] {
    [(Layout::LatLong, 2 * side, side), (Layout::Cube, side, 6 * side), (Layout::Octahedral, side, side)]
}

/// Every layout x filter x rows at poles.
pub fn descriptions(map: &Map) -> Vec<Description> {
    let mut all = Vec::new();
    for filter in [Filter::Nearest, Filter::Bilinear] {
        all.push(map.description(filter));
        if map.layout == Layout::LatLong {
            all.push(Description { rows_at_poles: true, ..map.description(filter) });
        }
    }
    all
}

/// Unclipped suns of 1 and 4 texels, 1e5 times the sky: at the horizon, at both poles, on the seam, and on none of these.
pub fn suns(width: u32, height: u32) -> Vec<(String, Map)> {
    let places = [
        ("horizon", [0.3, 0.5]),
        ("zenith", [0.3, 0.0]),
        ("nadir", [0.7, 1.0]),
        ("seam", [0.0, 0.37]),
        ("sky", [0.61, 0.23]),
    ];
    let mut all = Vec::new();
    for (name, [u, v]) in places {
        for texels in [1, 2] {
            let (x, y) = ((u * f64::from(width)) as u32, ((v * f64::from(height)) as u32).min(height - texels));
            let mut map = Map::of_directions(Layout::LatLong, width, height, sky);
            for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().filter(|(i, j)| *i < texels && *j < texels) {
                map.texels[((y + j) * width + (x + i) % width) as usize] = 1e5;
            }
            all.push((format!("sun of {} texels at the {name}", texels * texels), map));
        }
    }
    all
}

/// The real maps beside the crate, as luminances; crosses as six faces. None if they are not there, and then that is printed.
pub fn real() -> Vec<(String, Map)> {
    let folder: PathBuf = [env!("CARGO_MANIFEST_DIR"), "..", "shared", "data", "envmaps"].iter().collect();
    let Ok(files) = std::fs::read_dir(&folder) else {
        println!("left out: no maps beside the crate");
        return Vec::new();
    };
    let mut paths: Vec<PathBuf> = files.filter_map(|file| file.ok()).map(|file| file.path()).collect();
    paths.sort();
    paths
        .iter()
        .filter_map(|path| {
            let name = path.file_name()?.to_str()?.to_owned();
            let Ok(image) = image::open(path) else {
                println!("left out: {name} (its format is not built into the tests)");
                return None;
            };
            let image = image.into_rgb32f();
            let (width, height) = image.dimensions();
            let pixel = |x: u32, y: u32| {
                let [r, g, b] = image.get_pixel(x, y).0;
                0.2126 * r + 0.7152 * g + 0.0722 * b
            };
            if width == 2 * height {
                return Some((name, Map::latlong(width, height, pixel)));
            }
            if 3 * height == 4 * width {
                return Some((name, cross(width / 3, pixel)));
            }
            println!("left out: {name} (neither lat-long nor a vertical cross)");
            None
        })
        .collect()
}

/// The faces of a vertical cross (Debevec), 3 x 4 squares: +y on top, then -x +z +x, then -y, and -z upside down below.
fn cross(side: u32, pixel: impl Fn(u32, u32) -> f32) -> Map {
    Map::new(Layout::Cube, side, 6 * side, |x, y| {
        let (face, x, y) = (y / side, x, y % side);
        let (column, row, turned) = match face {
            0 => (2, 1, false),
            1 => (0, 1, false),
            2 => (1, 0, false),
            3 => (1, 2, false),
            4 => (1, 1, false),
            _ => (1, 3, true),
        };
        let (x, y) = if turned { (side - 1 - x, side - 1 - y) } else { (x, y) };
        pixel(column * side + x, row * side + y)
    })
}

/// A direction near another, at most `angle` from it.
pub fn near(d: V3, offset: V3, angle: f64) -> V3 {
    unit([0, 1, 2].map(|k| d[k] + angle * offset[k]))
}
