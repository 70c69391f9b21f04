"""Textures, cut-outs and skies, drawn by numbers. Colour pictures: h x w x 3 of 0..1, sRGB; they tile."""

import numpy as np
from PIL import Image


def _smooth(t):
    return t * t * (3 - 2 * t)


def tiled_noise(rng, height, width, cells_y, cells_x, octaves=1):
    """0..1; periodic."""
    total, norm, weight = np.zeros((height, width)), 0.0, 1.0
    for octave in range(octaves):
        ny, nx = max(1, int(cells_y)) << octave, max(1, int(cells_x)) << octave
        lattice = rng.random((ny, nx))
        y, x = np.arange(height) / height * ny, np.arange(width) / width * nx
        i, j = y.astype(int), x.astype(int)
        t, s = _smooth(y - i)[:, None], _smooth(x - j)[None]
        at = lambda a, b: lattice[np.ix_((i + a) % ny, (j + b) % nx)]
        total += weight * ((1 - t) * ((1 - s) * at(0, 0) + s * at(0, 1))
                           + t * ((1 - s) * at(1, 0) + s * at(1, 1)))
        norm += weight
        weight *= 0.55
    return total / norm


def blend(a, b, t):
    return np.asarray(a, float) * (1 - t[..., None]) + np.asarray(b, float) * t[..., None]


def _axes(n):
    y, x = np.mgrid[0:n, 0:n] / n
    return x, y


def checker(rng, colors, n=256):
    x, y = _axes(n)
    cells = int(rng.choice([2, 4, 8, 16]))
    odd = (np.floor(x * cells) + np.floor(y * cells)) % 2
    return blend(colors[0], colors[1], odd) * (0.9 + 0.1 * tiled_noise(rng, n, n, 8, 8, 3)[..., None])


def stripes(rng, colors, n=256):
    x, y = _axes(n)
    count = int(rng.choice([4, 8, 16, 32, 64]))
    along = [x, y, x + y][int(rng.integers(3))]
    wave = np.sin(2 * np.pi * count * along)
    t = np.clip(wave * rng.choice([1, 6]) * 0.5 + 0.5, 0, 1)
    return blend(colors[0], colors[1], t)


def wood(rng, colors, n=256):
    x, y = _axes(n)
    planks = int(rng.choice([1, 2, 4, 6]))
    number = np.floor(y * planks).astype(int)
    shift = rng.random(planks)[number]
    bend = tiled_noise(rng, n, n, 6 * planks, 2, 2)
    ring = 0.5 + 0.5 * np.sin(2 * np.pi * (y * planks * rng.integers(2, 6) + 1.5 * bend + shift * 9))
    fibre = tiled_noise(rng, n, n, 64, 4, 2)
    t = 0.45 * ring + 0.35 * fibre + 0.3 * shift
    gap = (y * planks) % 1 < 0.03 * (planks > 1)
    base = np.array([0.62, 0.42, 0.26]) * rng.uniform(0.5, 1.3) * rng.uniform(0.85, 1.15, 3)
    return np.where(gap[..., None], 0.12, blend(base * 1.1, base * 0.55, np.clip(t, 0, 1)))


def clouds(rng, colors, n=256):
    cells = int(rng.choice([2, 4, 8, 16]))
    t = tiled_noise(rng, n, n, cells, cells, 5)
    t = np.clip((t - 0.5) * rng.uniform(1.5, 4) + 0.5, 0, 1)
    return blend(colors[0], colors[1], t)


def marble(rng, colors, n=256):
    x, y = _axes(n)
    bend = tiled_noise(rng, n, n, 4, 4, 5)
    vein = np.abs(np.sin(np.pi * (2 * x + 2 * y + 4 * bend))) ** rng.uniform(0.2, 0.7)
    return blend(np.asarray(colors[0]) * 0.4, 0.5 + 0.5 * np.asarray(colors[1]), vein)


def bricks(rng, colors, n=256):
    x, y = _axes(n)
    rows, columns = int(rng.choice([4, 6, 8, 12])), int(rng.choice([2, 3, 4, 6]))
    offset = rng.choice([0, 0.5])
    row = np.floor(y * rows).astype(int)
    u = x * columns + offset * (row % 2)
    column = np.floor(u).astype(int) % columns
    tint = rng.random((rows, columns))[row, column]
    width = rng.uniform(0.02, 0.08)
    joint = (u % 1 < width) | ((y * rows) % 1 < width * rows / columns)
    body = blend(np.asarray(colors[0]) * 0.75, np.asarray(colors[0]) * 1.1, tint)
    body = body * (0.8 + 0.3 * tiled_noise(rng, n, n, 16, 16, 3)[..., None])
    return np.where(joint[..., None], 0.6 * np.asarray(colors[1]) + 0.2, body)


