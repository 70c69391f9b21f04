"""Layouts inside: each function fills a scene by chance and sets its camera."""

import numpy as np

import meshes as m
import pictures
import things


def _lens(rng, eye, target):
    """A pinhole mostly; else a lens focused at the target or anywhere."""
    if rng.random() > 0.25:
        return {}
    distance = np.linalg.norm(np.asarray(target, float) - eye)
    return {"lens": distance * 10 ** rng.uniform(-2.3, -1.1), "focus": distance * rng.uniform(0.6, 1.5)}


def _window(scene, looks, corner, u, v, inward):
    """A frame with bars, a pane seldom, blinds or a curtain sometimes, in a hole of a wall."""
    rng = looks.rng
    corner, u, v, inward = (np.asarray(x, float) for x in (corner, u, v, inward))
    w, h = np.linalg.norm(u), np.linalg.norm(v)
    du = u / w
    turn = np.arctan2(du[1], du[0])
    bars = [m.box((0.05, 0.08, h)).moved((x, 0, 0)) for x in np.linspace(0, w, int(rng.integers(2, 5)))]
    bars += [m.box((w, 0.07, 0.05)).moved((w / 2, 0, z)) for z in np.linspace(0, h - 0.05, int(rng.integers(2, 4)))]
    scene.add(m.joined(bars).moved(corner, (0, 0, turn)), looks.coated(texture=False))
    middle = corner + u / 2
    if rng.random() < 0.3:
        scene.add(m.quad(corner, u, v), looks.thin_glass())
    r = rng.random()
    if r < 0.25:  # blinds
        count, tilt = int(h / 0.06), rng.uniform(0, 1.2)
        slat = m.quad((-w / 2, -0.025, 0), (w, 0, 0), (0, 0.05, 0)).moved(turn=(tilt, 0, 0))
        slats = m.joined([slat.moved((0, 0, 0.06 * k)) for k in range(count)])
        scene.add(slats.moved(middle + inward * 0.1, (0, 0, turn)), looks.matte(texture=False))
    elif r < 0.6:
        material = looks.sheer() if rng.random() < 0.6 else looks.matte()
        for s in (-1, 1):
            cloth = m.sheet(rng, w * rng.uniform(0.25, 0.5), h * 1.15, int(rng.integers(4, 9)))
            scene.add(cloth.moved(middle + du * s * w * 0.4 + inward * 0.15 + [0, 0, -0.1 * h], (0, 0, turn)), material)


def _outside(scene, looks):
    rng = looks.rng
    if rng.random() < 0.75:
        scene.environment(pictures.sky(rng), rng.uniform(2, 12))
    else:
        scene.glow(looks.warm(rng.uniform(1, 8)))


def _panels(scene, looks, corner, u, inward, holes, back, strength):
    """Behind each hole of a wall a rectangle that shines in, like a white sky: found by rays to lights."""
    du, inward = m.unit(u), np.asarray(inward, float)
    light = looks.warm(strength)
    for a, low, b, high in holes:
        at = np.asarray(corner, float) + du * (b + back / 2) + [0, 0, low] - inward * back
        scene.add(m.quad(at, -du * (b - a + back), (0, 0, high - low)), looks.black, light=light)


