//! A visibility cache as an object that lends its handle to points.

use std::ptr::null_mut;
use wis_ffi_tests::client::{Block, Result, check, raw, size, told};
use wis_ffi_tests::scene::ShadingPoint;

/// Places of surfaces, as wide as a twentieth of the scene.
const PLACES: u32 = 2048;
const CELL: f32 = 0.1;

pub struct Cache(Block);

impl Cache {
    pub fn new() -> Result<Cache> {
        // SAFETY: both pointers are to live locals.
        let size = size(|size, diagnostic| unsafe { raw::wis_visibility_cache_size(PLACES, size, diagnostic) })?;
        let (mut memory, mut handle) = (Block::new(size.bytes), null_mut());
        // SAFETY: the block is as long as it says, and the other pointers are to live locals.
        told(|diagnostic| unsafe {
            raw::wis_visibility_cache_init(PLACES, memory.start_mut(), memory.bytes(), &mut handle, diagnostic)
        })?;
        Ok(Cache(memory))
    }

    /// Hands the cache to a point, with the key of its place.
    pub fn lend(&mut self, place: &ShadingPoint, point: &mut raw::wis_point) -> Result<()> {
        let (position, normal) = (place.origin.to_array(), place.normal.to_array());
        point.visibility = self.0.start_mut().cast();
        let key = &mut point.visibility_key;
        // SAFETY: the pointers are to three floats each and to a number, all alive.
        check(unsafe { raw::wis_visibility_key(position.as_ptr(), normal.as_ptr(), CELL, key) })
    }

    /// Whether a ray of a point that has the cache reached the light.
    pub fn record(&mut self, point: &raw::wis_point, wi: &[f32; 3], reached: bool) -> Result<()> {
        let reached = u8::from(reached);
        // SAFETY: one direction and one answer, both alive; the cache that the point holds is this one.
        check(unsafe { raw::wis_visibility_cache_record(point, 1, wi.as_ptr(), 0, &reached) })
    }

    pub fn end_pass(&mut self) -> Result<()> {
        // SAFETY: the handle is alive, and no other call uses it.
        check(unsafe { raw::wis_visibility_cache_end_pass(self.0.start_mut().cast()) })
    }
}
