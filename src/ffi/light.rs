//! The environment in C.

mod build;
pub(in crate::ffi) mod request;
pub(in crate::ffi) mod rows;

use super::{
    Checked, Diagnostic, DividedBlock, Failure, MemorySize, SharedBlock, WIS_ALIGNMENT, answer, borrow, frame, out,
    sized, slice,
};
use crate::light::chart::Layout;
use crate::light::environment::{Environment, Header, turn};
use crate::light::plan::Filter;
use crate::status::Status;
use build::{Build, PASSES, sizes};
use core::ffi::c_void;
use core::ptr::null_mut;
use request::read_config;

/// Columns are the azimuth phi = 2 pi (x + 1/2) / width, rows the polar angle theta = pi (y + 1/2) / height from +z;
/// the direction is (sin theta cos phi, sin theta sin phi, cos theta).
pub const WIS_LAYOUT_LATLONG: u32 = 1;
/// Six square faces below one another, +x -x +y -y +z -z, each as OpenGL orients it; height = 6 width.
pub const WIS_LAYOUT_CUBE: u32 = 2;
/// The equal-area octahedral square (Clarberg 2008): +z in the centre, -z in the corners, columns along x, rows
/// along y; height = width.
pub const WIS_LAYOUT_OCTAHEDRAL: u32 = 3;

/// 32-bit floats.
pub const WIS_FORMAT_F32: u32 = 1;
/// 16-bit floats.
pub const WIS_FORMAT_F16: u32 = 2;

/// You interpolate between texel centres along both axes. Lat-long maps wrap in azimuth and mirror over the poles, faces of a
/// cube and edges of an octahedral map join.
pub const WIS_FILTER_BILINEAR: u32 = 0;
/// You take the texel that holds the direction.
pub const WIS_FILTER_NEAREST: u32 = 1;

/// Lat-long only: the first and the last row of texels lie at the poles, so theta = pi y / (height - 1).
pub const WIS_ENVIRONMENT_ROWS_AT_POLES: u32 = 1;
/// Black texels get pdf 0. Otherwise no texel counts as darker than 2^-16 of the mean, and every direction has a pdf above 0.
pub const WIS_ENVIRONMENT_EXACT_ZERO: u32 = 2;
/// The distribution is compensated (Karlik et al. 2019): proportional to max(L - mean, L / 64) instead of L. For path tracers, where
/// BSDF rays bring the light up to the mean (see wis_direct), and for multiple importance sampling with BSDF samples.
pub const WIS_ENVIRONMENT_COMPENSATED: u32 = 4;
/// Bad texels are replaced and counted instead of rejected: NaN, -Inf and negative channels by 0, a texel with
/// +Inf by the largest finite luminance of the map.
pub const WIS_ENVIRONMENT_SANITISE: u32 = 8;

/// No products will be prepared with it, nor shared by hits, nor used for several rays: 34 kB less. wis_product_prepare answers WIS_NOT_BUILT.
pub const WIS_ENVIRONMENT_LIGHT_ONLY: u32 = 16;

const ALL_FLAGS: u32 = WIS_ENVIRONMENT_ROWS_AT_POLES
    | WIS_ENVIRONMENT_EXACT_ZERO
    | WIS_ENVIRONMENT_COMPENSATED
    | WIS_ENVIRONMENT_SANITISE
    | WIS_ENVIRONMENT_LIGHT_ONLY;

/// An environment map as a distribution of directions: bytes in your memory without pointers, so it may be copied (to any block
/// aligned to WIS_ALIGNMENT), saved and mapped. Constant once built, but for wis_environment_turn; any number of threads may
/// use it at once. Nothing to free.
#[allow(missing_debug_implementations)]
pub struct EnvironmentObject {
    _opaque: [u8; 0],
}

/// Gives row `y` in the format of the configuration. The bytes must stay as they are until the next call on the same
/// thread. Null stops the build with WIS_CALLBACK_FAILED.
pub type RowFn = Option<unsafe extern "C" fn(user: *mut c_void, y: u32) -> *const c_void>;

