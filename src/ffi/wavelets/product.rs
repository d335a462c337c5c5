//! Products in C: prepare a shading point, then sample, pdf and invert; evaluate a query's BRDF.

use super::density;
use crate::ffi::wavelets::environment::{Environment, view};
use crate::ffi::wavelets::level;
use crate::ffi::{
    Checked, Diagnostic, ExclusiveBlock, Failure, MemorySize, SharedBlock, Strided, StridedMut, WIS_ALIGNMENT, answer,
    borrow, frame, out, prior, sized,
};
use crate::prior::{Prior, WIS_PRIOR_CELLS};
use crate::sample::Sample;
use crate::simd::{self, Kernel, LANES, Lanes, Level};
use crate::sphere::vector::{V3, dot, splat, to_arrays};
use crate::sphere::{Frame, unit};
use crate::status::{Fault, Result, Status};
use crate::wavelets::environment as kernel;
use crate::wavelets::lobe::{Asked, Brdf, Lobes, MAX_PEAKS, Peak, share_of_lobe};
use crate::wavelets::product::{self, Budget, Built, Cell, Group, Node, Options, Product as Cells, Room, Scratch};
use crate::wavelets::query::{Query, WIS_WAVELET_QUERY_WHOLE_SPHERE};
use crate::wavelets::reuse::Reuse;
use crate::wavelets::sampler::{Header, MAGIC};
use crate::wavelets::table::Table;
use core::ffi::{c_int, c_void};
use glam::Vec3;

/// A prepared shading point: bytes in your memory without pointers, so it may be copied (to any block aligned to
/// WIS_ALIGNMENT) and kept. Constant once prepared; any number of threads may use it at once. Every call on it also
/// takes the environment that it was prepared with. The same environment, query and configuration give the same
/// bytes. Nothing to free.
#[allow(missing_debug_implementations)]
pub struct Product {
    _opaque: [u8; 0],
}

/// The most squares that a configuration may ask for.
pub const WIS_MAX_SQUARES: u32 = 4096;

/// What a preparation may spend, and how the map is turned.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ProductConfig {
    /// sizeof(wis_wavelet_product_config).
    pub size: u32,
    /// What wis_cpu_detect answered, or 0 for the baseline of the platform; anything else is WIS_INVALID_ARGUMENT. Never
    /// changes a bit of the results.
    pub cpu_level: u32,
    /// Inner nodes of the product's tree, 1 to WIS_MAX_SQUARES; 0: 128. Bounds memory and time.
    pub max_squares: u32,
    /// BRDF evaluations besides those of the 64 squares at most that narrow lobes ask for; 0: 66 for Lambert's lobes alone,
    /// 146 with a table or for a callback with a peak, else 106. At least 66 are spent.
    pub max_evaluations: u32,
    /// A row-major 3x3 rotation or reflection, world = M map, within 1e-4; null is the identity. Read during the call.
    pub world_from_map: *const f32,
    /// Radians, 0 to pi/2: the product may also serve hits of the same lobes whose normals lie within this angle of the
    /// query's (wis_wavelet_product_covers). Cosines and horizon are widened by it, so the pdf stays above 0 for all of them;
    /// what the product estimates is then widened too. Hits outside are best given another product; narrow lobes sample
    /// better with a small cone (.05). 0: this normal only.
    pub reuse_cone: f32,
    /// What other pixels saw about here, as a factor of the density (wis_prior_count says when that is unbiased); null:
    /// none. The estimates stay those without visibility. Read during the call.
    pub prior: *const Prior,
}

/// Evaluates the luminance of BRDF x cosine (at least 0, finite) for `count` world directions, three floats each. Where the
/// BRDF is 0 outside a hemisphere, and not narrow, directions outside are asked for as their mirror images inside.
/// Returns 0; anything else stops the preparation with WIS_CALLBACK_FAILED.
pub type BrdfBatchFn =
    Option<unsafe extern "C" fn(user: *mut c_void, count: usize, wi: *const f32, f_cos: *mut f32) -> c_int>;

