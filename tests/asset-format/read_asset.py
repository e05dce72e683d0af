#!/usr/bin/env python3
"""Reads an asset by docs/asset-format.md alone, with the standard library only, and prints what is in it as JSON.

    read_asset.py ASSET.glb              counts, views, triangles, levels, curves and cameras
    read_asset.py ASSET.glb --view K     camera and contours of a captured view, with --level L at a level of detail

It is a second reader of the format, which shares no code with silmap: a test compares what both print. Exit code 1 and one
sentence when the file is not an asset, or is damaged.
"""
import argparse
import base64
import json
import math
import struct
import sys
import zlib
from pathlib import Path

NAME = "SILMAP_silhouette_map"
FLOAT, BYTES_OF = 5126, {5121: 1, 5123: 2, 5125: 4}
COARSEST_LEVEL = 6


class NotAnAsset(Exception):
    """What is wrong with a file."""


def require(condition, what):
    if not condition:
        raise NotAnAsset(what)


class Part:
    """A binary part that is read from its beginning to its end."""

    def __init__(self, data, name):
        self.data, self.at, self.name = data, 0, name

    def take(self, count):
        require(count <= len(self.data) - self.at, f"the {self.name} end too early")
        self.at += count
        return self.data[self.at - count : self.at]

    def u8(self):
        return self.take(1)[0]

    def f32(self, count):
        return struct.unpack(f"<{count}f", self.take(4 * count))

    def f64(self, count):
        return struct.unpack(f"<{count}d", self.take(8 * count))

    def uint(self, below=1 << 64):
        value = shift = 0
        while True:
            byte = self.u8()
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                break
            require(shift < 70, f"a number in the {self.name} has no end")
        require(value < below, f"a number in the {self.name} is {value}, not below {below}")
        return value

    def sint(self):
        folded = self.uint()
        return (folded >> 1) ^ -(folded & 1)

    def count(self, bytes_each):
        """A count of things that take so many bytes at least."""
        return self.uint(1 + (len(self.data) - self.at) // bytes_each)

    def end(self):
        require(self.at == len(self.data), f"bytes are left after the {self.name}")


class Document:
    """A glTF document and its buffers."""

    def __init__(self, file):
        require(file[:4] == b"glTF" and len(file) >= 20, "it is no binary glTF file")
        version, length, json_length, kind = struct.unpack("<III4s", file[4:20])
        require(version == 2 and length == len(file) and kind == b"JSON", "it is no binary glTF file of version 2")
        self.file, self.json_text = file, file[20 : 20 + json_length]
        self.json = json.loads(self.json_text)
        rest = file[20 + json_length :]
        self.binary = b""
        if rest:
            size, kind = struct.unpack("<I4s", rest[:8])
            require(kind == b"BIN\0" and size <= len(rest) - 8, "its binary chunk is incomplete")
            self.binary = rest[8 : 8 + size]

    def element(self, kind, index):
        items = self.json.get(kind, [])
        require(index < len(items), f"{kind} has no element {index}")
        return items[index]

    def buffer(self, index):
        uri = self.element("buffers", index).get("uri")
        return self.binary if uri is None else data_of(uri)

    def view(self, index):
        view = self.element("bufferViews", index)
        start = view.get("byteOffset", 0)
        data = self.buffer(view.get("buffer", 0))[start : start + view["byteLength"]]
        require(len(data) == view["byteLength"], f"buffer view {index} ends too early")
        return data

    def image(self, index):
        image = self.element("images", index)
        return self.view(image["bufferView"]) if "bufferView" in image else data_of(image.get("uri", ""))

    def accessor(self, index):
        """The rows of an accessor: tuples of numbers."""
        accessor = self.element("accessors", index)
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}.get(accessor["type"])
        require(width and "sparse" not in accessor, f"accessor {index} is of no type that may be referred to")
        is_float = accessor["componentType"] == FLOAT
        require(is_float == (width > 1), f"accessor {index} has the wrong component type")
        each = 4 if is_float else BYTES_OF[accessor["componentType"]]
        stride = self.element("bufferViews", accessor["bufferView"]).get("byteStride") or each * width
        data, start = self.view(accessor["bufferView"]), accessor.get("byteOffset", 0)
        last = start + (accessor["count"] - 1) * stride + each * width
        require(accessor["count"] == 0 or last <= len(data), f"accessor {index} ends too early")
        layout = f"<{width}f" if is_float else {1: "<B", 2: "<H", 4: "<I"}[each]
        return [struct.unpack_from(layout, data, start + i * stride) for i in range(accessor["count"])]

    def meaning(self, kind, index):
        """The bytes of a reference."""
        if kind == "view":
            return self.view(index)
        if kind == "image":
            return self.image(index)
        rows = self.accessor(index)
        flat = [x for row in rows for x in row]
        is_index = len(rows[0]) == 1 if rows else True
        return struct.pack(f"<{len(flat)}{'I' if is_index else 'f'}", *flat)


