"""Mitsuba 3 as a client of wis: tests, then measures and pictures; writes docs/renderers.md. Usage: main.py PAGE [--quick] [--also FILE]"""

import os
import sys
import time

import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")

import checks  # noqa: E402
import page  # noqa: E402
import scenes  # noqa: E402
import wisdirect as wis  # noqa: E402

import client  # noqa: E402,F401  registers the integrators

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


# wis with fewer candidates than the library's choice: for renderers whose rays cost as little as Mitsuba's.
FEW = "wis, 2 candidates a ray"


def integrator(name, rays):
    """Stock direct light with half of the rays from the emitter and half from the BSDF, or wis with as many rays."""
    if name == "wis product":
        return mi.load_dict({"type": "wis_product"})
    if name.startswith("wis"):
        return mi.load_dict({"type": "wis", "rays": rays, "candidates": 2 if name == FEW else 0})
    return mi.load_dict({"type": "direct", "emitter_samples": rays // 2, "bsdf_samples": rays // 2})


class Renders:
    """Repeats of a scene by one method: images, and the processor time of one, over all threads."""

    def __init__(self, scene, name, rays, spp, repeats, first=0, warm=True):
        made = integrator(name, rays)
        images, times = [], []
        for repeat in range(repeats + warm):
            start = time.process_time()
            image = np.array(mi.render(scene, integrator=made, spp=spp, seed=1000 * first + repeat))
            times.append(time.process_time() - start)
            images.append(image)
        # The first one compiles Mitsuba's kernels.
        self.colour, self.seconds = np.array(images[warm:]), float(np.median(times[warm:]))
        self.images = self.colour @ LUMINANCE


def errors(renders, mean, where):
    """Mean relative and mean absolute variance of an image."""
    variance = renders.images.var(axis=0, ddof=1)
    least = 0.01 * mean.mean()
    return float((variance / (mean + least) ** 2)[where].mean()), float(variance[where].mean())


def measure(name, pixels, size, repeats):
    """Tests and measures under one map."""
    print(name, flush=True)
    width, height = size
    scene, compensated = scenes.scene(pixels, *size), scenes.scene(pixels, *size, compensated=True)
    region = checks.regions(scene, width, height)
    found = {"conventions": checks.conventions(pixels, scene), "methods": {}, "materials": {}}
    stock = Renders(scene, "stock", 2, 16, repeats, first=1)
    ours = Renders(scene, "wis", 4, 4, max(8, repeats // 2), first=2)
    product = Renders(scene, "wis product", 2, 2, max(8, repeats // 4), first=3)
    found["z"] = {"direct": checks.z_scores(ours.images, stock.images, region),
                  "product": checks.z_scores(product.images, stock.images, region)}
    mean = (stock.images.mean(axis=0) + ours.images.mean(axis=0)) / 2
    limit = Renders(scene, "stock", 64, 4, max(8, repeats // 2), first=8)
    found["limit"] = {material: errors(limit, mean, region == number) for number, (material, _) in enumerate(scenes.MATERIALS)}
    for rays in (2, 4):
        all = {
            "MIS": Renders(scene, "stock", rays, 4, repeats, first=4),
            "compensated MIS": Renders(compensated, "stock", rays, 4, repeats, first=5),
            "wis": Renders(scene, "wis", rays, 4, repeats, first=6),
            FEW: Renders(scene, FEW, rays, 4, repeats, first=7),
        }
        found["methods"][rays] = {
            method: (renders.seconds, *errors(renders, mean, region >= 0)) for method, renders in all.items()}
        for number, (material, _) in enumerate(scenes.MATERIALS):
            where = region == number
            found["materials"][rays, material] = {m: errors(renders, mean, where) for m, renders in all.items()}
    return found


def pictures(pixels, path, size, reference_spp):
    """Panels at four rays a hit and four samples a pixel, and the mean of many as the reference."""
    scene, compensated = scenes.scene(pixels, *size), scenes.scene(pixels, *size, compensated=True)
    panels = [
        ("MIS, 4 rays a hit, 4 samples a pixel", Renders(scene, "stock", 4, 4, 1, warm=False).colour[0]),
        ("compensated MIS, the same rays", Renders(compensated, "stock", 4, 4, 1, warm=False).colour[0]),
        ("wis, the same rays", Renders(scene, "wis", 4, 4, 1, warm=False).colour[0]),
        ("reference: MIS of 64 samples and 16 rays a hit", Renders(scene, "stock", 16, reference_spp, 1, warm=False).colour[0]),
    ]
    page.sheet(panels, path)


def main():
    path, quick = sys.argv[1], "--quick" in sys.argv
    size, repeats = ((120, 68), 8) if quick else ((160, 90), 48)
    own = scenes.sky()
    maps = {"sky and sun": own} if quick else scenes.maps()
    densities = checks.densities(own)
    if not quick:
        pictures(own, os.path.splitext(path)[0] + ".png", (480, 200), 64)
    found = {name: measure(name, pixels, size, repeats) for name, pixels in maps.items()}
    also = open(sys.argv[sys.argv.index("--also") + 1]).read() if "--also" in sys.argv else ""
    text, failures = page.text(mi.__version__, wis.__version__, densities, found, repeats, size, also)
    with open(path, "w") as file:
        file.write(text)
    print(text)
    for failure in failures:
        print("FAIL:", failure)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