/// A BRDF that the client evaluates. It is called only while the product is prepared.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CallbackBrdf {
    /// sizeof(wis_wavelet_callback).
    pub size: u32,
    /// WIS_WAVELET_QUERY_WHOLE_SPHERE, or 0: the BRDF is 0 outside the upper hemisphere of the normal.
    pub flags: u32,
    /// The shading normal, unit length.
    pub normal: [f32; 3],
    /// The direction about which a narrow lobe is concentrated, unit length. Read if half_angle is above 0.
    pub peak: [f32; 3],
    /// The half-angle of that lobe in radians, 0 to pi/2; 0: no narrow lobe.
    pub half_angle: f32,
    /// The BRDF.
    pub eval: BrdfBatchFn,
    /// Handed to `eval`.
    pub user: *mut c_void,
}

/// What a prepared product is made of.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct ProductInfo {
    /// sizeof(wis_wavelet_product_info), set by the caller.
    pub size: u32,
    /// Inner nodes.
    pub squares: u32,
    /// Leaves.
    pub leaves: u32,
    /// BRDF evaluations that the preparation spent.
    pub evaluations: u32,
    /// Bytes in use: that much of the block is the product.
    pub bytes: u64,
    /// The content id of the environment.
    pub environment: u64,
}

/// Evaluates RGB of BRDF x cosine of a query for `count` directions of unit length (0 for others): what the lobes mean.
/// Strides are in bytes; 0: packed.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_query_eval(
    query: *const Query,
    count: usize,
    wi: *const f32,
    wi_stride: usize,
    f_cos: *mut f32,
    f_cos_stride: usize,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let lobes = Lobes::new(sized(query, 1)?, None).map_err(|fault| Failure::fault(fault, 1))?;
            evaluate(|wi| lobes.rgb(wi), count, (wi, wi_stride), (f_cos, f_cos_stride), 3)?;
        }
        Ok(())
    })
}

/// RGB of lobes for many directions; 0 for those that are not of unit length. `argument` is the position of `wi`.
///
/// # Safety
/// Pointers are null or point to `count` elements.
pub(super) unsafe fn evaluate(
    rgb: impl Fn(Vec3) -> [f32; 3],
    count: usize,
    wi: (*const f32, usize),
    f_cos: (*mut f32, usize),
    argument: u32,
) -> Checked<()> {
    let wi = Strided::<3>::new(wi.0, wi.1, count, argument)?;
    let f_cos = StridedMut::<3>::new(f_cos.0, f_cos.1, count, argument + 2)?;
    for index in 0..count {
        // SAFETY: the caller's contract; the index is below the count.
        unsafe { f_cos.write(index, unit(wi.read(index)).map_or([0.0; 3], &rgb)) };
    }
    Ok(())
}

/// The bytes that a product needs; no scratch memory besides. Allocate one block per thread and use it over and over.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_size(
    config: *const ProductConfig,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let Settings { budget, level, .. } = read_config(config, 1)?;
            // Asked once for many preparations: here the processor itself is asked.
            if level != Level::BASELINE && level != Level::detect() {
                return Err(Failure::new(Status::InvalidArgument, 1));
            }
            let target = out(size, 2)?;
            let layout = Layout::new(budget).ok_or(Failure::new(Status::Overflow, 1))?;
            target.write(MemorySize { bytes: layout.bytes, align: WIS_ALIGNMENT, scratch_bytes: 0 });
        }
        Ok(())
    })
}

/// Prepares the product of an environment and a shading point. A query without lobes, or light and lobes that do not
/// meet, give a product whose samples have pdf 0.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the block.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_prepare(
    environment: *const Environment,
    query: *const Query,
    config: *const ProductConfig,
    memory: *mut c_void,
    bytes: usize,
    product: *mut *const Product,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let environment = view(environment, 1)?;
            let query = *sized(query, 2)?;
            let mut lobes = Lobes::new(&query, None).map_err(|fault| Failure::fault(fault, 2))?;
            let settings = read_config(config, 3)?;
            lobes.widen(Reuse::new(settings.reuse_cone));
            prepare(&environment, query, Material::Lobes(lobes), (&settings, 3), (memory, bytes), product)
        }
    })
}

/// As wis_wavelet_product_prepare, for a BRDF that the client evaluates in batches of at most 40 directions. There is no RGB
/// estimate of such a product.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the block.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_prepare_callback(
    environment: *const Environment,
    brdf: *const CallbackBrdf,
    config: *const ProductConfig,
    memory: *mut c_void,
    bytes: usize,
    product: *mut *const Product,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let environment = view(environment, 1)?;
            let brdf = Material::Callback(Callback::new(sized(brdf, 2)?)?);
            let settings = read_config(config, 3)?;
            prepare(&environment, Query::default(), brdf, (&settings, 3), (memory, bytes), product)
        }
    })
}

