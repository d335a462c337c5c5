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
    told(|_| status)
}

/// The same of a call that says where a fault is.
pub fn told(call: impl FnOnce(*mut raw::wis_diagnostic) -> raw::wis_status) -> Result<()> {
    let mut diagnostic = raw::wis_diagnostic::default();
    let status = call(&mut diagnostic);
    if status == raw::WIS_OK { Ok(()) } else { Err(Failure { status, diagnostic }) }
}

/// What a call writes in place of a value.
pub fn answered<T>(mut value: T, call: impl FnOnce(*mut T) -> raw::wis_status) -> Result<T> {
    check(call(&mut value)).map(|()| value)
}

/// What a size query answers.
pub fn size(
    query: impl FnOnce(*mut raw::wis_memory_size, *mut raw::wis_diagnostic) -> raw::wis_status,
) -> Result<raw::wis_memory_size> {
    let mut size = raw::wis_memory_size::default();
    told(|diagnostic| query(&mut size, diagnostic)).map(|()| size)
}

/// The memory of an object: asks for its size, and builds it with scratch memory.
///
/// # Errors
/// Those of the library.
pub fn built(
    query: impl FnOnce(*mut raw::wis_memory_size, *mut raw::wis_diagnostic) -> raw::wis_status,
    build: impl FnOnce(*mut c_void, usize, *mut c_void, usize, *mut raw::wis_diagnostic) -> raw::wis_status,
) -> Result<Block> {
    let size = size(query)?;
    let (mut memory, mut scratch) = (Block::new(size.bytes), Block::new(size.scratch_bytes));
    let (place, bytes, work, room) = (memory.start_mut(), memory.bytes(), scratch.start_mut(), scratch.bytes());
    told(|diagnostic| build(place, bytes, work, room, diagnostic)).map(|()| memory)
}

