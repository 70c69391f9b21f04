"""A living room at dusk. A strip of light behind a ledge, never seen itself, shines at the ceiling;
the sky in the window, a door out of the picture and a lamp with an opaque shade do the rest."""

import math
import random

import textures
from gltf import Writer
from shapes import (arc, box, curve, lathe, pillow, quad, rounded_box, sheet, sphere, torus, tube)

# Inside of the walls.
LEFT, RIGHT, BACK, FRONT, TOP = -2.0, 2.4, -2.4, 3.6, 2.62
# The window in the left wall: z and y.
WIN_Z, WIN_Y = (-1.75, -0.45), (0.72, 2.02)


def make(folder):
    out = Writer(folder, "room")
    plaster = out.texture("plaster_normal.png", textures.plaster_normal())
    weave = out.texture("weave_normal.png", textures.weave_normal())
    wood = out.material("oak", (0.42, 0.235, 0.12), roughness=0.42)
    brass = out.material("brass", (0.91, 0.70, 0.36), metallic=1, roughness=0.22)
    glass = out.material("glass", (1, 1, 1), roughness=0, glass_ior=1.5)

    planks = out.texture("floor_color.png", textures.floor_color())
    block = out.material("oak block", (1, 0.93, 0.84), roughness=0.36, color_texture=planks)

    _shell(out, plaster, planks)
    _window(out)
    _cove(out, wood)
    _sofa(out, weave, wood)
    _carpet(out, weave)
    _picture(out)
    _lamp(out, brass)
    _plant(out)
    _table(out, wood, block, glass)
    _side_table(out, brass, glass)

    out.camera((1.05, 1.34, 3.05), (-0.35, 0.90, -2.0), 35.5, 1.6)
    out.save()


def _shell(out, plaster, planks):
    floor = out.material(
        "floor", roughness=1,
        color_texture=planks,
        rough_texture=out.texture("floor_roughness.png", textures.floor_roughness()),
        normal_texture=out.texture("floor_normal.png", textures.floor_normal()))
    wall = out.material("back wall", (0.47, 0.52, 0.46), roughness=0.9, normal_texture=plaster,
                        normal_scale=0.7)
    white = out.material("plaster", (0.76, 0.73, 0.68), roughness=0.9, normal_texture=plaster,
                         normal_scale=0.7)
    ceiling = out.material("ceiling", (0.84, 0.83, 0.80))
    w, d, h = RIGHT - LEFT, FRONT - BACK, TOP
    tile = 0.9  # metres of plaster

    # Planks run toward the eye: a repeat is 1.6 m along z and 1.2 m along x.
    ground = quad((LEFT, 0, FRONT), (w, 0, 0), (0, 0, -d))
    ground.uvs = [((FRONT - p[2]) / 1.6, p[0] / 1.2) for p in ground.positions]
    out.place("floor", ground, floor)
    out.place("ceiling", quad((LEFT, h, BACK), (w, 0, 0), (0, 0, d)).without_uvs(), ceiling)
    out.place("back wall", quad((LEFT, 0, BACK), (w, 0, 0), (0, h, 0), (w / tile, h / tile)), wall)
    side = quad((RIGHT, 0, BACK), (0, 0, d), (0, h, 0), (d / tile, h / tile))
    side.add(quad((RIGHT, 0, FRONT), (-w, 0, 0), (0, h, 0), (w / tile, h / tile)))
    # The left wall around the window.
    (z0, z1), (y0, y1) = WIN_Z, WIN_Y
    for near, far, low, high in ((FRONT, z1, 0, h), (z1, z0, 0, y0), (z1, z0, y1, h),
                                 (z0, BACK, 0, h)):
        side.add(quad((LEFT, low, near), (0, 0, far - near), (0, high - low, 0),
                      ((near - far) / tile, (high - low) / tile)))
    out.place("other walls", side, white)

    skirting = out.material("skirting", (0.78, 0.76, 0.71), roughness=0.5)
    boards = box((LEFT - 0.1, -0.1, BACK - 0.1), (RIGHT + 0.1, 0.09, BACK + 0.015))
    boards.add(box((LEFT - 0.1, -0.1, BACK - 0.09), (LEFT + 0.015, 0.088, FRONT)))
    out.place("skirting", boards.without_uvs(), skirting)