/// Whether a product may serve a hit: 1 if the hit has the lobes and flags of the query that was prepared, bit for bit,
/// and its normal lies within `reuse_cone` of that query's; else 0, also for a product of a callback. That a tabulated
/// lobe means the same table is yours to know. The view (wo) may
/// differ: it changes the quality of the samples, not that the pdf is above 0 wherever the hit reflects light.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_covers(
    environment: *const Environment,
    product: *const Product,
    query: *const Query,
    covers: *mut u32,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let header = Opened::new(environment, product)?.header;
            let query = sized(query, 3)?;
            let target = out(covers, 4)?;
            Lobes::new(query, Some(Table::NOTHING)).map_err(|fault| Failure::fault(fault, 3))?;
            let normal = unit(query.normal).ok_or(Failure::new(Status::InvalidTransform, 3))?;
            target.write(u32::from(header.covers(query, normal)));
        }
        Ok(())
    })
}

/// What a product is made of.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_describe(
    environment: *const Environment,
    product: *const Product,
    info: *mut ProductInfo,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let opened = Opened::new(environment, product)?;
            sized(info.cast_const(), 3)?;
            let header = opened.header;
            info.write(ProductInfo {
                size: size_of::<ProductInfo>() as u32,
                squares: header.squares,
                leaves: if header.squares == 0 { 0 } else { 3 * header.squares + 1 },
                evaluations: header.evaluations,
                bytes: header.bytes,
                environment: header.environment,
            });
        }
        Ok(())
    })
}

/// An approximation of the integral over directions of luminance x luminance of BRDF x cosine, without visibility, in
/// the units of the map. An approximation: a ratio or control variate that uses it inherits its error.
///
/// Estimates from N samples, f L the luminance or colour of radiance x BRDF x cosine and V the visibility of each: the mean of
/// f L V / pdf is unbiased (Clarberg et al. 2005, Eq. 8). This integral times the share of samples with V = 1 (Eq. 11), or
/// times sum(f L V / pdf) / sum(f L / pdf), is free of noise where nothing is blocked, and biased by the integral's error:
/// better for a few samples, worse from 64 on.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_estimate(
    environment: *const Environment,
    product: *const Product,
    luminance: *mut f64,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let opened = Opened::new(environment, product)?;
            out(luminance, 3)?.write(opened.header.estimate(&opened.environment));
        }
        Ok(())
    })
}

/// The approximation of the integral of radiance x BRDF x cosine in RGB. WIS_NOT_BUILT unless the environment was built
/// with WIS_WAVELET_LIGHT_RGB and the product from a query without a table (for those with: wis_wavelet_table_estimate_rgb). Costs a
/// BRDF evaluation for each leaf.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_estimate_rgb(
    environment: *const Environment,
    product: *const Product,
    rgb: *mut [f64; 3],
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let opened = Opened::new(environment, product)?;
            let target = out(rgb, 3)?;
            let lobes = Lobes::new(opened.coloured_query()?, None).map_err(|_| Failure::new(Status::NotBuilt, 2))?;
            target.write(opened.header.estimate_rgb(&opened.environment, &opened.cells, &lobes, None)?);
        }
        Ok(())
    })
}

/// Samples a direction in proportion to the product. `u`: two numbers in [0, 1) (others are moved there, NaN counts as
/// 1/2). pdf 0: there is nothing to sample.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_sample(
    environment: *const Environment,
    product: *const Product,
    u: *const [f32; 2],
    sample: *mut Sample,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let opened = Opened::new(environment, product)?;
            density::sample((&opened.cells, &opened.frame), u, sample, 3)
        }
    })
}

/// As `count` calls of wis_wavelet_product_sample, in the order of `u`. Strides are in bytes from one element to the next; 0:
/// packed.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_sample_n(
    environment: *const Environment,
    product: *const Product,
    count: usize,
    u: *const f32,
    u_stride: usize,
    wi: *mut f32,
    wi_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> Status {
    // SAFETY: the caller's contract.
    unsafe {
        wis_wavelet_product_sample_lanes(
            environment,
            product,
            Level::BASELINE.code(),
            count,
            u,
            u_stride,
            wi,
            wi_stride,
            pdf,
            pdf_stride,
        )
    }
}

