//! Environments in C: build, open, and the environment alone as a distribution.

use super::{
    Block, Checked, Diagnostic, Failure, MemorySize, WIS_ALIGNMENT, answer, borrow, density, frame, out, sized,
};
use crate::descent::Sample;
use crate::environment as kernel;
use crate::environment::{
    Config, Decoded, Format, Grid, Header, Layout, Light, MAGIC, Pixels, RowError, RowSummary, Rows, Storage, Trees,
};
use crate::numeric::ContentHash;
use crate::sphere::Frame;
use crate::status::{Result, Status};
use crate::tree::{Link, MAX_DEPTH, Tree, complete_len};
use core::ffi::c_void;

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

/// Every cell is stored: 16 bytes for four cells, and a third more for the coarser levels.
pub const WIS_STORAGE_PYRAMID: u32 = 1;
/// A wavelet tree pruned to `error_budget`: 24 bytes for each square that is kept.
pub const WIS_STORAGE_SPARSE: u32 = 2;

/// The client looks texels up without filtering: importance is not spread to neighbouring texels.
pub const WIS_ENVIRONMENT_NEAREST: u32 = 1;
/// Black stays black, with density 0. Otherwise no cell is darker than 2^-16 of the mean.
pub const WIS_ENVIRONMENT_EXACT_ZERO: u32 = 2;
/// The compensated distribution is stored too (Karlik et al. 2019): max(L - mean, L / 64).
pub const WIS_ENVIRONMENT_COMPENSATED: u32 = 4;
/// RGB averages are stored too, for wis_product_estimate_rgb: 48 bytes for four cells, and a third more.
pub const WIS_ENVIRONMENT_RGB: u32 = 8;
/// Bad texels are replaced and counted instead of rejected: NaN, -Inf and negative channels by 0, a texel with
/// +Inf by the largest finite luminance of the map.
pub const WIS_ENVIRONMENT_SANITISE: u32 = 16;

/// Proportional to luminance.
pub const WIS_DISTRIBUTION_PLAIN: u32 = 0;
/// Proportional to the luminance above the mean: for multiple importance sampling with the BRDF.
pub const WIS_DISTRIBUTION_COMPENSATED: u32 = 1;

const ALL_FLAGS: u32 = WIS_ENVIRONMENT_NEAREST
    | WIS_ENVIRONMENT_EXACT_ZERO
    | WIS_ENVIRONMENT_COMPENSATED
    | WIS_ENVIRONMENT_RGB
    | WIS_ENVIRONMENT_SANITISE;

/// An environment: bytes in your memory without pointers, so it may be copied (to any block aligned to
/// WIS_ALIGNMENT), saved and mapped. Constant once built; any number of threads may use it at once. Nothing to free.
#[allow(missing_debug_implementations)]
pub struct Environment {
    _opaque: [u8; 0],
}

/// Gives row `y` in the format of the configuration. The bytes must stay as they are until the next call on the same
/// thread. Null stops the build with WIS_CALLBACK_FAILED.
pub type RowFn = Option<unsafe extern "C" fn(user: *mut c_void, y: u32) -> *const c_void>;

/// What to build.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentConfig {
    /// sizeof(wis_environment_config).
    pub size: u32,
    /// WIS_LAYOUT_*.
    pub layout: u32,
    /// Texels in a row, at least 1; any number, also odd.
    pub width: u32,
    /// Rows, at least 1; of a cube map all six faces.
    pub height: u32,
    /// 1 (luminance), 3 (RGB) or 4 (RGB and an alpha that is ignored); linear Rec. 709 radiance.
    pub channels: u32,
    /// WIS_FORMAT_*.
    pub format: u32,
    /// WIS_ENVIRONMENT_*, or 0.
    pub flags: u32,
    /// WIS_STORAGE_*.
    pub storage: u32,
    /// Cells along each side of the octahedral square, a power of two from 1 to 4096; 0: at least as many cells
    /// as texels.
    pub resolution: u32,
    /// Sparse storage: the variance that pruning may add to an estimate of the map's power, relative to its square,
    /// 0 or more (0.01 = 1 %); 0 drops nothing but constant squares.
    pub error_budget: f32,
    /// The first texel of row 0, or null if `row` gives the rows.
    pub pixels: *const c_void,
    /// Bytes from a row to the next, may be negative; 0: rows stand close together.
    pub row_stride: isize,
    /// Used if `pixels` is null; called from each thread that runs the first pass.
    pub row: RowFn,
    /// Handed to `row`.
    pub row_user: *mut c_void,
}

/// What was built.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct EnvironmentInfo {
    /// sizeof(wis_environment_info), set by the caller.
    pub size: u32,
    /// Cells along each side of the square.
    pub resolution: u32,
    /// WIS_STORAGE_*.
    pub storage: u32,
    /// WIS_ENVIRONMENT_*.
    pub flags: u32,
    /// Bytes of the environment: that much of the block is in use and needs to be saved.
    pub bytes: u64,
    /// Squares stored, each the averages of four children.
    pub squares: u64,
    /// Texels that were replaced.
    pub sanitised: u64,
    /// Tells environments apart: a hash of the bytes.
    pub content_id: u64,
    /// The integral of luminance over the sphere, in the units of the map times steradian.
    pub power: f64,
    /// Sparse storage: the variance that pruning added, relative.
    pub error: f64,
}

