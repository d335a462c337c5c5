"""The calls of wis.h that a wavefront renderer needs, on numpy arrays."""

import ctypes as c
import os

import numpy as np

OK, ROWS_AT_POLES, COMPENSATED = 0, 1, 4
LAMBERT, GGX = 1, 2
CAUSES = ["none", "scaled", "frame", "turned", "mirrored", "upside down", "axes", "shifted", "rows", "filter", "other",
          "clamped"]


class Size(c.Structure):
    _fields_ = [("bytes", c.c_size_t), ("align", c.c_size_t), ("scratch_bytes", c.c_size_t)]


class EnvironmentConfig(c.Structure):
    _fields_ = [(n, c.c_uint32) for n in "size layout width height channels format filter flags".split()] + [
        ("error_budget", c.c_float), ("pixels", c.c_void_p), ("row_stride", c.c_ssize_t),
        ("row", c.c_void_p), ("row_user", c.c_void_p), ("world_from_map", c.c_void_p)]


class SamplerConfig(c.Structure):
    _fields_ = [(n, c.c_uint32) for n in "size cpu_level rays candidates_per_ray hits_per_pixel reserved".split()]


class Lobe(c.Structure):
    _fields_ = [("kind", c.c_uint32), ("a", c.c_float), ("b", c.c_float), ("eta", c.c_float)]


class Material(c.Structure):
    _fields_ = [("size", c.c_uint32), ("lobe_count", c.c_uint32), ("lobe", Lobe * 4), ("hash", c.c_uint64)]


class Point(c.Structure):
    _fields_ = [("size", c.c_uint32), ("flags", c.c_uint32), ("material", c.c_void_p), ("normal", c.c_float * 3),
                ("tangent", c.c_float * 3), ("wo", c.c_float * 3), ("weight", c.c_float * 12), ("f0", c.c_float * 12)] + [
        (n, c.c_uint32) for n in "seed sample bounce visibility_key portal_count".split()] + [
        (n, c.c_void_p) for n in "visibility target target_user portals".split()]


class Ints(c.Structure):
    _fields_ = [("first", c.c_void_p), ("point", c.c_ssize_t)]


class Floats(c.Structure):
    _fields_ = [("first", c.c_void_p), ("point", c.c_ssize_t), ("number", c.c_ssize_t)]


class Wave(c.Structure):
    _fields_ = [(n, c.c_uint32) for n in "size flags material_count rays".split()] + [
        ("materials", c.c_void_p), ("material", Ints), ("mask", c.c_void_p)] + [
        (n, Floats) for n in "normal tangent wo weight f0".split()] + [
        (n, Ints) for n in "seed sample bounce visibility_key portal_count".split()] + [
        (n, Floats) for n in "portal position".split()] + [
        ("visibility", c.c_void_p), ("ray", Floats), ("count", c.c_void_p), ("status", c.c_void_p)]


class ProductConfig(c.Structure):
    _fields_ = [(n, c.c_uint32) for n in "size flags divided_cells".split()] + [("cone", c.c_float)]


Radiance = c.CFUNCTYPE(c.c_int, c.c_void_p, c.c_size_t, c.POINTER(c.c_float), c.POINTER(c.c_float))


class CheckConfig(c.Structure):
    _fields_ = [("size", c.c_uint32), ("reserved", c.c_uint32), ("radiance", Radiance), ("radiance_user", c.c_void_p)]


class CheckInfo(c.Structure):
    _fields_ = [("size", c.c_uint32), ("cause", c.c_uint32)] + [(n, c.c_float) for n in "error explained scale".split()] + [
        ("filter", c.c_uint32), ("flags", c.c_uint32), ("shift", c.c_float * 2), ("world_from_map", c.c_float * 9), ("limit", c.c_float)]


library = c.CDLL(os.path.join(os.environ["WIS_LIB"], "libwis.so"))
library.wis_status_string.restype = c.c_char_p


def check(status):
    if status != OK:
        raise RuntimeError(library.wis_status_string(c.c_uint32(status)).decode())


def sized(kind, **fields):
    return kind(size=c.sizeof(kind), **fields)


