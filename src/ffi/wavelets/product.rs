//! Products in C: prepare shading points, describe and estimate them; evaluate a query's BRDF.

use crate::ffi::memory::{block_mut, handle};
use crate::ffi::wavelets::environment::{Environment, view};
use crate::ffi::wavelets::table::{Table, lobes_of};
use crate::ffi::{
    Checked, Diagnostic, Failure, MemorySize, Strided, StridedMut, WIS_ALIGNMENT, answer, frame, out, sized, slice_mut,
};
use crate::simd::{LANES, Lanes};
use crate::sphere::vector::{V3, dot, splat, to_arrays};
use crate::sphere::{Frame, unit};
use crate::status::{Fault, Result, Status};
use crate::wavelets::environment::{self as kernel, WIS_WAVELET_LIGHT_RGB};
use crate::wavelets::lobe::{Asked, Brdf, Lobes, MAX_PEAKS, Peak, share_of_lobe};
use crate::wavelets::product::Budget;
use crate::wavelets::query::{Query, WIS_WAVELET_QUERY_WHOLE_SPHERE};
use crate::wavelets::sampler::{self, Header, Prepared};
use core::ffi::{c_int, c_void};
use core::ptr::null_mut;
use glam::Vec3;

/// A prepared shading point: bytes in your memory without pointers, so it may be copied (to any block aligned to
/// WIS_ALIGNMENT) and kept. Every call on it also takes the light that it was prepared with. The same light, query and
/// configuration give the same bytes.
#[allow(missing_debug_implementations)]
pub struct Product {
    _opaque: [u8; 0],
}

/// The most squares that a configuration may ask for.
pub const WIS_MAX_SQUARES: u32 = 4096;

/// Evaluates the luminance of BRDF x cosine (at least 0, finite) for `count` world directions, at most 40, three floats each.
/// Where the BRDF is 0 outside a hemisphere, and not narrow, directions outside are asked for as their mirror images inside.
/// Returns 0; anything else stops the preparation with WIS_CALLBACK_FAILED.
pub type BrdfBatchFn =
    Option<unsafe extern "C" fn(user: *mut c_void, count: usize, wi: *const f32, f_cos: *mut f32) -> c_int>;

/// A BRDF that the client evaluates. It is called only while products are prepared.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CallbackBrdf {
    /// sizeof(wis_wavelet_callback).
    pub size: u32,
    /// The half-angle of the narrow lobe in radians, 0 to pi/2; 0: no narrow lobe.
    pub half_angle: f32,
    /// The direction about which a narrow lobe is concentrated, unit length. Read if half_angle is above 0.
    pub peak: [f32; 3],
    /// Always 0.
    pub reserved: u32,
    /// The BRDF.
    pub eval: BrdfBatchFn,
    /// Handed to `eval`.
    pub user: *mut c_void,
}

/// What a preparation may spend, how the map is turned, and what lobes alone do not say. Everything is read during the call.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ProductConfig {
    /// sizeof(wis_wavelet_product_config).
    pub size: u32,
    /// Inner nodes of the product's tree, 1 to WIS_MAX_SQUARES; 0: 128. Bounds memory and time.
    pub max_squares: u32,
    /// BRDF evaluations besides those of the 64 squares at most that narrow lobes ask for; 0: 66 for Lambert's lobes alone,
    /// 146 with a table or for a callback with a peak, else 106. At least 66 are spent.
    pub max_evaluations: u32,
    /// Always 0.
    pub reserved: u32,
    /// A row-major 3x3 rotation or reflection, world = M map, within 1e-4; null is the identity.
    pub world_from_map: *const f32,
    /// What lobes of the kind WIS_WAVELET_LOBE_TABLE mean; null: there are none. Densities are above 0 wherever the true BRDF
    /// may be, however coarse the table is.
    pub table: *const Table,
    /// The BRDF in place of the queries' lobes; of a query, `normal` and WIS_WAVELET_QUERY_WHOLE_SPHERE are then read. Null: lobes.
    pub callback: *const CallbackBrdf,
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
    /// The content id of the light.
    pub environment: u64,
    /// An approximation of the integral over directions of luminance x luminance of BRDF x cosine, without visibility, in the
    /// units of the map. A ratio or control variate that uses it inherits its error.
    pub estimate: f64,
}

/// Evaluates RGB of BRDF x cosine of a query for `count` directions of unit length (0 for others): what its lobes and the table,
/// which may be null, mean. Strides in bytes, 0: packed. Work: count x lobes x depth of the slices.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_query_eval(
    query: *const Query,
    table: *const Table,
    count: usize,
    wi: *const f32,
    wi_stride: usize,
    f_cos: *mut f32,
    f_cos_stride: usize,
) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract; the index is below the count.
        unsafe {
            let (lobes, channels) = lobes_of((sized(query, 1)?, 1), (table, 2))?.coloured()?;
            let wi = Strided::<3>::new(wi, wi_stride, count, 4)?;
            let f_cos = StridedMut::<3>::new(f_cos, f_cos_stride, count, 6)?;
            let rgb = |wi| lobes.coloured(wi, channels.each_ref());
            for index in 0..count {
                f_cos.write(index, unit(wi.read(index)).map_or([0.0; 3], rgb));
            }
        }
        Ok(())
    })
}

