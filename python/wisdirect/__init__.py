"""Direct light from an environment map: which shadow rays to trace at many points at once, and their weights.

A thin layer over wis.h, whose comments are the reference of every quantity. Arrays are numpy's, and memory too: the library
allocates nothing. Arrays of the right type are read where they are, with their strides; others are converted. The GIL is free
during calls, so threads run in parallel; each needs a Sampler of its own. Directions are unit vectors in world space.
"""

from __future__ import annotations

import enum
import os
import threading
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from types import SimpleNamespace
from typing import Any, Callable, NamedTuple, Optional, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._wis import ARGUMENTS, LIBRARY, ffi  # type: ignore[import-not-found]

Floats = NDArray[np.float32]

_lib = ffi.dlopen(os.path.join(os.path.dirname(__file__), LIBRARY))
# Of memory in which objects are built: a cache line, four times what the library asks for.
_ALIGNMENT = 64



def _statuses() -> Any:
    members = {name[4:]: value for value, name in sorted(ffi.typeof("wis_status").elements.items())}
    return enum.IntEnum("Status", members)  # type: ignore[misc]


# WIS_INVALID_TEXEL is Status.INVALID_TEXEL.
Status = _statuses()
__version__ = ".".join(str(_lib.wis_version() >> shift & 255) for shift in (16, 8, 0))


class Error(ValueError):
    """A call that failed: `status`, and what was at fault: the name of the `argument` of the C `function`, the `field` of it,
    and `x` and `y`, the texel or the number of the element. None: nothing in particular."""

    def __init__(self, function: str, status: int, fault: Any) -> None:
        self.function, self.status = function, Status(status)
        self.argument: Optional[str] = ARGUMENTS[function][fault.argument - 1] if fault.argument else None
        self.field: Optional[str] = ffi.string(fault.field).decode() if fault.field else None
        self.x, self.y = int(fault.x), int(fault.y)
        message = ffi.string(_lib.wis_status_string(status)).decode()
        where = ".".join(name for name in (self.argument, self.field) if name)
        at = f" at {self.x}, {self.y}" if self.x or self.y or self.status == Status.INVALID_TEXEL else ""
        super().__init__(f"{function}: {where}{at}: {message}" if where else f"{function}: {message}")


def _call(function: str, *arguments: Any) -> None:
    names, fault = ARGUMENTS[function], ffi.new("wis_diagnostic *")
    if names[-1] == "diagnostic":
        arguments += (fault,)
    status = getattr(_lib, function)(*arguments)
    if status:
        if names[0] == "sampler":
            _lib.wis_sampler_fault(arguments[0], fault)
        raise Error(function, status, fault)


def _new(struct: str, **fields: Any) -> Any:
    made = ffi.new(struct + " *", fields)
    made.size = ffi.sizeof(struct)
    return made


def _read(struct: Any) -> SimpleNamespace:
    """The fields of a struct that the library wrote; names of WIS_CAUSE_* and the like in place of their numbers."""
    of = {name: getattr(struct, name) for name, _ in ffi.typeof(struct[0]).fields if name not in ("size", "reserved")}
    for name, value in of.items():
        if isinstance(value, ffi.CData):
            of[name] = ffi.string(value).decode() if ffi.typeof(value).kind == "pointer" else np.array(list(value), np.float32)
        elif name in _NAMED:
            of[name] = next(key[len(name) + 5:].lower() for key in dir(_lib)
                            if key.startswith(f"WIS_{name.upper()}_") and getattr(_lib, key) == value)
    return SimpleNamespace(**of)


_NAMED = ("cause", "mistake", "layout", "filter")


def _constant(kind: str, name: str) -> int:
    names = [key[len(kind) + 5:].lower() for key in dir(_lib) if key.startswith(f"WIS_{kind}_")]
    if name not in names:
        raise ValueError(f"{kind.lower()} is {name!r}, not one of {', '.join(names)}")
    return getattr(_lib, f"WIS_{kind}_{name.upper()}")


def _flags(kind: str, **given: bool) -> int:
    return sum(_constant(kind, name) for name, on in given.items() if on)


def _dtype(of: Any) -> np.dtype:
    """The numpy type of a C type."""
    if of.kind == "struct":
        names, fields = zip(*of.fields)
        return np.dtype({"names": names, "formats": [_dtype(field.type) for field in fields],
                         "offsets": [field.offset for field in fields], "itemsize": ffi.sizeof(of)})
    if of.kind == "array":
        return np.dtype((_dtype(of.item), (of.length,)))
    if of.kind == "primitive":
        return np.dtype(of.cname.removesuffix("_t").replace("float", "float32")) if of.cname != "size_t" else np.dtype(np.uintp)
    return np.dtype(np.uintp)


