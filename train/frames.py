#!/usr/bin/env python3
"""Renders random scenes with few samples and with many, and packs what a network is trained on.

    train/frames.py --out FOLDER --relume relume --network-inputs relume-network-inputs --scenes 400 --jobs 2

A scene is a seed. Its frames are in FOLDER/shards: SEED.json is there once they are whole, so that the same
command goes on where it was ended. What failed is in FOLDER/failed, and is not tried again.

SEED.json: layout, crop, exposure, names of "inputs" and "candidates", and for each frame spp, sampler, seed.
SEED.inputs.npy: frames x inputs x height x width; SEED.candidates.npy: frames x (3 candidates) x height x width,
RGB radiance times "scale"; SEED.reference.npy: 6 x height x width, the same, and root of its variance. All half
floats. With --extras SEED.extras.npy, frames x "extras" x height x width, floats as the program wrote them.
"""

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np

import exr
import scenes

SPP = [2, 4, 6, 8, 8, 8, 12, 16, 32, 64]
HALVES = 0.25  # of the frames are of one half of the samples alone
PREVIEW = 96
VIEWS = [1, 1, 1.5, 2, 3, 4]  # the whole picture's side, in sides of a frame


def run(command, timeout=600):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=timeout)
    if done.returncode != 0:
        raise RuntimeError("%s\nended with %d: %s" % (" ".join(command), done.returncode,
                                                      done.stdout.decode(errors="replace")[-2000:]))


def render(options, scene, out, size, spp, *more):
    run([options.relume, "render", scene, "--size", "%dx%d" % (size, size), "--spp", str(spp), "--workers", "1",
         "--threads", "1", "--allow-black", "--quiet", "-o", out, *more])


def luminance(rgb):
    return rgb @ np.array([0.2126, 0.7152, 0.0722], np.float32)


def smoothed(plane, times=3):
    for _ in range(times):
        padded = np.pad(plane, 1, mode="edge")
        plane = sum(padded[y:y + plane.shape[0], x:x + plane.shape[1]] for y in range(3) for x in range(3)) / 9
    return plane


def is_hit(planes):
    """Where there is a surface."""
    return sum(np.abs(planes["N." + c]) for c in "XYZ") > 0.1


def detail(planes):
    """How much there is to see at each pixel of a preview: edges of albedo, normal and smoothed light."""
    total = 0
    light = luminance(exr.rgb(planes, "noisy."))
    light = np.log(smoothed(light) + 1e-3 * light.mean() + 1e-12)
    seen = [(planes["albedo." + c], 1.0) for c in "RGB"] + [(planes["N." + c], 0.5) for c in "XYZ"]
    for plane, weight in seen + [(light, 0.4)]:
        gy, gx = np.gradient(smoothed(plane, 1))
        total = total + weight * np.minimum(np.hypot(gx, gy), 0.3)
    return total


def fault(planes, distance):
    """Why a preview is not worth a scene's time, or None."""
    light = luminance(exr.rgb(planes, "noisy."))
    hit = is_hit(planes)
    if not np.isfinite(light).all() or light.mean() <= 0:
        return "no light"
    if hit.mean() < 0.25:
        return "hardly anything is seen"
    if (light <= 1e-3 * light.mean()).mean() > 0.45:
        return "much of it is black"
    around = smoothed(light)
    noise = luminance(exr.rgb(planes, "variance.")) / (around ** 2 + 0.01 * light.mean() ** 2)
    if np.minimum(noise, 4).mean() > 0.6:
        return "so noisy that the reference would be, too"
    if (hit & (planes["Z"] < 0.12 * distance)).mean() > 0.4:
        return "something stands before the camera"
    if detail(planes).mean() < 0.04:
        return "nothing but even surfaces"
    return None


def choose_crop(rng, planes, side):
    """(size of the picture, x0, y0): a square of `side`, rather where there is much to see."""
    size = int(side * rng.choice(VIEWS))
    seen = (detail(planes) + 0.01) * (0.1 + is_hit(planes))
    places, scores = [], []
    for _ in range(10):
        x, y = (int(v) for v in rng.integers(0, size - side + 1, 2))
        a, b = (slice(int(v * PREVIEW / size), max(1, int((v + side) * PREVIEW / size))) for v in (y, x))
        places.append((size, x, y))
        scores.append(seen[a, b].mean() ** 2)
    scores = np.array(scores) / sum(scores)
    return places[int(rng.choice(len(places), p=scores))]


def draw_exposure(rng, planes):
    light = luminance(exr.rgb(planes, "noisy."))
    mean = np.exp(np.mean(np.log(np.maximum(smoothed(light), 1e-2 * light.mean()))))
    stops = rng.normal() * 1.2
    if rng.random() < 0.08:
        stops += rng.choice([-4, 4])
    return float(0.18 / mean * 2.0 ** stops)


