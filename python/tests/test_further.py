"""What few clients need: visibility of earlier passes, a BRDF of one's own in the choice of rays."""

import numpy as np
import pytest

import wisdirect as wis

UP = np.array([0, 0, 1], np.float32)
CHALK = wis.Material([wis.lambert()])
LIGHT = wis.Environment(np.ones((16, 32), np.float32))
COUNT = 512


def of_pass(number, **more):
    return wis.Points(np.tile(UP, (COUNT, 1)), (0, 0, 1), CHALK, seed=np.arange(COUNT) + COUNT * number, **more)


def test_a_cache_prefers_what_earlier_passes_reached():
    cache, shares, means = wis.VisibilityCache(4), [], []
    for number in range(8):
        points = of_pass(number, visibility=cache, visibility_key=1)
        rays = wis.direct(LIGHT, points)
        reached = rays.wi[..., 0] < 0
        shares.append(reached.mean())
        means.append((rays.weight * rays.wi[..., 2] / np.pi * reached).sum() / COUNT)
        cache.record(points, rays, reached)
        cache.end_pass()
    # Half of the sky is hidden: a cache that is ignored stays at one half, five standard errors below.
    assert abs(shares[0] - 0.5) < 0.11 < shares[-1] - 0.5
    assert abs(np.mean(means) - 0.5) < 0.05


def test_keys_tell_places_apart():
    keys = wis.visibility_keys([(0, 0, 0), (0.1, 0, 0), (9, 0, 0)], UP, 1)
    assert keys[0] == keys[1] != keys[2] and (keys > 0).all()


def test_a_target_of_ones_own_chooses_the_rays():
    def target(number, wi):
        return np.maximum(wi[:, 2], 0) / np.pi * (wi[:, 0] > 0) * (number + 1)

    rays = wis.Sampler().direct_target(LIGHT, of_pass(0), target)
    # A twentieth of the weight stays with all candidates; without the target it would be one half of the rays.
    assert (rays.wi[..., 0] > 0).mean() > 0.85
    # Five standard errors, which are smaller than 2 %.
    found = (rays.weight * np.maximum(rays.wi[..., 2], 0) / np.pi * (rays.wi[..., 0] > 0)).sum(1)
    assert abs(found.mean() - 0.5) < 5 * found.std() / np.sqrt(COUNT) < 0.1

    def broken(number, wi):
        raise KeyError(number)

    with pytest.raises(KeyError):
        wis.Sampler().direct_target(LIGHT, of_pass(0), broken)
