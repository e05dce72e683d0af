#!/usr/bin/env python3
"""What the project promises about the Stanford bunny and the torus, measured with the release binary.

    tools/promises.py target/release/silmap

Prints every figure beside its limit; exit code 1 when one is over it. Models are read from ../shared/models and skipped, with a
word, where that folder is missing. Where ../shared/check is there, its programs measure once more with other people's libraries.
"""
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SHARED = ROOT.parent / "shared"
BUNNY = SHARED / "models" / "stanford-bunny.ply"
CLOSED_BUNNY = SHARED / "models" / "stanford-bunny-closed.off"
KIB, MIB = 1024, 1024 * 1024

failed = []


def hold(what, value, limit, unit=""):
    """Prints a figure beside its limit and remembers when it is over."""
    is_held = value <= limit
    print(f"{'ok  ' if is_held else 'OVER'} {what}: {value:.4g}{unit} (at most {limit:g}{unit})", flush=True)
    if not is_held:
        failed.append(what)


def call(*arguments):
    """The JSON object that a command prints."""
    done = subprocess.run([str(a) for a in arguments], stdout=subprocess.PIPE, check=True)
    return json.loads(done.stdout)


def measured(*arguments):
    """The JSON object, seconds, and peak memory in bytes of a command."""
    since = time.monotonic()
    child = subprocess.Popen([str(a) for a in arguments], stdout=subprocess.PIPE)
    text = child.stdout.read()
    _, status, usage = os.wait4(child.pid, 0)
    if status != 0:
        sys.exit(f"failed: {' '.join(map(str, arguments))}")
    return json.loads(text), time.monotonic() - since, usage.ru_maxrss * KIB


def percent_of(evaluation, method, field):
    return 100 * evaluation["methods"][method][field]


def check_bunny(silmap, folder):
    asset = folder / "bunny.glb"
    built, seconds, memory = measured(silmap, "build", BUNNY, "--close-holes", "-o", asset, "--json")
    print(json.dumps(built))
    hold("bunny: build", seconds, 150, " s")
    hold("bunny: peak memory", memory / MIB, 1536, " MiB")
    inspected = call(silmap, "inspect", asset, "--json")
    hold("bunny: silhouette data", inspected["map"]["bytes"] / KIB, 200, " KiB")
    hold("bunny: whole asset", asset.stat().st_size / MIB, 2.5, " MiB")
    hold("bunny: hull faces", inspected["hull"]["faces"], 500)
    evaluation = call(silmap, "evaluate", asset, "--model", BUNNY, "--close-holes", "--viewpoints", 200, "--textures", 8, "--json")
    check_textures(built, evaluation["textures"])
    check_by_hull(silmap, "bunny", [BUNNY, "--close-holes"], 3.0, evaluation, folder)
    hold("bunny: paper misclassified", percent_of(evaluation, "paper", "misclassified_mean"), 4.0, " %")
    tight = percent_of(evaluation, "tight", "misclassified_mean")
    hold("bunny: tight misclassified", tight, 0.9, " %")
    hold("bunny: tight over paper", tight / percent_of(evaluation, "paper", "misclassified_mean"), 0.333)
    shell = call(silmap, "evaluate", asset, "--model", BUNNY, "--close-holes", "--where", "shell", "--method", "tight", "--json")
    hold("bunny: tight off the polytope over tight on it", percent_of(shell, "tight", "misclassified_mean") / tight, 1.5)
    check_fewer_views(silmap, "bunny", asset, [BUNNY, "--close-holes"], 2.2, folder)
    eye = "--eye=" + ",".join(map(str, evaluation["per_viewpoint"][0]["eye"]))
    for method in ("hull", "paper", "tight"):
        times = sorted(call(silmap, "contour", asset, eye, "--method", method, "--json")["seconds"] for _ in range(21))
        hold(f"bunny: contour by {method}, median", 1e3 * times[10], 1.0, " ms")
    return asset