def room(scene, looks):
    """Walls, floor, windows, furniture, lamps; the camera stands in a corner."""
    rng = looks.rng
    w, d, h = rng.uniform(3, 7), rng.uniform(3, 7), rng.uniform(2.3, 3.4)
    scene.max_depth = int(rng.integers(6, 9))
    by_day = rng.random() < 0.6
    holes = {k: [] for k in range(4)}  # of the walls y=0, x=w, y=d, x=0
    lengths = (w, d, w, d)
    eye_side = rng.uniform(0.05, 0.3)
    if by_day or rng.random() < 0.4:
        for k in rng.permutation(4)[:int(rng.integers(1, 3))]:
            width = rng.uniform(0.3, 0.8) * lengths[k]
            a = rng.uniform(0.1, max(0.11, lengths[k] - width - 0.1))
            low = rng.choice([0.05, 0.8, 1.2])
            holes[k].append((a, low, min(a + width, lengths[k] - 0.05), min(h - 0.15, low + rng.uniform(0.7, 1.6))))
    corners = [((0, 0, 0), (w, 0, 0), (0, 1, 0)), ((w, 0, 0), (0, d, 0), (-1, 0, 0)),
               ((w, d, 0), (-w, 0, 0), (0, -1, 0)), ((0, d, 0), (0, -d, 0), (1, 0, 0))]
    paint, bright, white = looks.wall(), rng.uniform(2, 12), rng.random() < 0.45
    for k, (corner, u, inward) in enumerate(corners):
        if white:
            _panels(scene, looks, corner, u, inward, holes[k], 0.1, bright)
        scene.add(m.wall(corner, u, (0, 0, h), holes[k]), paint if rng.random() < 0.75 else looks.wall())
        du = m.unit(u)
        for hole in holes[k]:
            _window(scene, looks, np.asarray(corner) + du * hole[0] + np.array([0, 0, hole[1]]),
                    du * (hole[2] - hole[0]), (0, 0, hole[3] - hole[1]), inward)
        if not holes[k] and rng.random() < 0.7:  # pictures
            for _ in range(int(rng.integers(1, 4))):
                pw, ph = rng.uniform(0.3, 1.2, 2)
                a = rng.uniform(0.2, lengths[k] - pw - 0.2) if lengths[k] > pw + 0.4 else 0.2
                z = rng.uniform(1.0, max(1.1, h - ph - 0.2))
                at = np.asarray(corner) + du * a + np.array([0, 0, z]) + 0.02 * np.asarray(inward)
                picture = scene.color(looks.picture(pictures.poster if rng.random() < 0.6 else pictures.text))
                kind = "coateddiffuse" if rng.random() < 0.5 else "diffuse"
                # (wall's u x up points out of the room: the picture is turned)
                scene.add(m.quad(at, du * pw, (0, 0, ph)), scene.material(kind, reflectance=picture))
    if any(holes.values()) and not white:
        _outside(scene, looks)
    r = float(rng.choice([0.4, 0.7, 1]))
    scene.add(m.quad((0, 0, 0), (w, 0, 0), (0, d, 0), (w, d)), looks.surface((r, r)))
    scene.add(m.quad((0, 0, h), (0, d, 0), (w, 0, 0), (d, w)),
              scene.material("diffuse", reflectance=(0.7 * np.ones(3) * rng.uniform(0.6, 1.2)).clip(0, 0.85)))
    if rng.random() < 0.5:
        scene.add(m.box((w * rng.uniform(0.3, 0.7), d * rng.uniform(0.3, 0.7), 0.012)).moved((w / 2, d / 2, 0)),
                  looks.matte(texture=True))
    eye = np.array([w * eye_side, d * eye_side, rng.uniform(0.9, min(2.2, h - 0.2))])
    flip = rng.random(2) < 0.5
    middle = np.array([w, d]) * rng.uniform(0.4, 0.7, 2)
    if flip[0]:
        eye[0], middle[0] = w - eye[0], w - middle[0]
    if flip[1]:
        eye[1], middle[1] = d - eye[1], d - middle[1]
    # Furniture about the middle.
    top = rng.uniform(0.4, 0.8)
    size = rng.uniform(0.8, 1.8), rng.uniform(0.6, 1.1)
    scene.add(things.table(rng, *size, top).moved((*middle, 0), (0, 0, rng.uniform(0, 0.4))), looks.surface())
    for _ in range(int(rng.integers(2, 9))):
        at = (*(middle + (rng.random(2) - 0.5) * np.array(size) * 0.8), top)
        things.place(scene, looks, things.thing(rng), at, rng.uniform(0.1, 0.35))
    if rng.random() < 0.5:
        seat, material = things.chair(rng), looks.surface()
        for _ in range(int(rng.integers(1, 5))):
            a = rng.uniform(0, 6.3)
            at = middle + 0.9 * np.array([np.cos(a), np.sin(a)]) * np.array(size)
            if np.linalg.norm(at - eye[:2]) > 0.8:
                things.place(scene, looks, seat, (*at.clip(0.3, [w - 0.3, d - 0.3]), 0), 1, a - np.pi / 2, material)
    far = np.array([w, d]) - eye[:2]
    if rng.random() < 0.6:
        things.place(scene, looks, things.sofa(rng), (*far.clip(0.9, [w - 0.9, d - 0.9]), 0), 1,
                     np.pi / 2 * int(rng.integers(4)), looks.matte())
    if rng.random() < 0.5:
        x = 0.16 if eye[0] > w / 2 else w - 0.16
        things.shelf(rng, scene, looks, (x, d / 2, 0), np.pi / 2, rng.uniform(0.8, 1.8), rng.uniform(1, h - 0.4))
    if rng.random() < 0.6:
        things.plant(rng, scene, looks, (*far.clip(0.5, [w - 0.5, d - 0.5]), 0), rng.uniform(0.6, 1.5))
    if not by_day or rng.random() < 0.4:
        for _ in range(int(rng.integers(1, 4))):
            at = (rng.uniform(0.2, 0.8) * w, rng.uniform(0.2, 0.8) * d, rng.choice([h - 0.02, h - 0.7, 1.4]))
            things.lamp(rng, scene, looks, at, rng.uniform(0.15, 0.5), rng.uniform(2, 30))
    target = np.array([*middle, rng.uniform(0.3, 1.2)])
    scene.camera(eye, target, rng.uniform(35, 75), **_lens(rng, eye, target))


