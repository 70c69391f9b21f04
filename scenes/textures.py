"""The room's textures, computed pixel by pixel. All but rug, picture, sky and leaf repeat without a
seam."""

import math
import random

import png


def _hash(x, y, seed):
    h = (x * 374761393 + y * 668265263 + seed * 2147483647) & 0xFFFFFFFF
    h = ((h ^ (h >> 13)) * 1274126177) & 0xFFFFFFFF
    return ((h ^ (h >> 16)) & 0xFFFF) / 65535


def noise(x, y, period_x, period_y, seed):
    """Smooth, 0..1, one random value at each whole number; repeats after the periods."""
    x0, y0 = math.floor(x), math.floor(y)
    fx, fy = x - x0, y - y0
    fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
    a, b = x0 % period_x, (x0 + 1) % period_x
    c, d = y0 % period_y, (y0 + 1) % period_y
    low = _hash(a, c, seed) * (1 - fx) + _hash(b, c, seed) * fx
    high = _hash(a, d, seed) * (1 - fx) + _hash(b, d, seed) * fx
    return low * (1 - fy) + high * fy


def mix(a, b, t):
    return tuple(x + (y - x) * t for x, y in zip(a, b))


def byte(x):
    return max(0, min(255, int(x + 0.5)))


def _color(c):
    return tuple(byte(x) for x in c)


def normals(width, height, at, strength, levels=64):
    """A normal map from a height at(x, y) that repeats; quantised, so that it packs well."""
    step = 256 // levels

    def pixel(x, y):
        dx = (at((x + 1) % width, y) - at((x - 1) % width, y)) * strength
        dy = (at(x, (y + 1) % height) - at(x, (y - 1) % height)) * strength
        length = math.sqrt(dx * dx + dy * dy + 1)
        n = (-dx / length, dy / length, 1 / length)  # v runs down, the bitangent up
        return tuple(byte(128 + step * round(127 * c / step)) for c in n)

    return png.rgb(width, height, pixel)


# --- floor: eight rows of planks along u, two to a row ---

PLANK_ROWS = 8


def _plank(u, v):
    """u, v in 0..1: (number, place along, place across), both places 0..1."""
    row = int(v * PLANK_ROWS) % PLANK_ROWS
    shifted = (u + _hash(row, 5, 11)) % 1.0 * 2
    return row * 2 + int(shifted), shifted % 1.0, v * PLANK_ROWS % 1.0


def _is_gap(along, across, width=0.018):
    return min(across, 1 - across) < width or min(along, 1 - along) < width * 0.13


def floor_color(width=512, height=384):
    tints, shades = 8, 20
    palette = []
    for tint in range(tints):
        base = mix((176, 124, 80), (206, 158, 108), _hash(tint, 1, 3))
        base = mix(base, (166, 106, 64), 0.5 * _hash(tint, 2, 3))
        for shade in range(shades):
            palette.append(_color(c * (0.66 + 0.5 * shade / (shades - 1)) for c in base))
    palette.append((52, 32, 20))

    def pixel(x, y):
        u, v = (x + 0.5) / width, (y + 0.5) / height
        number, along, across = _plank(u, v)
        if _is_gap(along, across):
            return tints * shades
        # Growth rings, cut at a slant: stretched along the plank, other in each one.
        wave = noise(u * 6, v * 24, 6, 24, 20 + number)
        ring = 0.5 + 0.5 * math.sin(2 * math.pi * (across * 3.5 + 1.6 * wave + number * 0.37))
        fibre = noise(u * 24, v * 192, 24, 192, 40 + number)
        tone = 0.48 + 0.26 * (ring - 0.5) + 0.30 * (fibre - 0.5) + 0.3 * (_hash(number, 7, 1) - 0.5)
        tint = int(_hash(number, 3, 9) * tints) % tints
        return tint * shades + max(0, min(shades - 1, int(tone * shades)))

    return png.indexed(width, height, palette, pixel)


def floor_normal(width=256, height=192):
    def at(x, y):
        u, v = (x % width + 0.5) / width, (y % height + 0.5) / height
        number, along, across = _plank(u, v)
        edge = min(min(across, 1 - across), min(along, 1 - along) * 8, 0.10) / 0.10
        return math.sqrt(edge) + 0.25 * noise(u * 8, v * 32, 8, 32, 60 + number)

    return normals(width, height, at, 0.35)