/// The bytes that an environment needs: exactly for a pyramid, at most for sparse storage (the bytes that are in use
/// stand in wis_environment_info; a block that is too short fails with WIS_MEMORY_TOO_SMALL and tells them, and
/// wis_environment_finish may then be called again).
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_size(
    config: *const EnvironmentConfig,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        let (request, _) = unsafe { read_config(config)? };
        let size = out(size, 2)?;
        let overflow = Failure::new(Status::Overflow, 1);
        let stored = request.stored(request.squares()).ok_or(overflow)?;
        let scratch = Scratch::of(&request).ok_or(overflow)?;
        let needed = MemorySize { bytes: stored.bytes, align: WIS_ALIGNMENT, scratch_bytes: scratch.bytes };
        // SAFETY: checked by `out`.
        unsafe { size.write(needed) };
        Ok(())
    })
}

/// Builds an environment in one call. `info` may be null.
///
/// # Safety
/// Pointers are null or point to what the header says; blocks are as long as stated and nobody else uses them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_init(
    config: *const EnvironmentConfig,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    environment: *mut *const Environment,
    info: *mut EnvironmentInfo,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let (request, rows) = read_config(config)?;
            // Whether the block is long enough for a sparse tree is known only at the end.
            Block::new(memory.cast(), bytes, 0, 2)?;
            check_results(environment, 6, info, 7)?;
            let build = Build::begin(request, scratch, scratch_bytes, 4)?;
            for (pass, count) in (0..).zip(build.rows()) {
                build.run(&rows, pass, 0, count)?;
            }
            build.finish(memory.cast(), bytes, environment, info)
        }
    })
}

/// Begins a build that threads share: for each of the two passes `p`, the rows `0..rows[p]` go to
/// wis_environment_run in any portions, on any threads; all of pass 0 before any of pass 1. The bits do not depend on
/// how the rows were shared.
///
/// # Safety
/// Pointers are null or point to what the header says; `rows` to two numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_begin(
    config: *const EnvironmentConfig,
    scratch: *mut c_void,
    scratch_bytes: usize,
    rows: *mut [u32; 2],
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let (request, _) = read_config(config)?;
            let target = out(rows, 4)?;
            let build = Build::begin(request, scratch, scratch_bytes, 2)?;
            target.write(build.rows());
        }
        Ok(())
    })
}

/// Works on `count` rows of a pass (0 or 1) from row `first` on. The configuration must be that of
/// wis_environment_begin. Threads may call this at once for different rows. WIS_MISMATCH if the second pass comes
/// before the first is done.
///
/// # Safety
/// Pointers are null or point to what the header says; no other thread works on the same rows.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_run(
    config: *const EnvironmentConfig,
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
            let build = Build::go_on(request, scratch, scratch_bytes, 2)?;
            let available = build.rows().get(pass as usize).copied().ok_or(Failure::new(Status::InvalidArgument, 4))?;
            let left = available.checked_sub(first).ok_or(Failure::new(Status::InvalidArgument, 5))?;
            if count > left {
                return Err(Failure::new(Status::InvalidArgument, 6));
            }
            if pass > 0 {
                build.require(pass - 1, 2)?;
            }
            build.run(&rows, pass, first, count)
        }
    })
}

/// Ends a build when both passes are done (WIS_MISMATCH before). `info` may be null.
///
/// # Safety
/// As wis_environment_init; no thread is still at work on the scratch block.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_finish(
    config: *const EnvironmentConfig,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    environment: *mut *const Environment,
    info: *mut EnvironmentInfo,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let (request, _) = read_config(config)?;
            check_results(environment, 6, info, 7)?;
            let build = Build::go_on(request, scratch, scratch_bytes, 4)?;
            build.require(1, 4)?;
            build.finish(memory.cast(), bytes, environment, info)
        }
    })
}

/// Checks bytes that an earlier build wrote (copied, or mapped from a file) and gives them as an environment. Reads
/// all of them once. `info` may be null.
///
/// # Safety
/// Pointers are null or point to what the header says; the bytes do not change while the environment is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_open(
    memory: *const c_void,
    bytes: usize,
    environment: *mut *const Environment,
    info: *mut EnvironmentInfo,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            check_results(environment, 3, info, 4)?;
            let block = Block::new(memory.cast_mut().cast(), bytes, size_of::<Header>(), 1)?;
            let header = block.slice::<Header>(0, 0, 1).first().copied().ok_or(Status::Corrupt)?;
            let corrupt = Failure::new(Status::Corrupt, 1);
            let stored = Stored::of_header(&header).ok_or(corrupt)?;
            if header.bytes != stored.bytes as u64 {
                return Err(corrupt);
            }
            let block = Block::new(memory.cast_mut().cast(), bytes, stored.bytes, 1)?;
            let view = stored.view(&block).ok_or(corrupt)?;
            check_stored(&view).map_err(|_| corrupt)?;
            if stored.padding(&block).iter().any(|link| *link != Link::default()) {
                return Err(corrupt);
            }
            publish(memory.cast(), &header, environment, info);
        }
        Ok(())
    })
}

