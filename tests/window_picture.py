#!/usr/bin/env python3
"""What the window of examples/embed shows: models, a ground, and shadows on it.

    tests/window_picture.py EMBED ASSET.glb

Runs on the display that DISPLAY names and looks at its picture, the XWD file DISPLAY_PICTURE (see tools/machine.bash). The model is
without colours of its own, so that it is warmer than the ground, which is greener. Without instances there must be neither models
nor shadows: a test that sees them everywhere is worth nothing.
"""

import os
import struct
import subprocess
import sys
import time

PATIENCE_S = 120
# Shares of the picture.
LEAST_MODELS, LEAST_GROUND, LEAST_SHADE = 0.03, 0.05, 0.01
# Below it the ground is in the shade, in steps of 255: its darkest tile in the light has 130.
SHADE = 110


def shares(path):
    """Shares of the pixels that are models, lit ground and ground in the shade; None before there is a picture."""
    with open(path, "rb") as file:
        data = file.read()
    header = struct.unpack(">25I", data[:100])
    first, width, height, row, colours = header[0], header[4], header[5], header[12], header[19]
    first += 12 * colours
    models = ground = shade = sky = 0
    for y in range(0, height, 2):
        line = data[first + y * row : first + y * row + 4 * width]
        for blue, green, red in zip(line[0::8], line[1::8], line[2::8]):
            if blue > green > red:
                sky += 1
            elif red > green > blue:
                models += 1
            elif green >= red >= blue and green > 0:
                ground += green >= SHADE
                shade += green < SHADE
    count = (height // 2) * (width // 2)
    return None if sky == 0 else (models / count, ground / count, shade / count)


def look(command, is_found):
    """Runs a command until the picture has something, or for a while, and returns the last picture's shares."""
    seen = None
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as window:
        try:
            end = time.monotonic() + PATIENCE_S
            while time.monotonic() < end and window.poll() is None:
                time.sleep(0.5)
                seen = shares(os.environ["DISPLAY_PICTURE"]) or seen
                if seen and is_found(*seen):
                    break
        finally:
            window.terminate()
    return seen or (0, 0, 0)


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    embed, asset = sys.argv[1:]

    def is_right(models, ground, shade):
        return models >= LEAST_MODELS and ground >= LEAST_GROUND and shade >= LEAST_SHADE

    def is_empty(models, ground, shade):
        return models == 0 and ground >= LEAST_GROUND and shade == 0

    for options in [[], ["--coverage"]]:
        seen = look([embed, "--model", asset, *options], is_right)
        models, ground, shade = (100 * share for share in seen)
        print(f"{' '.join(options) or 'stencil'}: {models:.1f} % models, {ground:.1f} % ground in the light, {shade:.1f} % in the shade")
        if not is_right(*seen):
            sys.exit("the window does not show models with shadows on a ground")
    if not is_empty(*look([embed, "--model", asset, "--instances", "0"], is_empty)):
        sys.exit("models or shadows are seen where there are none")


main()
