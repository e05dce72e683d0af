#!/usr/bin/env python3
"""How much interpolated outlines change from frame to frame along a walk, beside the model's own, for one or two builds of the program.

    tools/popping.py NEW_BINARY [OLD_BINARY] [--models NAME …] [--folder DIR] [--frames N] [--step DEGREES] [--build="OPTIONS"]

Each model is built by each program. An eye goes along a tilted circle at 3 radii; outlines of `contour`, and of `edges --outline` by
NEW_BINARY, are filled in pictures of 1024 × 1024 pixels. Prints, for each, the pixels that change from one frame to the next, on average;
how much more change there is than in the model's own outline; and the largest connected patch that changes at once.

Models are named as for tools/strays.py. Needs NumPy and SciPy, and makes an environment with them for the time where they are not there.
"""
import argparse
import shlex
import sys
import tempfile
from pathlib import Path

# Nothing is left in the tree.
sys.dont_write_bytecode = True
from exact_peers import call, option, run_with
from models import MODELS
from strays import PACKAGES, SIDE_PX, build, exact_outlines, find_models, line

HEAD = ["model", "outline", "changed pixels a frame", "more than the model's", "largest patch, 99 % of frames", "largest patch"]


def walk(asset, silmap, frames, step):
    """Eyes along a circle that is tilted out of every axis, as `--eye` takes them."""
    import numpy

    info = call(silmap, "inspect", asset, "--json")["model"]
    one = numpy.array([1.0, 0.31, -0.17])
    one /= numpy.linalg.norm(one)
    two = numpy.cross(one, [0.23, -0.4, 1.0])
    two /= numpy.linalg.norm(two)
    turns = numpy.radians(step) * numpy.arange(frames)[:, None]
    towards = numpy.cos(turns) * one + numpy.sin(turns) * two
    return [option("eye", eye) for eye in numpy.array(info["center"]) + 3 * info["radius"] * towards]


def filled(loops):
    """The pixels whose centres loops hold, even-odd."""
    import numpy

    toggles = numpy.zeros((SIDE_PX, SIDE_PX + 1), numpy.int32)
    for points in loops:
        points = numpy.array(points, float)[:, :2]
        for (x0, y0), (x1, y1) in zip(points, numpy.roll(points, -1, 0)):
            low, high = sorted((y0, y1))
            rows = numpy.arange(max(0, int(numpy.ceil(low - 0.5))), min(SIDE_PX, int(numpy.ceil(high - 0.5))))
            x = x0 + (rows + 0.5 - y0) * ((x1 - x0) / (y1 - y0)) if len(rows) else rows
            numpy.add.at(toggles, (rows, numpy.clip(numpy.ceil(x - 0.5), 0, SIDE_PX).astype(int)), 1)
    return numpy.cumsum(toggles, 1)[:, :SIDE_PX] % 2 == 1


def changes(pictures):
    """Of each frame but the first, the pixels that changed, and the largest patch of them."""
    import numpy
    from scipy import ndimage

    found, last = [], None
    for picture in pictures:
        if last is not None:
            changed = picture != last
            patches, count = ndimage.label(changed)
            largest = numpy.bincount(patches.ravel())[1:].max() if count else 0
            found.append((changed.sum(), largest))
        last = picture
    return numpy.array(found)


def row(name, label, found, own):
    import numpy

    pixels, patches = found.T
    more = "–" if found is own else f"{100 * (pixels.mean() / own[:, 0].mean() - 1):.1f} %"
    line([name, label, f"{pixels.mean():.0f}", more, f"{numpy.quantile(patches, 0.99):.0f}", f"{patches.max()}"])


def run(o):
    programs = [("new", o.new.resolve())] + ([("old", o.old.resolve())] if o.old else [])
    line(HEAD)
    line(["---"] * 2 + ["--:"] * (len(HEAD) - 2))
    with tempfile.TemporaryDirectory() as scratch:
        scratch = Path(scratch)
        for name, model, mending in find_models(o.models, o.folder, programs[0][1], scratch):
            own = None
            for label, silmap in programs:
                asset = scratch / f"{name}-{label}.glb"
                build(silmap, model, mending, shlex.split(o.build), asset)
                if own is None:
                    eyes = walk(asset, silmap, o.frames, o.step)
                    own = changes(map(filled, exact_outlines(silmap, model, mending, eyes, scratch)))
                    row(name, "the model's", own, own)
                size = f"{SIDE_PX}x{SIDE_PX}"
                seen = (call(silmap, "contour", asset, eye, "--size", size, "--json")["loops"] for eye in eyes)
                row(name, label, changes(map(filled, seen)), own)


def main():
    arguments = [a for a in sys.argv[1:] if a != "--inside"]
    if not arguments or arguments[0] in ("-h", "--help"):
        sys.exit(__doc__)
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("new", type=Path)
    parser.add_argument("old", type=Path, nargs="?")
    parser.add_argument("--models", nargs="+", default=["stanford-bunny.ply"])
    parser.add_argument("--folder", type=Path, default=MODELS)
    parser.add_argument("--frames", type=int, default=481)
    parser.add_argument("--step", type=float, default=0.25)
    parser.add_argument("--build", default="", help="more options of `build`, in one argument")
    o = parser.parse_args(arguments)
    run_with(PACKAGES, __file__, arguments, lambda: run(o))


if __name__ == "__main__":
    main()
