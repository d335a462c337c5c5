"""Integrators of Mitsuba that take their rays from wis: direct light in waves, and classic MIS with products."""

import ctypes as c
from concurrent.futures import ThreadPoolExecutor

import drjit as dr
import mitsuba as mi
import numpy as np

import wis
from scenes import MATERIALS

THREADS = 2


class Base(mi.SamplingIntegrator):
    """What both have in common: hits as arrays, and lobes for Mitsuba's BSDFs."""

    def __init__(self, props):
        super().__init__(props)
        self.rays = props.get("rays", 4)
        # For each ray; 0: the library's choice.
        self.candidates = props.get("candidates", 0)

    def prepare_for(self, scene, environment, spp, repeat=0):
        self.environment, self.spp, self.repeat = environment, spp, repeat
        self.shapes = scene.shapes()
        self.materials = wis.materials([lobes for _, _, lobes, _, _ in MATERIALS])
        self.samplers = [wis.Sampler(self.rays, self.candidates) for _ in range(THREADS)]

    def lights(self, scene, wi):
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(wi))
        si.wi = -wi
        return scene.environment().eval(si)

    def hits(self, si):
        """Everything that wis reads of the hits, numbers in columns of their own."""
        valid = si.is_valid()
        number = mi.UInt32(0)
        for k, shape in enumerate(self.shapes):
            number[valid & (si.shape == mi.ShapePtr(shape))] = int(shape.id().removeprefix("shape"))
        normal = dr.select(valid, si.sh_frame.n, mi.Vector3f(0, 0, 1))
        wo = dr.select(valid, si.to_world(si.wi), mi.Vector3f(0, 0, 1))
        diffuse = dr.select(valid, si.bsdf().eval_diffuse_reflectance(si, valid), mi.Color3f(0))
        dr.eval(number, normal, wo, diffuse, valid)
        number, diffuse = np.array(number), np.array(diffuse)
        weight, f0 = np.zeros((6, len(number)), np.float32), np.zeros((6, len(number)), np.float32)
        for k, (_, _, lobes, factor, specular) in enumerate(MATERIALS):
            of = number == k
            glossy = 0 if factor is None else 3
            if factor is not None:
                weight[:3, of] = factor * diffuse[:, of] if np.isscalar(factor) else np.array(factor, np.float32)[:, None]
            if specular is not None:
                weight[glossy:glossy + 3, of] = 1
                f0[glossy:glossy + 3, of] = np.array(specular, np.float32)[:, None]
        return np.array(valid).astype(np.uint8), number, np.array(normal), np.array(wo), weight, f0

    def seeds(self, count):
        """The pixel and the number of the sample of each lane; a pixel of its own for each repeat."""
        lane = np.arange(count, dtype=np.uint32)
        pixels = np.uint32(count // self.spp)
        return lane // self.spp + np.uint32(self.repeat) * pixels, lane % np.uint32(self.spp)


class Direct(Base):
    """wis_direct_wave: a few rays a hit, each with a weight; f, L and visibility are Mitsuba's."""

    def sample(self, scene, sampler, ray, medium=None, active=True):
        si = scene.ray_intersect(mi.Ray3f(ray), active)
        mask, number, normal, wo, weight, f0 = self.hits(si)
        count = len(mask)
        seed, sample = self.seeds(count)
        rays = np.zeros((4 * self.rays, count), np.float32)

        def part(of):
            # Cut between pixels, so that the result does not depend on the number of threads.
            first, last = (count // self.spp * k // THREADS * self.spp for k in (of, of + 1))
            columns = lambda a: wis.Floats(a[:, first:].ctypes.data, 4, 4 * count)
            counts = np.zeros(last - first, np.uint32)
            ints = lambda a: wis.Ints(a[first:].ctypes.data, 4)
            wave = wis.sized(wis.Wave, material_count=len(self.materials), rays=self.rays,
                             materials=c.cast(self.materials, c.c_void_p), material=ints(number), mask=mask[first:].ctypes.data,
                             normal=columns(normal), wo=columns(wo), weight=columns(weight), f0=columns(f0), seed=ints(seed),
                             sample=ints(sample), ray=columns(rays), count=counts.ctypes.data)
            wis.check(wis.library.wis_direct_wave(self.samplers[of].handle, self.environment.handle,
                                                  c.c_size_t(last - first), c.byref(wave)))

        with ThreadPoolExecutor(THREADS) as threads:
            list(threads.map(part, range(THREADS)))
        valid = si.is_valid()
        total = dr.select(valid, mi.Color3f(0), self.lights(scene, ray.d))
        bsdf, context = si.bsdf(), mi.BSDFContext()
        for k in range(self.rays):
            x, y, z, factor = (mi.Float(rays[4 * k + j]) for j in range(4))
            wi = mi.Vector3f(x, y, z)
            traced = valid & (factor > 0)
            f = bsdf.eval(context, si, si.to_local(wi), traced)
            seen = ~scene.ray_test(si.spawn_ray(wi), traced & (dr.max(f) > 0))
            total += dr.select(traced & seen, f * self.lights(scene, wi) * factor, 0)
        return total, valid, []


class Product(Base):
    """One sample of the product and one of the BSDF, combined by the balance heuristic with exact pdfs."""

    def sample(self, scene, sampler, ray, medium=None, active=True):
        si = scene.ray_intersect(mi.Ray3f(ray), active)
        valid, bsdf, context = si.is_valid(), si.bsdf(), mi.BSDFContext()
        mask, number, normal, wo, weight, f0 = self.hits(si)
        drawn, value = bsdf.sample(context, si, sampler.next_1d(), sampler.next_2d(), valid)
        of_bsdf = si.to_world(drawn.wo)
        u = np.array(sampler.next_2d()).T
        of_product, density, at_bsdf = self.densities(mask, number, normal.T, wo.T, weight.T, f0.T, u, np.array(of_bsdf).T)
        total = dr.select(valid, mi.Color3f(0), self.lights(scene, ray.d))
        wi = mi.Vector3f(*(mi.Float(np.ascontiguousarray(x)) for x in of_product.T))
        f, pdf = bsdf.eval_pdf(context, si, si.to_local(wi), valid)
        traced = valid & (mi.Float(density) > 0)
        seen = ~scene.ray_test(si.spawn_ray(wi), traced)
        total += dr.select(traced & seen, f * self.lights(scene, wi) / (mi.Float(density) + pdf), 0)
        traced = valid & (drawn.pdf > 0)
        seen = ~scene.ray_test(si.spawn_ray(of_bsdf), traced)
        share = drawn.pdf / (drawn.pdf + mi.Float(at_bsdf))
        total += dr.select(traced & seen, value * self.lights(scene, of_bsdf) * share, 0)
        return total, valid, []

    def densities(self, mask, number, normal, wo, weight, f0, u, of_bsdf):
        with_hit = np.flatnonzero(mask)
        wi, density, at_bsdf = np.zeros_like(of_bsdf), np.zeros(len(mask), np.float32), np.zeros(len(mask), np.float32)
        wi[:, 2] = 1
        sampler = self.samplers[0]
        for some in np.array_split(with_hit, max(1, len(with_hit) // 4096)):
            points = points_at(self.materials, number[some], normal[some], wo[some], weight[some], f0[some])
            memory, products = sampler.prepare(self.environment, points)
            for lane, product in zip(some, products):
                drawn = sampler.sample(self.environment, product, u[lane:lane + 1])[0]
                wi[lane], density[lane] = drawn[:3], drawn[3]
                at_bsdf[lane] = sampler.pdf(self.environment, product, of_bsdf[lane:lane + 1])[0]
        return wi, density, at_bsdf


def points_at(materials, number, normal, wo, weight, f0):
    points = (wis.Point * len(number))()
    for i, point in enumerate(points):
        point.size = c.sizeof(wis.Point)
        point.material = c.addressof(materials) + int(number[i]) * c.sizeof(wis.Material)
        point.normal[:], point.wo[:] = normal[i].tolist(), wo[i].tolist()
        point.weight[:6], point.f0[:6] = weight[i].tolist(), f0[i].tolist()
    return points


mi.register_integrator("wis_direct", Direct)
mi.register_integrator("wis_product", Product)