def data_of(uri):
    """The bytes of a data URI."""
    head, found, data = uri.partition(";base64,")
    require(found and head.startswith("data:"), "data beside the file are not read")
    return base64.b64decode(data + "=" * (-len(data) % 4))


def kind_of(key):
    if key in ("image", "images", "normals"):
        return "image"
    if key.endswith("View"):
        return "view"
    return "accessor" if key.endswith("Accessor") else None


class Checksum:
    """The checksum over the meaning of an extension object."""

    def __init__(self, document, extension):
        self.document, self.crc, self.data_bytes = document, 0, 0
        self.object(extension, is_root=True)

    def add(self, letter, size, data=b""):
        self.crc = zlib.crc32(letter + struct.pack("<Q", size) + data, self.crc)

    def object(self, value, is_root=False, is_opaque=False):
        self.add(b"o", len(value))
        for key in sorted(value, key=lambda key: key.encode()):
            if is_root and key == "checksum":
                continue
            self.value(key)
            is_inside = is_opaque or key == "params"
            self.value(value[key], None if is_inside else kind_of(key), is_inside)

    def value(self, value, kind=None, is_opaque=False):
        if value is None:
            self.add(b"n", 0)
        elif isinstance(value, bool):
            self.add(b"b", int(value))
        elif isinstance(value, str):
            self.add(b"s", len(value.encode()), value.encode())
        elif isinstance(value, list):
            self.add(b"a", len(value))
            for item in value:
                self.value(item, kind, is_opaque)
        elif isinstance(value, dict):
            self.object(value, is_opaque=is_opaque)
        else:
            self.number(value, kind)

    def number(self, value, kind):
        if isinstance(value, int) and not -(1 << 63) <= value < 1 << 64:
            value = float(value)
        if isinstance(value, float) and value.is_integer() and abs(value) <= 1 << 53:
            value = int(value)
        if isinstance(value, float):
            self.add(b"f", 0, struct.pack("<d", value))
        elif kind and value >= 0:
            data = self.document.meaning(kind, value)
            self.data_bytes += len(data)
            self.add(b"d", len(data), data)
        else:
            self.add(b"i", 0, value.to_bytes(16, "little", signed=True))


def checked_extension(document):
    """The extension object of a file whose checksum is right."""
    extension = document.json.get("extensions", {}).get(NAME)
    require(extension, "it has no silhouette map")
    version = extension.get("formatVersion")
    require(version in (1, 2, 3), f"its format version is {version}")
    if version == 1:
        key = b'"checksum":"'
        digits = 20 + document.json_text.index(key) + len(key)
        blank = document.file[:digits] + b"00000000" + document.file[digits + 8 :]
        computed = zlib.crc32(blank)
    else:
        checksum = Checksum(document, extension)
        require(checksum.data_bytes == extension["dataBytes"], "it has lost data")
        computed = checksum.crc
    require(f"{computed:08x}" == extension["checksum"], f"its checksum is {extension['checksum']}, of its contents {computed:08x}")
    return extension


# ── Vectors ───────────────────────────────────────────────────────────────────────────────────────────────────────────

def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    length = math.hypot(*a)
    return [x / length for x in a]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def captured_camera(eye, header):
    """The camera of a captured view, which follows from its eye."""
    to_center = minus(header["center"], eye)
    forward = unit(to_center)
    hint = [0, 0, 1] if abs(forward[1]) > math.cos(math.radians(18)) else [0, 1, 0]
    right = unit(cross(forward, hint))
    room = dot(to_center, to_center) - header["radius"] ** 2
    require(room > 0, "an eye is inside the bounding sphere")
    return {"eye": list(eye), "right": right, "up": cross(right, forward), "forward": forward,
            "half_tangent": 1.02 * header["radius"] / math.sqrt(room)}


