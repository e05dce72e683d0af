#!/usr/bin/env python3
"""`silmap align` on photographs: poses of views whose masks the model was not made from.

    tools/align_capture.py target/release/silmap [CAPTURE] [--out FOLDER]

CAPTURE is a folder with calibrated cameras and masks (cameras.json); without one ../shared/captures/squirrel is taken, and skipped with
a word where that is missing. A model is carved from the masks of most views. For each of the others the calibrated camera is turned
by 5 degrees and moved by 5 % of the model's radius, and aligned with that view's mask, which no part of the model comes from. Prints
how far the aligned camera is from the calibrated one before and after; exit code 1 when it did not come closer everywhere. With
--out the masks' rims are drawn over pictures of the model.
"""
import argparse
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

# Nothing is left in the tree.
sys.dont_write_bytecode = True
from exact_peers import ROOT, call, enter_environment, option, skip

CAPTURE = ROOT.parent / "shared" / "captures" / "squirrel"
PACKAGES = ["numpy==2.2.6", "vtk==9.7.2", "pillow==13.0.0"]
# Voxels along the longest side, every how manieth view is held out, faces of the model, and masks' size.
VOXELS = 256
HELD_OUT = 6
FACES = 20_000
SCALE = 0.5


def load_mask(capture, view):
    import numpy
    from PIL import Image

    return numpy.asarray(Image.open(capture / view["mask"])) > 127


def carve(capture, cameras, views):
    """The voxels inside all masks, as a closed triangle mesh."""
    import numpy
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

    low, high = map(numpy.array, cameras["object_bounds"])
    side = (high - low).max() / VOXELS
    counts = numpy.ceil((high - low) / side).astype(int) + 6
    origin = low - 3 * side
    axes = [origin[k] + side * numpy.arange(counts[k]) for k in range(3)]
    points = numpy.stack([*(a.ravel() for a in numpy.meshgrid(*axes, indexing="ij")), numpy.ones(counts.prod())], 1)
    left = numpy.arange(len(points))
    for view in views:
        mask = load_mask(capture, view)
        image = points[left] @ numpy.array(view["P"]).T
        column, row = (numpy.floor(image[:, k] / image[:, 2] + 0.5 - cameras["pixel_centre"]).astype(int) for k in (0, 1))
        is_seen = (column >= 0) & (column < mask.shape[1]) & (row >= 0) & (row < mask.shape[0])
        is_inside = numpy.ones(len(left), bool)
        is_inside[is_seen] = mask[row[is_seen], column[is_seen]]
        left = left[is_inside]
    solid = numpy.zeros(len(points), numpy.float32)
    solid[left] = 1
    grid = vtk.vtkImageData()
    grid.SetDimensions(*map(int, counts))
    grid.SetOrigin(*origin)
    grid.SetSpacing(side, side, side)
    grid.GetPointData().SetScalars(numpy_to_vtk(solid.reshape(counts).ravel(order="F"), deep=True))
    smooth, surface = vtk.vtkImageGaussianSmooth(), vtk.vtkFlyingEdges3D()
    smooth.SetInputData(grid)
    smooth.SetStandardDeviations(1, 1, 1)
    surface.SetInputConnection(smooth.GetOutputPort())
    surface.SetValue(0, 0.5)
    largest, clean = vtk.vtkPolyDataConnectivityFilter(), vtk.vtkCleanPolyData()
    largest.SetInputConnection(surface.GetOutputPort())
    largest.SetExtractionModeToLargestRegion()
    clean.SetInputConnection(largest.GetOutputPort())
    clean.Update()
    mesh = clean.GetOutput()
    positions = vtk_to_numpy(mesh.GetPoints().GetData()).astype(float)
    return positions, vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)


def write_off(path, positions, faces):
    lines = ["OFF", f"{len(positions)} {len(faces)} 0"]
    lines += ["%.9g %.9g %.9g" % tuple(p) for p in positions]
    lines += ["3 %d %d %d" % tuple(f) for f in faces]
    path.write_text("\n".join(lines) + "\n")


def centred_mask(capture, cameras, view):
    """The mask with the camera's axis in its middle, smaller by SCALE, and the vertical field of view in degrees."""
    from PIL import Image

    intrinsic = view["K"]
    middle = [intrinsic[k][2] + 0.5 - cameras["pixel_centre"] for k in (0, 1)]
    mask = Image.open(capture / view["mask"])
    half = [math.ceil(max(m, n - m)) for m, n in zip(middle, mask.size)]
    large = Image.new("L", (2 * half[0], 2 * half[1]), 0)
    large.paste(mask, tuple(round(h - m) for h, m in zip(half, middle)))
    size = tuple(2 * round(SCALE * h) for h in half)
    return large.resize(size, Image.Resampling.BOX), 2 * math.degrees(math.atan(half[1] / intrinsic[1][1]))