def still_life(scene, looks):
    """Things on a table or a bent backdrop, few lamps of any size or a sky."""
    rng = looks.rng
    count = int(rng.integers(3, 11))
    spread = 0.28 * np.sqrt(count)
    if rng.random() < 0.5:
        radius, deep = 0.8, 3.0

        def backdrop(u, v):
            s = v * (deep + radius * np.pi / 2 + 3)
            a = np.clip((s - deep) / radius, 0, np.pi / 2)
            y = -deep + spread + np.minimum(s, deep) + radius * np.sin(a)
            z = radius * (1 - np.cos(a)) + np.maximum(0, s - deep - radius * np.pi / 2)
            return np.stack([(u - 0.5) * 8, y + 0.5, z], 1)

        mesh = m.grid(backdrop, 4, 80)
        scene.add(mesh, looks.surface((6, 6)))
        turned = False
    else:
        scene.add(m.quad((-4, -4, 0), (8, 0, 0), (0, 8, 0), (8, 8)), looks.surface())
        turned = True
        if rng.random() < 0.5:
            scene.add(m.quad((-4, spread + 0.8, 0), (8, 0, 0), (0, 0, 4), (8, 4)), looks.wall())
            turned = False
    spots = []
    for _ in range(count * 6):
        at = rng.normal(size=2) * spread * 0.55
        if all(np.linalg.norm(at - s) > 0.3 for s in spots) and len(spots) < count:
            spots.append(at)
    for at in spots:
        more = {}
        if rng.random() < 0.06:
            more = {"move": tuple(rng.normal(size=2) * 0.1) + (0,), "turn": rng.uniform(-60, 60)}
        things.place(scene, looks, things.thing(rng), (*at, 0), rng.uniform(0.2, 0.6), **more)
    if rng.random() < 0.25:
        for _ in range(int(rng.integers(20, 80))):
            at = rng.normal(size=2) * spread
            scene.add(things.solid(rng).moved((*at, 0), (0, 0, rng.uniform(0, 6)), rng.uniform(0.03, 0.08)),
                      looks.object())
    r = rng.random()
    if r < 0.45:
        scene.environment(pictures.sky(rng))
    elif r < 0.6:
        scene.glow(looks.warm(rng.uniform(0.05, 0.5)))
    if r > 0.35:
        for _ in range(int(rng.integers(1, 4))):
            a, high, far = rng.uniform(np.pi * 0.8, np.pi * 2.2), rng.uniform(0.25, 1.4), rng.uniform(1, 3.5)
            way = np.array([np.cos(a) * np.cos(high), np.sin(a) * np.cos(high), np.sin(high)])
            size = far * 10 ** rng.uniform(-1.7, 0)
            x = m.unit(np.cross(way, [0, 0, 1]))
            y = np.cross(x, way)
            light = looks.warm(rng.uniform(2, 8)) * far ** 2 / size ** 2 / 3
            scene.add(m.quad(way * far - (x + y) * size / 2, y * size, x * size), looks.black, light=light)
    a = rng.uniform(0, 6.3) if turned else rng.uniform(-2.2, -0.9)
    high = rng.uniform(0.1, 0.9)
    eye = np.array([np.cos(a) * np.cos(high), np.sin(a) * np.cos(high), np.sin(high)]) * spread * rng.uniform(1.6, 3.2)
    eye[2] += 0.2
    target = np.array([0, 0, 0.2]) + rng.normal(size=3) * 0.1
    scene.camera(eye, target, rng.uniform(25, 50), **_lens(rng, eye, target))


