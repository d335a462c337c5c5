//! Products of two or three trees, and weighted sums, as trees: against pixels, vectors, and through C.

use crate::stored;
use crate::stored::{EPS, Random, Stored, array, cases, doubles, floats, integer, number};
use crate::support::{BuiltTree, Memory, pixel_config, tree_config};
use std::ffi::c_void;
use std::ptr::{null, null_mut};
use wis::ffi::wavelets::tree::*;
use wis::ffi::{Diagnostic, MemorySize};
use wis::status::Status;
use wis::wavelets::stored::AXES;

/// A tree in memory as a client holds it.
struct Client {
    memory: Memory,
    info: TreeInfo,
    /// Bytes that were asked for.
    needed: usize,
}

/// A product or a sum of trees, without weights.
fn of_trees(source: u32, trees: &[*const Tree]) -> TreeConfig {
    TreeConfig { tree_count: trees.len() as u32, trees: trees.as_ptr(), ..tree_config(source) }
}

/// The status of a size query.
fn measure(config: &TreeConfig, size: &mut MemorySize, diagnostic: *mut Diagnostic) -> Status {
    // SAFETY: the configuration is that of as many trees as it says.
    unsafe { wis_tree_size(config, size, diagnostic) }
}

fn memory(bytes: usize) -> Vec<u128> {
    vec![u128::from_ne_bytes([0xa5; 16]); bytes.div_ceil(16).max(1)]
}

fn start(memory: &mut [u128]) -> *mut c_void {
    memory.as_mut_ptr().cast()
}

/// The axes of a tree, from its header.
fn axes(tree: *const Tree) -> u32 {
    // SAFETY: a tree begins with 40 bytes and then its axes.
    unsafe { tree.byte_add(40).cast::<u32>().read() }
}

impl Client {
    fn new(dimensions: u32, depth: u32, error_budget: f32, pixels: &[f32]) -> Client {
        Client::build(&pixel_config(dimensions, depth, error_budget, pixels))
    }

    fn product(e: &Client, f: &Client, g: Option<&Client>) -> Client {
        let trees: Vec<_> = [Some(e), Some(f), g].into_iter().flatten().map(Client::tree).collect();
        let product = Client::build(&of_trees(WIS_TREE_PRODUCT, &trees));
        // Exact where axes are the same.
        let alike = trees.iter().all(|tree| axes(*tree) == axes(e.tree()));
        let (bytes, needed) = (product.info.bytes as usize, product.needed);
        assert!(bytes == needed || !alike && bytes < needed);
        product
    }

    fn blend(terms: &[(&Client, f64)]) -> Client {
        let (trees, weights): (Vec<_>, Vec<_>) = terms.iter().map(|(term, weight)| (term.tree(), *weight)).unzip();
        Client::build(&TreeConfig { weight: weights.as_ptr(), ..of_trees(WIS_TREE_BLEND, &trees) })
    }

    fn product_integral(&self, f: &Client) -> f64 {
        let mut integral = f64::NAN;
        // SAFETY: both handles are trees.
        assert_eq!(unsafe { wis_tree_product_integral(self.tree(), f.tree(), &mut integral) }, Status::Ok);
        integral
    }

    fn build(config: &TreeConfig) -> Client {
        let BuiltTree { memory, info, size, .. } = BuiltTree::new(config).unwrap();
        Client { memory, info, needed: size.bytes }
    }

    fn tree(&self) -> *const Tree {
        self.memory.bytes().as_ptr().cast()
    }

    fn open(&self) -> Status {
        let mut tree = null();
        let bytes = self.info.bytes as usize;
        // SAFETY: the block is as long as its info says.
        unsafe { wis_tree_open(self.memory.bytes().as_ptr().cast(), bytes, &mut tree, null_mut(), null_mut()) }
    }

    fn pdf<const N: usize>(&self, point: [f32; N]) -> f32 {
        let mut pdf = f32::NAN;
        // SAFETY: the point has as many numbers as the tree has axes.
        assert_eq!(unsafe { wis_tree_pdf(self.tree(), point.as_ptr(), &mut pdf) }, Status::Ok);
        pdf
    }