def check_by_hull(silmap, name, model, most, by_default, folder):
    """The error of `hull` with views chosen by it, as who draws by `hull` chooses them; that of the default build is shown beside."""
    asset = folder / f"{name}-hull.glb"
    call(silmap, "build", *model, "--choose-by", "hull", "-o", asset, "--json")
    model = ["--model", *model]
    evaluation = call(silmap, "evaluate", asset, *model, "--viewpoints", 200, "--method", "hull", "--json")
    hold(f"{name}: hull misclassified, views chosen by hull", percent_of(evaluation, "hull", "misclassified_mean"), most, " %")
    print(f"     {name}: hull misclassified, views chosen by default: {percent_of(by_default, 'hull', 'misclassified_mean'):.4g} %", flush=True)


def check_fewer_views(silmap, name, asset, model, limit, folder):
    fewer = folder / "fewer.glb"
    call(silmap, "build", "--from", asset, "--keep", 64, "-o", fewer, "--json")
    evaluation = call(silmap, "evaluate", fewer, "--model", *model, "--viewpoints", 200, "--method", "tight", "--json")
    hold(f"{name}: tight misclassified with 64 views", percent_of(evaluation, "tight", "misclassified_mean"), limit, " %")


def check_textures(built, textures):
    hold("bunny: baking textures", built["seconds"]["textures"], 5, " s")
    hold("bunny: hull area that falls to the atlas", 100 * built["textures"]["atlas_share"], 5, " %")
    # In steps of 255, the largest of the channels' means, inside both outlines at eyes on the view sphere.
    limits = {"blended": 4, "views": 4, "nearest": 5, "tiles": 5}
    for paint, limit in limits.items():
        hold(f"bunny: colours, {paint}", textures["colour_difference"][paint]["largest_channel"], limit)
    jumps = textures["discontinuities_per_1000"]
    print(f"     of 1,000 texels beside a jump: {jumps}")
    hold("bunny: jumps by normal-shooting over those by closest-point", jumps["normal-shooting"] / jumps["closest-point"], 0.5)


def check_conservative_bunny(silmap, folder):
    asset = folder / "bunny-any.glb"
    call(silmap, "build", BUNNY, "--close-holes", "--coverage", "any", "-o", asset, "--json")
    evaluation = call(silmap, "evaluate", asset, "--model", BUNNY, "--close-holes", "--viewpoints", 200, "--method", "hull", "--json")
    hold("bunny, coverage any: hull escaped", percent_of(evaluation, "hull", "escaped_mean"), 0.02, " %")


def check_hulls(silmap, folder):
    """Hulls of the closed bunny: volumes, and enclosure wherever the model is and however large."""
    hull = folder / "hull.obj"

    def made(model, *options):
        return call(silmap, "hull", model, "--verify", "-o", hull, "--json", *options)

    for faces, tighten, limit in [(500, "off", 1.11), (500, "fast", 1.077), (500, "best", 1.065), (100, "off", 1.5)]:
        of_bunny = made(CLOSED_BUNNY, "--faces", faces, "--tighten", tighten)
        hold(f"closed bunny, {faces} faces, tighten {tighten}: volume ratio", of_bunny["volume_ratio"], limit)
        hold(f"closed bunny, {faces} faces, tighten {tighten}: not enclosed", float(not of_bunny["verified"]), 0)
    hold("closed bunny: fewest faces", made(CLOSED_BUNNY, "--faces", 4)["faces"], 60)
    lines = CLOSED_BUNNY.read_text().splitlines()
    count = int(lines[1].split()[0])
    points = [[float(c) for c in line.split()] for line in lines[2 : 2 + count]]
    extent = [max(p[k] for p in points) - min(p[k] for p in points) for k in range(3)]
    far = 1e3 * sum(c * c for c in extent) ** 0.5
    reference = made(CLOSED_BUNNY, "--faces", 500)["volume_ratio"]
    for name, change in {
        "a millionth as large": lambda c: c * 1e-6,
        "a million times as large": lambda c: c * 1e6,
        "a thousand diagonals away": lambda c: c + far,
    }.items():
        changed = [" ".join(repr(change(c)) for c in p) for p in points]
        model = folder / "changed.off"
        model.write_text("\n".join([*lines[:2], *changed, *lines[2 + count :], ""]))
        of_changed = made(model, "--faces", 500)
        off = 100 * abs(of_changed["volume_ratio"] / reference - 1)
        hold(f"closed bunny {name}: volume ratio differs by", off, 0.5, " %")
        hold(f"closed bunny {name}: not enclosed", float(not of_changed["verified"]), 0)