# ── Parts ─────────────────────────────────────────────────────────────────────────────────────────────────────────────

def read_silhouettes(data, header):
    """Views and triangles."""
    part = Part(data, "silhouettes")
    views = []
    for _ in range(part.count(26)):
        eye = part.f64(3)
        view = {"camera": captured_camera(eye, header), "contours": []}
        shift, (x, y, z) = part.u8(), (0, 0, 0)
        distance, step = math.dist(eye, header["center"]), header["radius"] / 4096
        for _ in range(part.count(1)):
            head = part.uint()
            points, depths = [], []
            for _ in range(head >> 1):
                x += part.sint() << shift
                y += part.sint() << shift
                points.append([x / 16, y / 16])
            for _ in range((head >> 1) * (head & 1)):
                z += part.sint()
                depths.append(distance + z * step)
            view["contours"].append({"points": points, "depths": depths, "levels": []})
        views.append(view)
    triangles = [[part.uint(len(views)) for _ in range(3)] for _ in range(part.count(3))]
    part.end()
    return views, triangles


class Bits:
    """Decisions of the range coder in the rest of a part."""

    def __init__(self, part):
        self.part, self.range, self.contexts = part, (1 << 32) - 1, {}
        self.code = int.from_bytes(part.take(4), "big")

    def bit(self, *context):
        return self.decide(context, *self.contexts.get(context, (1 << 15, 1 << 15)))

    def fixed(self, p):
        """A decision that is not learnt from."""
        return self.decide(None, p << 4, p << 4)

    def decide(self, context, q, s):
        bound = (self.range >> 12) * min(max((q + s) >> 5, 32), 4064)
        bit = int(self.code >= bound)
        if bit:
            self.code, self.range = self.code - bound, self.range - bound
            q, s = q - (q >> 4), s - (s >> 7)
        else:
            self.range = bound
            q, s = q + ((65535 - q) >> 4), s + ((65535 - s) >> 7)
        if context:
            self.contexts[context] = (q, s)
        while self.range < 1 << 24:
            self.range, self.code = self.range << 8, self.code << 8 | self.part.u8()
        return bit


    def size(self, learnt, head, *context):
        """A whole number of 0 or more."""
        n = 0
        while n < 44 and self.bit("longer", *context, n):
            n += 1
        value = int(n > 0)
        for k in range(n - 1):
            bit = self.bit("head", head, n, value) if k < learnt else self.fixed(2048)
            value = value << 1 | bit
        return value

    def number(self, learnt, head, sign, *context):
        """A whole number."""
        value = self.size(learnt, head, *context)
        return -value if value and self.bit("sign", *sign) else value


def read_contours(data, header):
    """Views and triangles of version 3."""
    part = Part(data, "silhouettes")
    eyes = [part.f64(3) for _ in range(part.count(24))]
    triangles = [[part.uint(len(eyes)) for _ in range(3)] for _ in range(part.count(3))]
    depth_bits, has_levels = part.u8(), part.u8()
    require(8 <= depth_bits <= 20, "depths have no step")
    coder, views, total = Bits(part), [], 0
    for eye in eyes:
        contours, last, number = [], [0, 0, 0], 0
        distance, step = math.dist(eye, header["center"]), header["radius"] / (1 << depth_bits)
        for _ in range(coder.size(0, "first", "count")):
            number += coder.size(0, "first", "step")
            require(number < 256, "a contour is of no part that there can be")
            has_depth = coder.bit("depth")
            points, depths, edge, turn, slide = [], [], [0, 0], 0, 0
            while not coder.fixed(3968):
                total += 1
                require(total <= 1 << 24, "there are too many contour vertices")
                if not points:
                    new = [coder.number(3, "first", ("first", k), "first", k) for k in range(2)]
                else:
                    new, turn = next_edge(coder, edge, turn)
                last = [last[0] + new[0], last[1] + new[1], last[2]]
                if has_depth:
                    length = min(max(abs(new[0]).bit_length(), abs(new[1]).bit_length()), 12)
                    if not points:
                        last[2] += coder.number(3, "first", ("first", 2), "first", 2)
                    else:
                        sign = (slide > 0) - (slide < 0)
                        slide_class = min(abs(slide).bit_length(), 6)
                        slide = coder.number(2, "depth", ("depth", sign), "depth", length, slide_class)
                        last[2] += slide
                    depths.append(distance + last[2] * step)
                edge = new if points else [0, 0]
                points.append(last[:2])
            levels = contour_levels(coder, points) if has_levels else []
            points = [[x / 16, y / 16] for x, y in points]
            contours.append({"points": points, "depths": depths, "levels": levels, "part": number})
        views.append({"camera": captured_camera(eye, header), "contours": contours})
    part.end()
    return views, triangles


