#!/usr/bin/env python3
"""How far interpolated outlines stray from exact ones, for several models and one or two builds of the program, in one table.

    tools/strays.py NEW_BINARY [OLD_BINARY] [--models NAME …] [--folder DIR] [--viewpoints K] [--build="OPTIONS"] [--worst N]

Each model is built by each program, with its default options and those of --build, and looked at from K random eyes at 3 radii. The
outline of `contour` is compared with that of `edges --outline` by NEW_BINARY in pictures of 1024 × 1024 pixels: both boundaries are
sampled every half pixel, and distances between the samples are taken both ways. That uses neither `evaluate` nor any mask of the
program; the column of misclassified pixels alone is what `evaluate` says. Prints a row of Markdown as soon as it is measured; --worst
adds the eyes with the largest distances.

Models are files of the folder, ../shared/models without one, skipped with a word where they are missing, other files, or names that
`silmap generate` knows. Needs NumPy and SciPy, and makes an environment with them for the time where they are not there.
"""
import argparse
import json
import os
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path

# Nothing is left in the tree.
sys.dont_write_bytecode = True
from exact_peers import call, option, run_with
from models import FILES, MODELS

PACKAGES = ["numpy==2.2.6", "scipy==1.15.3"]
USUAL = ["stanford-bunny.ply", "armadillo.obj", "stanford-dragon-100k.obj", "cow.obj", "fertility.off", "organic"]
GENERATED_FACES = 40_000
SIDE_PX = 1024
STEP_PX = 0.5
HEAD = ["model", "build", "mean", "99 %, median eye", "largest, median eye", "90 % of eyes", "worst", "misclassified",
        "silhouettes", "file", "seconds", "processor"]


def sampled(loops):
    """Points along closed loops, at most half a pixel apart; N × 2."""
    import numpy

    parts = [numpy.empty((0, 2))]
    for loop in loops:
        points = numpy.array(loop, float)[:, :2]
        for a, b in zip(points, numpy.roll(points, -1, 0)):
            count = max(1, int(numpy.ceil(numpy.linalg.norm(b - a) / STEP_PX)))
            parts.append(a + (b - a) * numpy.linspace(0, 1, count, endpoint=False)[:, None])
    return numpy.concatenate(parts)


def distances(one, two):
    """Mean, 99 % and largest distance between two boundaries, both ways; infinite where one is missing."""
    import numpy
    from scipy.spatial import cKDTree

    one, two = sampled(one), sampled(two)
    if not (len(one) and len(two)):
        return [float("inf")] * 3
    both = [cKDTree(two).query(one)[0], cKDTree(one).query(two)[0]]
    return [
        sum(d.mean() for d in both) / 2,
        max(numpy.quantile(d, 0.99) for d in both),
        max(d.max() for d in both),
    ]


def find_models(names, folder, silmap, scratch):
    """Name, file and options that mend it, of each model that is there."""
    for name in names:
        path = next((p for p in (folder / name, Path(name)) if p.is_file()), None)
        if path is None and "." not in name:
            path = scratch / f"{name}.ply"
            made = subprocess.run([silmap, "generate", name, "--faces", str(GENERATED_FACES), "-o", path], capture_output=True)
            path = path if made.returncode == 0 else None
        if path is None:
            print(f"skipped: {name} is neither in {folder} nor generated", file=sys.stderr)
            continue
        yield Path(name).stem, path, FILES.get(name, [])


