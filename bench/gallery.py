#!/usr/bin/env python3
"""Renders every scene of ../shared/scenes small, for docs/gallery; prints what each render noted.

Environment maps are those that the scenes' README names for them; a scene without a camera gets one here.
"""
import argparse
import json
import os
import subprocess
import sys

SKY, STUDIO = "qwantani_afternoon_puresky_1k.hdr", "studio_small_08_1k.hdr"
# name: (file, size, environment, further options)
SCENES = {
    "cornell-box": ("cornell-box/scene.pbrt", "256x256", None, []),
    "coffee": ("coffee/scene.pbrt", "240x300", None, []),
    "staircase": ("staircase/scene.pbrt", "198x352", None, []),
    "staircase2": ("staircase2/scene-v4.pbrt", "256x256", None, []),
    "classroom": ("classroom/scene.pbrt", "384x216", None, []),
    "veach-ajar": ("veach-ajar/scene.pbrt", "384x216", None, []),
    "veach-ajar-v4": ("veach-ajar/scene-v4.pbrt", "384x216", None, []),
    "sponza": ("sponza/Sponza.gltf", "384x216", SKY,
               ["--look-from=-8.5,2.2,-0.4", "--look-at=4,3.4,0.4", "--fov", "60", "--environment-scale", "12"]),
    "chess": ("chess/ABeautifulGame.gltf", "384x216", STUDIO,
              ["--look-from=0.42,0.30,0.42", "--look-at=0,0.02,0", "--fov", "40"]),
    "toycar": ("toycar/ToyCar.gltf", "384x216", STUDIO, []),
    "milk-truck": ("milk-truck/CesiumMilkTruck.gltf", "384x216", SKY,
                   ["--look-from=5,2.4,-3.6", "--look-at=0,1.1,0", "--fov", "40", "--time", "0.3", "--shutter", "0.06"]),
}


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=list(SCENES), help="scenes [all]")
    parser.add_argument("--scenes", default=os.path.join(here, "..", "..", "shared", "scenes"), help="their folder")
    parser.add_argument("--relume", default=os.path.join(here, "..", "build", "ci", "bin", "relume"))
    parser.add_argument("--spp", type=int, default=1024)
    parser.add_argument("--out", default=os.path.join(here, "..", "docs", "gallery"))
    options = parser.parse_args()
    os.makedirs(options.out, exist_ok=True)
    failed = []
    for name in options.names:
        file, size, environment, further = SCENES[name]
        scene = os.path.join(options.scenes, file)
        if not os.path.exists(scene):
            print(f"{name}: skipped, {scene} is absent")
            continue
        image = os.path.join(options.out, name)
        command = [options.relume, "render", scene, "--size", size, "--spp", str(options.spp), "--sampler", "uniform",
                   "--filter", "none", "--workers", "1", "--threads", "2", "--json", "-o", f"{image}.exr", "--png",
                   f"{image}.png", "--report", f"{image}.json"] + further
        if environment:
            command += ["--environment", os.path.join(options.scenes, "environments", environment)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            failed.append(name)
            print(f"{name}: {done.stderr.strip().splitlines()[-1]}")
            continue
        with open(f"{image}.json") as file:
            report = json.load(file)
        print(f"{name}: {report.get('notes', [])}")
        os.remove(f"{image}.exr")
        os.remove(f"{image}.json")
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