/// The integral of a distribution over the sphere, in the units of the map times steradian: of luminance, or of what
/// compensation leaves of it. Its radiance over this power is the pdf of a direction, up to the size of a cell.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_power(
    environment: *const Environment,
    distribution: u32,
    power: *mut f64,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let environment = view(environment, 1)?;
            select(&environment, distribution)?;
            let header = environment.header;
            let compensated = distribution == WIS_DISTRIBUTION_COMPENSATED;
            out(power, 3)?.write(if compensated { header.compensated_power() } else { header.power });
        }
        Ok(())
    })
}

/// Samples a direction in proportion to the light alone. `u`: two numbers in [0, 1) (others are moved there, NaN
/// counts as 1/2). `world_from_map`: a row-major 3x3 rotation or reflection, within 1e-4; null is the identity. A
/// black environment gives pdf 0.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_sample(
    environment: *const Environment,
    distribution: u32,
    world_from_map: *const [f32; 9],
    u: *const [f32; 2],
    sample: *mut Sample,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let (light, frame) = light(environment, distribution, world_from_map)?;
            density::sample((&light, &frame), u, sample, 4)
        }
    })
}

/// As `count` calls of wis_environment_sample. Strides are in bytes from one element to the next; 0: packed.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_sample_n(
    environment: *const Environment,
    distribution: u32,
    world_from_map: *const [f32; 9],
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
            let (light, frame) = light(environment, distribution, world_from_map)?;
            density::sample_n((&light, &frame), count, (u, u_stride), (wi, wi_stride), (pdf, pdf_stride), 5)
        }
    })
}

/// The pdf per solid angle of any direction of unit length (within 1e-3): the very bits that a sample came with.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_pdf(
    environment: *const Environment,
    distribution: u32,
    world_from_map: *const [f32; 9],
    wi: *const [f32; 3],
    pdf: *mut f32,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let (light, frame) = light(environment, distribution, world_from_map)?;
            density::pdf((&light, &frame), wi, pdf, 4)
        }
    })
}

/// As `count` calls of wis_environment_pdf; a direction that is not of unit length gets pdf 0.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_pdf_n(
    environment: *const Environment,
    distribution: u32,
    world_from_map: *const [f32; 9],
    count: usize,
    wi: *const f32,
    wi_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract; indices stay below `count`.
        unsafe {
            let (light, frame) = light(environment, distribution, world_from_map)?;
            density::pdf_n((&light, &frame), count, (wi, wi_stride), (pdf, pdf_stride), 5)
        }
    })
}

/// The `u` that leads to a direction. WIS_ZERO_DENSITY if none does.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_invert(
    environment: *const Environment,
    distribution: u32,
    world_from_map: *const [f32; 9],
    wi: *const [f32; 3],
    u: *mut [f32; 2],
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let (light, frame) = light(environment, distribution, world_from_map)?;
            density::invert((&light, &frame), wi, u, 4)
        }
    })
}

/// The density and the frame that the calls on an environment alone work with.
///
/// # Safety
/// Pointers are null or point to what the header says.
unsafe fn light<'a>(
    environment: *const Environment,
    distribution: u32,
    world_from_map: *const [f32; 9],
) -> Checked<(Light<'a>, Frame)> {
    // SAFETY: the caller's contract.
    let environment = unsafe { view(environment, 1)? };
    let tree = select(&environment, distribution)?;
    // SAFETY: the caller's contract.
    Ok((Light(tree), unsafe { frame(world_from_map, 3)? }))
}

/// The tree of a distribution.
fn select<'a>(environment: &kernel::Environment<'a>, distribution: u32) -> Checked<Tree<'a, 4>> {
    match distribution {
        WIS_DISTRIBUTION_PLAIN => Ok(environment.light()),
        WIS_DISTRIBUTION_COMPENSATED if environment.header.flags & WIS_ENVIRONMENT_COMPENSATED != 0 => {
            Ok(environment.compensated())
        }
        WIS_DISTRIBUTION_COMPENSATED => Err(Failure::new(Status::NotBuilt, 2)),
        _ => Err(Failure::new(Status::InvalidArgument, 2)),
    }
}