/// A struct of the header with its size and some fields; the others are 0.
macro_rules! sized {
    ($name:ident { $($field:ident $(: $value:expr)?),* $(,)? }) => {
        $crate::client::raw::$name {
            size: size_of::<$crate::client::raw::$name>() as u32,
            $($field $(: $value)?,)*
            ..Default::default()
        }
    };
}
pub(crate) use sized;

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

    /// Replaces the block by one of so many bytes, if it has fewer.
    pub fn grow(&mut self, bytes: usize) {
        if self.bytes() < bytes {
            *self = Block::new(bytes);
        }
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

/// Where the texels of a map come from, as `WIS_FORMAT_*`.
#[derive(Clone, Copy)]
pub enum Texels<'a> {
    /// All texels, rows from the top, as 32-bit floats.
    F32(&'a [f32]),
    /// A function that answers a row of a format.
    Rows(u32, &'a (dyn Fn(u32) -> *const c_void + Sync)),
}

/// A map and what to build from it: the fields of `wis_environment_config`.
#[derive(Clone, Copy)]
#[allow(missing_docs)]
pub struct Map<'a> {
    pub layout: u32,
    pub width: u32,
    pub height: u32,
    pub channels: u32,
    pub filter: u32,
    pub flags: u32,
    pub error_budget: f32,
    pub texels: Texels<'a>,
    pub world_from_map: Option<[f32; 9]>,
}

impl<'a> Map<'a> {
    /// A lat-long map for a bilinear client, all of it kept.
    pub fn latlong(width: u32, height: u32, channels: u32, texels: Texels<'a>) -> Map<'a> {
        let (layout, filter) = (raw::WIS_LAYOUT_LATLONG, raw::WIS_FILTER_BILINEAR);
        Map { layout, width, height, channels, filter, flags: 0, error_budget: 0.0, texels, world_from_map: None }
    }

    /// As the library takes it.
    pub fn config(&self) -> raw::wis_environment_config {
        let &Map { layout, width, height, channels, filter, flags, error_budget, .. } = self;
        let (format, pixels, row, row_user): (_, _, raw::wis_row_fn, _) = match &self.texels {
            Texels::F32(texels) => (raw::WIS_FORMAT_F32, texels.as_ptr().cast(), None, null_mut()),
            Texels::Rows(format, rows) => (*format, null(), Some(row), std::ptr::from_ref(rows).cast_mut().cast()),
        };
        let world_from_map = self.world_from_map.as_ref().map_or(null(), |matrix| matrix.as_ptr());
        sized!(wis_environment_config {
            layout,
            width,
            height,
            channels,
            format,
            filter,
            flags,
            error_budget,
            pixels,
            row,
            row_user,
            world_from_map,
        })
    }
}

/// A row callback whose user pointer leads to a function of rows.
///
/// # Safety
/// `user` points to a reference to such a function, which is alive.
unsafe extern "C" fn row(user: *mut c_void, y: u32) -> *const c_void {
    // SAFETY: the configuration gave this pointer, and the map outlives the build.
    unsafe { (*user.cast::<&(dyn Fn(u32) -> *const c_void + Sync)>())(y) }
}

/// A density on the sphere of directions: what `sample`, `pdf` and `invert` answer for it. One of `sample` and `sample_n` follows from the
/// other, and one of `pdf` and `pdf_n`.
pub trait Density {
    /// A direction and its pdf.
    fn sample(&self, u: [f32; 2]) -> Result<raw::wis_drawn> {
        let mut drawn = raw::wis_drawn::default();
        self.sample_n(&[u], std::slice::from_mut(&mut drawn)).map(|()| drawn)
    }

    /// As many calls of `sample` at once; the slices are of one length.
    fn sample_n(&self, u: &[[f32; 2]], drawn: &mut [raw::wis_drawn]) -> Result<()> {
        u.iter().zip(drawn).try_for_each(|(u, drawn)| self.sample(*u).map(|sample| *drawn = sample))
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
        let config = sized!(wis_tree_config {
            source: raw::WIS_TREE_PIXELS,
            dimensions,
            depth,
            error_budget,
            pixels: pixels.as_ptr()
        });
        // SAFETY: `pixels` was checked to hold all values.
        unsafe { Tree::build(&config, &mut Block::new(0)) }
    }

    /// The product of this tree with one or two others, in `scratch`, which grows as it must.
    pub fn multiply(&self, f: &Tree, g: Option<&Tree>, scratch: &mut Block) -> Result<Tree> {
        let (trees, tree_count) =
            ([self.handle(), f.handle(), g.map_or(null(), Tree::handle)], 2 + u32::from(g.is_some()));
        let config = sized!(wis_tree_config { source: raw::WIS_TREE_PRODUCT, tree_count, trees: trees.as_ptr() });
        // SAFETY: the handles are alive.
        unsafe { Tree::build(&config, scratch) }
    }

    /// The weighted sum of up to 16 trees, in `scratch`, which grows as it must.
    pub fn blend(terms: &[(&Tree, f64)], scratch: &mut Block) -> Result<Tree> {
        let (trees, weights): (Vec<_>, Vec<_>) = terms.iter().map(|(tree, weight)| (tree.handle(), *weight)).unzip();
        let (tree_count, trees, weight) = (terms.len() as u32, trees.as_ptr(), weights.as_ptr());
        let config = sized!(wis_tree_config { source: raw::WIS_TREE_BLEND, tree_count, trees, weight });
        // SAFETY: as many live handles and weights as are said.
        unsafe { Tree::build(&config, scratch) }
    }

    /// A map in another frame.
    pub fn of_environment(environment: *const raw::wis_environment, turn: &Turn) -> Result<Tree> {
        let &Turn { depth, error_budget, least, .. } = turn;
        let config = sized!(wis_tree_config {
            source: raw::WIS_TREE_ENVIRONMENT,
            depth,
            error_budget,
            least: least.into(),
            environment,
            world_from_tree: turn.world_from_tree.as_ptr()
        });
        // SAFETY: everything that is pointed to is alive, and matrices have nine numbers.
        unsafe { Tree::build(&config, &mut Block::new(0)) }
    }

    /// The tree of a function given by its average and any wavelets, raised to `least`.
    pub fn of_wavelets(average: f64, wavelets: &[raw::wis_wavelets], least: f64) -> Result<Tree> {
        let (count, wavelets) = (wavelets.len() as u32, wavelets.as_ptr());
        let config = sized!(wis_tree_config { source: raw::WIS_TREE_WAVELETS, average, count, wavelets, least });
        // SAFETY: the list is as long as it says.
        unsafe { Tree::build(&config, &mut Block::new(0)) }
    }

    /// Asks for the memory that a tree needs, and builds it there; `scratch` grows as it must.
    ///
    /// # Safety
    /// What the configuration points to is alive, and as long as it says.
    unsafe fn build(config: &raw::wis_tree_config, scratch: &mut Block) -> Result<Tree> {
        // SAFETY: the caller's contract.
        let size = size(|size, diagnostic| unsafe { raw::wis_tree_size(config, size, diagnostic) })?;
        scratch.grow(size.scratch_bytes);
        let (mut memory, mut tree, mut info) = (Block::new(size.bytes), null(), sized!(wis_tree_info {}));
        let (place, bytes, work, room) = (memory.start_mut(), memory.bytes(), scratch.start_mut(), scratch.bytes());
        // SAFETY: the caller's contract; the blocks are as long as they say.
        told(|diagnostic| unsafe {
            raw::wis_tree_init(config, place, bytes, work, room, &mut tree, &mut info, diagnostic)
        })?;
        memory.shorten(info.bytes as usize);
        Ok(Tree { memory, info })
    }

    /// The handle, for raw calls.
    pub fn handle(&self) -> *const raw::wis_tree {
        self.memory.start().cast()
    }

    /// The integral of the product of three functions.
    pub fn triple_integral([a, b, c]: [&Tree; 3]) -> Result<f64> {
        // SAFETY: the handles are alive.
        answered(f64::NAN, |out| unsafe { raw::wis_triple_integral(a.handle(), b.handle(), c.handle(), out) })
    }

    /// The largest wavelets.
    pub fn largest(&self, keep: u32) -> Result<Vec<raw::wis_wavelets>> {
        let mut wavelets = vec![raw::wis_wavelets::default(); keep as usize];
        let mut count = 0;
        // SAFETY: there is room for `keep` elements.
        check(unsafe {
            let (tree, list) = (self.handle(), wavelets.as_mut_ptr());
            raw::wis_triple_select(tree, raw::WIS_SELECT_WAVELETS, keep, list, &mut count, null_mut())
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
        let (count, list, kept_count, kept) = (brdf.len() as u32, brdf.as_ptr(), kept.len() as u32, kept.as_ptr());
        // SAFETY: the handles are alive and the lists as long as they say.
        answered(f64::NAN, |out| unsafe {
            let (light, visible) = (self.handle(), visible.handle());
            raw::wis_triple_sublinear(average, count, list, kept_count, kept, light, visible, out, null_mut())
        })
    }

    /// The integral of this function times another.
    pub fn product_integral(&self, other: &Tree) -> Result<f64> {
        // SAFETY: both handles are alive.
        answered(f64::NAN, |out| unsafe { raw::wis_tree_product_integral(self.handle(), other.handle(), out) })
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
        // SAFETY: as in `sample`.
        answered(f32::NAN, |out| unsafe { raw::wis_tree_pdf(self.handle(), point.as_ptr(), out) })
    }

    /// The `u` that leads to a point.
    pub fn invert(&self, point: [f32; 2]) -> Result<[f32; 2]> {
        // SAFETY: as in `sample`.
        answered([f32::NAN; 2], |out| unsafe { raw::wis_tree_invert(self.handle(), point.as_ptr(), out.cast()) })
    }

    /// Warps points in place; `index` is permuted alike.
    pub fn warp<const N: usize>(&self, points: &mut [[f32; N]], index: &mut [u32]) -> Result<()> {
        assert!(points.len() == index.len() && self.info.dimensions as usize == N);
        // SAFETY: the handle is alive, and the slices are of one length.
        check(unsafe {
            let (first, index) = (points.as_mut_ptr().cast(), index.as_mut_ptr());
            raw::wis_warp_in_place(self.handle(), first, index, points.len(), null_mut())
        })
    }
}

/// The Hammersley set of as many points as there is room for, of the cells that the library's points have.
pub fn hammersley(points: &mut [[f32; 2]]) {
    let count = points.len() as f64;
    for (i, point) in (0u32..).zip(points) {
        let y = (2 * (i.reverse_bits() >> 9) + 1) as f32 / 16_777_216.0;
        *point = [((f64::from(i) + 0.5) / count) as f32, y];
    }
}

/// A seed of a pixel in a pass, of nested hashes (Wellons 2018, "lowbias32").
pub fn pixel_seed(pixel: [u32; 2], pass: u32) -> u32 {
    let mix = |x: u32| {
        let x = (x ^ x >> 16).wrapping_mul(0x7feb_352d);
        let x = (x ^ x >> 15).wrapping_mul(0x846c_a68b);
        x ^ x >> 16
    };
    mix(pixel[0] ^ mix(pixel[1] ^ mix(pass)))
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
    pub fn new(map: &Map, config: &raw::wis_strata_config) -> Result<Strata> {
        let config = raw::wis_strata_config { size: size_of::<raw::wis_strata_config>() as u32, ..*config };
        let of = map.config();
        // SAFETY: every pointer is to a live local.
        let size = size(|size, diagnostic| unsafe { raw::wis_strata_size(&of, &config, size, diagnostic) })?;
        let mut lights = vec![raw::wis_light::default(); size.bytes / size_of::<raw::wis_light>()];
        let mut label = vec![0; map.width as usize * map.height as usize];
        let (mut scratch, mut count) = (Block::new(size.scratch_bytes), 0);
        // SAFETY: the lights and the scratch memory are as large as was asked for, the labels as the map.
        told(|diagnostic| unsafe {
            let (work, room, label) = (scratch.start_mut(), scratch.bytes(), label.as_mut_ptr());
            raw::wis_strata_lights(&of, &config, work, room, lights.as_mut_ptr(), &mut count, label, diagnostic)
        })?;
        lights.truncate(count as usize);
        Ok(Strata { lights, label, size })
    }

    /// The texels of each stratum, to place samples inside: `WIS_JITTER_*`.
    pub fn jitter(&self, map: &Map, distribution: u32) -> Result<Jitter> {
        let (light_count, label) = (self.lights.len() as u32, self.label.as_ptr());
        let (of, config) = (map.config(), sized!(wis_jitter_config { light_count, distribution, label }));
        let mut handle = null();
        // SAFETY: every pointer is to a live local; the blocks are as large as was asked for, the labels as the map.
        let memory = built(
            |size, diagnostic| unsafe { raw::wis_jitter_size(&of, &config, size, diagnostic) },
            |place, bytes, work, room, diagnostic| unsafe {
                raw::wis_jitter_init(&of, &config, place, bytes, work, room, &mut handle, diagnostic)
            },
        );
        memory.map(Jitter)
    }
}

/// Places inside strata.
pub struct Jitter(Block);

impl Jitter {
    /// A direction inside the stratum of a light, and its pdf there.
    pub fn sample(&self, light: u32, u: [f32; 2]) -> Result<([f32; 3], f32)> {
        let (jitter, drawn) = (self.0.start().cast(), raw::wis_drawn::default());
        // SAFETY: the memory holds a jitter, and the locals live.
        let sample = answered(drawn, |out| unsafe { raw::wis_jitter_sample(jitter, light, u.as_ptr(), out) })?;
        Ok((sample.wi, sample.pdf))
    }
}

/// The lights by contribution, the largest first, and how many are worth a ray.
pub fn order(contribution: &[f32], threshold: f32, index: &mut [u32]) -> Result<usize> {
    assert_eq!(contribution.len(), index.len());
    let (count, contribution, index) = (contribution.len(), contribution.as_ptr(), index.as_mut_ptr());
    // SAFETY: both slices have as many elements.
    answered(0, |out| unsafe { raw::wis_strata_order(count, contribution, threshold, index, out, null_mut()) })
        .map(|traced| traced as usize)
}

/// Visibility in 8 bits, and its memory.
pub struct Visibility(Block);

impl Visibility {
    /// Stores a tree of values from 0 to 1.
    pub fn new(tree: &Tree) -> Result<Visibility> {
        let mut handle = null();
        // SAFETY: the handle is alive, and the block is as long as it says.
        let memory = built(
            |size, diagnostic| unsafe { raw::wis_visibility_size(tree.handle(), size, diagnostic) },
            |place, bytes, _, _, diagnostic| unsafe {
                raw::wis_visibility_init(tree.handle(), place, bytes, &mut handle, diagnostic)
            },
        );
        memory.map(Visibility)
    }

    /// Its bytes.
    pub fn bytes(&self) -> usize {
        self.0.bytes()
    }

    /// The integral of what is seen of a function.
    pub fn product_integral(&self, tree: &Tree) -> Result<f64> {
        // SAFETY: the handles are alive.
        answered(f64::NAN, |out| unsafe {
            raw::wis_visibility_product_integral(tree.handle(), self.0.start().cast(), out)
        })
    }

    /// As [`Tree::sublinear`].
    pub fn integral(
        &self,
        (average, brdf): (f64, &[raw::wis_wavelets]),
        kept: &[raw::wis_wavelets],
        light: &Tree,
    ) -> Result<f64> {
        let (count, list, kept_count, kept) = (brdf.len() as u32, brdf.as_ptr(), kept.len() as u32, kept.as_ptr());
        // SAFETY: the handles are alive and the lists as long as they say.
        answered(f64::NAN, |out| unsafe {
            let (light, visible) = (light.handle(), self.0.start().cast());
            raw::wis_visibility_integral(average, count, list, kept_count, kept, light, visible, out, null_mut())
        })
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
        let (lists, list) = (lists.len() as u32, out.as_mut_ptr());
        raw::wis_triple_blend(lists, handles, counts, weights, room, list, &mut count, null_mut())
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
    let frame = frame.map_or(null(), |frame| frame.as_ptr());
    // SAFETY: the arrays are as long as they must be.
    answered([0.0; 3], |out| unsafe { raw::wis_square_direction(point.as_ptr(), frame, out.cast()) })
}

/// The point of the square of a frame for a world direction.
pub fn square_point(wi: [f32; 3], frame: Option<&[f32; 9]>) -> Result<[f32; 2]> {
    let frame = frame.map_or(null(), |frame| frame.as_ptr());
    // SAFETY: the arrays are as long as they must be.
    answered([0.0; 2], |out| unsafe { raw::wis_square_point(wi.as_ptr(), frame, out.cast()) })
}

/// The slices of a table beside a view, their weights, and the frame about its mirror direction.
pub fn table_view(slices: u32, normal: [f32; 3], wo: [f32; 3]) -> Result<([u32; 2], [f64; 2], [f32; 9])> {
    let (mut slice, mut weight, mut frame) = ([0; 2], [0.0; 2], [0.0; 9]);
    // SAFETY: the arrays are as long as they must be.
    check(unsafe {
        let (slice, weight, frame) = (slice.as_mut_ptr(), weight.as_mut_ptr(), frame.as_mut_ptr());
        raw::wis_table_view(slices, normal.as_ptr(), wo.as_ptr(), slice, weight, frame)
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
