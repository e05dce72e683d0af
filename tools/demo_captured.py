#!/usr/bin/env python3
"""The capture that `silmap demo --captured` makes, with and without spoiled masks: `tools/demo_captured.py SILMAP`.

Spoiled masks must be named by `build --check`, and no other; the asset's error, and that of views that are left out, must not grow much
by them. Left-out views must be predicted nearly as well as by the mesh's own map with views where the photographs were taken.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

# At most so many times the error without spoiled masks.
MOST_WORSE = 1.2
# At most so many times the error of the mesh's own map, views being left out.
MOST_OVER_MESH = 1.5
# Every so many views one is left out.
EVERY = 8
# Misclassified pixels of the carved hull and of the asset, of those inside the true outline, in between.
MOST_CARVED, MOST_ASSET = 0.05, 0.06
# Colours in between, of 255.
MOST_OFF = 12.0


def run(silmap, *words):
    """The JSON that a command prints."""
    done = subprocess.run([silmap, *words, "--json"], check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout)


def main():
    silmap = sys.argv[1]
    errors, left_out = {}, {}
    with tempfile.TemporaryDirectory() as work:
        for share in ["0%", "2%", "5%"]:
            folder = Path(work) / share.rstrip("%")
            spoil = [] if share == "0%" else ["--spoil", share]
            demo = run(silmap, "demo", "--captured", *spoil, "-o", str(folder))
            between = demo["errors"]["between"]
            errors[share] = between["asset"]["mean"]
            print(share, "spoiled", demo["spoiled"], between, f"{demo['seconds']:.0f} s")
            assert between["carved"]["mean"] < MOST_CARVED, between
            assert between["asset"]["mean"] < MOST_ASSET, between
            assert demo["colour_difference"] < MOST_OFF, demo["colour_difference"]
            check = run(silmap, "build", demo["capture"], "--check")
            assert sorted(check["disagree"]) == sorted(demo["spoiled"]), check["disagree"]
            words = ["--leave-one-out", "--every", str(EVERY), "--model", demo["model"]]
            methods = run(silmap, "evaluate", demo["capture"], *words)["methods"]
            left_out[share] = methods["tight"]["misclassified_mean"]
            mesh = methods["mesh-tight"]["misclassified_mean"]
            print(f"left out: tight {left_out[share]:.4f}, the mesh's own map {mesh:.4f}")
            assert left_out[share] <= MOST_OVER_MESH * mesh, methods
            assert len(demo["spoiled"]) == {"0%": 0, "2%": 1, "5%": 3}[share]
    for found in (errors, left_out):
        for share, error in found.items():
            assert error <= MOST_WORSE * found["0%"], (share, found)


if __name__ == "__main__":
    main()