    fn sample<const N: usize>(&self, u: [f32; N]) -> ([f32; N], f32) {
        let (mut point, mut pdf) = ([f32::NAN; N], f32::NAN);
        // SAFETY: as above.
        let status = unsafe { wis_tree_sample(self.tree(), u.as_ptr(), point.as_mut_ptr(), &mut pdf) };
        assert_eq!(status, Status::Ok);
        (point, pdf)
    }
}

/// What a pruned tree stands for, pixel by pixel.
fn pixels_of<const N: usize, const C: usize>(depth: u32, budget: f64, pixels: &[f32]) -> Vec<f64> {
    Stored::<C>::complete::<N>(depth, pixels).pruned(budget).0.pixels::<N>()
}

/// `e` of N axes times `f` of K and `g` of two that varies along the first, and the naive product of their pixels.
fn check<const N: usize, const C: usize, const K: usize, const M: usize>(depth: u32, seed: u64, budget: f32) {
    let mut random = Random(seed);
    let e = random.blocky::<N>(depth);
    let f = random.blocky::<K>(depth);
    let g: Vec<f32> = random.blocky::<1>(depth).iter().flat_map(|&x| std::iter::repeat_n(x, 1 << depth)).collect();
    let clients = [
        Client::new(N as u32, depth, budget, &e),
        Client::new(K as u32, depth, budget, &f),
        Client::new(2, depth, budget, &g),
    ];
    let budget = f64::from(budget);
    let (e, f, g) = (
        pixels_of::<N, C>(depth, budget, &e),
        pixels_of::<K, M>(depth, budget, &f),
        pixels_of::<2, 4>(depth, budget, &g),
    );
    for triple in [false, true] {
        let product = Client::product(&clients[0], &clients[1], Some(&clients[2]).filter(|_| triple));
        assert_eq!(product.open(), Status::Ok);
        let pixel = |i: usize| {
            let third = if triple { g[i >> (depth as usize * (N - 2))] } else { 1.0 };
            e[i] * f[i >> (depth as usize * (N - K))] * third
        };
        let mean = (0..e.len()).map(pixel).sum::<f64>() / e.len() as f64;
        assert!((product.info.average - mean).abs() <= 8.0 * EPS * mean, "{} for {mean}", product.info.average);
        if mean == 0.0 {
            assert_eq!(product.sample([0.5; N]).1, 0.0);
            continue;
        }
        for point in stored::centres::<N>(depth) {
            let value = pixel(stored::pixel_index(stored::pixel_of(point, depth), depth)) / mean;
            let pdf = f64::from(product.pdf(point));
            assert_eq!(pdf > 0.0, value > 0.0);
            // Averages are rounded once; the splits of a level are rounded beside 1, and so may be cells of little mass.
            let splits = (1u64 << (N as u32 * depth)) as f64 * EPS;
            let bound = 16.0 * f64::from(depth) * EPS * value + splits;
            assert!((pdf - value).abs() <= bound, "{pdf} for {value}");
        }
        for _ in 0..200 {
            let (point, pdf) = product.sample(random.point::<N>());
            assert!(pdf > 0.0);
            assert_eq!(product.pdf(point).to_bits(), pdf.to_bits());
        }
    }
}

#[test]
fn products_are_those_of_the_pixels() {
    for (seed, budget) in (0..).zip([0.0, 0.0, 0.05, 1e9]) {
        check::<2, 4, 2, 4>(4, seed, budget);
        check::<4, 16, 2, 4>(2, seed, budget);
        check::<4, 16, 4, 16>(2, seed, budget);
    }
}