def floor_roughness(width=256, height=192):
    """G = roughness: other in each plank, dull in the gaps, with worn places."""
    palette = [(0, level, 0) for level in range(0, 256, 8)]

    def pixel(x, y):
        u, v = (x + 0.5) / width, (y + 0.5) / height
        number, along, across = _plank(u, v)
        if _is_gap(along, across, 0.03):
            return 28
        worn = noise(u * 5, v * 5, 5, 5, 80)
        return int(9 + 5 * _hash(number, 4, 4) + 7 * worn)

    return png.indexed(width, height, palette, pixel)


# --- cloth, plaster, metal ---


def weave_normal(size=32):
    """Over and under of two threads."""
    def at(x, y):
        u, v = (x % size + 0.5) / size * 2, (y % size + 0.5) / size * 2
        across = (int(u) + int(v)) % 2 == 0
        s, t = (u % 1.0, v % 1.0) if across else (v % 1.0, u % 1.0)
        return math.sin(math.pi * s) * (0.4 + 0.6 * math.sin(math.pi * t))

    return normals(size, size, at, 1.6)


def plaster_normal(size=128):
    def at(x, y):
        u, v = x / size, y / size
        return (noise(u * 9, v * 9, 9, 9, 1) + 0.6 * noise(u * 22, v * 22, 22, 22, 2)
                + 0.25 * noise(u * 50, v * 50, 50, 50, 3))

    return normals(size, size, at, 0.9, 32)


def hammered_normal(width=192, height=64):
    """Dents of a hammer: distance to the nearest of scattered points."""
    random.seed(5)
    columns, rows = 24, 8
    dents = {(i, j): (i + 0.2 + 0.6 * random.random(), j + 0.2 + 0.6 * random.random())
             for j in range(rows) for i in range(columns)}

    def at(x, y):
        u, v = x % width / width * columns, y % height / height * rows
        nearest = 9.0
        for j in range(int(v) - 1, int(v) + 2):
            for i in range(int(u) - 1, int(u) + 2):
                p = dents[(i % columns, j % rows)]
                px, py = p[0] - i % columns + i, p[1] - j % rows + j
                nearest = min(nearest, (px - u) ** 2 + (py - v) ** 2)
        return math.sqrt(nearest)

    return normals(width, height, at, 0.8)


def brushed_roughness(size=128):
    """G = roughness in rings about a lathe body: fine turning marks; B = metal."""
    palette = [(0, level, 255) for level in range(0, 256, 4)]
    random.seed(8)
    ring = [random.random() for _ in range(size)]

    def pixel(x, y):
        smudge = noise(x / size * 6, y / size * 6, 6, 6, 90)
        return byte(30 + 16 * ring[y] + 14 * smudge)

    return png.indexed(size, size, palette, pixel)


# --- pictures ---


def rug_color(width=320, height=224):
    cream, navy, rust, ochre, sage = (
        (222, 208, 184), (44, 58, 84), (166, 76, 48), (204, 150, 70), (120, 134, 110))
    random.seed(4)
    shades = 6
    palette = [_color(c * (0.86 + 0.14 * k / (shades - 1)) for c in base)
               for base in (cream, navy, rust, ochre, sage) for k in range(shades)]

    thread = [int(random.random() * shades) for _ in range(61)]

    def motif(x, y):
        edge = min(x, y, width - 1 - x, height - 1 - y)
        if edge < 5:
            return 0
        if edge < 12:
            return 1
        if edge < 30:  # a border of triangles
            along = x if min(y, height - 1 - y) == edge else y
            return 2 if abs((along % 20) - 10) * 1.6 < edge - 13 else 0
        if edge < 35:
            return 1
        if edge < 38:
            return 3
        # Diamonds in diamonds.
        s, t = (x - width / 2) / 41, (y - height / 2) / 48
        d = abs((s + 0.5) % 1.0 - 0.5) + abs((t + 0.5) % 1.0 - 0.5)
        odd = (math.floor(s + 0.5) + math.floor(t + 0.5)) % 2
        if d < 0.08:
            return 3
        if d < 0.17:
            return 1
        if d < 0.30:
            return 2 if odd else 4
        if d < 0.36:
            return 0
        if d < 0.42:
            return 1
        return 0

    def pixel(x, y):
        return motif(x, y) * shades + thread[(x * 5 + y * 3) % len(thread)]

    return png.indexed(width, height, palette, pixel)


