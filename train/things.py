"""Things that stand about: single objects, furniture, plants, lamps."""

import numpy as np

import meshes as m


def outline(rng):
    """A turned body (vase, bottle, bowl, candlestick) about 1 high."""
    count = int(rng.integers(3, 7))
    radii = rng.uniform(0.08, 0.45, count)
    radii = np.concatenate([[0.001], m.curve_of(radii, 28), [0.001 if rng.random() < 0.6 else radii[-1] * 0.9]])
    heights = np.concatenate([[0], np.linspace(0, 1, 28), [1]])
    return m.lathe(np.maximum(radii, 0.001), heights)


def goblet(rng):
    return m.lathe([0.001, 0.25, 0.25, 0.04, 0.03, 0.05, 0.25, 0.33, 0.3, 0.28, 0.22, 0.02, 0.001],
                   [0, 0, 0.02, 0.05, 0.35, 0.42, 0.55, 0.8, 1, 1, 0.6, 0.47, 0.46], 48)


def knot(rng):
    t = np.linspace(0, 2 * np.pi, 160)
    p, q = [(2, 3), (3, 2), (2, 5), (3, 4)][int(rng.integers(4))]
    r = 0.3 + 0.12 * np.cos(q * t)
    path = np.stack([r * np.cos(p * t), r * np.sin(p * t), 0.18 * np.sin(q * t) + 0.3], 1)
    return m.tube(path, rng.uniform(0.03, 0.07), 12)


def spring(rng):
    turns = rng.integers(3, 9)
    t = np.linspace(0, 1, int(turns) * 24)
    path = np.stack([0.3 * np.cos(2 * np.pi * turns * t), 0.3 * np.sin(2 * np.pi * turns * t), t], 1)
    return m.tube(path, rng.uniform(0.01, 0.04), 8)


def statue(rng):
    """Rounded lumps on top of each other."""
    parts, z = [], 0.0
    for k in range(int(rng.integers(2, 5))):
        r = rng.uniform(0.15, 0.35) * (1 - 0.15 * k)
        parts.append(m.blob(rng, 0.25, 1.5, 3, 48, 32).moved((rng.normal() * 0.05, rng.normal() * 0.05, z + 0.8 * r),
                                                             rng.uniform(0, 6, 3), r))
        z += 1.45 * r
    return m.joined(parts)


def cage(rng):
    parts = []
    count, r = int(rng.integers(5, 14)), rng.uniform(0.006, 0.02)
    for k in range(count):
        a = 2 * np.pi * k / count
        t = np.linspace(-np.pi / 2, np.pi / 2, 20)
        parts.append(m.tube(np.stack([0.4 * np.cos(t) * np.cos(a), 0.4 * np.cos(t) * np.sin(a),
                                      0.4 + 0.4 * np.sin(t)], 1), r, 6))
    for z in (0.2, 0.4, 0.6):
        w = np.sqrt(max(0, 0.16 - (z - 0.4) ** 2))
        parts.append(m.torus(w, r, 40, 6).moved((0, 0, z)))
    return m.joined(parts)


def books(rng):
    parts, z = [], 0.0
    for _ in range(int(rng.integers(2, 6))):
        size = (rng.uniform(0.5, 0.7), rng.uniform(0.35, 0.5), rng.uniform(0.05, 0.14))
        parts.append(m.box(size).moved((0, 0, z), (0, 0, rng.normal() * 0.2)))
        z += size[2] + 0.002
    return m.joined(parts)


def solid(rng):
    """Ball, box, cone, pipe, ring, star, pebble."""
    kind = int(rng.integers(8))
    if kind == 0:
        return m.superellipsoid(nu=48, nv=32).moved((0, 0, 0.4), scale=0.4)
    if kind == 1:
        return m.box(rng.uniform(0.3, 0.9, 3))
    if kind == 2:
        return m.superellipsoid(*rng.uniform(0.1, 0.7, 2), nu=48, nv=32).moved((0, 0, 0.4), scale=0.4)
    if kind == 3:
        return m.lathe([0.001, 0.4, 0.4, 0.001], [0, 0, 0.02, 0.9])
    if kind == 4:
        return m.lathe([0.3, 0.35, 0.35, 0.3, 0.3], [0, 0, 0.7, 0.7, 0], 48)
    if kind == 5:
        return m.torus(0.3, rng.uniform(0.06, 0.14)).moved((0, 0, 0.1 if rng.random() < 0.5 else 0.4),
                                                           (0 if rng.random() < 0.5 else np.pi / 2, 0, 0))
    if kind == 6:
        return m.prism(rng).moved(scale=0.45)
    return m.blob(rng, rng.uniform(0.1, 0.5), rng.uniform(0.8, 3)).moved((0, 0, 0.35), scale=0.35)


def thing(rng):
    """About 1 high and wide."""
    makers = [solid, solid, solid, outline, outline, goblet, knot, spring, statue, cage, books]
    return makers[int(rng.integers(len(makers)))](rng)