/// The map, and what to build from it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct LightConfig {
    /// sizeof(wis_environment_config).
    pub size: u32,
    /// WIS_LAYOUT_*.
    pub layout: u32,
    /// Texels in a row, 1 to 32768; any number, also odd.
    pub width: u32,
    /// Rows, 1 to 32768; of a cube map all six faces.
    pub height: u32,
    /// 1 (luminance), 3 (RGB) or 4 (RGB and an alpha that is ignored); linear Rec. 709 radiance.
    pub channels: u32,
    /// WIS_FORMAT_*.
    pub format: u32,
    /// WIS_FILTER_*: how you look the map up.
    pub filter: u32,
    /// WIS_ENVIRONMENT_*, or 0.
    pub flags: u32,
    /// The relative standard deviation of radiance / pdf that coarser tables may add, 0 to 1. 0 keeps every texel. 0.01 makes a
    /// smooth sky take kilobytes.
    pub error_budget: f32,
    /// The first texel of row 0, or null if `row` gives the rows. Aligned to its format, 4 or 2 bytes; the rows of `row` need
    /// no alignment.
    pub pixels: *const c_void,
    /// Bytes from a row to the next, may be negative: a multiple of the bytes of a channel, at least a row. 0: rows stand
    /// close together.
    pub row_stride: isize,
    /// Used if `pixels` is null; called from each thread that runs the first pass.
    pub row: RowFn,
    /// Handed to `row`.
    pub row_user: *mut c_void,
    /// A row-major 3x3 rotation or reflection, world = M map, within 1e-4; null is the identity. Copied.
    pub world_from_map: *const f32,
}

/// What was built.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct LightInfo {
    /// sizeof(wis_environment_info), set by the caller.
    pub size: u32,
    /// WIS_LAYOUT_*.
    pub layout: u32,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// WIS_FILTER_*.
    pub filter: u32,
    /// WIS_ENVIRONMENT_*, but for WIS_ENVIRONMENT_SANITISE.
    pub flags: u32,
    /// Bytes of the environment: that much of the block is in use and needs to be saved.
    pub bytes: u64,
    /// Texels that were replaced.
    pub sanitised: u64,
    /// Tells environments apart: a hash of the bytes, also of world_from_map.
    pub content_id: u64,
    /// The integral of what the pdf is proportional to over the sphere: of luminance (of what compensation leaves of it), in the
    /// unit of the map times steradian.
    pub power: f64,
    /// The mean luminance over the sphere, in the unit of the map.
    pub mean: f64,
    /// The share of the light that the brightest texel gives, 0 to 1.
    pub largest_share: f64,
    /// The relative standard deviation of radiance / pdf that the error budget added.
    pub error: f64,
}

/// The environment behind a pointer.
///
/// # Safety
/// The pointer is null or points to an environment that this version built or opened, or to memory as long as its header;
/// nobody writes it while the result lives.
#[inline(always)]
pub(super) unsafe fn environment<'a>(pointer: *const EnvironmentObject, argument: u32) -> Checked<Environment<'a>> {
    // SAFETY: the caller's contract.
    let header = unsafe { borrow(pointer.cast::<Header>(), argument)? };
    if pointer.addr() % WIS_ALIGNMENT != 0 {
        return Err(Failure::new(Status::Misaligned, argument));
    }
    let mismatch = Failure::new(Status::Mismatch, argument);
    let bytes = header.length().ok_or(mismatch)?;
    // SAFETY: an environment of this version is as long as its header says.
    let bytes = unsafe { core::slice::from_raw_parts(pointer.cast::<u8>(), bytes) };
    Environment::view(bytes).ok_or(mismatch)
}

/// Measures the memory of a build: bytes of the environment, exactly without an error budget and at most with one, and bytes of
/// scratch memory. A map of 1024 x 512 needs 2.4 MB (WIS_FILTER_NEAREST: 1.2 MB) and 2.4 MB of scratch. Reads no pixels; costs
/// about 15 us. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_size(
    config: *const LightConfig,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        let (request, _) = unsafe { read_config(config)? };
        let target = out(size, 2)?;
        let (bytes, scratch_bytes) = sizes(&request)?;
        // SAFETY: checked by `out`.
        unsafe { target.write(MemorySize { bytes, align: WIS_ALIGNMENT, scratch_bytes }) };
        Ok(())
    })
}

