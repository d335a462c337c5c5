"""What must hold with Mitsuba: conventions, densities by its own chi-square tool, region means by a z-test."""

import mitsuba as mi
import numpy as np
from mitsuba.chi2 import ChiSquareTest, SphericalDomain

import scenes
import wisdirect as wis
import wisdirect.mitsuba

# Of all z of one run: a false alarm in 10,000 runs of 64 of them. Bonferroni.
Z_LIMIT = 4.9


def rows(vector):
    return np.ascontiguousarray(np.array(vector).T, np.float32)


def vector(rows):
    return mi.Vector3f(*(mi.Float(np.ascontiguousarray(column)) for column in rows.T))


def conventions(pixels, scene):
    """The name that wis_check gives to a light built as Mitsuba looks it up, and to lights that are not."""
    def found(matrix, rows_at_poles=True):
        light = wis.Environment(pixels, world_from_map=matrix, rows_at_poles=rows_at_poles)
        return wis.Sampler().check(light, lambda wi: rows(wisdirect.mitsuba.radiance(scene.environment(), vector(wi))))
    right = scenes.WORLD_FROM_MAP
    built = {
        "as Mitsuba has it": ("none", found(right)),
        "with pbrt-v3's azimuth": ("mirrored", found(np.eye(3))),
        "with +y up": ("axes", found(scenes.MITSUBA_FROM_MAP)),
        "rotated by 90 degrees": ("turned", found(right @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]))),
        "rows half a texel beside the poles": ("rows", found(right, False)),
    }
    return {name: (expected, info.cause, info.error) for name, (expected, info) in built.items()}


def chi_square(environment, product, samples=200_000):
    """The p-value of Mitsuba's test of samples against the pdf; the light alone if `product` is none."""
    sampler = wis.Sampler()

    def sample(u):
        return vector(sampler.sample(environment, np.array(u).T, product).wi)

    def pdf(wi):
        return mi.Float(sampler.pdf(environment, rows(wi), product))

    test = ChiSquareTest(domain=SphericalDomain(), sample_func=sample, pdf_func=pdf, sample_dim=2, sample_count=samples, res=101,
                         ires=8)
    passed = test.run(0.01, test_count=8)
    return float(test.p_value), bool(passed)


def densities(pixels):
    """Chi-square tests of a light and of products at hits of every material, on a map small enough for Mitsuba's quadrature."""
    small = pixels[::16, ::16]
    environment = wis.Environment(small, world_from_map=scenes.WORLD_FROM_MAP, rows_at_poles=True)
    found = {"light alone": chi_square(environment, None)}
    for number, (name, bsdf) in enumerate(scenes.MATERIALS):
        lobes = wisdirect.mitsuba.described.get(f"shape{number}") or wisdirect.mitsuba.lobes(mi.load_dict(bsdf))
        f0 = [np.broadcast_to(of, 3) for of in lobes.f0]
        points = wis.Points((0, 0, 1), (0.48, -0.36, 0.8), wis.Material(lobes.shapes), weight=0.5, f0=f0)
        found[name] = chi_square(environment, wis.Sampler().prepare(environment, points)[0])
    return found


def regions(scene, width, height):
    """The material of each pixel whose corners all see it; -1 elsewhere."""
    sensor = scene.sensors()[0]
    shapes = scene.shapes()
    found = []
    for dx, dy in [(0.02, 0.02), (0.98, 0.02), (0.02, 0.98), (0.98, 0.98)]:
        x, y = np.meshgrid((np.arange(width) + dx) / width, (np.arange(height) + dy) / height)
        at = mi.Point2f(mi.Float(x.ravel().astype(np.float32)), mi.Float(y.ravel().astype(np.float32)))
        ray, _ = sensor.sample_ray(0.0, 0.5, at, mi.Point2f(0.5))
        si = scene.ray_intersect(ray)
        number = mi.Int32(-1)
        for shape in shapes:
            number[si.is_valid() & (si.shape == mi.ShapePtr(shape))] = int(shape.id().removeprefix("shape"))
        found.append(np.array(number))
    same = np.all([f == found[0] for f in found], axis=0)
    return np.where(same, found[0], -1).reshape(height, width)


def z_scores(ours, stock, region):
    """Of each material: the difference of the mean luminance as a share, its standard error, and z."""
    def means(images, number):
        per_image = images[:, region == number].mean(axis=1)
        return per_image.mean(), per_image.std(ddof=1) / np.sqrt(len(per_image))
    found = {}
    for number, (name, _) in enumerate(scenes.MATERIALS):
        if not (region == number).any():
            continue
        (a, da), (b, db) = means(ours, number), means(stock, number)
        error = np.hypot(da, db)
        found[name] = ((a - b) / b, error / b, (a - b) / error)
    return found