/// Measures the memory of a product; there is no scratch memory. Work: constant.
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
            let Settings { budget, .. } = read_config(config, 1)?;
            let target = out(size, 2)?;
            let bytes = sampler::size(budget).ok_or(Failure::new(Status::Overflow, 1))?;
            target.write(MemorySize { bytes, align: WIS_ALIGNMENT, scratch_bytes: 0 });
        }
        Ok(())
    })
}

/// Prepares the products of a light and `count` shading points. `memory`: `count` times the bytes of wis_wavelet_product_size.
/// `product` receives `count` handles. A query without lobes, or light and lobes that do not meet, give a product whose samples
/// have pdf 0. On failure, products before the query at fault, whose number is the diagnostic's `y`, are whole. Costs 1 us for
/// Lambert's lobes to 6 us for narrow ones each. Work: count x (squares + evaluations) x lobes.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the block.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_prepare(
    environment: *const Environment,
    config: *const ProductConfig,
    count: usize,
    query: *const Query,
    memory: *mut c_void,
    bytes: usize,
    product: *mut *const Product,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract; the places of products do not overlap.
        unsafe {
            let light = view(environment, 1)?;
            let settings = read_config(config, 2)?;
            if count == 0 {
                return Ok(());
            }
            let overflow = Failure::new(Status::Overflow, 3);
            let each = sampler::size(settings.budget).ok_or(overflow)?;
            let needed = each.checked_mul(count).filter(|bytes| *bytes <= isize::MAX as usize).ok_or(overflow)?;
            let places = block_mut(memory, bytes, needed, 5)?.chunks_exact_mut(each.max(1));
            let handles = slice_mut(product, count, 7)?;
            for (number, (handle, place)) in handles.iter_mut().zip(places).enumerate() {
                let at = |failure: Failure| if failure.argument() == 4 { failure.in_row(4, number) } else { failure };
                // One at a time: after a struct of another size nothing stands where it ought to.
                let query = sized(query.wrapping_add(number), 4).map_err(at)?;
                // Matched where it stands: a copy would lie on the stack of the preparation.
                let mut made = settings.material(query);
                let material = match &mut made {
                    Ok(material) => material,
                    Err(failure) => return Err(at(*failure)),
                };
                let kept = Some(query).filter(|_| settings.callback.is_none());
                let built = sampler::prepare_in(&light, kept, &settings.frame, material, settings.budget, place);
                built.map_err(|status| match status {
                    Status::CallbackFailed => Failure::new(status, 2).of(c"callback.eval"),
                    _ => Failure::new(status, 2),
                })?;
                *handle = place.as_ptr().cast();
            }
        }
        Ok(())
    })
}

/// Tells what a product is made of, and the approximation of its integral. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_describe(
    environment: *const Environment,
    product: *const Product,
    info: *mut ProductInfo,
) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let prepared = prepared(view(environment, 1)?, product, 2)?;
            sized(info.cast_const(), 3)?;
            let header = prepared.header;
            info.write(ProductInfo {
                size: size_of::<ProductInfo>() as u32,
                squares: header.squares,
                leaves: if header.squares == 0 { 0 } else { 3 * header.squares + 1 },
                evaluations: header.evaluations,
                bytes: header.bytes,
                environment: header.environment,
                estimate: prepared.estimate(),
            });
        }
        Ok(())
    })
}

/// Approximates the integral of radiance x BRDF x cosine in RGB. `table`: the one that the product was prepared with, whose
/// colours count, or null. WIS_NOT_BUILT without WIS_WAVELET_LIGHT_RGB, and for the product of a callback. Costs a BRDF
/// evaluation for each leaf. Work: squares x lobes.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_product_estimate_rgb(
    environment: *const Environment,
    product: *const Product,
    table: *const Table,
    rgb: *mut [f64; 3],
) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let prepared = prepared(view(environment, 1)?, product, 2)?;
            let target = out(rgb, 4)?;
            if prepared.environment.header.flags & WIS_WAVELET_LIGHT_RGB == 0 {
                return Err(Failure::new(Status::NotBuilt, 1));
            }
            let query = &prepared.header.query;
            if query.size == 0 {
                return Err(Failure::new(Status::NotBuilt, 2));
            }
            // A tabulated lobe that is asked for without its table.
            let without = |failure: Failure| if table.is_null() { Failure::new(Status::NotBuilt, 2) } else { failure };
            let (lobes, channels) = lobes_of((query, 2), (table, 3)).map_err(without)?.coloured()?;
            target.write(prepared.estimate_rgb(&lobes, Some(channels.each_ref()))?);
        }
        Ok(())
    })
}

