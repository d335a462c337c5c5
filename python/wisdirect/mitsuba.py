"""An integrator for Mitsuba 3 whose rays towards the environment are chosen by wis. Set an RGB variant of LLVM, then

    import wisdirect.mitsuba
    integrator = mi.load_dict({"type": "wis", "rays": 4})

`max_depth` 2, the default, is direct light, as Mitsuba counts. BSDFs, radiance and visibility stay Mitsuba's: what this module
guesses of a BSDF, its lobes, decides about noise alone. Other emitters get one emitter sample at a hit. There are no gradients.
A picture holds about 200 bytes for each sample of a pass: give large ones to several passes.
"""

from __future__ import annotations

import os
from typing import Any, NamedTuple, Optional, Sequence

import drjit as dr
import mitsuba as mi
import numpy as np

import wisdirect as wis

# What wis calls the map's space: polar axis +z, azimuth from +x to +y. Mitsuba's azimuth is atan2(x, -z) about +y.
MITSUBA_FROM_MAP = np.array([[0, 1, 0], [0, 0, 1], [-1, 0, 0]], np.float32)
# A difference between Mitsuba's radiance and the light that was built: rounding to 16 bits is a hundredth of it.
_TOLERANCE = 0.02
_LEAST_ALPHA = 1e-3
# Parameters of BSDFs that tell lobes.
_READ = ("alpha", "alpha_u", "alpha_v", "eta", "k", "roughness", "metallic", "specular", "diffuse_reflectance", "reflectance")


class Lobes(NamedTuple):
    """A BSDF as lobes, at most four: of each its shape, a constant weight and f0, and factors of the diffuse reflectance at the hit
    that are added to both. `inside`: the shapes seen from below."""

    shapes: Sequence[wis.Lobe]
    weight: Any
    f0: Any
    diffuse_weight: Any
    diffuse_f0: Any
    inside: Optional[Sequence[wis.Lobe]] = None

    @staticmethod
    def of(*lobes: tuple[wis.Lobe, Any, Any, Any, Any], inside: Optional[Sequence[wis.Lobe]] = None) -> Lobes:
        return Lobes(*zip(*lobes), inside=inside)


# Of shapes by their id: yours in place of what is guessed of their BSDFs.
described: dict[str, Lobes] = {}


def _guess(of: dict[str, Any], transmits: bool) -> list[tuple[wis.Lobe, Any, Any, Any, Any]]:
    """Lobes of one plugin by its parameters: shape, weight, f0, and the factors of the diffuse reflectance."""
    grey = {name: float(np.mean(value)) for name, value in of.items()}
    alpha = max(grey.get("alpha", (grey.get("alpha_u", 0.1) + grey.get("alpha_v", 0.1)) / 2), _LEAST_ALPHA)
    eta = grey.get("eta", 1.5)
    schlick = ((eta - 1) / (eta + 1)) ** 2
    rough = "alpha" in of or "alpha_u" in of
    if "roughness" in of:
        metallic = grey.get("metallic", 0)
        glossy = wis.ggx(max(grey["roughness"] ** 2, _LEAST_ALPHA))
        return [(wis.lambert(), 0, 0, 1 - metallic, 0), (glossy, 1, 0.08 * grey.get("specular", 0.5) * (1 - metallic), 0, metallic)]
    if "k" in of:
        n, k = (np.array(of[name], np.float64).reshape(-1) for name in ("eta", "k"))
        return [(wis.ggx(alpha), 1, ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2), 0, 0)] if rough else []
    if "diffuse_reflectance" in of:
        # A tenth or so never leaves the base again.
        base = (wis.lambert(), 0, 0, (1 - schlick) ** 2, 0)
        return [base, (wis.ggx(alpha), 1, schlick, 0, 0)] if rough else [base]
    if rough and transmits:
        return [(wis.ggx(alpha), 1, schlick, 0, 0), (wis.ggx_transmission(alpha, eta), 1, schlick, 0, 0)]
    if "eta" in of:
        return []
    return [(wis.lambert(), 0, 0, 1, 0)] + ([(wis.lambert_transmission(), 0.5, 0, 0, 0)] if transmits else [])


def lobes(bsdf: mi.BSDF) -> Lobes:
    """A guess by the parameters of a BSDF and of the plugins in it."""
    parameters: Any = mi.traverse(bsdf)
    plugins: dict[Any, dict[str, Any]] = {}
    for key in parameters.keys():
        path = key.split(".")
        # What stands before is the plugin, what stands behind the texture.
        at = next((k for k, name in enumerate(path) if name in _READ), None)
        if at is not None and path[-1] != "to_uv":
            plugins.setdefault(tuple(path[:at]), {})[path[at]] = np.array(parameters[key])
    transmits = any(mi.has_flag(bsdf.flags(), of) for of in (mi.BSDFFlags.DiffuseTransmission, mi.BSDFFlags.GlossyTransmission))
    found = [lobe for of in plugins.values() for lobe in _guess(of, transmits)][:4] or _guess({}, transmits)
    flipped = [lobe._replace(eta=1 / lobe.eta) if lobe.eta else lobe for lobe, *_ in found]
    return Lobes.of(*found, inside=flipped)


