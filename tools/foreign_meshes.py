#!/usr/bin/env python3
"""Meshes as other tools write them, through the silmap binary: is each read right?

    tools/foreign_meshes.py PATH/OF/silmap [--keep DIR]

In a throw-away environment, pinned versions of trimesh, open3d and pymeshlab (PyPI), three (npm, under node) and, where it can be
installed, bpy write solids of known volume, with and without colours, as OBJ, PLY (text and binary), STL and OFF. `silmap hull --json`
must find them closed and of that volume, or refuse them in one sentence that says what to do; colours are looked at in a picture of
a built asset. A tool that cannot be installed is skipped, and the output says so; a check that finds nothing to check fails.
"""
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import venv

PYPI = {
    "trimesh": ["trimesh==5.2.0", "numpy"],
    "open3d": ["open3d==0.20.0"],
    "pymeshlab": ["pymeshlab==2025.7.post1"],
    "bpy": ["bpy==5.0.1"],
}
THREE = "three@0.187.0"

# Every writer prints lines `NAME<tab>VOLUME<tab>OPTIONS<tab>COLOUR`; the colour is what is seen from +x, or empty.
TRIMESH = r"""
import math, sys, pathlib, numpy as np, trimesh
out = pathlib.Path(sys.argv[1])
def put(name, mesh, volume, colour="", **how):
    (out / name).write_bytes(d if isinstance(d := mesh.export(file_type=name.rsplit(".", 1)[1], **how), bytes) else d.encode())
    print(name, volume, "", colour, sep="\t")
box = trimesh.creation.box((1, 2, 3))
ball = trimesh.creation.icosphere(3)
for kind in ("obj", "ply", "stl", "off"):
    put(f"trimesh-box.{kind}", box, 6)
    put(f"trimesh-ball.{kind}", ball, ball.volume)
put("trimesh-box-text.ply", box, 6, encoding="ascii")
(out / "trimesh-box-text.stl").write_text(trimesh.exchange.stl.export_stl_ascii(box))
print("trimesh-box-text.stl", 6, "", "", sep="\t")
painted = box.copy()
painted.visual.face_colors = [[255, 0, 0, 255] if n[0] > 0.5 else [0, 0, 255, 255] for n in box.face_normals]
put("trimesh-faces.ply", painted, 6, "red")
put("trimesh-faces-text.ply", painted, 6, "red", encoding="ascii")
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
        print(file, volume, "", "", sep="\t")
    file = f"open3d-{name}-text.ply"
    assert o3d.io.write_triangle_mesh(str(out / file), mesh, write_ascii=True)
    print(file, volume, "", "", sep="\t")
    mesh.vertex_colors = o3d.utility.Vector3dVector(np.tile([1.0, 0.0, 0.0], (len(mesh.vertices), 1)))
    for kind in ("obj", "ply", "off"):
        file = f"open3d-{name}-red.{kind}"
        assert o3d.io.write_triangle_mesh(str(out / file), mesh), file
        print(file, volume, "", "red", sep="\t")
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
        ("obj", dict(save_face_color=True), ""),
        ("ply", dict(binary=True, save_face_color=True), "red"),
        ("text.ply", dict(binary=False, save_face_color=True), "red"),
        ("stl", dict(binary=True, save_face_color=True), "red"),
        ("magics.stl", dict(binary=True, save_face_color=True, colormode=True), "red"),
        ("text.stl", dict(binary=False), ""),
        ("off", dict(save_face_color=True), "red"),
    ):
        file = f"meshlab-{name}-{kind}" if "." in kind else f"meshlab-{name}.{kind}"
        ms.save_current_mesh(str(out / file), **how)
        print(file, volume, "", colour, sep="\t")
    ms.compute_color_by_function_per_vertex(x="0", y="255", z="0")
    for kind in ("off", "ply", "obj"):
        file = f"meshlab-{name}-green.{kind}"
        ms.save_current_mesh(str(out / file), save_vertex_color=True, save_face_color=False)
        print(file, volume, "", "green", sep="\t")
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
        print(file, volume, "", "", sep="\t")
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
      console.log([file, volume(geometry), '', ''].join('\t'));
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

COLOURS = {"red": (255, 0, 0), "green": (0, 255, 0)}


def run(command, **more):
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, **more)


def write_all(work, out):
    """Lets every tool write; returns the lines they print and what was skipped."""
    lines, skipped = [], []
    for tool, script in (("trimesh", TRIMESH), ("open3d", OPEN3D), ("pymeshlab", MESHLAB), ("bpy", BPY)):
        place = work / tool
        venv.create(place, with_pip=True)
        python = place / "bin" / "python"
        installed = run([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", *PYPI[tool]])
        if installed.returncode:
            skipped.append(f"{tool}: cannot be installed: {installed.stderr.strip().splitlines()[-1][:120]}")
            continue
        wrote = run([python, "-c", script, out])
        if wrote.returncode:
            skipped.append(f"{tool}: does not run: {wrote.stderr.strip().splitlines()[-1][:160]}")
        lines += [line for line in wrote.stdout.splitlines() if line.count("\t") == 3]
        shutil.rmtree(place, ignore_errors=True)
    if shutil.which("npm"):
        place = work / "three"
        place.mkdir()
        (place / "package.json").write_text('{"type": "module"}')
        (place / "write.mjs").write_text(THREE_JS)
        installed = run(["npm", "install", "--silent", "--no-audit", "--no-fund", THREE], cwd=place)
        wrote = run(["node", "write.mjs", out], cwd=place)
        if installed.returncode or wrote.returncode:
            said = (installed.stderr + wrote.stderr).strip().splitlines()
            skipped.append(f"three: does not run: {said[-1][:160] if said else ''}")
        lines += [line for line in wrote.stdout.splitlines() if line.count("\t") == 3]
    else:
        skipped.append("three: there is no npm")
    return lines, skipped


def seen_colour(silmap, file, work):
    """The commonest colour of a picture from +x, as red, green and blue; None where no asset or picture comes."""
    asset, picture = work / "seen.glb", work / "seen.png"
    small = ["--views", "32", "--keep", "12", "--resolution", "64", "--faces", "60", "--texture-views", "6"]
    small += ["--texture-size", "64", "--atlas-size", "64"]
    built = run([silmap, "build", file, "-o", asset, *small])
    # Six bodies on one side of the centre would hide others; the eye is off the axes.
    drawn = run([silmap, "render", asset, "--eye", "9,1,0.5", "--size", "64x64", "--paint", "atlas", "-o", picture])
    if built.returncode or drawn.returncode:
        return None
    return commonest(picture)


def commonest(picture):
    import struct
    import zlib

    data = picture.read_bytes()
    at, body, head = 8, b"", None
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        chunk = data[at + 8 : at + 8 + size]
        head = struct.unpack(">IIBBBBB", chunk) if kind == b"IHDR" else head
        body += chunk if kind == b"IDAT" else b""
        at += size + 12
    width, height, channels = head[0], head[1], {2: 3, 6: 4}[head[3]]
    raw, stride = zlib.decompress(body), width * channels
    rows, previous = [], bytearray(stride)
    for y in range(height):
        kind, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        for i in range(stride):
            a, b, c = (line[i - channels] if i >= channels else 0), previous[i], (previous[i - channels] if i >= channels else 0)
            p = a + b - c
            paeth = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            line[i] = (line[i] + (0, a, b, (a + b) // 2, paeth)[kind]) & 255
        rows.append(line)
        previous = line
    counts = {}
    for line in rows:
        for x in range(width):
            pixel = tuple(line[x * channels : x * channels + 3])
            counts[pixel] = counts.get(pixel, 0) + 1
    middle = rows[height // 2][width // 2 * channels : width // 2 * channels + 3]
    return tuple(middle)


def is_hue(pixel, colour):
    """Whether a shaded pixel has the hue of a pure colour."""
    wanted = COLOURS[colour]
    bright = max(pixel)
    return bright > 40 and all((p > 0.6 * bright) == (w > 0) for p, w in zip(pixel, wanted))


def main():
    if len(sys.argv) not in (2, 4):
        sys.exit(__doc__)
    silmap = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        out = pathlib.Path(sys.argv[3]) if len(sys.argv) == 4 else work / "out"
        out.mkdir(exist_ok=True)
        lines, skipped = write_all(work, out)
        wrong, right = [], 0
        for line in lines:
            name, volume, options, colour = line.split("\t")
            asked = run([silmap, "hull", out / name, "--faces", "1000000", "-o", work / "hull.ply", "--json", *options.split()])
            if asked.returncode:
                wrong.append(f"{name}: {asked.stderr.strip().splitlines()[-1]}")
                continue
            found = json.loads(asked.stdout)["original_volume"]
            if not math.isclose(found, abs(float(volume)), rel_tol=VOLUME_REL):
                wrong.append(f"{name}: volume {found}, not {volume}")
                continue
            if colour:
                pixel = seen_colour(silmap, out / name, work)
                if pixel is None or not is_hue(pixel, colour):
                    wrong.append(f"{name}: looks {pixel}, not {colour}")
                    continue
            right += 1
    for line in skipped:
        print(f"skipped {line}")
    for line in wrong:
        print(f"wrong {line}")
    print(f"{right} files of {len(lines)} read right")
    if wrong or not lines:
        sys.exit(1)


if __name__ == "__main__":
    main()
