"""One scene in three units of length; all three have the same image. And once for a camera that sees a line of it."""

from failure.parts import lamp, room
from gltf import Writer
from shapes import box, sphere

UNITS = {"unit": 1, "unit_huge": 1e6, "unit_tiny": 1e-5}


def make(folder):
    for name, unit in UNITS.items():
        out = _scene(folder, name, unit)
        out.camera((0, 1, 3.6), (0, 1, 0), 42, 1)
        out.save()
    out = _scene(folder, "line", 1)
    out.orthographic_camera((0, 0.4, 3.6), (0, 0.4, 0), 0.98, 0.98 / 4000)
    out.save()


def _scene(folder, name, unit):
    out = Writer(folder, name, unit)
    out.place("room", room((-1, 0, -1), (1, 2, 1)), out.material("walls", (0.6, 0.58, 0.55)))
    out.place("box", box((-0.7, 0, -0.6), (-0.1, 0.8, 0)).without_uvs(), out.material("box", (0.3, 0.4, 0.7)))
    out.place("glass", sphere(0.3, 24).without_uvs(), out.material("glass", roughness=0, glass_ior=1.5),
              at=(-0.3, 1.2, 0.1))
    out.place("ball", sphere(0.35, 24).without_uvs(),
              out.material("brass", (0.9, 0.7, 0.35), metallic=1, roughness=0.3), at=(0.45, 0.36, 0.2))
    out.place("lamp", lamp((0, 1.98, 0), 0.5, 0.5), out.material("lamp", (0, 0, 0), emissive=(12, 11, 10)))
    return out
