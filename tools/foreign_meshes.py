#!/usr/bin/env python3
"""Meshes as other tools write them, through the silmap binary: is each read right?

    tools/foreign_meshes.py PATH/OF/silmap [--keep FOLDER]

In throw-away environments, pinned versions of trimesh, Open3D, PyMeshLab and Blender's bpy (PyPI) and of three.js (npm, under node)
write solids of known volume, with and without colours, as OBJ, PLY (text and binary), STL and OFF. `silmap hull --json` must find
each closed and of that volume; colours are looked at in a picture of the model. A tool that cannot be installed is skipped, and so
are colours where no graphics adapter is; the output says so. Controls: another volume, another colour and a file that was cut off
must be noticed. Exit code 1 when a mesh is read wrong, when a tool that is there fails to write, or when there was nothing to check.
"""
import argparse
import json
import math
import pathlib
import shutil
import subprocess
import sys
import tempfile
import venv

# What to import, and the packages that hold it.
PYPI = {
    "trimesh": ["trimesh==5.2.0", "numpy==2.4.6"],
    "open3d": ["open3d-cpu==0.20.0"],
    "pymeshlab": ["pymeshlab==2025.7.post1"],
    "bpy": ["bpy==5.0.1"],
}
PILLOW = "pillow==13.0.0"
THREE = "three@0.187.0"

# Every writer prints lines `NAME<tab>VOLUME<tab>COLOUR`; the colour is what is seen from +x, with a second one what is seen from -x,
# or empty where the file holds none.
TRIMESH = r"""
import math, sys, pathlib, numpy as np, trimesh
out = pathlib.Path(sys.argv[1])
def put(name, mesh, volume, colour="", **how):
    (out / name).write_bytes(d if isinstance(d := mesh.export(file_type=name.rsplit(".", 1)[1], **how), bytes) else d.encode())
    print(name, volume, colour, sep="\t")
box = trimesh.creation.box((1, 2, 3))
ball = trimesh.creation.icosphere(3)
for kind in ("obj", "ply", "stl", "off"):
    put(f"trimesh-box.{kind}", box, 6)
    put(f"trimesh-ball.{kind}", ball, ball.volume)
put("trimesh-box-text.ply", box, 6, encoding="ascii")
(out / "trimesh-box-text.stl").write_text(trimesh.exchange.stl.export_stl_ascii(box))
print("trimesh-box-text.stl", 6, "", sep="\t")
painted = box.copy()
painted.visual.face_colors = [[255, 0, 0, 255] if n[0] > 0.5 else [0, 0, 255, 255] for n in box.face_normals]
put("trimesh-faces.ply", painted, 6, "red blue")
put("trimesh-faces-text.ply", painted, 6, "red blue", encoding="ascii")
put("trimesh-faces.off", painted, 6, "")
dots = box.copy()
dots.visual.vertex_colors = np.tile([0, 255, 0, 255], (len(box.vertices), 1))
for kind in ("ply", "obj", "off"):
    put(f"trimesh-vertices.{kind}", dots, 6, "green" if kind != "off" else "")
"""

OPEN3D = r"""
import sys, pathlib, open3d as o3d, numpy as np
out = pathlib.Path(sys.argv[1])
for name, make, volume in (("box", lambda: o3d.geometry.TriangleMesh.create_box(1, 2, 3), 6),
                           ("torus", lambda: o3d.geometry.TriangleMesh.create_torus(1.0, 0.4, 40, 30), None),
                           ("cone", lambda: o3d.geometry.TriangleMesh.create_cone(1.0, 2.0, 40, 4), None),
                           ("ball", lambda: o3d.geometry.TriangleMesh.create_sphere(1.0, 24), None)):
    mesh = make()
    mesh.compute_triangle_normals()
    mesh.compute_vertex_normals()
    volume = volume or mesh.get_volume()
    for kind in ("obj", "ply", "stl", "off"):
        file = f"open3d-{name}.{kind}"
        assert o3d.io.write_triangle_mesh(str(out / file), mesh), file
        print(file, volume, "", sep="\t")
    file = f"open3d-{name}-text.ply"
    assert o3d.io.write_triangle_mesh(str(out / file), mesh, write_ascii=True)
    print(file, volume, "", sep="\t")
    mesh.vertex_colors = o3d.utility.Vector3dVector(np.tile([1.0, 0.0, 0.0], (len(mesh.vertices), 1)))
    for kind in ("obj", "ply", "off"):
        file = f"open3d-{name}-red.{kind}"
        assert o3d.io.write_triangle_mesh(str(out / file), mesh), file
        print(file, volume, "red", sep="\t")
"""