def _block(count: int) -> NDArray[np.uint8]:
    memory = np.empty(count + _ALIGNMENT, np.uint8)
    first = -memory.ctypes.data % _ALIGNMENT
    return memory[first:first + count]


def _pointer(array: NDArray, kind: str = "void") -> Any:
    return ffi.cast(kind + " *", array.ctypes.data)


def _measured(function: str, config: Any) -> Any:
    size = ffi.new("wis_memory_size *")
    _call(function, config, size)
    return size


def _matrix(world_from_map: ArrayLike) -> Floats:
    matrix = np.ascontiguousarray(world_from_map, np.float32)
    if matrix.shape != (3, 3):
        raise ValueError(f"world_from_map has shape {matrix.shape}, not (3, 3)")
    return matrix


def _texels(pixels: ArrayLike) -> NDArray:
    """Rows of adjacent texels: the array itself if its strides allow."""
    texels = np.asarray(pixels)
    if texels.dtype not in (np.float32, np.float16):
        texels = texels.astype(np.float32)
    if texels.ndim == 2:
        texels = texels[..., None]
    if texels.ndim != 3:
        raise ValueError(f"pixels have {texels.ndim} dimensions, not height x width x channels")
    texel, number = texels.shape[2] * texels.itemsize, texels.itemsize
    close = texels.strides[1:] == (texel, number) and texels.strides[0] % number == 0
    return texels if close and abs(texels.strides[0]) >= texels.shape[1] * texel else np.ascontiguousarray(texels)


class Environment:
    """An environment map as a distribution of directions; constant, and threads share it. `pixels`: height x width x channels
    of 1, 3 or 4 numbers, float32 or float16, linear radiance. `layout`: latlong (the polar axis is +z of the map), cube or
    octahedral. `filter`: how you look the map up, bilinear or nearest. Flags: WIS_ENVIRONMENT_* of wis.h."""

    def __init__(self, pixels: ArrayLike, *, layout: str = "latlong", filter: str = "bilinear",
                 world_from_map: ArrayLike = ((1, 0, 0), (0, 1, 0), (0, 0, 1)), error_budget: float = 0, rows_at_poles: bool = False,
                 exact_zero: bool = False, compensated: bool = False, sanitise: bool = False, light_only: bool = False,
                 rays_only: bool = False, absolute: bool = False) -> None:
        texels, matrix = _texels(pixels), _matrix(world_from_map)
        height, width, channels = texels.shape
        flags = _flags("ENVIRONMENT", rows_at_poles=rows_at_poles, exact_zero=exact_zero, compensated=compensated,
                       sanitise=sanitise, light_only=light_only, rays_only=rays_only, absolute=absolute)
        config = _new("wis_environment_config", layout=_constant("LAYOUT", layout), width=width, height=height, channels=channels,
                      format=_constant("FORMAT", f"f{8 * texels.itemsize}"), filter=_constant("FILTER", filter), flags=flags,
                      error_budget=error_budget, pixels=_pointer(texels), row_stride=texels.strides[0],
                      world_from_map=_pointer(matrix, "float"))
        size = _measured("wis_environment_size", config)
        memory, scratch = _block(size.bytes), _block(size.scratch_bytes)
        handle = ffi.new("const wis_environment **")
        _call("wis_environment_init", config, _pointer(memory), size.bytes, _pointer(scratch), size.scratch_bytes, handle)
        self._keep(memory, handle[0])

    def _keep(self, memory: NDArray[np.uint8], handle: Any) -> None:
        self._handle = handle
        self.memory = memory[:self.info().bytes]
        self.memory.flags.writeable = False

    @classmethod
    def open(cls, memory: NDArray[np.uint8]) -> Environment:
        """From the `memory` of another one: saved, sent or mapped. Copied only if it is not aligned to 16 bytes."""
        if memory.dtype != np.uint8 or not memory.flags.c_contiguous or memory.ctypes.data % 16:
            memory = _copied(memory)
        made, handle = cls.__new__(cls), ffi.new("const wis_environment **")
        _call("wis_environment_open", _pointer(memory), memory.nbytes, handle)
        made._keep(memory, handle[0])
        return made

    def turned(self, world_from_map: ArrayLike) -> Environment:
        """A copy in another rotation; nothing is rebuilt."""
        memory, made, handle = _copied(self.memory), Environment.__new__(Environment), ffi.new("const wis_environment **")
        _call("wis_environment_turn", _pointer(memory), memory.nbytes, _pointer(_matrix(world_from_map), "float"), handle)
        made._keep(memory, handle[0])
        return made

    def info(self) -> SimpleNamespace:
        """What was built: the fields of wis_environment_info."""
        info = _new("wis_environment_info")
        _call("wis_environment_describe", self._handle, info)
        return _read(info)