/// Builds an environment on one thread. `memory`: where the environment goes; a multiple of 64 as its address makes look-ups
/// from cold caches cheaper. `scratch`: may be freed afterwards. `environment` receives the handle, which is the address of
/// `memory`. WIS_INVALID_TEXEL: the diagnostic names column and row. WIS_MEMORY_TOO_SMALL: the diagnostic tells the bytes that
/// are needed; an error budget needs fewer than wis_environment_size says. A map of 1024 x 512 RGB floats costs 10 to 15 ms,
/// with an error budget 0.1 s. Work: texels.
///
/// # Safety
/// Pointers are null or point to what the header says; blocks are as long as stated and nobody else uses them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_init(
    config: *const LightConfig,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    environment: *mut *const EnvironmentObject,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract; this call does all passes, one after the other.
        unsafe {
            let (request, rows) = read_config(config)?;
            // How long the block must be is known only when grids are chosen.
            DividedBlock::new(memory.cast(), bytes, 0, 2)?;
            let handle = out(environment, 6)?;
            let build = Build::begin(request, scratch, scratch_bytes, 4)?;
            for (pass, count) in build.items().into_iter().enumerate() {
                build.run(&rows, (memory, bytes), pass, 0..count)?;
            }
            build.finish(memory, bytes)?;
            handle.write(memory.cast_const().cast());
        }
        Ok(())
    })
}

/// Begins a build that threads share. `items` receives the number of items of each of three passes: rows of texels; cells, whose
/// tables are chosen; cells, whose tables are written. Hand all items of a pass to wis_environment_run, in any portions, on any
/// threads, before those of the next pass; then call wis_environment_finish. However the items are shared, the bytes are those
/// of wis_environment_init. Work: rows.
///
/// # Safety
/// Pointers are null or point to what the header says; `items` to three numbers; nobody else uses the scratch block.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_begin(
    config: *const LightConfig,
    scratch: *mut c_void,
    scratch_bytes: usize,
    items: *mut [u32; 3],
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let (request, _) = read_config(config)?;
            let target = out(items, 4)?;
            let build = Build::begin(request, scratch, scratch_bytes, 2)?;
            target.write(build.items());
        }
        Ok(())
    })
}

/// Works on `count` items of a pass, from item `first` on. Threads may call this at once for different items. `config`: that of
/// wis_environment_begin. `memory`: used by pass 2 only, null before; the same block in all calls of pass 2 and in
/// wis_environment_finish. If it is too short, the diagnostic tells the bytes that are needed, and pass 2 may be run again.
/// `pass`: 0, 1 or 2. WIS_MISMATCH if an earlier pass is not done. Work: texels of the items.
///
/// # Safety
/// Pointers are null or point to what the header says; no other thread works on the same items.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_run(
    config: *const LightConfig,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    pass: u32,
    first: u32,
    count: u32,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let (request, rows) = read_config(config)?;
            let invalid = |argument| Failure::new(Status::InvalidArgument, argument);
            let build = Build::go_on(request, scratch, scratch_bytes, 4)?;
            let pass = pass as usize;
            let available = build.items().get(pass).copied().ok_or(invalid(6))?;
            let left = available.checked_sub(first).ok_or(invalid(7))?;
            if count > left {
                return Err(invalid(8));
            }
            build.require_before(pass)?;
            build.run(&rows, (memory, bytes), pass, first..first + count)
        }
    })
}

/// Ends a build whose three passes are done (WIS_MISMATCH before). `memory`: the block of pass 2. `environment` receives the
/// handle. Costs about 1 ms for a map of 1024 x 512. Work: texels.
///
/// # Safety
/// As wis_environment_init; no thread is still at work on the build.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_finish(
    config: *const LightConfig,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    environment: *mut *const EnvironmentObject,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let (request, _) = read_config(config)?;
            let handle = out(environment, 6)?;
            let build = Build::go_on(request, scratch, scratch_bytes, 4)?;
            build.require_before(PASSES)?;
            build.finish(memory, bytes)?;
            handle.write(memory.cast_const().cast());
        }
        Ok(())
    })
}