/// Trees hold no negative values, so images that have some are split into two; products are bilinear.
#[test]
fn averages_are_those_of_the_vectors() {
    for case in cases("product.json") {
        let (n, m, depth) = (integer(&case["n"]), integer(&case["m"]), integer(&case["L"]));
        if ![n, m].iter().all(|axes| AXES.contains(axes)) {
            continue;
        }
        let part =
            |image: &str, sign: f32| floats(&case[image]).iter().map(|x| (sign * x).max(0.0)).collect::<Vec<_>>();
        let (mut signed, mut absolute) = (0.0, 0.0);
        for (e_sign, f_sign) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let (e, f) = (part("E", e_sign), part("F", f_sign));
            let product = Client::product(&Client::new(n, depth, 0.0, &e), &Client::new(m, depth, 0.0, &f), None);
            signed += f64::from(e_sign * f_sign) * product.info.average;
            absolute += product.info.average;
        }
        let expected = doubles(&case["averages"][0])[0];
        assert!((signed - expected).abs() <= 3.0 * EPS * absolute, "{signed} for {expected}");
    }
}

fn check_points<const N: usize>(case: &serde_json::Value) {
    let (m, depth) = (integer(&case["m"]), integer(&case["L"]));
    let [e, f] = [(N as u32, "E"), (m, "F")].map(|(axes, image)| Client::new(axes, depth, 0.0, &floats(&case[image])));
    let product = Client::product(&e, &f, None);
    let integral = number(&case["integral"]);
    assert!((product.info.average / integral - 1.0).abs() < 1e-14);
    assert!((e.product_integral(&f) / integral - 1.0).abs() < 1e-14);
    for point in case["points"].as_array().unwrap() {
        let u = array::<N>(&doubles(&point["x"])).map(|x| (x / 16_777_216.0) as f32);
        let (sampled, pdf) = product.sample(u);
        let cell = stored::pixel_of(sampled, depth);
        if number(&point["margin"]) <= 1.0 / 1_048_576.0 {
            continue;
        }
        let axis_prob: [f64; N] = array(&doubles(&point["axis_prob"]));
        for axis in 0..N {
            assert_eq!(f64::from(cell[axis]), doubles(&point["cell"])[axis]);
            let cells = f64::from(1u32 << depth);
            let error = f64::from(sampled[axis]) * cells - f64::from(cell[axis]) - doubles(&point["offset"])[axis];
            assert!(error.abs() <= 16.0 * EPS / axis_prob[axis] + EPS * cells, "{point} {error}");
        }
        let least = axis_prob.iter().copied().fold(1.0, f64::min);
        let bound = (4.0 * N as f64 * f64::from(depth) + N as f64 / least) * EPS;
        assert!((f64::from(pdf) / number(&point["pdf"]) - 1.0).abs() <= bound);
    }
}

#[test]
fn points_of_the_product_are_those_of_the_vectors() {
    for case in cases("warp_product.json") {
        match integer(&case["n"]) {
            2 => check_points::<2>(&case),
            4 => check_points::<4>(&case),
            _ => {}
        }
    }
}

#[test]
fn a_product_is_a_factor_like_any_other() {
    let mut random = Random(4);
    let images: Vec<Vec<f32>> = (0..3).map(|_| random.image(1 << 10)).collect();
    let [e, f, g] = [0, 1, 2].map(|i| Client::new(2, 5, 0.0, &images[i]));
    let at_once = Client::product(&e, &f, Some(&g));
    let one_by_one = Client::product(&Client::product(&e, &f, None), &g, None);
    assert!((at_once.info.average / one_by_one.info.average - 1.0).abs() < 4.0 * EPS);
    let mut integral = 0.0;
    // SAFETY: the handles are trees.
    let status =
        unsafe { wis::ffi::wavelets::triple::wis_triple_integral(e.tree(), f.tree(), g.tree(), &mut integral) };
    assert_eq!(status, Status::Ok);
    assert!((at_once.info.average / integral - 1.0).abs() < 4.0 * EPS);
    let (point, _) = at_once.sample([0.3, 0.8]);
    assert!((f64::from(at_once.pdf(point)) / f64::from(one_by_one.pdf(point)) - 1.0).abs() < 80.0 * EPS);
}

