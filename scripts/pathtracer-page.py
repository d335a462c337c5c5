#!/usr/bin/env python3
"""Runs the path tracer under each lat-long map of a folder and writes its page: pathtracer-page.py PROGRAM MAPS PAGE

Results stand beside the page, as .tsv; the first of those files in place of MAPS writes the page alone. Two maps run at a time, each in one thread."""
import glob
import math
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from statistics import geometric_mean, linear_regression

# Every so many pixels of an image of 960 x 560: hits of a pixel are then as near to one another as those of a real image.
VIEW = ["--width", "24", "--height", "14", "--stride", "40"]
PIXELS = 24 * 14
# What is traced, by name: the arguments, and the most samples of a pixel with random numbers and with a (0,2)-sequence.
TRACERS = {
    "paths": (["--repeats", "1", "--reference", "500", "--methods", "mis,compensated,direct,alone,unshared"], ["256", "256"]),
    "direct light": (["--depth", "1", "--repeats", "1", "--reference", "1000"], ["256", "1024"]),
    "direct light, 4 rays": (["--depth", "1", "--rays", "4", "--repeats", "1", "--reference", "1000"], ["64", "256"]),
    "spheres": (["--without", "1", "--repeats", "2", "--reference", "250"], ["64", "64"]),
}
# Direct light with a (0,2)-sequence in scenes that lack what cells are thought to be lost to, under all maps.
LACKS = {"without the metal sphere": "2", "without the ground": "4", "without both": "6", "without all three": "7"}
# The same where all is of one material, under some maps: a sky, an interior, and a sun.
MATERIALS = {"Lambert": "1", "Lambert, patterned": "4", "GGX 0.2": "2", "GGX 0.05": "3"}
MESHES = {"fine": "0", "coarse": "1"}
SLOPED = ["forest_slope_1k", "st_fagans_interior_1k", "venice_sunset_1k"]
EXPERIMENT = ["--depth", "1", "--stratified", "1", "--least", "16", "--repeats", "1", "--methods", "mis,compensated,alone"]
NUMBERS = ["random", "(0,2)-sequence"]
METRICS = ["absolute", "relative"]
PATTERNS = ["direct", "unshared", "alone"]
# The pattern of docs/integrating.md for each tracer: verdicts and losses are of these.
ADVISED = {"paths": "direct", "direct light": "alone", "direct light, 4 rays": "alone", "spheres": "direct"}
BASELINES = ["mis", "compensated"]
COLUMNS = ["tracer", "map", "numbers", "samples", "method", "seconds", "mean", "absolute MSE", "relative MSE", "absolute efficiency over mis",
           "relative efficiency over mis"]
EXPERIMENT_COLUMNS = ["experiment", "map", *COLUMNS[3:], "share of the disc", "share of the mesh"]
# Names of both patterns on the page: those of docs/integrating.md.
CALLED = {"direct": "pattern 1", "unshared": "pattern 1, not shared", "alone": "pattern 2"}
# What the table by map shows: a tracer, its numbers and samples.
BY_MAP = [("paths", "random", 16), ("paths", "random", 64), ("paths", "(0,2)-sequence", 16), ("paths", "(0,2)-sequence", 64),
          ("direct light", "random", 16), ("direct light", "(0,2)-sequence", 64)]
# Five of ten: skies that most outdoor scenes are lit by.
OUTDOORS = ["forest_slope_1k", "potsdamer_platz_1k", "rooitou_park_1k", "uffizi-large_1024x512", "venice_sunset_1k"]
# How many of the cells that lose most the page shows, for each metric.
LOSSES = 8
# Goals, absolute and relative: the mean with a (0,2)-sequence of 16 samples and more, and in a path tracer with random numbers.
GOALS = {"(0,2)-sequence": [3.0, 1.5], "random": [5.5, 3.5]}


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def rows_of(command):
    """The numbers that the path tracer prints: 10 for each number of samples and method."""
    out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    rows = [line.split() for line in out.splitlines() if re.match(r" *\d+ \w", line)]
    return [row for row in rows if len(row) == 10]


