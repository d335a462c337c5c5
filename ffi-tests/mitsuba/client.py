"""An integrator that combines samples of products with those of the BSDF: what tells whether pdfs are exact."""

import drjit as dr
import mitsuba as mi
import numpy as np

import wisdirect as wis
import wisdirect.mitsuba

# Products that are in memory at a time: 16 MB.
BATCH = 4096


class Product(wisdirect.mitsuba.Integrator):
    """One sample of the product and one of the BSDF, combined by the balance heuristic with exact pdfs."""

    def sample(self, scene, sampler, ray, medium=None, active=True):
        light = lambda wi: wisdirect.mitsuba.radiance(scene.environment(), wi)
        si = scene.ray_intersect(mi.Ray3f(ray), active)
        valid, bsdf, context, of = si.is_valid(), si.bsdf(), mi.BSDFContext(), self.tables(scene)
        drawn, value = bsdf.sample(context, si, sampler.next_1d(), sampler.next_2d(), valid)
        of_bsdf, points = si.to_world(drawn.wo), self.points(of, si, bsdf, valid)
        u, rows = np.array(sampler.next_2d()).T, np.array(of_bsdf).T
        of_product, density, at_bsdf = densities(of.light, points, np.flatnonzero(np.array(valid)), u, rows)
        total = dr.select(valid, mi.Color3f(0), light(ray.d))
        wi = mi.Vector3f(*(mi.Float(np.ascontiguousarray(x)) for x in of_product.T))
        f, pdf = bsdf.eval_pdf(context, si, si.to_local(wi), valid)
        traced = valid & (mi.Float(density) > 0)
        seen = ~scene.ray_test(si.spawn_ray(wi), traced)
        total += dr.select(traced & seen, f * light(wi) / (mi.Float(density) + pdf), 0)
        traced = valid & (drawn.pdf > 0)
        seen = ~scene.ray_test(si.spawn_ray(of_bsdf), traced)
        share = drawn.pdf / (drawn.pdf + mi.Float(at_bsdf))
        total += dr.select(traced & seen, value * light(of_bsdf) * share, 0)
        return total, valid, []


def densities(light, points, hits, u, of_bsdf):
    """A sample of each hit's product, its pdf, and the product's pdf of the BSDF's direction."""
    wi, density, at_bsdf = np.zeros_like(of_bsdf), np.zeros(len(u), np.float32), np.zeros(len(u), np.float32)
    wi[:, 2] = 1
    sampler = wis.Sampler()
    for some in np.array_split(hits, max(1, len(hits) // BATCH)):
        for lane, product in zip(some, sampler.prepare(light, points[some])):
            drawn = sampler.sample(light, u[lane:lane + 1], product)
            wi[lane], density[lane] = drawn.wi[0], drawn.pdf[0]
            at_bsdf[lane] = sampler.pdf(light, of_bsdf[lane:lane + 1], product)[0]
    return wi, density, at_bsdf


mi.register_integrator("wis_product", Product)
