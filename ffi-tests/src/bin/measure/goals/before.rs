//! Products beside those of version 0.1, whose engine version 0.2 still had: times of their calls, and the variance of as many samples.

use super::both::Lit;
use super::times::{self, BATCH, POINTS, Times};
use super::variance::{self, Cell, VIEWS, Variances, least, lobes, variances};
use anyhow::{Context, Result};
use std::cell::RefCell;
use std::ffi::c_void;
use std::ptr::{null, null_mut};
use std::rc::Rc;
use wis_ffi_tests::caches::RENDERER;
use wis_ffi_tests::client::{self, Block, Density, Texels, raw};
use wis_ffi_tests::earlier;
use wis_ffi_tests::environment::{self, Environment, Light, Sampler};
use wis_ffi_tests::page::{Part, Table};
use wis_ffi_tests::points;
use wis_ffi_tests::statistics::{geometric, median};
use wis_ffi_tests::timing::singles;

const MATERIALS: [&str; 9] = [
    "Lambert",
    "GGX 0.5",
    "GGX 0.2",
    "GGX 0.1",
    "GGX 0.05",
    "GGX 0.02",
    "anisotropic (0.3, 0.05)",
    "mix",
    "mix of GGX 0.3 and 0.05",
];
/// Samples of a product.
const COUNTS: [usize; 2] = [16, 64];

/// A lobe as it took them.
#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Lobe {
    kind: u32,
    weight: [f32; 3],
    f0: [f32; 3],
    a: f32,
    b: f32,
}

/// Its shading point.
#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Query {
    size: u32,
    flags: u32,
    lobe_count: u32,
    normal: [f32; 3],
    tangent: [f32; 3],
    wo: [f32; 3],
    lobe: [Lobe; 4],
}

/// What it built of a map.
#[repr(C)]
struct Config {
    size: u32,
    layout: u32,
    width: u32,
    height: u32,
    channels: u32,
    format: u32,
    flags: u32,
    storage: u32,
    resolution: u32,
    error_budget: f32,
    pixels: *const c_void,
    row_stride: isize,
    row: *const c_void,
    row_user: *const c_void,
}

/// How it prepared a product.
#[repr(C)]
struct Preparation {
    size: u32,
    max_squares: u32,
    max_evaluations: u32,
    reserved: u32,
    world_from_map: *const f32,
    table: *const c_void,
    callback: *const c_void,
}

type Told = *mut raw::wis_diagnostic;
type Asked = *mut raw::wis_memory_size;
type Handle = *const c_void;

/// Its functions.
struct Engine {
    light_size: unsafe extern "C" fn(*const Config, Asked, Told) -> raw::wis_status,
    #[rustfmt::skip]
    light_init: unsafe extern "C" fn(*const Config, *mut c_void, usize, *mut c_void, usize, *mut Handle, *mut c_void, Told) -> raw::wis_status,
    product_size: unsafe extern "C" fn(*const Preparation, Asked, Told) -> raw::wis_status,
    #[rustfmt::skip]
    prepare: unsafe extern "C" fn(Handle, *const Preparation, usize, *const Query, *mut c_void, usize, *mut Handle, Told) -> raw::wis_status,
    #[rustfmt::skip]
    sample: unsafe extern "C" fn(Handle, Handle, *const f32, usize, *const f32, usize, *mut raw::wis_drawn, usize) -> raw::wis_status,
    pdf: unsafe extern "C" fn(Handle, Handle, *const f32, usize, *const f32, usize, *mut f32, usize) -> raw::wis_status,
}

/// A map as it built it, and room for a product.
struct Before {
    engine: Engine,
    light: Block,
    matrix: [f32; 9],
    product: Block,
}

impl Before {
    fn new(light: &wis_ffi_tests::light::Light) -> Result<Before> {
        // SAFETY: the types are those of the header of 0.2.
        let engine = unsafe {
            Engine {
                light_size: earlier::function("wis_wavelet_light_size")?,
                light_init: earlier::function("wis_wavelet_light_init")?,
                product_size: earlier::function("wis_wavelet_product_size")?,
                prepare: earlier::function("wis_wavelet_product_prepare")?,
                sample: earlier::function("wis_wavelet_sample")?,
                pdf: earlier::function("wis_wavelet_pdf")?,
            }
        };
        const PYRAMID: u32 = 1;
        let built = light.mapped(0, 0.0, |map| {
            let Texels::F32(texels) = map.texels else { unreachable!("maps of floats") };
            let config = Config {
                size: size_of::<Config>() as u32,
                layout: map.layout,
                width: map.width,
                height: map.height,
                channels: map.channels,
                format: raw::WIS_FORMAT_F32,
                flags: 0,
                storage: PYRAMID,
                resolution: 0,
                error_budget: 0.0,
                pixels: texels.as_ptr().cast(),
                row_stride: 0,
                row: null(),
                row_user: null(),
            };
            let mut handle = null();
            // SAFETY: every pointer is to a live local, and blocks are as long as they say.
            client::built(
                |size, told| unsafe { (engine.light_size)(&config, size, told) },
                |place, bytes, work, room, told| unsafe {
                    (engine.light_init)(&config, place, bytes, work, room, &mut handle, null_mut(), told)
                },
            )
        })?;
        let mut before = Before { engine, light: built, matrix: light.world_from_map(), product: Block::new(0) };
        // SAFETY: every pointer is to a live local.
        let size =
            client::size(|size, told| unsafe { (before.engine.product_size)(&before.preparation(), size, told) })?;
        before.product = Block::new(size.bytes);
        Ok(before)
    }

