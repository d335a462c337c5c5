//! What a product keeps where the BRDF is dark (rule 16), read from its density.

use super::built::{Built, Random};
use super::client::Client;
use super::lookup::{Map, double, single};
use super::maps::layouts;
use super::points::{phong, view};
use super::prepared::Prepared;
use wis::brdf::material::{Material, Shape};
use wis::light::chart::Layout;
use wis::light::guide::value;
use wis::light::plan::Filter;
use wis::light::tables::decode;
use wis::product::prepare::Config;
use wis::simd::GROUP;

/// Parts of 16-bit words, and of pdfs in f32.
const ROUNDING: f64 = 2e-3;
/// What the parts of a divided cell keep of its floor.
const OF_A_PART: f64 = 0.5;

/// Where a narrow lobe is drawn, too, cells keep 1 % of their largest corner, and no more.
#[test]
fn cells_of_a_lobe_that_is_drawn_keep_less() {
    let map = Map::of_directions(Layout::LatLong, 64, 32, |_| 1.0);
    let built = Built::new(&map, &map.description(Filter::Bilinear));
    let guide = built.environment().guide().expect("it was built");
    let [x, y, z] = guide.corner_directions();
    let material = Material::new(&[Shape::ggx(0.1, 0.1)]).unwrap();
    let point = view(&material, [0.3, 0.2, 1.0], 40.0, 0.5);
    let client = Client::new(&point);
    let prepared = Prepared::with(&built, &point, &Config { divided: 0, ..Config::default() });
    let product = prepared.product();
    let mut least = f64::MAX;
    for cell in 0..guide.cells() {
        let first = guide.corner_of(cell);
        let corners = [0, 1, guide.row_length() + 1, guide.row_length() + 2].map(|further| first + further);
        let corners = corners.map(|i| client.f_cos(double([x[i], y[i], z[i]].map(value))));
        let [upper, lower] = product.leaves()[cell / GROUP].map(|words| words[cell % GROUP]);
        let leaf = [upper, upper >> 16, lower, lower >> 16].map(|word| f64::from(decode(word as u16)));
        let (largest, darkest) = (corners.into_iter().fold(0.0, f64::max), leaf.into_iter().fold(f64::MAX, f64::min));
        if largest > 0.0 && darkest > 0.0 {
            least = least.min(darkest * product.header.unit / largest);
        }
    }
    assert!((0.0099..0.0101).contains(&least), "{least}");
}

/// No cell that counts is darker than 5 % of its largest corner, nor than 2^-10 of the mean of the corners above the horizon; of a
/// divided cell at least half of that is left. All cells are looked at, 40 directions in each on average; zero failures.
#[test]
fn no_cell_above_the_horizon_is_darker_than_its_floor() {
    let mut random = Random(83);
    for (layout, width, height) in layouts(32) {
        let map = Map::of_directions(layout, width, height, |_| 1.0);
        let built = Built::new(&map, &map.description(Filter::Bilinear));
        let (environment, light) = (built.environment(), built.environment().light());
        let guide = environment.guide().expect("it was built");
        let [x, y, z] = guide.corner_directions().map(|column| column.iter().map(|&x| value(x)).collect::<Vec<f32>>());
        for shape in [Shape::LAMBERT, Shape::ggx(0.5, 0.5), Shape::ggx(0.2, 0.2), phong(4.0), phong(9.0)] {
            let material = Material::new(&[shape]).unwrap();
            let point = view(&material, random.direction(), 60.0 * random.f64(), random.f64());
            let client = Client::new(&point);
            let corners: Vec<f64> = (0..x.len()).map(|i| client.f_cos(double([x[i], y[i], z[i]]))).collect();
            let above = (0..x.len()).filter(|&i| client.cosine(double([x[i], y[i], z[i]])) > 0.0);
            let (sum, count) = above.fold((0.0, 0.0), |(sum, count), i| (sum + corners[i], count + 1.0));
            for divided in [0, 8] {
                let prepared = Prepared::with(&built, &point, &Config { divided, ..Config::default() });
                let header = *prepared.product().header;
                assert_eq!(header.peak, 0.0, "{shape:?} has a density of its own");
                for _ in 0..5000 {
                    let wi = single(random.direction());
                    let [cell] = light.locate::<f32>(wi, false).cell;
                    let (first, below) = (guide.corner_of(cell as usize), guide.row_length() + 1);
                    let around = [first, first + 1, first + below, first + below + 1].map(|i| corners[i]);
                    let largest = around.into_iter().fold(0.0, f64::max);
                    if largest <= 0.0 && client.cosine(double(wi)) <= 0.0 {
                        continue;
                    }
                    // BRDF x cosine as it is stored.
                    let stored = f64::from(prepared.pdf(wi) / built.pdf(wi)) * header.integral / light.power;
                    let part = if divided > 0 { OF_A_PART } else { 1.0 };
                    let (of_corner, of_mean) = (0.05 * part * largest, sum / count / 1024.0);
                    let least = (1.0 - ROUNDING) * of_corner.max(of_mean);
                    assert!(stored >= least, "{layout:?} {shape:?} {divided}: {stored:e} of {of_corner:e} {of_mean:e}");
                }
            }
        }
    }
}