def _copied(memory: NDArray) -> NDArray[np.uint8]:
    copy = _block(memory.nbytes)
    copy[:] = np.frombuffer(memory, np.uint8)
    return copy


class Lobe(NamedTuple):
    """The shape of a lobe; made by lambert, ggx and the others below."""

    kind: int
    a: float = 0
    b: float = 0
    eta: float = 0


def lambert() -> Lobe:
    return Lobe(_lib.WIS_LOBE_LAMBERT)


def ggx(alpha: float, alpha_bitangent: Optional[float] = None) -> Lobe:
    return Lobe(_lib.WIS_LOBE_GGX, alpha, alpha if alpha_bitangent is None else alpha_bitangent)


def phong(exponent: float) -> Lobe:
    return Lobe(_lib.WIS_LOBE_PHONG, exponent)


def ggx_transmission(alpha: float, eta: float, alpha_bitangent: Optional[float] = None) -> Lobe:
    return Lobe(_lib.WIS_LOBE_GGX_TRANSMISSION, alpha, alpha if alpha_bitangent is None else alpha_bitangent, eta)


def lambert_transmission() -> Lobe:
    return Lobe(_lib.WIS_LOBE_LAMBERT_TRANSMISSION)


class Material:
    """The shapes of up to four lobes; their factors belong to points."""

    def __init__(self, lobes: Sequence[Lobe]) -> None:
        self.lobes = tuple(lobes)
        record = _new("wis_material", lobe_count=len(self.lobes), lobe=[tuple(lobe) for lobe in self.lobes[:_lib.WIS_MAX_LOBES]])
        _call("wis_material_init", record)
        self._record = np.frombuffer(bytes(ffi.buffer(record)), np.uint8)


Materials = Union[Material, Sequence[Material], None]


class VisibilityCache:
    """What rays of earlier passes reached, at `places` such as tiles of pixels or pieces of surface: give it to Points, `record` the
    rays of a pass, then `end_pass`."""

    def __init__(self, places: int) -> None:
        size, handle = _measured("wis_visibility_cache_size", places), ffi.new("wis_visibility_cache **")
        self._memory = _block(size.bytes)
        _call("wis_visibility_cache_init", places, _pointer(self._memory), size.bytes, handle)
        self._handle = handle[0]

    def record(self, points: Points, rays: Rays, reached: ArrayLike) -> None:
        """`reached`, n x rays: whether a ray of `direct` met nothing. No other call may use the cache meanwhile."""
        records, _portals = points._records()
        wi = np.ascontiguousarray(rays.wi)
        seen = np.ascontiguousarray(np.broadcast_to(np.asarray(reached, bool), rays.weight.shape))
        point = _pointer(records, "wis_point")
        for number, count in enumerate(rays.counts.tolist()):
            _call("wis_visibility_cache_record", point + number, count, _pointer(wi[number], "float"), 0,
                  _pointer(seen[number], "uint8_t"))

    def end_pass(self) -> None:
        _call("wis_visibility_cache_end_pass", self._handle)


def visibility_keys(position: ArrayLike, normal: ArrayLike, cell: float) -> NDArray[np.uint32]:
    """Keys of positions n x 3 with normals, by a grid of width `cell`: a twentieth of the scene is a good width."""
    where, facing = (np.ascontiguousarray(array, np.float32) for array in np.broadcast_arrays(position, normal))
    keys = np.zeros(len(where), np.uint32)
    for number in range(len(where)):
        _call("wis_visibility_key", _pointer(where[number], "float"), _pointer(facing[number], "float"), cell,
              _pointer(keys[number:], "uint32_t"))
    return keys


