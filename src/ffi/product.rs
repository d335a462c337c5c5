//! Products in C: prepared at shading points, for wis_sample, wis_pdf and wis_invert.

use super::light::{EnvironmentObject, environment as view, exact};
use super::material::{PointData, point as read_point};
use super::memory::{handle, stored_or};
use super::sampler::{SamplerObject, with_level};
use super::{Checked, Diagnostic, MemorySize, answer, check_block, out, put, put_size, sized, slice_mut};
use crate::blob::{self, Size};
use crate::light::environment::Environment;
use crate::product::check;
use crate::product::density::Shaded;
pub use crate::product::info::GridInfo;
use crate::product::prepare::{Config, DIVIDED, Task};
use crate::product::stored::{Header, MAX_DIVIDED, Product, most_bytes};
use crate::status::{Error, Status};
use core::ffi::c_void;
use core::ptr::null_mut;

/// No cell is divided: cheaper to prepare, and worse.
pub const WIS_PRODUCT_UNDIVIDED: u32 = 1;
/// Products get the checksum that wis_product_open asks for: about 0.6 us each.
pub const WIS_PRODUCT_CHECKSUM: u32 = 2;

/// The product of an environment and the BRDF x cosine at a shading point, as a distribution of directions: bytes in your memory
/// without pointers, to be copied (to any block aligned to WIS_ALIGNMENT) and read by any number of threads.
#[allow(missing_debug_implementations)]
pub struct ProductObject {
    _opaque: [u8; 0],
}

/// How products are prepared. Zeros are good choices.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct GridConfig {
    /// sizeof(wis_product_config).
    pub size: u32,
    /// WIS_PRODUCT_*, or 0.
    pub flags: u32,
    /// The most cells of the environment that are divided, 1 to 24; 0: 8.
    pub divided_cells: u32,
    /// How far normals of hits that it serves may turn, in radians, 0 to pi/2. The pdf stays above 0 for them; the integral grows.
    pub cone: f32,
}

#[inline]
fn checked(config: &GridConfig, argument: u32) -> Checked<Config> {
    Error::first([
        (config.flags & !(WIS_PRODUCT_UNDIVIDED | WIS_PRODUCT_CHECKSUM) == 0, c"flags"),
        (config.divided_cells as usize <= MAX_DIVIDED, c"divided_cells"),
        ((0.0..=core::f32::consts::FRAC_PI_2).contains(&config.cone), c"cone"),
    ])
    .map_err(|error| error.instead(argument))?;
    let divided = match config.divided_cells as usize {
        _ if config.flags & WIS_PRODUCT_UNDIVIDED != 0 => 0,
        0 => DIVIDED,
        divided => divided,
    };
    Ok(Config { divided, cone: config.cone })
}

/// Measures the memory of one product at most: 4.0 kB, without division 2.0 kB, with 24 divided cells 8.0 kB. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_product_size(
    config: *const GridConfig,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let config = checked(sized(config, 1)?, 1)?;
        put_size(size, 2, Ok(Size { bytes: most_bytes(config.divided), scratch: 0 }))
    })
}

/// Prepares products at `count` points, one behind the other in `memory`: product i begins `offset[i]` bytes behind it, at a multiple
/// of 16. `bytes_used` receives the bytes of all, which is what needs to be copied. `memory`: `count` times the bytes of
/// wis_product_size. `seed`, `sample` and `bounce` of the points are not read. The number of a bad point stands in `y` of the fault
/// (wis_sampler_fault). WIS_NOT_BUILT for an environment with WIS_ENVIRONMENT_LIGHT_ONLY.
/// About 1 us for Lambert's lobe, 2 us for another wide one, and 4 us where lobes below about 0.12 are tried.
/// Work: count x (lobes + divided cells).
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_product_prepare(
    sampler: *mut SamplerObject,
    environment: *const EnvironmentObject,
    config: *const GridConfig,
    count: usize,
    point: *const PointData,
    memory: *mut c_void,
    bytes: usize,
    offset: *mut usize,
    bytes_used: *mut usize,
) -> Status {
    // SAFETY: the caller's contract, also for what stands inside.
    unsafe {
        with_level(sampler, |level, _| {
            let environment = exact(environment, 2)?;
            let flags = sized(config, 3)?.flags;
            let config = checked(sized(config, 3)?, 3)?;
            let overflow = Error::new(Status::Overflow, 4);
            let needed = most_bytes(config.divided).checked_mul(count).ok_or(overflow)?;
            if isize::try_from(needed).is_err() {
                return Err(overflow);
            }
            if count > 0 {
                sized(point, 5)?;
            }
            check_block(memory.cast(), bytes, needed, 6)?;
            let offsets = slice_mut(offset, count, 8)?;
            let used = out(bytes_used, 9)?;
            let memory = slice_mut(memory.cast::<u8>(), needed, 6)?;
            let mut end = 0;
            for i in 0..count {
                let (data, material) = read_point(point.add(i), 5).map_err(|failure| failure.in_row(i))?;
                let room = memory.get_mut(end..).unwrap_or_default();
                let point = data.kernel(material, None, None, &[]);
                let task = Task { level, environment: &environment, point: &point, config: &config };
                end += task.prepare(None, room).map_err(|error| refused(error, i))?;
            }
            write_offsets(memory, offsets);
            if flags & WIS_PRODUCT_CHECKSUM != 0 {
                check::write_checksums(memory.get_mut(..end).unwrap_or_default());
            }
            used.write(end);
            Ok(())
        })
    }
}