/// The environment behind a handle.
///
/// # Safety
/// The handle is null or points to an environment that this version built or opened.
#[inline(always)]
pub(super) unsafe fn view<'a>(environment: *const Environment, argument: u32) -> Checked<kernel::Environment<'a>> {
    // SAFETY: the caller's contract; a header is at least aligned.
    let header = unsafe { borrow(environment.cast::<Header>(), argument)? };
    let mismatch = Failure::new(Status::Mismatch, argument);
    if header.magic != MAGIC {
        return Err(mismatch);
    }
    let stored = Stored::of_header(header).ok_or(mismatch)?;
    let block = Block::new(environment.cast_mut().cast(), stored.bytes, stored.bytes, argument)?;
    // SAFETY: the object is as long as its header says.
    unsafe { stored.view(&block).ok_or(mismatch) }
}

/// Checks the pointers to the results of a build.
///
/// # Safety
/// Pointers are null or point to what the header says.
unsafe fn check_results(
    environment: *mut *const Environment,
    environment_argument: u32,
    info: *mut EnvironmentInfo,
    info_argument: u32,
) -> Checked<()> {
    out(environment, environment_argument)?;
    if !info.is_null() {
        // SAFETY: the caller's contract.
        unsafe { sized(info.cast_const(), info_argument)? };
    }
    Ok(())
}

/// Writes the results of a build or an opening.
///
/// # Safety
/// [`check_results`] accepted the pointers.
unsafe fn publish(
    memory: *const Environment,
    header: &Header,
    environment: *mut *const Environment,
    info: *mut EnvironmentInfo,
) {
    // SAFETY: checked before; info may be null.
    unsafe {
        environment.write(memory);
        if !info.is_null() {
            info.write(EnvironmentInfo {
                size: size_of::<EnvironmentInfo>() as u32,
                resolution: 1 << header.depth,
                storage: header.storage,
                flags: header.flags,
                bytes: header.bytes,
                squares: header.squares.into(),
                sanitised: header.sanitised,
                content_id: header.content_id,
                power: header.power,
                error: header.error,
            });
        }
    }
}

/// Checks everything in stored bytes that later calls rely on, and that nothing was changed.
fn check_stored(view: &kernel::Environment) -> Result<()> {
    let header = view.header;
    let tree = |average, squares| match header.storage {
        WIS_STORAGE_SPARSE => Tree::<4>::sparse(header.depth, average, squares, view.links),
        _ => Tree::<4>::complete(header.depth, average, squares),
    };
    tree(header.average, view.squares)?;
    if header.flags & WIS_ENVIRONMENT_COMPENSATED != 0 {
        tree(header.compensated_average, view.compensated)?;
    }
    let mut colours = view.rgb.iter().flatten().chain([&header.rgb_average]).flatten();
    let finite = [header.power, header.error].iter().all(|value| (0.0..=f64::MAX).contains(value))
        && colours.all(|channel| (0.0..=f32::MAX).contains(channel));
    let unchanged = header.reserved == [0; 2] && header.content_id == view.content_id();
    if finite && unchanged { Ok(()) } else { Err(Status::Corrupt) }
}

/// Where the parts of a stored environment stand.
#[derive(Clone, Copy)]
struct Stored {
    squares: usize,
    links: Option<usize>,
    compensated: Option<usize>,
    rgb: Option<usize>,
    count: usize,
    bytes: usize,
}

impl Stored {
    fn new(count: usize, sparse: bool, flags: u32) -> Option<Stored> {
        let mut end = size_of::<Header>();
        let mut part = |bytes_each: usize| {
            let start = end;
            end = count.checked_mul(bytes_each)?.checked_add(start)?.checked_next_multiple_of(WIS_ALIGNMENT)?;
            Some(start)
        };
        let squares = part(size_of::<[f32; 4]>())?;
        let links = if sparse { Some(part(size_of::<Link>())?) } else { None };
        let has = |flag: u32| flags & flag != 0;
        let compensated = if has(WIS_ENVIRONMENT_COMPENSATED) { Some(part(size_of::<[f32; 4]>())?) } else { None };
        let rgb = if has(WIS_ENVIRONMENT_RGB) { Some(part(size_of::<[[f32; 3]; 4]>())?) } else { None };
        if end > isize::MAX as usize {
            return None;
        }
        Some(Stored { squares, links, compensated, rgb, count, bytes: end })
    }

    fn of_header(header: &Header) -> Option<Stored> {
        let storage_known = matches!(header.storage, WIS_STORAGE_PYRAMID | WIS_STORAGE_SPARSE);
        if header.magic != MAGIC || !storage_known || header.depth > MAX_DEPTH || header.flags & !ALL_FLAGS != 0 {
            return None;
        }
        Stored::new(header.squares as usize, header.storage == WIS_STORAGE_SPARSE, header.flags)
    }

    /// The room behind an odd number of links.
    ///
    /// # Safety
    /// As [`Block::slice`].
    unsafe fn padding<'a>(&self, block: &Block) -> &'a mut [Link] {
        // SAFETY: the caller's contract; the links are padded to the alignment of the next part.
        self.links.map_or(&mut [], |links| unsafe { block.slice(links, self.count, self.count & 1) })
    }

