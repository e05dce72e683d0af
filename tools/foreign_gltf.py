#!/usr/bin/env python3
"""glTF models as the tools write them that people use: each is read right, or refused in one sentence with the way out.

    tools/foreign_gltf.py target/release/silmap [--keep FOLDER] [--blender]

Writers: glTF-Transform, gltfpack, three.js, trimesh, Open3D and (with --blender, as it is large) Blender, all pinned, in a throw-away
folder. The models are boxes with known volume; on textured ones the four quarters of the picture are looked at from +z. Colours are
skipped with a word where no graphics adapter is, and so is a writer that cannot be installed. Controls: twice the volume, another
picture and a file that is no model must be noticed. Exit code 1 when a model is read wrong, or with a warning about it.
"""
import argparse
import json
import math
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

TOOLS = Path(__file__).resolve().parent
NPM = [
    "gltfpack@1.3.0", "@gltf-transform/core@4.5.1", "@gltf-transform/extensions@4.5.1", "@gltf-transform/functions@4.5.1",
    "@gltf-transform/cli@4.5.1", "meshoptimizer@1.3.0", "draco3dgltf@1.5.7", "three@0.187.0", "ktx2-encoder@0.6.0",
]
PYTHON = ["numpy==2.4.6", "pillow==13.0.0", "trimesh==5.2.0"]
OPEN3D = ["open3d-cpu==0.20.0"]
# Each of them wants a Python of its own.
BLENDER = [["bpy==5.2.3"], ["bpy==5.0.1"], ["bpy==4.5.15"]]

# Compressed positions are off by a part in some thousands.
EXACT, ROUGH = 1e-6, 5e-3
UPRIGHT, SWAPPED, MIRRORED, RED, GREEN = "rgby", "ybgr", "gryb", "rrrr", "gggg"

# What is written, the volume, the quarters seen from +z, and how close.
MODELS = {
    "transform-plain.glb": (1, UPRIGHT, EXACT),
    "transform-plain.gltf": (1, UPRIGHT, EXACT),
    "transform-quantize.glb": (1, UPRIGHT, ROUGH),
    "transform-quantize-scene.glb": (1, UPRIGHT, ROUGH),
    "transform-meshopt-medium.glb": (1, UPRIGHT, ROUGH),
    "transform-meshopt-high.glb": (1, UPRIGHT, ROUGH),
    "transform-draco-edgebreaker.glb": (1, UPRIGHT, ROUGH),
    "transform-draco-sequential.glb": (1, UPRIGHT, ROUGH),
    "transform-unweld.glb": (1, UPRIGHT, EXACT),
    "transform-offset.glb": (1, SWAPPED, EXACT),
    "transform-offset-meshopt.glb": (1, SWAPPED, ROUGH),
    "transform-mirrored.glb": (1, MIRRORED, EXACT),
    "transform-nodes.glb": (7, UPRIGHT, EXACT),
    "transform-instance.glb": (7, UPRIGHT, EXACT),
    "transform-instance-meshopt.glb": (7, UPRIGHT, ROUGH),
    "transform-morph.glb": (2, None, EXACT),
    "transform-morph-sparse.glb": (2, None, EXACT),
    "three-box.glb": (1, RED, EXACT),
    "three-box.gltf": (1, RED, EXACT),
    "three-mirrored.glb": (12, None, EXACT),
    "three-vertex-colours.glb": (1, GREEN, EXACT),
    "three-instanced.glb": (6, RED, EXACT),
    "three-skinned.glb": (3, None, EXACT),
}

# Degrees. The eye is far off, so that it is outside of the bounding sphere of scenes too.
FIELD = str(2 * math.degrees(math.atan(0.94 / 39.5)))

failed = []


def report(is_right, what, more=""):
    print(f"{'ok   ' if is_right else 'WRONG'} {what}{': ' if more else ''}{more}", flush=True)
    if not is_right:
        failed.append(what)


def skip(why):
    print(f"skipped: {why}", flush=True)


def run(command, **options):
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, **options)


