"""Lists of small generated models, for trying and measuring `tools/farm`."""
import json
import math


def closed(path, number, faces):
    """A torus of about so many faces as OBJ; every number gives another shape."""
    around = max(round(math.sqrt(faces)), 3)
    along = max(round(faces / 2 / around), 3)
    thickness = 0.25 + 0.2 * ((number * 7) % 11) / 11
    waves, depth = 2 + number % 5, 0.12 * ((number * 3) % 7) / 7
    stretch = 0.7 + 0.6 * ((number * 5) % 13) / 13
    lines = [f"# model {number}"]
    for i in range(around):
        u = math.tau * i / around
        radius = thickness * (1 + depth * math.cos(waves * u))
        for j in range(along):
            v = math.tau * j / along
            ring = 1 + radius * math.cos(v)
            lines.append(f"v {ring * math.cos(u):.6f} {stretch * ring * math.sin(u):.6f} {radius * math.sin(v):.6f}")
    for i in range(around):
        for j in range(along):
            a, b = i * along + j, (i + 1) % around * along + j
            c, d = i * along + (j + 1) % along, (i + 1) % around * along + (j + 1) % along
            lines.append(f"f {a + 1} {b + 1} {d + 1}\nf {a + 1} {d + 1} {c + 1}")
    path.write_text("\n".join(lines) + "\n")


def opened(path, number, faces):
    """The same with a face too few."""
    closed(path, number, faces)
    path.write_text(path.read_text().rsplit("f ", 1)[0])


def broken(path, number, _):
    """A PLY file that ends in its header."""
    path.write_text(f"ply\nformat ascii 1.0\ncomment {number}\nelement vertex 8\nproperty float")


def write(folder, kinds, faces):
    """A list of models in a folder; `kinds` has a function for each. Gives the list's path."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "list.jsonl"
    with open(path, "w") as file:
        for number, kind in enumerate(kinds):
            name = f"{number:05}.{'ply' if kind is broken else 'obj'}"
            kind(folder / name, number, faces)
            file.write(json.dumps({"model": name}) + "\n")
    return path
