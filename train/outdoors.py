"""Layouts under a sky, and things so fine or odd that they need no room."""

import numpy as np

import meshes as m
import pictures
import things
from indoors import _lens


def _sky(scene, looks):
    rng = looks.rng
    scene.environment(pictures.sky(rng))
    if rng.random() < 0.1:
        a, high = rng.uniform(0, 6.3), rng.uniform(0.2, 1.3)
        scene.distant(-np.array([np.cos(a) * np.cos(high), np.sin(a) * np.cos(high), np.sin(high)]), looks.warm(rng.uniform(1, 5)))


def landscape(scene, looks):
    """Uneven ground, trees, rocks, grass, a fence, a hut."""
    rng = looks.rng
    ground, level = m.terrain(rng, 60, rng.uniform(0.3, 3), 110, rng.uniform(0.03, 0.15))
    r = rng.uniform(0.3, 1)
    scene.add(ground, looks.green(0) if rng.random() < 0.35 else looks.matte((r, r), True))
    _sky(scene, looks)
    on = lambda x, y: np.array([x, y, level(x, y)[0]])
    cut = scene.numbers(pictures.cutout(rng, "leaves" if rng.random() < 0.6 else "leaf")) if rng.random() < 0.6 else None
    for _ in range(int(rng.integers(1, 6))):
        things.tree(rng, scene, looks, on(rng.uniform(-7, 7), rng.uniform(2, 16)), rng.uniform(2.5, 7),
                    cut if rng.random() < 0.6 else None)
    stone = looks.surface()
    for _ in range(int(rng.integers(3, 20))):
        at, size = on(rng.uniform(-6, 6), rng.uniform(-3, 12)), rng.uniform(0.1, 1.2)
        rock = m.blob(rng, 0.35, rng.uniform(0.8, 2), 4, 40, 26).moved((0, 0, 0.1), rng.uniform(0, 6, 3), rng.uniform(0.6, 1.2, 3))
        things.place(scene, looks, rock, at, size, material=stone if rng.random() < 0.7 else looks.surface())
    if rng.random() < 0.7:  # grass
        count = int(rng.integers(800, 5000))
        at = np.stack([rng.uniform(-3, 3, count), rng.uniform(-5, 4, count)], 1)
        at = np.concatenate([at, level(at[:, 0], at[:, 1])[:, None]], 1)
        blades = m.scattered(m.blade(rng.uniform(0.02, 0.08), rng.uniform(0, 0.8)), at, m.random_turns(rng, count, 0.4),
                             rng.uniform(0.1, 0.5) * rng.uniform(0.5, 1.2, count))
        scene.add(blades, looks.green())
    if rng.random() < 0.4:  # a fence
        posts, y = [], rng.uniform(0, 5)
        for x in np.arange(-8, 8, rng.uniform(0.12, 0.6)):
            posts.append(m.box((0.06, 0.03, 1.1)).moved(on(x, y) - [0, 0, 0.1]))
        for z in (0.3, 0.8):
            line = np.linspace(-8, 8, 40)
            path = np.stack([line, line * 0 + y, level(line, line * 0 + y) + z], 1)
            posts.append(m.tube(path, 0.015, 5))
        scene.add(m.joined(posts), looks.matte())
    if rng.random() < 0.4:
        at, size = on(rng.uniform(-5, 5), rng.uniform(6, 12)), rng.uniform(1.5, 3)
        scene.add(m.box((size * 1.5, size, size)).moved(at - [0, 0, 0.3]), looks.surface((2, 2)))
        roof = m.Mesh([(-1, -0.65, 0), (1, -0.65, 0), (1, 0.65, 0), (-1, 0.65, 0), (-1, 0, 0.6), (1, 0, 0.6)],
                      [[0, 1, 5], [0, 5, 4], [2, 3, 4], [2, 4, 5], [1, 2, 5], [3, 0, 4]],
                      [[0, 0], [2, 0], [2, 0], [0, 0], [0, 1], [2, 1]])
        scene.add(roof.moved(at + [0, 0, size - 0.3], scale=size * 0.85), looks.surface((3, 3)))
    for _ in range(int(rng.integers(0, 4))):
        things.place(scene, looks, things.thing(rng), on(rng.uniform(-2, 2), rng.uniform(-3, 2)), rng.uniform(0.5, 1.2))
    eye = on(rng.uniform(-2, 2), rng.uniform(-8, -5)) + [0, 0, rng.uniform(0.5, 3)]
    target = on(rng.uniform(-1.5, 1.5), rng.uniform(0, 5)) + [0, 0, rng.uniform(0.3, 1.5)]
    scene.camera(eye, target, rng.uniform(30, 60), **_lens(rng, eye, target))