def _window(out):
    (z0, z1), (y0, y1) = WIN_Z, WIN_Y
    deep = 0.16
    x = LEFT - deep
    white = out.material("window frame", (0.74, 0.73, 0.70), roughness=0.45)
    sky = out.material("sky", (0, 0, 0), emissive=(1.1, 1.1, 1.1),
                       emissive_texture=out.texture("sky_color.png", textures.sky_color(), True))
    out.place("sky", quad((x, y0, z1), (0, 0, z0 - z1), (0, y1 - y0, 0)), sky)
    reveal = quad((x, y0, z1), (deep, 0, 0), (0, 0, z0 - z1))
    reveal.add(quad((x, y1, z0), (deep, 0, 0), (0, 0, z1 - z0)))
    reveal.add(quad((x, y0, z0), (deep, 0, 0), (0, y1 - y0, 0)))
    reveal.add(quad((LEFT, y0, z1), (-deep, 0, 0), (0, y1 - y0, 0)))
    bar, x0, x1 = 0.028, LEFT - 0.11, LEFT - 0.06
    middle = (z0 + z1) / 2
    for low, high in (((y0 - 0.05, z0 - 0.05), (y1 + 0.05, z0 + 0.05)),
                      ((y0 - 0.05, z1 - 0.05), (y1 + 0.05, z1 + 0.05)),
                      ((y0 - 0.05, middle - bar), (y1 + 0.05, middle + bar))):
        reveal.add(box((x0, low[0], low[1]), (x1, high[0], high[1])))
    for low, high in ((y0 - 0.05, y0 + 0.05), (y1 - 0.05, y1 + 0.05), (1.60, 1.625)):
        reveal.add(box((x0 + 0.005, low, z0 - 0.05), (x1 - 0.005, high, z1 + 0.05)))
    reveal.add(box((LEFT - 0.055, y0 - 0.035, z0 - 0.06), (LEFT + 0.07, y0 + 0.006, z1 + 0.06)))
    out.place("window frame", reveal.without_uvs(), white)

    # A balcony door in the right wall, out of the picture.
    pale = out.material("balcony door", (0, 0, 0), emissive=(3.85, 4.2, 5.0))
    door = quad((RIGHT - 0.01, 0.1, -1.35), (0, 0, 1.7), (0, 2.0, 0)).without_uvs()
    out.place("balcony door", door, pale)

    cloth = out.material("curtain", (0.72, 0.66, 0.58), roughness=1, double_sided=True)

    def fold(s, t):
        depth = 0.028 + 0.012 * math.sin(3 * s) + 0.008 * (1 - t)
        return (LEFT + 0.10 + depth * math.sin(2 * math.pi * 5 * s + 0.4 * math.sin(5 * t)),
                0.03 + 2.12 * t, -1.72 - (0.50 + 0.05 * t) * s)

    out.place("curtain", sheet(5, 50, fold).without_uvs(), cloth)
    rod = tube([(LEFT + 0.10, 2.17, 0.2), (LEFT + 0.10, 2.17, -2.34)], 0.013, 12).without_uvs()
    metal = out.material("dark metal", (0.12, 0.11, 0.10), metallic=1, roughness=0.35)
    out.place("curtain rod", rod, metal)


def _cove(out, wood):
    """A ledge along the back wall; the strip behind its lip shines at the ceiling."""
    light = out.material("cove light", (0, 0, 0), emissive=(3.9, 2.7, 1.6))
    z = BACK
    ledge = box((LEFT - 0.1, 2.13, z - 0.1), (RIGHT + 0.1, 2.165, z + 0.26))
    ledge.add(box((LEFT - 0.11, 2.115, z + 0.24), (RIGHT + 0.11, 2.235, z + 0.27)))
    out.place("ledge", ledge.without_uvs(), wood)
    strip = quad((LEFT + 0.05, 2.172, z + 0.21), (RIGHT - LEFT - 0.1, 0, 0), (0, 0, -0.17))
    out.place("cove light", strip.without_uvs(), light)


