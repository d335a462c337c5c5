"""The package answers the bits of the C library: of twenty.c, which scripts/test-python.sh runs."""

import os

import numpy as np
import pytest

import wisdirect as wis


def expected():
    path = os.environ.get("WIS_TWENTY")
    if not path:
        pytest.skip("WIS_TWENTY names no output of tests/twenty.c: scripts/test-python.sh makes it")
    with open(path) as file:
        return np.array([[int(word, 16) for word in line.split()] for line in file], np.uint32).view(np.float32)


def test_twenty_rays_samples_and_products_have_the_bits_of_the_c_library():
    numbers = expected()
    y, x, c = np.mgrid[:32, :64, :3]
    pixels = ((7 * x + 13 * y + 5 * c) % 32 + np.where((x == 20) & (y == 9), 4096, 1)).astype(np.float32) / 32
    light = wis.Environment(pixels)
    wo = np.zeros((5, 3), np.float32)
    wo[:, 2] = 0.8
    wo[np.arange(5), np.arange(5) % 2] = 0.6
    weight = np.ones((5, 2, 3), np.float32)
    weight[:, 0] = 0.125 * (np.arange(5)[:, None] + 1)
    points = wis.Points((0, 0, 1), wo, wis.Material([wis.lambert(), wis.ggx(0.25)]), weight=weight, f0=[[0] * 3, [0.0625] * 3], sample=3)
    sampler, u = wis.Sampler(4), wis.points_sobol(7, 0, 8)
    rays = sampler.direct(light, points, 4)
    assert (rays.counts == 4).all()
    drawn = [sampler.sample(light, u, product) for product in (None, sampler.prepare(light, points)[4])]
    got = [np.concatenate([rays.wi, rays.weight[..., None]], 2).reshape(20, 4)] + [np.c_[of.wi, of.pdf] for of in drawn]
    np.testing.assert_array_equal(np.concatenate(got).view(np.uint32), numbers.view(np.uint32))