#[test]
fn extremes_have_defined_products() {
    let huge = Client::new(2, 1, 0.0, &[3e38, 1e38, 0.0, 2e38]);
    let cube = Client::product(&huge, &huge, Some(&huge));
    assert!((cube.info.average / ((2.7e115 + 1e114 + 8e114) / 4.0) - 1.0).abs() < 1e-5);
    let tiny = Client::new(2, 1, 0.0, &[1e-45, 0.0, 0.0, 1e-40]);
    let product = Client::product(&tiny, &tiny, Some(&tiny));
    assert!(product.info.average > 0.0 && product.pdf([0.1, 0.1]) > 0.0);
    assert_eq!(product.pdf([0.1, 0.9]), 0.0);
    let board = |parity: usize| (0..64).map(|i| ((i / 8 + i % 8 + parity) % 2) as f32).collect::<Vec<_>>();
    let nothing = Client::product(&Client::new(2, 3, 0.0, &board(0)), &Client::new(2, 3, 0.0, &board(1)), None);
    assert_eq!((nothing.info.average, nothing.sample([0.5; 2]).1, nothing.open()), (0.0, 0.0, Status::Ok));
    let black = Client::new(2, 3, 0.0, &[0.0; 64]);
    assert_eq!(Client::product(&black, &huge, None).info.squares, 0);
    let constant = Client::new(2, 0, 0.0, &[0.25]);
    let product = Client::product(&constant, &constant, None);
    assert_eq!((product.info.average, product.info.squares, product.pdf([0.2, 0.7])), (0.0625, 0, 1.0));
}

#[test]
fn wrong_trees_and_short_blocks_are_refused() {
    let square = Client::new(2, 2, 0.0, &[1.0, 2.0, 3.0, 4.0].repeat(4));
    let hypercube = Client::new(4, 1, 0.0, &[1.0, 2.0, 3.0, 4.0].repeat(4));
    let mut size = MemorySize::default();
    let mut diagnostic = Diagnostic::default();
    let trees = [square.tree(), hypercube.tree()];
    let status = measure(&of_trees(WIS_TREE_PRODUCT, &trees), &mut size, &mut diagnostic);
    assert_eq!((status, diagnostic.argument, diagnostic.y), (Status::InvalidArgument, 1, 1));
    assert_eq!(unsafe { std::ffi::CStr::from_ptr(diagnostic.field) }, c"trees");
    let trees = [hypercube.tree(), square.tree()];
    let config = of_trees(WIS_TREE_PRODUCT, &trees);
    assert_eq!(measure(&config, &mut size, null_mut()), Status::Ok);
    let mut call = |bytes: usize, scratch_bytes: usize| {
        let (mut block, mut scratch) = (memory(size.bytes), memory(size.scratch_bytes));
        let (block, scratch) = (start(&mut block), start(&mut scratch));
        let mut tree = null();
        // SAFETY: the blocks are at least as long as stated.
        let status = unsafe {
            wis_tree_init(&config, block, bytes, scratch, scratch_bytes, &mut tree, null_mut(), &mut diagnostic)
        };
        (status, diagnostic.argument, diagnostic.bytes_needed)
    };
    assert_eq!(call(size.bytes, size.scratch_bytes).0, Status::Ok);
    let (bytes, scratch_bytes) = (size.bytes, size.scratch_bytes);
    assert_eq!(call(bytes - 1, scratch_bytes), (Status::MemoryTooSmall, 2, bytes as u64));
    assert_eq!(call(bytes, scratch_bytes - 1), (Status::MemoryTooSmall, 4, scratch_bytes as u64));
    assert_eq!(call(bytes, 0), (Status::MemoryTooSmall, 4, scratch_bytes as u64));
}