def runs_of(program, path):
    lines = []
    for tracer, (arguments, most) in TRACERS.items():
        for stratified in (0, 1):
            command = [program, "--map", path, "--stratified", str(stratified), "--most", most[stratified], *VIEW, *arguments]
            lines += ["\t".join([tracer, os.path.basename(path)[:-4], NUMBERS[stratified], *row[:8]]) for row in rows_of(command)]
    return lines


def experiments_of(program, path):
    name = os.path.basename(path)[:-4]
    runs = [(lack, ["--most", "256", "--reference", "1000", "--without", number]) for lack, number in LACKS.items()]
    if name in SLOPED:
        runs += [(f"{material}, {mesh}", ["--most", "1024", "--reference", "1000", "--material", number, "--coarse", coarse])
                 for material, number in MATERIALS.items() for mesh, coarse in MESHES.items()]
    return ["\t".join([run, name, *row]) for run, arguments in runs for row in rows_of([program, "--map", path, *EXPERIMENT, *VIEW, *arguments])]


def measured(of, columns, program, folder, file):
    if os.path.isfile(folder):
        return read(file).splitlines()[1:]
    maps = sorted(m for m in glob.glob(f"{folder}/*.hdr") if "cross" not in m and "probe" not in m)
    with ThreadPoolExecutor(2) as pool:
        lines = [line for lines in pool.map(lambda m: of(program, m), maps) for line in lines]
    with open(file, "w", encoding="utf-8") as kept:
        kept.write("\n".join(["\t".join(columns), *lines]) + "\n")
    return lines


def table(head, rows):
    return "\n".join(["| " + " | ".join(cells) + " |" for cells in [head, ["---"] * len(head), *rows]]) + "\n"


# Why a goal is missed, by numbers and metric; what is measured stands before it.
CAUSES = {
    ("(0,2)-sequence", "absolute"): "on narrow lobes points of a sequence make errors of MIS fall faster than those of picks among candidates (GGX 0.05 in Convergence)",
    ("(0,2)-sequence", "relative"): "pixels that see light which is blocked (Why direct light loses)",
    ("random", "absolute"): "BSDF rays bring later hits and the light up to the mean, as in MIS",
    ("random", "relative"): "BSDF rays bring later hits and the light up to the mean, as in MIS",
}


