"""A glass ball and a brass ring on a floor under a small lamp: light that only a lucky path finds, through the glass and
off the ring, and then of a radiance of hundreds (fireflies)."""

from failure.parts import lamp
from gltf import Writer
from shapes import quad, sphere, torus


def make(folder):
    out = Writer(folder, "caustic")
    white = out.material("white", (0.7, 0.7, 0.7), matte=True)
    floor = quad((-2, 0, 2), (4, 0, 0), (0, 0, -4)).add(quad((-2, 0, -2), (4, 0, 0), (0, 3, 0)))
    out.place("floor, back", floor.without_uvs(), white)
    out.place("ball", sphere(0.5, 12).without_uvs(), out.material("glass", roughness=0, glass_ior=1.5),
              at=(-0.5, 0.52, 0))
    ring = torus(0.45, 0.06, 32, 12).without_uvs()
    out.place("ring", ring, out.material("brass", (0.9, 0.7, 0.35), metallic=1, roughness=0.05), at=(0.8, 0.06, 0.4))
    out.place("lamp", lamp((0.9, 2.6, 0.6), 0.12, 0.12), out.material("lamp", (0, 0, 0), emissive=(400, 380, 340)))
    out.camera((0.1, 1.5, 3.6), (0.1, 0.5, 0), 36, 1)
    out.save()
