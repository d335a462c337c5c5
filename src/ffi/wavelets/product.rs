//! Products in C: prepare shading points, describe and estimate them; evaluate a query's BRDF.

pub use crate::wavelets::sampler::ProductInfo;

use crate::ffi::material::ClientTarget;
use crate::ffi::memory::{block_mut, handle};
use crate::ffi::strided::{Strided, StridedMut};
use crate::ffi::wavelets::environment::{Environment, view};
use crate::ffi::wavelets::table::{Table, lobes_of};
use crate::ffi::{Checked, Diagnostic, MemorySize, answer, frame, out, put, put_size, require, sized, slice_mut};
use crate::object::Size;
use crate::sphere::{Frame, unit};
use crate::status::{Error, Status};
use crate::wavelets::callback::{Callback, Material};
use crate::wavelets::environment::{self as kernel, WIS_WAVELET_LIGHT_RGB};
use crate::wavelets::product::Budget;
use crate::wavelets::query::Query;
use crate::wavelets::sampler::{self, Header, Prepared};
use core::ffi::{c_int, c_void};
use core::ptr::null_mut;

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
    // SAFETY: the caller's contract; the index is below the count.
    answer(null_mut(), || unsafe {
        let (lobes, channels) = lobes_of((sized(query, 1)?, 1), (table, 2))?.coloured()?;
        let wi = Strided::<3>::new(wi, wi_stride, count, 4)?;
        let f_cos = StridedMut::<3>::new(f_cos, f_cos_stride, count, 6)?;
        let rgb = |wi| lobes.coloured(wi, channels.each_ref());
        for index in 0..count {
            f_cos.write(index, unit(wi.read(index)).map_or([0.0; 3], rgb));
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
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let bytes = sampler::size(read_config(config, 1)?.budget).ok_or(Error::new(Status::Overflow, 1));
        put_size(size, 2, bytes.map(|bytes| Size { bytes, scratch: 0 }))
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
    // SAFETY: the caller's contract; the places of products do not overlap.
    answer(diagnostic, || unsafe {
        let light = view(environment, 1)?;
        let settings = read_config(config, 2)?;
        if count == 0 {
            return Ok(());
        }
        let overflow = Error::new(Status::Overflow, 3);
        let each = sampler::size(settings.budget).ok_or(overflow)?;
        let needed = each.checked_mul(count).filter(|bytes| *bytes <= isize::MAX as usize).ok_or(overflow)?;
        let places = block_mut(memory, bytes, needed, 5)?.chunks_exact_mut(each.max(1));
        let handles = slice_mut(product, count, 7)?;
        for (number, (handle, place)) in handles.iter_mut().zip(places).enumerate() {
            let at = |failure: Error| if failure.argument == 4 { failure.in_row(number) } else { failure };
            // One at a time: after a struct of another size nothing stands where it ought to.
            let query = sized(query.wrapping_add(number), 4).map_err(at)?;
            // Matched where it stands: a copy would lie on the stack of the preparation.
            let mut made = settings.material(query);
            let material = match &mut made {
                Ok(material) => material,
                Err(failure) => return Err(at(*failure)),
            };
            let kept = Some(query).filter(|_| settings.target.is_none());
            let built = sampler::prepare_in(&light, kept, &settings.frame, material, settings.budget, place);
            built.map_err(|status| match status {
                Status::CallbackFailed => Error::new(status, 2).of(c"callback.eval"),
                _ => Error::new(status, 2),
            })?;
            *handle = place.as_ptr().cast();
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
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let prepared = prepared(view(environment, 1)?, product, 2)?;
        sized(info.cast_const(), 3)?;
        put(info, 3, Ok(prepared.info()))
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
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let prepared = prepared(view(environment, 1)?, product, 2)?;
        let target = out(rgb, 4)?;
        let query = &prepared.header.query;
        require(prepared.environment.header.flags & WIS_WAVELET_LIGHT_RGB != 0, Status::NotBuilt, 1)?;
        require(query.size != 0, Status::NotBuilt, 2)?;
        // A tabulated lobe that is asked for without its table.
        let without = |failure: Error| if table.is_null() { Error::new(Status::NotBuilt, 2) } else { failure };
        let (lobes, channels) = lobes_of((query, 2), (table, 3)).map_err(without)?.coloured()?;
        target.write(prepared.estimate_rgb(&lobes, Some(channels.each_ref()))?);
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
    Prepared::view(environment, bytes).ok_or(Error::new(Status::Mismatch, argument))
}

/// A configuration that was checked.
struct Settings {
    budget: Budget,
    frame: Frame,
    table: *const Table,
    /// The client's BRDF, its peak and its half-angle.
    target: Option<(ClientTarget, ([f32; 3], f32))>,
}

/// Checks a configuration.
///
/// # Safety
/// The pointer is null or points to what the header says.
unsafe fn read_config(config: *const ProductConfig, argument: u32) -> Checked<Settings> {
    // SAFETY: the caller's contract.
    unsafe {
        let config = sized(config, argument)?;
        Error::first([(config.max_squares <= WIS_MAX_SQUARES, c"max_squares"), (config.reserved == 0, c"reserved")])
            .map_err(|error| error.instead(argument))?;
        let or = |value: u32, default: u32| if value == 0 { default } else { value };
        let budget = Budget {
            squares: or(config.max_squares, Budget::DEFAULT.squares),
            evaluations: or(config.max_evaluations, Budget::DEFAULT.evaluations),
        };
        let frame = frame(config.world_from_map.cast(), argument).map_err(|at| at.of(c"world_from_map"))?;
        let target = if config.callback.is_null() { None } else { Some(read_callback(config.callback, argument)?) };
        Ok(Settings { budget, frame, table: config.table, target })
    }
}

/// Checks a client's BRDF.
///
/// # Safety
/// The pointer is null or points to what the header says.
unsafe fn read_callback(callback: *const CallbackBrdf, argument: u32) -> Checked<(ClientTarget, ([f32; 3], f32))> {
    // SAFETY: the caller's contract.
    let given = unsafe { sized(callback, argument) }.map_err(|at| at.of(c"callback"))?;
    let none = Error::new(Status::NullPointer, argument).of(c"callback.eval");
    let target = ClientTarget::new(given.eval, given.user).ok_or(none)?;
    let half_angles = 0.0..=core::f32::consts::FRAC_PI_2 + 1e-6;
    Error::first([(half_angles.contains(&given.half_angle), c"callback.half_angle")])
        .map_err(|error| error.instead(argument))?;
    if given.half_angle > 0.0 && unit(given.peak).is_none() {
        return Err(Error::transform(c"callback.peak").instead(argument));
    }
    Ok((target, (given.peak, given.half_angle)))
}

impl Settings {
    /// What a product is prepared for. Of the configuration, argument 2, and a query, argument 4. By itself, so that what it works in is
    /// not on the stack of the preparation.
    ///
    /// # Safety
    /// The table is null or what the header says.
    #[inline(never)]
    unsafe fn material<'a>(&'a self, query: &'a Query) -> Checked<Material<'a>> {
        match &self.target {
            Some((target, peak)) => {
                let callback = Callback::new(target, *peak, query).map_err(|error| error.instead(4))?;
                Ok(Material::Callback(callback))
            }
            // SAFETY: the caller's contract.
            None => Ok(Material::Lobes(unsafe { lobes_of((query, 4), (self.table, 2))? }.lobes)),
        }
    }
}
