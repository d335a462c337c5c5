//! Direct light for many points in one call, in the caller's own layout of arrays.

use super::light::{EnvironmentObject, environment as view};
use super::material::{
    MaterialData, POINT_FLAGS, WIS_MAX_LOBES, WIS_POINT_COMPENSATED, WIS_POINT_COSINE_INCLUDED,
    WIS_POINT_PORTALS_COMPLETE, WIS_POINT_WHOLE_SPHERE, material,
};
use super::sampler::{SamplerObject, with_sampler};
use super::visibility::{VisibilityCacheObject, factors};
use super::{Checked, sized};
use crate::brdf::material::Material;
use crate::brdf::point::Point;
use crate::brdf::portal::{MAX_PORTALS, Portal};
use crate::direct::Ray;
use crate::direct::sampler::{Sampler, Sequence, WAVE_RAYS};
use crate::light::environment::Environment;
use crate::status::{Error, Status};

/// Numbers of all points: number `k` of point `i` stands `i * point + k * number` bytes behind `first`.
/// Array of structures: point = sizeof the structure, number = 4. Structure of arrays: point = 4, number = bytes of a column. Points that
/// have a number in common are WIS_INVALID_ARGUMENT, unless all share all of them.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct FloatsIn {
    /// The first number of point 0; null where that is allowed.
    pub first: *const f32,
    /// Bytes from a point to the next; 0: all points share these numbers.
    pub point: isize,
    /// Bytes from a number to the next; 0: they stand close together.
    pub number: isize,
}

/// As wis_floats_in, for numbers that are written. `point` must not be 0.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct FloatsOut {
    /// The first number of point 0.
    pub first: *mut f32,
    /// Bytes from a point to the next.
    pub point: isize,
    /// Bytes from a number to the next; 0: they stand close together.
    pub number: isize,
}

/// A whole number of each point.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct IntsIn {
    /// The number of point 0; null where that is allowed.
    pub first: *const u32,
    /// Bytes from a point to the next; 0: all points share it.
    pub point: isize,
}

/// The points of a wave, and where their rays go.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct DirectWave {
    /// sizeof(wis_wave).
    pub size: u32,
    /// WIS_POINT_* of all points.
    pub flags: u32,
    /// How many materials there are.
    pub material_count: u32,
    /// The most rays for each point, at most as many as the sampler was made for.
    pub rays: u32,
    /// The materials, each after wis_material_init.
    pub materials: *const MaterialData,
    /// The material of each point, below material_count. Null: material 0.
    pub material: IntsIn,
    /// Points whose byte is 0 are left out: their count is 0 and nothing else of them is read. Null: none.
    pub mask: *const u8,
    /// Three numbers each: the shading normal.
    pub normal: FloatsIn,
    /// Three numbers each; null: any, if no lobe is anisotropic.
    pub tangent: FloatsIn,
    /// Three numbers each: the direction to the viewer.
    pub wo: FloatsIn,
    /// Three numbers for each lobe, lobe after lobe: RGB factors. Null: 1.
    pub weight: FloatsIn,
    /// Three numbers for each lobe, lobe after lobe: reflectance at normal incidence. Null: 0.
    pub f0: FloatsIn,
    /// The pixel of each point; wis_sampler_begin_pixel is called where it changes.
    pub seed: IntsIn,
    /// The number of the hit of each point among all hits of its pixel and bounce; null: 0.
    pub sample: IntsIn,
    /// The bounce of each point; null: 0.
    pub bounce: IntsIn,
    /// The place of each point in `visibility`; null: 0, which is none.
    pub visibility_key: IntsIn,
    /// How many portals each point has, at most WIS_MAX_PORTALS; null: 0.
    pub portal_count: IntsIn,
    /// Nine numbers each, portal after portal, as in wis_portal. Null only without `portal_count`.
    pub portal: FloatsIn,
    /// Positions, taken from the corners of portals, so that points share portals of the world. Null: 0.
    pub position: FloatsIn,
    /// What rays of earlier passes saw. Null: not known.
    pub visibility: *mut VisibilityCacheObject,
    /// Four numbers for each ray, ray after ray: direction and weight.
    pub ray: FloatsOut,
    /// How many rays each point has.
    pub count: *mut u32,
    /// A wis_status for each point, as a byte: a bad point never fails the others. May be null.
    pub status: *mut u8,
}

/// Numbers of a portal.
const NUMBERS: usize = size_of::<Portal>() / size_of::<f32>();

impl FloatsIn {
    /// Checks `numbers` of each of `count` points.
    #[inline(never)]
    fn check(&self, allowed_null: bool, numbers: usize, count: usize, field: &'static core::ffi::CStr) -> Checked<()> {
        let fail = |status| Err(Error::new(status, 4).of(field));
        match (self.first.is_null(), self.first.is_aligned() && self.point % 4 == 0 && self.number % 4 == 0) {
            (true, _) if allowed_null => Ok(()),
            (true, _) => fail(Status::NullPointer),
            (_, false) => fail(Status::Misaligned),
            _ if self.point != 0 && self.overlaps(numbers, count) => fail(Status::InvalidArgument),
            _ => Ok(()),
        }
    }

