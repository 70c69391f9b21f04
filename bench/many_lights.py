#!/usr/bin/python3
"""Writes FOLDER/many_lights.gltf: a hall of columns with a thousand small lamps of different power
that face all ways, for bench/light_study.cpp. Standard library only; the same bytes each time."""

import os
import random
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "scenes"))

from gltf import Writer  # noqa: E402
from shapes import box, cross, quad, unit  # noqa: E402

LAMPS = 1000


def make(folder):
    out = Writer(folder, "many_lights")
    rng = random.Random(5)
    stone = out.material("stone", (0.6, 0.58, 0.55))
    blue = out.material("blue", (0.2, 0.3, 0.6), roughness=0.3)
    hall = quad((-10, 0, 10), (20, 0, 0), (0, 0, -20)).add(quad((-10, 4, -10), (20, 0, 0), (0, 0, 20)))
    hall.add(quad((-10, 0, -10), (20, 0, 0), (0, 4, 0))).add(quad((-10, 0, 10), (0, 0, -20), (0, 4, 0)))
    hall.add(quad((10, 0, -10), (0, 0, 20), (0, 4, 0)))
    out.place("hall", hall.without_uvs(), stone)
    for i in range(4):
        for k in range(4):
            x, z = -7.5 + 5 * i, -7.5 + 5 * k
            out.place("column", box((x - 0.4, 0, z - 0.4), (x + 0.4, 4, z + 0.4)).without_uvs(), blue)
    lamps = [out.material("lamp %d" % i, (0, 0, 0), emissive=[p * rng.uniform(0.5, 1) for _ in "rgb"])
             for i, p in enumerate((2, 6, 20, 60))]
    for _ in range(LAMPS):
        side = rng.uniform(0.02, 0.08)
        u = unit([rng.gauss(0, 1) for _ in range(3)])
        v = unit(cross(u, [rng.gauss(0, 1) for _ in range(3)]))
        at = (rng.uniform(-9.8, 9.8), rng.uniform(0.1, 3.9), rng.uniform(-9.8, 9.8))
        lamp = quad(at, [side * c for c in u], [side * c for c in v])
        out.place("lamp", lamp.without_uvs(), lamps[min(int(rng.expovariate(1)), 3)])
    out.camera((0, 1.6, 9), (0, 1.4, 0), 60, 16 / 9)
    out.save()


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: many_lights.py FOLDER")
    make(sys.argv[1])