def block(count):
    """Zeroed bytes, aligned to 64."""
    memory = np.zeros(count + 64, np.uint8)
    first = -memory.ctypes.data % 64
    return memory[first:first + count]


def address(array):
    return c.c_void_p(array.ctypes.data)


class Environment:
    """A lat-long map, as Mitsuba looks it up: bilinear, rows at the poles."""

    def __init__(self, pixels, world_from_map, flags=ROWS_AT_POLES):
        pixels = np.ascontiguousarray(pixels, np.float32)
        matrix = np.ascontiguousarray(world_from_map, np.float32)
        height, width, channels = pixels.shape
        config = sized(EnvironmentConfig, layout=1, width=width, height=height, channels=channels, format=1, filter=0,
                       flags=flags, pixels=pixels.ctypes.data, world_from_map=matrix.ctypes.data)
        need = Size()
        check(library.wis_environment_size(c.byref(config), c.byref(need), None))
        self.memory, scratch = block(need.bytes), block(need.scratch_bytes)
        self.handle = c.c_void_p()
        check(library.wis_environment_init(c.byref(config), address(self.memory), c.c_size_t(need.bytes), address(scratch),
                                           c.c_size_t(need.scratch_bytes), c.byref(self.handle), None))


class Sampler:
    def __init__(self, rays=16, candidates=0):
        config = sized(SamplerConfig, rays=rays, candidates_per_ray=candidates)
        need = Size()
        check(library.wis_sampler_size(c.byref(config), c.byref(need), None))
        self.memory = block(need.bytes)
        self.handle = c.c_void_p()
        check(library.wis_sampler_init(c.byref(config), address(self.memory), c.c_size_t(need.bytes), c.byref(self.handle), None))

    def sample(self, environment, product, u):
        """Directions and pdfs, (n, 4)."""
        u, out = np.ascontiguousarray(u, np.float32), np.zeros((len(u), 4), np.float32)
        check(library.wis_sample(self.handle, environment.handle, product, c.c_size_t(len(u)), address(u), c.c_size_t(0),
                                 address(out), c.c_size_t(0)))
        return out

    def pdf(self, environment, product, wi):
        wi, out = np.ascontiguousarray(wi, np.float32), np.zeros(len(wi), np.float32)
        check(library.wis_pdf(self.handle, environment.handle, product, c.c_size_t(len(wi)), address(wi), c.c_size_t(0),
                              address(out), c.c_size_t(0)))
        return out

    def prepare(self, environment, points):
        """Products at points: the memory that holds them, and the address of each."""
        config, need, used = sized(ProductConfig), Size(), c.c_size_t()
        check(library.wis_product_size(c.byref(config), c.byref(need), None))
        memory, offset = block(len(points) * need.bytes), np.zeros(len(points), np.uintp)
        check(library.wis_product_prepare(self.handle, environment.handle, c.byref(config), c.c_size_t(len(points)), points,
                                          address(memory), c.c_size_t(len(memory)), address(offset), c.byref(used)))
        return memory, [c.c_void_p(memory.ctypes.data + int(o)) for o in offset]

    def compare(self, environment, radiance):
        """What wis_check finds; `radiance` answers (n, 3) for (n, 3) world directions."""
        def eval(_, count, wi, rgb):
            wi = np.ctypeslib.as_array(wi, (count, 3))
            np.ctypeslib.as_array(rgb, (count, 3))[:] = radiance(wi)
            return 0
        config, info = sized(CheckConfig, radiance=Radiance(eval)), sized(CheckInfo)
        check(library.wis_check(self.handle, environment.handle, c.byref(config), c.byref(info)))
        return info


def materials(lobes):
    """An array of materials, each a list of (kind, a, b)."""
    made = (Material * len(lobes))()
    for material, of in zip(made, lobes):
        material.size, material.lobe_count = c.sizeof(Material), len(of)
        for lobe, (kind, a, b) in zip(material.lobe, of):
            lobe.kind, lobe.a, lobe.b = kind, a, b
        check(library.wis_material_init(c.byref(material), None))
    return made