def off_by(camera, truth, center, radius):
    """Degrees, and shifts across and along the view in percent of the radius, between two cameras (eye, forward, up)."""
    import numpy

    frames = [numpy.array([numpy.cross(f, u), u, f]) for _, f, u in (camera, truth)]
    cosine = (numpy.trace(frames[0] @ frames[1].T) - 1) / 2
    seen = [frame @ (center - c[0]) for frame, c in zip(frames, (camera, truth))]
    shift = 100 * (seen[0] - seen[1]) / radius
    return math.degrees(math.acos(min(1, cosine))), math.hypot(*shift[:2]), abs(shift[2])


def rotation(axis, angle):
    import numpy

    x, y, z = axis / numpy.linalg.norm(axis)
    cross = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return numpy.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def draw(silmap, model, camera, mask, out):
    """A picture of the model with the mask's rim in red."""
    import numpy
    from PIL import Image

    size = f"{mask.size[0]}x{mask.size[1]}"
    look = [option(name, camera[name]) for name in ("eye", "target", "up")]
    command = [silmap, "render", "--model", model, "--mode", "original", *look, "--fov", camera["fov_y_degrees"], "--size", size, "-o", out]
    subprocess.run([str(c) for c in command], check=True, stderr=subprocess.DEVNULL)
    picture, inside = numpy.array(Image.open(out).convert("RGB")), numpy.asarray(mask) > 127
    within = inside.copy()
    for axis in (0, 1):
        for step in (-1, 1):
            within &= numpy.roll(inside, step, axis)
    picture[inside & ~within] = [255, 0, 0]
    Image.fromarray(picture).save(out)


def main():
    if "--inside" not in sys.argv[1:]:
        if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
            sys.exit(__doc__)
        sys.exit(enter_environment(__file__, PACKAGES, sys.argv[1:]))
    import numpy

    parser = argparse.ArgumentParser()
    parser.add_argument("silmap", type=Path)
    parser.add_argument("capture", type=Path, nargs="?", default=CAPTURE)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--inside", action="store_true")
    o = parser.parse_args()
    if o.capture == CAPTURE and not CAPTURE.is_dir():
        skip(f"{CAPTURE} is not here")
    silmap = o.silmap.resolve()
    cameras = json.loads((o.capture / "cameras.json").read_text())
    if not cameras["metric"]:
        sys.exit(f"{o.capture}: its cameras are not metric: there are no angles to compare")
    views = [v for v in cameras["views"] if v["mask"]]
    held_out = views[::HELD_OUT]
    rng = numpy.random.default_rng(3)
    is_closer = True
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        positions, faces = carve(o.capture, cameras, [v for k, v in enumerate(views) if k % HELD_OUT])
        carved, model = folder / "carved.off", folder / "model.ply"
        write_off(carved, positions, faces)
        center = (positions.max(0) + positions.min(0)) / 2
        radius = numpy.linalg.norm(positions - center, axis=1).max()
        far = center + radius * numpy.array([0, 0, 9])
        call(silmap, "simplify", carved, "--repair", "--faces", FACES, option("eye", far), "-o", model, "--json")
        print(f"{'view':>12} {'start: degrees, across, along':>30} {'aligned: degrees, across, along':>32} {'apart, px':>10} {'s':>6}")
        for view in held_out:
            mask, fov = centred_mask(o.capture, cameras, view)
            mask.save(folder / "mask.png")
            turned = numpy.array(view["R"])
            eye, forward, up = -turned.T @ numpy.array(view["t"]), turned[2], -turned[1]
            wrong = rotation(rng.normal(size=3), math.radians(5))
            shift = rng.normal(size=3)
            shift *= 0.05 * radius / numpy.linalg.norm(shift)
            start = (wrong @ (eye - center - shift) + center, wrong @ forward, wrong @ up)
            pose = {"eye": start[0].tolist(), "target": (start[0] + radius * start[1]).tolist(), "up": start[2].tolist(), "fov_y_degrees": fov}
            (folder / "start.json").write_text(json.dumps(pose))
            found = call(silmap, "align", model, "--mask", folder / "mask.png", "--start", folder / "start.json", "--json")
            camera = found["camera"]
            along = numpy.array(camera["target"]) - camera["eye"]
            aligned = (numpy.array(camera["eye"]), along / numpy.linalg.norm(along), numpy.array(camera["up"]))
            before = off_by(start, (eye, forward, up), center, radius)
            after = off_by(aligned, (eye, forward, up), center, radius)
            is_closer &= after[0] < before[0] and math.hypot(*after[1:]) < math.hypot(*before[1:])
            texts = ["{:.2f}, {:.2f} %, {:.2f} %".format(*figures) for figures in (before, after)]
            print(f"{view['name']:>12} {texts[0]:>30} {texts[1]:>32} {found['distance_px']:>10.2f} {found['seconds']:>6.1f}", flush=True)
            if o.out:
                o.out.mkdir(exist_ok=True)
                draw(silmap, model, {**camera, "fov_y_degrees": fov}, mask, o.out / f"{view['name']}.png")
    if not is_closer:
        sys.exit("a pose did not come closer to the calibrated one")


if __name__ == "__main__":
    main()