def picture(path):
    """The four quarters as a picture, red and green above blue and yellow."""
    from PIL import Image

    colours = {(0, 0): (255, 0, 0), (1, 0): (0, 255, 0), (0, 1): (0, 0, 255), (1, 1): (255, 255, 0)}
    image = Image.new("RGB", (64, 64))
    for (i, j), colour in colours.items():
        image.paste(colour, (32 * i, 32 * j, 32 * i + 32, 32 * j + 32))
    image.save(path)


def volume_of(silmap, model, folder):
    """The volume, or the sentence that refuses the model; and the warnings about it, not those about the hull that is written."""
    done = run([silmap, "hull", model, "--faces", "1000000", "--json", "-o", folder / "hull.obj"])
    warnings = [line for line in done.stderr.splitlines() if f"warning: {model}:" in line]
    if done.returncode != 0:
        return done.stderr.strip().splitlines()[-1] if done.stderr.strip() else f"exit code {done.returncode}", warnings
    return json.loads(done.stdout)["original_volume"], warnings


def quarters_of(silmap, model, folder):
    """The colours that are seen from +z, or None where nothing can be drawn."""
    from PIL import Image

    path = folder / "seen.png"
    done = run([silmap, "render", "--mode", "original", "--model", model, "--eye=0,0,40", "--target=0,0,0", "--fov", FIELD,
                "--size", "256x256", "-o", path])
    if done.returncode == 3:
        return None
    if done.returncode != 0:
        return done.stderr.strip()
    image = Image.open(path).convert("RGB")
    # Half of the picture is 0.94 high where the side is.
    at = [(x, y) for y in (101, 155) for x in (101, 155)]
    names = {(1, 0, 0): "r", (0, 1, 0): "g", (0, 0, 1): "b", (1, 1, 0): "y", (1, 1, 1): "w"}
    seen = ""
    for place in at:
        pixel = image.getpixel(place)
        seen += names.get(tuple(int(2 * c > max(pixel)) for c in pixel), "?")
    return seen


def faults(silmap, model, wanted, folder):
    """What is wrong with a model as it is read: of its volume, of its colours; each None where nothing is."""
    volume, quarters, tolerance = wanted
    found, warnings = volume_of(silmap, model, folder)
    if isinstance(found, str):
        return found, None
    of_volume = None
    if abs(found - volume) > tolerance * volume or warnings:
        of_volume = "".join([f"volume {found:.6g} for {volume}", *(f"; {w}" for w in warnings)])
    of_colours = None
    if quarters is not None:
        seen = quarters_of(silmap, model, folder)
        if seen is None:
            if "adapter" not in said:
                said.add("adapter")
                skip("colours: there is no graphics adapter")
        else:
            looked_at.append(model.name)
            of_colours = None if seen == quarters else f"{seen} for {quarters}"
    return of_volume, of_colours


def check(silmap, model, wanted, folder):
    found = [fault for fault in faults(silmap, model, wanted, folder) if fault is not None]
    checked.append(model.name)
    report(not found, model.name, "; ".join(found))


checked, looked_at = [], []
said = set()


def javascript(folder, out):
    """Models by glTF-Transform, three.js and gltfpack."""
    if shutil.which("npm") is None or shutil.which("node") is None:
        skip("glTF-Transform, three.js and gltfpack: npm is not here")
        return False
    (folder / "package.json").write_text('{"private": true, "type": "module"}')
    done = run(["npm", "install", "--no-audit", "--no-fund", "--silent", *NPM], cwd=folder)
    if done.returncode != 0:
        skip(f"glTF-Transform, three.js and gltfpack cannot be installed: {done.stderr.strip()[-200:]}")
        return False
    shutil.copy(TOOLS / "foreign_gltf.mjs", folder / "write.mjs")
    done = run(["node", "write.mjs", out], cwd=folder)
    if done.returncode != 0:
        report(False, "foreign_gltf.mjs", done.stderr.strip()[-400:])
        return False
    return True


# Options of gltfpack, and how close.
GLTFPACK = {
    "plain": [],
    "c": ["-c"],
    "cc": ["-cc"],
    "floats": ["-noq"],
    "float-positions": ["-vpf", "-cc"],
    "instances": ["-mi", "-cc"],
    "kept": ["-kn", "-km", "-ke", "-c"],
    "fallback": ["-cf"],
}


