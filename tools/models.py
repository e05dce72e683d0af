#!/usr/bin/env python3
"""Every closed model of ../shared/models in one table: errors, bytes, seconds, and whether `hull` is conservative.

    tools/models.py target/release/silmap [--quick | --defaults] [--viewpoints K] [--only NAME …]

Builds each model twice, with the default options and with `--coverage any`, and evaluates both over random viewpoints on the
polytope. Prints a row of Markdown as soon as it is measured; exit code 1 when method `hull` with `--coverage any` lets more escape
than is promised. `--quick` looks at nothing else, and builds with fewer views at a lower resolution: that makes outlines worse, but
what may escape does not depend on it. `--defaults` builds with the default options only.
"""
import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MODELS = Path(__file__).resolve().parent.parent.parent / "shared" / "models"
CLOSE, REPAIR = "--close-holes", "--repair"
# Every file there but alligator.obj, which encloses nothing, and what makes it a closed manifold.
FILES = {
    "stanford-bunny.ply": [CLOSE],
    "stanford-bunny-closed.off": [],
    "stanford-dragon-100k.obj": [],
    "stanford-dragon-res2.ply": [REPAIR],
    "armadillo.obj": [],
    "turbine-blade.ply": [],
    "spot/spot_triangulated.obj": [],
    "spot/spot_quadrangulated.obj": [],
    "spot/spot_control_mesh.obj": [],
    "feline/feline.obj": [],
    "fuze/fuze.obj": [],
    "cow.obj": [REPAIR],
    "beethoven.ply": [REPAIR],
    "teapot.obj": [CLOSE],
    "suzanne.obj": [CLOSE, REPAIR],
    "cheburashka.off": [],
    "fertility.off": [],
    "elephant.off": [],
    "three-hole-torus.off": [],
    "knot-quads.obj": [],
    "torus.stl": [],
    "decimated-knight.off": [],
    "lion.off": [CLOSE],
    "duck.glb": [],
}
QUICK = "--views 96 --keep 40 --resolution 256 --faces 200 --texture-views 4 --texture-size 32".split()
# What method `hull` may lose with `--coverage any`, as shares of the pixels inside: on average, and at the worst viewpoint.
ESCAPED_MEAN, ESCAPED_MAX = 0.0001, 0.001

ESCAPED_HEAD = "`hull` escaped, `--coverage any`: mean, worst"
ERRORS_HEAD = ["`tight` mean, worst", "`hull` mean, worst", "`paper` mean, worst", "silhouettes", "`build`"]


def call(*arguments):
    """The JSON object that a command prints; its warnings are left out."""
    done = subprocess.run([str(a) for a in arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip().splitlines()[-1])
    return json.loads(done.stdout)


def pair(measured, what):
    return f"{100 * measured[what + '_mean']:.3g} %, {100 * measured[what + '_max']:.3g} %"


def errors(silmap, model, mending, evaluate, asset):
    """The cells that tell of the default options, and the model's faces."""
    since = time.monotonic()
    call(silmap, "build", model, "-o", asset, *mending, "--json")
    seconds = time.monotonic() - since
    inspected = call(silmap, "inspect", asset, "--json")
    size = inspected["map"]["bytes"]
    methods = call(silmap, "evaluate", asset, *evaluate)["methods"]
    cells = [pair(methods[m], "misclassified") for m in ("tight", "hull", "paper")]
    return [*cells, f"{size / 1024:.0f} KiB", f"{seconds:.0f} s"], inspected["model"]["faces"]


def escaped(silmap, model, mending, settings, evaluate, asset):
    """What method `hull` lets escape with `--coverage any`, the eye it is worst at, and the model's faces."""
    call(silmap, "build", model, "-o", asset, *mending, *settings, "--coverage", "any", "--json")
    evaluation = call(silmap, "evaluate", asset, *evaluate, "--method", "hull")
    worst = max(evaluation["per_viewpoint"], key=lambda v: v["escaped"])
    faces = call(silmap, "inspect", asset, "--json")["model"]["faces"]
    return evaluation["methods"]["hull"], worst["eye"], faces


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("silmap", type=Path)
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--quick", action="store_true")
    what.add_argument("--defaults", action="store_true")
    parser.add_argument("--viewpoints", type=int, default=200)
    parser.add_argument("--only", nargs="+", default=list(FILES), metavar="NAME")
    options = parser.parse_args()
    if not MODELS.is_dir():
        print(f"skipped: {MODELS} is not here")
        return
    silmap, over = options.silmap.resolve(), []
    head = ["model", "faces"] + ([] if options.defaults else [ESCAPED_HEAD]) + ([] if options.quick else ERRORS_HEAD)
    print("| " + " | ".join(head) + " |\n|" + "---|" * len(head), flush=True)
    for name in options.only:
        model, mending = MODELS / name, FILES[name]
        evaluate = ["--model", model, *mending, "--viewpoints", options.viewpoints, "--json"]
        with tempfile.TemporaryDirectory() as folder:
            asset = Path(folder) / "model.glb"
            cells, lost, settings = [], None, QUICK if options.quick else []
            try:
                if not options.defaults:
                    lost, eye, faces = escaped(silmap, model, mending, settings, evaluate, asset)
                    cells.append(pair(lost, "escaped"))
                if not options.quick:
                    of_defaults, faces = errors(silmap, model, mending, evaluate, asset)
                    cells += of_defaults
            except RuntimeError as error:
                print(f"| {name} | {error} |", flush=True)
                over.append(f"{name}: {error}")
                continue
        print("| " + " | ".join([model.name, f"{faces:,}", *cells]) + " |", flush=True)
        if lost and (lost["escaped_mean"] > ESCAPED_MEAN or lost["escaped_max"] > ESCAPED_MAX):
            over.append(f"{name}: {pair(lost, 'escaped')} escaped, worst at the eye {eye}")
    if over:
        sys.exit("over the limit:\n" + "\n".join(over))


if __name__ == "__main__":
    main()
