//! A Rust client of the C library: the generated bindings, and owners of memory around the handles.
//!
//! Nothing is checked or changed on the way in, so that a test can hand over anything that C can.

use std::ffi::{CStr, c_int, c_void};
use std::fmt;
use std::mem::size_of;
use std::ptr::{null, null_mut};

/// The header, as generated.
#[allow(non_camel_case_types, non_snake_case, non_upper_case_globals, missing_docs)]
pub mod raw {
    include!(concat!(env!("OUT_DIR"), "/wis.rs"));
}

/// A status other than `WIS_OK`, and where the library says the fault is.
#[derive(Clone, Copy)]
pub struct Failure {
    /// `WIS_*`.
    pub status: raw::wis_status,
    /// As the library left it.
    pub diagnostic: raw::wis_diagnostic,
}

// SAFETY: the diagnostic's pointer is to a static string, if it is not null.
unsafe impl Send for Failure {}
// SAFETY: as above.
unsafe impl Sync for Failure {}

impl Failure {
    /// The field of a struct that is at fault.
    pub fn field(&self) -> Option<&'static CStr> {
        let field = self.diagnostic.field;
        // SAFETY: a static string, if it is not null.
        if field.is_null() { None } else { Some(unsafe { CStr::from_ptr(field) }) }
    }
}

/// The result of a call that can fail.
pub type Result<T> = std::result::Result<T, Failure>;

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // SAFETY: the library answers a static string for any number.
        let text = unsafe { CStr::from_ptr(raw::wis_status_string(self.status)) };
        write!(f, "{} ({})", text.to_string_lossy(), self.status)
    }
}

impl fmt::Debug for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}, {:?}, {:?}", self.diagnostic, self.field())
    }
}

impl std::error::Error for Failure {}

/// The status of a call as a result.
pub fn check(status: raw::wis_status) -> Result<()> {
    check_with(status, raw::wis_diagnostic::default())
}

/// The same with what the library said of it.
pub fn check_with(status: raw::wis_status, diagnostic: raw::wis_diagnostic) -> Result<()> {
    if status == raw::WIS_OK { Ok(()) } else { Err(Failure { status, diagnostic }) }
}

/// Memory aligned to `WIS_ALIGNMENT`.
#[derive(Clone, Default)]
pub struct Block(Vec<Unit>);

#[derive(Clone, Copy, Default)]
#[repr(C, align(16))]
struct Unit([u8; 16]);

impl Block {
    /// A block of at least `bytes` zeros.
    pub fn new(bytes: usize) -> Block {
        Block(vec![Unit::default(); bytes.div_ceil(size_of::<Unit>())])
    }

    /// Bytes of the block.
    pub fn bytes(&self) -> usize {
        self.0.len() * size_of::<Unit>()
    }

    /// Gives back what lies behind the first `bytes`.
    pub fn shorten(&mut self, bytes: usize) {
        self.0.truncate(bytes.div_ceil(size_of::<Unit>()));
        self.0.shrink_to_fit();
    }

    /// Where it begins.
    pub fn start(&self) -> *const c_void {
        self.0.as_ptr().cast()
    }

    /// Where it begins, to write.
    pub fn start_mut(&mut self) -> *mut c_void {
        self.0.as_mut_ptr().cast()
    }
}