def environment(scene: mi.Scene) -> wis.Environment:
    """The light of a scene's `envmap` or `constant`, compared with what Mitsuba evaluates."""
    emitter = scene.environment()
    if emitter is None:
        raise ValueError("the scene has no environment")
    parameters = mi.traverse(emitter)
    if "data" in parameters:
        # Mitsuba repeats a column on each side.
        pixels = np.array(parameters["data"])[:, 1:-1, :3]
        matrix = np.array(parameters["to_world"].matrix).reshape(4, 4)[:3, :3] @ MITSUBA_FROM_MAP
        light = wis.Environment(np.maximum(pixels, 0), world_from_map=matrix, rows_at_poles=True)
    else:
        light = wis.Environment(np.ones((2, 4, 1), np.float32))

    found = wis.Sampler().check(light, lambda wi: np.array(radiance(emitter, mi.Vector3f(np.ascontiguousarray(wi.T)))).T)
    if found.error > _TOLERANCE:
        raise ValueError(f"this light is not what Mitsuba evaluates: {found}")
    return light


def radiance(emitter: Any, wi: mi.Vector3f) -> mi.Color3f:
    """What Mitsuba evaluates in a direction."""
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(wi))
    si.wi = -wi
    return emitter.eval(si)


def _number(bsdf: mi.BSDF) -> int:
    """The number by which kernels know a BSDF."""
    return int(dr.reinterpret_array(mi.UInt32, mi.BSDFPtr(bsdf))[0])


class _Tables:
    """Of a scene: the light, and the lobes of its BSDFs as tables that kernels read. Row 2 k is BSDF k, 2 k + 1 seen from below."""

    def __init__(self, scene: mi.Scene) -> None:
        self.light = environment(scene)
        self.others = len(scene.emitters()) > 1
        shapes = {_number(shape.bsdf()): shape for shape in scene.shapes() if shape.bsdf() is not None}
        bsdfs = [shape.bsdf() for shape in shapes.values()]
        found = [described.get(shape.id()) or lobes(shape.bsdf()) for shape in shapes.values()]
        self.delta = any(of.flags() & mi.BSDFFlags.Delta for of in bsdfs)
        self.materials = [wis.Material(side or of.shapes) for of in found for side in (of.shapes, of.inside)]
        self.lobes = max(len(of.shapes) for of in found)
        numbers = np.zeros((4, len(found), self.lobes, 3), np.float32)
        for k, of in enumerate(found):
            for table, given in enumerate((of.weight, of.f0, of.diffuse_weight, of.diffuse_f0)):
                for lobe, value in enumerate(given):
                    numbers[table, k, lobe] = value
        self.numbers = [mi.Float(table.ravel()) for table in numbers]
        row = np.zeros(max(shapes) + 1, np.uint32)
        row[list(shapes)] = np.arange(len(shapes))
        self.row = mi.UInt32(row)