def _sofa(out, weave, wood):
    petrol = out.material("petrol cloth", (0.075, 0.205, 0.225), roughness=0.85,
                          normal_texture=weave, normal_scale=0.8, repeat=(90, 90))
    x, z = -0.30, -1.78
    out.place("sofa base", rounded_box((2.02, 0.20, 0.86), 0.04), petrol, (x, 0.24, z))
    arm = rounded_box((0.19, 0.44, 0.90), 0.075, 3)
    for side in (-1, 1):
        out.place("sofa arm", arm, petrol, (x + side * 1.06, 0.40, z + 0.01))
    seat = rounded_box((0.955, 0.17, 0.74), 0.06, 2, 4, 0.03)
    back = rounded_box((0.95, 0.46, 0.20), 0.075, 2, 4, 0.045)
    for side in (-1, 1):
        out.place("sofa seat", seat, petrol, (x + side * 0.4805, 0.42, z + 0.08))
        out.place("sofa back", back, petrol, (x + side * 0.4785, 0.69, z - 0.26), turn=(-12, 0, 0))
    leg = lathe([(0, 0), (0.018, 0), (0.028, 0.15)], 14).without_uvs()
    for dx in (-0.98, 0.98):
        for dz in (-0.36, 0.36):
            out.place("sofa leg", leg, wood, (x + dx, 0, z + dz))

    shape = pillow(0.47, 0.45, 0.19, 14)
    colors = {"ochre": (0.62, 0.32, 0.055), "rust": (0.43, 0.10, 0.045),
              "cream": (0.70, 0.62, 0.50)}
    cloth = {name: out.material(name + " cloth", color, roughness=0.95, normal_texture=weave,
                                normal_scale=0.9, repeat=(70, 70))
             for name, color in colors.items()}
    out.place("pillow", shape, cloth["ochre"], (x - 0.70, 0.735, z - 0.06), turn=(-17, 24, 4))
    out.place("pillow", shape, cloth["cream"], (x - 0.36, 0.715, z - 0.02), turn=(-22, 6, -7),
              scale=(0.88, 0.88, 0.88))
    out.place("pillow", shape, cloth["rust"], (x + 0.70, 0.735, z - 0.04), turn=(-18, -22, -6))


def _carpet(out, weave):
    color = out.texture("rug_color.png", textures.rug_color(), True)
    rug = out.material("rug", roughness=1, color_texture=color, normal_texture=weave,
                       normal_scale=1, repeat=(110, 77))
    shape = box((-1.35, 0.001, -0.945), (1.35, 0.014, 0.945))
    shape.uvs = [((p[0] + 1.35) / 2.7, (p[2] + 0.945) / 1.89) for p in shape.positions]
    out.place("rug", shape, rug, (-0.16, 0, 0.0))


def _picture(out):
    art = out.material("picture", roughness=0.6,
                       color_texture=out.texture("picture.png", textures.picture_color(), True))
    frame = out.material("picture frame", (0.03, 0.028, 0.026), roughness=0.35)
    mount = out.material("mount", (0.80, 0.78, 0.73))
    x, y, w, h, z = -0.30, 1.47, 1.14, 0.76, BACK
    out.place("picture", quad((x - w / 2, y - h / 2, z + 0.016), (w, 0, 0), (0, h, 0)), art)
    m, f = 0.07, 0.022
    out.place("mount", quad((x - w / 2 - m, y - h / 2 - m, z + 0.012), (w + 2 * m, 0, 0),
                            (0, h + 2 * m, 0)).without_uvs(), mount)
    a, b = w / 2 + m, h / 2 + m
    bars = box((x - a - f, y - b - f, z - 0.01), (x - a, y + b + f, z + 0.04))
    bars.add(box((x + a, y - b - f, z - 0.01), (x + a + f, y + b + f, z + 0.04)))
    bars.add(box((x - a - 0.01, y - b - f, z - 0.01), (x + a + 0.01, y - b, z + 0.039)))
    bars.add(box((x - a - 0.01, y + b, z - 0.01), (x + a + 0.01, y + b + f, z + 0.039)))
    out.place("picture frame", bars.without_uvs(), frame)


def _lamp(out, brass):
    """Light goes up and down only: the shade is thick metal, and the bulb sits deep in it."""
    x, z = 1.50, -2.0
    foot = lathe([(0, 0.001), (0.15, 0.001)] + arc((0.15, 0.013), 0.012, -90, 90, 4)
                 + [(0.03, 0.032), (0.014, 0.05), (0.0125, 1.36)], 28)
    out.place("lamp foot", foot.without_uvs(), brass, (x, 0, z))
    outside, inside = [(0.205, 0), (0.135, 0.28)], [(0.131, 0.28), (0.201, 0)]
    shade = out.material("lamp shade", (0.035, 0.085, 0.095), roughness=0.3)
    lining = out.material("lamp lining", (0.85, 0.62, 0.30), metallic=1, roughness=0.45)
    out.place("lamp shade", lathe(outside + [inside[0]], 48).without_uvs(), shade, (x, 1.36, z))
    out.place("lamp lining", lathe(inside + [outside[0]], 48).without_uvs(), lining, (x, 1.36, z))
    # Two discs on a plate: one shines down, one up.
    disc = lathe([(0.125, 0.008), (0, 0.008)], 24).without_uvs()
    bulb = out.material("bulb", (0, 0, 0), emissive=(14.5, 9.0, 4.6))
    for turn in (0, 180):
        out.place("bulb", disc, bulb, (x, 1.47, z), turn=(turn, 0, 0))
    out.place("bulb holder", tube([(x - 0.17, 1.47, z), (x + 0.17, 1.47, z)], 0.006, 8)
              .without_uvs(), brass)