    /// The environment in a block.
    ///
    /// # Safety
    /// The block holds an environment of this layout that nobody writes.
    #[inline(always)]
    unsafe fn view<'a>(&self, block: &Block) -> Option<kernel::Environment<'a>> {
        // SAFETY: the caller's contract; the parts lie inside the block.
        unsafe {
            Some(kernel::Environment {
                header: block.slice::<Header>(0, 0, 1).first()?,
                squares: block.slice(self.squares, 0, self.count),
                links: self.links.map_or(&[], |offset| block.slice(offset, 0, self.count)),
                compensated: self.compensated.map_or(&[], |offset| block.slice(offset, 0, self.count)),
                rgb: self.rgb.map_or(&[], |offset| block.slice(offset, 0, self.count)),
            })
        }
    }
}

/// A checked configuration.
#[derive(Clone, Copy)]
struct Request {
    config: Config,
    flags: u32,
}

impl Request {
    /// Squares of the complete tree.
    fn squares(&self) -> usize {
        complete_len::<4>(self.config.depth).unwrap_or(0) as usize
    }

    fn stored(&self, squares: usize) -> Option<Stored> {
        Stored::new(squares, self.config.storage == Storage::Sparse, self.flags)
    }

    /// Tells whether a later call of the same build brings the same configuration.
    fn fingerprint(&self) -> u64 {
        let pixels = &self.config.pixels;
        let mut hash = ContentHash::new();
        for word in [pixels.width, pixels.height, pixels.channels, pixels.layout as u32, pixels.format as u32] {
            hash.add(word.into());
        }
        for word in [self.flags, self.config.depth, self.config.storage as u32] {
            hash.add(word.into());
        }
        hash.add(self.config.error_budget.to_bits());
        hash.finish()
    }
}

/// Checks a configuration.
///
/// # Safety
/// The pointer is null or points to what the header says.
unsafe fn read_config(config: *const EnvironmentConfig) -> Checked<(Request, PixelRows)> {
    // SAFETY: the caller's contract.
    let c = unsafe { sized(config, 1)? };
    let invalid = Failure::new(Status::InvalidArgument, 1);
    let layout = match c.layout {
        WIS_LAYOUT_LATLONG => Layout::LatLong,
        WIS_LAYOUT_CUBE => Layout::Cube,
        WIS_LAYOUT_OCTAHEDRAL => Layout::Octahedral,
        _ => return Err(invalid),
    };
    let format = match c.format {
        WIS_FORMAT_F32 => Format::F32,
        WIS_FORMAT_F16 => Format::F16,
        _ => return Err(invalid),
    };
    let storage = match c.storage {
        WIS_STORAGE_PYRAMID => Storage::Pyramid,
        WIS_STORAGE_SPARSE => Storage::Sparse,
        _ => return Err(invalid),
    };
    let resolution_fits = c.resolution == 0 || (c.resolution.is_power_of_two() && c.resolution <= 1 << MAX_DEPTH);
    if !resolution_fits || c.flags & !ALL_FLAGS != 0 || !(0.0..=f32::MAX).contains(&c.error_budget) {
        return Err(invalid);
    }
    let pixels = Pixels { layout, width: c.width, height: c.height, channels: c.channels, format };
    kernel::check(&pixels).map_err(|status| Failure::new(status, 1))?;
    let row_bytes = pixels.row_bytes().ok_or(Failure::new(Status::Overflow, 1))?;
    let stride = if c.row_stride == 0 { row_bytes as isize } else { c.row_stride };
    if stride.unsigned_abs() < row_bytes {
        return Err(invalid);
    }
    if stride.checked_mul(c.height as isize).is_none() {
        return Err(Failure::new(Status::Overflow, 1));
    }
    if c.pixels.is_null() && c.row.is_none() {
        return Err(Failure::new(Status::NullPointer, 1));
    }
    let config = Config {
        pixels,
        depth: if c.resolution == 0 { Config::natural_depth(&pixels) } else { c.resolution.ilog2() },
        storage,
        error_budget: c.error_budget.into(),
        nearest: c.flags & WIS_ENVIRONMENT_NEAREST != 0,
        exact_zero: c.flags & WIS_ENVIRONMENT_EXACT_ZERO != 0,
        compensated: c.flags & WIS_ENVIRONMENT_COMPENSATED != 0,
        rgb: c.flags & WIS_ENVIRONMENT_RGB != 0,
        sanitise: c.flags & WIS_ENVIRONMENT_SANITISE != 0,
    };
    let rows = PixelRows { pixels: c.pixels, stride, row_bytes, row: c.row, user: c.row_user };
    Ok((Request { config, flags: c.flags }, rows))
}

/// The client's rows: an array or a callback.
struct PixelRows {
    pixels: *const c_void,
    stride: isize,
    row_bytes: usize,
    row: RowFn,
    user: *mut c_void,
}