/// Where the texels of a map come from.
#[derive(Clone, Copy)]
pub enum Texels<'a> {
    /// All texels, rows from the top, as 32-bit floats.
    F32(&'a [f32]),
    /// The same as the bits of 16-bit floats.
    F16(&'a [u16]),
    /// A function that answers a row of 32-bit floats.
    RowsF32(&'a (dyn Fn(u32) -> *const f32 + Sync)),
    /// A function that answers a row of 16-bit floats.
    RowsF16(&'a (dyn Fn(u32) -> *const u16 + Sync)),
}

/// A map, as strata and lights take it.
#[derive(Clone, Copy)]
#[allow(missing_docs)]
pub struct Map<'a> {
    pub layout: u32,
    pub width: u32,
    pub height: u32,
    pub channels: u32,
    pub texels: Texels<'a>,
}

impl<'a> Map<'a> {
    /// A lat-long map.
    pub fn latlong(width: u32, height: u32, channels: u32, texels: &'a [f32]) -> Map<'a> {
        Map { layout: raw::WIS_LAYOUT_LATLONG, width, height, channels, texels: Texels::F32(texels) }
    }

    /// The format, the array, the function and its argument that give the texels.
    fn source(&self) -> (u32, *const c_void, raw::wis_row_fn, *mut c_void) {
        match &self.texels {
            Texels::F32(texels) => (raw::WIS_FORMAT_F32, texels.as_ptr().cast(), None, null_mut()),
            Texels::F16(texels) => (raw::WIS_FORMAT_F16, texels.as_ptr().cast(), None, null_mut()),
            Texels::RowsF32(rows) => {
                (raw::WIS_FORMAT_F32, null(), Some(row_f32), std::ptr::from_ref(rows).cast_mut().cast())
            }
            Texels::RowsF16(rows) => {
                (raw::WIS_FORMAT_F16, null(), Some(row_f16), std::ptr::from_ref(rows).cast_mut().cast())
            }
        }
    }

    /// The map as wis.h describes it, for a nearest client.
    fn environment_config(&self, world_from_map: &[f32; 9]) -> raw::wis_environment_config {
        let (format, pixels, row, row_user) = self.source();
        raw::wis_environment_config {
            size: size_of::<raw::wis_environment_config>() as u32,
            layout: self.layout,
            width: self.width,
            height: self.height,
            channels: self.channels,
            format,
            filter: raw::WIS_FILTER_NEAREST,
            flags: 0,
            error_budget: 0.0,
            pixels,
            row_stride: 0,
            row,
            row_user,
            world_from_map: world_from_map.as_ptr(),
        }
    }
}

/// A row callback whose user pointer leads to a function of rows.
///
/// # Safety
/// `user` points to a reference to such a function, which is alive.
pub unsafe extern "C" fn row_f32(user: *mut c_void, y: u32) -> *const c_void {
    // SAFETY: the configuration gave this pointer, and the map outlives the build.
    let rows = unsafe { &*user.cast::<&(dyn Fn(u32) -> *const f32 + Sync)>() };
    rows(y).cast()
}

/// A row callback of 16-bit floats.
///
/// # Safety
/// As for [`row_f32`].
pub unsafe extern "C" fn row_f16(user: *mut c_void, y: u32) -> *const c_void {
    // SAFETY: as in `row_f32`.
    let rows = unsafe { &*user.cast::<&(dyn Fn(u32) -> *const u16 + Sync)>() };
    rows(y).cast()
}

/// A density on the sphere of directions: what `sample`, `pdf` and `invert` answer for it. One of `sample` and `sample_n` follows from the
/// other, and one of `pdf` and `pdf_n`.
pub trait Density {
    /// A direction and its pdf.
    fn sample(&self, u: [f32; 2]) -> Result<raw::wis_drawn> {
        let mut drawn = raw::wis_drawn::default();
        self.sample_n(&[u], std::slice::from_mut(&mut drawn.wi), std::slice::from_mut(&mut drawn.pdf))?;
        Ok(drawn)
    }

    /// As many calls of `sample` at once; the slices are of one length.
    fn sample_n(&self, u: &[[f32; 2]], wi: &mut [[f32; 3]], pdf: &mut [f32]) -> Result<()> {
        for ((u, wi), pdf) in u.iter().zip(wi).zip(pdf) {
            let drawn = self.sample(*u)?;
            (*wi, *pdf) = (drawn.wi, drawn.pdf);
        }
        Ok(())
    }

    /// The pdf per solid angle.
    fn pdf(&self, wi: [f32; 3]) -> Result<f32> {
        let mut pdf = [f32::NAN];
        self.pdf_n(&[wi], &mut pdf)?;
        Ok(pdf[0])
    }

    /// As many calls of `pdf` at once; the slices are of one length.
    fn pdf_n(&self, wi: &[[f32; 3]], pdf: &mut [f32]) -> Result<()> {
        for (wi, pdf) in wi.iter().zip(pdf) {
            *pdf = self.pdf(*wi)?;
        }
        Ok(())
    }

    /// The `u` that leads to a direction, of a density that can tell.
    fn invert(&self, _wi: [f32; 3]) -> Result<[f32; 2]> {
        check(raw::WIS_UNREACHABLE).map(|()| [f32::NAN; 2])
    }
}

/// A function that writes BRDF x cosine of each direction and answers whether it could.
pub type Brdf<'a> = &'a mut dyn FnMut(&[[f32; 3]], &mut [f32]) -> bool;

/// What the library calls for a [`Brdf`].
///
/// # Safety
/// `user` is the address of a [`Brdf`] that is alive; there are `count` directions, and as many values.
pub unsafe extern "C" fn brdf_batch(user: *mut c_void, count: usize, wi: *const f32, f_cos: *mut f32) -> c_int {
    // SAFETY: whoever names this function gives this pointer; the library states the lengths.
    let (brdf, wi, f_cos) = unsafe {
        (
            &mut *user.cast::<Brdf>(),
            std::slice::from_raw_parts(wi.cast::<[f32; 3]>(), count),
            std::slice::from_raw_parts_mut(f_cos, count),
        )
    };
    c_int::from(!brdf(wi, f_cos))
}

/// How a map is rotated: see `WIS_TREE_ENVIRONMENT`. The matrix row by row.
pub struct Turn {
    pub depth: u32,
    pub error_budget: f32,
    pub least: f32,
    pub world_from_tree: [f32; 9],
}

/// A configuration of a tree of which nothing is set but the source.
fn tree_config(source: u32) -> raw::wis_tree_config {
    let size = size_of::<raw::wis_tree_config>() as u32;
    raw::wis_tree_config { size, source, ..Default::default() }
}

/// The tree of a function on the square, and its memory.
#[derive(Clone)]
pub struct Tree {
    memory: Block,
    /// What was built.
    pub info: raw::wis_tree_info,
}

impl Tree {
    /// Builds a tree of `2^depth` by `2^depth` values.
    pub fn new(depth: u32, error_budget: f32, pixels: &[f32]) -> Result<Tree> {
        Tree::of(2, depth, error_budget, pixels)
    }

    /// Builds a tree of `2^depth` values along each of some axes.
    pub fn of(dimensions: u32, depth: u32, error_budget: f32, pixels: &[f32]) -> Result<Tree> {
        assert!(pixels.len() == 1 << (dimensions * depth));
        let config = raw::wis_tree_config {
            dimensions,
            depth,
            error_budget,
            pixels: pixels.as_ptr(),
            ..tree_config(raw::WIS_TREE_PIXELS)
        };
        // SAFETY: `pixels` was checked to hold all values.
        unsafe { Tree::build(&config, &mut Block::new(0)) }
    }

    /// The product of this tree with one or two others, in `scratch`, which grows as it must.
    pub fn multiply(&self, f: &Tree, g: Option<&Tree>, scratch: &mut Block) -> Result<Tree> {
        let (trees, tree_count) =
            ([self.handle(), f.handle(), g.map_or(null(), Tree::handle)], 2 + u32::from(g.is_some()));
        let config = raw::wis_tree_config { tree_count, trees: trees.as_ptr(), ..tree_config(raw::WIS_TREE_PRODUCT) };
        // SAFETY: the handles are alive.
        unsafe { Tree::build(&config, scratch) }
    }

    /// The weighted sum of up to 16 trees, in `scratch`, which grows as it must.
    pub fn blend(terms: &[(&Tree, f64)], scratch: &mut Block) -> Result<Tree> {
        let (trees, weights): (Vec<_>, Vec<_>) = terms.iter().map(|(tree, weight)| (tree.handle(), *weight)).unzip();
        let (tree_count, trees, weight) = (terms.len() as u32, trees.as_ptr(), weights.as_ptr());
        let config = raw::wis_tree_config { tree_count, trees, weight, ..tree_config(raw::WIS_TREE_BLEND) };
        // SAFETY: as many live handles and weights as are said.
        unsafe { Tree::build(&config, scratch) }
    }

    /// A map in another frame.
    pub fn of_environment(environment: *const raw::wis_environment, turn: &Turn) -> Result<Tree> {
        let &Turn { depth, error_budget, least, .. } = turn;
        let config = raw::wis_tree_config {
            depth,
            error_budget,
            least: least.into(),
            environment,
            world_from_tree: turn.world_from_tree.as_ptr(),
            ..tree_config(raw::WIS_TREE_ENVIRONMENT)
        };
        // SAFETY: everything that is pointed to is alive, and matrices have nine numbers.
        unsafe { Tree::build(&config, &mut Block::new(0)) }
    }

    /// The tree of a function given by its average and any wavelets, raised to `least`.
    pub fn of_wavelets(average: f64, wavelets: &[raw::wis_wavelets], least: f64) -> Result<Tree> {
        let (count, wavelets) = (wavelets.len() as u32, wavelets.as_ptr());
        let config = raw::wis_tree_config { average, count, wavelets, least, ..tree_config(raw::WIS_TREE_WAVELETS) };
        // SAFETY: the list is as long as it says.
        unsafe { Tree::build(&config, &mut Block::new(0)) }
    }

    /// Asks for the memory that a tree needs, and builds it there; `scratch` grows as it must.
    ///
    /// # Safety
    /// What the configuration points to is alive, and as long as it says.
    unsafe fn build(config: &raw::wis_tree_config, scratch: &mut Block) -> Result<Tree> {
        let (mut size, mut diagnostic) = (raw::wis_memory_size::default(), raw::wis_diagnostic::default());
        // SAFETY: the caller's contract.
        check_with(unsafe { raw::wis_tree_size(config, &mut size, &mut diagnostic) }, diagnostic)?;
        if scratch.bytes() < size.scratch_bytes {
            *scratch = Block::new(size.scratch_bytes);
        }
        let (mut memory, mut tree) = (Block::new(size.bytes), null());
        let mut info = raw::wis_tree_info { size: size_of::<raw::wis_tree_info>() as u32, ..Default::default() };
        let (place, bytes, work, room) = (memory.start_mut(), memory.bytes(), scratch.start_mut(), scratch.bytes());
        // SAFETY: the caller's contract; the blocks are as long as they say.
        let status =
            unsafe { raw::wis_tree_init(config, place, bytes, work, room, &mut tree, &mut info, &mut diagnostic) };
        check_with(status, diagnostic)?;
        memory.shorten(info.bytes as usize);
        Ok(Tree { memory, info })
    }

    /// The handle, for raw calls.
    pub fn handle(&self) -> *const raw::wis_tree {
        self.memory.start().cast()
    }

    /// The integral of the product of three functions.
    pub fn triple_integral([a, b, c]: [&Tree; 3]) -> Result<f64> {
        let mut integral = f64::NAN;
        // SAFETY: the handles are alive.
        check(unsafe { raw::wis_triple_integral(a.handle(), b.handle(), c.handle(), &mut integral) })?;
        Ok(integral)
    }

    /// The largest wavelets.
    pub fn largest(&self, keep: u32) -> Result<Vec<raw::wis_wavelets>> {
        let mut wavelets = vec![raw::wis_wavelets::default(); keep as usize];
        let mut count = 0;
        // SAFETY: there is room for `keep` elements.
        check(unsafe {
            raw::wis_triple_select(
                self.handle(),
                raw::WIS_SELECT_WAVELETS,
                keep,
                wavelets.as_mut_ptr(),
                &mut count,
                null_mut(),
            )
        })?;
        wavelets.truncate(count as usize);
        Ok(wavelets)
    }

    /// The triple product integral with approximations of a BRDF of this average and of this light.
    pub fn sublinear(
        &self,
        (average, brdf): (f64, &[raw::wis_wavelets]),
        kept: &[raw::wis_wavelets],
        visible: &Tree,
    ) -> Result<f64> {
        let mut integral = f64::NAN;
        // SAFETY: the handles are alive and the lists as long as they say.
        check(unsafe {
            raw::wis_triple_sublinear(
                average,
                brdf.len() as u32,
                brdf.as_ptr(),
                kept.len() as u32,
                kept.as_ptr(),
                self.handle(),
                visible.handle(),
                &mut integral,
                null_mut(),
            )
        })?;
        Ok(integral)
    }

    /// The integral of this function times another.
    pub fn product_integral(&self, other: &Tree) -> Result<f64> {
        let mut integral = f64::NAN;
        // SAFETY: both handles are alive.
        check(unsafe { raw::wis_tree_product_integral(self.handle(), other.handle(), &mut integral) })?;
        Ok(integral)
    }

    /// A point of the square and its density.
    pub fn sample(&self, u: [f32; 2]) -> Result<([f32; 2], f32)> {
        let (mut point, mut pdf) = ([f32::NAN; 2], f32::NAN);
        // SAFETY: the handle is alive; the arrays hold two numbers as the tree has two axes.
        check(unsafe { raw::wis_tree_sample(self.handle(), u.as_ptr(), point.as_mut_ptr(), &mut pdf) })?;
        Ok((point, pdf))
    }

    /// The density at a point.
    pub fn pdf(&self, point: [f32; 2]) -> Result<f32> {
        let mut pdf = f32::NAN;
        // SAFETY: as in `sample`.
        check(unsafe { raw::wis_tree_pdf(self.handle(), point.as_ptr(), &mut pdf) })?;
        Ok(pdf)
    }

    /// The `u` that leads to a point.
    pub fn invert(&self, point: [f32; 2]) -> Result<[f32; 2]> {
        let mut u = [f32::NAN; 2];
        // SAFETY: as in `sample`.
        check(unsafe { raw::wis_tree_invert(self.handle(), point.as_ptr(), u.as_mut_ptr()) })?;
        Ok(u)
    }

    /// Warps points in place; `index` is permuted alike.
    pub fn warp<const N: usize>(&self, points: &mut [[f32; N]], index: &mut [u32]) -> Result<()> {
        assert!(points.len() == index.len() && self.info.dimensions as usize == N);
        // SAFETY: the handle is alive, and the slices are of one length.
        check(unsafe {
            raw::wis_warp_in_place(
                self.handle(),
                points.as_mut_ptr().cast(),
                index.as_mut_ptr(),
                points.len(),
                null_mut(),
            )
        })
    }
}

/// The numbers `first..` of the Owen-scrambled Sobol sequence of a seed.
pub fn sobol(seed: u32, first: u32, points: &mut [[f32; 2]]) -> Result<()> {
    // SAFETY: the slice holds that many points.
    check(unsafe { raw::wis_points_sobol(seed, first, points.len(), points.as_mut_ptr().cast(), 0) })
}

/// The Hammersley set of as many points as there is room for.
pub fn hammersley(points: &mut [[f32; 2]]) -> Result<()> {
    let count = points.len() as u32;
    // SAFETY: the slice holds that many points.
    check(unsafe { raw::wis_points_hammersley(0, count, count, points.as_mut_ptr().cast(), 0) })
}

/// The seed of a pixel in a pass.
pub fn pixel_seed(pixel: [u32; 2], pass: u32) -> u32 {
    // SAFETY: a pure function of numbers.
    unsafe { raw::wis_pixel_seed(pixel[0], pixel[1], pass) }
}

/// A lat-long map as directional lights, and the number of the light of each texel.
pub struct Strata {
    /// In the order in which they were placed.
    pub lights: Vec<raw::wis_light>,
    /// Row by row.
    pub label: Vec<u32>,
    /// Bytes of the lights and of the scratch memory.
    pub size: raw::wis_memory_size,
}

impl Strata {
    /// Cuts a map; the size of the config is filled in.
    pub fn new(map: &Map, world_from_map: &[f32; 9], config: &raw::wis_strata_config) -> Result<Strata> {
        let config = raw::wis_strata_config { size: size_of::<raw::wis_strata_config>() as u32, ..*config };
        let map_config = map.environment_config(world_from_map);
        let (mut size, mut diagnostic) = (raw::wis_memory_size::default(), raw::wis_diagnostic::default());
        // SAFETY: every pointer is to a live local.
        let status = unsafe { raw::wis_strata_size(&map_config, &config, &mut size, &mut diagnostic) };
        check_with(status, diagnostic)?;
        let mut lights = vec![raw::wis_light::default(); size.bytes / size_of::<raw::wis_light>()];
        let mut label = vec![0; map.width as usize * map.height as usize];
        let (mut scratch, mut count) = (Block::new(size.scratch_bytes), 0);
        // SAFETY: the lights and the scratch memory are as large as was asked for, the labels as the map.
        let status = unsafe {
            raw::wis_strata_lights(
                &map_config,
                &config,
                scratch.start_mut(),
                scratch.bytes(),
                lights.as_mut_ptr(),
                &mut count,
                label.as_mut_ptr(),
                &mut diagnostic,
            )
        };
        check_with(status, diagnostic)?;
        lights.truncate(count as usize);
        Ok(Strata { lights, label, size })
    }

    /// The texels of each stratum, to place samples inside: `WIS_JITTER_*`.
    pub fn jitter(&self, map: &Map, world_from_map: &[f32; 9], distribution: u32) -> Result<Jitter> {
        let (mut size, mut diagnostic) = (raw::wis_memory_size::default(), raw::wis_diagnostic::default());
        let config = raw::wis_jitter_config {
            size: size_of::<raw::wis_jitter_config>() as u32,
            light_count: self.lights.len() as u32,
            distribution,
            label: self.label.as_ptr(),
            ..Default::default()
        };
        let map_config = map.environment_config(world_from_map);
        // SAFETY: every pointer is to a live local.
        let status = unsafe { raw::wis_jitter_size(&map_config, &config, &mut size, &mut diagnostic) };
        check_with(status, diagnostic)?;
        let (mut memory, mut scratch) = (Block::new(size.bytes), Block::new(size.scratch_bytes));
        let mut handle = null();
        // SAFETY: the blocks are as large as was asked for, the labels as the map.
        let status = unsafe {
            raw::wis_jitter_init(
                &map_config,
                &config,
                memory.start_mut(),
                memory.bytes(),
                scratch.start_mut(),
                scratch.bytes(),
                &mut handle,
                &mut diagnostic,
            )
        };
        check_with(status, diagnostic)?;
        Ok(Jitter(memory))
    }
}

/// Places inside strata.
pub struct Jitter(Block);

impl Jitter {
    /// A direction inside the stratum of a light, and its pdf there.
    pub fn sample(&self, light: u32, u: [f32; 2]) -> Result<([f32; 3], f32)> {
        let mut sample = raw::wis_drawn::default();
        // SAFETY: the memory holds a jitter, and the locals live.
        check(unsafe { raw::wis_jitter_sample(self.0.start().cast(), light, u.as_ptr(), &mut sample) })?;
        Ok((sample.wi, sample.pdf))
    }
}

/// The lights by contribution, the largest first, and how many are worth a ray.
pub fn order(contribution: &[f32], threshold: f32, index: &mut [u32]) -> Result<usize> {
    assert_eq!(contribution.len(), index.len());
    let mut traced = 0;
    // SAFETY: both slices have as many elements.
    check(unsafe {
        raw::wis_strata_order(
            contribution.len(),
            contribution.as_ptr(),
            threshold,
            index.as_mut_ptr(),
            &mut traced,
            null_mut(),
        )
    })?;
    Ok(traced as usize)
}

/// Visibility in 8 bits, and its memory.
pub struct Visibility(Block);

impl Visibility {
    /// Stores a tree of values from 0 to 1.
    pub fn new(tree: &Tree) -> Result<Visibility> {
        let (mut size, mut diagnostic) = (raw::wis_memory_size::default(), raw::wis_diagnostic::default());
        // SAFETY: the handle is alive.
        check_with(unsafe { raw::wis_visibility_size(tree.handle(), &mut size, &mut diagnostic) }, diagnostic)?;
        let (mut memory, mut handle) = (Block::new(size.bytes), null());
        // SAFETY: the block is as long as it says.
        let status = unsafe {
            let (place, bytes) = (memory.start_mut(), memory.bytes());
            raw::wis_visibility_init(tree.handle(), place, bytes, &mut handle, &mut diagnostic)
        };
        check_with(status, diagnostic)?;
        Ok(Visibility(memory))
    }

    /// Its bytes.
    pub fn bytes(&self) -> usize {
        self.0.bytes()
    }

    /// The integral of what is seen of a function.
    pub fn product_integral(&self, tree: &Tree) -> Result<f64> {
        let mut integral = f64::NAN;
        // SAFETY: the handles are alive.
        check(unsafe { raw::wis_visibility_product_integral(tree.handle(), self.0.start().cast(), &mut integral) })?;
        Ok(integral)
    }

    /// As [`Tree::sublinear`].
    pub fn integral(
        &self,
        (average, brdf): (f64, &[raw::wis_wavelets]),
        kept: &[raw::wis_wavelets],
        light: &Tree,
    ) -> Result<f64> {
        let mut integral = f64::NAN;
        // SAFETY: the handles are alive and the lists as long as they say.
        check(unsafe {
            raw::wis_visibility_integral(
                average,
                brdf.len() as u32,
                brdf.as_ptr(),
                kept.len() as u32,
                kept.as_ptr(),
                light.handle(),
                self.0.start().cast(),
                &mut integral,
                null_mut(),
            )
        })?;
        Ok(integral)
    }
}

/// The weighted sum of at most 16 lists, in `out`, which grows as it must.
pub fn blend(lists: &[(&[raw::wis_wavelets], f64)], out: &mut Vec<raw::wis_wavelets>) -> Result<()> {
    let (mut handles, mut counts, mut weights) = ([null(); 16], [0; 16], [0.0; 16]);
    for (k, (list, weight)) in lists.iter().enumerate() {
        (handles[k], counts[k], weights[k]) = (list.as_ptr(), list.len() as u32, *weight);
    }
    out.resize(lists.iter().map(|(list, _)| list.len()).sum(), raw::wis_wavelets::default());
    let (mut count, room) = (0, out.len() as u32);
    let (handles, counts, weights) = (handles.as_ptr(), counts.as_ptr(), weights.as_ptr());
    // SAFETY: the lists are alive, and there is room for all of their elements.
    check(unsafe {
        raw::wis_triple_blend(
            lists.len() as u32,
            handles,
            counts,
            weights,
            room,
            out.as_mut_ptr(),
            &mut count,
            null_mut(),
        )
    })?;
    out.truncate(count as usize);
    Ok(())
}

/// The direction of a cell of a grid.
pub fn grid_direction(side: u32, cell: u32) -> Result<[f32; 3]> {
    square_direction([cell / side, cell % side].map(|k| (k as f32 + 0.5) / side as f32), None)
}

/// The world direction of a point of the square of a frame.
pub fn square_direction(point: [f32; 2], frame: Option<&[f32; 9]>) -> Result<[f32; 3]> {
    let (mut direction, frame) = ([0.0; 3], frame.map_or(null(), |frame| frame.as_ptr()));
    // SAFETY: the arrays are as long as they must be.
    check(unsafe { raw::wis_square_direction(point.as_ptr(), frame, direction.as_mut_ptr()) })?;
    Ok(direction)
}

/// The point of the square of a frame for a world direction.
pub fn square_point(wi: [f32; 3], frame: Option<&[f32; 9]>) -> Result<[f32; 2]> {
    let (mut point, frame) = ([0.0; 2], frame.map_or(null(), |frame| frame.as_ptr()));
    // SAFETY: the arrays are as long as they must be.
    check(unsafe { raw::wis_square_point(wi.as_ptr(), frame, point.as_mut_ptr()) })?;
    Ok(point)
}

/// The slices of a table beside a view, their weights, and the frame about its mirror direction.
pub fn table_view(slices: u32, normal: [f32; 3], wo: [f32; 3]) -> Result<([u32; 2], [f64; 2], [f32; 9])> {
    let (mut slice, mut weight, mut frame) = ([0; 2], [0.0; 2], [0.0; 9]);
    // SAFETY: the arrays are as long as they must be.
    check(unsafe {
        raw::wis_table_view(
            slices,
            normal.as_ptr(),
            wo.as_ptr(),
            slice.as_mut_ptr(),
            weight.as_mut_ptr(),
            frame.as_mut_ptr(),
        )
    })?;
    Ok((slice, weight, frame))
}

/// The cells about a direction and their weights.
pub fn grid_cells(side: u32, wi: [f32; 3]) -> Result<([u32; 4], [f32; 4])> {
    let (mut cells, mut weights) = ([0; 4], [0.0; 4]);
    // SAFETY: the arrays are as long as they must be.
    check(unsafe { raw::wis_grid_cells(side, wi.as_ptr(), cells.as_mut_ptr(), weights.as_mut_ptr()) })?;
    Ok((cells, weights))
}