def corridor(scene, looks):
    """Columns and niches in a long hall; light through a door, slits, or from strips behind ledges."""
    rng = looks.rng
    w, length, h = rng.uniform(2, 5), rng.uniform(8, 16), rng.uniform(2.5, 5)
    scene.max_depth = int(rng.integers(7, 11))
    side, paint = looks.wall(), looks.wall()
    kind = rng.choice(["slits", "door", "strips"])
    holes = []
    if kind == "slits":
        step, wide = rng.uniform(1.3, 3), rng.uniform(0.3, 1.2)
        holes = [(y, rng.choice([0.3, 1.2]), y + wide, h - 0.3) for y in np.arange(0.5, length - 1, step)]
    scene.add(m.wall((0, length, 0), (0, -length, 0), (0, 0, h), holes), side)
    door = [(length * rng.uniform(0.4, 0.8), 0.0, 0, 2.1)] if kind == "door" else []
    door = [(a, 0.0, a + rng.uniform(0.6, 1.6), t) for a, _, _, t in door]
    scene.add(m.wall((w, 0, 0), (0, length, 0), (0, 0, h), door), side)
    scene.add(m.wall((w, length, 0), (-w, 0, 0), (0, 0, h)), paint)
    scene.add(m.wall((0, 0, 0), (w, 0, 0), (0, 0, h)), paint)
    r = float(rng.choice([0.5, 1, 2]))
    scene.add(m.quad((0, 0, 0), (w, 0, 0), (0, length, 0), (w, length)), looks.surface((r, r)))
    scene.add(m.quad((0, 0, h), (0, length, 0), (w, 0, 0), (length, w)), looks.wall())
    if kind in ("slits", "door"):
        if rng.random() < 0.25:
            _outside(scene, looks)
        else:
            _panels(scene, looks, (0, length, 0), (0, -1, 0), (1, 0, 0), holes, 0.1, rng.uniform(2, 12))
            _panels(scene, looks, (w, 0, 0), (0, 1, 0), (-1, 0, 0), door, rng.uniform(0.1, 0.8), rng.uniform(5, 30))
    else:
        for x in (0.15, w - 0.15):
            scene.add(m.quad((x - 0.1, 0.2, h - 0.35), (0.2, 0, 0), (0, length - 0.4, 0)), looks.black,
                      light=looks.warm(rng.uniform(2, 10)))
            scene.add(m.box((0.3, length, 0.03)).moved((x, length / 2, h - 0.4)), side)
    material, r = looks.surface((2, 4)), rng.uniform(0.1, 0.3)
    round_ = rng.random() < 0.6
    column = m.lathe([r * 1.5, r * 1.5, r, r, r * 1.5, r * 1.5], [0, 0.15, 0.2, h - 0.2, h - 0.15, h]) if round_ \
        else m.box((r * 1.6, r * 1.6, h))
    for y in np.arange(1.5, length, rng.uniform(1.5, 3)):
        for x in (r * 1.8, w - r * 1.8):
            if rng.random() < 0.85:
                scene.add(column.moved((x, y, 0)), material)
    for _ in range(int(rng.integers(3, 10))):
        at = (rng.uniform(0.5, w - 0.5), rng.uniform(3, length - 1), 0)
        things.place(scene, looks, things.thing(rng), at, rng.uniform(0.4, 1.2))
    eye = np.array([w * rng.uniform(0.35, 0.65), rng.uniform(0.3, 1.5), rng.uniform(0.6, 1.9)])
    target = np.array([w * rng.uniform(0.2, 0.8), length * rng.uniform(0.4, 0.8), rng.uniform(0.4, 1.8)])
    scene.camera(eye, target, rng.uniform(45, 80), **_lens(rng, eye, target))


