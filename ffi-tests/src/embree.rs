//! A thin safe wrapper of Embree 3: a scene of triangle meshes, nearest hits and shadow rays.

use crate::mesh::Mesh;
use anyhow::{Result, bail};
use embree3_sys as sys;
use glam::Vec3;

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    pub distance: f32,
    /// The geometric normal, unit length, by the orientation of the triangle.
    pub normal: Vec3,
    /// The number of the mesh.
    pub mesh: u32,
    /// The number of the triangle.
    pub triangle: u32,
    /// The weights of its second and third corner.
    pub weights: [f32; 2],
}

/// A committed Embree scene and its device.
pub struct Tracer {
    device: sys::RTCDevice,
    scene: sys::RTCScene,
}

// SAFETY: a committed scene is only read; Embree allows queries from any thread.
unsafe impl Send for Tracer {}
unsafe impl Sync for Tracer {}

impl Tracer {
    /// Builds the acceleration structure.
    ///
    /// # Errors
    /// Embree reports an error.
    pub fn new(meshes: &[Mesh]) -> Result<Tracer> {
        // SAFETY: the string ends in 0; the handles live until drop.
        let tracer = unsafe {
            let device = sys::rtcNewDevice(c"threads=1,set_affinity=0".as_ptr());
            Tracer { device, scene: sys::rtcNewScene(device) }
        };
        for mesh in meshes {
            tracer.attach(mesh)?;
        }
        // SAFETY: the scene is live.
        unsafe { sys::rtcCommitScene(tracer.scene) };
        tracer.check()?;
        Ok(tracer)
    }

    /// The first surface along a ray.
    pub fn intersect(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        let hit = sys::RTCHit {
            Ng_x: 0.0,
            Ng_y: 0.0,
            Ng_z: 0.0,
            u: 0.0,
            v: 0.0,
            primID: u32::MAX,
            geomID: u32::MAX,
            instID: [u32::MAX],
        };
        let mut query = sys::RTCRayHit { ray: ray(origin, direction), hit };
        // SAFETY: the scene is committed; context and ray live through the call and are aligned by their types.
        unsafe { sys::rtcIntersect1(self.scene, &mut context(), &mut query) };
        let normal = Vec3::new(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z).normalize_or_zero();
        let hit = query.hit;
        let (distance, weights) = (query.ray.tfar, [hit.u, hit.v]);
        let found = Hit { distance, normal, mesh: hit.geomID, triangle: hit.primID, weights };
        (hit.geomID != u32::MAX).then_some(found)
    }

    /// Whether anything lies along a ray.
    pub fn occluded(&self, origin: Vec3, direction: Vec3) -> bool {
        let mut ray = ray(origin, direction);
        // SAFETY: as in `intersect`.
        unsafe { sys::rtcOccluded1(self.scene, &mut context(), &mut ray) };
        // Embree answers -inf for an occluded ray.
        ray.tfar < 0.0
    }

    /// Whether anything lies along each of eight rays from a point that stay together.
    pub fn occluded8(&self, origin: Vec3, directions: &[Vec3; 8]) -> [bool; 8] {
        let mut rays = sys::RTCRay8 {
            org_x: [origin.x; 8],
            org_y: [origin.y; 8],
            org_z: [origin.z; 8],
            tnear: [0.0; 8],
            dir_x: directions.map(|d| d.x),
            dir_y: directions.map(|d| d.y),
            dir_z: directions.map(|d| d.z),
            time: [0.0; 8],
            tfar: [f32::INFINITY; 8],
            mask: [u32::MAX; 8],
            id: [0; 8],
            flags: [0; 8],
        };
        let mut context = sys::RTCIntersectContext { flags: sys::RTCIntersectContextFlags::COHERENT, ..context() };
        let all = Mask([-1; 8]);
        // SAFETY: as in `intersect`; the mask is aligned as the rays are.
        unsafe { sys::rtcOccluded8(all.0.as_ptr(), self.scene, &mut context, &mut rays) };
        rays.tfar.map(|far| far < 0.0)
    }

