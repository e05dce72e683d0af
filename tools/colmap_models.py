#!/usr/bin/env python3
"""COLMAP models of every camera model, written by pycolmap as text and as binary, and read by `silmap build --check`.

    tools/colmap_models.py target/release/silmap

A figure of three balls is photographed from all sides: pycolmap gives the ray of every pixel, and the pixel is white where it meets a
ball. Views belong to a rig of two cameras. What silmap says of each camera is compared with pycolmap's projection of points, and the
hull of the masks must overlap each of them and have the volume that it has without any lens; when the lens is left out of the file, its
volume must be another. Exit code 1 when one of it fails.
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
from exact_peers import enter_environment

PACKAGES = ["numpy==2.2.6", "pillow==13.0.0", "pycolmap==4.2.1"]
SIZE = (240, 200)
FRAMES = 12
DISTANCE = 7
# Center and radius of each ball: a figure that no mirror or turn maps to itself.
BALLS = [((0, 0, 0), 1.0), ((1.1, 0.2, 0.1), 0.55), ((0.1, -0.3, 1.2), 0.4)]
# Lenses strong enough that a hull without them is seen to be wrong.
MODELS = {
    "SIMPLE_PINHOLE": [300, 124, 97],
    "PINHOLE": [300, 290, 124, 97],
    "SIMPLE_RADIAL": [300, 124, 97, -0.7],
    "RADIAL": [300, 124, 97, -0.6, 0.3],
    "OPENCV": [300, 290, 124, 97, -0.6, 0.3, 0.02, -0.01],
    "OPENCV_FISHEYE": [300, 290, 124, 97, -0.4, 0.1, 0.02, -0.003],
    "FULL_OPENCV": [300, 290, 124, 97, -0.3, 0.1, 0.02, -0.01, 0.02, 0.2, 0.1, 0.01],
    "FOV": [300, 290, 124, 97, 1.1],
    "SIMPLE_RADIAL_FISHEYE": [300, 124, 97, -0.4],
    "RADIAL_FISHEYE": [300, 124, 97, -0.5, 0.2],
    "THIN_PRISM_FISHEYE": [300, 290, 124, 97, -0.4, 0.1, 0.02, -0.01, 0.02, -0.003, 0.01, -0.02],
    "SIMPLE_DIVISION": [300, 124, 97, -0.7],
    "DIVISION": [300, 290, 124, 97, -0.7],
    "SIMPLE_FISHEYE": [300, 124, 97],
    "FISHEYE": [300, 290, 124, 97],
    "EUCM": [300, 290, 124, 97, 0.7, 1.4],
}
REFUSED = {
    "RAD_TAN_THIN_PRISM_FISHEYE": [300, 290, 124, 97] + [0.0] * 12,
    "EQUIRECTANGULAR": [240, 200],
}
# Pixels between two projections, overlap of hull and masks, and by how much volumes may differ and must.
FARTHEST_PX = 1e-6
LEAST_OVERLAP = 0.98
SAME_VOLUME, OTHER_VOLUME = 0.005, 0.02


def rotation_towards(eye, roll):
    """Rows right, down, forward of a camera at `eye` that looks at the origin."""
    import numpy

    forward = -eye / numpy.linalg.norm(eye)
    right = numpy.cross(forward, [0.3, 0.1, 0.9])
    right /= numpy.linalg.norm(right)
    down = numpy.cross(forward, right)
    c, s = math.cos(roll), math.sin(roll)
    return numpy.array([c * right + s * down, c * down - s * right, forward])


def reconstruction(name, params):
    """A rig of two cameras of a model, in so many frames around the figure."""
    import numpy
    import pycolmap

    made = pycolmap.Reconstruction()
    width, height = SIZE
    rig = pycolmap.Rig(rig_id=1)
    cameras = []
    for number in (1, 2):
        camera = pycolmap.Camera(camera_id=number, model=name, width=width, height=height, params=params)
        made.add_camera(camera)
        cameras.append(camera)
    # The second camera stands upside down, a third of a turn further on the circle.
    turn = 2 * math.pi / 3
    about = numpy.array([[math.cos(turn), 0, -math.sin(turn)], [0, 1, 0], [math.sin(turn), 0, math.cos(turn)]])
    second = numpy.diag([-1.0, -1.0, 1.0]) @ about
    center = numpy.array([0, 0, DISTANCE])
    second_from_rig = pycolmap.Rigid3d(pycolmap.Rotation3d(second), center - second @ center)
    rig.add_ref_sensor(cameras[0].sensor_id)
    rig.add_sensor(cameras[1].sensor_id, second_from_rig)
    made.add_rig(rig)
    for k in range(FRAMES):
        z = -0.9 + 1.8 * (k + 0.5) / FRAMES
        ring = math.sqrt(1 - z * z)
        eye = DISTANCE * numpy.array([ring * math.cos(2.4 * k), ring * math.sin(2.4 * k), z])
        rotation = rotation_towards(eye, 0.4 * k)
        rig_from_world = pycolmap.Rigid3d(pycolmap.Rotation3d(rotation), -rotation @ eye)
        frame = pycolmap.Frame(frame_id=k + 1, rig_id=1)
        images = []
        for number, camera in enumerate(cameras):
            image = pycolmap.Image(
                image_id=2 * k + number + 1, camera_id=camera.camera_id, name=f"camera {number}/{k:03}.jpg", frame_id=k + 1
            )
            frame.add_data_id(image.data_id)
            images.append(image)
        frame.rig_from_world = rig_from_world
        made.add_frame(frame)
        for image in images:
            made.add_image(image)
        made.register_frame(k + 1)
    return made


def photograph(image, camera):
    """The mask of an image: white where the ray of a pixel's centre meets a ball."""
    import numpy
    from PIL import Image

    width, height = SIZE
    columns, rows = numpy.meshgrid(numpy.arange(width) + 0.5, numpy.arange(height) + 0.5)
    pixels = numpy.stack([columns.ravel(), rows.ravel()], 1)
    rays = numpy.concatenate([camera.cam_from_img(pixels), numpy.ones((len(pixels), 1))], 1)
    pose = image.cam_from_world()
    rotation, translation = pose.rotation.matrix(), numpy.asarray(pose.translation)
    is_met = numpy.zeros(len(rays), bool)
    length_squared = (rays**2).sum(1)
    for center, radius in BALLS:
        seen = rotation @ numpy.array(center, float) + translation
        along = rays @ seen
        is_met |= (seen @ seen - along**2 / length_squared < radius * radius) & (along > 0)
    return Image.fromarray((255 * is_met.reshape(height, width)).astype("uint8"))