/// The product behind a handle.
///
/// # Safety
/// The handle is null or points to a product that this version prepared.
#[inline(always)]
pub(super) unsafe fn prepared<'a>(
    environment: kernel::Environment<'a>,
    product: *const Product,
    argument: u32,
) -> Checked<Prepared<'a>> {
    // SAFETY: the caller's contract.
    let bytes = unsafe { handle(product.cast(), Header::length, argument)? };
    Prepared::view(environment, bytes).ok_or(Failure::new(Status::Mismatch, argument))
}

/// A configuration that was checked.
struct Settings {
    budget: Budget,
    frame: Frame,
    table: *const Table,
    callback: Option<CallbackBrdf>,
}

/// Checks a configuration.
///
/// # Safety
/// The pointer is null or points to what the header says.
unsafe fn read_config(config: *const ProductConfig, argument: u32) -> Checked<Settings> {
    // SAFETY: the caller's contract.
    unsafe {
        let config = sized(config, argument)?;
        let invalid = |field| Failure::fault(Fault::range(field), argument);
        if config.max_squares > WIS_MAX_SQUARES {
            return Err(invalid(c"max_squares"));
        }
        if config.reserved != 0 {
            return Err(invalid(c"reserved"));
        }
        let or = |value: u32, default: u32| if value == 0 { default } else { value };
        let budget = Budget {
            squares: or(config.max_squares, Budget::DEFAULT.squares),
            evaluations: or(config.max_evaluations, Budget::DEFAULT.evaluations),
        };
        let frame = frame(config.world_from_map.cast(), argument).map_err(|at| at.of(c"world_from_map"))?;
        let mut callback = None;
        if !config.callback.is_null() {
            let given = *sized(config.callback, argument).map_err(|at| at.of(c"callback"))?;
            if given.eval.is_none() {
                return Err(Failure::new(Status::NullPointer, argument).of(c"callback.eval"));
            }
            if !(0.0..=core::f32::consts::FRAC_PI_2 + 1e-6).contains(&given.half_angle) {
                return Err(invalid(c"callback.half_angle"));
            }
            if given.half_angle > 0.0 && unit(given.peak).is_none() {
                return Err(Failure::fault(Fault::transform(c"callback.peak"), argument));
            }
            callback = Some(given);
        }
        Ok(Settings { budget, frame, table: config.table, callback })
    }
}

impl Settings {
    /// What a product is prepared for. Of the configuration, argument 2, and a query, argument 4. By itself, so that what it works in is
    /// not on the stack of the preparation.
    ///
    /// # Safety
    /// The table is null or what the header says.
    #[inline(never)]
    unsafe fn material<'a>(&self, query: &'a Query) -> Checked<Material<'a>> {
        match &self.callback {
            Some(callback) => Ok(Material::Callback(Callback::new(callback, query)?)),
            None => {
                // SAFETY: the caller's contract.
                let lobes = unsafe { lobes_of((query, 4), (self.table, 2))? }.lobes;
                Ok(Material::Lobes(lobes))
            }
        }
    }
}

/// The client's BRDF.
struct Callback {
    hemisphere: Option<Vec3>,
    peak: Option<Peak>,
    /// Which share of the BRDF is continued below the horizon.
    share: f32,
    eval: unsafe extern "C" fn(*mut c_void, usize, *const f32, *mut f32) -> c_int,
    user: *mut c_void,
}

impl Callback {
    fn new(brdf: &CallbackBrdf, query: &Query) -> Checked<Callback> {
        let eval = brdf.eval.ok_or(Failure::new(Status::NullPointer, 2).of(c"callback.eval"))?;
        let whole = query.flags & WIS_WAVELET_QUERY_WHOLE_SPHERE != 0;
        if query.flags & !WIS_WAVELET_QUERY_WHOLE_SPHERE != 0 {
            return Err(Failure::fault(Fault::range(c"flags"), 4));
        }
        let normal = unit(query.normal).ok_or(Failure::fault(Fault::transform(c"normal"), 4))?;
        let peak = unit(brdf.peak).filter(|_| brdf.half_angle > 0.0);
        let peak = peak.map(|direction| Peak::disc(direction, brdf.half_angle));
        let hemisphere = if whole { None } else { Some(normal) };
        let share = if whole { 0.0 } else { share_of_lobe(peak) };
        Ok(Callback { hemisphere, peak, share, eval, user: brdf.user })
    }
}

/// What products are prepared for. One type, since each would have its own copy of the preparation.
#[allow(clippy::large_enum_variant)]
enum Material<'a> {
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