def gallery(scene, looks):
    """A dark hall with many lamps: spots on things and pictures, coloured bulbs, a glossy floor."""
    rng = looks.rng
    w, d, h = rng.uniform(5, 10), rng.uniform(5, 10), rng.uniform(3, 5)
    floor = looks.coated((1, 1), roughness=10 ** rng.uniform(-2.5, -0.7)) if rng.random() < 0.7 else looks.surface()
    scene.add(m.quad((0, 0, 0), (w, 0, 0), (0, d, 0), (w, d)), floor)
    paint = looks.wall()
    for corner, u in (((0, d, 0), (w, 0, 0)), ((0, 0, 0), (0, d, 0)), ((w, d, 0), (0, -d, 0)), ((w, 0, 0), (-w, 0, 0))):
        scene.add(m.wall(corner, u, (0, 0, h)), paint)
    scene.add(m.quad((0, 0, h), (0, d, 0), (w, 0, 0)), looks.matte(texture=False))
    strength = rng.uniform(2, 20)
    for x in np.arange(0.8, w - 1, rng.uniform(1.2, 2.2)):
        pw, ph = rng.uniform(0.6, 1.1), rng.uniform(0.6, 1.6)
        picture = scene.color(looks.picture())
        scene.add(m.box((pw + 0.08, 0.04, ph + 0.08)).moved((x + pw / 2, d - 0.02, 1 - 0.04)), looks.surface())
        scene.add(m.quad((x, d - 0.05, 1), (pw, 0, 0), (0, 0, ph)), scene.material("diffuse", reflectance=picture))
        if rng.random() < 0.7:
            scene.spot((x + pw / 2, d - 1.2, h - 0.2), (x + pw / 2, d, 1.3), looks.warm(strength), rng.uniform(15, 40))
    for _ in range(int(rng.integers(2, 8))):
        at = np.array([rng.uniform(1, w - 1), rng.uniform(0.35, 0.9) * d, 0])
        tall = rng.uniform(0.4, 1.2)
        scene.add(m.box((0.5, 0.5, tall)).moved(at), looks.surface())
        things.place(scene, looks, things.thing(rng), at + [0, 0, tall], rng.uniform(0.4, 0.9))
        if rng.random() < 0.6:
            scene.spot(at + [rng.normal(), -1.5, h - 0.3], at + [0, 0, tall + 0.3], looks.warm(strength), rng.uniform(10, 35))
    bulbs = int(rng.choice([0, 6, 30, 80]))
    for _ in range(bulbs):
        at = rng.uniform([0.3, 0.3, 0.2], [w - 0.3, d - 0.3, h - 0.2])
        r = 10 ** rng.uniform(-2, -1)
        scene.add(m.superellipsoid(nu=10, nv=6).moved(at, scale=r), looks.black,
                  light=looks.warm(strength) * 0.03 / r ** 2 * 10 ** rng.uniform(-1, 0.5) / max(bulbs, 1) * 6)
    if rng.random() < 0.5 or not bulbs:
        things.lamp(rng, scene, looks, (w / 2, d / 2, h - 0.4), 0.6, strength)
    eye = np.array([w * rng.uniform(0.2, 0.8), 0.4, rng.uniform(1, 2.2)])
    target = np.array([w * rng.uniform(0.3, 0.7), d * 0.8, rng.uniform(0.7, 1.4)])
    scene.camera(eye, target, rng.uniform(35, 65), **_lens(rng, eye, target))