/// A sum of pruned trees of any scales is the sum of their pixels, to the rounding of the trees, and opens; terms
/// without weight do not matter.
fn check_blend<const N: usize, const C: usize>(depth: u32, count: usize, seed: u64) {
    let mut random = Random(seed);
    let budget = 0.05f32;
    let scales = [1.0f32, 1e-20, 1e15, 3.0];
    let images: Vec<Vec<f32>> = (0..count)
        .map(|k| random.blocky::<N>(depth).into_iter().map(|x| x * scales[(k + seed as usize) % 4]).collect())
        .collect();
    let clients: Vec<Client> = images.iter().map(|image| Client::new(N as u32, depth, budget, image)).collect();
    let weights: Vec<f64> = (0..count).map(|k| if k % 5 == 4 { 0.0 } else { f64::from(random.unit()) }).collect();
    let blend = Client::blend(&clients.iter().zip(weights.iter().copied()).collect::<Vec<_>>());
    assert_eq!(blend.open(), Status::Ok);
    let mut expected = vec![0.0; 1 << (N as u32 * depth)];
    for (image, weight) in images.iter().zip(&weights) {
        let pixels = pixels_of::<N, C>(depth, budget.into(), image);
        expected.iter_mut().zip(pixels).for_each(|(sum, pixel)| *sum += weight * pixel);
    }
    let mean = expected.iter().sum::<f64>() / expected.len() as f64;
    assert!((blend.info.average - mean).abs() <= 4.0 * EPS * mean, "{} {mean}", blend.info.average);
    for point in stored::centres::<N>(depth) {
        let value = expected[stored::pixel_index(stored::pixel_of(point, depth), depth)] / mean;
        let pdf = f64::from(blend.pdf(point));
        assert_eq!(pdf > 0.0, value > 0.0);
        // As in `check`.
        let splits = (1u64 << (N as u32 * depth)) as f64 * EPS;
        assert!((pdf - value).abs() <= 16.0 * f64::from(depth) * EPS * value + splits, "{pdf} for {value}");
    }
}

#[test]
fn blends_are_sums_of_pixels() {
    for (seed, count) in [(1, 1), (2, 2), (3, 4), (4, 16)] {
        check_blend::<2, 4>(5, count, seed + 10);
        check_blend::<4, 16>(2, count, seed + 30);
    }
}

/// What interpolates four turned maps and four slices of a BRDF is the bilinear blend of all sixteen products, exactly: the
/// inner product of details is bilinear (Clarberg et al. 2005, Section 5.2), and what is sampled has the pdf of that.
#[test]
fn sixteen_products_are_one() {
    let mut random = Random(77);
    let mut four = |budget| [(); 4].map(|()| Client::new(2, 5, budget, &random.blocky::<2>(5)));
    let (maps, slices) = (four(0.0), four(0.03));
    let (v, w) = ([0.1, 0.2, 0.3, 0.4], [0.56, 0.24, 0.14, 0.06]);
    let terms = |trees: &'_ [Client; 4], weights: [f64; 4]| {
        Client::blend(&trees.iter().zip(weights).collect::<Vec<(&Client, f64)>>())
    };
    let product = Client::product(&terms(&maps, v), &terms(&slices, w), None);
    let mut expected = 0.0;
    for (map, v) in maps.iter().zip(v) {
        expected += slices.iter().zip(w).map(|(slice, w)| v * w * map.product_integral(slice)).sum::<f64>();
    }
    assert!((product.info.average / expected - 1.0).abs() < 1e-6, "{} {expected}", product.info.average);
    for _ in 0..200 {
        let (point, pdf) = product.sample::<2>([random.unit(), random.unit()]);
        assert_eq!(product.pdf(point).to_bits(), pdf.to_bits());
        let value = |trees: &[Client; 4], weights: [f64; 4]| -> f64 {
            trees.iter().zip(weights).map(|(t, w)| w * f64::from(t.pdf(point)) * t.info.average).sum()
        };
        let density = value(&maps, v) * value(&slices, w) / expected;
        assert!((f64::from(pdf) / density - 1.0).abs() < 1e-4, "{pdf} {density}");
    }
}

