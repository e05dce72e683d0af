#!/usr/bin/env python3
"""The README's picture of viewpoints: the full mesh, and beside it the asset, textured and clipped.

    tools/viewpoints.py SILMAP [--model FILE] [--out docs/images/viewpoints.jpg]

Builds the model with default options (holes closed) and draws both from the viewpoints below, in columns: mesh above, asset below.
These are viewpoints at which outlines that were interpolated as a whole had slits and hairs. Needs Pillow, and makes an environment with
it for the time where it is not there.
"""
import argparse
import importlib.util
import subprocess
import sys
import tempfile
from pathlib import Path

from exact_peers import enter_environment

PACKAGES = ["pillow==11.0.0"]
ROOT = Path(__file__).resolve().parent.parent
SIDE_PX = 1024
SHOWN_PX = 400
EYES = [
    "-0.195564304,0.328092287,-0.140713324",
    "-0.130044446,0.137141639,-0.293540081",
    "0.212788015,-0.0463752541,0.145359706",
    "-0.3,0.15,0.05",
]


def draw(silmap, model, out):
    from PIL import Image

    sheet = Image.new("RGB", (SHOWN_PX * len(EYES), 2 * SHOWN_PX), "white")
    with tempfile.TemporaryDirectory() as folder:
        asset, picture = Path(folder, "asset.glb"), Path(folder, "picture.png")

        def run(*args):
            subprocess.run([silmap, *map(str, args)], check=True, stderr=subprocess.DEVNULL)

        run("build", model, "--close-holes", "-o", asset)
        for column, eye in enumerate(EYES):
            for row, mode in enumerate((["original", "--model", model, "--close-holes"], ["clipped"])):
                size = f"{SIDE_PX}x{SIDE_PX}"
                run("render", asset, f"--eye={eye}", "--size", size, "-o", picture, "--mode", *mode)
                image = Image.open(picture).convert("RGB").resize((SHOWN_PX, SHOWN_PX), Image.Resampling.LANCZOS)
                sheet.paste(image, (SHOWN_PX * column, SHOWN_PX * row))
    sheet.save(out, quality=88)
    print(f"wrote {out}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("silmap")
    parser.add_argument("--model", default=ROOT.parent / "shared/models/stanford-bunny.ply", type=Path)
    parser.add_argument("--out", default=ROOT / "docs/images/viewpoints.jpg", type=Path)
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if not args.model.exists():
        sys.exit(f"{args.model} is not there: name a model with --model")
    if importlib.util.find_spec("PIL") is None:
        sys.exit(enter_environment(__file__, PACKAGES, sys.argv[1:]))
    draw(args.silmap, args.model, args.out)


main()