class Points:
    """Shading points: `normal` and `wo`, the direction to the viewer, n x 3. `material`: one, or several of which `index` names
    that of each point. `weight` and `f0` of lobes: numbers, or arrays that broadcast to n x lobes x 3. `seed`: the pixel; by default
    each point is one. `portals`: rectangles k x 3 x 3 in the world (a corner and two edges) for points at `position`, or
    n x k x 3 x 3. `visibility`: a cache, and `visibility_key` the place of each point in it, above 0. Every array may have one element for all points. The rest: wis_wave in wis.h."""

    def __init__(self, normal: ArrayLike, wo: ArrayLike, material: Materials = None, *, index: ArrayLike = 0,
                 tangent: Optional[ArrayLike] = None, weight: ArrayLike = 1, f0: ArrayLike = 0, seed: Optional[ArrayLike] = None,
                 sample: ArrayLike = 0, bounce: ArrayLike = 0, mask: Optional[ArrayLike] = None, portals: Optional[ArrayLike] = None,
                 position: ArrayLike = (0, 0, 0), visibility: Optional[VisibilityCache] = None, visibility_key: ArrayLike = 0, whole_sphere: bool = False, cosine_included: bool = False,
                 compensated: bool = False, portals_complete: bool = False) -> None:
        self.count = np.broadcast_shapes(np.shape(normal), np.shape(wo), (1, 3))[0]
        self.materials = [] if material is None else [material] if isinstance(material, Material) else list(material)
        self._materials = np.concatenate([of._record for of in self.materials] or [np.zeros(0, np.uint8)])
        self._flags = _flags("POINT", whole_sphere=whole_sphere, cosine_included=cosine_included, compensated=compensated,
                             portals_complete=portals_complete)
        lobes = max([len(of.lobes) for of in self.materials] + [1])
        if self.materials and not (0 <= np.min(index) and np.max(index) < len(self.materials)):
            raise ValueError(f"index names materials beyond the {len(self.materials)} that there are")
        self._floats = {"normal": self._rows(normal, 3), "wo": self._rows(wo, 3), "position": self._rows(position, 3),
                        "weight": self._lobes(weight, lobes), "f0": self._lobes(f0, lobes)}
        if tangent is not None:
            self._floats["tangent"] = self._rows(tangent, 3)
        self._ints = {name: self._whole(of) for name, of in {
            "material": index, "seed": np.arange(self.count) if seed is None else seed, "sample": sample, "bounce": bounce,
            "visibility_key": visibility_key}.items()}
        self._visibility = visibility
        if portals is not None:
            corners = np.asarray(portals, np.float32)
            self._floats["portal"] = self._rows(corners.reshape(corners.shape[:-3] + (-1,)), 9 * corners.shape[-3])
            self._ints["portal_count"] = self._whole(corners.shape[-3])
        self._mask = None if mask is None else np.ascontiguousarray(np.broadcast_to(np.asarray(mask, bool), self.count))

    def _rows(self, given: ArrayLike, width: int) -> Floats:
        """As it is if the numbers of a point are an equal distance above 0 apart, in whole floats; else a copy."""
        array = np.broadcast_to(np.asarray(given, np.float32), (self.count, width))
        fits = all(stride % 4 == 0 for stride in array.strides) and array.strides[1] != 0
        return array if fits else np.ascontiguousarray(array)

    def _lobes(self, given: ArrayLike, lobes: int) -> Floats:
        array = np.asarray(given, np.float32)
        if array.ndim == 2 and lobes == 1:
            array = array[:, None]
        array = np.broadcast_to(array, array.shape[:-2] + (lobes, 3))
        return self._rows(array.reshape(array.shape[:-2] + (3 * lobes,)), 3 * lobes)

    def _whole(self, given: ArrayLike) -> NDArray[np.uint32]:
        return np.broadcast_to(np.asarray(given).astype(np.uint32, copy=False), self.count)

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, some: Union[slice, NDArray]) -> Points:
        """Some points; those of a slice share their arrays."""
        of = Points.__new__(Points)
        of.__dict__.update(self.__dict__)
        of._floats = {name: array[some] for name, array in self._floats.items()}
        of._ints = {name: array[some] for name, array in self._ints.items()}
        of._mask = None if self._mask is None else np.ascontiguousarray(self._mask[some])
        of.count = len(of._ints["seed"])
        return of

    def _wave(self, ray: Floats, count: NDArray[np.uint32], status: NDArray[np.uint8]) -> Any:
        columns = {name: _strided(array) for name, array in {**self._floats, "ray": ray.reshape(len(ray), -1)}.items()}
        ints = {name: {"first": _pointer(array, "uint32_t"), "point": array.strides[0]} for name, array in self._ints.items()}
        cache = ffi.NULL if self._visibility is None else self._visibility._handle
        return _new("wis_wave", flags=self._flags, visibility=cache, material_count=len(self.materials), rays=ray.shape[1],
                    materials=_pointer(self._materials, "wis_material"), mask=ffi.NULL if self._mask is None else
                    _pointer(self._mask, "uint8_t"), count=_pointer(count, "uint32_t"), status=_pointer(status, "uint8_t"),
                    **columns, **ints)

    def _records(self) -> tuple[NDArray, Any]:
        """Structs wis_point, and the portals that they point to."""
        made = np.zeros(self.count, _dtype(ffi.typeof("wis_point")))
        made["size"], made["flags"] = made.itemsize, self._flags
        if self.materials:
            # An array that changed since it was checked must not lead beyond.
            index = np.minimum(self._ints["material"], len(self.materials) - 1).astype(np.uintp)
            made["material"] = self._materials.ctypes.data + index * ffi.sizeof("wis_material")
        for name in ("normal", "wo", "tangent"):
            made[name] = self._floats.get(name, 0)
        for name in ("weight", "f0"):
            lobes = self._floats[name].shape[1] // 3
            made[name][:, :lobes] = self._floats[name].reshape(-1, lobes, 3)
        for name in ("seed", "sample", "bounce", "visibility_key"):
            made[name] = self._ints[name]
        if self._visibility is not None:
            made["visibility"] = self._visibility._memory.ctypes.data
        if "portal" not in self._floats:
            return made, None
        rectangles = self._floats["portal"].reshape(self.count, -1, 3, 3).copy()
        rectangles[:, :, 0] -= self._floats["position"][:, None]
        made["portal_count"] = rectangles.shape[1]
        made["portals"] = rectangles.ctypes.data + np.arange(self.count, dtype=np.uintp) * rectangles[0].nbytes
        return made, rectangles