#[test]
fn blends_out_of_range() {
    let (hypercube, square) = (Client::new(4, 1, 0.0, &[2.0; 16]), Client::new(2, 1, 0.0, &[1.0, 2.0, 3.0, 4.0]));
    let nothing = Client::new(2, 1, 0.0, &[0.0; 4]);
    let mut size = MemorySize::default();
    let mixed = [hypercube.tree(), square.tree()];
    let asked = |tree_count, trees: &[*const Tree], size: &mut MemorySize| {
        measure(&TreeConfig { tree_count, ..of_trees(WIS_TREE_BLEND, trees) }, size, null_mut())
    };
    assert_eq!(asked(0, &mixed, &mut size), Status::InvalidArgument);
    assert_eq!(asked(17, &[hypercube.tree(); 17], &mut size), Status::InvalidArgument);
    assert_eq!(asked(2, &mixed, &mut size), Status::InvalidArgument);
    assert_eq!(asked(2, &[square.tree(), null()], &mut size), Status::NullPointer);
    let black = Client::blend(&[(&square, 0.0), (&nothing, 3.0)]);
    assert_eq!((black.info.average, black.info.squares), (0.0, 0));
    let huge = Client::blend(&[(&square, 1e300), (&nothing, 1e308), (&square, 1e-300)]);
    assert_eq!(huge.open(), Status::Ok);
    assert!((huge.info.average / 2.5e300 - 1.0).abs() < 1e-6);
    for weight in [-1.0, f64::NAN, f64::INFINITY] {
        let (mut block, mut scratch) = (memory(size.bytes), memory(size.scratch_bytes));
        let (trees, mut tree) = ([square.tree()], null());
        let config = TreeConfig { weight: &weight, ..of_trees(WIS_TREE_BLEND, &trees) };
        // SAFETY: refused before anything is written.
        let status = unsafe {
            let (block, scratch) = (start(&mut block), start(&mut scratch));
            wis_tree_init(&config, block, 0, scratch, 0, &mut tree, null_mut(), null_mut())
        };
        assert_eq!(status, Status::InvalidArgument);
    }
}

/// Where the factors have different axes, sizes come from counts: 16^8 squares are not visited to be counted, and a room
/// that is too short is found out before it is exceeded.
#[test]
fn sizes_of_products_of_different_axes_are_counted() {
    let depth = 8;
    let hypercube = Client::new(4, 0, 0.0, &[1.0]);
    let square = Client::new(2, depth, 0.0, &(0..1 << (2 * depth)).map(|i| (i + 1) as f32).collect::<Vec<_>>());
    let start_of_work = std::time::Instant::now();
    let mut size = MemorySize::default();
    let trees = [hypercube.tree(), square.tree()];
    let config = of_trees(WIS_TREE_PRODUCT, &trees);
    let status = measure(&config, &mut size, null_mut());
    let squares = ((1usize << (4 * depth)) - 1) / 15;
    assert_eq!((status, size.bytes), (Status::Ok, 64 + squares * (64 + 8)));
    let (mut block, mut scratch) = (memory(1 << 12), memory(1 << 12));
    let (mut tree, mut diagnostic) = (null(), Diagnostic::default());
    // SAFETY: the blocks are as long as stated.
    let status = unsafe {
        let (block, scratch) = (start(&mut block), start(&mut scratch));
        wis_tree_init(&config, block, 1 << 12, scratch, 1 << 12, &mut tree, null_mut(), &mut diagnostic)
    };
    assert_eq!((status, diagnostic.argument), (Status::MemoryTooSmall, 4));
    assert_eq!(diagnostic.bytes_needed, size.scratch_bytes as u64);
    assert!(start_of_work.elapsed().as_secs_f64() < 1.0, "{:?}", start_of_work.elapsed());
}

/// The size is an upper bound of what any product takes, and exact for two complete trees.
#[test]
fn sizes_from_counts_are_enough() {
    let mut random = Random(9);
    for (n, m, depth) in [(2, 2, 4), (4, 2, 2), (4, 4, 1)] {
        for budget in [0.0, 0.02] {
            let mut image = |pixels: usize| (0..pixels).map(|_| 1.0 + random.unit()).collect::<Vec<f32>>();
            let e = Client::new(n, depth, budget, &image(1 << (n * depth)));
            let f = Client::new(m, depth + 1, budget, &image(1 << (m * (depth + 1))));
            for third in [None, Some(&f)] {
                let product = Client::product(&e, &f, third);
                assert!(product.info.bytes <= product.needed as u64);
                let is_exact = product.info.bytes == product.needed as u64;
                assert!(is_exact || budget > 0.0 || third.is_some(), "{n} {m}");
            }
        }
    }
}