def bush(scene, looks):
    """Leaves near the camera, cut out or of triangles, lit from anywhere, mostly with a lens."""
    rng = looks.rng
    scene.add(m.quad((-20, -20, 0), (40, 0, 0), (0, 40, 0), (30, 30)), looks.surface())
    _sky(scene, looks)
    for _ in range(int(rng.integers(2, 7))):
        at = np.array([rng.uniform(-1, 1), rng.uniform(-0.4, 2.5), rng.uniform(0.2, 1)])
        count, size = int(rng.integers(80, 1200)), 10 ** rng.uniform(-1.3, -0.5)
        if rng.random() < 0.5:
            cut = scene.numbers(pictures.cutout(rng, rng.choice(["leaf", "leaves"])))
            mesh, alpha = m.card(rng.uniform(0.4, 1)), cut
        else:
            mesh, alpha = None, None
        scene.add(things.foliage(rng, rng.uniform(0.3, 0.8), count, size, mesh, 0.2).moved(at), looks.green(), alpha=alpha,
                  move=tuple(rng.normal(size=3) * 0.02) if rng.random() < 0.15 else None)
    for _ in range(int(rng.integers(3, 20))):  # twigs
        t = np.linspace(0, 1, 10)[:, None]
        start = np.array([*rng.uniform(-1, 1, 2), 0])
        way = rng.normal(size=3) * [0.5, 0.5, 0.2] + [0, 0, 1.2]
        scene.add(m.tube(start + way * t + 0.2 * np.sin(3 * t) * rng.normal(size=3), 0.004 + 0.015 * (1 - t[:, 0]), 6), looks.matte((1, 5)))
    for _ in range(int(rng.integers(0, 12))):  # fruit
        at = rng.uniform([-0.8, -0.6, 0.2], [0.8, 1.5, 1.2])
        scene.add(m.superellipsoid(nu=24, nv=16).moved(at, scale=rng.uniform(0.02, 0.12)), looks.coated())
    eye = np.array([rng.uniform(-1, 1), rng.uniform(-2.4, -1.2), rng.uniform(0.2, 1.4)])
    target = np.array([0, 0.3, 0.55])
    lens = _lens(rng, eye, target)
    if not lens and rng.random() < 0.4:
        lens = {"lens": 0.03, "focus": 1.7}
    scene.camera(eye, target, rng.uniform(25, 50), **lens)