def _strided(array: NDArray) -> dict[str, Any]:
    return {"first": _pointer(array, "float"), "point": array.strides[0], "number": array.strides[1]}


def _packed(array: ArrayLike, width: int) -> Floats:
    """n x width, of which the numbers of a row stand close together and rows at least that far apart."""
    rows = np.asarray(array, np.float32)
    if rows.ndim != 2 or rows.shape[1] != width:
        raise ValueError(f"an array has shape {rows.shape}, not (n, {width})")
    fits = rows.strides[1] == 4 and rows.strides[0] >= 4 * width and rows.strides[0] % 4 == 0
    return rows if fits else np.ascontiguousarray(rows)


class Rays(NamedTuple):
    """`wi`, n x rays x 3, with a `weight` each, n x rays; `counts` of them at each point, and weight 0 from there on."""

    wi: Floats
    weight: Floats
    counts: NDArray[np.uint32]


class Drawn(NamedTuple):
    wi: Floats
    pdf: Floats


class Product(NamedTuple):
    """The light times BRDF and cosine at a point, as a distribution of directions."""

    memory: NDArray[np.uint8]
    environment: Environment

    def info(self) -> SimpleNamespace:
        """The fields of wis_product_info."""
        info = _new("wis_product_info")
        _call("wis_product_describe", self.environment._handle, _handle_of(self), info)
        return _read(info)


def _handle_of(product: Optional[Product]) -> Any:
    return ffi.NULL if product is None else _pointer(product.memory, "wis_product")


def _callback(kind: str, function: Callable[[Floats], ArrayLike], width: int) -> tuple[Any, list[BaseException]]:
    """A C function that answers rows of `width` floats for directions, and what it raised."""
    raised: list[BaseException] = []

    def call(_user: Any, count: int, wi: Any, out: Any) -> int:
        try:
            directions = np.frombuffer(ffi.buffer(wi, 12 * count), np.float32).reshape(count, 3)
            answer = np.asarray(function(directions), np.float32).reshape(count, width)
            np.frombuffer(ffi.buffer(out, 4 * width * count), np.float32).reshape(count, width)[:] = answer
            return 0
        except BaseException as error:
            raised.append(error)
            return 1

    return ffi.callback(ffi.typeof(kind), call), raised


