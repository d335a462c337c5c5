//! What calls wis_direct at a hit, with or without portals, and perhaps tells a visibility cache what rays saw.

use anyhow::Result;
use glam::Vec3;
use std::ptr::null_mut;
use wis_ffi_tests::client::{self, Block, check, pixel_seed, raw, size, told};
use wis_ffi_tests::environment::{Sampler, material};
use wis_ffi_tests::material::Bsdf;
use wis_ffi_tests::scene::{Scene, ShadingPoint};
use wis_ffi_tests::setting::Setting;

/// Places of surfaces, as wide as a twentieth of the scene.
const PLACES: u32 = 2048;
const CELL: f32 = 0.1;

/// A visibility cache.
struct Cache(Block);

impl Cache {
    fn new() -> client::Result<Cache> {
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
    fn lend(&mut self, place: &ShadingPoint, point: &mut raw::wis_point) -> client::Result<()> {
        let (position, normal) = (place.origin.to_array(), place.normal.to_array());
        point.visibility = self.0.start_mut().cast();
        let key = &mut point.visibility_key;
        // SAFETY: the pointers are to three floats each and to a number, all alive.
        check(unsafe { raw::wis_visibility_key(position.as_ptr(), normal.as_ptr(), CELL, key) })
    }

    /// Whether a ray of a point that has the cache reached the light.
    fn record(&mut self, point: &raw::wis_point, wi: &[f32; 3], reached: bool) -> client::Result<()> {
        let reached = u8::from(reached);
        // SAFETY: one direction and one answer, both alive; the cache that the point holds is this one.
        check(unsafe { raw::wis_visibility_cache_record(point, 1, wi.as_ptr(), 0, &reached) })
    }

    fn end_pass(&mut self) -> client::Result<()> {
        // SAFETY: the handle is alive, and no other call uses it.
        check(unsafe { raw::wis_visibility_cache_end_pass(self.0.start_mut().cast()) })
    }
}

pub struct Renderer {
    sampler: Sampler,
    material: raw::wis_material,
    cache: Option<Cache>,
    has_portals: bool,
    rays: Vec<raw::wis_ray>,
}

impl Renderer {
    /// For so many rays a hit, with or without a cache and portals.
    pub fn new(setting: &Setting, [has_cache, has_portals]: [bool; 2], rays: usize) -> Result<Renderer> {
        let (sampler, material) = (Sampler::new(rays, 0, 0)?, material(&setting.material.lobes())?);
        let cache = has_cache.then(Cache::new).transpose()?;
        Ok(Renderer { sampler, material, cache, has_portals, rays: vec![raw::wis_ray::default(); rays] })
    }

    pub fn end_pass(&mut self) -> Result<()> {
        Ok(self.cache.as_mut().map_or(Ok(()), Cache::end_pass)?)
    }

    /// What a point reflects, by rays of a seed and a sample.
    pub fn call(
        &mut self,
        scene: &Scene,
        setting: &Setting,
        place: &ShadingPoint,
        (seed, sample): (u32, u32),
    ) -> Result<f64> {
        let Renderer { sampler, material, cache, has_portals, rays } = self;
        let bsdf = Bsdf::new(setting.material, place);
        let mut point = setting.material.point(place, material);
        (point.seed, point.sample) = (pixel_seed(place.pixel, seed), sample);
        if let Some(cache) = cache {
            cache.lend(place, &mut point)?;
        }
        let mut portals = [raw::wis_portal::default(); raw::WIS_MAX_PORTALS as usize];
        if *has_portals {
            portals.iter_mut().zip(&scene.portals).for_each(|(to, portal)| *to = portal.at(place.origin));
            (point.portals, point.portal_count) = (portals.as_ptr(), scene.portals.len() as u32);
        }
        let count = sampler.direct(setting.tables, &point, None, rays)?;
        let mut sum = 0.0;
        for ray in &rays[..count] {
            let wi = Vec3::from(ray.wi);
            setting.cost.evaluate(1);
            let reflected = bsdf.eval_one(wi).0 * setting.light.radiance(wi) * ray.weight;
            let reached = scene.visible_at(setting.cost, place, wi);
            if let Some(cache) = cache {
                cache.record(&point, &ray.wi, reached)?;
            }
            sum += if reached { f64::from(reflected) } else { 0.0 };
        }
        Ok(sum)
    }
}