/// Opens bytes that an earlier build wrote: copied, or mapped from a file. `bytes`: as many as wis_environment_info says, or more.
/// `environment` receives the handle, which is the address of `memory`. WIS_CORRUPT if a byte was changed. Reads all bytes once:
/// 1 ms for a map of 1024 x 512. Work: bytes.
///
/// # Safety
/// Pointers are null or point to what the header says; the bytes do not change while the environment is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_open(
    memory: *const c_void,
    bytes: usize,
    environment: *mut *const EnvironmentObject,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let handle = out(environment, 3)?;
            let length = length(memory.cast(), bytes, Status::Corrupt)?;
            Environment::open(slice(memory.cast::<u8>(), length, 1)?).map_err(|status| Failure::new(status, 1))?;
            handle.write(memory.cast());
        }
        Ok(())
    })
}

/// Describes an environment. Set `info->size` before. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_describe(
    environment: *const EnvironmentObject,
    info: *mut LightInfo,
) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let environment = self::environment(environment, 1)?;
            sized(info.cast_const(), 2)?;
            info.write(describe(&environment));
        }
        Ok(())
    })
}

/// Turns an environment in place; nothing is rebuilt. `memory`: the environment, which no other thread may use meanwhile.
/// `world_from_map`: replaces the former one; a row-major 3x3 rotation or reflection, world = M map, within 1e-4; null is the
/// identity. `environment` receives the handle. The content id changes: products that were prepared before answer
/// WIS_MISMATCH. A call that fails changes nothing. Costs less than 0.1 us. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_turn(
    memory: *mut c_void,
    bytes: usize,
    world_from_map: *const [f32; 9],
    environment: *mut *const EnvironmentObject,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let handle = out(environment, 4)?;
            let frame = frame(world_from_map, 3)?;
            let length = length(memory.cast_const().cast(), bytes, Status::Mismatch)?;
            turn(super::slice_mut(memory.cast::<u8>(), length, 1)?, &frame);
            handle.write(memory.cast_const().cast());
        }
        Ok(())
    })
}

/// The length of the environment that begins a block, which is argument 1; `other` if none does.
///
/// # Safety
/// The block is null or as long as stated.
unsafe fn length(memory: *const u8, bytes: usize, other: Status) -> Checked<usize> {
    let block = SharedBlock::new(memory, bytes, size_of::<Header>(), 1)?;
    // SAFETY: the caller's contract.
    let header = unsafe { block.slice::<Header>(0, 0, 1) }.first();
    let length = header.and_then(Header::length).ok_or(Failure::new(other, 1))?;
    if length > bytes { Err(Failure::too_small(1, length)) } else { Ok(length) }
}

fn describe(environment: &Environment<'_>) -> LightInfo {
    let (header, of) = (environment.header(), environment.description());
    let flag = |on: bool, flag: u32| if on { flag } else { 0 };
    LightInfo {
        size: size_of::<LightInfo>() as u32,
        layout: match of.layout {
            Layout::LatLong => WIS_LAYOUT_LATLONG,
            Layout::Cube => WIS_LAYOUT_CUBE,
            Layout::Octahedral => WIS_LAYOUT_OCTAHEDRAL,
        },
        width: of.width,
        height: of.height,
        filter: if of.filter == Filter::Bilinear { WIS_FILTER_BILINEAR } else { WIS_FILTER_NEAREST },
        flags: flag(of.rows_at_poles, WIS_ENVIRONMENT_ROWS_AT_POLES)
            | flag(of.exact_zero, WIS_ENVIRONMENT_EXACT_ZERO)
            | flag(of.compensated, WIS_ENVIRONMENT_COMPENSATED)
            | flag(of.light_only, WIS_ENVIRONMENT_LIGHT_ONLY),
        bytes: header.bytes,
        sanitised: header.sanitised,
        content_id: header.content_id,
        power: header.power,
        mean: header.mean,
        largest_share: header.largest_share,
        error: header.error,
    }
}
