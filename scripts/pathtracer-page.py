#!/usr/bin/env python3
"""Runs the path tracer under each lat-long map of a folder and writes its page: pathtracer-page.py PROGRAM MAPS PAGE

Results stand beside the page, as .tsv; that file in place of MAPS writes the page alone. Two maps run at a time, each in one thread."""
import glob
import math
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

# Every so many pixels of an image of 960 x 560: hits of a pixel are then as near to one another as those of a real image.
VIEW = ["--width", "24", "--height", "14", "--stride", "40"]
# What is traced, by name: the arguments, and the most samples of a pixel with random numbers and with a (0,2)-sequence.
TRACERS = {
    "paths": (["--repeats", "1", "--reference", "500"], ["256", "256"]),
    "direct light": (["--depth", "1", "--repeats", "1", "--reference", "1000"], ["256", "1024"]),
    "direct light, 4 rays": (["--depth", "1", "--rays", "4", "--repeats", "1", "--reference", "1000"], ["64", "256"]),
    "spheres": (["--spheres", "1", "--repeats", "2", "--reference", "250"], ["64", "64"]),
}
NUMBERS = ["random", "(0,2)-sequence"]
METRICS = ["absolute", "relative"]
PATTERNS = ["direct", "alone"]
# The pattern of docs/integrating.md for each tracer: verdicts and losses are of these.
ADVISED = {"paths": "direct", "direct light": "alone", "direct light, 4 rays": "alone", "spheres": "direct"}
BASELINES = ["mis", "compensated"]
COLUMNS = ["tracer", "map", "numbers", "samples", "method", "seconds", "mean", "absolute MSE", "relative MSE", "absolute efficiency over mis",
           "relative efficiency over mis", "share of the metal sphere"]
# How many of the cells that lose most the page shows, for each metric.
LOSSES = 8
# Goals, absolute and relative: the mean with a (0,2)-sequence of 16 samples and more, and in a path tracer with random numbers.
GOALS = {"(0,2)-sequence": [3.0, 1.5], "random": [5.5, 3.5]}


def runs_of(program, path):
    lines = []
    for tracer, (arguments, most) in TRACERS.items():
        for stratified in (0, 1):
            command = [program, "--map", path, "--stratified", str(stratified), "--most", most[stratified], *VIEW, *arguments]
            out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            name = os.path.basename(path)[:-4]
            rows = [line.split() for line in out.splitlines() if re.match(r" *\d+ \w", line)]
            lines += ["\t".join([tracer, name, NUMBERS[stratified], *row]) for row in rows if len(row) == 9]
    return lines


def measured(program, folder, path):
    if os.path.isfile(folder):
        with open(folder, encoding="utf-8") as file:
            return file.read().splitlines()[1:]
    maps = sorted(m for m in glob.glob(f"{folder}/*.hdr") if "cross" not in m and "probe" not in m)
    with ThreadPoolExecutor(2) as pool:
        lines = [line for lines in pool.map(lambda m: runs_of(program, m), maps) for line in lines]
    with open(path.removesuffix(".md") + ".tsv", "w", encoding="utf-8") as file:
        file.write("\n".join(["\t".join(COLUMNS), *lines]) + "\n")
    return lines


def table(head, rows):
    return "\n".join(["| " + " | ".join(cells) + " |" for cells in [head, ["---"] * len(head), *rows]]) + "\n"


def mean(values):
    return math.exp(sum(map(math.log, values)) / len(values))


# Why a goal is missed, by numbers and metric; what is measured stands before it.
CAUSES = {
    ("(0,2)-sequence", "absolute"): "points of a sequence make errors of MIS fall faster than those of picks among candidates (Convergence)",
    ("(0,2)-sequence", "relative"): "pixels that see light which is blocked (Why direct light loses)",
    ("random", "absolute"): "BSDF rays bring later hits and the light up to the mean, as in MIS",
    ("random", "relative"): "BSDF rays bring later hits and the light up to the mean, as in MIS",
}


