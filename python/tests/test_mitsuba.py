"""The integrator for Mitsuba, where Mitsuba is installed: the example's errors, and means of a scene with everything in it."""

import json
import pathlib

import numpy as np
import pytest

mi = pytest.importorskip("mitsuba")
mi.set_variant("llvm_ad_rgb")
import wisdirect.mitsuba  # noqa: E402,F401

EXAMPLE = pathlib.Path(__file__).parents[1] / "examples" / "mitsuba.ipynb"


def test_the_example_shows_less_error_than_mis_with_as_many_rays():
    found = {}
    for cell in json.loads(EXAMPLE.read_text())["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), found)
    (relative, absolute, _), (mine, own, _) = found["of"]["MIS"], found["of"]["wis"]
    assert mine < relative / 2 and own < absolute / 5


def scene():
    to, grey = mi.ScalarTransform4f, {"type": "rgb", "value": 0.5}
    sky = np.full((32, 64, 3), (0.4, 0.5, 0.6), np.float32)
    sky[6, 40] = 200
    spheres = [{"type": "dielectric"}, {"type": "roughdielectric", "alpha": 0.3}, {"type": "plastic"}, {"type": "conductor"},
               {"type": "twosided", "bsdf": {"type": "roughconductor", "alpha": 0.2}},
               {"type": "blendbsdf", "weight": 0.5, "a": {"type": "diffuse"}, "b": {"type": "roughplastic"}}]
    made = {f"sphere{k}": {"type": "sphere", "center": [1.2 * k - 3, 0.5, 0], "radius": 0.5, "bsdf": bsdf}
            for k, bsdf in enumerate(spheres)}
    return mi.load_dict({
        "type": "scene", **made, "sky": {"type": "envmap", "bitmap": mi.Bitmap(sky), "scale": 2.0, "to_world": to().rotate([0, 1, 0], 40)},
        "sensor": {"type": "perspective", "fov": 40, "to_world": to().look_at([0, 2, 9], [0, 0.5, 0], [0, 1, 0]),
                   "film": {"type": "hdrfilm", "width": 96, "height": 32, "rfilter": {"type": "box"}}},
        "floor": {"type": "rectangle", "to_world": to().rotate([1, 0, 0], -90).scale(9), "bsdf": {"type": "diffuse", "reflectance": grey}},
        "lamp": {"type": "rectangle", "to_world": to().translate([0, 4, 0]).rotate([1, 0, 0], 90), "bsdf": {"type": "diffuse"},
                 "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 5}}}})


def test_paths_have_the_means_of_mitsubas_own():
    of, means = scene(), {}
    for name, more in {"path": {"rr_depth": 100}, "wis": {"rays": 2}}.items():
        integrator = mi.load_dict({"type": name, "max_depth": 4, **more})
        pictures = [np.array(mi.render(of, integrator=integrator, spp=32, seed=seed)) for seed in range(16)]
        # By sixths of the picture, so that one sphere's fault is not lost among the others.
        means[name] = np.array([[part.mean() for part in np.array_split(picture, 6, axis=1)] for picture in pictures])
    (stock, mine), count = means.values(), 16
    error = np.hypot(stock.std(0, ddof=1), mine.std(0, ddof=1)) / np.sqrt(count)
    # Six z, of fixed seeds: they find 5 % of any sixth of the picture.
    assert (5 * error < 0.05 * stock.mean(0)).all(), error / stock.mean(0)
    assert (np.abs(stock.mean(0) - mine.mean(0)) < 5 * error).all(), (mine.mean(0) / stock.mean(0), error / stock.mean(0))


def test_a_light_that_changed_is_noticed_by_forget():
    of, integrator = scene(), mi.load_dict({"type": "wis"})
    before = integrator.tables(of)
    assert integrator.tables(of) is before
    integrator.forget()
    assert integrator.tables(of) is not before
