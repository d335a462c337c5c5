"""Lights from arrays; errors name argument and field; wis_check and wis_check_point name mistakes."""

import tracemalloc

import numpy as np
import pytest

import wisdirect as wis
from test_direct import UP, radiance, sky


def built(pixels, **more):
    return wis.Environment(pixels, **more).memory.tobytes()


def peak(pixels):
    """Bytes of arrays that a build makes, at the most."""
    tracemalloc.start()
    wis.Environment(pixels, light_only=True)
    found = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return found


def test_arrays_are_read_where_they_are():
    pixels = np.random.default_rng(1).random((256, 512, 4), np.float32)
    of_rows, upside_down = pixels[::2], pixels[::-1]
    copied = peak(np.asfortranarray(pixels)) - peak(pixels)
    assert 0.95 * pixels.nbytes < copied < 1.05 * pixels.nbytes
    assert abs(peak(of_rows) - peak(np.ascontiguousarray(of_rows))) < 0.05 * of_rows.nbytes
    assert abs(peak(upside_down) - peak(pixels)) < 0.05 * pixels.nbytes


def test_strides_and_types_build_the_same_light():
    pixels = (np.random.default_rng(2).random((16, 32, 3)) * 8).astype(np.float16)
    expected = built(pixels)
    assert built(pixels.astype(np.float32)) == built(pixels.astype(np.float64)) == built(pixels.astype(">f4")) == expected
    assert built(np.asfortranarray(pixels)) == built(np.ascontiguousarray(pixels[::-1])[::-1]) == expected
    alpha = np.concatenate([pixels, np.ones((16, 32, 1), np.float16)], 2)
    assert built(alpha) == built(alpha[..., :3]) == expected
    wide = np.zeros((16, 64, 3), np.float16)
    wide[:, :32] = pixels
    assert built(wide[:, :32]) == expected
    assert built(np.broadcast_to(pixels[:1], (16, 32, 3))) == built(np.repeat(pixels[:1], 16, 0))


def test_a_stored_light_opens_and_turns():
    light = wis.Environment(sky())
    stored = np.frombuffer(light.memory.tobytes(), np.uint8)
    assert wis.Environment.open(stored).info().content_id == light.info().content_id
    half = [[-1, 0, 0], [0, -1, 0], [0, 0, 1]]
    turned, wi = light.turned(half), np.array([[0.6, 0, 0.8], [0, 0.8, 0.6]], np.float32)
    np.testing.assert_allclose(wis.Sampler().pdf(turned, wi * (-1, -1, 1)), wis.Sampler().pdf(light, wi), rtol=1e-3)
    broken = stored.copy()
    broken[1000] ^= 1
    with pytest.raises(wis.Error) as caught:
        wis.Environment.open(broken)
    assert caught.value.status == wis.Status.CORRUPT


def nan(x, y):
    pixels = sky()
    pixels[y, x] = np.nan
    return pixels


LIGHT, SAMPLER = wis.Environment(sky()), wis.Sampler()
LONG = np.array([[0, 0, 1], [0, 0, 1], [0, 0, 2]])
SHEAR = [[[1, 1, 1], [1, 0, 0], [1, 1, 0]]]


@pytest.mark.parametrize("call, status, argument, field, y", [
    (lambda: wis.Environment(np.ones((4, 4, 2))), "INVALID_ARGUMENT", "config", "channels", 0),
    (lambda: wis.Environment(nan(5, 3)), "INVALID_TEXEL", "config", "pixels", 3),
    (lambda: wis.Environment(sky(), error_budget=2), "INVALID_ARGUMENT", "config", "error_budget", 0),
    (lambda: wis.Environment(sky(), world_from_map=2 * np.eye(3)), "INVALID_TRANSFORM", "config", "world_from_map", 0),
    (lambda: wis.Material([wis.lambert(), wis.ggx(-1)]), "INVALID_ARGUMENT", "material", "a", 1),
    (lambda: wis.Sampler(rays=5000), "INVALID_ARGUMENT", "config", "rays", 0),
    (lambda: SAMPLER.direct(LIGHT, wis.Points(UP, UP), 17), "INVALID_ARGUMENT", "wave", "rays", 0),
    (lambda: SAMPLER.direct(LIGHT, wis.Points(LONG, UP)), "INVALID_TRANSFORM", "wave", "normal", 2),
    (lambda: wis.direct(LIGHT, wis.Points(UP, UP, portals=SHEAR)), "INVALID_ARGUMENT", "wave", "portals", 0),
    (lambda: SAMPLER.sample(wis.Environment(sky(), rays_only=True), np.zeros((1, 2))), "NOT_BUILT", "environment", "flags", 0),
    (lambda: SAMPLER.prepare(LIGHT, wis.Points(UP, LONG)), "INVALID_TRANSFORM", "point", "wo", 2),
])
def test_errors_name_argument_and_field(call, status, argument, field, y):
    with pytest.raises(wis.Error) as caught:
        call()
    error = caught.value
    assert (error.status.name, error.argument, error.field, error.y) == (status, argument, field, y)
    assert f"{argument}.{field}" in str(error)


@pytest.mark.parametrize("call, message", [
    (lambda: wis.Environment(sky(), layout="cross"), "cube, latlong, octahedral"),
    (lambda: wis.Environment(sky()[0]), "height x width"),
    (lambda: wis.Environment(sky(), world_from_map=np.eye(4)), "not \\(3, 3\\)"),
    (lambda: wis.Points(UP, UP, wis.Material([]), index=1), "beyond the 1"),
    (lambda: SAMPLER.sample(LIGHT, np.zeros(2)), "not \\(n, 2\\)"),
    (lambda: SAMPLER.direct(LIGHT, wis.Points(UP, UP), 2, np.zeros((1, 2, 4))), "float32"),
])
def test_shapes_and_names_that_are_wrong_raise(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_a_light_for_rays_alone_has_their_bits_in_less_memory():
    whole, rays_only = (wis.Environment(sky(), rays_only=flag) for flag in (False, True))
    assert rays_only.memory.nbytes < 0.7 * whole.memory.nbytes
    rays = [wis.direct(of, wis.Points(UP, UP, seed=7), 4) for of in (whole, rays_only)]
    assert np.array_equal(rays[0].wi, rays[1].wi) and np.array_equal(rays[0].weight, rays[1].weight)


def test_check_names_a_mirrored_light_and_passes_on_what_a_callback_raises():
    found = SAMPLER.check(wis.Environment(sky(), filter="nearest"), lambda wi: radiance(sky(), wi * (1, -1, 1))[:, None].repeat(3, 1))
    assert found.cause == "mirrored" and found.error > 0.1
    with pytest.raises(ZeroDivisionError):
        SAMPLER.check(LIGHT, lambda wi: 1 / 0)


def test_check_point_names_a_forgotten_cosine():
    points = wis.Points(UP, (0.6, 0, 0.8), wis.Material([wis.lambert()]))
    assert SAMPLER.check_point(LIGHT, points, lambda wi: np.maximum(wi[:, 2], 0) / np.pi).mistake == "none"
    found = SAMPLER.check_point(LIGHT, points, lambda wi: (wi[:, 2] > 0) / np.pi)
    assert found.mistake == "cosine_missing" and "cosine" in found.message