def main(program, folder, path):
    # Seconds, absolute and relative error, and the share of the metal sphere in that, by tracer, map, numbers, samples and method.
    cells = {}
    for line in measured(program, folder, path):
        tracer, name, numbers, samples, method, seconds, _, absolute, relative, _, _, metal = line.split("\t")
        values = [float(x) for x in (seconds, absolute, relative, metal)]
        cells.setdefault((tracer, name, numbers, int(samples)), {})[method] = values
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
        return [gain(key, method, metric) for key in of(group)]

    groups = list(dict.fromkeys((key[0], key[2], key[3]) for key in told))
    places = list(dict.fromkeys(group[:2] for group in groups))
    numbers_of_samples = sorted({group[2] for group in groups})

    def text(values):
        return f"{mean(values):.2f}x ({min(values):.2f}x)" if values else "-"

    summary, rows, goals = [], [], []
    for place in places:
        for metric, name in enumerate(METRICS):
            found = [gains((*place, samples), ADVISED[place[0]], metric) for samples in numbers_of_samples]
            summary.append([f"{place[0]}, {place[1]}", name, *map(text, found)])
    for group in groups:
        for metric, name in enumerate(METRICS):
            rows.append([f"{group[0]}, {group[1]}", str(group[2]), name, *[text(gains(group, method, metric)) for method in PATTERNS]])
    for numbers, goal in GOALS.items():
        kept = [g for g in groups if g[1] == numbers and (g[2] >= 16 if numbers != "random" else g[0] == "paths")]
        for metric, name in enumerate(METRICS):
            keys = [(key, ADVISED[group[0]]) for group in kept for key in of(group)]
            found = [gain(key, ours, metric) for key, ours in keys]
            error = mean([cells[key][best_of(key, metric)][1 + metric] / cells[key][ours][1 + metric] for key, ours in keys])
            time = mean([cells[key][ours][0] / cells[key][best_of(key, metric)][0] for key, ours in keys])
            reached = mean(found) >= goal[metric] and (metric == 0 or min(found) >= 1)
            least = ", and no cell below 1" if metric else ""
            where = "path tracers" if numbers == "random" else "all tracers with 16 samples and more"
            verdict = "reached" if reached else f"**missed**: {CAUSES[numbers, name]}"
            goals.append(f"- {numbers}, {where}, {name}: {mean(found):.2f}x, least {min(found):.2f}x; with as many samples {error:.2f}x in {time:.2f}x of the "
                         f"time. The goal of {goal[metric]}x{least} is {verdict}.")
    sphere = mean([value for group in groups if group[0] == "spheres" for value in gains(group, ADVISED["spheres"], 1)])
    goals.append(f"- A tracer of spheres whose rays cost 50 ns, relative: {sphere:.2f}x. The goal of 1x is {'reached' if sphere >= 1 else '**missed**'}.")

    def rest(key, method):
        """The cost of the relative error of all pixels but those of the metal sphere."""
        return cost(key, method, 1) * (1 - cells[key][method][3])

    causes = []
    for group in groups:
        if group[0].startswith("direct light") and group[1] == NUMBERS[1] and group[2] >= 16:
            keys = [key for key in of(group) if all(row[3] < 1 for row in cells[key].values())]
            ours = ADVISED[group[0]]
            shares = [[cells[key][method][3] for key in keys] for method in (*BASELINES, ours)]
            without = [min(rest(key, other) for other in BASELINES) / rest(key, ours) for key in keys]
            causes.append([group[0], str(group[2]), *[f"{100 * sum(share) / len(share):.0f} %" for share in shares],
                           text([gain(key, ours, 1) for key in keys]), text(without)])

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

    steps = [(16, 64), (64, 256), (256, 1024)]
    slopes = []
    for method in BASELINES + PATTERNS:
        def slope(step):
            keys = [[("direct light", name, NUMBERS[1], samples) for samples in step] for name in names]
            found = [[cells[key][method][2] for key in pair] for pair in keys if all(key in told for key in pair)]
            return sum(math.log(b / a) / math.log(step[1] / step[0]) for a, b in found) / len(found) if found else math.nan
        slopes.append([method, *[f"{slope(step):.2f}" for step in steps]])

    worst = [row for name in METRICS for row in sorted((row for row in losses if row[3] == name), key=lambda row: float(row[4][:-1]))[:LOSSES]]
    provenance = subprocess.run(["scripts/provenance.sh", "pathtracer-page"], check=True, capture_output=True, text=True).stdout
    if os.path.isfile(folder):
        # What the page says of the run it was measured in stays.
        with open(path, encoding="utf-8") as file:
            provenance = re.search(r"^Commit [\s\S]*", file.read(), flags=re.M).group()
    with open(path, "w", encoding="utf-8") as file:
        file.write(f"""# Light in a path tracer, at equal time

**In path tracers let `wis_direct` bring what exceeds the mean of the map, and BSDF rays the rest; in direct light let it bring all.** Against the
better of MIS and compensated MIS this wins {won['relative'][0]} of {won['relative'][1]} cells in relative error, and {won['absolute'][0]} of \
{won['absolute'][1]} in absolute error. A cell is a tracer, a map and a
number of samples per pixel. {len(cells) - len(told)} cells are left out, whose errors are below what the references can tell.

Efficiency over the better of MIS and compensated MIS: 1 / (mean squared error x time). Geometric mean over {len(names)} maps, in brackets the worst
map. Above 1 is better. Both MIS take a sample of the light and one of the BSDF at each hit, with 4 rays four of each.

{table(["tracer, numbers", "metric", *[f"{samples} samples" if samples > 1 else "1 sample" for samples in numbers_of_samples]], summary)}
{chr(10).join(goals)}

## Why direct light loses

Direct light, (0,2)-sequence, relative error. About half of it is on the metal sphere, GGX 0.05. Where that mirrors the ground it is dark: its light
is hidden, and what is left comes from the tail of the lobe. Rays that follow BSDF times light go to what is hidden; light samples of MIS do not.
Most of the rest is the floor in shadows, where wis traces one ray and MIS two: with 4 rays for a hit it is level up to 64 samples.

{table(["tracer", "samples", "metal: its share in the error of MIS", "of compensated MIS", "of wis", "efficiency of wis", "without the metal sphere"], causes)}
- **Products for diffuse lobes, candidates for narrow ones** is what hits do: each by its narrowest lobe. Only the varnish has a diffuse lobe
  and one narrower than 0.2, and 2 to 8 % of the error under three maps. So drawing one of the two by chance could lower no error by more than that.
- **Candidates that the renderer's points drive** are those of now: candidate `i` of the sample `t` is point `16 t + i` of one Owen-scrambled Sobol
  sequence. All candidates of a pixel together are a (0,2)-sequence, and each sample's are a net. Points of the renderer could stratify no better.
- **A BSDF ray for direct light**: column "direct" below. It halves the error of the floor, and has 1.4 to 2.9 times that of the metal sphere.
- **More candidates, and chances for all of them**: four times as many have 0.5 to 1.1 times the efficiency in relative error under three maps. A least
  weight of 0.2 of the mean in place of 0.05 has 1.0 to 1.3 times in relative error and 0.8 to 0.9 times in absolute error; one of 1 has 1.1 to 2.0
  times and 0.5 to 0.6 times.

## Both patterns

{table(["tracer, numbers", "samples", "metric", "direct", "direct alone"], rows)}
- **direct**: `WIS_POINT_COMPENSATED`, and BSDF rays that leave the scene bring the map up to its mean. In direct light BSDF rays are traced for it.
- **direct alone**: `wis_direct` brings all light.
- **paths**: four hits. **direct light**: one hit. **spheres**: paths without the mesh, whose rays cost 50 ns. A sphere is of GGX 0.05.

## Convergence

Slope of log relative error over log samples: direct light, (0,2)-sequence, mean over maps. Independent samples have -1. Steeper is better.

{table(["method", *[f"{a} to {b} samples" for a, b in steps]], slopes)}
## Where it loses most

Of direct for paths and spheres, of direct alone for direct light. Error: that of the better MIS over ours with as many samples. Time: ours over
that of the better MIS. Every cell stands in [pathtracer.tsv](pathtracer.tsv).

{table(["map", "tracer, numbers", "samples", "metric", "efficiency", "error", "time"], worst) if worst else "In no cell."}
## How it was measured

`make pathtracer-page MAPS=folder` wrote this page. The tracer is `scene.h` and `path.h` in `c-examples/pathtracer`: spheres, a mesh of 115,200
triangles, Lambert, GGX of 0.05, 0.15 and 0.3, patterned albedo. One ray for light at each hit, or four. 24 x 14 pixels, every 40th of an image of 960 x 560;
processor time of one thread; methods take turns. Errors are the mean of (image - one reference) x (image - the other), so that the noise of
references does not bias them. Relative error: squared error / (reference^2 + 1e-4 mean^2). Maps: {", ".join(names)}.

{provenance}""")


os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
main(*sys.argv[1:])