def gltfpack(silmap, folder, out):
    program = folder / "node_modules/.bin/gltfpack"
    for source, wanted in [("transform-plain.glb", (1, UPRIGHT, ROUGH)), ("transform-nodes.glb", (7, UPRIGHT, ROUGH)),
                           ("transform-offset.glb", (1, SWAPPED, ROUGH)), ("transform-mirrored.glb", (1, MIRRORED, ROUGH))]:
        for name, options in GLTFPACK.items():
            for kind in ["glb", "gltf"] if name in ("plain", "cc", "fallback") else ["glb"]:
                packed = out / f"gltfpack-{name}-{Path(source).stem}.{kind}"
                done = run([program, "-i", out / source, "-o", packed, *options])
                if done.returncode != 0:
                    skip(f"{packed.name}: gltfpack says {(done.stdout + done.stderr).strip()[-200:]}")
                    continue
                check(silmap, packed, wanted, folder)


def card_textures(silmap, folder, out):
    """Textures for graphics cards are refused with the way out; and the way out works, where its other program is here."""
    for kind in ["uastc", "etc1s"]:
        model, opened = out / f"transform-ktx-{kind}.glb", out / f"opened-{kind}.glb"
        sentence, _ = volume_of(silmap, model, folder)
        is_told = isinstance(sentence, str) and "KHR_texture_basisu" in sentence and "`npx @gltf-transform/cli" in sentence
        report(is_told, model.name, str(sentence))
        if not is_told:
            continue
        if shutil.which("ktx") is None:
            skip("the way out: the program ktx of KTX-Software is not here")
            continue
        words = sentence.split("`")[1].replace("IN.glb", str(model)).replace("OUT.glb", str(opened)).split()
        done = run(["node_modules/.bin/gltf-transform", *words[2:]], cwd=folder)
        if done.returncode != 0:
            report(False, " ".join(words[:3]), (done.stdout + done.stderr).strip()[-300:])
        else:
            check(silmap, opened, (1, UPRIGHT, ROUGH), folder)


def with_trimesh(silmap, folder, out):
    import numpy
    import trimesh
    from PIL import Image

    box = trimesh.creation.box()
    box.visual.vertex_colors = numpy.tile([255, 0, 0, 255], (8, 1))
    scene = trimesh.Scene()
    scene.add_geometry(box)
    turned = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3], [0, 0, 0])
    turned[:3, 3] = [5, 0, 0]
    scene.add_geometry(box, transform=turned)
    mirrored = numpy.diag([1.0, 1.0, -2.0, 1.0])
    mirrored[:3, 3] = [-5, 0, 0]
    scene.add_geometry(box, transform=mirrored)
    box.export(out / "trimesh-box.glb")
    scene.export(out / "trimesh-scene.glb")
    files = out / "trimesh"
    files.mkdir(exist_ok=True)
    for name, data in trimesh.exchange.gltf.export_gltf(trimesh.Scene(box)).items():
        (files / name).write_bytes(data)
    painted = trimesh.load(out / "transform-plain.glb", force="mesh", process=False) if (out / "transform-plain.glb").exists() else None
    check(silmap, out / "trimesh-box.glb", (1, RED, EXACT), folder)
    check(silmap, out / "trimesh-scene.glb", (4, RED, EXACT), folder)
    check(silmap, files / "model.gltf", (1, RED, EXACT), folder)
    if painted is not None:
        painted.export(out / "trimesh-textured.glb")
        check(silmap, out / "trimesh-textured.glb", (1, UPRIGHT, EXACT), folder)


def with_open3d(silmap, folder, out):
    try:
        import open3d
    except ImportError as error:
        skip(f"Open3D does not start here: {error}")
        return

    box = open3d.geometry.TriangleMesh.create_box(2, 2, 2)
    box.translate([-1, -1, -1])
    box.paint_uniform_color([0, 1, 0])
    box.compute_vertex_normals()
    for kind in ["glb", "gltf"]:
        path = out / f"open3d-box.{kind}"
        if open3d.io.write_triangle_mesh(str(path), box):
            check(silmap, path, (8, GREEN, EXACT), folder)
        else:
            skip(f"{path.name}: Open3D does not write it")


