#!/usr/bin/env python3
"""The viewer in a real window, driven by mouse and keys, with its picture beside that of `silmap render`.

    tests/window_viewer.py VIEWER SILMAP ASSET.glb MODEL

Runs on the display that DISPLAY names and looks at its picture, the XWD file DISPLAY_PICTURE (see tools/machine.bash). Needs xdotool. Each
key must change the picture, the same key back again must bring it back, and the picture must be the one that `silmap render` draws;
the one of another eye must not be: a comparison that lets everything pass is worth nothing.
"""

import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import time
import zlib

PATIENCE_S = 180
EYE, OTHER_EYE = "1.5,1,3", "1.7,1,2.9"
# Shares of the pixels that may differ by more than STEPS of 255, and that must where something has changed.
SAME, CHANGED, STEPS = 0.002, 0.004, 24
# A bar of one line is lower.
BAR_PX = 40


def window_pixels():
    """Rows of the display, three bytes a pixel, and its size; None before there is a picture."""
    data = pathlib.Path(os.environ["DISPLAY_PICTURE"]).read_bytes()
    header = struct.unpack(">25I", data[:100])
    first, width, height, row = header[0] + 12 * header[19], header[4], header[5], header[12]
    lines = []
    for y in range(height):
        line = data[first + y * row : first + y * row + 4 * width]
        pixels = bytearray(3 * width)
        pixels[0::3], pixels[1::3], pixels[2::3] = line[2::4], line[1::4], line[0::4]
        lines.append(bytes(pixels))
    return lines


def png_pixels(path):
    """Rows of an RGB or RGBA file of eight bits, as silmap writes it."""
    data = pathlib.Path(path).read_bytes()
    place, body = 8, b""
    while place < len(data):
        length, kind = struct.unpack(">I4s", data[place : place + 8])
        if kind == b"IHDR":
            width, height, _, colour = struct.unpack(">IIBB", data[place + 8 : place + 18])
        if kind == b"IDAT":
            body += data[place + 8 : place + 8 + length]
        place += 12 + length
    raw, channels = zlib.decompress(body), {2: 3, 6: 4}[colour]
    rows, before, stride = [], bytes(width * channels), width * channels
    for y in range(height):
        kind, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        for x in range(stride):
            left = line[x - channels] if x >= channels else 0
            up, corner = before[x], before[x - channels] if x >= channels else 0
            if kind == 1:
                line[x] = (line[x] + left) & 255
            elif kind == 2:
                line[x] = (line[x] + up) & 255
            elif kind == 3:
                line[x] = (line[x] + (left + up) // 2) & 255
            elif kind == 4:
                guess = left + up - corner
                near = min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))
                line[x] = (line[x] + near[2]) & 255
        before = bytes(line)
        rows.append(b"".join(before[k : k + 3] for k in range(0, stride, channels)))
    return rows


def differ(one, two):
    """The share of pixels that differ."""
    assert len(one) == len(two) and len(one[0]) == len(two[0]), "pictures of one size"
    count = off = 0
    for a, b in zip(one, two):
        count += len(a) // 3
        if a != b:
            off += sum(max(abs(a[k + c] - b[k + c]) for c in range(3)) > STEPS for k in range(0, len(a), 3))
    return off / count


def cropped(rows, place):
    x, y, width, height = place
    return [row[3 * x : 3 * (x + width)] for row in rows[y : y + height]]


def xdotool(*words):
    subprocess.run(["xdotool", *map(str, words)], check=True)


def settled(place):
    """The picture once it does not change any more."""
    end = time.monotonic() + PATIENCE_S
    before = None
    while time.monotonic() < end:
        now = cropped(window_pixels(), place)
        if now == before:
            return now
        before = now
        time.sleep(0.7)
    sys.exit("the window's picture does not come to rest")