    /// Whether two points have a number in common: the strides p and n have the least common multiple |p| / g n, which |p| / g numbers of
    /// one point and |n| / g points reach.
    fn overlaps(&self, numbers: usize, count: usize) -> bool {
        let (point, number) =
            (self.point.unsigned_abs(), if self.number == 0 { 4 } else { self.number.unsigned_abs() });
        let (mut g, mut rest) = (point, number);
        while rest != 0 {
            (g, rest) = (rest, g % rest);
        }
        point < g.saturating_mul(numbers) && number < g.saturating_mul(count)
    }

    /// # Safety
    /// The array holds the numbers of point `i`.
    unsafe fn read(&self, i: usize, k: usize) -> f32 {
        let number = if self.number == 0 { 4 } else { self.number };
        // SAFETY: inside the caller's array, whose strides keep the alignment of a float.
        unsafe { self.first.byte_offset(i as isize * self.point + k as isize * number).read() }
    }

    /// # Safety
    /// As [`FloatsIn::read`], if not null.
    unsafe fn three(&self, i: usize, from: usize, otherwise: f32) -> [f32; 3] {
        if self.first.is_null() {
            return [otherwise; 3];
        }
        // SAFETY: the caller's contract.
        unsafe { [self.read(i, from), self.read(i, from + 1), self.read(i, from + 2)] }
    }
}

impl IntsIn {
    #[inline(never)]
    fn check(&self, allowed_null: bool, field: &'static core::ffi::CStr) -> Checked<()> {
        // One number each: no two points overlap.
        FloatsIn { first: self.first.cast(), point: self.point, number: 0 }.check(allowed_null, 1, 0, field)
    }

    /// # Safety
    /// The array holds the number of point `i`, if it is not null.
    unsafe fn read(&self, i: usize) -> u32 {
        // SAFETY: inside the caller's array, whose stride keeps the alignment.
        if self.first.is_null() { 0 } else { unsafe { self.first.byte_offset(i as isize * self.point).read() } }
    }
}

impl FloatsOut {
    fn check(&self, numbers: usize, count: usize, field: &'static core::ffi::CStr) -> Checked<()> {
        FloatsIn { first: self.first, point: self.point, number: self.number }.check(false, numbers, count, field)?;
        if self.point == 0 { Err(Error::new(Status::InvalidArgument, 4).of(field)) } else { Ok(()) }
    }

    /// # Safety
    /// The array has room for the numbers of point `i`.
    unsafe fn write(&self, i: usize, k: usize, value: f32) {
        let number = if self.number == 0 { 4 } else { self.number };
        // SAFETY: inside the caller's array, whose strides keep the alignment of a float.
        unsafe { self.first.byte_offset(i as isize * self.point + k as isize * number).write(value) }
    }
}

impl DirectWave {
    fn check(&self, count: usize) -> Checked<()> {
        if self.flags & !POINT_FLAGS != 0 {
            return Err(Error::new(Status::InvalidArgument, 4).of(c"flags"));
        }
        self.normal.check(false, 3, count, c"normal")?;
        self.tangent.check(true, 3, count, c"tangent")?;
        self.wo.check(false, 3, count, c"wo")?;
        self.weight.check(true, 3, count, c"weight")?;
        self.f0.check(true, 3, count, c"f0")?;
        self.material.check(true, c"material")?;
        self.seed.check(false, c"seed")?;
        self.sample.check(true, c"sample")?;
        self.bounce.check(true, c"bounce")?;
        self.visibility_key.check(true, c"visibility_key")?;
        self.portal_count.check(true, c"portal_count")?;
        self.portal.check(self.portal_count.first.is_null(), NUMBERS, count, c"portal")?;
        self.position.check(true, 3, count, c"position")?;
        self.ray.check((self.rays as usize).saturating_mul(4), count, c"ray")?;
        super::pointer(self.count, 4).map_err(|failure| failure.of(c"count"))?;
        if self.material_count > 0 {
            super::pointer(self.materials, 4).map_err(|failure| failure.of(c"materials"))?;
        }
        Ok(())
    }

    /// # Safety
    /// The arrays hold point `i`.
    unsafe fn material(&self, i: usize) -> Checked<&Material> {
        if self.material_count == 0 {
            return Ok(&Material::NONE);
        }
        // SAFETY: the caller's contract; the number is below the count.
        unsafe {
            let number = self.material.read(i);
            if number >= self.material_count {
                return Err(Error::new(Status::InvalidArgument, 4).of(c"material"));
            }
            material(self.materials.add(number as usize), 4)
        }
    }

