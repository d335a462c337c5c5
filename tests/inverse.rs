//! The table of a distribution: cells that have weight are all reached, and as often as their widths say.

use wis::environment::Inverse;
use wis::points::sobol;

const DEPTH: u32 = 5;
const SIDE: u32 = 1 << DEPTH;
/// Positions are multiples of 2^-30.
const WHOLE: f64 = (1 << 30) as f64;

/// The weight of a cell.
type Weight = fn([u32; 2]) -> f64;

/// Weights as maps have them: smooth, dark in places, one cell or row alone, or spread over many orders of magnitude.
fn weights() -> Vec<(&'static str, Weight)> {
    vec![
        ("constant", |_| 1.0),
        ("smooth", |[i, j]| 1.0 + f64::from(i * j) / 10.0),
        ("a sun", |index| if index == [7, 30] { 1e30 } else { 1.0 }),
        ("one cell", |index| if index == [31, 31] { 1e-20 } else { 0.0 }),
        ("one row", |[i, j]| if i == 0 { f64::from(j % 3) } else { 0.0 }),
        ("stripes", |[i, j]| if (i + j) % 2 == 0 { f64::from(1 + j % 4) } else { 0.0 }),
        ("many sizes", |[i, j]| f64::from(sobol(4, i * SIDE + j)[0] * 80.0 - 40.0).exp2()),
    ]
}

struct Table {
    starts: Vec<u32>,
    guides: Vec<u16>,
    sum: f64,
}

impl Table {
    fn new(weight: Weight) -> Table {
        let [starts, guides] = Inverse::lengths(DEPTH).map(|len| len as usize);
        let (mut starts, mut guides) = (vec![u32::MAX; starts], vec![u16::MAX; guides]);
        let sum = Inverse::fill(DEPTH, &mut starts, &mut guides, weight);
        Table { starts, guides, sum }
    }

    fn view(&self) -> Inverse<'_> {
        let inverse = Inverse::trusted(DEPTH, &self.starts, &self.guides);
        assert!(inverse.is_sound());
        inverse
    }
}

/// The probability of a cell is its share of the weight; not below 2^-24 in its row or column, unless it is 0.
#[test]
fn widths_are_shares() {
    for (name, weight) in weights() {
        let table = Table::new(weight);
        let inverse = table.view();
        let row = |i: u32| (0..SIDE).map(|j| weight([i, j])).sum::<f64>();
        let sum: f64 = (0..SIDE).map(row).sum();
        assert!((table.sum / sum - 1.0).abs() < 1e-6, "{name}");
        let check = |distribution, cell, share: f64| {
            let width = f64::from(inverse.span(distribution, cell).width);
            let raised = if share > 0.0 { share.max(2f64.powi(-24)) } else { 0.0 };
            // Those that are raised take from the others; starts and single weights are rounded.
            let allowed = f64::from(SIDE) * 2f64.powi(-24) * share + 2.0 / WHOLE + 1e-6 * share;
            assert!((width / WHOLE - raised).abs() <= allowed, "{name} {distribution} {cell}: {share} {width}");
            assert!(width == 0.0 || width >= 64.0, "{name}");
        };
        for i in 0..SIDE {
            check(0, i, row(i) / sum);
            (0..SIDE).filter(|_| row(i) > 0.0).for_each(|j| check(1 + i, j, weight([i, j]) / row(i)));
        }
    }
}

/// Positions lead to the cell that contains them, wherever in it: also the first and the last of each.
#[test]
fn positions_lead_to_their_cells() {
    for (name, weight) in weights() {
        let table = Table::new(weight);
        let inverse = table.view();
        for distribution in 0..=SIDE {
            if distribution > 0 && inverse.span(0, distribution - 1).width == 0 {
                continue;
            }
            let mut reached = 0;
            for cell in 0..SIDE {
                let span = inverse.span(distribution, cell);
                assert_eq!(span.start, reached, "{name}");
                reached += span.width;
                if span.width == 0 {
                    continue;
                }
                for offset in [0, 1, span.width / 3, span.width / 2, span.width - 1] {
                    let found = inverse.find(distribution, span.start + offset);
                    assert_eq!(found, span, "{name} {distribution}");
                    let inside = found.inside(span.start + offset);
                    assert!((0.0..1.0).contains(&inside) && (inside - offset as f32 / span.width as f32).abs() < 1e-6);
                    let back = f64::from(found.undo(inside)) * WHOLE - f64::from(span.start + offset);
                    assert!(back.abs() <= 64.0 + f64::from(span.width) / 8_388_608.0, "{name}: {back}");
                }
            }
            assert_eq!(f64::from(reached), WHOLE);
        }
    }
}