def build(silmap, model, mending, options, asset):
    """Builds, and gives seconds of the clock and of the processor."""
    since = time.monotonic()
    child = subprocess.Popen([silmap, "build", model, *mending, *options, "-o", asset], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    told = child.stderr.read()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        sys.exit(f"failed: build {model}: {told.decode().strip()}")
    return time.monotonic() - since, usage.ru_utime + usage.ru_stime


def eyes_of(asset, silmap, count, seed):
    """Random eyes at 3 radii, as `--eye` takes them."""
    import numpy

    info = call(silmap, "inspect", asset, "--json")["model"]
    random = numpy.random.default_rng(seed)
    towards = random.normal(size=(count, 3))
    towards /= numpy.linalg.norm(towards, axis=1)[:, None]
    return [option("eye", eye) for eye in numpy.array(info["center"]) + 3 * info["radius"] * towards]


def exact_outlines(silmap, model, mending, eyes, scratch):
    found = []
    for eye in eyes:
        file = scratch / "exact.json"
        subprocess.run([silmap, "edges", model, *mending, eye, "--method", "brute", "--outline", file], check=True, capture_output=True)
        found.append(json.loads(file.read_text())["loops"])
    return found


def misclassified(silmap, asset, model, mending, method):
    """What the program itself says; an older one may not know an option, or the asset."""
    told = subprocess.run([silmap, "evaluate", asset, "--model", model, *mending, "--method", method, "--json"], capture_output=True)
    if told.returncode != 0:
        return "–"
    return f"{100 * json.loads(told.stdout)['methods'][method]['misclassified_mean']:.2f} %"


def measure(silmap, asset, eyes, exact, method):
    rows = []
    for eye, truth in zip(eyes, exact):
        ours = call(silmap, "contour", asset, eye, "--size", f"{SIDE_PX}x{SIDE_PX}", "--method", method, "--json")
        rows.append((*distances(ours["loops"], truth), eye.removeprefix("--eye=")))
    return rows


def row(name, label, rows, rest):
    import numpy

    mean, most, largest = (numpy.array([r[k] for r in rows]) for k in range(3))
    figures = [
        f"{mean.mean():.2f}",
        f"{numpy.median(most):.1f}",
        f"{numpy.median(largest):.1f}",
        f"{numpy.quantile(largest, 0.9):.1f}",
        f"{largest.max():.1f}",
    ]
    return [name, label, *figures, *rest]


def line(cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def run(o):
    programs = [("new", o.new.resolve())] + ([("old", o.old.resolve())] if o.old else [])
    worst = []
    line(HEAD)
    line(["---"] * 2 + ["--:"] * (len(HEAD) - 2))
    with tempfile.TemporaryDirectory() as scratch:
        scratch = Path(scratch)
        for name, model, mending in find_models(o.models, o.folder, programs[0][1], scratch):
            eyes = exact = None
            for label, silmap in programs:
                asset = scratch / f"{name}-{label}.glb"
                seconds, processor = build(silmap, model, mending, shlex.split(o.build), asset)
                if eyes is None:
                    eyes = eyes_of(asset, silmap, o.viewpoints, o.seed)
                    exact = exact_outlines(silmap, model, mending, eyes, scratch)
                rows = measure(silmap, asset, eyes, exact, o.method)
                rest = [
                    misclassified(silmap, asset, model, mending, o.method),
                    f"{call(silmap, 'inspect', asset, '--json')['map']['bytes'] / 1024:.0f} KiB",
                    f"{asset.stat().st_size / 1024:.0f} KiB",
                    f"{seconds:.1f}",
                    f"{processor:.1f}",
                ]
                line(row(name, label, rows, rest))
                worst += [(name, label, *r) for r in sorted(rows, key=lambda r: -r[2])[: o.worst]]
    for name, label, mean, _, largest, eye in worst:
        print(f"{name}, {label}: {largest:.1f} px, {mean:.2f} px on average, from {eye}")


def main():
    arguments = [a for a in sys.argv[1:] if a != "--inside"]
    if not arguments or arguments[0] in ("-h", "--help"):
        sys.exit(__doc__)
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("new", type=Path)
    parser.add_argument("old", type=Path, nargs="?")
    parser.add_argument("--models", nargs="+", default=USUAL)
    parser.add_argument("--folder", type=Path, default=MODELS)
    parser.add_argument("--viewpoints", type=int, default=40)
    parser.add_argument("--seed", type=int, default=4)
    parser.add_argument("--method", default="tight")
    parser.add_argument("--build", default="", help="more options of `build`, in one argument")
    parser.add_argument("--worst", type=int, default=0)
    o = parser.parse_args(arguments)
    run_with(PACKAGES, __file__, arguments, lambda: run(o))


if __name__ == "__main__":
    main()