def text(rng, colors, n=256, dark=None):
    """Lines of marks like letters."""
    paper, ink = np.asarray(colors[0]) * 0.3 + 0.65, np.asarray(colors[1]) * 0.3
    if dark if dark is not None else rng.random() < 0.3:
        paper, ink = ink * 0.5, paper
    picture = np.ones((n, n, 3)) * paper
    size = int(rng.choice([6, 8, 12, 20]))
    for top in range(size, n - size, int(size * 1.6)):
        left, end = size, n - size - int(rng.integers(0, n // 3))
        while left < end:
            word = int(rng.integers(2, 9))
            for _ in range(word):
                if left + size > end:
                    break
                glyph = rng.random((3, 3)) < 0.55
                cell = np.kron(glyph, np.ones((max(1, size // 4), max(1, size // 6))))
                h, w = cell.shape
                area = picture[top:top + h, left:left + w]
                area[cell[:area.shape[0], :area.shape[1]] > 0] = ink
                left += w + max(1, size // 6)
            left += size // 2
    return picture


def poster(rng, colors, n=256):
    """Discs, bars and lines of writing."""
    x, y = _axes(n)
    picture = blend(colors[0], colors[1], y * rng.random())
    for _ in range(int(rng.integers(4, 14))):
        color = np.asarray(colors[int(rng.integers(len(colors)))]) * rng.uniform(0.3, 1.2)
        cx, cy, r = rng.random(), rng.random(), rng.uniform(0.04, 0.3)
        kind = int(rng.integers(4))
        if kind == 0:
            inside = (x - cx) ** 2 + (y - cy) ** 2 < r * r
        elif kind == 1:
            inside = (abs(x - cx) < r) & (abs(y - cy) < r * rng.uniform(0.05, 1))
        elif kind == 2:
            inside = abs((x - cx) * rng.normal() + (y - cy) * rng.normal()) < 0.1 * r
        else:
            inside = abs(np.hypot(x - cx, y - cy) - r) < 0.03
        picture[inside] = color
    if rng.random() < 0.5:
        half = n // 2
        picture[half:, :] = picture[half:, :] * 0.2 + 0.8 * text(rng, colors, n)[half:, :]
    return np.clip(picture, 0, 1)


def dots(rng, colors, n=256):
    x, y = _axes(n)
    count = int(rng.choice([4, 8, 16, 32]))
    r = np.hypot((x * count) % 1 - 0.5, (y * count) % 1 - 0.5)
    return blend(colors[0], colors[1], np.clip((rng.uniform(0.2, 0.45) - r) * 12 + 0.5, 0, 1))


def weave(rng, colors, n=256):
    x, y = _axes(n)
    count = int(rng.choice([8, 16, 32, 64]))
    u, v = x * count, y * count
    over = (np.floor(u) + np.floor(v)) % 2 == 0
    shade = np.where(over, np.sin(np.pi * (u % 1)), np.sin(np.pi * (v % 1)))
    plaid = np.where(over, np.sin(2 * np.pi * 2 * x) > 0.3, np.sin(2 * np.pi * 3 * y) > 0.3)
    return blend(colors[0], colors[1], plaid.astype(float)) * (0.45 + 0.55 * shade[..., None])


def cells(rng, colors, n=256):
    """Nearest of scattered points: stones, terrazzo, leather."""
    count = int(rng.choice([20, 60, 200]))
    px, py = rng.random(count), rng.random(count)
    x, y = _axes(n)
    best = np.full((n, n), 9.0)
    second, who = best.copy(), np.zeros((n, n), int)
    for k in range(count):
        dx, dy = np.abs(x - px[k]), np.abs(y - py[k])
        d = np.minimum(dx, 1 - dx) ** 2 + np.minimum(dy, 1 - dy) ** 2
        closer = d < best
        second = np.where(closer, best, np.minimum(second, d))
        who[closer] = k
        best = np.minimum(best, d)
    tint = rng.random(count)[who]
    edge = np.clip((np.sqrt(second) - np.sqrt(best)) * np.sqrt(count) * rng.uniform(3, 12), 0, 1)
    return blend(np.asarray(colors[1]) * 0.5, blend(colors[0], colors[-1], tint), edge)


def speckle(rng, colors, n=128):
    t = (rng.random((n, n)) < rng.uniform(0.05, 0.4)).astype(float)
    return blend(colors[0], colors[1], t)


def windows(rng, colors, n=256, lit=False):
    """A house's front; with `lit`, black but for some windows."""
    rows, columns = int(rng.integers(3, 10)), int(rng.integers(3, 10))
    x, y = _axes(n)
    u, v = (x * columns) % 1, (y * rows) % 1
    i, j = np.floor(y * rows).astype(int), np.floor(x * columns).astype(int)
    a, b = rng.uniform(0.15, 0.35, 2)
    glass = (abs(u - 0.5) < 0.5 - a) & (abs(v - 0.5) < 0.5 - b)
    on = (rng.random((rows, columns)) < 0.35)[i, j] & glass
    tone = rng.uniform(0.3, 1, (rows, columns))[i, j][..., None]
    if lit:
        return np.where(on[..., None], tone * np.array([1, 0.8, 0.5]), 0.0)
    front = np.asarray(colors[0]) * (0.8 + 0.2 * tiled_noise(rng, n, n, 16, 16, 3)[..., None])
    return np.where(glass[..., None], 0.1 + 0.1 * tone, front)


COLOR = [checker, stripes, wood, wood, clouds, clouds, marble, bricks, bricks, text, poster, dots, weave,
         cells, speckle, windows]


def screen(rng, n=256):
    """What a monitor shows."""
    kind = int(rng.integers(3))
    bright = rng.uniform(0.3, 1, (3, 3))
    if kind == 0:
        return text(rng, bright, n, dark=True)
    return poster(rng, bright, n) if kind == 1 else clouds(rng, bright, n)


# --- numbers (grey, linear) and cut-outs ---


def bump(rng, n=256):
    """Heights 0..1."""
    kind = int(rng.integers(6))
    x, y = _axes(n)
    if kind == 0:
        return tiled_noise(rng, n, n, 8, 8, 4)
    if kind == 1:
        return tiled_noise(rng, n, n, 32, 32, 2)
    if kind == 2:
        return np.abs(np.sin(np.pi * x * 16)) * np.abs(np.sin(np.pi * y * 16))
    if kind == 3:
        return tiled_noise(rng, n, n, 64, 2, 2)
    white, black = np.ones(3), np.zeros(3)
    return (bricks if kind == 4 else cells)(rng, [white, black], n)[..., 0]


def rough(rng, n=128):
    cells_ = int(rng.choice([2, 4, 16]))
    low, high = np.sort(rng.uniform(0.02, 0.6, 2))
    t = tiled_noise(rng, n, n, cells_, cells_, 3)
    if rng.random() < 0.3:
        t = (t > 0.5).astype(float)
    return low + (high - low) * t


def cutout(rng, kind, n=128):
    """1 where something is: leaf, leaves, mesh, holes, bars."""
    x, y = _axes(n)
    if kind == "leaf":
        s, t = np.abs(x - 0.5) * 2, 1 - y
        half = np.sin(np.pi * np.clip(t, 0, 1) ** rng.uniform(0.6, 1)) * rng.uniform(0.5, 0.95)
        half = half * (1 - rng.uniform(0, 0.3) * np.abs(np.sin(np.pi * t * rng.integers(4, 12))))
        return ((s < half) | ((s < 0.04) & (t < 0.2))).astype(float)
    if kind == "leaves":
        a = np.zeros((n, n), bool)
        for _ in range(14):
            cx, cy, r, w = rng.uniform(0.15, 0.85), rng.uniform(0.1, 0.9), rng.uniform(0.06, 0.16), rng.random()
            angle = rng.uniform(0, np.pi)
            u = (x - cx) * np.cos(angle) + (y - cy) * np.sin(angle)
            v = (y - cy) * np.cos(angle) - (x - cx) * np.sin(angle)
            a |= (u / r) ** 2 + (v / (r * (0.25 + 0.3 * w))) ** 2 < 1
        return (a | (abs(x - 0.5) < 0.01)).astype(float)
    count = int(rng.choice([4, 8, 16]))
    u, v = (x * count) % 1, (y * count) % 1
    if kind == "mesh":
        w = rng.uniform(0.08, 0.2)
        return ((abs((u + v) % 1 - 0.5) < w) | (abs((u - v) % 1 - 0.5) < w)).astype(float)
    if kind == "holes":
        return (np.hypot(u - 0.5, v - 0.5) > rng.uniform(0.25, 0.42)).astype(float)
    return (u < rng.uniform(0.2, 0.6)).astype(float)


# --- skies: latitude-longitude, linear radiance, +z in the top row ---


def sky(rng, width=512):
    height = width // 2
    phi = (np.arange(width) + 0.5) / width * 2 * np.pi
    theta = (np.arange(height) + 0.5) / height * np.pi
    up = np.cos(theta)[:, None] * np.ones(width)
    d = np.stack([np.sin(theta)[:, None] * np.cos(phi), np.sin(theta)[:, None] * np.sin(phi), up], 2)
    kind = rng.choice(["clear", "clear", "cloudy", "overcast", "dusk", "studio", "night"])
    if kind in ("studio", "night"):
        picture = np.ones((height, width, 3)) * rng.uniform(0.005, 0.1) * rng.uniform(0.6, 1, 3)
        count = int(rng.integers(1, 5)) if kind == "studio" else int(rng.integers(8, 40))
        for _ in range(count):
            size = rng.uniform(0.1, 0.6) if kind == "studio" else rng.uniform(0.015, 0.06)
            v0 = rng.uniform(-0.1, 0.9 if kind == "studio" else 0.4)
            u0 = rng.uniform(0, 2 * np.pi)
            tall = rng.uniform(0.3, 1.5)
            turn = np.abs((phi - u0 + np.pi) % (2 * np.pi) - np.pi)
            inside = (np.abs(np.arcsin(up) - v0) < size * tall) & (turn < size / max(0.2, np.cos(v0)))
            picture[inside] = rng.uniform(1, 20) * (1 - rng.uniform(0, 0.5, 3))
        return picture
    tint = {"clear": (0.25, 0.5, 1.0), "cloudy": (0.35, 0.55, 0.9), "overcast": (0.8, 0.85, 0.9),
            "dusk": (0.3, 0.35, 0.7)}[kind]
    zenith = np.array(tint) * rng.uniform(0.7, 1.3, 3) * 0.6
    horizon = np.array((1, 0.65, 0.4) if kind == "dusk" else (0.8, 0.9, 1.0)) * rng.uniform(0.8, 1.2, 3)
    picture = blend(horizon, zenith, np.clip(up, 0, 1) ** rng.uniform(0.3, 0.7))
    if kind != "clear" or rng.random() < 0.3:
        t = np.clip((tiled_noise(rng, height, width, 4, 6, 5) - rng.uniform(0.3, 0.6)) * 4, 0, 1)
        picture = blend(picture, rng.uniform(0.5, 1.6) * np.ones(3), np.clip(t, 0, 1) * (up > 0)) \
            if kind != "overcast" else picture * (0.6 + 0.5 * t[..., None])
    ground = rng.uniform(0.05, 0.4) * rng.uniform(0.6, 1, 3)
    picture = np.where(up[..., None] < 0, ground, picture)
    if kind != "overcast":  # the sun; its light against the sky's is drawn
        height_angle = rng.uniform(0.03, 0.3) if kind == "dusk" else rng.uniform(0.15, 1.4)
        way = rng.uniform(0, 2 * np.pi)
        to = np.array([np.cos(way) * np.cos(height_angle), np.sin(way) * np.cos(height_angle),
                       np.sin(height_angle)])
        radius = np.radians(rng.choice([0.6, 1, 2, 5, 12]))
        c = d @ to
        glow = np.exp(-(1 - c) / (8 * radius ** 2 + 0.01)) * rng.uniform(0, 1.5)
        warm = np.array([1, 0.55, 0.25]) if kind == "dusk" else np.array([1, 0.93, 0.82])
        picture = picture + glow[..., None] * warm * (up[..., None] > 0)
        solid = np.sin(theta)[:, None] * (np.pi / height) * (2 * np.pi / width) * np.ones(width)
        disc = np.clip((c - np.cos(radius)) / (1 - np.cos(radius)) * 4, 0, 1)
        around = (picture.mean(2) * np.maximum(up, 0) * solid).sum()
        light = (disc * solid).sum()
        if light > 0:
            picture = picture + (disc * around / light * rng.uniform(0.3, 6))[..., None] * warm
    return picture


# --- files ---


def write_png(picture, file_name):
    data = np.uint8(np.clip(np.rint(np.asarray(picture) * 255), 0, 255))
    Image.fromarray(data).save(file_name, compress_level=1)


def write_hdr(picture, file_name):
    """Radiance's RGBE, rows as they are (no run lengths)."""
    picture = np.maximum(np.asarray(picture, float), 0)
    brightest = picture.max(2)
    mantissa, exponent = np.frexp(brightest)
    scale = np.where(brightest > 1e-30, mantissa * 256 / np.maximum(brightest, 1e-30), 0)
    rgbe = np.empty(picture.shape[:2] + (4,), np.uint8)
    rgbe[..., :3] = np.clip(picture * scale[..., None], 0, 255)
    rgbe[..., 3] = np.where(brightest > 1e-30, exponent + 128, 0)
    with open(file_name, "wb") as out:
        out.write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % picture.shape[:2])
        out.write(rgbe.tobytes())
