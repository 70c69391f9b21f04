"""Materials by chance: what a scene's surfaces look like."""

import colorsys

import numpy as np

import pictures

METALS = ["Ag", "Al", "Au", "Cu", "CuZn"]


def palette(rng):
    """Five colours (sRGB, 0..1) that go together more or less."""
    style = rng.choice(["muted", "muted", "vivid", "pastel", "earth", "earth", "grey"])
    hue = rng.random()
    colors = []
    for k in range(5):
        h = (hue + rng.choice([0, 0.08, 0.5, 0.33, -0.1]) + 0.04 * rng.normal()) % 1
        s, v = {
            "muted": (rng.uniform(0.1, 0.45), rng.uniform(0.25, 0.85)),
            "vivid": (rng.uniform(0.6, 0.95), rng.uniform(0.4, 0.95)),
            "pastel": (rng.uniform(0.1, 0.3), rng.uniform(0.75, 0.95)),
            "earth": (rng.uniform(0.2, 0.6), rng.uniform(0.15, 0.7)),
            "grey": (rng.uniform(0, 0.08), rng.uniform(0.05, 0.9)),
        }[style]
        if style == "earth":
            h = rng.uniform(0.03, 0.17)
        colors.append(np.array(colorsys.hsv_to_rgb(h, s, v)))
    if rng.random() < 0.6:  # one that stands out
        colors[-1] = np.array(colorsys.hsv_to_rgb(rng.random(), rng.uniform(0.7, 1), rng.uniform(0.5, 0.9)))
    return colors


def linear(color):
    return np.asarray(color, float) ** 2.2


class Looks:
    def __init__(self, scene, rng):
        self.scene, self.rng = scene, rng
        self.colors = palette(rng)
        self.textured = rng.uniform(0.2, 0.8)
        self.shiny = rng.uniform(0.1, 0.9)
        self.black = scene.material("diffuse", reflectance=(0, 0, 0))
        self.glasses = set()

    def any_color(self):
        return self.colors[int(self.rng.integers(len(self.colors)))]

    def two_colors(self):
        order = self.rng.permutation(len(self.colors))
        return [self.colors[i] for i in order]

    def picture(self, maker=None):
        maker = maker or pictures.COLOR[int(self.rng.integers(len(pictures.COLOR)))]
        return np.clip(maker(self.rng, self.two_colors()), 0.01, 0.97)

    def texture(self, repeat=None, maker=None):
        if repeat is None:
            r = float(self.rng.choice([1, 1, 2, 3, 5]))
            repeat = (r, r)
        return self.scene.color(self.picture(maker), repeat)

    def base(self, repeat=None, texture=None):
        if texture if texture is not None else self.rng.random() < self.textured:
            return self.texture(repeat)
        return tuple(linear(self.any_color()).clip(0.01, 0.9))

    def _bump(self, repeat):
        if self.rng.random() > 0.2:
            return {}
        height = 10 ** self.rng.uniform(-3.3, -1.8)
        return {"displacement": self.scene.numbers(pictures.bump(self.rng), repeat or (2, 2), height)}

    def matte(self, repeat=None, texture=None):
        return self.scene.material("diffuse", reflectance=self.base(repeat, texture), **self._bump(repeat))

    def coated(self, repeat=None, texture=None, roughness=None):
        rng = self.rng
        if roughness is None:
            roughness = 0.0 if rng.random() < 0.2 else 10 ** rng.uniform(-2.5, -0.3)
            if rng.random() < 0.15:
                roughness = self.scene.numbers(pictures.rough(rng), repeat or (2, 2))
        return self.scene.material("coateddiffuse", reflectance=self.base(repeat, texture),
                                   roughness=roughness, **self._bump(repeat))

    def metal(self, repeat=None):
        rng = self.rng
        roughness = 0.0 if rng.random() < 0.15 else 10 ** rng.uniform(-2.3, -0.4)
        if rng.random() < 0.25:
            roughness = self.scene.numbers(pictures.rough(rng), repeat or (2, 2))
        if rng.random() < 0.6:
            name = METALS[int(rng.integers(len(METALS)))]
            values = {"eta": "metal-%s-eta" % name, "k": "metal-%s-k" % name}
        else:
            values = {"reflectance": rng.uniform(0.4, 0.95) * (1 - rng.uniform(0, 0.3, 3))}
        return self.scene.material("conductor", roughness=roughness, **values, **self._bump(repeat))

    def glass(self):
        roughness = 0.0 if self.rng.random() < 0.75 else self.rng.uniform(0.02, 0.3)
        name = self.scene.material("dielectric", eta=self.rng.uniform(1.3, 1.7), roughness=roughness)
        self.glasses.add(name)
        return name

    def thin_glass(self):
        return self.scene.material("thindielectric", eta=1.5)

    def sheer(self):
        """Lets light through diffusely: leaves, cloth, paper, lamp shades."""
        c = linear(self.any_color()).clip(0.05, 0.85)
        share = self.rng.uniform(0.3, 0.7)
        return self.scene.material("diffusetransmission", reflectance=c * share, transmittance=c * (1 - share))

    def green(self, sheer=0.5):
        hue = self.rng.uniform(0.15, 0.42) if self.rng.random() < 0.85 else self.rng.uniform(0, 0.15)
        c = linear(np.array(colorsys.hsv_to_rgb(hue, self.rng.uniform(0.4, 0.85), self.rng.uniform(0.25, 0.7))))
        if self.rng.random() < sheer:
            return self.scene.material("diffusetransmission", reflectance=c * 0.6, transmittance=c * 0.4)
        if self.rng.random() < 0.4:
            return self.scene.material("coateddiffuse", reflectance=c, roughness=self.rng.uniform(0.1, 0.5))
        return self.scene.material("diffuse", reflectance=c)

    def mixed(self, repeat=None):
        amount = self.scene.numbers(pictures.clouds(self.rng, [np.zeros(3), np.ones(3)])[..., 0], repeat or (2, 2))
        return self.scene.mix(self.matte(repeat), self.metal() if self.rng.random() < 0.5 else self.coated(), amount)

    def object(self, repeat=None):
        """Of a thing."""
        rng = self.rng
        r = rng.random()
        if r < 0.42 * (1 - self.shiny) + 0.18:
            return self.matte(repeat)
        if r < 0.72:
            return self.coated(repeat)
        if r < 0.85:
            return self.metal(repeat)
        if r < 0.93:
            return self.glass()
        return self.sheer() if r < 0.96 else self.mixed(repeat)

    def surface(self, repeat=(1, 1)):
        """Of a floor, a wall, a table: nothing is seen through it."""
        r = self.rng.random()
        if r < 0.62 - 0.3 * self.shiny:
            return self.matte(repeat)
        return self.coated(repeat) if r < 0.95 else self.mixed(repeat)

    def wall(self):
        if self.rng.random() < 0.55:
            c = linear(self.any_color()) * 0.5 + self.rng.uniform(0.15, 0.45)
            return self.scene.material("diffuse", reflectance=c.clip(0, 0.85))
        r = float(self.rng.choice([0.3, 0.5, 1, 2]))
        return self.surface((r, r))

    def warm(self, strength=1.0):
        """Light of a lamp: warm, white, cool, seldom coloured."""
        t = self.rng.random()
        if t < 0.12:
            c = np.array(colorsys.hsv_to_rgb(self.rng.random(), self.rng.uniform(0.5, 0.95), 1))
        else:
            c = np.array([[1, 0.6, 0.28], [1, 0.85, 0.65], [1, 1, 1], [0.75, 0.88, 1]][int(self.rng.integers(4))])
        return c * strength