def _plant(out):
    x, z = -1.56, -1.92
    glaze = out.material("glazed pot", (0.72, 0.69, 0.64), roughness=0.12)
    earth = out.material("earth", (0.045, 0.03, 0.02))
    pot = curve([(0.10, 0.0), (0.165, 0.10), (0.185, 0.24), (0.165, 0.36)], 4)
    body = [(0, 0.001), (0.10, 0.001)] + pot[1:] + arc((0.157, 0.362), 0.008, 30, 180, 4)
    out.place("pot", lathe(body + [(0.150, 0.30)], 40).without_uvs(), glaze, (x, 0, z))
    out.place("earth", lathe([(0.158, 0.33), (0, 0.34)], 24).without_uvs(), earth, (x, 0, z))

    leaf = out.material("leaf", roughness=0.38, mask=True, double_sided=True,
                        color_texture=out.texture("leaf.png", textures.leaf_color(), True))
    stalk = out.material("stalk", (0.12, 0.20, 0.06), roughness=0.5)

    def blade(s, t):  # points along +z from the stalk, drooping; 1 m long
        across, along = (s - 0.5) * 0.78, t
        droop = -0.42 * along * along + 0.10 * along
        return (across, droop + 0.55 * across * across * (1 - 0.5 * along) + 0.10 * abs(across),
                along * 0.92)

    shape = sheet(8, 8, lambda s, t: blade(1 - s, t))
    shape.uvs = [(1 - u, v) for u, v in shape.uvs]
    random.seed(12)
    for i in range(12):
        turn = math.radians(137.5 * i + 20)
        height = 0.93 + 0.052 * i + 0.05 * random.random()
        reach = 0.30 - 0.014 * i + 0.05 * random.random()
        top = (x + reach * math.sin(turn) * (0.9 if math.sin(turn) < 0 else 1.1), height,
               z + reach * math.cos(turn) + 0.03)
        middle = (x + 0.35 * reach * math.sin(turn), 0.33 + 0.62 * (height - 0.33),
                  z + 0.35 * reach * math.cos(turn))
        path = curve([(x, 0.30, z), middle, top], 3)
        out.place("stalk", tube(path, [0.010 - 0.0008 * k for k in range(len(path))], 6)
                  .without_uvs(), stalk)
        size = 0.42 + 0.08 * random.random() - 0.006 * i
        out.place("leaf", shape, leaf, top,
                  turn=(38 - 4.5 * i + 10 * random.random(), math.degrees(turn), 0),
                  scale=(size, size, size))


def _vase():
    """A closed body of glass: up the outside, over the rim, down the inside."""
    outside = curve([(0.055, 0.0), (0.086, 0.07), (0.092, 0.13), (0.058, 0.22), (0.036, 0.28),
                     (0.040, 0.32), (0.060, 0.36)], 3)
    inside = [(max(r - 0.006, 0.0), h) for r, h in reversed(outside)]
    floor = [(r, max(h, 0.022)) for r, h in inside if h > 0.02]
    profile = [(0, 0.0), (0.050, 0.0)] + arc((0.050, 0.005), 0.005, -60, -30, 1) + outside[1:]
    return lathe(profile + arc((0.0575, 0.3605), 0.003, 30, 150, 2) + floor
                 + [(0.045, 0.016), (0.0, 0.013)], 40, crease=75).without_uvs()


