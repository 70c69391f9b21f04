"""Rooms whose light is small, hidden, blinding or not there at all, and one in which all is white."""

import math
import os
import struct

from failure.parts import lamp, room, wall_with_hole
from gltf import Writer
from shapes import box, quad, sphere, torus

GRAY = (0.6, 0.58, 0.55)


def tiny_light(folder):
    """A room of 2 m and a lamp of 0.2 mm, which shines seven million; its reflections in brass are fireflies."""
    out = Writer(folder, "tiny_light")
    out.place("room", room((-1, 0, -1), (1, 2, 1)), out.material("walls", GRAY))
    out.place("box", box((-0.7, 0, -0.6), (-0.1, 0.8, 0)).without_uvs(), out.material("box", (0.3, 0.4, 0.7)))
    out.place("ball", sphere(0.35, 12).without_uvs(), out.material("brass", (0.9, 0.7, 0.35), metallic=1, roughness=0.25),
              at=(0.45, 0.35, 0.2))
    out.place("lamp", lamp((0, 1.9, 0), 2e-4, 2e-4), out.material("lamp", (0, 0, 0), emissive=(7e6, 7e6, 7e6)))
    out.camera((0, 1, 3.6), (0, 1, 0), 42, 1)
    out.save()


def keyhole(folder):
    """The lamp is in the next room; the wall between has a hole of 12 cm."""
    out = Writer(folder, "keyhole")
    gray = out.material("walls", GRAY, matte=True, double_sided=True)
    out.place("front", room((-1, 0, 0), (1, 2, 2), (0, 2)), gray)
    out.place("rear", room((-1, 0, -2), (1, 2, 0), (0,)), gray)
    out.place("wall", wall_with_hole(2, 2, 0.12, (0.2, 1.1)), gray)
    out.place("box", box((-0.6, 0, 0.6), (0, 0.7, 1.2)).without_uvs(), out.material("box", (0.7, 0.35, 0.25), matte=True))
    out.place("lamp", lamp((0.3, 1.9, -0.7), 0.6, 0.6), out.material("lamp", (0, 0, 0), emissive=(900, 850, 760)))
    out.camera((0, 1, 4.6), (0, 1, 0), 42, 1)
    out.save()


def dynamic_range(folder):
    """A room of radiance .01, and at the end of a black shaft, which keeps its light out of the room, one of 10,000."""
    out = Writer(folder, "dynamic_range")
    gray = out.material("walls", GRAY, matte=True, double_sided=True)
    out.place("room", room((-1, 0, 0), (1, 2, 2), (0, 2)), gray)
    out.place("back", wall_with_hole(2, 2, 0.5, (0, 1)), gray)
    shaft = room((-0.25, 0.75, -3), (0.25, 1.25, 0), (-3, 0))
    out.place("shaft", shaft, out.material("black", (0, 0, 0), matte=True))
    out.place("sun", quad((-0.25, 0.75, -3), (0.5, 0, 0), (0, 0.5, 0)).without_uvs(),
              out.material("sun", (0, 0, 0), emissive=(1e4, 1e4, 9e3)))
    out.place("box", box((-0.9, 0, 0.5), (-0.5, 0.8, 1.1)).without_uvs(), out.material("box", (0.3, 0.4, 0.7), matte=True))
    out.place("lamp", lamp((0, 1.99, 0.8), 0.3, 0.3), out.material("lamp", (0, 0, 0), emissive=(0.4, 0.35, 0.25)))
    out.camera((0, 1, 4.6), (0, 1, 0), 42, 1)
    out.save()


def bulbs(folder):
    """A dim room with bulbs of a tenth of a pixel to one pixel in front of its walls, a thousand times as bright as these."""
    out = Writer(folder, "bulbs")
    out.place("room", room((-1, 0, -1), (1, 2, 1)), out.material("walls", GRAY))
    out.place("box", box((-0.7, 0, -0.6), (-0.1, 0.8, 0)).without_uvs(), out.material("box", (0.3, 0.4, 0.7)))
    glow = out.material("glow", (0, 0, 0), emissive=(400, 350, 250))
    for k in range(8):
        x, y = -0.85 + 0.24 * k, 1.1 + 0.13 * (5 * k % 7)
        out.place(f"bulb {k}", sphere(0.002 * 1.4 ** k, 6).without_uvs(), glow, at=(x, y, -0.95))
    out.camera((0, 1, 3.6), (0, 1, 0), 42, 1)
    out.save()


def black(folder, name, shining):
    """Nothing is seen: the lamp, if there is one, shines inside of a closed box."""
    out = Writer(folder, name)
    out.place("room", room((-1, 0, -1), (1, 2, 1)), out.material("walls", GRAY))
    out.place("box", box((-0.4, 0, -0.4), (0.4, 0.8, 0.4)).without_uvs(), out.material("box", (0.3, 0.4, 0.7)))
    if shining:
        out.place("lamp", lamp((0, 0.6, 0), 0.2, 0.2), out.material("lamp", (0, 0, 0), emissive=(50, 50, 50)))
    out.camera((0, 1, 3.6), (0, 1, 0), 42, 1)
    out.save()


def furnace(folder):
    """Bodies that reflect all light, under a sky of 1: every pixel is 1, as the longest path goes to infinity. Flat triangles:
    interpolated normals lose light."""
    out = Writer(folder, "furnace")
    white = out.material("white", (1, 1, 1), matte=True)
    ball, ring = sphere(0.5, 16).without_uvs(), torus(0.4, 0.1, 32, 12).without_uvs()
    ball.normals, ring.normals = [], []
    out.place("ball", ball, white, at=(-0.5, 0.5, 0))
    out.place("box", box((0.1, 0, -0.3), (0.8, 0.7, 0.4)).without_uvs(), white)
    out.place("ring", ring, white, at=(0, 0.1, 0.9))
    out.camera((0.1, 1.2, 3.4), (0.1, 0.4, 0), 32, 1)
    out.save()
    radiance_map(os.path.join(folder, "white.hdr"), 8, 4, lambda x, y: (1, 1, 1))
    # Zenith blue, horizon white, and a low sun of some 10 degrees.
    def sky(x, y):
        if y >= 16:
            return (0.1, 0.1, 0.08)
        up = 1 - y / 16
        if (x, y) == (20, 11):
            return (150, 120, 80)
        return (1 - 0.8 * up, 1 - 0.6 * up, 1)
    radiance_map(os.path.join(folder, "sky.hdr"), 64, 32, sky)


def radiance_map(path, width, height, pixel):
    """Ward's format, without run lengths."""
    with open(path, "wb") as out:
        out.write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width))
        for y in range(height):
            for x in range(width):
                rgb = pixel(x, y)
                exponent = math.frexp(max(rgb))[1]
                out.write(struct.pack("4B", *(min(255, int(c * 2 ** (8 - exponent))) for c in rgb), exponent + 128))


def make(folder):
    tiny_light(folder)
    keyhole(folder)
    dynamic_range(folder)
    bulbs(folder)
    black(folder, "black_lit", True)
    black(folder, "black_unlit", False)
    furnace(folder)