    fn attach(&self, mesh: &Mesh) -> Result<()> {
        let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
        let (vertex, index) = (sys::RTCBufferType::VERTEX, sys::RTCBufferType::INDEX);
        // SAFETY: each buffer is allocated by Embree for exactly the elements that are copied into it.
        unsafe {
            let geometry = sys::rtcNewGeometry(self.device, sys::RTCGeometryType::TRIANGLE);
            let to = sys::rtcSetNewGeometryBuffer(geometry, vertex, 0, sys::RTCFormat::FLOAT3, 12, vertices);
            let corners = sys::rtcSetNewGeometryBuffer(geometry, index, 0, sys::RTCFormat::UINT3, 12, triangles);
            if to.is_null() || corners.is_null() {
                bail!("Embree gives no buffer for {triangles} triangles");
            }
            std::ptr::copy_nonoverlapping(mesh.vertices.as_ptr(), to.cast(), vertices);
            std::ptr::copy_nonoverlapping(mesh.triangles.as_ptr(), corners.cast(), triangles);
            sys::rtcCommitGeometry(geometry);
            sys::rtcAttachGeometry(self.scene, geometry);
            sys::rtcReleaseGeometry(geometry);
        }
        self.check()
    }

    fn check(&self) -> Result<()> {
        // SAFETY: the device may also be null.
        match unsafe { sys::rtcGetDeviceError(self.device) } {
            sys::RTCError::NONE => Ok(()),
            error => bail!("Embree: {error:?}"),
        }
    }
}

impl Drop for Tracer {
    fn drop(&mut self) {
        // SAFETY: both handles are released once.
        unsafe {
            sys::rtcReleaseScene(self.scene);
            sys::rtcReleaseDevice(self.device);
        }
    }
}

/// Which of eight rays are to be traced: -1.
#[repr(align(32))]
struct Mask([i32; 8]);

fn ray(origin: Vec3, direction: Vec3) -> sys::RTCRay {
    sys::RTCRay {
        org_x: origin.x,
        org_y: origin.y,
        org_z: origin.z,
        tnear: 0.0,
        dir_x: direction.x,
        dir_y: direction.y,
        dir_z: direction.z,
        time: 0.0,
        tfar: f32::INFINITY,
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}

fn context() -> sys::RTCIntersectContext {
    sys::RTCIntersectContext { flags: sys::RTCIntersectContextFlags::INCOHERENT, filter: None, instID: [u32::MAX] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_meet_a_sphere_on_the_ground() {
        let centre = Vec3::new(0.0, 0.0, 1.0);
        let tracer = Tracer::new(&[Mesh::ground(10.0), Mesh::sphere(centre, 1.0, 64)]).unwrap();
        let hit = tracer.intersect(Vec3::new(0.0, 0.0, 5.0), Vec3::NEG_Z).unwrap();
        assert!((hit.distance - 3.0).abs() < 1e-2 && hit.normal.z > 0.99 && hit.mesh == 1);
        assert!(tracer.occluded(Vec3::new(0.0, 0.0, 5.0), Vec3::NEG_Z));
        assert!(!tracer.occluded(Vec3::new(0.0, 0.0, 5.0), Vec3::Z));
        assert!(tracer.intersect(Vec3::new(5.0, 0.0, 1.0), Vec3::X).is_none());
        let turns = std::array::from_fn(|i| Vec3::new((i as f32).cos(), 0.3, (i as f32).sin()).normalize());
        let origin = Vec3::new(1.5, -0.4, 0.5);
        let hidden = tracer.occluded8(origin, &turns);
        assert_eq!(hidden, turns.map(|d| tracer.occluded(origin, d)));
        assert!(hidden.contains(&true) && hidden.contains(&false));
    }

    #[test]
    fn blocks_and_spheres_face_outwards() {
        for mesh in [Mesh::sphere(Vec3::Z, 1.0, 16), Mesh::block(Vec3::splat(-1.0), Vec3::ONE)] {
            let corner = |i: u32| mesh.vertices[i as usize];
            let volume = |&[a, b, c]: &[u32; 3]| corner(a).dot(corner(b).cross(corner(c)));
            assert!(mesh.triangles.iter().map(volume).sum::<f32>() > 0.0);
        }
    }
}
