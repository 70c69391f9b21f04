#!/usr/bin/env python3
"""Renders the PBRT scenes of ../shared/scenes and compares with the renders that others made of them.

For each scene and channel: the mean against the interval between the two references, and, after one fitted scale a
channel, the median over pixels of the squared relative error against the nearer reference, all at a quarter of the
scene's width and height. There a pixel of --spp samples is 16 pixels of --spp / 16 of the full size: the pixel filter is
a box, so both are the same average.

Each scene is rendered with two sets of four seeds, which share the samples; a test tells whether the sets differ by their
noise alone.

Needs python3-numpy and python3-openimageio.
"""
import argparse
import os
import re
import subprocess
import sys

import numpy as np
import OpenImageIO as oiio

# scene file, limit of the median
SCENES = {
    "cornell-box": ("scene.pbrt", 0.002),
    "coffee": ("scene.pbrt", 0.006),
    "staircase2": ("scene-v4.pbrt", 0.006),
    "staircase": ("scene.pbrt", 0.006),
    "classroom": ("scene.pbrt", None),
    "veach-ajar": ("scene-v4.pbrt", None),
}
SEEDS = 4  # of each of two sets
# Of veach-ajar only pbrt's render has the floor of the file.
ONE_REFERENCE = {"veach-ajar"}


def read(path):
    picture = oiio.ImageInput.open(path)
    if picture is None:
        sys.exit(f"{path}: {oiio.geterror()}")
    pixels = picture.read_image("float")
    names = list(picture.spec().channelnames)
    picture.close()
    return np.stack([pixels[:, :, names.index(c)] for c in "RGB"], axis=2).astype(np.float64)


def read_tone_mapped(path):
    """Linear radiance behind Tungsten's PNG: the filmic curve of J. Hejl and R. Burgess-Dawson, y = x (6.2 x + 0.5) /
    (x (6.2 x + 1.7) + 0.06), cut off to 8 bits. Where a scene has both files the curve explains every code."""
    picture = oiio.ImageInput.open(path)
    y = picture.read_image("float")[:, :, :3].astype(np.float64) + 0.5 / 255
    picture.close()
    y = np.minimum(y, 0.998)
    a, b, c = 6.2 * (1 - y), 0.5 - 1.7 * y, -0.06 * y
    return (-b + np.sqrt(b * b - 4 * a * c)) / (2 * a) + 0.004


def depth_of(path):
    """Path segments: pbrt counts scattering events."""
    with open(path) as file:
        return int(re.search(r'"integer maxdepth"\s*\[?\s*(\d+)', file.read()).group(1)) + 1


def reduce(image, size):
    height, width = size
    y, x = image.shape[0] // height, image.shape[1] // width
    return image.reshape(height, y, width, x, 3).mean(axis=(1, 3))


def png(path, image):
    """An sRGB view, brightness 1."""
    image = np.clip(image, 0, 1)
    code = np.where(image <= 0.0031308, 12.92 * image, 1.055 * image ** (1 / 2.4) - 0.055)
    out = oiio.ImageOutput.create(path)
    out.open(path, oiio.ImageSpec(image.shape[1], image.shape[0], 3, "uint8"))
    out.write_image(np.round(255 * code).astype(np.uint8))
    out.close()


def z_test(first, second):
    """Do two sets of renders, each of its own seeds, differ by more than the spread within the sets? Student's t per pixel
    and channel (6 degrees of freedom): the mean must be 0 within 4 standard errors, and at most 5.5 and 1.2 % of the
    pixels may be rejected at the levels of 5 and 1 %."""
    first, second = np.array(first), np.array(second)
    spread = (first.var(axis=0, ddof=1) + second.var(axis=0, ddof=1)) / len(first)
    lit = spread > 0
    t = (first.mean(axis=0) - second.mean(axis=0))[lit] / np.sqrt(spread[lit])
    clipped = np.clip(t, -5, 5)
    mean = clipped.mean() / clipped.std() * np.sqrt(t.size / 3)  # the channels go together
    rejected = [float((np.abs(t) > quantile).mean()) for quantile in (2.4469, 3.7074)]
    passed = abs(mean) < 4 and rejected[0] < 0.055 and rejected[1] < 0.012
    print(f"{'':12s} t-test    mean {mean:.2f} standard errors, rejected at 5 %: {100 * rejected[0]:.2f} %, at 1 %: "
          f"{100 * rejected[1]:.2f} %  {'passed' if passed else 'FAILED'}")
    return passed


