"""Pictures for pages: sRGB views, error maps, sample maps, as PNG in data URIs."""
import base64
import io

import numpy as np

from matplotlib import colormaps
from PIL import Image

from . import exr

ERROR_RANGE = (-4.0, 0.0)  # log10 of the relative squared error: black to yellow


def srgb(image):
    """Bytes of linear radiance at brightness 1; what is not finite is black."""
    x = np.clip(np.nan_to_num(image.astype(np.float64), nan=0, posinf=0, neginf=0), 0, 1)
    return np.round(255 * np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)).astype(np.uint8)


def error_map(image, reference):
    """Relative squared error of each pixel, as MrSE has it, on a log scale."""
    image, reference = image.astype(np.float64), reference.astype(np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        error = ((image - reference) ** 2 / (reference ** 2 + 1e-3)).mean(axis=2)
    low, high = ERROR_RANGE
    value = (np.log10(np.maximum(np.nan_to_num(error, nan=1, posinf=1), 10 ** low)) - low) / (high - low)
    return _colours(value, "inferno")


def sample_map(counts):
    """Samples of each pixel on a log scale from a quarter of the mean to four times the mean."""
    mean = max(float(counts.mean()), 1e-9)
    return _colours(np.log2(np.maximum(counts / mean, 1e-3)) / 4 + 0.5, "viridis")


def _colours(values, name):
    return np.round(255 * colormaps[name](np.clip(values, 0, 1))[:, :, :3]).astype(np.uint8)


def sharpness(image, reference):
    """Sum of the differences of neighbours' luma over that of the reference: below 1 detail is gone."""
    def steps(x):
        luma = srgb(x).astype(np.float64) @ [0.2126, 0.7152, 0.0722]
        return np.abs(np.diff(luma, axis=0)).sum() + np.abs(np.diff(luma, axis=1)).sum()
    return steps(image) / max(steps(reference), 1e-9)


def uri(pixels):
    out = io.BytesIO()
    Image.fromarray(pixels).save(out, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(out.getvalue()).decode()


def strip(entries, reference):
    """entries: (label, path of an EXR). Views and error maps; the reference is first."""
    truth = exr.read_rgb(reference)
    out = [{"label": "reference", "image": uri(srgb(truth)), "error": None}]
    for label, path in entries:
        image = exr.read_rgb(path)
        out.append({"label": label, "image": uri(srgb(image)), "error": uri(error_map(image, truth))})
    return out