def street(scene, looks):
    """Blocks with windows, steps, posts, wires; by day, or at night with windows that shine."""
    rng = looks.rng
    night = rng.random() < 0.35
    width = rng.uniform(4, 10)
    scene.add(m.quad((-40, -10, 0), (80, 0, 0), (0, 90, 0), (40, 45)), looks.surface((2, 2)))
    scene.max_depth = 5
    if night:
        scene.glow(np.array([0.4, 0.55, 1]) * rng.uniform(0.002, 0.02))
    else:
        _sky(scene, looks)
    for side in (-1, 1):
        y = -4.0
        while y < 40:
            d, w, h = rng.uniform(4, 10), rng.uniform(4, 8), rng.uniform(3, 14)
            x = side * (width / 2 + w / 2 + rng.uniform(0, 0.7))
            n = float(rng.integers(1, 3))
            material = scene.material("diffuse", reflectance=scene.color(looks.picture(
                pictures.windows if rng.random() < 0.75 else pictures.bricks), (n, n)))
            scene.add(m.box((w, d, h)).moved((x, y + d / 2, 0)), material)
            if night and rng.random() < 0.8:
                lit = pictures.windows(rng, looks.two_colors(), lit=True)
                xs = x - side * (w / 2 + 0.02)
                face = m.quad((xs, y + (d if side > 0 else 0), 0.3), (0, -d * side, 0), (0, 0, h - 0.3))
                scene.add(face, looks.black, light=np.ones(3) * rng.uniform(0.3, 3), light_picture=lit)
            for z in (h, h * rng.uniform(0.3, 0.6)):
                scene.add(m.box((w + 0.3, d + 0.1, 0.15)).moved((x, y + d / 2, z)), looks.matte(texture=False))
            y += d + (rng.uniform(0, 3) if rng.random() < 0.3 else 0)
    for y in np.arange(0, 25, rng.uniform(3, 8)):
        x = (width / 2 - 0.4) * rng.choice([-1, 1])
        scene.add(m.lathe([0.08, 0.05, 0.04, 0.04], [0, 0.5, 3, 3.5], 10).moved((x, y, 0)), looks.metal())
        if rng.random() < 0.7:
            ball = m.superellipsoid(nu=12, nv=8).moved((x, y, 3.65), scale=0.16)
            if night:
                scene.add(ball, looks.black, light=looks.warm(rng.uniform(5, 60)))
            else:
                scene.add(ball, looks.coated(texture=False))
    for _ in range(int(rng.integers(0, 8))):  # wires across
        y, z = rng.uniform(1, 20), rng.uniform(3, 7)
        t = np.linspace(-1, 1, 24)
        scene.add(m.tube(np.stack([t * width / 2, t * 0 + y, z + 0.4 * t * t], 1), 0.012, 5), looks.black)
    for _ in range(int(rng.integers(2, 9))):
        at = (rng.uniform(-0.45, 0.45) * width, rng.uniform(0, 15), 0)
        more = {"move": (0, rng.uniform(-0.5, 0.5), 0)} if rng.random() < 0.2 else {}
        things.place(scene, looks, things.thing(rng), at, rng.uniform(0.4, 1.5), **more)
    if rng.random() < 0.5:
        things.tree(rng, scene, looks, (rng.choice([-1, 1]) * width * 0.35, rng.uniform(4, 12), 0), rng.uniform(3, 6))
    eye = np.array([rng.uniform(-0.3, 0.3) * width, -3, rng.uniform(0.6, 3)])
    target = np.array([rng.uniform(-0.4, 0.4) * width, 10, rng.uniform(0.5, 3.5)])
    scene.camera(eye, target, rng.uniform(40, 70), **_lens(rng, eye, target))


def thin(scene, looks):
    """Wires, nets, cages, hair, slats: finer than pixels."""
    rng = looks.rng
    scene.add(m.quad((-6, -6, 0), (12, 0, 0), (0, 12, 0), (6, 6)), looks.surface())
    if rng.random() < 0.5:
        scene.add(m.quad((-6, 2, 0), (12, 0, 0), (0, 0, 5), (6, 2.5)), looks.wall())
    for _ in range(int(rng.integers(2, 7))):
        at = np.array([rng.normal() * 0.8, rng.uniform(-0.6, 1.4), 0])
        kind = int(rng.integers(6))
        if kind == 0:
            things.place(scene, looks, things.cage(rng), at, rng.uniform(0.5, 1.2), material=looks.metal())
        elif kind == 1:  # a net
            cut = scene.numbers(pictures.cutout(rng, rng.choice(["mesh", "holes", "bars"])), (3, 3))
            cloth = m.sheet(rng, rng.uniform(0.8, 2), rng.uniform(0.8, 1.6), 2, 0.15)
            scene.add(cloth.moved(at, (0, 0, rng.normal() * 0.5)), looks.matte(), alpha=cut)
        elif kind == 2:  # a ball of hair
            count = int(rng.integers(400, 2000))
            way = m.unit(rng.normal(size=(count, 3)))
            hair = m.blade(rng.uniform(0.01, 0.04), rng.uniform(0, 1))
            turns = np.stack([np.cross(way, rng.normal(size=3)), np.zeros_like(way), way], 2)
            turns[:, :, 0] = m.unit(turns[:, :, 0])
            turns[:, :, 1] = np.cross(way, turns[:, :, 0])
            mesh = m.scattered(hair, way * 0.3, turns, rng.uniform(0.1, 0.3) * np.ones(count))
            scene.add(mesh.moved(at + [0, 0, 0.5]), looks.matte(texture=False))
            scene.add(m.superellipsoid(nu=32, nv=20).moved(at + [0, 0, 0.5], scale=0.3), looks.matte())
        elif kind == 3:  # strings
            strings = []
            for k in range(int(rng.integers(10, 60))):
                a, b = rng.normal(size=3) * [0.6, 0.3, 0.1] + [0, 0, 0.05], rng.normal(size=3) * [0.6, 0.3, 0.1] + [0, 0, 1.5]
                t = np.linspace(0, 1, 12)[:, None]
                strings.append(m.tube(a + (b - a) * t + 0.1 * t * (1 - t) * rng.normal(size=3), 10 ** rng.uniform(-3, -2), 5))
            scene.add(m.joined(strings).moved(at), looks.object())
        elif kind == 4:  # slats
            slats = [m.box((1.2, 0.01, 0.03)).moved((0, 0, 0.05 * k)) for k in range(int(rng.integers(10, 30)))]
            scene.add(m.joined(slats).moved(at, (0, 0, rng.normal() * 0.6)), looks.surface())
        else:  # grass
            count = int(rng.integers(300, 3000))
            spots = np.concatenate([rng.normal(size=(count, 2)) * 0.4, np.zeros((count, 1))], 1)
            scene.add(m.scattered(m.blade(0.03, 0.6), spots, m.random_turns(rng, count, 0.4),
                                  rng.uniform(0.2, 0.6) * rng.uniform(0.5, 1, count)).moved(at), looks.green())
    for _ in range(int(rng.integers(1, 4))):
        things.place(scene, looks, things.thing(rng), (rng.normal() * 0.8, rng.uniform(-0.5, 1), 0), rng.uniform(0.3, 0.7))
    if rng.random() < 0.6:
        scene.environment(pictures.sky(rng))
    else:
        scene.glow(looks.warm(rng.uniform(0.02, 0.3)))
        for _ in range(int(rng.integers(1, 4))):
            things.lamp(rng, scene, looks, (*rng.uniform(-1.5, 1, 2), rng.uniform(1.5, 3)), rng.uniform(0.1, 0.8), 6)
    eye = np.array([rng.uniform(-1.5, 1.5), rng.uniform(-3, -1.8), rng.uniform(0.3, 1.6)])
    target = np.array([0, 0.2, rng.uniform(0.3, 0.7)])
    scene.camera(eye, target, rng.uniform(28, 50), **_lens(rng, eye, target))