impl Rows for PixelRows {
    fn row(&self, y: u32) -> Option<&[u8]> {
        let start: *const u8 = match self.row {
            // SAFETY: row y of the array that the client describes; the offset was checked to fit an isize.
            _ if !self.pixels.is_null() => unsafe { self.pixels.cast::<u8>().byte_offset(self.stride * y as isize) },
            // SAFETY: the client's function with the client's argument.
            Some(row) => unsafe { row(self.user, y).cast() },
            None => core::ptr::null(),
        };
        if start.is_null() {
            return None;
        }
        // SAFETY: the client gives rows of that many bytes.
        Some(unsafe { core::slice::from_raw_parts(start, self.row_bytes) })
    }
}

/// The first words of a scratch block in use.
#[repr(C)]
struct ScratchHeader {
    magic: u64,
    fingerprint: u64,
}

const SCRATCH_MAGIC: u64 = u64::from_le_bytes(*b"wis-bld\x01");

/// The largest luminance of a row of texels, or the first cell of a row, until that row is done.
const UNFINISHED: f64 = -1.0;

/// Where the parts of a scratch block stand; the trees only if they do not go to the environment at once.
#[derive(Clone, Copy)]
struct Scratch {
    rows: usize,
    texels: usize,
    texels_rgb: usize,
    cells: usize,
    cells_rgb: usize,
    plain: usize,
    compensated: usize,
    rgb: usize,
    savings: usize,
    sources: usize,
    bytes: usize,
}

impl Scratch {
    fn of(request: &Request) -> Option<Scratch> {
        let config = &request.config;
        let mut end = size_of::<ScratchHeader>();
        let mut part = |count: usize, bytes_each: usize| {
            let start = end;
            end = count.checked_mul(bytes_each)?.checked_add(start)?.checked_next_multiple_of(WIS_ALIGNMENT)?;
            Some(start)
        };
        let when = |condition: bool, count: usize| if condition { count } else { 0 };
        let texels = config.texels();
        let cells = config.cells() as usize * config.cells() as usize;
        let squares = when(config.storage == Storage::Sparse, request.squares());
        let scratch = Scratch {
            rows: part(config.pixels.height as usize, size_of::<RowSummary>())?,
            texels: part(texels, size_of::<f64>())?,
            texels_rgb: part(when(config.rgb, texels), size_of::<[f32; 3]>())?,
            cells: part(cells, size_of::<f64>())?,
            cells_rgb: part(when(config.rgb, cells), size_of::<[f32; 3]>())?,
            plain: part(squares, size_of::<[f32; 4]>())?,
            compensated: part(when(config.compensated, squares), size_of::<[f32; 4]>())?,
            rgb: part(when(config.rgb, squares), size_of::<[[f32; 3]; 4]>())?,
            savings: part(squares, size_of::<f64>())?,
            sources: part(squares, size_of::<u32>())?,
            bytes: 0,
        };
        if end > isize::MAX as usize { None } else { Some(Scratch { bytes: end, ..scratch }) }
    }
}

/// A build at work on a scratch block.
struct Build {
    request: Request,
    scratch: Scratch,
    block: Block,
}

impl Build {
    fn new(request: Request, scratch: *mut c_void, bytes: usize, argument: u32) -> Checked<Build> {
        let layout = Scratch::of(&request).ok_or(Failure::new(Status::Overflow, 1))?;
        let block = Block::new(scratch.cast(), bytes, layout.bytes, argument)?;
        Ok(Build { request, scratch: layout, block })
    }

    /// Starts a build.
    ///
    /// # Safety
    /// The block is the caller's to write.
    unsafe fn begin(request: Request, scratch: *mut c_void, bytes: usize, argument: u32) -> Checked<Build> {
        let build = Build::new(request, scratch, bytes, argument)?;
        let [texel_rows, cell_rows] = build.rows();
        // SAFETY: the caller's contract; nothing else uses the block yet.
        unsafe {
            if let Some(header) = build.block.slice::<ScratchHeader>(0, 0, 1).first_mut() {
                *header = ScratchHeader { magic: SCRATCH_MAGIC, fingerprint: request.fingerprint() };
            }
            let unfinished = RowSummary { largest: UNFINISHED, sanitised: 0 };
            build.block.slice::<RowSummary>(build.scratch.rows, 0, texel_rows as usize).fill(unfinished);
            for row in 0..cell_rows {
                build.first_cell(row).fill(UNFINISHED);
            }
        }
        Ok(build)
    }

    /// Goes on with a build that [`Build::begin`] started.
    ///
    /// # Safety
    /// The block holds a build that was begun.
    unsafe fn go_on(request: Request, scratch: *mut c_void, bytes: usize, argument: u32) -> Checked<Build> {
        let build = Build::new(request, scratch, bytes, argument)?;
        // SAFETY: the caller's contract; threads only read the header.
        let begun = unsafe { build.block.slice::<ScratchHeader>(0, 0, 1) }
            .first()
            .is_some_and(|h| h.magic == SCRATCH_MAGIC && h.fingerprint == request.fingerprint());
        if begun { Ok(build) } else { Err(Failure::new(Status::Mismatch, argument)) }
    }

