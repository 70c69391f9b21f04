"""Three panels that fill a square image, seen from z = 3: what a sampler makes of light that is rarely found.

Left: noise, the same everywhere: a pattern far finer than pixels, of mean 0.55 and relative deviation 0.5 a sample.
Middle: a white matte wall. A lamp is the only thing that lights it, far away behind a pane, so that shadow rays never reach
it: a path finds it with chance p, and then has 0.55 / p. Right: no noise: 0.55.
"""

import math

import png
from gltf import Writer
from shapes import quad

MEAN = 0.55
CHANCES = {"050": 0.05, "020": 0.02, "005": 0.005}
LAMP_AT = 1000.0
# Of the pattern, along each side of the image's third: a whole number a pixel in images of 48 x 48 pixels and small
# multiples.
REPEATS = 128


def chance(half_width):
    """That a direction with the density of the cosine, from a point below its middle, meets a parallel square at
    distance 1."""
    x = half_width / math.sqrt(1 + half_width * half_width)
    return 4 / math.pi * x * math.atan(x)


def half_width_for(p):
    low, high = 0.0, 10.0
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (middle, high) if chance(middle) < p else (low, middle)
    return low


def pattern():
    """Sixteen levels at equal distances, of relative deviation 0.5, as bytes in sRGB."""
    levels = []
    for k in (5, 12, 2, 9, 14, 0, 11, 7, 3, 10, 6, 15, 8, 1, 13, 4):
        linear = MEAN * (1 + 0.5 * math.sqrt(12 / (1 - 1 / 256)) * ((k + 0.5) / 16 - 0.5))
        levels.append(round(255 * (1.055 * linear ** (1 / 2.4) - 0.055)))
    return levels


def make(folder):
    for name, p in CHANCES.items():
        _make(folder, "rare_light_" + name, p)


def _make(folder, name, p):
    out = Writer(folder, name)
    levels = pattern()
    picture = out.texture("pattern.png", png.rgb(4, 4, lambda x, y: (levels[4 * y + x],) * 3), nearest=True)
    # Panels reach beyond the image above and below: its edge shows nothing else.
    def panel(x):
        return quad((x, -2, 0), (1, 0, 0), (0, 4, 0), (REPEATS, 4 * REPEATS))
    out.place("noise", panel(-1.5), out.material("noise", unlit=True, color_texture=picture))
    out.place("wall", panel(-0.5).without_uvs(), out.material("wall", matte=True))
    out.place("still", panel(0.5).without_uvs(), out.material("still", (MEAN,) * 3, unlit=True))

    # The lamp faces the wall, as wide as chance p asks. The pane before it is of its size: from the
    # wall it hides more.
    half = LAMP_AT * half_width_for(p)
    def facing(z):
        return quad((half, -half, z), (-2 * half, 0, 0), (0, 2 * half, 0)).without_uvs()
    out.place("lamp", facing(LAMP_AT), out.material("lamp", (0, 0, 0), emissive=(MEAN / p,) * 3, matte=True))
    out.place("pane", facing(0.9 * LAMP_AT), out.material("pane", roughness=0, pane=True))
    out.camera((0, 0, 3), (0, 0, 0), math.degrees(2 * math.atan(0.5)), 1)
    out.save()