def with_blender(silmap, folder, out):
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    red = bpy.data.materials.new("red")
    red.use_nodes = True
    red.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (1, 0, 0, 1)
    bpy.ops.mesh.primitive_cube_add(size=1)
    bpy.context.object.data.materials.append(red)
    bpy.ops.mesh.primitive_cube_add(size=1, location=(4, 0, 0), rotation=(0.3, 0.4, 0.5))
    bpy.context.object.scale = (1, -2, 3)
    for name, more in {
        "blender-box.glb": {"export_format": "GLB"},
        "blender-box.gltf": {"export_format": "GLTF_SEPARATE"},
        "blender-draco.glb": {"export_format": "GLB", "export_draco_mesh_compression_enable": True},
        "blender-instances.glb": {"export_format": "GLB", "export_gpu_instances": True},
    }.items():
        try:
            bpy.ops.export_scene.gltf(filepath=str(out / name), **more)
        except Exception as error:
            skip(f"{name}: Blender says {str(error).strip()[-200:]}")
            continue
        check(silmap, out / name, (7, RED, ROUGH if "draco" in name else EXACT), folder)


def inside(silmap, folder, has_open3d, has_blender):
    out = folder / "models"
    out.mkdir(exist_ok=True)
    picture(folder / "quarters.png")
    if javascript(folder, out):
        for name, wanted in MODELS.items():
            check(silmap, out / name, wanted, folder)
        gltfpack(silmap, folder, out)
        card_textures(silmap, folder, out)
        controls(silmap, folder, out)
    with_trimesh(silmap, folder, out)
    if has_open3d:
        with_open3d(silmap, folder, out)
    if has_blender:
        with_blender(silmap, folder, out)


def controls(silmap, folder, out):
    """What is wrong must be noticed."""
    of_volume, _ = faults(silmap, out / "transform-morph.glb", (1, None, ROUGH), folder)
    report(of_volume is not None, "control: twice the volume is noticed", of_volume or "")
    of_volume, _ = faults(silmap, folder / "quarters.png", (1, None, ROUGH), folder)
    report(of_volume is not None, "control: what is no model is noticed", of_volume or "")
    if "adapter" in said:
        return
    for model in ("transform-offset.glb", "transform-mirrored.glb"):
        _, of_colours = faults(silmap, out / model, (1, UPRIGHT, ROUGH), folder)
        report(of_colours is not None, f"control: another picture is noticed, {model}", of_colours or "")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("silmap", type=Path)
    parser.add_argument("--keep", type=Path, help="work in this folder, and leave it")
    parser.add_argument("--blender", action="store_true", help="Blender too")
    parser.add_argument("--inside", choices=["", "o", "b", "ob"], help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    silmap = arguments.silmap.resolve()
    if arguments.inside is not None:
        inside(silmap, arguments.keep.resolve(), "o" in arguments.inside, "b" in arguments.inside)
        print(f"{len(checked)} models read, colours of {len(set(looked_at))} looked at; {len(failed)} wrong")
        return 1 if failed or not checked else 0
    if arguments.keep:
        arguments.keep.mkdir(parents=True, exist_ok=True)
        return enter(silmap, arguments.keep.resolve(), arguments.blender)
    with tempfile.TemporaryDirectory() as folder:
        return enter(silmap, Path(folder), arguments.blender)


def enter(silmap, folder, with_blender):
    """Runs this program again in an environment that has the packages."""
    environment = folder / "environment"
    if run([sys.executable, "-m", "venv", environment]).returncode != 0:
        skip("python3 makes no environment here (the package python3-venv)")
        return 0

    def install(packages):
        pip = [environment / "bin/pip", "install", "--quiet", "--disable-pip-version-check", *packages]
        if run(pip).returncode == 0:
            return True
        skip(f"pip cannot install {', '.join(packages)} here")
        return False

    if not install(PYTHON):
        return 0
    has = "o" if install(OPEN3D) else ""
    if with_blender:
        has += next(("b" for packages in BLENDER if install(packages)), "")
    again = [environment / "bin/python", Path(__file__), silmap, "--keep", folder, f"--inside={has}"]
    return subprocess.run([str(a) for a in again]).returncode


if __name__ == "__main__":
    sys.exit(main())
