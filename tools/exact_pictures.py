#!/usr/bin/env python3
"""How far the exactly clipped hull is from the model, in pixels of what the renderer draws.

    tools/exact_pictures.py target/release/silmap ASSET MODEL [--eyes 50] [--side 1024] [--mode exact] [--close-holes]

Draws modes `exact` and `original` without smoothing from random eyes at 1.5R to 6R and prints one JSON object with the share of
pixels inside `original` that are on the wrong side. Needs numpy and pillow. `--mode textured` measures the unclipped hull, which must
come out bad.
"""
import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import numpy
from PIL import Image

SEED = 1


def mask(silmap, asset, model, eye, mode, side, folder):
    """Pixels that a picture covers."""
    out = Path(folder) / "picture.png"
    eye = "--eye=" + ",".join(f"{x:.17g}" for x in eye)
    command = [silmap, "render", asset, eye, "--mode", mode, "--model", *model, "--antialias", "none"]
    command += ["--background", "transparent", "--size", f"{side}x{side}", "-o", out]
    subprocess.run([str(c) for c in command], check=True, stderr=subprocess.DEVNULL)
    with Image.open(out) as picture:
        return numpy.asarray(picture.convert("RGBA"))[:, :, 3] > 127


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("silmap", type=Path)
    parser.add_argument("asset", type=Path)
    parser.add_argument("model")
    parser.add_argument("--close-holes", action="store_true")
    parser.add_argument("--eyes", type=int, default=50)
    parser.add_argument("--side", type=int, default=1024)
    parser.add_argument("--mode", default="exact")
    options = parser.parse_args()
    model = [options.model] + (["--close-holes"] if options.close_holes else [])
    inspected = json.loads(subprocess.run([options.silmap, "inspect", options.asset, "--json"], stdout=subprocess.PIPE, check=True).stdout)
    center, radius = numpy.array(inspected["model"]["center"]), inspected["model"]["radius"]
    random = numpy.random.default_rng(SEED)
    wrong, inside, worst = 0, 0, 0.0
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(options.eyes):
            direction = random.normal(size=3)
            distance = radius * 1.5 * 4 ** random.random()
            eye = center + direction / numpy.linalg.norm(direction) * distance
            drawn, truth = (
                mask(options.silmap, options.asset, model, eye, mode, options.side, folder) for mode in (options.mode, "original")
            )
            different = int((drawn != truth).sum())
            wrong, inside = wrong + different, inside + int(truth.sum())
            worst = max(worst, different / max(1, truth.sum()))
    print(json.dumps({"eyes": options.eyes, "misclassified": wrong / inside, "misclassified_max": float(worst), "pixels": wrong}))


if __name__ == "__main__":
    main()