class Sampler:
    """One thread's working memory, for calls of up to `rays` rays. `candidates_per_ray` and `hits_per_pixel`: wis_sampler_config."""

    def __init__(self, rays: int = 16, candidates_per_ray: int = 0, hits_per_pixel: int = 0) -> None:
        config = _new("wis_sampler_config", rays=rays, candidates_per_ray=candidates_per_ray, hits_per_pixel=hits_per_pixel)
        size, handle = _measured("wis_sampler_size", config), ffi.new("wis_sampler **")
        self._memory, self._busy = _block(size.bytes), threading.Lock()
        _call("wis_sampler_init", config, _pointer(self._memory), size.bytes, handle)
        self._handle = handle[0]

    def _call(self, function: str, environment: Environment, *arguments: Any) -> None:
        if not self._busy.acquire(blocking=False):
            raise RuntimeError("a Sampler belongs to one call at a time: make one for each thread")
        try:
            _call(function, self._handle, environment._handle, *arguments)
        finally:
            self._busy.release()

    def direct(self, environment: Environment, points: Points, rays: int = 1, out: Optional[Floats] = None) -> Rays:
        """The rays to trace at points. Add weight x f(wo, wi) x |cos| x L(wi) x V(wi) over them: that is an unbiased estimate of
        the reflected light. `out`: where they go, n x rays x 4, for arrays of your own order. Points that are wrong raise."""
        if out is None:
            out = np.empty((len(points), rays, 4), np.float32)
        flat = out.reshape(len(points), -1) if len(points) else out
        if out.shape != (len(points), rays, 4) or out.dtype != np.float32 or flat.ctypes.data != out.ctypes.data:
            raise ValueError(f"out must be float32 of shape {(len(points), rays, 4)}, its rays an equal distance apart")
        out[...] = 0
        count, status = np.zeros(len(points), np.uint32), np.zeros(len(points), np.uint8)
        self._call("wis_direct_wave", environment, len(points), points._wave(out, count, status))
        if status.any():
            self._explain(environment, points, int(status.argmax()), rays, status)
        return Rays(out[..., :3], out[..., 3], count)

    def direct_target(self, environment: Environment, points: Points, target: Callable[[int, Floats], ArrayLike], rays: int = 1) -> Rays:
        """As `direct`, with your own BRDF in the choice of rays: `target` of a point's number and directions n x 3 answers luminances
        of BRDF x |cos|. Point by point, so for measured BRDFs rather than for speed."""
        out, counts = np.zeros((len(points), rays, 4), np.float32), np.zeros(len(points), np.uint32)
        records, _portals = points._records()
        for number in range(len(points)):
            function, raised = _callback("wis_target_fn", partial(target, number), 1)
            point = _pointer(records, "wis_point") + number
            point.target = function
            self._raising(raised, "wis_direct", environment, point, rays, _pointer(out[number], "wis_ray"),
                          _pointer(counts[number:], "uint32_t"))
        return Rays(out[..., :3], out[..., 3], counts)

    def sample(self, environment: Environment, u: ArrayLike, product: Optional[Product] = None) -> Drawn:
        """Directions in proportion to the light, or to a product, of numbers `u` n x 2 in [0, 1); and their pdf."""
        u = _packed(u, 2)
        drawn = np.empty((len(u), 4), np.float32)
        self._call("wis_sample", environment, _handle_of(product), len(u), _pointer(u, "float"), u.strides[0],
                   _pointer(drawn, "wis_drawn"), 0)
        return Drawn(drawn[:, :3], drawn[:, 3])

    def pdf(self, environment: Environment, wi: ArrayLike, product: Optional[Product] = None) -> Floats:
        """The pdf of directions, per steradian: the bits that `sample` answers."""
        wi = _packed(wi, 3)
        pdf = np.empty(len(wi), np.float32)
        self._call("wis_pdf", environment, _handle_of(product), len(wi), _pointer(wi, "float"), wi.strides[0], _pointer(pdf, "float"), 0)
        return pdf

    def invert(self, environment: Environment, wi: ArrayLike, product: Optional[Product] = None) -> tuple[Floats, NDArray[np.uint8]]:
        """The numbers `u` that lead to directions, and a Status for each; where that is not OK, `u` is NaN."""
        wi = _packed(wi, 3)
        u, status = np.full((len(wi), 2), np.nan, np.float32), np.zeros(len(wi), np.uint8)
        self._call("wis_invert", environment, _handle_of(product), len(wi), _pointer(wi, "float"), wi.strides[0],
                   _pointer(u, "float"), 0, _pointer(status, "uint8_t"))
        return u, status

    def prepare(self, environment: Environment, points: Points, *, cone: float = 0, divided_cells: int = 0) -> list[Product]:
        """The product at each point, for `sample`, `pdf` and `invert`."""
        config = _new("wis_product_config", cone=cone, divided_cells=divided_cells)
        memory = _block(len(points) * _measured("wis_product_size", config).bytes)
        offset, used = np.zeros(len(points) + 1, np.uintp), ffi.new("size_t *")
        records, _portals = points._records()
        self._call("wis_product_prepare", environment, config, len(points), _pointer(records, "wis_point"), _pointer(memory),
                   memory.nbytes, _pointer(offset, "size_t"), used)
        offset[-1] = used[0]
        return [Product(memory[first:last], environment) for first, last in zip(offset, offset[1:])]

    def check(self, environment: Environment, radiance: Callable[[Floats], ArrayLike]) -> SimpleNamespace:
        """Compares your radiance, n x 3 for directions n x 3, with the light that was built, and names the likely mistake:
        `cause` is none, frame, mirrored, axes ... The other fields: wis_check_info."""
        function, raised = _callback("wis_radiance_fn", radiance, 3)
        info = _new("wis_check_info")
        return self._checked("wis_check", environment, raised, info, _new("wis_check_config", radiance=function))

    def check_point(self, environment: Environment, points: Points, target: Callable[[Floats], ArrayLike]) -> SimpleNamespace:
        """Compares your BSDF x |cos|, luminances of n directions n x 3, with the lobes at the first of points, and names the likely
        `mistake`: wo, normal, alpha_square ... The other fields: wis_point_verdict."""
        function, raised = _callback("wis_target_fn", target, 1)
        records, _portals = points[:1]._records()
        point = _pointer(records, "wis_point")
        point.target = function
        return self._checked("wis_check_point", environment, raised, _new("wis_point_verdict"), point)

    def _checked(self, function: str, environment: Environment, raised: list[BaseException], info: Any, given: Any) -> SimpleNamespace:
        self._raising(raised, function, environment, given, info)
        return _read(info)

    def _raising(self, raised: list[BaseException], function: str, environment: Environment, *arguments: Any) -> None:
        try:
            self._call(function, environment, *arguments)
        except Error as error:
            if raised:
                raise raised[0] from error
            raise

    def _explain(self, environment: Environment, points: Points, number: int, rays: int, status: NDArray[np.uint8]) -> None:
        """Raises for a point that is wrong: called alone, it also tells the field."""
        records, _portals = points[number:number + 1]._records()
        ray, count = ffi.new("wis_ray[]", rays), ffi.new("uint32_t *")
        fault, field = ffi.new("wis_diagnostic *", {"argument": 4, "y": number}), None
        try:
            self._call("wis_direct", environment, _pointer(records, "wis_point"), rays, ray, count)
        except Error as error:
            field = ffi.new("char[]", (error.field or "").encode())
        fault.field = field or ffi.NULL
        raise Error("wis_direct_wave", status[number], fault)