def draw_frames(rng, count):
    """[(spp, sampler, filter)]"""
    result = []
    for _ in range(count):
        spp = int(rng.choice(SPP))
        if spp >= 6 and rng.random() < 0.4:
            result.append((spp, "adaptive", "bilateral" if rng.random() < 0.5 else "none"))
        else:
            result.append((spp, "uniform:pilot=2", "none"))
    return result


def read_dump(file_name):
    """Header, inputs C x H x W, candidates 3K x H x W, reference 3 x H x W, extras of relume-network-inputs' file."""
    with open(file_name, "rb") as source:
        header = json.loads(source.readline())
        planes = np.frombuffer(source.read(), "<f4")
    inputs, candidates, extras = len(header["inputs"]), 3 * len(header["candidates"]), len(header.get("extras", []))
    shape = (inputs + candidates + 3 + extras, header["height"], header["width"])
    if planes.size != np.prod(shape) or not header["reference"]:
        raise RuntimeError("%s: %d numbers for planes %s" % (file_name, planes.size, shape))
    planes = planes.reshape(shape)
    return header, *np.split(planes, np.cumsum([inputs, candidates, 3]))


def half(planes):
    return np.clip(np.nan_to_num(planes, nan=0.0, posinf=6e4, neginf=-6e4), -6e4, 6e4).astype(np.float16)


def make_scene(options, seed):
    """All frames of one scene."""
    rng = np.random.default_rng([seed, 77])
    folder = os.path.join(options.out, "scenes", "%06d" % seed)
    shutil.rmtree(folder, ignore_errors=True)
    started = time.time()
    for attempt in range(6):
        scene, layout = scenes.make(seed, folder, attempt=attempt)
        preview = os.path.join(folder, "preview.exr")
        render(options, scene.write(), preview, PREVIEW, 16, "--sampler", "uniform", "--filter", "none")
        planes = exr.read(preview)
        wrong = fault(planes, np.linalg.norm(scene.view[1] - scene.view[0]))
        if wrong is None:
            break
        print("attempt %d (%s): %s" % (attempt, layout, wrong))
        shutil.rmtree(folder)
    else:
        raise RuntimeError("no view of the scene is worth its time")
    exposure = draw_exposure(rng, planes)
    path = scene.write(exposure)
    side = options.size
    size, x, y = choose_crop(rng, planes, side)
    crop = ["--crop", "%d,%d,%d,%d" % (x, y, x + side, y + side)]
    reference = os.path.join(folder, "reference.exr")
    seconds = {"scene": time.time() - started}
    started = time.time()
    render(options, path, reference, size, options.reference_spp, "--sampler", "uniform", "--filter", "none",
           "--layers", "all", "--seed", "1000", *crop)
    seconds["reference"] = time.time() - started
    seconds["frames"] = seconds["inputs"] = 0.0
    frames, inputs, candidates, extras = [], [], [], []
    for k, (spp, sampler, filter_) in enumerate(draw_frames(rng, options.frames)):
        noisy = os.path.join(folder, "noisy_%d.exr" % k)
        started = time.time()
        render(options, path, noisy, size, spp, "--sampler", sampler, "--filter", filter_, "--layers", "all",
               "--seed", str(k + 1), *crop)
        seconds["frames"] += time.time() - started
        started = time.time()
        dump = os.path.join(folder, "noisy_%d.bin" % k)
        # Filters are tried on halves of the samples: the network sees such, too.
        half_alone = ["--half", str(rng.integers(2))] if spp >= 4 and rng.random() < HALVES else []
        run([*options.network_inputs.split(), noisy, "--reference", reference, "-o", dump, *half_alone])
        header, first, second, truth, more = read_dump(dump)
        seconds["inputs"] += time.time() - started
        frames.append({"spp": spp, "sampler": sampler, "filter": filter_, "seed": k + 1, "half": bool(half_alone), "mean_spp": header.get("spp", spp)})
        inputs.append(half(first))
        candidates.append(second)
        extras.append(more)
        if k and (header["inputs"], header["candidates"]) != names:
            raise RuntimeError("frames of one scene have other inputs or candidates")
        names = (header["inputs"], header["candidates"])
    mean = max(float(np.nanmean(truth)), 1e-12)
    scale = float(2.0 ** -np.round(np.log2(mean)))
    noise = np.sqrt(np.maximum([exr.read(reference)["variance." + c] for c in "RGB"], 0))
    record = {"seed": seed, "layout": layout, "attempt": attempt, "exposure": exposure, "view": size, "crop": [x, y],
              "size": side, "reference_spp": options.reference_spp, "scale": scale, "inputs": names[0],
              "candidates": names[1], "frames": frames, "seconds": {k: round(v, 3) for k, v in seconds.items()}}
    shards = os.path.join(options.out, "shards")
    os.makedirs(shards, exist_ok=True)
    base = os.path.join(shards, "%06d" % seed)
    np.save(base + ".inputs.npy", np.stack(inputs))
    np.save(base + ".candidates.npy", half(np.stack(candidates) * scale))
    np.save(base + ".reference.npy", half(np.concatenate([truth, noise]) * scale))
    if options.extras:
        record["extras"] = header.get("extras", [])
        np.save(base + ".extras.npy", np.stack(extras).astype(np.float32))
    with open(base + ".part", "w") as out:
        json.dump(record, out, indent=1)
    os.replace(base + ".part", base + ".json")
    if not options.keep:
        shutil.rmtree(folder)


