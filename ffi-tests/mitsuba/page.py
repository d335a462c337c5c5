"""docs/renderers.md and its picture: every verdict is computed from the numbers of the run."""

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from checks import Z_LIMIT
from scenes import ALPHA, BRDF_NAME

KINDS = ("relative, equal rays", "absolute, equal rays", "relative, equal time", "absolute, equal time")


def tone(image):
    """sRGB, 8 bits."""
    image = np.clip(image * 0.9, 0, 1)
    encoded = np.where(image <= 0.0031308, 12.92 * image, 1.055 * image ** (1 / 2.4) - 0.055)
    return Image.fromarray((255 * encoded + 0.5).astype(np.uint8))


def sheet(panels, path):
    """Labelled panels, two in a row."""
    height, width, _ = panels[0][1].shape
    rows = (len(panels) + 1) // 2
    out = Image.new("RGB", (2 * width + 4, rows * height + 4 * (rows - 1)), "white")
    font = ImageFont.load_default(size=17)
    for k, (label, image) in enumerate(panels):
        panel = tone(image)
        draw = ImageDraw.Draw(panel)
        box = draw.textbbox((8, 6), label, font=font)
        draw.rectangle((box[0] - 5, box[1] - 4, box[2] + 5, box[3] + 4), fill="black")
        draw.text((8, 6), label, font=font, fill="white")
        out.paste(panel, (k % 2 * (width + 4), k // 2 * (height + 4)))
    # A palette takes a third of the bytes; with k-means its steps hardly show.
    out.quantize(256, kmeans=6, dither=Image.Dither.NONE).save(path, optimize=True)


def times(ratio):
    """2.4x, or 0.53x."""
    return f"{ratio:.1f}x" if ratio >= 1 else f"{ratio:.2f}x"


def gains(of, method, peer):
    """How many times lower the variance is: at equal rays relative and absolute, at equal processor time the same."""
    (seconds, relative, absolute), (mine, r, a) = of[peer], of[method]
    time = seconds / mine
    return relative / r, absolute / a, time * relative / r, time * absolute / a


def summary(found):
    lines = ["| map | rays a hit | method | against | relative, equal rays | absolute, equal rays | relative, equal time | absolute, equal time |",
             "| --- | --- | --- | --- | --- | --- | --- | --- |"]
    ratios = {}
    for name, of in found.items():
        for rays, methods in of["methods"].items():
            for method in (m for m in methods if m.startswith("wis")):
                for peer in ("MIS", "compensated MIS"):
                    of_peer = gains(methods, method, peer)
                    for kind, ratio in zip(KINDS, of_peer):
                        ratios.setdefault((method, kind), []).append(ratio)
                    lines.append(f"| {name} | {rays} | {method} | {peer} | " + " | ".join(times(r) for r in of_peer) + " |")
    return lines, ratios


def conclusion(ratios):
    """The comparisons in which a method is ahead, and the geometric mean."""
    lines = ["| method | " + " | ".join(KINDS) + " |", "| --- | --- | --- | --- | --- |"]
    methods = list(dict.fromkeys(method for method, _ in ratios))
    for method in methods:
        cells = []
        for kind in KINDS:
            of = np.array(ratios[method, kind])
            cells.append(f"{times(np.exp(np.log(of).mean()))}, ahead in {(of > 1).sum()} of {len(of)}")
        lines.append(f"| {method} | " + " | ".join(cells) + " |")
    return lines


def by_material(found):
    lines = ["| map | material | relative, against MIS | absolute, against MIS | relative, against compensated | absolute, against compensated "
             "| relative, MIS with 64 rays | absolute, MIS with 64 rays |", "| --- | --- | --- | --- | --- | --- | --- | --- |"]
    for name, of in found.items():
        for (rays, material), methods in of["materials"].items():
            if rays == 4:
                r, a = methods["wis"]
                ratios = [x for peer in ("MIS", "compensated MIS") for x in (methods[peer][0] / r, methods[peer][1] / a)]
                ratios += [a / b for a, b in zip(methods["MIS"], of["limit"][material])]
                lines.append(f"| {name} | {material} | " + " | ".join(times(x) for x in ratios) + " |")
    return lines


def costs(found):
    methods = list(next(iter(next(iter(found.values()))["methods"].values())))
    lines = ["| map | rays a hit | " + " | ".join(methods) + " |", "| --- | --- |" + " --- |" * len(methods)]
    for name, of in found.items():
        for rays, methods in of["methods"].items():
            lines.append(f"| {name} | {rays} | " + " | ".join(f"{methods[m][0] * 1e3:.0f} ms" for m in methods) + " |")
    return lines


def tests(densities, found, failures):
    lines = ["| test | result | verdict |", "| --- | --- | --- |"]
    for name, (p, passed) in densities.items():
        lines.append(f"| chi-square of Mitsuba, {'products at ' if name != 'light alone' else ''}{name} | p = {p:.3f} | {verdict(passed)} |")
        if not passed:
            failures.append(f"chi-square: {name}")
    for map, of in found.items():
        for name, (expected, cause, error) in of["conventions"].items():
            holds = expected == cause
            lines.append(f"| wis_check, {map}: a light built {name} | {cause}, difference {error:.4f} | {verdict(holds)} |")
            if not holds:
                failures.append(f"wis_check: {map}, {name}: {cause} in place of {expected}")
        for kind, z in of["z"].items():
            worst = max(z, key=lambda m: abs(z[m][2]))
            finest, coarsest = (100 * Z_LIMIT * of(z[m][1] for m in z) for of in (min, max))
            holds = abs(z[worst][2]) < Z_LIMIT
            what = f"largest of {len(z)} z = {z[worst][2]:+.1f} ({worst}); finds {finest:.1f} to {coarsest:.0f} % and more, by material"
            lines.append(f"| means of materials, {map}: wis {kind} against stock | {what} | {verdict(holds)} |")
            if not holds:
                failures.append(f"means: {map}, {kind}, {worst}: z = {z[worst][2]:.1f}")
    return lines


def verdict(holds):
    return "holds" if holds else "**does not hold**"


def text(version, wis_version, densities, found, repeats, size, also):
    """The page; `also` is what other renderers report."""
    failures = []
    detail, ratios = summary(found)
    checked = tests(densities, found, failures)
    lines = [
        "# wis in real renderers", "",
        "Mitsuba 3 (PyPI) calls the Python package, rpt and threers (crates.io) the Rust crate. Cycles can only be asked for its look-up: Blender's",
        "Python module renders pictures, and hands out neither hits nor BSDFs. `make cycles` holds a light against it.", "",
        "## Mitsuba 3", "",
        "How many times lower the variance of the integrator `wis` ([python](../python)) is than that of Mitsuba's `direct` integrator: geometric means over maps,",
        "rays a hit, and both kinds of MIS. Above 1x wis is better.", "",
        *conclusion(ratios), "",
        "- \"wis\" looks at up to 16 candidates for each ray, the library's choice and the integrator's.",
        "- Equal rays: as many shadow rays a hit. Half of Mitsuba's come from the emitter and half from the BSDF.",
        "- Equal time: the same processor time, with everything that a client in Python adds. Mitsuba fuses a whole picture into one kernel;",
        "  for wis, hits leave that kernel as arrays and rays come back. Rays and BSDFs are as cheap here as they get.", "",
        "![Pictures at the same number of rays, and the reference](renderers.png)", "",
        "*Four rays a hit and four samples a pixel under a sky with a sun. From left to right: diffuse, roughplastic 0.1, principled 0.5,",
        "roughconductor 0.2 and 0.05, and a measured material, on a textured floor.*", "",
        "### Tests", "", *checked, "",
        f"All z of a run must stay below {Z_LIMIT}. The product's client combines one sample of a product with one of the BSDF by the",
        "balance heuristic.", "",
        "### Map by map", "", *detail, "",
        "### By material, at equal rays", "",
        "Four rays a hit. The last two columns: MIS with 64 rays a hit against MIS with 4. Where they are far below 16x, most of the",
        "variance comes from where a pixel's samples hit, such as the sun's highlight on a narrow lobe. No choice of rays lowers that.", "", *by_material(found), "",
        "### Processor time of one picture", "", f"Four samples a pixel, {size[0]} x {size[1]} pixels, all threads together.", "",
        *costs(found), "",
        "### How it is measured", "",
        f"- Written by `make test-renderers` with Mitsuba {version} (`llvm_ad_rgb`) and wis {wis_version}.",
        f"- Variance: of {repeats} pictures with seeds of their own, pixel by pixel. Relative: over the square of the mean, to which 1 % of the",
        "  picture's mean is added. Pixels that see one material alone count.",
        f"- \"{BRDF_NAME}\" is read by Mitsuba's plugin `measured`. Its lobes are fitted: Lambert and GGX {ALPHA:.2f}. With a file of the RGL",
        "  database beside the project it is that material; else `ffi-tests/mitsuba/measured.py` writes such a file of an analytic BRDF.",
        "- Mitsuba's BSDFs as lobes: guessed by `python/wisdirect/mitsuba.py` from the names of parameters. They need not fit.",
        "- Time: processor time over all threads, the median of the pictures without the first, which compiles Mitsuba's kernels.", "",
        *also.splitlines(), "",
    ]
    return "\n".join(lines), failures
