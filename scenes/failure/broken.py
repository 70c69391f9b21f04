"""Files with faults: triangles without an area, vertices that are no numbers, a sky of NaN, infinite and negative texels."""

import math
import os
import random
import struct

from failure.parts import lamp, room
from gltf import Writer
from shapes import Shape, box, quad, sphere

NAN, INFINITE = math.nan, math.inf


def faulty_mesh():
    """A sphere among whose triangles are some without an area, twice the same, or as thin as floats allow."""
    shape = sphere(0.4, 12)
    rng = random.Random(2)
    good = list(shape.triangles)
    for a, b, c in rng.sample(good, 60):
        shape.triangles += [(a, a, a), (a, b, b), (a, b, a)]  # a point, lines
        shape.triangles += [(a, b, c), (a, c, b)]  # the same again, and turned over
    # Vertices of their own at one place, on one line, and almost on one.
    for q in ((0, 0, 0), (0.1, 0, 0), (0.1, 1e-6, 0)):
        first = len(shape.positions)
        shape.positions += [(0, 0.45, 0), (0.2, 0.45, 0), tuple(s + c for s, c in zip((0, 0.45, 0), q))]
        shape.normals += [(0, 0, 0)] * 3
        shape.uvs += [(0, 0)] * 3
        shape.triangles.append((first, first + 1, first + 2))
    # Normals that say nothing, or the opposite.
    for i in range(0, len(shape.normals), 7):
        shape.normals[i] = (0, 0, 0)
    for i in range(3, len(shape.normals), 11):
        shape.normals[i] = tuple(-c for c in shape.normals[i])
    return shape


def degenerate(folder):
    out = Writer(folder, "degenerate")
    out.place("room", room((-1, 0, -1), (1, 2, 1)), out.material("walls", (0.6, 0.58, 0.55)))
    out.place("ball", faulty_mesh(), out.material("ball", (0.7, 0.3, 0.2), roughness=0.4), at=(-0.45, 0.4, 0))
    out.place("glass", faulty_mesh(), out.material("glass", roughness=0, glass_ior=1.5), at=(0.45, 1.1, 0.1))
    # Twice the same: which one is seen is left to chance, but not the image's brightness.
    for name in ("box", "box again"):
        out.place(name, box((0.1, 0, -0.6), (0.7, 0.6, 0)).without_uvs(), out.material("box", (0.3, 0.4, 0.7)))
    shining = lamp((0, 1.98, 0), 0.5, 0.5)
    shining.positions += [(0, 1.9, 0)] * 3 + [(0, 1.9, 0), (0.2, 1.9, 0), (0.4, 1.9, 0)]
    shining.normals += [(0, -1, 0)] * 6
    shining.triangles += [(4, 5, 6), (7, 8, 9), (0, 0, 1)]  # shine, too, without an area
    out.place("lamp", shining, out.material("lamp", (0, 0, 0), emissive=(12, 11, 10)))
    out.camera((0, 1, 3.6), (0, 1, 0), 42, 1)
    out.save()


def not_a_number(folder, name, position, normal):
    """One vertex of a box. To be refused with the vertex named."""
    out = Writer(folder, name)
    out.place("room", room((-1, 0, -1), (1, 2, 1)), out.material("walls", (0.6, 0.58, 0.55)))
    out.place("lamp", lamp((0, 1.98, 0), 0.5, 0.5), out.material("lamp", (0, 0, 0), emissive=(12, 11, 10)))
    bad = box((-0.4, 0, -0.4), (0.4, 0.8, 0.4)).without_uvs()
    out.place("box", bad, out.material("box", (0.3, 0.4, 0.7)))
    out.camera((0, 1, 3.6), (0, 1, 0), 42, 1)
    out.save()
    # The file's text says bounds as if all were numbers: the last but one of the views with 24 vertices are the box's.
    path = os.path.join(folder, name + ".bin")
    views = [out.json["bufferViews"][out.json["accessors"][a]["bufferView"]]
             for a in (out.json["meshes"][-1]["primitives"][0]["attributes"][k] for k in ("POSITION", "NORMAL"))]
    with open(path, "r+b") as file:
        for view, value in zip(views, (position, normal)):
            if value is not None:
                file.seek(view["byteOffset"] + 12 * 5)
                file.write(struct.pack("<f", value))


def exr(path, width, height, pixel):
    """OpenEXR: one part, scan lines without compression, 32-bit R, G, B."""
    def attribute(name, kind, data):
        return name + b"\0" + kind + b"\0" + struct.pack("<i", len(data)) + data
    channels = b"".join(c + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for c in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    header = struct.pack("<ii", 20000630, 2) + b"".join((
        attribute(b"channels", b"chlist", channels), attribute(b"compression", b"compression", b"\0"),
        attribute(b"dataWindow", b"box2i", window), attribute(b"displayWindow", b"box2i", window),
        attribute(b"lineOrder", b"lineOrder", b"\0"), attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        attribute(b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0)),
        attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)))) + b"\0"
    line = 8 + 12 * width
    with open(path, "wb") as out:
        out.write(header)
        first = len(header) + 8 * height
        out.write(struct.pack("<%dQ" % height, *(first + line * y for y in range(height))))
        for y in range(height):
            row = [pixel(x, y) for x in range(width)]
            out.write(struct.pack("<ii", y, 12 * width))
            for channel in (2, 1, 0):
                out.write(struct.pack("<%df" % width, *(p[channel] for p in row)))


def faulty_sky(folder):
    """Bodies in the open; the map has texels that are no light."""
    out = Writer(folder, "faulty_sky")
    out.place("floor", quad((-3, 0, 3), (6, 0, 0), (0, 0, -6)).without_uvs(), out.material("floor", (0.5, 0.5, 0.5)))
    out.place("ball", sphere(0.5, 16).without_uvs(), out.material("brass", (0.9, 0.7, 0.35), metallic=1, roughness=0.1),
              at=(-0.6, 0.5, 0))
    out.place("box", box((0.2, 0, -0.3), (0.9, 0.7, 0.4)).without_uvs(), out.material("box", (0.3, 0.4, 0.7)))
    out.camera((0.1, 1.2, 3.8), (0.1, 0.4, 0), 36, 4 / 3)
    out.save()
    faults = {(3, 4): (NAN, NAN, NAN), (9, 2): (1, NAN, 1), (20, 5): (-5, -5, -5), (25, 3): (-INFINITE, 1, 1),
              (28, 6): (NAN, -1, 2)}
    exr(os.path.join(folder, "faulty_sky.exr"), 32, 16, lambda x, y: faults.get((x, y), (0.5, 0.7, 1.0 - 0.02 * y)))
    # An infinite texel is taken for one of 65504: a sun, of which nobody knows how bright it is.
    faults = {(12, 4): (INFINITE, INFINITE, INFINITE)}
    exr(os.path.join(folder, "infinite_sky.exr"), 32, 16, lambda x, y: faults.get((x, y), (0.5, 0.7, 1.0 - 0.02 * y)))


def make(folder):
    degenerate(folder)
    not_a_number(folder, "nan_position", NAN, None)
    not_a_number(folder, "infinite_position", INFINITE, None)
    not_a_number(folder, "nan_normal", None, NAN)
    faulty_sky(folder)