def direct(environment: Environment, points: Points, rays: int = 1, *, threads: Optional[int] = None, candidates_per_ray: int = 0,
           out: Optional[Floats] = None) -> Rays:
    """As Sampler.direct, with samplers of its own, on `threads` threads: all processors by default. The same bits for any number."""
    threads = max(1, min(threads or os.cpu_count() or 1, len(points) // _LEAST))
    if out is None:
        out = np.empty((len(points), rays, 4), np.float32)
    cuts = [len(points) * part // threads for part in range(threads + 1)]
    work = [(points[first:last], out[first:last]) for first, last in zip(cuts, cuts[1:])]
    with ThreadPoolExecutor(threads) as pool:
        made = list(pool.map(lambda of: Sampler(rays, candidates_per_ray).direct(environment, of[0], rays, of[1]), work))
    return Rays(out[..., :3], out[..., 3], np.concatenate([of.counts for of in made]))


# Fewer points of a thread take less time than starting it.
_LEAST = 256


def points_sobol(seed: int, first: int, count: int) -> Floats:
    """Points of an Owen-scrambled (0,2)-sequence, count x 2: `u` for `sample`."""
    out = np.empty((count, 2), np.float32)
    _call("wis_points_sobol", seed, first, count, _pointer(out, "float"), 0)
    return out