class Integrator(mi.SamplingIntegrator):
    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self.rays, self.max_depth = props.get("rays", 4), props.get("max_depth", 2)
        # For each ray; 0: the library's choice, 16. Mitsuba's rays are so cheap that at equal time 2 have less error.
        self.candidates = props.get("candidates", 0)
        self.threads = props.get("threads", os.cpu_count() or 1)
        self._tables: dict[Any, _Tables] = {}

    def tables(self, scene: mi.Scene) -> _Tables:
        """Made once for a scene. Call `forget` when its light or a BSDF changed."""
        if scene not in self._tables:
            self._tables = {scene: _Tables(scene)}
        return self._tables[scene]

    def forget(self) -> None:
        self._tables = {}

    def sample(self, scene: mi.Scene, sampler: mi.Sampler, ray: mi.RayDifferential3f, medium: Any = None,
               active: Any = True) -> tuple[mi.Color3f, mi.Bool, list]:
        of, ray, active, count = self.tables(scene), mi.Ray3f(ray), mi.Bool(active), sampler.wavefront_size()
        total, throughput, first, delta = mi.Color3f(0), mi.Color3f(1), mi.Bool(False), mi.Bool(True)
        # Lanes of a pixel stand side by side; another pass or picture has other seeds.
        per_pixel = max(1, count // int(np.prod(mi.ScalarVector2u(scene.sensors()[0].film().crop_size()))))
        lane = np.arange(count, dtype=np.uint32)
        start = np.uint32(int(sampler.next_1d()[0] * 2.0**24) << 8)
        seed, number = lane // np.uint32(per_pixel) + start, lane % np.uint32(per_pixel)
        for depth in range(self.max_depth):
            found = scene.ray_intersect_preliminary(ray, coherent=depth == 0, active=active)
            si = found.compute_surface_interaction(ray, mi.RayFlags.All, active)
            total += dr.select(active & delta, throughput * si.emitter(scene, active).eval(si, active), 0)
            active &= si.is_valid()
            if depth == 0:
                first = active
            if depth + 1 == self.max_depth:
                break
            bsdf, context = si.bsdf(ray), mi.BSDFContext()
            smooth = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
            state = (found, ray, total, throughput, active, delta)
            points = self.points(of, si, bsdf, smooth, state, seed=seed, sample=number, bounce=depth)
            chosen = self._rays(of, points)
            si, bsdf = found.compute_surface_interaction(ray, mi.RayFlags.All, active), si.bsdf(ray)
            for wi, weight in chosen:
                traced = smooth & (weight > 0)
                f = bsdf.eval(context, si, si.to_local(wi), traced)
                traced &= dr.max(f) > 0
                seen = traced & ~scene.ray_test(si.spawn_ray(wi), traced)
                total += dr.select(seen, throughput * f * radiance(scene.environment(), wi) * weight, 0)
            if of.others:
                total += throughput * self._others(scene, sampler, si, bsdf, context, smooth)
            if depth + 2 < self.max_depth or of.delta:
                drawn, value = bsdf.sample(context, si, sampler.next_1d(), sampler.next_2d(), active)
                throughput *= value
                ray, delta = si.spawn_ray(si.to_world(drawn.wo)), mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Delta)
                active &= dr.max(throughput) > 0
                sampler.schedule_state()
            else:
                break
        return total, first, []

    def points(self, of: _Tables, si: mi.SurfaceInteraction3f, bsdf: mi.BSDFPtr, smooth: mi.Bool, state: tuple = (),
               **more: Any) -> wis.Points:
        """All lanes: one kernel writes what wis reads of the hits, and evaluates `state`."""
        count = dr.width(si.wi)
        below = dr.dot(si.sh_frame.n, si.to_world(si.wi)) < 0
        normal = dr.select(smooth, dr.select(below, -si.sh_frame.n, si.sh_frame.n), mi.Vector3f(0, 0, 1))
        wo = dr.select(smooth, si.to_world(si.wi), mi.Vector3f(0, 0, 1))
        diffuse = bsdf.eval_diffuse_reflectance(si, smooth)
        row = dr.gather(mi.UInt32, of.row, dr.reinterpret_array(mi.UInt32, bsdf), smooth)
        columns = [normal, wo]
        for constants, factors in ((of.numbers[0], of.numbers[2]), (of.numbers[1], of.numbers[3])):
            for lobe in range(of.lobes):
                constant, factor = (dr.gather(mi.Color3f, table, row * of.lobes + lobe, smooth) for table in (constants, factors))
                columns.append(constant + factor * diffuse)
        index = 2 * row + dr.select(below, 1, 0)
        dr.eval(columns, index, smooth, *state)
        # Copied together here: scatters of a kernel of LLVM take 20 times as long.
        numbers = np.stack([axis for column in columns for axis in column]).reshape(-1, 3, count).transpose(2, 0, 1)
        return wis.Points(numbers[:, 0], numbers[:, 1], of.materials, index=np.asarray(index), weight=numbers[:, 2:2 + of.lobes],
                          f0=numbers[:, 2 + of.lobes:], mask=np.asarray(smooth), **more)

    def _rays(self, of: _Tables, points: wis.Points) -> list[tuple[mi.Vector3f, mi.Float]]:
        """Directions and weights for all lanes."""
        count = len(points)
        out, lane = np.empty(4 * self.rays * count, np.float32), dr.arange(mi.UInt32, count)
        wis.direct(of.light, points, self.rays, threads=self.threads, candidates_per_ray=self.candidates,
                   out=out.reshape(self.rays, 4, count).transpose(2, 0, 1))
        made = mi.Float(out)
        parts = [[dr.gather(mi.Float, made, lane + (4 * k + part) * count) for part in range(4)] for k in range(self.rays)]
        return [(mi.Vector3f(x, y, z), weight) for x, y, z, weight in parts]

    def _others(self, scene: mi.Scene, sampler: mi.Sampler, si: mi.SurfaceInteraction3f, bsdf: mi.BSDFPtr, context: mi.BSDFContext,
                smooth: mi.Bool) -> mi.Color3f:
        """Light of emitters that are not the environment."""
        at, light = scene.sample_emitter_direction(si, sampler.next_2d(), True, smooth)
        smooth &= at.emitter != mi.EmitterPtr(scene.environment())
        return dr.select(smooth, bsdf.eval(context, si, si.to_local(at.d), smooth) * light, 0)


mi.register_integrator("wis", Integrator)