def next_edge(coder, edge, turn):
    """The edge after one, and which way it turns from it."""
    swapped = abs(edge[0]) < abs(edge[1])
    run, rise = reversed(edge) if swapped else edge
    flips = [-1 if run < 0 else 1, -1 if rise < 0 else 1]
    mirrored = swapped ^ (flips[0] < 0) ^ (flips[1] < 0)
    run, rise = abs(run), abs(rise)
    slope = min(4 * rise // run, 3) if run else 4
    along = coder.number(3, "along", ("along", slope), "along", slope, min(run.bit_length(), 12))
    straight = (2 * along * rise + run) // (2 * run) if run else 0
    length = min(abs(along).bit_length(), 12)
    across = straight + coder.number(2, "across", ("across", -turn if mirrored else turn), "across", along < 0, length)
    new = [along * flips[0], across * flips[1]]
    if swapped:
        new.reverse()
    bend = edge[0] * new[1] - edge[1] * new[0]
    return new, (bend > 0) - (bend < 0)


def contour_levels(coder, points):
    levels, there = [0] * len(points), list(range(len(points)))
    for level in range(1, COARSEST_LEVEL + 1):
        before = 0
        for j, k in enumerate(there):
            (ax, ay), (px, py), (bx, by) = points[there[j - 1]], points[k], points[there[(j + 1) % len(there)]]
            area = float(px - ax) * float(by - ay) - float(py - ay) * float(bx - ax)
            base = float(bx - ax) * float(bx - ax) + float(by - ay) * float(by - ay)
            height = sum(area * area >= base * 4.0 ** (level + i - 1) for i in range(1, 7))
            stays = coder.bit("stays", level, before, height)
            levels[k] += stays
            before = (before << 1 | stays) & 3
        there = [k for k in there if levels[k] >= level]
    require(levels.count(COARSEST_LEVEL) >= min(3, len(levels)), "a contour is no loop at its coarsest level")
    return levels


def read_levels(data, views):
    part = Part(data, "levels of detail")
    require(part.u8() == 1, "its levels of detail have another coding")
    bits = (byte >> k & 1 for byte in data[1:] for k in range(8))
    used = 0
    for contour in (contour for view in views for contour in view["contours"]):
        levels = [0] * len(contour["points"])
        for level in range(1, COARSEST_LEVEL + 1):
            for k, own in enumerate(levels):
                if own == level - 1:
                    levels[k] += next(bits)
                    used += 1
        require(levels.count(COARSEST_LEVEL) >= min(3, len(levels)), "a contour is no loop at its coarsest level")
        contour["levels"] = levels
    require(not any(bits) and len(data) == 1 + (used + 7) // 8, "bits are left after the levels of detail")


def read_depths(data, view_count):
    """Bits, columns, rows, and per view the nearest and the farthest depth and the rows of codes."""
    part = Part(data, "depths")
    bits, width, height = part.uint(15), part.uint(4097), part.uint(4097)
    require(bits > 1 and width > 0 and height > 0, "depths have no size")
    ranges = [part.f64(2) for _ in range(view_count)]
    coder, most, pictures = Bits(part), (1 << bits) - 1, []
    for near, far in ranges:
        require(near <= far, "depths have no range")
        last, rows = 1 << (bits - 1), []
        # With a column of nothing on either side.
        above, above_off = [0] * (width + 2), [0] * (width + 2)
        for _ in range(height):
            here, off = [0] * (width + 2), [0] * (width + 2)
            for x in range(1, width + 1):
                around = left, top, right, corner = here[x - 1], above[x], above[x + 1], above[x - 1]
                if not coder.bit("seen", left > 0, top > 0, corner > 0, right > 0):
                    continue
                if left and top and corner:
                    predicted = min(max(left + top - corner, min(left, top)), max(left, top))
                elif left and top:
                    predicted = (left + top) // 2
                else:
                    predicted = next((code for code in around if code), last)
                k = min((off[x - 1] + above_off[x] + above_off[x - 1] + above_off[x + 1]).bit_length(), 8)
                if not coder.bit("right", k):
                    less, n, m = coder.bit("less", k), 0, 1
                    while n < 14 and coder.bit("longer", k, n):
                        n += 1
                    for i in reversed(range(n)):
                        m = m << 1 | coder.bit("low", n, i)
                    predicted, off[x] = min(max(predicted - m if less else predicted + m, 1), most), m
                here[x] = last = predicted
            above, above_off = here, off
            rows.append(here[1:-1])
        pictures.append((near, far, rows))
    part.end()
    return bits, width, height, pictures


def read_hull(document, extension):
    """Positions and surface points of hull vertices, faces of them, and the texture coordinates of corners."""
    hull = extension["hull"]
    if extension["formatVersion"] == 1:
        primitive = document.json["meshes"][0]["primitives"][0]
        attributes = primitive["attributes"]
        arrays = attributes["POSITION"], primitive["indices"], attributes.get("TEXCOORD_0")
    else:
        arrays = hull["positionsAccessor"], hull["indicesAccessor"], hull.get("uvsAccessor")
    unwelded, indices = document.accessor(arrays[0]), [row[0] for row in document.accessor(arrays[1])]
    uvs = document.accessor(arrays[2]) if arrays[2] is not None else []
    part = Part(document.view(hull["verticesView"]), "hull vertices")
    positions = [None] * part.count(1)
    vertex_of = [part.uint(len(positions)) for _ in unwelded]
    for vertex, position in zip(vertex_of, unwelded):
        require(positions[vertex] in (None, position), f"hull vertex {vertex} has two positions")
        positions[vertex] = position
    require(None not in positions, "a hull vertex has no position")
    surface = [part.f32(3) for _ in range(len(positions) * part.uint(2))]
    part.end()
    corners = [indices[k : k + 3] for k in range(0, len(indices), 3)]
    return {"positions": positions, "surface_points": surface, "faces": [[vertex_of[i] for i in c] for c in corners],
            "uvs": [[uvs[i] for i in c] for c in corners] if uvs else []}


def read_cameras(data, n_views, n_faces):
    part = Part(data, "cameras")
    names = ("eye", "right", "up", "forward")
    cameras = []
    for _ in range(n_views):
        camera = {name: list(part.f64(3)) for name in names} | {"half_tangent": list(part.f64(2))}
        cameras.append(camera | {"size": [part.uint(16385), part.uint(16385)]})
    has_visibility = part.uint(2)
    each = (n_views + 7) // 8
    visible = [int.from_bytes(part.take(each), "little") for _ in range(n_faces * has_visibility)]
    require(all(bits < 1 << n_views for bits in visible), "a face is visible in a view that does not exist")
    part.end()
    return cameras, visible


def read_curve(data):
    part = Part(data, "error curve")
    curve = [[part.uint(1 << 32), part.f32(1)[0]] for _ in range(part.count(5))]
    part.end()
    return curve


def read_order(data, n_views):
    """Numbers of views and mean errors, as the map loses one view after the other."""
    part = Part(data, "collapse order")
    curve, there = [[n_views, part.f32(2)[0]]], set(range(n_views))
    for _ in range(part.count(11)):
        removed, onto = part.uint(n_views), part.uint(n_views)
        curve.append([curve[-1][0] - 1, part.f32(2)[0]])
        turned = [part.uint(n_views) for _ in range(2 * part.count(2))]
        require({removed, onto, *turned} <= there and removed not in (onto, *turned), "a step names a view that is gone")
        there.remove(removed)
    part.end()
    return curve


def read(file):
    """Everything in an asset."""
    document = Document(file)
    extension = checked_extension(document)
    header, build, textures = extension["map"], extension["build"], extension["textures"]
    read_map = read_contours if extension["formatVersion"] == 3 else read_silhouettes
    views, triangles = read_map(document.view(header["silhouettesView"]), header)
    if "levelsView" in header:
        read_levels(document.view(header["levelsView"]), views)
    hull = read_hull(document, extension)
    cameras, visible = read_cameras(document.view(textures["camerasView"]), len(textures["images"]), len(hull["faces"]))
    curves = {name: read_curve(document.view(build[key])) for name, key in
              (("error_curve", "errorCurveView"), ("uniform_curve", "uniformCurveView")) if key in build}
    if "collapseOrderView" in build:
        curves["order_curve"] = read_order(document.view(build["collapseOrderView"]), len(views))
    if "depthsView" in textures:
        curves["depths"] = read_depths(document.view(textures["depthsView"]), len(textures["images"]))
    return {"extension": extension, "views": views, "triangles": triangles, "hull": hull, "cameras": cameras, "visible": visible, **curves}


# ── Printing ──────────────────────────────────────────────────────────────────────────────────────────────────────────

def summary(asset):
    """What `silmap inspect --full --json` prints, as far as it follows from the format."""
    extension, views, hull = asset["extension"], asset["views"], asset["hull"]
    contours = [contour for view in views for contour in view["contours"]]
    counts = [sum(len(c["points"]) for c in view["contours"]) for view in views]
    has_levels = any(c["levels"] for c in contours)
    at_level = lambda level: sum(sum(own >= level for own in c["levels"]) for c in contours) / len(views)  # noqa: E731
    printed = {
        "format_version": extension["formatVersion"],
        "model": {key: extension["model"][key] for key in ("name", "faces", "vertices", "origin") if key in extension["model"]},
        "map": {
            "views": len(views),
            "triangles": len(asset["triangles"]),
            "resolution": extension["map"]["resolution"],
            "contour_vertices_mean": sum(counts) / len(counts),
            "contour_vertices_max": max(counts),
            "level_vertices_mean": [at_level(level) for level in range(COARSEST_LEVEL + 1)] if has_levels else None,
            "has_depth": all(len(c["depths"]) == len(c["points"]) for c in contours),
        },
        "hull": {"faces": len(hull["faces"]), "vertices": len(hull["positions"]), "volume_ratio": extension["hull"]["volumeRatio"]},
        "textures": {"views": len(asset["cameras"])} | ({"relief": relief_figures(asset["depths"])} if "depths" in asset else {}),
        "views": [{"eye": view["camera"]["eye"], "contour_vertices": n} for view, n in zip(views, counts)],
        "triangles": asset["triangles"],
    }
    return printed | {name: asset[name] for name in ("error_curve", "uniform_curve", "order_curve") if name in asset}


def relief_figures(depths):
    bits, width, height, pictures = depths
    codes = [code for _, _, rows in pictures for row in rows for code in row if code]
    share = len(codes) / (width * height * len(pictures)) if pictures else 0
    return {"bits": bits, "size": [width, height], "seen": share, "code_mean": sum(codes) / max(len(codes), 1)}


def outline(asset, number, level):
    """A captured view: its camera, and its contours at a level of detail."""
    require(number < len(asset["views"]), f"there are {len(asset['views'])} views")
    view = asset["views"][number]
    kept = [[p for p, own in zip(c["points"], c["levels"] or [COARSEST_LEVEL] * len(c["points"])) if own >= level] for c in view["contours"]]
    return {"camera": view["camera"], "loops": kept, "parts": [c.get("part", 0) for c in view["contours"]]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("asset", type=Path)
    parser.add_argument("--view", type=int)
    parser.add_argument("--level", type=int, default=0)
    options = parser.parse_args()
    try:
        asset = read(options.asset.read_bytes())
        printed = summary(asset) if options.view is None else outline(asset, options.view, options.level)
    except (NotAnAsset, KeyError, ValueError, struct.error) as error:
        sys.exit(f"{options.asset}: {error}")
    print(json.dumps(printed))


if __name__ == "__main__":
    main()