def place(scene, looks, mesh, at, size, turn=None, material=None, **more):
    """One thing, `size` of what it measures now, standing at `at`."""
    rng = looks.rng
    material = material or looks.object()
    turn = rng.uniform(0, 2 * np.pi) if turn is None else turn
    if material in looks.glasses and rng.random() < 0.5:
        more["absorption"] = rng.uniform(0, 1, 3) ** 2 * 3 / size
    scene.add(mesh.moved(at, (0, 0, turn), size), material, **more)


def table(rng, width, depth, height):
    thick, leg = rng.uniform(0.02, 0.06), rng.uniform(0.03, 0.08)
    parts = [m.box((width, depth, thick), True).moved((0, 0, height - thick))]
    if rng.random() < 0.75:
        for x in (-1, 1):
            for y in (-1, 1):
                parts.append(m.box((leg, leg, height - thick), True).moved(
                    (x * (width / 2 - leg), y * (depth / 2 - leg), 0)))
    else:
        parts.append(m.lathe([0.25 * depth, 0.25 * depth, leg, leg], [0, 0.03, 0.05, height - thick]))
    for p in parts:
        if p.n is None:
            p.smooth()
    return m.joined(parts)


def chair(rng):
    w, seat, back = rng.uniform(0.4, 0.5), rng.uniform(0.42, 0.48), rng.uniform(0.85, 1.1)
    parts = [m.box((w, w, 0.04)).moved((0, 0, seat))]
    for x in (-1, 1):
        for y in (-1, 1):
            parts.append(m.box((0.035, 0.035, back if y > 0 else seat)).moved((x * w * 0.46, y * w * 0.46, 0)))
    slats = int(rng.integers(1, 6))
    for k in range(slats):
        z = seat + (back - seat) * (k + 1) / (slats + 0.5) - 0.05
        parts.append(m.box((w * 0.9, 0.02, rng.uniform(0.03, 0.1))).moved((0, w * 0.46, z)))
    return m.joined(parts)


def sofa(rng):
    w, d = rng.uniform(1.4, 2.2), rng.uniform(0.75, 0.95)
    parts = [m.superellipsoid(0.25, 0.25, 48, 32).moved((0, 0, 0.3), scale=(w / 2, d / 2, 0.16)),
             m.superellipsoid(0.25, 0.25, 48, 32).moved((0, d * 0.42, 0.5), scale=(w / 2, 0.13, 0.4))]
    for s in (-1, 1):
        parts.append(m.superellipsoid(0.25, 0.25, 48, 32).moved((s * w / 2, 0, 0.35), scale=(0.12, d / 2, 0.28)))
    return m.joined(parts)


def shelf(rng, scene, looks, at, turn, width, height):
    """A rack with small things in it."""
    material, deep, rows = looks.surface(), 0.3, int(rng.integers(2, 6))
    boards = [m.box((width, deep, 0.025), True).moved((0, 0, height * k / rows)) for k in range(rows + 1)]
    boards += [m.box((0.025, deep, height), True).moved((s * width / 2, 0, 0)) for s in (-1, 1)]
    spin = m.rotation(0, 0, turn)
    scene.add(m.joined(boards).moved(at, (0, 0, turn)), material)
    for k in range(rows):
        x, gap = -width / 2 + 0.05, height / rows
        if rng.random() < 0.5:  # books in a row, of three colours
            groups = [[] for _ in range(3)]
            while x < width / 2 - 0.08:
                w, h = rng.uniform(0.015, 0.05), gap * rng.uniform(0.55, 0.85)
                groups[int(rng.integers(3))].append(m.box((w * 0.95, 0.2, h)).moved((x + w / 2, 0, height * k / rows + 0.025)))
                x += w
                if rng.random() < 0.04:
                    x += 0.1
            for group in groups:
                if group:
                    scene.add(m.joined(group).moved(at, (0, 0, turn)), looks.matte())
        else:
            while x < width / 2 - 0.1:
                size = gap * rng.uniform(0.3, 0.7)
                local = np.array([x + size / 2, 0, height * k / rows + 0.025])
                place(scene, looks, thing(rng), spin @ local + np.asarray(at), size)
                x += size + rng.uniform(0.02, 0.2)


def foliage(rng, radius, count, leaf_size, mesh=None, shell=0.5):
    """Leaves in a ball about the origin, turned anyhow."""
    way = m.unit(rng.normal(size=(count, 3)))
    r = radius * (shell + (1 - shell) * rng.random(count)) ** 0.5
    squash = np.array([1, 1, rng.uniform(0.6, 1.1)])
    return m.scattered(mesh or m.leaf(rng.uniform(0.25, 0.7), rng.uniform(-0.3, 0.5)), way * r[:, None] * squash,
                       m.random_turns(rng, count), leaf_size * rng.uniform(0.6, 1.3, count))