    /// Checks that every row of a pass is done.
    ///
    /// # Safety
    /// No thread is at work on that pass.
    unsafe fn require(&self, pass: u32, scratch_argument: u32) -> Checked<()> {
        let [_, cell_rows] = self.rows();
        // SAFETY: the caller's contract.
        let done = unsafe {
            match pass {
                0 => self.summaries().iter().all(|row| row.largest != UNFINISHED),
                _ => (0..cell_rows).all(|row| self.first_cell(row) != [UNFINISHED]),
            }
        };
        if done { Ok(()) } else { Err(Failure::new(Status::Mismatch, scratch_argument)) }
    }

    /// The first cell of a row of the second pass.
    ///
    /// # Safety
    /// No thread is at work on that row.
    unsafe fn first_cell<'a>(&self, row: u32) -> &'a mut [f64] {
        // SAFETY: the caller's contract.
        unsafe { self.block.slice(self.scratch.cells, row as usize * self.request.config.cells() as usize, 1) }
    }

    /// Rows of the two passes.
    fn rows(&self) -> [u32; 2] {
        [self.request.config.pixels.height, self.request.config.cells()]
    }

    /// Works on rows of a pass.
    ///
    /// # Safety
    /// No other thread works on these rows, nor on the first pass while this is the second.
    unsafe fn run(&self, rows: &PixelRows, pass: u32, first: u32, count: u32) -> Checked<()> {
        for row in first..first + count {
            // SAFETY: the caller's contract.
            unsafe { if pass == 0 { self.decode(rows, row)? } else { self.integrate(row) } }
        }
        Ok(())
    }

    /// # Safety
    /// As [`Build::run`].
    unsafe fn decode(&self, rows: &PixelRows, y: u32) -> Checked<()> {
        let width = self.request.config.pixels.width as usize;
        let start = y as usize * width;
        let coloured = if self.request.config.rgb { width } else { 0 };
        // SAFETY: elements of this row only.
        let (luminance, rgb, summary) = unsafe {
            (
                self.block.slice::<f64>(self.scratch.texels, start, width),
                self.block.slice::<[f32; 3]>(self.scratch.texels_rgb, start, coloured),
                self.block.slice::<RowSummary>(self.scratch.rows, y as usize, 1),
            )
        };
        let decoded = kernel::decode(&self.request.config, rows, y, luminance, rgb).map_err(|error| match error {
            RowError::Missing => Failure::at(error.status(), 1, 0, y),
            RowError::Texel(texel) => Failure::at(error.status(), 1, texel.x, texel.y),
        })?;
        if let Some(summary) = summary.first_mut() {
            *summary = decoded;
        }
        Ok(())
    }

    /// # Safety
    /// As [`Build::run`]; the first pass is done.
    unsafe fn integrate(&self, i: u32) {
        let config = &self.request.config;
        let cells = config.cells() as usize;
        let when_rgb = |count: usize| if config.rgb { count } else { 0 };
        // SAFETY: what is only read is not written in this pass; of the cells this row only is written.
        unsafe {
            let decoded = Decoded {
                luminance: self.block.slice(self.scratch.texels, 0, config.texels()),
                rgb: self.block.slice(self.scratch.texels_rgb, 0, when_rgb(config.texels())),
                replacement: kernel::replacement(self.summaries()),
            };
            let start = i as usize * cells;
            let luminance = self.block.slice::<f64>(self.scratch.cells, start, cells);
            let rgb = self.block.slice::<[f32; 3]>(self.scratch.cells_rgb, start, when_rgb(cells));
            kernel::integrate(config, decoded, i, luminance, rgb);
        }
    }

    /// # Safety
    /// The first pass is done.
    unsafe fn summaries<'a>(&self) -> &'a [RowSummary] {
        // SAFETY: written by the first pass, only read from then on.
        unsafe { self.block.slice(self.scratch.rows, 0, self.request.config.pixels.height as usize) }
    }

    /// Builds the trees and writes the environment; both passes are done.
    ///
    /// # Safety
    /// As wis_environment_finish.
    unsafe fn finish(
        &self,
        memory: *mut u8,
        bytes: usize,
        environment: *mut *const Environment,
        info: *mut EnvironmentInfo,
    ) -> Checked<()> {
        // SAFETY: the caller's contract; the parts of the blocks do not overlap.
        unsafe {
            let header = match self.request.config.storage {
                Storage::Pyramid => self.store_pyramid(memory, bytes)?,
                Storage::Sparse => self.store_sparse(memory, bytes)?,
            };
            publish(memory.cast_const().cast(), &header, environment, info);
        }
        Ok(())
    }

