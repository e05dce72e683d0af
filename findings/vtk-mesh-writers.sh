#!/usr/bin/env bash
# VTK 9.7.2 (PyPI `vtk`), seen with Python 3.11 on x86-64 Linux. Two of its mesh writers lose a closed surface without a word:
#
# 1. vtkPLYWriter writes no face for triangle strips (`element face 0`); Write() returns 1 and the error code is 0. vtkSTLWriter
#    and vtkOBJWriter write the same strips as triangles.
# 2. vtkSTLWriter as text, where a mesh has triangles and larger polygons, writes the corners of triangles with 17 digits and those
#    of cut polygons with 6. The two texts are different numbers, so that a closed cone opens all around its base: 48 edges without
#    a partner for 24 sides. The same writer as binary, and as text after vtkTriangleFilter, leaves it closed.
#
# Exit code 1 when this changes.
set -euo pipefail

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/python"
"$work/python/bin/pip" install --quiet --disable-pip-version-check vtk==9.7.2

cat >"$work/write.py" <<'PYTHON'
import struct
import sys
from collections import Counter
from pathlib import Path

import vtk

folder = Path(sys.argv[1])


def write(writer, name, data, binary=False):
    writer.SetFileName(str(folder / name))
    writer.SetInputData(data)
    if hasattr(writer, "SetFileTypeToASCII"):
        (writer.SetFileTypeToBinary if binary else writer.SetFileTypeToASCII)()
    return writer.Write(), writer.GetErrorCode(), folder / name


def open_edges(corners):
    edges = Counter()
    for i in range(0, len(corners), 3):
        for k in range(3):
            edges[corners[i + k], corners[i + (k + 1) % 3]] += 1
    return sum(n for (a, b), n in edges.items() if edges[b, a] != n)


def text_corners(path):
    lines = (line.split() for line in path.read_text().splitlines())
    return [tuple(map(float, words[1:])) for words in lines if words[:1] == ["vertex"]]


def binary_corners(path):
    data = path.read_bytes()
    count = struct.unpack_from("<I", data, 80)[0]
    return [struct.unpack_from("<3f", data, 84 + 50 * i + 12 + 12 * k) for i in range(count) for k in range(3)]


cone = vtk.vtkConeSource(resolution=24)
triangles = vtk.vtkTriangleFilter()
triangles.SetInputConnection(cone.GetOutputPort())
stripper = vtk.vtkStripper()
stripper.SetInputConnection(triangles.GetOutputPort())
stripper.Update()
cone, triangles, strips = cone.GetOutput(), triangles.GetOutput(), stripper.GetOutput()

done, code, ply = write(vtk.vtkPLYWriter(), "strips.ply", strips)
faces = next(line for line in ply.read_text().splitlines() if line.startswith("element face"))
done_again, _, stl = write(vtk.vtkSTLWriter(), "strips.stl", strips)
_, _, obj = write(vtk.vtkOBJWriter(), "strips.obj", strips)
in_obj = sum(line.startswith("f ") for line in obj.read_text().splitlines())
mixed = text_corners(write(vtk.vtkSTLWriter(), "cone.stl", cone)[2])
seen = [
    f"VTK {vtk.vtkVersion.GetVTKVersion()}",
    f"vtkPLYWriter, strips: {faces}, Write() {done}, error code {code}",
    f"vtkSTLWriter, strips: {len(text_corners(stl)) // 3} facets; vtkOBJWriter, strips: {in_obj} faces",
    f"vtkSTLWriter, text, cone: {len(mixed) // 3} facets, {len(set(mixed))} places, {open_edges(mixed)} edges without a partner",
    f"vtkSTLWriter, binary, cone: {open_edges(binary_corners(write(vtk.vtkSTLWriter(), 'binary.stl', cone, True)[2]))}",
    f"vtkSTLWriter, text, cone of triangles: {open_edges(text_corners(write(vtk.vtkSTLWriter(), 'all.stl', triangles)[2]))}",
]
print("\n".join(seen))
PYTHON

cat >"$work/known" <<'TEXT'
VTK 9.7.2
vtkPLYWriter, strips: element face 0, Write() 1, error code 0
vtkSTLWriter, strips: 46 facets; vtkOBJWriter, strips: 46 faces
vtkSTLWriter, text, cone: 46 facets, 48 places, 48 edges without a partner
vtkSTLWriter, binary, cone: 0
vtkSTLWriter, text, cone of triangles: 0
TEXT

"$work/python/bin/python" "$work/write.py" "$work" >"$work/seen"
cat "$work/seen"
diff "$work/known" "$work/seen"
