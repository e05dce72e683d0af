#!/usr/bin/env python3
"""How time and memory grow on meshes of awkward shape: bicones, combs and long slivers beside a torus.

    tools/growth.py [--silmap PATH] [--out FILE.json] [--small] [--only KIND,...] [--stages build,cones]

Builds assets of, and cone forests for, models of 1,000 to 100,000 faces, one process at a time on one thread, and takes the
processor's seconds and the peak memory of each. Printed and written as JSON: the exponent of growth of both over the models of
at least 4,000 faces (a straight line through their logarithms), and the ratios to a torus of as many faces. It is a benchmark:
it judges nothing, and ends with 1 only when a run fails. Models whose lids have more corners than a polygon may have are left out.
Where a time is below a tenth of a second it says nothing, and no memory below some 17 MiB is seen, which Python itself takes before
the program starts.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

SIZES = [1_000, 4_000, 10_000, 40_000, 100_000]
SMALL_SIZES = [1_000, 2_000, 4_000, 8_000]
BUILD = ["--views", "64", "--keep", "16", "--resolution", "128", "--texture-views", "6",
         "--texture-size", "256", "--atlas-size", "512", "--backend", "cpu"]
LEAST_SECONDS = 0.1
# Faces of more corners are refused by the reader.
MOST_CORNERS = 10_000


def extruded(outline, depth):
    """A polygon, counter-clockwise, between two planes: its lids as polygons, its sides as quadrilaterals."""
    n = len(outline)
    points = [(x, y, z) for z in (-depth, depth) for x, y in outline]
    faces = [[n + i for i in range(n)], list(reversed(range(n)))]
    faces += [[i, (i + 1) % n, n + (i + 1) % n, n + i] for i in range(n)]
    return points, faces


def circle(n):
    return [(math.cos(2 * math.pi * i / n), math.sin(2 * math.pi * i / n)) for i in range(n)]


def bicone(faces):
    n = faces // 2
    rim = [(x, y, 0.0) for x, y in circle(n)]
    sides = [(2 + i, 2 + (i + 1) % n) for i in range(n)]
    return [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)] + rim, [f for a, b in sides for f in ([0, a, b], [1, b, a])]


def comb(faces):
    """Many thin prongs on a spine."""
    prongs = max(faces // 16, 2)
    step = 2.0 / prongs
    outline = [(-1.0, -0.2), (1.0, -0.2)]
    for k in reversed(range(prongs)):
        x = -1.0 + k * step
        outline += [(x + 0.7 * step, 0.0), (x + 0.5 * step, 1.0), (x + 0.2 * step, 1.0), (x, 0.0)]
    return extruded(outline, 0.1)


def slivers(faces):
    """A cylinder across the axes: its sides are needles, its lids polygons of a quarter as many corners as faces."""
    points, polygons = extruded(circle(faces // 4), 1.5)
    turned = []
    for x, y, z in points:
        y, z = 0.8 * y - 0.6 * z, 0.6 * y + 0.8 * z
        turned.append((0.6 * x - 0.8 * y, 0.8 * x + 0.6 * y, z))
    return turned, polygons


def drum(faces):
    """A cylinder whose flat lids are fans about their middles."""
    n = faces // 4
    points = [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)] + [(x, y, z) for x, y in circle(n) for z in (1.0, -1.0)]
    polygons = []
    for i in range(n):
        a, b = 2 + 2 * i, 2 + 2 * ((i + 1) % n)
        polygons += [[0, a, b], [1, b + 1, a + 1], [a, a + 1, b + 1], [a, b + 1, b]]
    return points, polygons


def torus(faces):
    sides = max(round(math.sqrt(faces / 2 * 0.4)), 3)
    rings = max(round(faces / 2 / sides), 3)
    points = []
    for u in circle(rings):
        for v in circle(sides):
            r = 1.0 + 0.4 * v[0]
            points.append((r * u[0], r * u[1], 0.4 * v[1]))
    at = lambda i, j: i % rings * sides + j % sides
    quads = [(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)) for i in range(rings) for j in range(sides)]
    return points, [f for a, b, c, d in quads for f in ([a, b, c], [a, c, d])]


KINDS = {"torus": torus, "bicone": bicone, "comb": comb, "slivers": slivers, "drum": drum}


def write_obj(path, points, faces):
    with open(path, "w") as file:
        for p in points:
            file.write("v %.17g %.17g %.17g\n" % tuple(p))
        for face in faces:
            file.write("f " + " ".join(str(v + 1) for v in face) + "\n")


def run(command):
    """Processor seconds, and peak memory in MiB."""
    with tempfile.TemporaryFile() as messages:
        child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=messages)
        _, status, usage = os.wait4(child.pid, 0)
        if status != 0:
            messages.seek(0)
            sys.exit("failed: %s\n%s" % (" ".join(command), messages.read().decode(errors="replace")))
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0


def exponent(rows, what, least):
    """Slope of the line through the logarithms of faces and of a figure, over what is not too small to say anything."""
    points = [(math.log(r["faces"]), math.log(r[what])) for r in rows if r["faces"] >= 4_000 and r[what] >= least]
    if len(points) < 2:
        return None
    x, y = (sum(p[k] for p in points) / len(points) for k in (0, 1))
    return sum((a - x) * (b - y) for a, b in points) / sum((a - x) ** 2 for a, _ in points)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--silmap", default=str(Path(__file__).parent.parent / "target/release/silmap"))
    parser.add_argument("--out", help="figures as JSON")
    parser.add_argument("--small", action="store_true", help="at most 8,000 faces")
    parser.add_argument("--only", default=",".join(KINDS), help="kinds of models beside the torus")
    parser.add_argument("--stages", default="build,cones")
    options = parser.parse_args()
    sizes = SMALL_SIZES if options.small else SIZES
    kinds = ["torus"] + [k for k in options.only.split(",") if k != "torus"]
    figures = {}
    with tempfile.TemporaryDirectory() as folder:
        for stage in options.stages.split(","):
            figures[stage] = {}
            for kind in kinds:
                rows = figures[stage][kind] = {"runs": []}
                for size in sizes:
                    model = os.path.join(folder, "%s-%d.obj" % (kind, size))
                    if not os.path.exists(model):
                        points, faces = KINDS[kind](size)
                        if max(map(len, faces)) > MOST_CORNERS:
                            print("%-6s %-8s %7d faces: left out, a lid of more than %d corners is not read" % (
                                stage, kind, size, MOST_CORNERS), flush=True)
                            continue
                        write_obj(model, points, faces)
                    if stage == "build":
                        out = ["-o", os.path.join(folder, "out.glb"), "--threads", "1", "--json"]
                        command = [options.silmap, "build", model] + BUILD + out
                    else:
                        command = [options.silmap, "edges", model, "--method", stage, "--eye", "3,2,2",
                                   "--threads", "1", "--repeat", "1", "--json"]
                    seconds, mebibytes = run(command)
                    rows["runs"].append({"faces": size, "seconds": round(seconds, 3), "mebibytes": round(mebibytes, 1)})
                    beside = next(r for r in figures[stage]["torus"]["runs"] if r["faces"] == size)
                    rows["runs"][-1]["over_torus"] = round(seconds / max(beside["seconds"], 1e-3), 2)
                    print("%-6s %-8s %7d faces %8.2f s %8.1f MiB %6.2f of the torus" % (
                        stage, kind, size, seconds, mebibytes, rows["runs"][-1]["over_torus"]), flush=True)
                rows["time_exponent"] = exponent(rows["runs"], "seconds", LEAST_SECONDS)
                rows["memory_exponent"] = exponent(rows["runs"], "mebibytes", 0.0)
                print("%-6s %-8s time n^%s memory n^%s" % (stage, kind, *(
                    "?" if e is None else "%.2f" % e for e in (rows["time_exponent"], rows["memory_exponent"]))))
    if options.out:
        Path(options.out).write_text(json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()