/// As wis_wavelet_product_sample_n, with the instructions of a `cpu_level` (wis_cpu_detect): the same bits, with AVX2 in three quarters
/// of the time.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_sample_lanes(
    environment: *const Environment,
    product: *const Product,
    cpu_level: u32,
    count: usize,
    u: *const f32,
    u_stride: usize,
    wi: *mut f32,
    wi_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract; indices stay below `count`.
        unsafe {
            let opened = Opened::new(environment, product)?;
            density::sample_n(
                (&Group::of(&opened.cells), &opened.frame),
                level(cpu_level, 3)?,
                count,
                (u, u_stride),
                (wi, wi_stride),
                (pdf, pdf_stride),
                5,
            )
        }
    })
}

/// The pdf per solid angle of any direction of unit length (within 1e-3): the very bits that a sample came with, and
/// above 0 wherever radiance x BRDF x cosine is.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_pdf(
    environment: *const Environment,
    product: *const Product,
    wi: *const [f32; 3],
    pdf: *mut f32,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let opened = Opened::new(environment, product)?;
            density::pdf((&opened.cells, &opened.frame), wi, pdf, 3)
        }
    })
}

/// As `count` calls of wis_wavelet_product_pdf; a direction that is not of unit length gets pdf 0.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_pdf_n(
    environment: *const Environment,
    product: *const Product,
    count: usize,
    wi: *const f32,
    wi_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> Status {
    // SAFETY: the caller's contract.
    unsafe {
        wis_wavelet_product_pdf_lanes(
            environment,
            product,
            Level::BASELINE.code(),
            count,
            wi,
            wi_stride,
            pdf,
            pdf_stride,
        )
    }
}

/// As wis_wavelet_product_pdf_n, with the instructions of a `cpu_level` (wis_cpu_detect): the same bits, with AVX2 in three quarters
/// of the time.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_pdf_lanes(
    environment: *const Environment,
    product: *const Product,
    cpu_level: u32,
    count: usize,
    wi: *const f32,
    wi_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract; indices stay below `count`.
        unsafe {
            let opened = Opened::new(environment, product)?;
            density::pdf_n(
                (&Group::of(&opened.cells), &opened.frame),
                level(cpu_level, 3)?,
                count,
                (wi, wi_stride),
                (pdf, pdf_stride),
                5,
            )
        }
    })
}

/// The `u` that leads to a direction. WIS_ZERO_DENSITY if none does.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_invert(
    environment: *const Environment,
    product: *const Product,
    wi: *const [f32; 3],
    u: *mut [f32; 2],
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let opened = Opened::new(environment, product)?;
            density::invert((&opened.cells, &opened.frame), wi, u, 3)
        }
    })
}

/// A product with its environment, ready for a call.
#[derive(Clone, Copy)]
pub(super) struct Opened<'a> {
    environment: kernel::Environment<'a>,
    header: &'a Header,
    pub(super) cells: Cells<'a>,
    pub(super) frame: Frame,
}

impl<'a> Opened<'a> {
    /// Checks that the two belong together.
    ///
    /// # Safety
    /// The handles are null or point to an environment and a product that this version made.
    #[inline(always)]
    unsafe fn new(environment: *const Environment, product: *const Product) -> Checked<Opened<'a>> {
        // SAFETY: the caller's contract.
        unsafe { Opened::of(view(environment, 1)?, product, 2) }
    }

    /// As [`Opened::new`], for an environment that is open; `argument` is the product's position.
    ///
    /// # Safety
    /// As [`Opened::new`].
    #[inline(always)]
    pub(super) unsafe fn of(
        environment: kernel::Environment<'a>,
        product: *const Product,
        argument: u32,
    ) -> Checked<Opened<'a>> {
        // SAFETY: the caller's contract; the object is as long as its header says.
        unsafe {
            let header = borrow(product.cast::<Header>(), argument)?;
            if header.magic != MAGIC || header.environment != environment.header.content_id {
                return Err(Failure::new(Status::Mismatch, argument));
            }
            let bytes = header.bytes as usize;
            let block = SharedBlock::new(product.cast(), bytes, bytes, argument)?;
            let cells = Cells {
                light: environment.light(),
                nodes: block.slice(Layout::NODES, 0, nodes(header.squares)),
                base: header.base,
                squares: header.squares,
                average: header.average,
            };
            Ok(Opened { environment, header, cells, frame: header.frame() })
        }
    }

    /// The query of a product that was prepared from one, which is needed with the environment's colours: the integral in RGB.
    fn coloured_query(&self) -> Checked<&'a Query> {
        if self.environment.header.flags & crate::ffi::wavelets::environment::WIS_WAVELET_LIGHT_RGB == 0 {
            return Err(Failure::new(Status::NotBuilt, 1));
        }
        if self.header.query.size == 0 { Err(Failure::new(Status::NotBuilt, 2)) } else { Ok(&self.header.query) }
    }
}