def picture_color(width=288, height=192):
    """Hills in the haze under a low sun."""
    ridges = [(0.50, 0.060, 2.3, (214, 150, 112)), (0.60, 0.075, 1.7, (170, 100, 92)),
              (0.70, 0.080, 2.6, (108, 70, 84)), (0.81, 0.070, 1.9, (58, 52, 74)),
              (0.91, 0.050, 3.1, (30, 34, 54))]
    steps = 24
    palette = [_color(mix((246, 214, 168), (236, 158, 104), k / (steps - 1))) for k in range(steps)]
    palette += [(250, 238, 206)]
    for _, _, _, color in ridges:
        palette += [_color(mix(color, mix(color, (240, 190, 150), 0.35), k / 7)) for k in range(8)]

    def pixel(x, y):
        u, v = (x + 0.5) / width, (y + 0.5) / height
        for i in reversed(range(len(ridges))):
            level, rise, frequency, _ = ridges[i]
            top = level + rise * (math.sin(frequency * 3.1 * u + i * 1.9)
                                  + 0.5 * math.sin(frequency * 7.7 * u + i * 0.7)
                                  + 0.5 * noise(u * 26, i, 26, 99, 7))
            if v > top:
                haze = min(1.0, (v - top) * 6)
                return steps + 1 + i * 8 + int(7.99 * haze)
        if (u - 0.66) ** 2 * 2.25 + (v - 0.34) ** 2 < 0.115 ** 2:
            return steps
        return max(0, min(steps - 1, int(v / 0.62 * steps)))

    return png.indexed(width, height, palette, pixel)


def sky_color(width=240, height=320):
    """Dusk: what the window shines with."""
    steps = 40
    sky = [_color(mix((255, 196, 158), (104, 156, 232), min(1, (k / (steps - 1)) ** 0.55)))
           for k in range(steps)]
    palette = sky + [(46, 58, 96), (74, 90, 136)]

    def pixel(x, y):
        u, v = x / width, 1 - y / height
        if v < 0.20 + 0.05 * noise(u * 18, 1, 18, 9, 1) + 0.03 * math.sin(7 * u):
            return steps
        if v < 0.27 + 0.06 * math.sin(4 * u + 2) + 0.02 * noise(u * 9, 5, 9, 9, 2):
            return steps + 1
        return max(0, min(steps - 1, int((v - 0.2) / 0.8 * steps)))

    return png.indexed(width, height, palette, pixel)


def leaf_color(width=96, height=128):
    """A monstera's leaf, stalk at the bottom: split from the rim towards the midrib."""
    shades = 24
    palette = [_color(mix((20, 58, 28), (92, 142, 58), k / (shades - 1))) + (255,)
               for k in range(shades)]
    palette += [(40, 92, 40, 0)]

    def pixel(x, y):
        s, t = ((x + 0.5) / width - 0.5) * 2, 1 - (y + 0.5) / height
        # Half width at height t: a heart.
        half = 0.96 * math.sin(math.pi * min(1, t) ** 0.62) ** 0.75 * (1 - 0.18 * t)
        distance = abs(s)
        if distance > half or (t < 0.10 and distance < 0.5 * (0.10 - t) / 0.10 and distance > 0.03):
            return shades
        # Slits run outwards and up.
        slope = t - 0.30 * distance
        phase = (slope * 6.5 + (0.5 if s > 0 else 0.0)) % 1.0
        if (0.16 < slope < 0.80 and distance > 0.34 * half
                and abs(phase - 0.5) < 0.13 * distance / half):
            return shades
        vein = min(distance * 14, abs((slope * 6.5 + (0.0 if s > 0 else 0.5)) % 1.0 - 0.5) * 7)
        tone = 0.42 + 0.22 * noise(s * 6 + 9, t * 8, 64, 64, 3) + (0.34 if vein < 0.35 else 0)
        return max(0, min(shades - 1, int(tone * shades)))

    return png.indexed(width, height, palette, pixel)