def _table(out, wood, block, glass):
    x, z, top = -0.10, 0.22, 0.38
    board = lathe([(0, top - 0.04)] + arc((0.50, top - 0.02), 0.02, -90, 90, 5) + [(0, top)], 64)
    board.uvs = [(0.3 + p[0] / 0.9, 0.07 + p[2] / 0.7) for p in board.positions]
    out.place("table top", board, block, (x, 0, z))
    for k in range(3):
        a = math.radians(120 * k + 40)
        leg = tube([(x + 0.36 * math.sin(a), 0.012, z + 0.36 * math.cos(a)),
                    (x + 0.30 * math.sin(a), top - 0.03, z + 0.30 * math.cos(a))],
                   [0.014, 0.026], 14)
        out.place("table leg", leg.without_uvs(), wood)
    on = top + 0.0005

    out.place("glass vase", _vase(), glass, (x - 0.26, on, z - 0.08))
    ball = sphere(0.088, 18).without_uvs()
    out.place("glass ball", ball, glass, (x + 0.10, on + 0.088, z + 0.26))
    out.place("glass ball", ball, glass, (x - 0.10, on + 0.088 * 0.62, z + 0.33),
              scale=(0.62, 0.62, 0.62))

    # A turned and brushed pot with spout and handle.
    copper = out.material(
        "brushed copper", (0.95, 0.52, 0.34), metallic=1, roughness=1,
        rough_texture=out.texture("brushed_roughness.png", textures.brushed_roughness()))
    body = [(0, 0.0), (0.062, 0.0)] + curve([(0.070, 0.006), (0.105, 0.06), (0.100, 0.11),
                                             (0.060, 0.150), (0.056, 0.156)], 4)
    lid = curve([(0.058, 0.160), (0.040, 0.176), (0.012, 0.184), (0.010, 0.192)], 2)
    knob = arc((0.0, 0.207), 0.017, -50, 90, 5)
    px, pz = x + 0.20, z - 0.10
    out.place("pot body", lathe(body + lid + knob, 40, 50), copper, (px, on, pz))
    spout = curve([(0.085, 0.05, 0), (0.135, 0.07, 0), (0.155, 0.12, 0), (0.185, 0.155, 0)], 5)
    parts = tube(spout, [0.026 - 0.0105 * k / (len(spout) - 1) for k in range(len(spout))], 16)
    handle = curve([(-0.060, 0.142, 0), (-0.115, 0.155, 0), (-0.160, 0.115, 0), (-0.145, 0.06, 0),
                    (-0.098, 0.045, 0)], 6)
    parts.add(tube(handle, 0.0085, 10))
    out.place("pot spout, handle", parts, copper, (px, on, pz), turn=(0, -28, 0))
    out.place("pot spout inside", lathe([(0.0115, 0), (0, 0)], 14).without_uvs(),
              out.material("hollow", (0.02, 0.01, 0.008)), **_on_spout(px, on, pz))

    # A hammered bowl.
    dents = out.texture("hammered_normal.png", textures.hammered_normal())
    bowl = out.material("hammered brass", (0.91, 0.70, 0.36), metallic=1, roughness=0.16,
                        normal_texture=dents, normal_scale=0.55)
    side = curve([(0.05, 0.004), (0.105, 0.028), (0.145, 0.075)], 4)
    inner = [(r - 0.005, h + 0.004) for r, h in reversed(side)]
    profile = [(0, 0.0), (0.045, 0.0)] + side + arc((0.1425, 0.0765), 0.003, 20, 160, 3)[1:] + inner
    out.place("bowl", lathe(profile + [(0, 0.007)], 44, uv_size=(2, 2)), bowl,
              (x + 0.02, on, z + 0.02 - 0.30))


def _on_spout(x, y, z):
    c, s = math.cos(math.radians(-28)), math.sin(math.radians(-28))
    px, py = 0.1835, 0.1538
    return {"at": (x + px * c, y + py, z - px * s), "turn": (0, -28, -40)}


def _side_table(out, brass, glass):
    x, z, top = 1.08, -1.55, 0.50
    rim = arc((0.212, top - 0.008), 0.008, -90, 90, 4)
    plate = lathe([(0, top - 0.016)] + rim + [(0, top)], 56)
    out.place("side table", plate.without_uvs(), brass, (x, 0, z))
    post = lathe([(0, 0.001), (0.13, 0.001), (0.13, 0.012), (0.022, 0.02), (0.016, 0.05),
                  (0.016, top - 0.01)], 28)
    out.place("side table post", post.without_uvs(), brass, (x, 0, z))
    books = random.Random(3)
    y = top + 0.0005
    colors = ((0.42, 0.10, 0.06), (0.08, 0.16, 0.24), (0.60, 0.50, 0.34))
    for k, color in enumerate(colors):
        cover = out.material("book %d" % k, color, roughness=0.55)
        thick = 0.024 + 0.006 * k
        book = rounded_box((0.23 - 0.02 * k, thick, 0.16 - 0.012 * k), 0.003, 1).without_uvs()
        out.place("book", book, cover, (x - 0.03, y + thick / 2, z),
                  turn=(0, books.uniform(-16, 24), 0))
        y += thick + 0.0005
    ring = out.material("ceramic", (0.74, 0.72, 0.68), roughness=0.18)
    out.place("ring", torus(0.066, 0.021, 32, 12).without_uvs(), ring, (x - 0.03, y + 0.0868, z),
              turn=(90, 25, 0))