/// The integral in RGB of a product whose lobes have a coloured table.
///
/// # Safety
/// The handles are null or point to an environment and a product that this version made.
pub(super) unsafe fn estimate_coloured<'a>(
    environment: *const Environment,
    product: *const Product,
    table: impl FnOnce(&Query) -> Checked<(Lobes<'a>, [Table<'a>; 3])>,
) -> Checked<[f64; 3]> {
    // SAFETY: the caller's contract.
    let opened = unsafe { Opened::new(environment, product)? };
    let (lobes, [red, green, blue]) = table(opened.coloured_query()?)?;
    Ok(opened.header.estimate_rgb(&opened.environment, &opened.cells, &lobes, Some([&red, &green, &blue]))?)
}

/// The client's BRDF.
pub(super) struct Callback {
    hemisphere: Option<Vec3>,
    peak: Option<Peak>,
    /// Which share of the BRDF is continued below the horizon.
    share: f32,
    eval: unsafe extern "C" fn(*mut c_void, usize, *const f32, *mut f32) -> c_int,
    user: *mut c_void,
}

impl Callback {
    fn new(brdf: &CallbackBrdf) -> Checked<Callback> {
        let eval = brdf.eval.ok_or(Failure::new(Status::NullPointer, 2).of(c"eval"))?;
        let whole = brdf.flags & WIS_WAVELET_QUERY_WHOLE_SPHERE != 0;
        if brdf.flags & !WIS_WAVELET_QUERY_WHOLE_SPHERE != 0 {
            return Err(Failure::fault(Fault::range(c"flags"), 2));
        }
        if !(0.0..=core::f32::consts::FRAC_PI_2 + 1e-6).contains(&brdf.half_angle) {
            return Err(Failure::fault(Fault::range(c"half_angle"), 2));
        }
        let normal = unit(brdf.normal).ok_or(Failure::fault(Fault::transform(c"normal"), 2))?;
        let peak = if brdf.half_angle > 0.0 {
            let direction = unit(brdf.peak).ok_or(Failure::fault(Fault::transform(c"peak"), 2))?;
            Some(Peak::disc(direction, brdf.half_angle))
        } else {
            None
        };
        let hemisphere = if whole { None } else { Some(normal) };
        let share = if whole { 0.0 } else { share_of_lobe(peak) };
        Ok(Callback { hemisphere, peak, share, eval, user: brdf.user })
    }
}

/// What products are prepared for. One type, since each would have its own copy of the preparation.
#[allow(clippy::large_enum_variant)]
pub(super) enum Material<'a> {
    Lobes(Lobes<'a>),
    Callback(Callback),
}

impl Brdf for Material<'_> {
    fn hemisphere(&self) -> Option<Vec3> {
        match self {
            Material::Lobes(lobes) => lobes.hemisphere(),
            Material::Callback(callback) => callback.hemisphere,
        }
    }

    fn rounds(&self) -> u32 {
        match self {
            Material::Lobes(lobes) => lobes.rounds(),
            // A peak is where the caller says, but of any shape.
            Material::Callback(callback) => 1 + u32::from(callback.peak.is_some()),
        }
    }

    fn may_reflect(&self) -> bool {
        match self {
            Material::Lobes(lobes) => lobes.may_reflect(),
            Material::Callback(_) => true,
        }
    }

    fn peaks(&self) -> [Option<Peak>; MAX_PEAKS] {
        match self {
            Material::Lobes(lobes) => lobes.peaks(),
            Material::Callback(callback) => [callback.peak, None, None, None],
        }
    }

    #[inline(always)]
    fn eval<F: Lanes>(&mut self, wi: &[Asked<F>], f_cos: &mut [F]) -> Result<()> {
        match self {
            Material::Lobes(lobes) => lobes.eval(wi, f_cos),
            Material::Callback(callback) => callback.eval(wi, f_cos),
        }
    }
}

