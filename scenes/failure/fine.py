"""Detail finer than pixels, or that a lens and motion smear over them: features are as noisy as the light."""

import math
import random

import png
from failure.parts import lamp, room
from gltf import Writer
from shapes import Shape, cross, quad, sub, tube, unit


def wires(folder):
    """Wires of a tenth of a pixel before a lit wall, in three directions."""
    out = Writer(folder, "wires")
    out.place("room", room((-1, 0, -1), (1, 2, 1)), out.material("walls", (0.7, 0.7, 0.7)))
    metal, dark = out.material("steel", (0.8, 0.8, 0.8), metallic=1, roughness=0.2), out.material("dark", (0.02, 0.02, 0.02))
    thread = tube([(0, -1.4, 0), (0, 1.4, 0)], 0.0016, 5).without_uvs()
    for i in range(40):
        x = -0.95 + 1.9 * i / 39
        out.place("wire", thread, metal if i % 2 else dark, at=(x, 1, 0.3), turn=(0, 0, (i % 3 - 1) * 35))
    out.place("lamp", lamp((0, 1.98, 0.2), 0.5, 0.5), out.material("lamp", (0, 0, 0), emissive=(12, 11, 10)))
    out.camera((0, 1, 3.6), (0, 1, 0), 42, 1)
    out.save()


def grass(folder):
    """Blades of a millimetre as far as one sees; lit by ../lights/sky.hdr."""
    out = Writer(folder, "grass")
    ground = quad((-20, 0, 2), (40, 0, 0), (0, 0, -40)).without_uvs()
    out.place("ground", ground, out.material("earth", (0.15, 0.1, 0.06), matte=True))
    rng = random.Random(1)
    green = [out.material("blade %d" % i, c, double_sided=True)
             for i, c in enumerate([(0.1, 0.35, 0.05), (0.3, 0.4, 0.08), (0.05, 0.2, 0.04)])]
    clumps = []
    for _ in range(3):
        clump = Shape()
        for _ in range(120):
            x, z, a = rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), rng.uniform(0, 2 * math.pi)
            h, w, lean = rng.uniform(0.05, 0.14), 0.0015, rng.uniform(-0.05, 0.05)
            p = [(x - w * math.cos(a), 0, z - w * math.sin(a)), (x + w * math.cos(a), 0, z + w * math.sin(a)),
                 (x + lean * math.sin(a), h, z - lean * math.cos(a))]
            first = len(clump.positions)
            clump.positions += p
            clump.normals += [unit(cross(sub(p[1], p[0]), sub(p[2], p[0])))] * 3
            clump.triangles.append((first, first + 1, first + 2))
        clumps.append(clump)
    for row in range(20):
        for column in range(9):
            z = 0.6 - 0.5 * row
            spread = 0.35 + 0.14 * row
            out.place("clump", clumps[(row + column) % 3], green[(row * 7 + column * 3) % 3],
                      at=((column - 4) * spread, 0, z), turn=(0, rng.randrange(360), 0), scale=(1.6, 1, 1))
    out.camera((0, 0.35, 2), (0, 0.15, -1), 36, 4 / 3)
    out.save()


def cutouts(folder):
    """Three sheets full of holes, a third of a pixel and more, between lamp, eye and wall."""
    out = Writer(folder, "cutouts")
    palette = [(60, 120, 40, 255), (90, 160, 50, 255), (0, 0, 0, 0)]
    def mesh(x, y):
        return 2 if (x - 7.5) ** 2 + (y - 7.5) ** 2 < 30 or (x * y) % 7 == 3 else (x // 4 + y // 4) % 2
    picture = out.texture("holes.png", png.indexed(16, 16, palette, mesh), nearest=True)
    out.place("room", room((-1, 0, -1), (1, 2, 1)), out.material("walls", (0.7, 0.7, 0.7)))
    leaf = out.material("leaf", color_texture=picture, mask=True, double_sided=True)
    for i, (x, z, n) in enumerate(((-0.7, 0.7, 40), (-0.5, 0.2, 16), (-0.3, -0.4, 90))):
        out.place("sheet %d" % i, quad((x, 0.3 + 0.2 * i, z), (1, 0, 0.2), (0.1, 1, 0), (n, n)), leaf)
    out.place("lamp", lamp((0, 1.98, 0.2), 0.5, 0.5), out.material("lamp", (0, 0, 0), emissive=(12, 11, 10)))
    out.camera((0, 1, 3.6), (0, 1, 0), 42, 1)
    out.save()


def checker(x, y):
    return (235, 235, 235) if (x + y) % 2 else (20, 20, 20)


def motion_defocus(folder):
    """Cards of fine checks: one stands in focus, one before it is blurred by the lens, one behind moves."""
    out = Writer(folder, "motion_defocus")
    picture = out.texture("checks.png", png.rgb(2, 2, checker), nearest=True)
    out.place("room", room((-1, 0, -1), (1, 2, 1.6)), out.material("walls", (0.6, 0.58, 0.55)))
    card = out.material("card", color_texture=picture, double_sided=True)
    def sheet(width, height, checks):
        return quad((-width / 2, -height / 2, 0), (width, 0, 0), (0, height, 0),
                    (checks * width, checks * height))
    out.place("still", sheet(0.7, 0.9, 8), card, at=(0.45, 0.8, 0.2))
    out.place("near", sheet(0.6, 0.6, 12), card, at=(-0.35, 0.5, 0.9))
    out.place("floor", quad((-1, 0.001, 1), (2, 0, 0), (0, 0, -2), (12, 12)), card)
    moving = out.place("moving", sheet(0.7, 0.7, 12), card, at=(-0.7, 1.4, -0.3))
    out.animate(moving, (0, 1), ((-0.7, 1.4, -0.3), (0.1, 1.5, -0.3)))
    out.place("lamp", lamp((0, 1.98, 1.2), 0.5, 0.5), out.material("lamp", (0, 0, 0), emissive=(12, 11, 10)))
    out.camera((0, 1, 3.6), (0, 1, 0), 42, 1)
    out.save()


def defocused_checker(folder):
    """Checks in relief and colour, all far out of focus: normal, albedo and depth of a pixel are noise, its mean is smooth."""
    out = Writer(folder, "defocused_checker")
    out.place("room", room((-1, 0, -1), (1, 2, 1)), out.material("walls", (0.6, 0.58, 0.55)))
    colors = [out.material("tile %d" % i, c) for i, c in enumerate([(0.9, 0.9, 0.9), (0.05, 0.05, 0.08), (0.7, 0.2, 0.1)])]
    tiles = [quad((-0.05, -0.05, 0), (0.1, 0, 0.03 * s), (0, 0.1, 0.03 * t)).without_uvs()
             for s, t in ((1, 1), (-1, 1), (0, -1))]
    for row in range(14):
        for column in range(14):
            out.place("tile", tiles[(row * 2 + column) % 3], colors[(row + column * 2 + row * column) % 3],
                      at=(-0.65 + 0.1 * column, 0.35 + 0.1 * row, -0.5))
    out.place("lamp", lamp((0, 1.98, 0.2), 0.5, 0.5), out.material("lamp", (0, 0, 0), emissive=(12, 11, 10)))
    out.camera((0, 1, 3.6), (0, 1, 0), 36, 1)
    out.save()


def make(folder):
    wires(folder)
    grass(folder)
    cutouts(folder)
    motion_defocus(folder)
    defocused_checker(folder)
