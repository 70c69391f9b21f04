#!/usr/bin/env python3
"""Writes random scenes, a seed each: PBRT files with all that they need beside them.

    train/scenes.py --seed 7 --out FOLDER
"""

import argparse

import numpy as np

import indoors
import outdoors
from looks import Looks
from pbrt import Scene

LAYOUTS = {
    "room": (indoors.room, 7), "still_life": (indoors.still_life, 3), "corridor": (indoors.corridor, 3),
    "gallery": (indoors.gallery, 2), "desk": (indoors.desk, 2), "glassware": (indoors.glassware, 2),
    "clutter": (indoors.clutter, 2), "landscape": (outdoors.landscape, 3), "bush": (outdoors.bush, 2),
    "street": (outdoors.street, 2), "thin": (outdoors.thin, 2), "shapes": (outdoors.shapes, 2),
}


def make(seed, folder, layout=None, attempt=0):
    """The scene of this seed in `folder`, not yet written: see Scene.write. Returns scene, layout's name."""
    names = list(LAYOUTS)
    weights = np.array([LAYOUTS[n][1] for n in names], float)
    drawn = str(np.random.default_rng([seed, 1]).choice(names, p=weights / weights.sum()))
    if layout is None and attempt > 3:  # that one does not work out
        drawn = str(np.random.default_rng([seed, 3, attempt]).choice(["still_life", "clutter", "shapes", "desk"]))
    layout = layout or drawn
    rng = np.random.default_rng([seed, 2, attempt])
    scene = Scene(folder)
    LAYOUTS[layout][0](scene, Looks(scene, rng))
    return scene, layout


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--out", required=True, help="folder of the scene")
    parser.add_argument("--layout", choices=list(LAYOUTS), help="instead of the seed's own")
    options = parser.parse_args()
    scene, layout = make(options.seed, options.out, options.layout)
    print(layout, scene.write())


if __name__ == "__main__":
    main()