/// Where the products stand that were written one behind the other.
fn write_offsets(memory: &[u8], offsets: &mut [usize]) {
    let mut at = 0;
    for offset in offsets {
        *offset = at;
        let header = memory.get(at..).and_then(blob::header::<Header>);
        at += header.map_or(0, |header| header.bytes as usize);
    }
}

/// Why the point of this number has no product.
fn refused(error: Error, row: usize) -> Error {
    match error.status {
        Status::MemoryTooSmall | Status::Misaligned => error.instead(6),
        Status::NotBuilt => error.instead(2),
        // A lobe's number stands in the row of a single point; of many the point counts.
        _ => error.instead(5).in_row(row),
    }
}

/// Opens bytes of one product that wis_product_prepare wrote with WIS_PRODUCT_CHECKSUM: copied, or read from a file. `bytes`: as many as
/// wis_product_info says, or more. `environment`: the one that it was prepared with, or that one's bytes opened again; WIS_MISMATCH for
/// another. `product` receives the handle, which is the address of `memory`. WIS_CORRUPT if a byte was changed or there is no checksum;
/// with the field `magic` in the diagnostic if another version of wis wrote them. Reads all bytes: about 1.3 us.
/// Work: bytes.
///
/// # Safety
/// Pointers are null or point to what the header says; the bytes do not change while the product is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_product_open(
    environment: *const EnvironmentObject,
    memory: *const c_void,
    bytes: usize,
    product: *mut *const ProductObject,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let environment = view(environment, 1)?;
        let handle = out(product, 4)?;
        let bytes = stored_or(Status::Corrupt, memory, bytes, 2, Header::stored_length)?;
        let at = |status| if status == Status::Corrupt { 2 } else { 1 };
        check::open(bytes, &environment).map_err(|status| Error::new(status, at(status)))?;
        handle.write(memory.cast());
        Ok(())
    })
}

/// Describes a product. WIS_MISMATCH for a product of another environment. Costs about 1 us.
/// Work: divided cells.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_product_describe(
    environment: *const EnvironmentObject,
    product: *const ProductObject,
    info: *mut GridInfo,
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let environment = view(environment, 1)?;
        let (product, light) = (self::product(product, &environment, 2)?, environment.tables());
        sized(info.cast_const(), 3)?;
        put(info, 3, Ok(GridInfo::of(&Shaded::new(&light, product), &environment)))
    })
}

/// Whether a product serves another hit well: 1 in `covers`, else 0. The normal must lie within the cone. Normal and view must also lie within
/// half of the narrowest alpha of the product's, at most 0.1 radians. Lobes must be of the same kinds and about as wide. Weights and f0 may differ as long as no lobe's share
/// of what the hit scatters is more than 1.25 times that at the product. Where `covers` is 1, the pdf is above 0 wherever that hit
/// reflects light. Costs about 100 ns. Work: lobes.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_product_covers(
    product: *const ProductObject,
    point: *const PointData,
    covers: *mut u32,
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let header = opened(product, 1)?.header;
        let (data, material) = read_point(point, 2)?;
        put(covers, 3, Ok(u32::from(header.covers(&data.kernel(material, None, None, &[])))))
    })
}

/// The product behind a pointer.
///
/// # Safety
/// The pointer is null or points to a product, or to memory as long as its header; nobody writes it while the result lives.
#[inline(always)]
unsafe fn opened<'a>(product: *const ProductObject, argument: u32) -> Checked<Product<'a>> {
    // SAFETY: the caller's contract.
    let bytes = unsafe { handle(product.cast(), Header::length, argument)? };
    Product::view(bytes).ok_or(Error::new(Status::Mismatch, argument))
}

/// The product of an environment behind a pointer.
///
/// # Safety
/// As [`opened`].
#[inline(always)]
pub(super) unsafe fn product<'a>(
    product: *const ProductObject,
    environment: &Environment<'_>,
    argument: u32,
) -> Checked<Product<'a>> {
    // SAFETY: the caller's contract.
    let product = unsafe { opened(product, argument)? };
    if product.header.environment == environment.header().content_id {
        Ok(product)
    } else {
        Err(Error::new(Status::Mismatch, argument))
    }
}