def check_torus(silmap, folder):
    model, asset = folder / "torus.ply", folder / "torus.glb"
    call(silmap, "generate", "torus", "--faces", 65536, "-o", model, "--json")
    call(silmap, "build", model, "-o", asset, "--json")
    evaluation = call(silmap, "evaluate", asset, "--model", model, "--viewpoints", 200, "--json")
    check_by_hull(silmap, "torus", [model], 1.8, evaluation, folder)
    hold("torus: tight misclassified", percent_of(evaluation, "tight", "misclassified_mean"), 0.45, " %")
    check_fewer_views(silmap, "torus", asset, [model], 1.2, folder)


def check_exact_pictures(silmap, asset, python):
    """The exactly clipped hull against the mesh, and the unclipped hull, which must be far over the limit."""
    measure = [python, ROOT / "tools/exact_pictures.py", silmap, asset, BUNNY, "--close-holes"]
    hold("bunny: exactly clipped, misclassified", 100 * call(*measure)["misclassified"], 0.02, " %")
    unclipped = call(*measure, "--mode", "textured", "--eyes", 2)["misclassified"]
    hold("bunny: limit over the unclipped hull's misclassified", 0.0002 / unclipped, 0.1)


def python_with_libraries(folder):
    """A throw-away environment with other people's libraries."""
    environment = folder / "environment"
    subprocess.run([sys.executable, "-m", "venv", environment], check=True)
    packages = ["numpy", "trimesh", "embreex", "scipy", "shapely", "pillow", "rtree"]
    subprocess.run([environment / "bin/pip", "install", "--quiet", *packages], check=True)
    return environment / "bin/python"


def check_from_outside(silmap, asset, folder, python):
    """The programs of ../shared/check."""
    closed, hull = folder / "closed.ply", folder / "hull.obj"
    # The programs want the closed mesh: an inner or outer hull with every face kept is that.
    call(silmap, "hull", BUNNY, "--close-holes", "--faces", 1_000_000, "-o", closed, "--json")
    call(silmap, "hull", BUNNY, "--close-holes", "--faces", 500, "--verify", "-o", hull, "--json")
    for method in ("hull", "paper", "tight"):
        subprocess.run([python, SHARED / "check/outline.py", silmap, asset, closed, "--method", method], check=True)
    subprocess.run([python, SHARED / "check/hull.py", hull, closed], check=True)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    silmap = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        check_torus(silmap, folder)
        if BUNNY.exists():
            asset = check_bunny(silmap, folder)
            check_conservative_bunny(silmap, folder)
            python = python_with_libraries(folder)
            check_exact_pictures(silmap, asset, python)
            if (SHARED / "check").is_dir():
                check_from_outside(silmap, asset, folder, python)
            else:
                print(f"skipped: {SHARED / 'check'} is not here")
        else:
            print(f"skipped: {BUNNY} is not here")
        if CLOSED_BUNNY.exists():
            check_hulls(silmap, folder)
        else:
            print(f"skipped: {CLOSED_BUNNY} is not here")
    if failed:
        sys.exit("over the limit: " + ", ".join(failed))


if __name__ == "__main__":
    main()