def shapes(scene, looks):
    """Bodies that fill space, with noise on them, under a sky or lamps among them."""
    rng = looks.rng
    if rng.random() < 0.6:
        ground, _ = m.terrain(rng, 24, rng.uniform(0.1, 1.2), 90, rng.uniform(0.2, 1))
        scene.add(ground.moved((0, 0, -1.6)), looks.surface((0.3, 0.3)))
    if rng.random() < 0.4:
        scene.add(m.quad((-12, 5, -4), (24, 0, 0), (0, 0, 14), (12, 7)), looks.wall())
    count = int(rng.integers(5, 40))
    for _ in range(count):
        at = rng.normal(size=3) * [1.4, 1.4, 0.8]
        size = 1.6 * rng.uniform(0.3, 1) / count ** 0.4
        r = rng.random()
        if r < 0.4:
            mesh = m.blob(rng, rng.uniform(0.05, 0.6), rng.uniform(0.7, 5), int(rng.integers(1, 5)))
        elif r < 0.75:
            mesh = m.superellipsoid(*rng.uniform(0.05, 2, 2), nu=56, nv=36).smooth()
        else:
            mesh = m.torus(1, rng.uniform(0.1, 0.4))
        scene.add(mesh.moved(at, rng.uniform(0, 6, 3), size * rng.uniform(0.5, 1.2, 3)), looks.object(),
                  move=tuple(rng.normal(size=3) * 0.1) if rng.random() < 0.05 else None)
    lamps = int(rng.integers(0, 5))
    if rng.random() < 0.7 or not lamps:
        scene.environment(pictures.sky(rng))
    for _ in range(lamps):
        things.lamp(rng, scene, looks, rng.normal(size=3) * [1.6, 1.6, 0.8] + [0, -0.5, 1], rng.uniform(0.1, 0.7), rng.uniform(0.5, 5))
    a, high = rng.uniform(-2.6, -0.6), rng.uniform(-0.1, 0.8)
    eye = np.array([np.cos(a) * np.cos(high), np.sin(a) * np.cos(high), np.sin(high)]) * rng.uniform(3.5, 5.5)
    scene.camera(eye, rng.normal(size=3) * 0.2, rng.uniform(28, 50), **_lens(rng, eye, (0, 0, 0)))