def desk(scene, looks):
    """Monitors that shine, books, posters with writing and fine stripes, pens; near."""
    rng = looks.rng
    scene.add(m.quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), (2, 2)), looks.surface())
    scene.add(m.quad((-2, 0.75, 0), (4, 0, 0), (0, 0, 3), (2, 2)), looks.wall())
    for s in (-1, 1):
        if rng.random() < 0.5:
            scene.add(m.quad((s * 1.6, -2 if s > 0 else 2, 0), (0, 4 * s, 0), (0, 0, 3), (2, 2)), looks.wall())
    for _ in range(int(rng.integers(2, 6))):
        pw, ph = rng.uniform(0.2, 0.7, 2)
        maker = [pictures.text, pictures.stripes, pictures.poster, pictures.checker][int(rng.integers(4))]
        at = (rng.uniform(-1.3, 0.9), 0.745 - 0.002 * rng.random(), rng.uniform(0.4, 0.9))
        kind = "coateddiffuse" if rng.random() < 0.4 else "diffuse"
        scene.add(m.quad(at, (pw, 0, 0), (0, 0, ph)), scene.material(kind, reflectance=looks.texture((1, 1), maker)))
    for _ in range(int(rng.integers(0, 3))):
        w, at, turn = rng.uniform(0.3, 0.7), (rng.uniform(-0.6, 0.6), rng.uniform(0.1, 0.5), 0), rng.normal() * 0.3
        high = w * rng.uniform(0.55, 0.7)
        body = m.joined([m.box((w + 0.03, 0.03, high + 0.03)).moved((0, 0.02, 0.1)), m.box((0.05, 0.03, 0.12)).moved((0, 0.03, 0)),
                         m.box((0.25, 0.18, 0.012))])
        scene.add(body.moved(at, (0, 0, turn)), looks.coated(texture=False))
        glass = m.quad((-w / 2, 0, 0.115), (w, 0, 0), (0, 0, high)).moved(at, (0, 0, turn))
        scene.add(glass, looks.black, light=np.ones(3) * rng.uniform(0.3, 3), light_picture=pictures.screen(rng))
    for _ in range(int(rng.integers(3, 12))):
        at = (rng.uniform(-0.8, 0.8), rng.uniform(-0.6, 0.5), 0)
        r = rng.random()
        if r < 0.35:
            sheet = m.quad((-0.1, -0.14, 0.001 + 0.002 * rng.random()), (0.21, 0, 0), (0, 0.29, 0))
            scene.add(sheet.moved(at, (0, 0, rng.uniform(-1, 1))),
                      scene.material("diffuse", reflectance=looks.texture((1, 1), pictures.text)))
        elif r < 0.55:
            things.place(scene, looks, things.books(rng), at, rng.uniform(0.3, 0.5))
        elif r < 0.7:
            scene.add(m.lathe([0.001, 0.004, 0.004, 0.001], [0, 0.02, 0.15, 0.16], 8).moved(
                (*at[:2], 0.005), (np.pi / 2, 0, rng.uniform(0, 6))), looks.coated(texture=False))
        else:
            things.place(scene, looks, things.thing(rng), at, rng.uniform(0.08, 0.3))
    if rng.random() < 0.5:
        things.plant(rng, scene, looks, (rng.uniform(-0.8, 0.8), 0.5, 0), rng.uniform(0.3, 0.7))
    things.lamp(rng, scene, looks, (rng.uniform(-0.9, 0.9), rng.uniform(-0.3, 0.5), rng.uniform(0.4, 1)),
                rng.uniform(0.1, 0.3), rng.uniform(0.3, 3))
    if rng.random() < 0.6:
        scene.glow(looks.warm(rng.uniform(0.02, 0.4)))
    eye = np.array([rng.uniform(-0.9, 0.9), rng.uniform(-1.6, -0.8), rng.uniform(0.25, 1.1)])
    target = np.array([rng.uniform(-0.3, 0.3), 0.2, rng.uniform(0.05, 0.4)])
    scene.camera(eye, target, rng.uniform(30, 60), **_lens(rng, eye, target))