    fn preparation(&self) -> Preparation {
        Preparation {
            size: size_of::<Preparation>() as u32,
            max_squares: 0,
            max_evaluations: 0,
            reserved: 0,
            world_from_map: self.matrix.as_ptr(),
            table: null(),
            callback: null(),
        }
    }

    fn prepare(&mut self, query: &Query) -> client::Result<()> {
        let (preparation, mut handle) = (self.preparation(), null());
        let (place, bytes) = (self.product.start_mut(), self.product.bytes());
        // SAFETY: every pointer is to a live local, and the block is as long as it says.
        client::told(|told| unsafe {
            (self.engine.prepare)(self.light.start(), &preparation, 1, query, place, bytes, &mut handle, told)
        })
    }
}

impl Density for Before {
    fn sample_n(&self, u: &[[f32; 2]], drawn: &mut [raw::wis_drawn]) -> client::Result<()> {
        assert!(u.len() == drawn.len());
        let (light, product, out) = (self.light.start(), self.product.start(), drawn.as_mut_ptr());
        // SAFETY: both are alive, and the arrays are of one length.
        client::check(unsafe { (self.engine.sample)(light, product, null(), u.len(), u.as_ptr().cast(), 0, out, 0) })
    }

    fn pdf_n(&self, wi: &[[f32; 3]], pdf: &mut [f32]) -> client::Result<()> {
        assert!(wi.len() == pdf.len());
        let (light, product, out) = (self.light.start(), self.product.start(), pdf.as_mut_ptr());
        // SAFETY: as above.
        client::check(unsafe { (self.engine.pdf)(light, product, null(), wi.len(), wi.as_ptr().cast(), 0, out, 0) })
    }
}

/// A point as it took them; its kinds of lobes have the numbers of today's.
fn query(point: &raw::wis_point) -> Query {
    // SAFETY: points of this page have a material that lives.
    let material = unsafe { &*point.material };
    let lobe = |k: usize| {
        let raw::wis_lobe { kind, a, b, .. } = material.lobe[k];
        Lobe { kind, weight: point.weight[k], f0: point.f0[k], a, b }
    };
    let &raw::wis_point { normal, tangent, wo, .. } = point;
    let count = material.lobe_count;
    let lobes = std::array::from_fn(|k| if k < count as usize { lobe(k) } else { Lobe::default() });
    Query { size: size_of::<Query>() as u32, flags: 0, lobe_count: count, normal, tangent, wo, lobe: lobes }
}

/// The current sampler, light and room for a product.
struct Now<'a> {
    sampler: Rc<RefCell<Sampler>>,
    light: &'a Environment,
    product: Block,
}

impl Now<'_> {
    fn prepare(&mut self, point: &raw::wis_point) -> client::Result<Light<'_>> {
        Light::product(self.light, &self.sampler, point, &mut self.product)
    }
}