def plant(rng, scene, looks, at, height):
    """A pot, stems, leaves."""
    pot = height * rng.uniform(0.2, 0.35)
    place(scene, looks, m.lathe([0.001, 0.32, 0.45, 0.4, 0.38, 0.001], [0, 0, 1, 1, 0.9, 0.85]), at, pot,
          material=looks.coated())
    stems, spots, turns = [], [], []
    for _ in range(int(rng.integers(4, 14))):
        lean = rng.normal(size=2) * 0.35 * height
        t = np.linspace(0, 1, 10)
        tall = (height - pot) * rng.uniform(0.5, 1)
        path = np.stack([lean[0] * t ** 1.6, lean[1] * t ** 1.6, pot * 0.9 + tall * t], 1)
        stems.append(m.tube(path, 0.006 * height, 5))
        for s in rng.uniform(0.3, 1, int(rng.integers(3, 12))):
            spots.append(path[int(s * 9)])
            turns.append(m.rotation(0, 0, rng.uniform(0, 6.3)) @ m.rotation(rng.uniform(-0.6, 0.9), 0, 0))
    leaf = m.leaf(rng.uniform(0.15, 0.7), rng.uniform(-0.5, 0.3))
    leaves = m.scattered(leaf, np.array(spots), np.array(turns), height * rng.uniform(0.12, 0.3) * np.ones(len(spots)))
    scene.add(m.joined(stems).moved(at), looks.green(0))
    scene.add(leaves.moved(at), looks.green())


def tree(rng, scene, looks, at, height, cut=None):
    """A trunk, branches, thousands of leaves; `cut` a cut-out picture's texture for cards."""
    trunk = height * rng.uniform(0.25, 0.5)
    crown = height - trunk
    parts, tops = [], []
    t = np.linspace(0, 1, 8)
    sway = rng.normal(size=2) * 0.08 * height
    parts.append(m.tube(np.stack([sway[0] * t ** 2, sway[1] * t ** 2, trunk * 1.3 * t], 1),
                        height * (0.035 - 0.02 * t), 8))
    for _ in range(int(rng.integers(5, 12))):
        way = m.unit(rng.normal(size=3) + [0, 0, 0.5])
        start = np.array([*sway, 0]) * 0.7 + [0, 0, trunk * rng.uniform(0.8, 1.2)]
        end = np.array([*sway, trunk + crown * 0.45]) + way * crown * rng.uniform(0.25, 0.5)
        bend = start + (end - start) * t[:, None] + np.outer(np.sin(np.pi * t), rng.normal(size=3) * 0.04 * height)
        parts.append(m.tube(bend, height * (0.014 - 0.01 * t), 5))
        tops.append(end)
    scene.add(m.joined(parts).moved(at), looks.matte((3, 6)))
    for top in tops[:8]:
        if cut is not None:
            leaves = foliage(rng, crown * rng.uniform(0.2, 0.35), int(rng.integers(60, 160)), height * 0.09,
                             m.card(), 0.2)
            scene.add(leaves.moved(np.asarray(at) + top), looks.green(), alpha=cut)
        else:
            leaves = foliage(rng, crown * rng.uniform(0.2, 0.35), int(rng.integers(250, 900)), height * 0.035, None, 0.1)
            scene.add(leaves.moved(np.asarray(at) + top), looks.green())


def lamp(rng, scene, looks, at, size, strength):
    """A bulb, a ball, a shaded lamp, a panel or a tube, hanging at `at`."""
    kind = int(rng.integers(5))
    light = looks.warm(strength)
    at = np.asarray(at, float)
    if kind == 0:  # tiny
        r = size * 0.08
        scene.add(m.superellipsoid(nu=12, nv=8).moved(at, scale=r), looks.black, light=light / (r * r * 12))
    elif kind == 1:
        r = size * 0.4
        scene.add(m.superellipsoid(nu=16, nv=10).moved(at, scale=r), looks.black, light=light / (r * r * 12))
    elif kind == 2:
        r = size * 0.12
        scene.add(m.superellipsoid(nu=12, nv=8).moved(at, scale=r), looks.black, light=light / (r * r * 12))
        shade = m.lathe([0.55, 0.35], [-0.3, 0.35], 40).moved(at, scale=size)
        scene.add(shade, looks.sheer() if rng.random() < 0.6 else looks.matte())
    elif kind == 3:
        w, d = size * rng.uniform(0.5, 1.5, 2)
        panel = m.quad(at + [-w / 2, d / 2, 0], (w, 0, 0), (0, -d, 0))
        scene.add(panel, looks.black, light=light / (w * d * 3))
    else:
        w = size * rng.uniform(1, 2.5)
        tube = m.tube(at + np.linspace(-w / 2, w / 2, 3)[:, None] * [[1, 0, 0]], 0.015, 8)
        scene.add(tube, looks.black, light=light / (w * 0.015 * 20))
