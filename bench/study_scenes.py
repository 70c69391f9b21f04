"""The scenes that bench/sampling and bench/filters study, and their views, at about 25,000 pixels."""
import math
import os
import statistics
import sys

SKY, STUDIO = "qwantani_afternoon_puresky_1k.hdr", "studio_small_08_1k.hdr"
# name: (file, size, environment, further options); "own/": scenes of this repository
SCENES = {
    "cornell-box": ("cornell-box/scene.pbrt", "160x160", None, []),
    "coffee": ("coffee/scene.pbrt", "144x180", None, []),
    "staircase": ("staircase/scene.pbrt", "120x213", None, []),
    "staircase2": ("staircase2/scene-v4.pbrt", "160x160", None, []),
    "classroom": ("classroom/scene.pbrt", "213x120", None, []),
    "veach-ajar": ("veach-ajar/scene-v4.pbrt", "213x120", None, []),
    "sponza": ("sponza/Sponza.gltf", "213x120", SKY,
               ["--look-from=-8.5,2.2,-0.4", "--look-at=4,3.4,0.4", "--fov", "60", "--environment-scale", "12"]),
    "chess": ("chess/ABeautifulGame.gltf", "213x120", STUDIO,
              ["--look-from=0.42,0.30,0.42", "--look-at=0,0.02,0", "--fov", "40"]),
    "toycar": ("toycar/ToyCar.gltf", "213x120", STUDIO, []),
    "milk-truck": ("milk-truck/CesiumMilkTruck.gltf", "213x120", SKY,
                   ["--look-from=5,2.4,-3.6", "--look-at=0,1.1,0", "--fov", "40", "--time", "0.3", "--shutter", "0.06"]),
    "room": ("own/room/room.gltf", "184x138", None, []),
    "cornell-glossy": ("own/cornell/cornell.gltf", "160x160", None, []),
}


def find(name, scenes):
    """The scene's file, or nothing, said on stderr."""
    file = SCENES[name][0]
    here = os.path.dirname(os.path.abspath(__file__))
    path = os.path.join(here, "..", "scenes", file[4:]) if file.startswith("own/") else os.path.join(scenes, file)
    if os.path.exists(path):
        return path
    print(f"{name}: skipped, {path} is absent", file=sys.stderr)
    return None


def arguments(name, path, scenes):
    """What relume-sampling-study and relume-filter-study take of a scene."""
    _, size, environment, further = SCENES[name]
    command = [path, "--name", name, "--size", size] + further
    if environment:
        command += ["--environment", os.path.join(scenes, "environments", environment)]
    return command


def geomean(values):
    return math.exp(statistics.fmean(math.log(max(v, 1e-12)) for v in values))