    /// The first portals of point `i`, relative to it.
    ///
    /// # Safety
    /// The arrays hold point `i`, and so many portals of it.
    #[inline(never)]
    unsafe fn portals(&self, i: usize, count: usize) -> [Portal; MAX_PORTALS] {
        let mut portals = [Portal::default(); MAX_PORTALS];
        // SAFETY: the caller's contract.
        let at = unsafe { self.position.three(i, 0, 0.0) };
        let numbers: &mut [f32] = bytemuck::cast_slice_mut(&mut portals);
        for (k, number) in numbers.iter_mut().take(NUMBERS * count).enumerate() {
            // SAFETY: the caller's contract. Corners come first, and edges are the same everywhere.
            *number = unsafe { self.portal.read(i, k) } - at.get(k % NUMBERS).unwrap_or(&0.0);
        }
        portals
    }

    /// The rays of point `i`: how many.
    ///
    /// # Safety
    /// The arrays hold point `i`.
    unsafe fn point(
        &self,
        sampler: &mut Sampler<'_>,
        environment: &Environment<'_>,
        i: usize,
        room: &mut [Ray],
    ) -> Checked<usize> {
        // SAFETY: the caller's contract.
        unsafe {
            let material = self.material(i)?;
            let mut point = Point::new(material, self.normal.three(i, 0, 0.0), self.wo.three(i, 0, 0.0));
            point.tangent = self.tangent.three(i, 0, 0.0);
            point.whole_sphere = self.flags & WIS_POINT_WHOLE_SPHERE != 0;
            point.cosine_included = self.flags & WIS_POINT_COSINE_INCLUDED != 0;
            point.compensated = self.flags & WIS_POINT_COMPENSATED != 0;
            for lobe in 0..material.lobes().len().min(WIS_MAX_LOBES) {
                if let (Some(weight), Some(f0)) = (point.weight.get_mut(lobe), point.f0.get_mut(lobe)) {
                    *weight = self.weight.three(i, 3 * lobe, 1.0);
                    *f0 = self.f0.three(i, 3 * lobe, 0.0);
                }
            }
            let portals;
            let count = self.portal_count.read(i) as usize;
            if count > 0 {
                portals = self.portals(i, count);
                let fault = Error::new(Status::InvalidArgument, 4).of(c"portal_count");
                point.portals = portals.get(..count).ok_or(fault)?;
                point.portals_complete = self.flags & WIS_POINT_PORTALS_COMPLETE != 0;
            }
            point.seen = factors(self.visibility, self.visibility_key.read(i), self.seed.read(i), 4)?;
            let at = Sequence { seed: self.seed.read(i), sample: self.sample.read(i), bounce: self.bounce.read(i) };
            let rays = room.get_mut(..self.rays as usize).unwrap_or_default();
            sampler.direct(environment, &point, at, self.rays as usize, rays).map_err(|error| error.instead(4))
        }
    }
}

/// Rays of one point at the most, in a wave.
pub const WIS_WAVE_RAYS: usize = 64;
const _: () = assert!(WIS_WAVE_RAYS == WAVE_RAYS);

/// As `count` calls of wis_direct, in order, with wis_sampler_begin_pixel where the seed changes: the same bits. A point that is
/// wrong gets a status of its own and no rays. `wave` and its arrays are read during the call only.
/// Work: count x rays x candidates x lobes.
///
/// # Safety
/// Pointers are null or point to what the header says; arrays hold `count` points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_direct_wave(
    sampler: *mut SamplerObject,
    environment: *const EnvironmentObject,
    count: usize,
    wave: *const DirectWave,
) -> Status {
    // SAFETY: the caller's contract, also for what stands inside.
    unsafe {
        with_sampler(sampler, |sampler| {
            let environment = view(environment, 2)?;
            let wave = sized(wave, 4)?;
            if count == 0 {
                return Ok(());
            }
            wave.check(count)?;
            if wave.rays > sampler.config().rays || wave.rays as usize > WIS_WAVE_RAYS {
                return Err(Error::new(Status::InvalidArgument, 4).of(c"rays"));
            }
            let room = sampler.take_wave();
            let mut seed = None;
            for i in 0..count {
                let left_out = !wave.mask.is_null() && wave.mask.add(i).read() == 0;
                let answer = if left_out {
                    Ok(0)
                } else {
                    let own = wave.seed.read(i);
                    if seed != Some(own) {
                        sampler.begin_pixel();
                        seed = Some(own);
                    }
                    wave.point(sampler, &environment, i, room)
                };
                let (status, got) = match answer {
                    Ok(got) => (Status::Ok, got),
                    Err(failure) => (failure.status, 0),
                };
                for (r, ray) in room.iter().take(got).enumerate() {
                    let [x, y, z] = ray.wi;
                    for (k, value) in [x, y, z, ray.weight].into_iter().enumerate() {
                        wave.ray.write(i, 4 * r + k, value);
                    }
                }
                wave.count.add(i).write(got as u32);
                if !wave.status.is_null() {
                    wave.status.add(i).write(status as u8);
                }
            }
            Ok(())
        })
    }
}