MESHLAB = r"""
import sys, pathlib, pymeshlab
out = pathlib.Path(sys.argv[1])
ms = pymeshlab.MeshSet()
for make, name in ((ms.create_cube, "cube"), (ms.create_torus, "torus"), (ms.create_cone, "cone"), (ms.create_sphere, "ball")):
    make()
    volume = ms.get_geometric_measures()["mesh_volume"]
    ms.compute_color_by_function_per_face(r="255", g="0", b="0")
    for kind, how, colour in (
        ("obj", dict(save_face_color=True), "red"),
        ("ply", dict(binary=True, save_face_color=True), "red"),
        ("text.ply", dict(binary=False, save_face_color=True), "red"),
        ("stl", dict(binary=True, save_face_color=True), "red"),
        ("magics.stl", dict(binary=True, save_face_color=True, colormode=True), "red"),
        ("text.stl", dict(binary=False), ""),
        ("off", dict(save_face_color=True), "red"),
    ):
        file = f"meshlab-{name}-{kind}" if "." in kind else f"meshlab-{name}.{kind}"
        ms.save_current_mesh(str(out / file), **how)
        print(file, volume, colour, sep="\t")
    ms.compute_color_by_function_per_vertex(x="0", y="255", z="0")
    for kind in ("off", "ply", "obj"):
        file = f"meshlab-{name}-green.{kind}"
        ms.save_current_mesh(str(out / file), save_vertex_color=True, save_face_color=False)
        print(file, volume, "green", sep="\t")
"""

BPY = r"""
import sys, pathlib, math, bpy
out = pathlib.Path(sys.argv[1])
for name, add in (("cube", lambda: bpy.ops.mesh.primitive_cube_add(size=2)),
                  ("torus", lambda: bpy.ops.mesh.primitive_torus_add()),
                  ("cone", lambda: bpy.ops.mesh.primitive_cone_add(vertices=64))):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    add()
    import bmesh
    body = bmesh.new(); body.from_mesh(bpy.context.object.data); volume = body.calc_volume(); body.free()
    for kind, save in (("obj", lambda f: bpy.ops.wm.obj_export(filepath=f)),
                       ("ply", lambda f: bpy.ops.wm.ply_export(filepath=f)),
                       ("text.ply", lambda f: bpy.ops.wm.ply_export(filepath=f, ascii_format=True)),
                       ("stl", lambda f: bpy.ops.wm.stl_export(filepath=f)),
                       ("text.stl", lambda f: bpy.ops.wm.stl_export(filepath=f, ascii_format=True))):
        file = f"bpy-{name}-{kind}" if "." in kind else f"bpy-{name}.{kind}"
        save(str(out / file))
        print(file, volume, "", sep="\t")
"""