def compare(name, ours, references, tolerance):
    means = ours.mean(axis=(0, 1))
    every = np.array([r.mean(axis=(0, 1)) for r in references.values()])
    low, high = every.min(axis=0) * (1 - tolerance), every.max(axis=0) * (1 + tolerance)
    inside = bool(np.all((means >= low) & (means <= high)))
    medians = {}
    for key, reference in references.items():
        # One scale a channel, by the median ratio: edges and fireflies don't move it.
        lit = reference > 1e-3
        fitted = np.empty_like(ours)
        for c in range(3):
            ratio = ours[:, :, c][lit[:, :, c]] / reference[:, :, c][lit[:, :, c]]
            fitted[:, :, c] = ours[:, :, c] / np.median(ratio)
        error = ((fitted - reference) ** 2 / (reference**2 + 1e-3)).mean(axis=2)
        medians[key] = float(np.median(error))
    print(f"{name:12s} mean {means.round(4)}  allowed {low.round(4)} to {high.round(4)}  "
          f"{'inside' if inside else 'OUTSIDE'}")
    for key, reference in references.items():
        print(f"{'':12s} {key:9s} mean {reference.mean(axis=(0, 1)).round(4)}  ratio "
              f"{(means / reference.mean(axis=(0, 1))).round(4)}  median {medians[key]:.5f}")
    return inside, min(medians.values())


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=list(SCENES), help="scenes [all]")
    parser.add_argument("--scenes", default=os.path.join(here, "..", "..", "shared", "scenes"), help="their folder")
    parser.add_argument("--relume", default=os.path.join(here, "..", "build", "ci", "bin", "relume"))
    parser.add_argument("--spp", type=int, default=8192, help="at a quarter of the size; 8192 are 512 at the full size")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--out", default="out/references", help="folder of the images")
    options = parser.parse_args()
    os.makedirs(options.out, exist_ok=True)
    failed = []
    for name in options.names:
        scene, limit = SCENES[name]
        folder = os.path.join(options.scenes, name)
        if not os.path.isdir(folder):
            print(f"{name}: skipped, {folder} is absent")
            continue
        pbrt = read(os.path.join(folder, "reference-pbrt.exr"))
        size = pbrt.shape[:2]
        references = {"pbrt-v4": pbrt}
        tungsten = os.path.join(folder, "reference.exr")
        if os.path.exists(tungsten) and name not in ONE_REFERENCE:
            references["Tungsten"] = reduce(read(tungsten), size)
        elif name not in ONE_REFERENCE:
            references["Tungsten"] = reduce(read_tone_mapped(os.path.join(folder, "reference.png")), size)
        sets = ([], [])
        for seed in range(2 * SEEDS):
            image = os.path.join(options.out, f"{name}-{seed}.exr")
            spp = max(2, options.spp // (2 * SEEDS))
            subprocess.run([options.relume, "render", os.path.join(folder, scene), "--size", f"{size[1]}x{size[0]}",
                            "--spp", str(spp), "--sampler", "uniform", "--filter", "none", "--max-depth",
                            str(depth_of(os.path.join(folder, scene))), "--seed", str(seed), "--workers", "1",
                            "--threads", str(options.threads), "--quiet", "-o", image], check=True,
                           stdout=subprocess.DEVNULL)
            sets[seed % 2].append(read(image))
            os.remove(image)
        ours = np.mean(sets[0] + sets[1], axis=0)
        inside, median = compare(name, ours, references, 0.05 if len(references) == 1 else 0.03)
        if not z_test(*sets) or not inside or (limit is not None and median > limit):
            failed.append(name)
        # Ours, the reference, and the relative difference: grey is none, red too bright, blue too dark.
        reference = references.get("Tungsten", pbrt)
        relative = ((ours - reference) / (0.5 * (ours + reference) + 1e-3)).mean(axis=2)
        colours = np.stack([0.2 + np.clip(relative, 0, 0.8), np.full(size, 0.2), 0.2 + np.clip(-relative, 0, 0.8)], axis=2)
        png(os.path.join(options.out, f"{name}-difference.png"), np.concatenate([ours, reference, colours], axis=1))
    if failed:
        sys.exit(f"outside: {', '.join(failed)}")


if __name__ == "__main__":
    main()