    /// A header with what does not depend on the trees.
    ///
    /// # Safety
    /// Both passes are done.
    unsafe fn header(&self) -> Header {
        let config = &self.request.config;
        Header {
            magic: MAGIC,
            bytes: 0,
            content_id: 0,
            // SAFETY: the caller's contract.
            sanitised: unsafe { self.summaries() }.iter().map(|row| row.sanitised).sum(),
            power: 0.0,
            error: 0.0,
            storage: if config.storage == Storage::Sparse { WIS_STORAGE_SPARSE } else { WIS_STORAGE_PYRAMID },
            flags: self.request.flags,
            depth: config.depth,
            squares: 0,
            exponent: 0,
            average: 0.0,
            compensated_average: 0.0,
            rgb_average: [0.0; 3],
            reserved: [0; 2],
        }
    }

    /// The integrated cells.
    ///
    /// # Safety
    /// Both passes are done.
    unsafe fn grid<'a>(&self) -> Grid<'a> {
        let cells = self.request.config.cells() as usize * self.request.config.cells() as usize;
        let coloured = if self.request.config.rgb { cells } else { 0 };
        // SAFETY: only read from now on.
        unsafe {
            Grid {
                luminance: self.block.slice(self.scratch.cells, 0, cells),
                rgb: self.block.slice(self.scratch.cells_rgb, 0, coloured),
            }
        }
    }

    /// Builds the complete trees where they stay.
    ///
    /// # Safety
    /// As [`Build::finish`].
    unsafe fn store_pyramid(&self, memory: *mut u8, bytes: usize) -> Checked<Header> {
        let squares = self.request.squares();
        let stored = self.request.stored(squares).ok_or(Failure::new(Status::Overflow, 1))?;
        let block = Block::new(memory, bytes, stored.bytes, 2)?;
        let count = |part: Option<usize>| if part.is_some() { squares } else { 0 };
        // SAFETY: the caller's contract; the parts do not overlap.
        unsafe {
            let mut header = self.header();
            let mut trees = Trees {
                plain: block.slice(stored.squares, 0, squares),
                compensated: block.slice(stored.compensated.unwrap_or(0), 0, count(stored.compensated)),
                rgb: block.slice(stored.rgb.unwrap_or(0), 0, count(stored.rgb)),
            };
            kernel::complete(&self.request.config, &self.grid(), &mut trees, &mut header)?;
            header.squares = squares as u32;
            seal(&block, &stored, header)
        }
    }

    /// Builds the complete trees in scratch memory and copies the squares that the budget keeps.
    ///
    /// # Safety
    /// As [`Build::finish`].
    unsafe fn store_sparse(&self, memory: *mut u8, bytes: usize) -> Checked<Header> {
        let config = &self.request.config;
        let all = self.request.squares();
        let when = |condition: bool, count: usize| if condition { count } else { 0 };
        // SAFETY: the caller's contract; the parts do not overlap.
        unsafe {
            let mut header = self.header();
            let mut trees = Trees {
                plain: self.block.slice(self.scratch.plain, 0, all),
                compensated: self.block.slice(self.scratch.compensated, 0, when(config.compensated, all)),
                rgb: self.block.slice(self.scratch.rgb, 0, when(config.rgb, all)),
            };
            kernel::complete(config, &self.grid(), &mut trees, &mut header)?;
            let savings = self.block.slice::<f64>(self.scratch.savings, 0, all);
            let planned = kernel::plan(config, &header, trees.plain, savings)?;
            let kept = planned.squares as usize;
            let stored = self.request.stored(kept).ok_or(Failure::new(Status::Overflow, 1))?;
            let block = Block::new(memory, bytes, stored.bytes, 2)?;
            let links = block.slice::<Link>(stored.links.unwrap_or(0), 0, kept);
            kernel::write_kept(config, &header, trees.plain, savings, block.slice(stored.squares, 0, kept), links)?;
            // The bytes of an environment must not depend on what was in the block.
            stored.padding(&block).fill(Link::default());
            let sources = self.block.slice::<u32>(self.scratch.sources, 0, kept);
            if let Some(part) = stored.compensated {
                kernel::copy_kept(links, sources, trees.compensated, block.slice(part, 0, kept));
            }
            if let Some(part) = stored.rgb {
                kernel::copy_kept(links, sources, trees.rgb, block.slice(part, 0, kept));
            }
            header.squares = planned.squares;
            header.error = planned.error;
            seal(&block, &stored, header)
        }
    }
}

/// Writes the header and the content id, the last step of a build.
///
/// # Safety
/// The block is the caller's to write and holds everything but the header.
unsafe fn seal(block: &Block, stored: &Stored, header: Header) -> Checked<Header> {
    // SAFETY: the caller's contract; the views do not outlive the statement that made them.
    unsafe {
        let mut header = Header { bytes: stored.bytes as u64, ..header };
        let write = |header: Header| {
            if let Some(slot) = block.slice::<Header>(0, 0, 1).first_mut() {
                *slot = header;
            }
        };
        write(header);
        header.content_id = stored.view(block).ok_or(Failure::new(Status::Overflow, 1))?.content_id();
        write(header);
        Ok(header)
    }
}