def settled_unlike(first, place):
    """The picture once it is another one and does not change any more; what has to be made first takes a while."""
    end = time.monotonic() + PATIENCE_S / 6
    while time.monotonic() < end and differ(first, cropped(window_pixels(), place)) < CHANGED / 4:
        time.sleep(0.3)
    return settled(place)


def background_of(rows):
    """Where the picture is: the rows and columns in which the colour behind the model is found."""
    behind = bytes([0xF4, 0xF5, 0xF7])
    inside = [y for y, row in enumerate(rows) if row.count(behind) > 200]
    if not inside:
        return None
    row = rows[inside[len(inside) // 8]]
    columns = [k // 3 for k in range(0, len(row), 3) if row[k : k + 3] == behind]
    return columns[0], inside[0], columns[-1] - columns[0] + 1, inside[-1] - inside[0] + 1


def main():
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    viewer, silmap, asset, model = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        drive(viewer, silmap, asset, model, pathlib.Path(folder))


def drive(viewer, silmap, asset, model, folder):
    """Drives the window, and ends the program where it does not do what it should."""
    home = {**os.environ, "XDG_DATA_HOME": str(folder)}
    command = [viewer, asset, "--model", model, f"--eye={EYE}", "--target=0,0,0", "--fov", "40"]
    with subprocess.Popen(command, env=home) as window:
        try:
            # While something is loaded the bar has a line more.
            places, end = [], time.monotonic() + PATIENCE_S
            while len(places) < 4 or len(set(places[-4:])) > 1 or places[-1] is None or places[-1][1] > BAR_PX:
                if time.monotonic() > end or window.poll() is not None:
                    sys.exit("no window with a picture appears")
                time.sleep(1)
                places.append(background_of(window_pixels()))
            place = places[-1]
            x, y, width, height = place
            # No window manager gives it the keyboard here. A click takes the hint away.
            found = subprocess.run(["xdotool", "search", "--onlyvisible", "--name", "silmap"], check=True, capture_output=True, text=True)
            xdotool("windowfocus", found.stdout.split()[-1])
            xdotool("mousemove", x + 20, y + 20, "click", 1)
            first = settled(place)
            pictures = []
            for eye in (EYE, OTHER_EYE):
                file = folder / "native.png"
                subprocess.run(
                    [silmap, "render", asset, f"--eye={eye}", "--target=0,0,0", "--fov", "40", "--size", f"{width}x{height}", "--background", "#f4f5f7", "-o", file],
                    check=True,
                    stderr=subprocess.DEVNULL,
                )
                pictures.append(differ(first, png_pixels(file)))
            print(f"{width} x {height} pixels: {pictures[0]:.3%} differ from the picture of render, from another eye's {pictures[1]:.1%}")
            if pictures[0] > SAME or pictures[1] < CHANGED:
                sys.exit("the window shows another picture than render draws")
            for key in ("o", "t", "b", "h", "i"):
                xdotool("key", key)
                changed = differ(first, settled_unlike(first, place))
                xdotool("key", "Escape" if key == "h" else key)
                back = differ(first, settled(place))
                print(f"{key}: {changed:.2%} of the pixels change, {back:.3%} after it was taken back")
                # After the thousand one is framed, which is another view of it.
                is_back = back <= SAME or key == "i"
                if changed < CHANGED / 4 or not is_back:
                    sys.exit(f"the key {key} does not do what it should")
            for what, words in [("the left button", (1,)), ("the right button", (3,))]:
                before = settled(place)
                xdotool("mousemove", x + width // 2, y + height // 2, "mousedown", *words)
                # A hand takes its time.
                xdotool("sleep", 1, "mousemove_relative", 60, 25)
                xdotool("sleep", 1, "mousemove_relative", 20, 5, "sleep", 1, "mouseup", *words)
                if differ(before, settled(place)) < CHANGED:
                    sys.exit(f"{what} does not move the camera")
        finally:
            window.terminate()
    print("mouse and keys do what they should")


main()
