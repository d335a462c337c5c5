"""Scenes of Mitsuba: a textured floor and spheres of its BSDFs under an environment map."""

import os

import mitsuba as mi
import numpy as np

import measured
import wisdirect as wis
from wisdirect.mitsuba import MITSUBA_FROM_MAP, Lobes, described

# Lat-long maps of Mitsuba have +y up; this world has +z up.
TO_WORLD = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
WORLD_FROM_MAP = np.array(TO_WORLD) @ MITSUBA_FROM_MAP

DATA = os.path.join(os.path.dirname(__file__), "..", "..", "..", "shared", "data", "envmaps")
REAL = ["venice_sunset_1k.hdr"]


def sky(width=512, height=256, sun=2e4):
    """A blue sky over ground, with a sun of 2 x 2 texels."""
    v = (np.arange(height) / (height - 1))[:, None, None]
    u = (np.arange(width) / width)[None, :, None]
    up = np.cos(np.pi * v)
    above = np.array([0.35, 0.5, 0.9]) * (0.4 + 0.6 * up + 0.15 * np.sin(40 * u) * np.sin(31 * v))
    ground = np.array([0.12, 0.1, 0.08]) * (1.0 + 0.3 * np.sin(50 * u * np.pi))
    pixels = np.where(up > 0, above, ground).astype(np.float32)
    pixels[height // 4:height // 4 + 2, width // 5:width // 5 + 2] = np.array([1.0, 0.9, 0.7]) * sun
    return pixels


def maps():
    """Names and pixels: one of its own, and real ones where they stand beside the project."""
    all = {"sky and sun": sky()}
    for name in REAL:
        path = os.path.join(DATA, name)
        if os.path.exists(path):
            bitmap = mi.Bitmap(path).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False)
            all[name.removesuffix("_1k.hdr")] = np.array(bitmap)
    return all


def rgb(*value):
    return {"type": "rgb", "value": list(value)}


ETA, K = (0.2, 0.92, 1.1), (3.9, 2.45, 2.14)
CHECKER = {"type": "checkerboard", "color0": rgb(0.2, 0.22, 0.25), "color1": rgb(0.6, 0.55, 0.5),
           "to_uv": mi.ScalarTransform4f().scale(12)}

BRDF, BRDF_NAME = measured.file()
ALPHA, ALBEDO, F0_MEASURED = measured.lobes(BRDF)

MATERIALS = [
    ("floor", {"type": "diffuse", "reflectance": CHECKER}),
    ("diffuse", {"type": "diffuse", "reflectance": rgb(0.7, 0.3, 0.2)}),
    ("roughplastic 0.1", {"type": "roughplastic", "alpha": 0.1, "distribution": "ggx", "diffuse_reflectance": rgb(0.1, 0.3, 0.6)}),
    ("principled 0.5", {"type": "principled", "base_color": rgb(0.5, 0.15, 0.5), "roughness": 0.5, "specular": 0.5}),
    ("roughconductor 0.2", {"type": "roughconductor", "alpha": 0.2, "distribution": "ggx", "eta": rgb(*ETA), "k": rgb(*K)}),
    ("roughconductor 0.05", {"type": "roughconductor", "alpha": 0.05, "distribution": "ggx", "eta": rgb(*ETA), "k": rgb(*K)}),
    (BRDF_NAME, {"type": "measured", "filename": BRDF}),
]
# The package guesses the lobes of the others.
described[f"shape{len(MATERIALS) - 1}"] = Lobes.of(
    (wis.lambert(), ALBEDO, 0, 0, 0), (wis.ggx(ALPHA), 1, F0_MEASURED, 0, 0))


def envmap(pixels, compensated=False):
    matrix = np.eye(4)
    matrix[:3, :3] = TO_WORLD
    return {"type": "envmap", "bitmap": mi.Bitmap(np.ascontiguousarray(pixels)), "to_world": mi.ScalarTransform4f(matrix),
            "mis_compensation": compensated}


def scene(pixels, width, height, compensated=False):
    transform = mi.ScalarTransform4f
    of = {
        "type": "scene",
        "sensor": {"type": "perspective", "fov": 48, "to_world": transform().look_at([0, -9, 3.2], [0, 0, 0.7], [0, 0, 1]),
                   "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}},
                   "sampler": {"type": "independent"}},
        "light": envmap(pixels, compensated),
    }
    for number, (_, bsdf) in enumerate(MATERIALS):
        if number == 0:
            of["shape0"] = {"type": "rectangle", "to_world": transform().scale(12), "bsdf": bsdf}
        else:
            of[f"shape{number}"] = {"type": "sphere", "center": [1.35 * (number - 3.5), 0, 0.65], "radius": 0.65, "bsdf": bsdf}
    return mi.load_dict(of)
