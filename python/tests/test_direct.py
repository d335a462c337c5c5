"""Rays at points: means against quadrature, arrays of any order, threads, portals."""

import threading
import time

import numpy as np
import pytest

import wisdirect as wis

UP = np.array([0, 0, 1], np.float32)
MIXED = wis.Material([wis.lambert(), wis.ggx(0.25)])


def sky():
    pixels = np.full((32, 64), 0.5, np.float32)
    pixels[16:] = 0.1
    pixels[6, 40] = 300
    return pixels


def radiance(pixels, wi):
    height, width = pixels.shape
    x = np.arctan2(wi[..., 1], wi[..., 0]) / (2 * np.pi) % 1 * width
    y = np.arccos(np.clip(wi[..., 2], -1, 1)) / np.pi * height
    return pixels[np.minimum(y.astype(int), height - 1), np.minimum(x.astype(int), width - 1)]


def some_points(count, **more):
    random = np.random.default_rng(1)
    wo = random.normal(size=(count, 3)).astype(np.float32)
    wo[:, 2] = np.abs(wo[:, 2]) + 0.2
    return wis.Points(UP, wo / np.linalg.norm(wo, axis=1, keepdims=True), MIXED, f0=0.04, **more)


def same(a, b):
    return all((x == y).all() for x, y in zip(a, b))


def test_a_diffuse_point_reflects_what_quadrature_says():
    pixels = sky()
    light, chalk = wis.Environment(pixels, filter="nearest"), wis.Material([wis.lambert()])
    rays = wis.direct(light, wis.Points(np.tile(UP, (20_000, 1)), (0.6, 0, 0.8), chalk), 2)
    found = (rays.weight * np.maximum(rays.wi[..., 2], 0) / np.pi * radiance(pixels, rays.wi)).sum(1, dtype=np.float64)
    # Texels of the nearest filter: the integral of cosine over rows of the upper half is exact.
    edges = np.cos(np.linspace(0, np.pi, 33)) ** 2
    exact = (pixels[:16] * (edges[:16] - edges[1:17])[:, None] / 2 * (2 * np.pi / 64)).sum() / np.pi
    error = found.std() / np.sqrt(len(found))
    # A wrong library fails if it is off by 1 %: five standard errors.
    assert 5 * error < 0.01 * exact
    assert abs(found.mean() - exact) < 5 * error


def test_orders_of_arrays_and_shared_elements_change_no_bit():
    light, n = wis.Environment(sky()), 300
    points = some_points(n)
    normal, wo = np.tile(UP, (n, 1)), points._floats["wo"]
    rows = wis.direct(light, wis.Points(normal, wo, MIXED, f0=np.full((n, 2, 3), 0.04)), 3)
    columns = [np.asfortranarray(a) for a in (normal, wo)]
    out = np.empty((3, 4, n), np.float32).transpose(2, 0, 1)
    assert same(rows, wis.direct(light, wis.Points(*columns, MIXED, f0=[[[0.04] * 3] * 2]), 3, out=out))
    backwards = [np.ascontiguousarray(a[::-1])[::-1] for a in (normal, wo)]
    assert same(rows, wis.direct(light, wis.Points(*backwards, MIXED, f0=0.04), 3))
    assert same(rows, wis.direct(light, points, 3))
    assert np.shares_memory(columns[1], wis.Points(*columns, MIXED)._floats["wo"])


def test_threads_change_no_bit_and_the_gil_is_free():
    light, points = wis.Environment(sky()), some_points(100_000)
    done = []
    thread = threading.Thread(target=lambda: done.append(wis.direct(light, points, 4, threads=1)))
    thread.start()
    ticks = 0
    while thread.is_alive():
        time.sleep(0.001)
        ticks += 1
    # One call of 0.1 s and more: if it held the lock, this thread would have slept through it.
    assert ticks > 10
    assert same(done[0], wis.direct(light, points, 4, threads=3))


def test_points_that_are_left_out_have_no_rays():
    mask = np.arange(8) % 2 == 0
    rays = wis.direct(wis.Environment(sky()), some_points(8, mask=mask), 2)
    assert (rays.counts == 2 * mask).all() and (rays.weight[~mask] == 0).all()
    out = np.full((8, 2, 4), np.nan, np.float32)
    assert same(rays, wis.direct(wis.Environment(sky()), some_points(8, mask=mask), 2, out=out))


def test_rays_of_complete_portals_leave_through_them():
    # The edges' cross product points into the room, along -x.
    window = [[[2, -1, 1], [0, 0, 1], [0, 2, 0]]]
    position = np.random.default_rng(2).uniform(-1, 1, (200, 3)) * (1, 1, 0)
    rays = wis.direct(wis.Environment(sky()), some_points(200, portals=window, position=position, portals_complete=True), 4)
    at = position[:, None] + rays.wi * ((2 - position[:, :1]) / rays.wi[..., 0])[..., None]
    lit = rays.weight > 0
    assert lit.mean() > 0.9
    assert (np.abs(at[lit][:, 1]) < 1.001).all() and (np.abs(at[lit][:, 2] - 1.5) < 0.501).all()


def test_samples_and_pdfs_have_the_same_bits_and_u_leads_back():
    light, sampler, u = wis.Environment(sky()), wis.Sampler(), wis.points_sobol(3, 0, 256)
    for product in [None] + sampler.prepare(light, some_points(3)):
        drawn = sampler.sample(light, u, product)
        assert (drawn.pdf > 0).all()
        np.testing.assert_array_equal(sampler.pdf(light, drawn.wi, product), drawn.pdf)
        back, status = sampler.invert(light, drawn.wi, product)
        ok = status == wis.Status.OK
        assert ok.mean() > 0.9
        again = sampler.sample(light, back[ok], product)
        assert np.median(np.abs(again.wi - drawn.wi[ok]).max(1)) < 1e-3


def test_numbers_are_read_in_any_order():
    light, sampler, u = wis.Environment(sky()), wis.Sampler(), wis.points_sobol(3, 0, 64)
    rows = sampler.sample(light, u)
    assert same(rows, sampler.sample(light, np.asfortranarray(u)))
    assert same(rows, sampler.sample(light, np.repeat(u, 2, 1)[:, ::2]))
    assert same([a[::-1] for a in rows], sampler.sample(light, u[::-1]))
    assert same([a[::2] for a in rows], sampler.sample(light, u[::2]))
    assert same([np.repeat(a[:1], 64, 0) for a in rows], sampler.sample(light, np.broadcast_to(u[:1], (64, 2))))
    assert (sampler.pdf(light, rows.wi[::-1]) == rows.pdf[::-1]).all()


def test_a_sampler_serves_one_call_at_a_time():
    light, sampler = wis.Environment(sky()), wis.Sampler()
    with pytest.raises(RuntimeError, match="one call at a time"):
        sampler.check(light, lambda wi: sampler.sample(light, wi[:, :2]).wi)