impl Callback {
    #[inline(never)]
    fn eval<F: Lanes>(&mut self, wi: &[Asked<F>], f_cos: &mut [F]) -> Result<()> {
        wi.chunks(MOST_GROUPS).zip(f_cos.chunks_mut(MOST_GROUPS)).try_for_each(|(wi, f_cos)| self.call(wi, f_cos))
    }

    /// One call of the client's function.
    fn call<F: Lanes>(&mut self, wi: &[Asked<F>], f_cos: &mut [F]) -> Result<()> {
        let mut directions = [[0.0f32; 3]; MOST_GROUPS * LANES];
        let mut count = 0;
        for Asked { wi, lanes } in wi {
            let [x, y, z] = to_arrays(self.mirrored(*wi).0);
            for (i, ((&x, &y), &z)) in x.iter().zip(&y).zip(&z).enumerate() {
                if let Some(slot) = directions.get_mut(count).filter(|_| lanes >> i & 1 == 1) {
                    *slot = [x, y, z];
                    count += 1;
                }
            }
        }
        let mut values = [f32::NAN; MOST_GROUPS * LANES];
        // SAFETY: both arrays hold `count` elements; the function is the client's.
        let answer = unsafe { (self.eval)(self.user, count, directions.as_ptr().cast(), values.as_mut_ptr()) };
        let mut values = values.into_iter().take(count);
        for (Asked { wi, lanes }, out) in wi.iter().zip(f_cos) {
            let mut eight = [0.0; LANES];
            for (i, slot) in eight.iter_mut().enumerate() {
                if lanes >> i & 1 == 1 {
                    *slot = values.next().unwrap_or(f32::NAN);
                }
            }
            if answer != 0 || !eight.iter().all(|f| (0.0..=f32::MAX).contains(f)) {
                return Err(Status::CallbackFailed);
            }
            let (value, below) = (F::from_array(eight), self.mirrored(*wi).1);
            *out = F::select(below, value * F::splat(-self.share), value);
        }
        Ok(())
    }

    /// Directions, those below a horizon that values continue across as their mirror images; and which these are.
    fn mirrored<F: Lanes>(&self, wi: V3<F>) -> (V3<F>, F::Mask) {
        let Some(normal) = self.hemisphere.filter(|_| self.share > 0.0) else { return (wi, F::mask(0)) };
        let normal = splat(normal.to_array());
        let below = dot(wi, normal).min(F::splat(0.0));
        let twice = below + below;
        let [x, y, z] = [normal[0] * twice, normal[1] * twice, normal[2] * twice];
        ([wi[0] - x, wi[1] - y, wi[2] - z], below.lt(F::splat(0.0)))
    }
}

/// The most groups of eight directions that a client's function is asked for at once.
const MOST_GROUPS: usize = 5;

/// The nodes of a product of so many squares.
fn nodes(squares: u32) -> usize {
    if squares == 0 { 0 } else { 4 * squares as usize + 1 }
}

/// Where the parts of a product's block stand while it is built: header and nodes, then what is needed only to build.
struct Layout {
    room: Room,
    cells: usize,
    priorities: usize,
    slots: usize,
    bytes: usize,
}

impl Settings {
    /// The bytes of a product.
    pub(super) fn bytes(&self) -> Option<usize> {
        Layout::new(self.budget).map(|layout| layout.bytes)
    }
}

impl Layout {
    const NODES: usize = size_of::<Header>().next_multiple_of(WIS_ALIGNMENT);

    fn new(budget: Budget) -> Option<Layout> {
        let room = Room::new(budget.squares)?;
        let cells = (Layout::NODES + room.nodes * size_of::<Node>()).next_multiple_of(WIS_ALIGNMENT);
        let priorities = cells + room.cells * size_of::<Cell>();
        let slots = priorities + room.priorities * size_of::<f32>();
        let bytes = (slots + room.squares * size_of::<u32>()).next_multiple_of(WIS_ALIGNMENT);
        Some(Layout { room, cells, priorities, slots, bytes })
    }

    /// The room that a product is built in.
    ///
    /// # Safety
    /// The block is the caller's to write, and of nobody else while the room lives.
    unsafe fn scratch<'a>(&self, block: &ExclusiveBlock) -> Scratch<'a> {
        // SAFETY: the caller's contract; the parts do not overlap.
        unsafe {
            Scratch {
                nodes: block.slice(Self::NODES, 0, self.room.nodes),
                cells: block.slice(self.cells, 0, self.room.cells),
                priorities: block.slice(self.priorities, 0, self.room.priorities),
                slots: block.slice(self.slots, 0, self.room.squares),
            }
        }
    }
}