def main(program, folder, path):
    # Seconds, absolute and relative error, by tracer, map, numbers, samples and method.
    cells = {}
    results = path.removesuffix(".md")
    for line in measured(runs_of, COLUMNS, program, folder, f"{results}.tsv"):
        tracer, name, numbers, samples, method, seconds, _, absolute, relative, *_ = line.split("\t")
        cells.setdefault((tracer, name, numbers, int(samples)), {})[method] = [float(x) for x in (seconds, absolute, relative)]
    # The same and the errors of the disc and of the mesh, by experiment, map, samples and method.
    tried = {}
    for line in measured(experiments_of, EXPERIMENT_COLUMNS, program, folder, f"{results}-experiments.tsv"):
        run, name, samples, method, seconds, _, absolute, relative, _, _, disc, mesh = line.split("\t")
        seconds, absolute, relative, disc, mesh = (float(x) for x in (seconds, absolute, relative, disc, mesh))
        tried.setdefault((run, name, int(samples)), {})[method] = [seconds, absolute, relative, relative * disc, relative * mesh]
    names = sorted({key[1] for key in cells})

    def cost(key, method, metric):
        return cells[key][method][0] * cells[key][method][1 + metric]

    def gain(key, method, metric):
        return min(cost(key, other, metric) for other in BASELINES) / cost(key, method, metric)

    def best_of(key, metric):
        return min(BASELINES, key=lambda other: cost(key, other, metric))

    # An error that is 0 or below is one that the references cannot tell.
    told = [key for key in cells if all(min(row[1:3]) > 0 for row in cells[key].values())]

    def of(group):
        return [key for key in told if (key[0], key[2], key[3]) == group]

    def gains(group, method, metric):
        return [gain(key, method, metric) for key in of(group) if method in cells[key]]

    groups = list(dict.fromkeys((key[0], key[2], key[3]) for key in told))
    places = list(dict.fromkeys(group[:2] for group in groups))
    numbers_of_samples = sorted({group[2] for group in groups})

    def text(values):
        return f"{geometric_mean(values):.2f}x ({min(values):.2f}x)" if values else "-"

    summary, rows, goals = [], [], []
    for place in places:
        for metric, name in enumerate(METRICS):
            found = [gains((*place, samples), ADVISED[place[0]], metric) for samples in numbers_of_samples]
            summary.append([f"{place[0]}, {place[1]}", name, *map(text, found)])
    for group in groups:
        for metric, name in enumerate(METRICS):
            rows.append([f"{group[0]}, {group[1]}", str(group[2]), name, *[text(gains(group, method, metric)) for method in PATTERNS]])
    def under(maps, tracer, *run):
        keys = [(tracer, name, *run) for name in maps if (tracer, name, *run) in told]
        return ", ".join(f"{geometric_mean([gain(key, ADVISED[tracer], metric) for key in keys]):.2f}x" for metric in (1, 0)) if keys else "-"

    by_map = [[name, *[under(maps, *run) for run in BY_MAP]] for name, maps in [*((name, [name]) for name in names), ("outdoors by day", OUTDOORS)]]
    for numbers, goal in GOALS.items():
        kept = [g for g in groups if g[1] == numbers and (g[2] >= 16 if numbers != "random" else g[0] == "paths")]
        for metric, name in enumerate(METRICS):
            keys = [(key, ADVISED[group[0]]) for group in kept for key in of(group)]
            found = [gain(key, ours, metric) for key, ours in keys]
            error = geometric_mean([cells[key][best_of(key, metric)][1 + metric] / cells[key][ours][1 + metric] for key, ours in keys])
            time = geometric_mean([cells[key][ours][0] / cells[key][best_of(key, metric)][0] for key, ours in keys])
            reached = geometric_mean(found) >= goal[metric] and (metric == 0 or min(found) >= 1)
            least = ", and no cell below 1" if metric else ""
            where = "path tracers" if numbers == "random" else "all tracers with 16 samples and more"
            verdict = "reached" if reached else f"**missed**: {CAUSES[numbers, name]}"
            goals.append(f"- {numbers}, {where}, {name}: {geometric_mean(found):.2f}x, least {min(found):.2f}x; with as many samples {error:.2f}x in {time:.2f}x of the "
                         f"time. The goal of {goal[metric]}x{least} is {verdict}.")
    sphere = geometric_mean([value for group in groups if group[0] == "spheres" for value in gains(group, ADVISED["spheres"], 1)])
    goals.append(f"- A tracer of spheres whose rays cost 50 ns, relative: {sphere:.2f}x. The goal of 1x is {'reached' if sphere >= 1 else '**missed**'}.")

    def lacking(run, samples):
        """Gains in relative error, by map, of a call that brings all light."""
        found = [(name, cells.get(("direct light", name, NUMBERS[1], samples)) if run is None else tried.get((run, name, samples))) for name in names]
        rows = [row for _, row in found if row is not None and all(values[2] > 0 for values in row.values())]
        return [min(row[other][0] * row[other][2] for other in BASELINES) / (row["alone"][0] * row["alone"][2]) for row in rows]

    causes = [[run or "as it is", *[text(lacking(run, samples)) for samples in (16, 64, 256)]] for run in (None, *LACKS)]

    lost = [(name, row["alone"]) for (run, name, _), row in tried.items()
            if run == "without both" and row["alone"][0] * row["alone"][2] > min(row[other][0] * row[other][2] for other in BASELINES)]
    shares = [values[4] / values[2] for _, values in lost] or [0]
    losing = ", ".join(sorted({name for name, _ in lost}))

    # Of one sample a pixel: all seconds of an image.
    path_us = 1e6 * geometric_mean([cells[key]["mis"][0] / PIXELS for key in cells if key[0] == "paths" and key[3] == 1])

    losses = []
    won = {metric: [0, 0] for metric in METRICS}
    for key in told:
        for metric, name in enumerate(METRICS):
            ours = ADVISED[key[0]]
            value = gain(key, ours, metric)
            won[name] = [won[name][0] + (value > 1), won[name][1] + 1]
            if value < 1:
                (seconds, *error), (own, *own_error) = cells[key][best_of(key, metric)], cells[key][ours]
                losses.append([key[1], f"{key[0]}, {key[2]}", str(key[3]), name, f"{value:.2f}x",
                               f"{error[metric] / own_error[metric]:.2f}x", f"{own / seconds:.2f}x"])

    def slope(run, method, part):
        """Of a line through the logarithms of errors and samples, as the mean over maps."""
        found = []
        for name in SLOPED:
            points = [(samples, tried[run, name, samples][method][part]) for samples in (16, 64, 256, 1024) if (run, name, samples) in tried]
            if len(points) == 4 and all(error > 0 for _, error in points):
                found.append(linear_regression(*zip(*((math.log(samples), math.log(error)) for samples, error in points))).slope)
        return f"{sum(found) / len(found):.2f}" if found else "-"

    sloped = {key[1] for key in tried if key[0] not in LACKS}
    slopes = []
    for material in MATERIALS:
        for surface, mesh, part in (("flat floor", "fine", 3), ("curved, fine mesh", "fine", 4), ("curved, coarse mesh", "coarse", 4)):
            slopes.append([material, surface, *[slope(f"{material}, {mesh}", method, part) for method in (*BASELINES, "alone")]])

    worst = [row for name in METRICS for row in sorted((row for row in losses if row[3] == name), key=lambda row: float(row[4][:-1]))[:LOSSES]]
    provenance = subprocess.run(["scripts/provenance.sh", "pathtracer-page"], check=True, capture_output=True, text=True).stdout
    if os.path.isfile(folder):
        # What the page says of the run it was measured in stays.
        provenance = re.search(r"^Commit [\s\S]*", read(path), flags=re.M).group()
    with open(path, "w", encoding="utf-8") as file:
        samples = [f"{samples} samples" if samples > 1 else "1 sample" for samples in numbers_of_samples]
        file.write(read("scripts/pathtracer.md").removesuffix("\n").format(
            won_relative=won["relative"][0], of_relative=won["relative"][1], won_absolute=won["absolute"][0], of_absolute=won["absolute"][1],
            untold=len(cells) - len(told), maps=len(names), path_us=path_us, goals="\n".join(goals), outdoors=", ".join(OUTDOORS),
            losing=losing, least_share=100 * min(shares), largest_share=100 * max(shares), sloped=len(sloped), names=", ".join(names),
            provenance=provenance, summary=table(["tracer, numbers", "metric", *samples], summary),
            by_map=table(["map", *[f"{tracer}, {numbers}, {samples}" for tracer, numbers, samples in BY_MAP]], by_map),
            causes=table(["scene", *[f"{samples} samples" for samples in (16, 64, 256)]], causes),
            rows=table(["tracer, numbers", "samples", "metric", *[CALLED[method] for method in PATTERNS]], rows),
            slopes=table(["material", "pixels that see", "MIS", "compensated MIS", CALLED["alone"]], slopes),
            worst=table(["map", "tracer, numbers", "samples", "metric", "efficiency", "error", "time"], worst) if worst else "In no cell."))


os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
main(*sys.argv[1:])