def glassware(scene, looks):
    """Glass, water and mirrors over tiles, with small lamps: caustics."""
    rng = looks.rng
    scene.max_depth = int(rng.integers(8, 12))
    floor = looks.texture((2, 2), pictures.bricks if rng.random() < 0.5 else None)
    scene.add(m.quad((-3, -3, 0), (6, 0, 0), (0, 6, 0), (2, 2)), scene.material(
        "coateddiffuse" if rng.random() < 0.4 else "diffuse", reflectance=floor))
    scene.add(m.quad((-3, 1.3, 0), (6, 0, 0), (0, 0, 4), (2, 1.4)), looks.wall())
    if rng.random() < 0.5:
        scene.add(m.quad((-3, 3, 0), (0, -6, 0), (0, 0, 4), (2, 1.4)), looks.wall())
    if rng.random() < 0.25:  # water
        seed = int(rng.integers(1 << 20))
        surface = m.grid(lambda u, v: np.stack([(u - 0.5) * 4, (v - 0.5) * 2.4, 0.25 + 0.02 * m.noise(
            np.stack([u * 12, v * 8, u * 0], 1), seed, 2)], 1), 80, 60)
        scene.add(surface, scene.material("dielectric", eta=1.33, roughness=0.0))
    for _ in range(int(rng.integers(3, 9))):
        at = (*(rng.normal(size=2) * [0.6, 0.4]), 0)
        r, size = rng.random(), rng.uniform(0.2, 0.6)
        if r < 0.65:
            mesh = [things.goblet, things.outline, things.solid, things.knot][int(rng.integers(4))](rng)
            things.place(scene, looks, mesh, at, size, material=looks.glass())
        elif r < 0.8:
            things.place(scene, looks, m.torus(0.4, rng.uniform(0.02, 0.1)).moved((0, 0, 0.08)), at, size, material=looks.metal())
        else:
            things.place(scene, looks, things.thing(rng), at, size)
    if rng.random() < 0.3:
        scene.add(m.quad((-1.2, 1.28, 0.1), (1.5, 0, 0), (0, 0, 1.4)), scene.material(
            "conductor", reflectance=(0.92, 0.92, 0.92), roughness=0.0))
    for _ in range(int(rng.integers(1, 3))):
        r = 10 ** rng.uniform(-1.5, -0.3)
        at = np.array([rng.uniform(-2, 2), rng.uniform(-2, 1), rng.uniform(1.2, 3)])
        scene.add(m.superellipsoid(nu=14, nv=8).moved(at, scale=r), looks.black,
                  light=looks.warm(rng.uniform(2, 8)) / (r * r * 4))
    if rng.random() < 0.7:
        scene.glow(looks.warm(rng.uniform(0.05, 0.5)))
    eye = np.array([rng.uniform(-1.2, 1.2), rng.uniform(-2.4, -1.4), rng.uniform(0.4, 1.6)])
    target = np.array([0, 0, 0.25]) + rng.normal(size=3) * 0.1
    scene.camera(eye, target, rng.uniform(28, 50), **_lens(rng, eye, target))


def clutter(scene, looks):
    """A heap of many small things; some fly through the picture while the shutter is open."""
    rng = looks.rng
    scene.add(m.quad((-5, -5, 0), (10, 0, 0), (0, 10, 0), (8, 8)), looks.surface())
    if rng.random() < 0.5:
        for s, corner, u in ((0, (-1.5, 1.5, 0), (3, 0, 0)), (1, (-1.5, -1.5, 0), (0, 3, 0)), (1, (1.5, 1.5, 0), (0, -3, 0))):
            scene.add(m.wall(corner, u, (0, 0, rng.uniform(0.1, 1.5))), looks.surface())
    materials = [looks.object() for _ in range(12)]
    kinds = [things.thing(rng) for _ in range(7)]
    for _ in range(int(rng.integers(60, 220))):
        r = rng.uniform(0, 1.4)
        a = rng.uniform(0, 6.3)
        at = np.array([r * np.cos(a), r * np.sin(a), abs(rng.normal()) * 0.35 * max(0, 1 - r / 1.5)])
        mesh = kinds[int(rng.integers(len(kinds)))].moved(at, rng.uniform(0, 6.3, 3), rng.uniform(0.06, 0.35))
        more = {}
        if rng.random() < 0.04:
            more = {"move": tuple(rng.normal(size=3) * 0.15), "turn": rng.uniform(-90, 90)}
        scene.add(mesh, materials[int(rng.integers(len(materials)))], **more)
    if rng.random() < 0.5:
        scene.environment(pictures.sky(rng))
    else:
        scene.glow(looks.warm(rng.uniform(0.02, 0.3)))
        for _ in range(int(rng.integers(1, 4))):
            things.lamp(rng, scene, looks, (*rng.uniform(-1.5, 1.5, 2), rng.uniform(1.5, 3)), rng.uniform(0.1, 1), 6)
    a, high = rng.uniform(-2.4, -0.7), rng.uniform(0.2, 1.2)
    far = rng.uniform(1.5, 3)
    eye = np.array([np.cos(a) * np.cos(high), np.sin(a) * np.cos(high), np.sin(high)]) * far + [0, 0, 0.2]
    scene.camera(eye, (0, 0, 0.2), rng.uniform(28, 55), **_lens(rng, eye, (0, 0, 0.2)))