/// Both tables, with their text.
///
/// # Errors
/// Those of the library; version 0.2 is not there.
pub fn parts(lights: &[Lit], timed: &Lit, rounds: usize, quick: bool) -> Result<Vec<Part>> {
    let mut table = times::table("0.1");
    for material in ["Lambert", "GGX 0.2", "GGX 0.05", "mix"] {
        times::row(&mut table, &format!("prepare a product, {material}"), 1, &prepare(timed, material, 0, rounds)?);
    }
    for (name, batch) in [("in 64", BATCH), ("alone", 1)] {
        let [sample, pdf] = calls(timed, batch, rounds)?;
        times::row(&mut table, &format!("product of GGX 0.2: sample {name}"), batch, &sample);
        times::row(&mut table, &format!("product of GGX 0.2: pdf {name}"), batch, &pdf);
    }
    let mut cells = Vec::new();
    for (lit, material) in lights.iter().flat_map(|lit| MATERIALS.map(|material| (lit, material))) {
        let [old, new] = errors(lit, material, if quick { (8, 32, &COUNTS) } else { (48, 96, &COUNTS) })?;
        for (view, i) in (0..VIEWS.len()).flat_map(|view| [0, 1].map(|i| (view, i))) {
            let ratios = variance::ratios([&old[i][view], &new[i][view]]);
            cells.push(Cell { lit, material, candidates: 0, view, hits: COUNTS[i], ratios });
        }
    }
    let heads = ["time", "absolute", "least", "relative", "least", "absolute, equal time", "relative, equal time"];
    let mut errors = Table::new(["material", "samples", "view"], heads);
    let (mut ahead, mut all) = ([0; 2], 0);
    for (material, count) in MATERIALS.into_iter().flat_map(|material| COUNTS.map(|count| (material, count))) {
        let [old, new] = prepare(timed, material, count, rounds)?.map(|times| median(&times[RENDERER]));
        for (view, name) in VIEWS.iter().enumerate() {
            let of = |cell: &&Cell| cell.material == material && cell.hits == count && cell.view == view;
            let group: Vec<&Cell> = cells.iter().filter(of).collect();
            let means = [0, 1].map(|metric| geometric(group.iter().map(|cell| cell.ratios[metric][0])));
            let [absolute, relative] = [0, 1].map(|metric| [format!("{:.2}", means[metric]), least(&group, metric)]);
            let numbers = [vec![format!("{:.2}", old / new)], absolute.into(), relative.into()].concat();
            for mean in means {
                all += 1;
                ahead[0] += usize::from(mean > 1.0);
                ahead[1] += usize::from(mean * old / new > 1.0);
            }
            let equal = means.map(|mean| format!("{:.2}", mean * old / new));
            errors.row([material.to_string(), count.to_string(), name.to_string()], numbers.into_iter().chain(equal));
        }
    }
    let text = "The products that version 0.2 still had beside its own: a tree of wavelets over the map. Ratios are those of 0.1 over today's.";
    let samples = format!(
        "Variance of the mean of as many samples of a product, with the time of preparing it and drawing them, in a renderer's caches. Means over all \
         maps: **today's are ahead in {} of {all} at equal counts, and in {} at equal time.**",
        ahead[0], ahead[1]
    );
    Ok(vec![
        Part::Heading("Beside the products of version 0.1".into()),
        Part::Text(text.into()),
        Part::Table(table),
        Part::Text(samples),
        Part::Table(errors),
    ])
}

/// Both, and a material of today's.
fn each<'a>(lit: &'a Lit, material: &str) -> Result<(Before, Now<'a>, raw::wis_material)> {
    let before = Before::new(&lit.light).context("version 0.1 within 0.2")?;
    let sampler = Rc::new(RefCell::new(Sampler::new(1, 0, 0)?));
    let shapes: Vec<_> = lobes(material).iter().map(|lobe| lobe.shape()).collect();
    Ok((before, Now { sampler, light: &lit.each[1], product: Block::new(0) }, environment::material(&shapes)?))
}

/// Times of preparing a product and drawing so many samples of it.
fn prepare(lit: &Lit, material: &str, samples: usize, rounds: usize) -> Result<Times> {
    let (mut before, mut now, own) = each(lit, material)?;
    let points = variance::points(material, &own, POINTS);
    let (queries, u): (Vec<Query>, _) = (points.iter().map(query).collect(), points::of(3, samples));
    let mut drawn = [vec![raw::wis_drawn::default(); samples], vec![raw::wis_drawn::default(); samples]];
    let [of_old, of_new] = &mut drawn;
    let mut old = |i: usize| {
        before.prepare(&queries[i % POINTS])?;
        if samples > 0 { before.sample_n(&u, of_old) } else { Ok(()) }
    };
    let mut new = |i: usize| {
        let product = now.prepare(&points[i % POINTS])?;
        if samples > 0 { product.sample_n(&u, of_new) } else { Ok(()) }
    };
    Ok(singles(rounds, [&mut old, &mut new])?)
}

fn calls(lit: &Lit, batch: usize, rounds: usize) -> Result<[Times; 2]> {
    let (mut before, mut now, own) = each(lit, "GGX 0.2")?;
    let point = variance::points("GGX 0.2", &own, 1)[0];
    before.prepare(&query(&point))?;
    let new = now.prepare(&point)?;
    times::calls([&before, &new], batch, rounds)
}

/// Variances of means of samples of both.
fn errors(lit: &Lit, material: &str, effort: (usize, usize, &[usize])) -> Result<[Variances; 2]> {
    let (mut before, mut now, own) = each(lit, material)?;
    let mut drawn = [raw::wis_drawn::default(); COUNTS[1]];
    // All samples of a point and seed are drawn with the first.
    let mut of = |point: &raw::wis_point, is_old: bool| {
        if point.sample == 0 {
            let mut u = [[0.0; 2]; COUNTS[1]];
            points::sobol(point.seed, 0, &mut u);
            if is_old {
                before.prepare(&query(point))?;
                before.sample_n(&u, &mut drawn)?;
            } else {
                now.prepare(point)?.sample_n(&u, &mut drawn)?;
            }
        }
        let raw::wis_drawn { wi, pdf } = drawn[point.sample as usize];
        Ok((pdf > 0.0).then_some((wi, 1.0 / pdf)))
    };
    let [old, new] = [true, false].map(|is_old| variances(lit, material, &own, effort, &mut |point| of(point, is_old)));
    Ok([old?, new?])
}