class Jobs:
    """Runs this program once a scene, several at a time, each in a process group of its own."""

    def __init__(self, options):
        self.options = options
        self.running = {}  # seed: (process, log)
        self.done = self.failed = 0
        self.scratch = os.path.join(os.path.abspath(options.out), "tmp")
        for name in ("shards", "failed", "scenes", "tmp"):
            os.makedirs(os.path.join(options.out, name), exist_ok=True)

    def is_over(self, seed):
        return any(os.path.exists(os.path.join(self.options.out, folder, "%06d.%s" % (seed, kind)))
                   for folder, kind in (("shards", "json"), ("failed", "txt")))

    def start(self, seed):
        o = self.options
        log_name = os.path.join(o.out, "scenes", "%06d.log" % seed)
        log = open(log_name, "w")
        command = [sys.executable, os.path.abspath(__file__), "--one", str(seed)]
        for name in ("out", "relume", "network_inputs", "size", "frames", "reference_spp"):
            command += ["--" + name.replace("_", "-"), str(getattr(o, name))]
        command += ["--" + name for name in ("keep", "extras") if getattr(o, name)]
        environment = dict(os.environ, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1", TMPDIR=self.scratch)
        process = subprocess.Popen(command, stdout=log, stderr=log, start_new_session=True, env=environment)
        log.close()
        self.running[seed] = (process, log_name)

    def collect(self):
        for seed, (process, log_name) in list(self.running.items()):
            if process.poll() is None:
                continue
            del self.running[seed]
            if process.returncode == 0:
                self.done += 1
                os.remove(log_name)
            else:
                self.failed += 1
                os.replace(log_name, os.path.join(self.options.out, "failed", "%06d.txt" % seed))
                print("scene %d failed: see %s/failed" % (seed, self.options.out), flush=True)

    def stop(self):
        """Ends what runs, with all that it started."""
        for process, _ in self.running.values():
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
            process.wait()
        self.running = {}
        shutil.rmtree(self.scratch, ignore_errors=True)


def make_all(options):
    jobs = Jobs(options)
    started = time.time()
    seeds = iter(s for s in range(options.first, options.first + options.scenes) if not jobs.is_over(s))
    left, told = True, 0
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    try:
        while (left or jobs.running) and time.time() - started < options.seconds:
            while left and len(jobs.running) < options.jobs:
                seed = next(seeds, None)
                left = seed is not None
                if left:
                    jobs.start(seed)
            time.sleep(0.1)
            jobs.collect()
            if jobs.done + jobs.failed >= told + 10:
                told = jobs.done + jobs.failed
                print("%d scenes, %d failed, %.0f s" % (jobs.done, jobs.failed, time.time() - started), flush=True)
    finally:
        unfinished = len(jobs.running)
        jobs.stop()
    print("%d scenes made, %d failed, %d ended unfinished, %.1f s" % (jobs.done, jobs.failed, unfinished,
                                                                    time.time() - started), flush=True)
    return jobs


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, help="folder of the work")
    parser.add_argument("--relume", default="relume")
    parser.add_argument("--network-inputs", default="relume-network-inputs", help="program, may have options")
    parser.add_argument("--scenes", type=int, default=400)
    parser.add_argument("--first", type=int, default=1, help="seed of the first")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--size", type=int, default=160, help="side of a frame, pixels")
    parser.add_argument("--frames", type=int, default=3, help="noisy ones a scene")
    parser.add_argument("--reference-spp", type=int, default=512)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="scenes that are not done by then are dropped")
    parser.add_argument("--keep", action="store_true", help="scenes and images, too")
    parser.add_argument("--extras", action="store_true", help="what other networks see, too")
    parser.add_argument("--one", type=int, help="this scene alone, in this process")
    options = parser.parse_args(arguments)
    if options.one is not None:
        make_scene(options, options.one)
        return 0
    jobs = make_all(options)
    return 1 if jobs.failed and not jobs.done else 0


if __name__ == "__main__":
    sys.exit(main())
