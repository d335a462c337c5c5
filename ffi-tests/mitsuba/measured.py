"""A measured BRDF for Mitsuba's plugin `measured`, and the lobes that come nearest to it."""

import os
import struct

import drjit as dr
import mitsuba as mi
import numpy as np

# The broadest lobe among the materials of ../shared/data that is not diffuse.
REAL = os.path.join(os.path.dirname(__file__), "..", "..", "..", "shared", "data", "brdfs", "satin_rosaline_rgb.bsdf")
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# Alphas that are tried: a factor of 1.15 apart, so that the best is within 7 %.
ALPHAS = 0.08 * 1.15 ** np.arange(19)


def ggx(wi, wo, alpha):
    """GGX with separable Smith shadowing, times the cosine of `wo`, without Fresnel; and Schlick's (1 - cos)^5."""
    h = wi + wo
    h /= np.maximum(np.linalg.norm(h, axis=-1, keepdims=True), 1e-9)
    wi_z, wo_z = np.maximum(wi[..., 2], 1e-6), np.maximum(wo[..., 2], 1e-6)
    d = alpha**2 / (np.pi * (h[..., 2] ** 2 * (alpha**2 - 1) + 1) ** 2)
    smith = lambda z: 2 / (1 + np.sqrt(1 + alpha**2 * (1 / z**2 - 1)))
    return d * smith(wi_z) * smith(wo_z) / (4 * wi_z), (1 - np.clip(np.sum(wi * h, axis=-1), 0, 1)) ** 5


def write(path):
    """A tensor file as the RGL database has them, of an analytic BRDF: Lambert and GGX 0.3.

    The map from the unit square to half vectors is the identity (`vndf` is constant, `jacobian` is 0), so `rgb` holds BRDF x cosine
    at half vectors: columns are sqrt(theta / (pi / 2)), rows phi from the view.
    """
    theta, size = np.linspace(0, np.pi / 2, 8, dtype=np.float32), 48
    at = np.linspace(0, 1, size)
    theta_m, phi_m = np.meshgrid(at**2 * np.pi / 2, (2 * at - 1) * np.pi)
    half = np.stack([np.sin(theta_m) * np.cos(phi_m), np.sin(theta_m) * np.sin(phi_m), np.cos(theta_m)], axis=-1)
    slices = []
    for t in np.minimum(theta, np.pi / 2 - 0.01):
        view = np.array([np.sin(t), 0, np.cos(t)])
        out = 2 * (half @ view)[..., None] * half - view
        glossy, schlick = ggx(view, out, 0.3)
        lit = [kd / np.pi * out[..., 2] + glossy * (0.05 + 0.95 * schlick) for kd in (0.1, 0.3, 0.25)]
        slices.append(np.where((out[..., 2] > 0) & (half @ view > 0), lit, 0))
    rgb = np.array(slices)[None]
    ones = np.ones((2, 16))
    fields = {
        "description": np.frombuffer(b"Lambert and GGX 0.3, made by the project", np.uint8),
        "phi_i": np.zeros(1, np.float32), "theta_i": theta, "sigma": ones, "ndf": ones,
        "vndf": np.ones((1, len(theta), 16, 16)), "luminance": np.tensordot(LUMINANCE, rgb, (0, 2)) + 1e-4, "rgb": rgb,
        "jacobian": np.zeros(1, np.uint8), "valid": np.full(size * size // 8, 255, np.uint8),
    }
    offset = 18 + sum(len(name) + 13 + 8 * field.ndim for name, field in fields.items())
    table, data = b"", b""
    for name, field in fields.items():
        kind, numbers = (1, field) if field.dtype == np.uint8 else (10, field.astype("<f4"))
        data += b"\0" * (-(offset + len(data)) % 8)
        shape = struct.pack(f"<{field.ndim}Q", *field.shape)
        table += struct.pack("<H", len(name)) + name.encode() + struct.pack("<HBQ", field.ndim, kind, offset + len(data)) + shape
        data += numbers.tobytes()
    with open(path, "wb") as file:
        file.write(b"tensor_file\0\1\0" + struct.pack("<I", len(fields)) + table + data)


def file():
    """A measured material if there is one, else the project's own; and its name."""
    if os.path.exists(REAL):
        return REAL, "measured satin"
    path = os.path.join(os.environ["WIS_BUILD"], "own.bsdf")
    write(path)
    return path, "measured, of its own"


def evaluate(path, wi, wo):
    """BRDF x cosine as Mitsuba has it, RGB."""
    bsdf, si = mi.load_dict({"type": "measured", "filename": path}), dr.zeros(mi.SurfaceInteraction3f, len(wi))
    of = lambda rows: mi.Vector3f(*(mi.Float(np.ascontiguousarray(column, np.float32)) for column in rows.T))
    si.wi = of(wi)
    return np.array(bsdf.eval(mi.BSDFContext(), si, of(wo))).T


def lobes(path):
    """Lambert's albedo, and alpha and F0 of GGX: least squares of about the relative difference at 40,000 pairs of directions."""
    random = np.random.default_rng(5)
    z, phi = random.uniform(0.05, 1, (2, 40_000)), random.uniform(0, 2 * np.pi, (2, 40_000))
    wi, wo = (np.stack([np.sqrt(1 - c * c) * np.cos(p), np.sqrt(1 - c * c) * np.sin(p), c], axis=-1) for c, p in zip(z, phi))
    value = evaluate(path, wi, wo)
    # Measured data are 0 where nothing could be measured: such pairs must not count as much as others.
    share = 1 / (value @ LUMINANCE + (value @ LUMINANCE).mean())

    def fit(alpha):
        glossy, schlick = ggx(wi, wo, alpha)
        lambert, glossy, target = wo[:, 2] / np.pi * share, glossy * share, value * share[:, None]
        # Schlick's rise is a part of the lobe whatever F0 is; without a lobe there is none of it.
        weights = np.linalg.lstsq(np.stack([lambert, glossy * (1 - schlick)], -1), target - (glossy * schlick)[:, None])[0]
        weights = np.clip(weights, 1e-3, 1)
        rest = target - np.outer(lambert, weights[0]) - glossy[:, None] * (weights[1] + (1 - weights[1]) * schlick[:, None])
        return (rest**2).sum(), alpha, weights

    _, alpha, (albedo, f0) = min((fit(alpha) for alpha in ALPHAS), key=lambda of: of[0])
    return alpha, albedo.tolist(), f0.tolist()
