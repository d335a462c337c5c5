//! Samples at corners, edges and folds stay in their cells (rule 13 of the design).

use super::check;
use super::numbers::neighbours;
use crate::support::scenes::{ShadingPoint, lobes, rows};
use crate::support::vector::{dot, scale, single, unit};
use crate::support::{Environment, Map, Random, build, next_down, query};
use std::ffi::c_void;
use std::ptr::null;
use wis::ffi::wavelets::environment::{
    EnvironmentConfig, WIS_LAYOUT_OCTAHEDRAL, WIS_WAVELET_LIGHT_EXACT_ZERO, WIS_WAVELET_LIGHT_NEAREST,
};
use wis::ffi::wavelets::sampling::{wis_wavelet_pdf, wis_wavelet_sample};
use wis::sphere::{SPHERE, direction_f64};
use wis::status::Status;
use wis::wavelets::descent::Sample;

/// Rotations and, every other one, reflections.
fn random_matrices(seed: u64, count: usize) -> Vec<[f32; 9]> {
    let mut random = Random(seed);
    let signs = [1.0, -1.0].into_iter().cycle();
    signs.take(count).map(|sign| rows(random.direction(), random.direction(), sign)).collect()
}

/// Cells along each side of the finest grid.
pub const CELLS: u32 = 4096;

/// Rows of a checker, one after the other.
unsafe extern "C" fn checker_row(user: *mut c_void, y: u32) -> *const c_void {
    // SAFETY: the user pointer is that of the two rows.
    unsafe { user.cast::<[f32; CELLS as usize]>().add(y as usize % 2).cast() }
}

/// Every other cell of the finest grid lit and the rest black: a point that slips into a neighbour has density 0.
fn finest_checker() -> Environment {
    let row = |parity: usize| std::array::from_fn(|x| if x % 2 == parity { 1.0 } else { 0.0 });
    let mut rows: [[f32; CELLS as usize]; 2] = [row(0), row(1)];
    let map = Map { width: CELLS, height: CELLS, channels: 1, layout: WIS_LAYOUT_OCTAHEDRAL, pixels: Vec::new() };
    let config = EnvironmentConfig {
        pixels: null(),
        row: Some(checker_row),
        row_user: rows.as_mut_ptr().cast(),
        ..map.config(CELLS, WIS_WAVELET_LIGHT_EXACT_ZERO | WIS_WAVELET_LIGHT_NEAREST)
    };
    build(&config).unwrap()
}

/// The u that lead to the corners of lit cell `(i, j)` of the finest checker. Every split but those of axis 2 at
/// the finest level is 1/2, so u is the point of the square itself, one level less deep along axis 2.
fn corners_of_cell(i: u32, j: u32) -> [[f32; 2]; 4] {
    let ends = |k: u32, cells: u32| {
        let end = |k: u32| k as f32 / cells as f32;
        [end(k), next_down(end(k + 1))]
    };
    let ([x0, x1], [y0, y1]) = (ends(i, CELLS), ends(j / 2, CELLS / 2));
    [[x0, y0], [x0, y1], [x1, y0], [x1, y1]]
}

/// Cells on the folded edges of the square, on the fold at the equator, and beside the middle lines.
fn cells_at_folds() -> impl Iterator<Item = (u32, u32)> {
    let (last, half) = (CELLS - 1, CELLS / 2);
    (0..CELLS).flat_map(move |k| {
        let diagonal = if k < half { half - 1 - k } else { k - half };
        let across = [0, 1, half - 1, half, last - 1, last, diagonal, last - diagonal];
        across.into_iter().flat_map(move |other| [(k, other), (other, k)])
    })
}

/// Warps u to samples and asks for the pdf of each.
fn check_all(environment: &Environment, matrix: &[f32; 9], u: &[[f32; 2]], expected: f32) {
    let (mut drawn, mut asked) = (vec![Sample::default(); u.len()], vec![0.0f32; u.len()]);
    let (e, n, start) = (environment.handle, u.len(), drawn.as_mut_ptr());
    // SAFETY: all arrays have n elements.
    unsafe {
        let u = u.as_ptr().cast();
        assert_eq!(wis_wavelet_sample(e, null(), matrix, n, u, 0, start, 0), Status::Ok);
        let status = wis_wavelet_pdf(e, null(), matrix, n, start.cast(), 16, asked.as_mut_ptr(), 0);
        assert_eq!(status, Status::Ok);
    }
    for ((u, drawn), asked) in u.iter().zip(&drawn).zip(&asked) {
        assert_eq!(drawn.pdf.to_bits(), asked.to_bits(), "{u:?} {drawn:?}");
        assert_eq!(drawn.pdf, expected, "{u:?} {drawn:?}");
    }
}

/// Under 100 matrices, samples at the corners of the cells of the finest grid stay in their cells: at all folds, and
/// inside in every tenth cell under one of the matrices (in a release build: in all cells under each).
#[test]
fn samples_stay_in_the_finest_cells() {
    let environment = &finest_checker();
    let matrices = &random_matrices(47, 100);
    let stride = if cfg!(debug_assertions) { 10 * matrices.len() } else { 1 };
    let check_cells = move |number: usize, cells: &mut dyn Iterator<Item = (u32, u32)>| {
        let lit = cells.filter(|&(i, j)| (i + j) % 2 == 0);
        let u: Vec<[f32; 2]> = lit.flat_map(|(i, j)| corners_of_cell(i, j)).collect();
        check_all(environment, &matrices[number], &u, 2.0 / SPHERE);
    };
    let check_matrix = move |number: usize| {
        check_cells(number, &mut cells_at_folds());
        for row in 0..CELLS {
            let first = (number + row as usize) % stride;
            check_cells(number, &mut (first as u32..CELLS).step_by(stride).map(|column| (row, column)));
        }
    };
    std::thread::scope(|scope| {
        for half in 0..2 {
            scope.spawn(move || (half..matrices.len()).step_by(2).for_each(check_matrix));
        }
    });
}

/// As above for products: their splits are not simple, so corners are approached by inversion from inside their cells
/// and by the nearest u on all sides.
#[test]
fn samples_of_products_stay_in_the_finest_cells() {
    let environment = finest_checker();
    let mut random = Random(53);
    let at = |i: u32, inwards: f64| (f64::from(i) + inwards) / f64::from(CELLS);
    for (world_from_map, (name, lobes)) in random_matrices(59, 100).into_iter().zip(lobes().iter().cycle()) {
        let (normal, wo) = (unit(random.direction()), random.direction());
        let wo = scale(wo, dot(normal, wo).signum());
        let query = query(single(normal), single(wo), lobes);
        let point = ShadingPoint { name: (*name).into(), query, world_from_map };
        let product = point.prepare(&environment);
        for (i, j) in cells_at_folds().step_by(101).filter(|(i, j)| (i + j) % 2 == 0) {
            for (x, y) in [(1e-3, 1e-3), (1e-3, 0.999), (0.999, 1e-3), (0.999, 0.999)] {
                let wi = point.world(direction_f64([at(i, x), at(j, y)]));
                let Some(u) = product.invert(wi) else { continue };
                for near in neighbours(u) {
                    let sample = product.sample(near);
                    check(sample, product.pdf(sample.wi));
                }
            }
        }
    }
}