THREE_JS = r"""
import * as THREE from 'three';
import fs from 'node:fs';
import { OBJExporter } from 'three/examples/jsm/exporters/OBJExporter.js';
import { PLYExporter } from 'three/examples/jsm/exporters/PLYExporter.js';
import { STLExporter } from 'three/examples/jsm/exporters/STLExporter.js';
const out = process.argv[2];
globalThis.requestAnimationFrame ??= f => setTimeout(f, 0);
const volume = g => {
  const p = g.attributes.position, n = g.index ? g.index.count : p.count;
  const at = i => new THREE.Vector3().fromBufferAttribute(p, g.index ? g.index.getX(i) : i);
  let six = 0;
  for (let i = 0; i < n; i += 3) six += at(i).dot(at(i + 1).cross(at(i + 2)));
  return six / 6;
};
const shapes = {
  box: new THREE.BoxGeometry(1, 2, 3), sphere: new THREE.SphereGeometry(1, 32, 16), cone: new THREE.ConeGeometry(1, 2, 32),
  cylinder: new THREE.CylinderGeometry(1, 1, 2, 32), torus: new THREE.TorusGeometry(1, 0.4, 12, 48),
  knot: new THREE.TorusKnotGeometry(1, 0.3, 100, 8), capsule: new THREE.CapsuleGeometry(1, 1, 4, 8),
  icosahedron: new THREE.IcosahedronGeometry(1, 2),
  lathe: new THREE.LatheGeometry([[0, -1], [1, -0.5], [0.7, 0.5], [0, 1]].map(p => new THREE.Vector2(...p)), 24),
};
for (const [name, geometry] of Object.entries(shapes)) {
  for (const turned of [false, true]) {
    const mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial());
    if (turned) { mesh.rotation.set(0.3, 0.7, 1.1); mesh.position.set(5, -3, 2); }
    mesh.updateMatrixWorld(true);
    const stem = `three-${name}${turned ? '-turned' : ''}`;
    const put = (file, data) => {
      fs.writeFileSync(`${out}/${file}`, typeof data === 'string' ? data : Buffer.from(data.buffer ?? data, data.byteOffset ?? 0, data.byteLength));
      console.log([file, volume(geometry), ''].join('\t'));
    };
    put(`${stem}.obj`, new OBJExporter().parse(mesh));
    put(`${stem}-text.ply`, new PLYExporter().parse(mesh, () => {}, {}));
    put(`${stem}.ply`, new PLYExporter().parse(mesh, () => {}, { binary: true }));
    put(`${stem}-big.ply`, new PLYExporter().parse(mesh, () => {}, { binary: true, littleEndian: false }));
    put(`${stem}-text.stl`, new STLExporter().parse(mesh));
    put(`${stem}.stl`, new STLExporter().parse(mesh, { binary: true }));
  }
}
"""

# How far volumes may be off: single precision, and six digits of text.
VOLUME_REL = 1e-4

COLOURS = {"red": (1, 0, 0), "green": (0, 1, 0), "blue": (0, 0, 1)}


def run(command, **more):
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, **more)


def last_line(text):
    return (text.strip().splitlines() or ["no word"])[-1][:160]