/// A configuration that was checked.
pub(super) struct Settings {
    budget: Budget,
    frame: Frame,
    level: Level,
    pub(super) reuse_cone: f32,
    prior: Option<[f32; WIS_PRIOR_CELLS]>,
}

/// Checks a configuration.
///
/// # Safety
/// The pointer is null or points to what the header says.
pub(super) unsafe fn read_config(config: *const ProductConfig, argument: u32) -> Checked<Settings> {
    // SAFETY: the caller's contract.
    unsafe {
        let config = sized(config, argument)?;
        if config.max_squares > WIS_MAX_SQUARES {
            return Err(Failure::fault(Fault::range(c"max_squares"), argument));
        }
        let or = |value: u32, default: u32| if value == 0 { default } else { value };
        let budget = Budget {
            squares: or(config.max_squares, Budget::DEFAULT.squares),
            evaluations: or(config.max_evaluations, Budget::DEFAULT.evaluations),
        };
        if !(0.0..=core::f32::consts::FRAC_PI_2).contains(&config.reuse_cone) {
            return Err(Failure::fault(Fault::range(c"reuse_cone"), argument));
        }
        let frame = frame(config.world_from_map.cast(), argument).map_err(|at| at.of(c"world_from_map"))?;
        let prior = if config.prior.is_null() {
            None
        } else {
            Some(prior::check(config.prior, argument).map_err(|at| at.of(c"prior"))?.weights())
        };
        let level = level(config.cpu_level, argument).map_err(|at| at.of(c"cpu_level"))?;
        Ok(Settings { budget, frame, level, reuse_cone: config.reuse_cone, prior })
    }
}

/// The building of a product, on any lanes.
struct Building<'a, 'c, 'm> {
    environment: &'a kernel::Environment<'a>,
    frame: &'a Frame,
    material: &'a mut Material<'m>,
    options: Options,
    scratch: &'a mut Scratch<'c>,
}

impl Kernel for Building<'_, '_, '_> {
    type Output = Result<Built>;

    #[inline(always)]
    fn run<F: Lanes>(self) -> Result<Built> {
        product::build::<F, Material>(self.environment.light(), self.frame, self.material, &self.options, self.scratch)
    }
}

/// Prepares a product for any BRDF, which stands before the configuration; `argument` is that one's position.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the block.
pub(super) unsafe fn prepare(
    environment: &kernel::Environment,
    query: Query,
    mut material: Material,
    (settings, argument): (&Settings, u32),
    (memory, bytes): (*mut c_void, usize),
    product: *mut *const Product,
) -> Checked<()> {
    let &Settings { budget, ref frame, level, reuse_cone, ref prior } = settings;
    // SAFETY: the caller's contract; the parts of the block do not overlap.
    unsafe {
        let layout = Layout::new(budget).ok_or(Failure::new(Status::Overflow, argument))?;
        let block = ExclusiveBlock::new(memory.cast(), bytes, layout.bytes, argument + 1)?;
        let target = out(product, argument + 3)?;
        let mut scratch = layout.scratch(&block);
        let options = Options { budget, reuse: Reuse::new(reuse_cone) };
        let building = Building { environment, frame, material: &mut material, options, scratch: &mut scratch };
        let built = simd::run(level, building).map_err(|status| match status {
            Status::CallbackFailed => Failure::new(status, argument - 1).of(c"eval"),
            _ => Failure::new(status, argument - 1),
        })?;
        let [average, visible] = scratch.finish(built.base, built.squares, prior.as_ref());
        let header = Header {
            magic: MAGIC,
            bytes: (Layout::NODES + nodes(built.squares) * size_of::<Node>()) as u64,
            environment: environment.header.content_id,
            query,
            frame: frame.to_array(),
            average,
            exponent: built.exponent,
            squares: built.squares,
            base: built.base,
            evaluations: built.evaluations,
            reuse_cone,
            visible,
            reserved: [0; 2],
        };
        if let Some(slot) = block.slice::<Header>(0, 0, 1).first_mut() {
            *slot = header;
        }
        target.write(memory.cast_const().cast());
    }
    Ok(())
}