def check(silmap, folder):
    done = subprocess.run(
        [silmap, "build", folder, "--check", "--json", "--voxels", "80", "--outvoted", "0"], capture_output=True, text=True, check=False
    )
    return json.loads(done.stdout) if done.returncode == 0 else done.stderr.strip()


def farthest_px(found, made):
    """How far silmap's cameras are from pycolmap's, in pixels of a pinhole camera of the same focal length."""
    import numpy

    points = numpy.random.default_rng(5).uniform(-1, 1, (50, 3))
    views = {mask["name"]: mask for mask in found["masks"]}
    most = 0.0
    for image in made.images.values():
        mask = views[image.name.removesuffix(".jpg")]
        matrix = numpy.array(mask["camera"])
        seen = numpy.concatenate([points, numpy.ones((50, 1))], 1) @ matrix.T
        seen = seen[:, :2] / seen[:, 2:]
        pose = image.cam_from_world()
        inside = points @ pose.rotation.matrix().T + numpy.asarray(pose.translation)
        camera = made.cameras[image.camera_id]
        focal = [camera.focal_length_x, camera.focal_length_y]
        principal = numpy.array([camera.principal_point_x, camera.principal_point_y])
        expected = inside[:, :2] / inside[:, 2:] * focal + principal
        # The image without the lens begins a whole number of pixels beside the photograph.
        off = seen - expected
        most = max(most, numpy.abs(off - numpy.round(off.mean(0))).max())
        if tuple(mask["size"]) == SIZE and camera.model_name in ("SIMPLE_PINHOLE", "PINHOLE"):
            most = max(most, numpy.abs(off).max())
    return most


def main():
    if "--inside" not in sys.argv[1:]:
        if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
            sys.exit(__doc__)
        sys.exit(enter_environment(__file__, PACKAGES, sys.argv[1:]))
    parser = argparse.ArgumentParser()
    parser.add_argument("silmap", type=Path)
    parser.add_argument("--inside", action="store_true")
    silmap = parser.parse_args().silmap.resolve()
    faults, plain = [], None
    with tempfile.TemporaryDirectory() as name:
        for model, params in MODELS.items():
            folder = Path(name) / model
            made = reconstruction(model, params)
            for image in made.images.values():
                path = folder / "masks" / f"{image.name}.png"
                path.parent.mkdir(parents=True, exist_ok=True)
                photograph(image, made.cameras[image.camera_id]).save(path)
            sparse = folder / "sparse" / "0"
            sparse.mkdir(parents=True)
            told = {}
            for kind, write in (("text", made.write_text), ("binary", made.write_binary)):
                for old in sparse.iterdir():
                    old.unlink()
                write(str(sparse))
                told[kind] = found = check(silmap, folder)
                if isinstance(found, str):
                    faults.append(f"{model}, {kind}: {found}")
                    continue
                apart, overlap = farthest_px(found, made), found["overlap"]["smallest"]
                # The first model has no lens.
                plain = plain or found["hull"]["volume"]
                share = found["hull"]["volume"] / plain
                words = f"{apart:.1e} px apart, overlap {overlap:.4f} at least, volume {share:.4f}"
                print(f"{model:>28} {kind:>6}: {words}", flush=True)
                if apart > FARTHEST_PX or overlap < LEAST_OVERLAP or abs(share - 1) > SAME_VOLUME:
                    faults.append(f"{model}, {kind}: {words}")
            results = [found if isinstance(found, str) else (found["overlap"], found["hull"]) for found in told.values()]
            if results[0] != results[1]:
                faults.append(f"{model}: text and binary differ")
            if model in ("SIMPLE_PINHOLE", "PINHOLE"):
                continue
            # Without its lens in the file.
            focal = [made.cameras[1].focal_length_x, made.cameras[1].focal_length_y]
            for old in sparse.iterdir():
                old.unlink()
            reconstruction("PINHOLE", [*focal, 124, 97]).write_binary(str(sparse))
            found = check(silmap, folder)
            share = 0.0 if isinstance(found, str) else found["hull"]["volume"] / plain
            print(f"{'':>28} without its lens: volume {share:.4f}", flush=True)
            if abs(share - 1) < OTHER_VOLUME:
                faults.append(f"{model}: the volume is {share} without its lens")
        for model, params in REFUSED.items():
            folder = Path(name) / model
            folder.mkdir()
            reconstruction(model, params).write_binary(str(folder))
            (folder / "masks").mkdir()
            found = check(silmap, folder)
            print(f"{model:>28}: {found}")
            if not isinstance(found, str) or f"model {model}" not in found or "\n" in found:
                faults.append(f"{model}: {found}")
    for fault in faults:
        print(fault, file=sys.stderr)
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