def install(place, *packages):
    """The Python of a new environment with these packages, or None, and why."""
    venv.create(place, with_pip=True)
    python = place / "bin" / "python"
    installed = run([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", *packages])
    return (None, f"cannot be installed: {last_line(installed.stderr)}") if installed.returncode else (python, "")


def write_python(tool, script, work, out):
    """The lines that a tool prints, why it is skipped, and what went wrong."""
    place = work / tool
    python, why = install(place, *PYPI[tool])
    if python is None:
        return [], why, ""
    starts = run([python, "-c", f"import {tool}"])
    if starts.returncode:
        return [], f"does not start here: {last_line(starts.stderr)}", ""
    wrote = run([python, "-c", script, out])
    shutil.rmtree(place, ignore_errors=True)
    return wrote.stdout.splitlines(), "", last_line(wrote.stderr) if wrote.returncode else ""


def write_three(work, out):
    if shutil.which("npm") is None or shutil.which("node") is None:
        return [], "there is no npm", ""
    place = work / "three"
    place.mkdir(exist_ok=True)
    (place / "package.json").write_text('{"private": true, "type": "module"}')
    (place / "write.mjs").write_text(THREE_JS)
    installed = run(["npm", "install", "--silent", "--no-audit", "--no-fund", THREE], cwd=place)
    if installed.returncode:
        return [], f"cannot be installed: {last_line(installed.stderr)}", ""
    wrote = run(["node", "write.mjs", out], cwd=place)
    return wrote.stdout.splitlines(), "", last_line(wrote.stderr) if wrote.returncode else ""


class Reader:
    """The silmap binary, asked about meshes."""

    def __init__(self, silmap, work):
        self.silmap, self.work = silmap, work
        self.eyes, self.blind = install(work / "eyes", PILLOW)
        self.looked_at = 0

    def fault(self, file, volume, colours):
        """What is wrong with a mesh as it is read, or None."""
        asked = run([self.silmap, "hull", file, "--faces", "1000000", "-o", self.work / "hull.ply", "--json"])
        if asked.returncode:
            return last_line(asked.stderr)
        found = json.loads(asked.stdout)["original_volume"]
        if not math.isclose(found, abs(volume), rel_tol=VOLUME_REL):
            return f"volume {found}, not {volume}"
        for colour, eye in zip(colours, ("9,1,0.5", "-9,1,0.5")):
            pixel = self.middle(file, eye)
            if self.blind:
                return None
            if not is_hue(pixel, colour):
                return f"looks {pixel} from {eye}, not {colour}"
        return None

    def middle(self, file, eye):
        """The colour in the middle of a picture."""
        picture = self.work / "seen.png"
        if not self.blind:
            drawn = run([self.silmap, "render", "--mode", "original", "--model", file, f"--eye={eye}", "--size", "64x64", "-o", picture])
            if drawn.returncode == 3:
                self.blind = "there is no graphics adapter"
            elif drawn.returncode:
                return last_line(drawn.stderr)
        if self.blind:
            return None
        self.looked_at += 1
        look = "import sys; from PIL import Image; print(*Image.open(sys.argv[1]).convert('RGB').getpixel((32, 32)))"
        return tuple(int(c) for c in run([self.eyes, "-c", look, picture]).stdout.split())


def is_hue(pixel, colour):
    """Whether a shaded pixel has the hue of a pure colour."""
    if not isinstance(pixel, tuple):
        return False
    bright = max(pixel)
    return bright > 40 and all((p > 0.6 * bright) == (w > 0) for p, w in zip(pixel, COLOURS[colour]))


def unnoticed(reader, out, meshes):
    """Controls: what is wrong with meshes that were read right must be noticed. Returns what was not."""
    missed = []
    for name, volume, colours in meshes:
        if reader.fault(out / name, 2 * volume, []) is None:
            missed.append(f"twice the volume of {name}")
        if colours and not reader.blind and reader.fault(out / name, volume, ["green" if colours[0] == "red" else "red"]) is None:
            missed.append(f"another colour than that of {name}")
        cut = reader.work / f"cut{pathlib.Path(name).suffix}"
        cut.write_bytes((out / name).read_bytes()[: (out / name).stat().st_size * 2 // 3])
        if reader.fault(cut, volume, []) is None:
            missed.append(f"{name} cut off")
    return missed


def check(silmap, work):
    out = work / "meshes"
    out.mkdir(exist_ok=True)
    reader = Reader(silmap, work)
    wrong, right, controls, count = [], 0, [], 0
    scripts = {"trimesh": TRIMESH, "open3d": OPEN3D, "pymeshlab": MESHLAB, "bpy": BPY}
    for tool in [*scripts, "three"]:
        lines, skipped, failed = write_three(work, out) if tool == "three" else write_python(tool, scripts[tool], work, out)
        lines = [line.split("\t") for line in lines if line.count("\t") == 2]
        if skipped:
            print(f"skipped: {tool} {skipped}", flush=True)
            continue
        if failed or not lines:
            wrong.append(f"{tool}: does not write: {failed}")
        # One control for every kind of file a tool writes, of those with colours where there are any.
        kinds, of_tool = {}, 0
        for name, volume, colours in lines:
            fault = reader.fault(out / name, float(volume), colours.split())
            if fault is not None:
                wrong.append(f"{name}: {fault}")
                continue
            of_tool += 1
            kind = name.rsplit(".", 1)[1]
            if kind not in kinds or (colours and not kinds[kind][2]):
                kinds[kind] = (name, float(volume), colours.split())
        print(f"{tool}: {of_tool} meshes of {len(lines)} read right", flush=True)
        right, count = right + of_tool, count + len(lines)
        controls += kinds.values()
    missed = unnoticed(reader, out, controls)
    wrong += [f"control: {what} is not noticed" for what in missed]
    if reader.blind:
        print(f"skipped: colours: {reader.blind}")
    for line in wrong:
        print(f"wrong: {line}")
    print(f"{right} meshes of {count} read right, {reader.looked_at} pictures looked at, controls on {len(controls)} of them")
    return 1 if wrong or not count else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("silmap", type=pathlib.Path)
    parser.add_argument("--keep", type=pathlib.Path, help="work in this folder, and leave the meshes there")
    arguments = parser.parse_args()
    silmap = arguments.silmap.resolve()
    if arguments.keep:
        arguments.keep.mkdir(parents=True, exist_ok=True)
        return check(silmap, arguments.keep.resolve())
    with tempfile.TemporaryDirectory() as folder:
        return check(silmap, pathlib.Path(folder))


if __name__ == "__main__":
    sys.exit(main())
