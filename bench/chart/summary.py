"""Means over seeds, and curves of each scene and over all scenes."""
import dataclasses
import statistics

from .front import geomean
from .methods import BASE, Method

MEASURES = {"mrse": "MrSE", "ssim": "1 \N{MINUS SIGN} SSIM", "flip": "FLIP"}


@dataclasses.dataclass
class Point:
    """One scene, method and budget; means over seeds. Seconds are processor seconds over threads but for `wall`."""
    scene: str
    method: Method
    stop: str
    spp: float  # asked for; None with other budgets
    mean_spp: float
    time: float
    sampling: float
    wall: float
    errors: dict  # MEASURES, relmse: less the reference's own error where it is known
    energy: float
    bad: float
    tie: bool  # MrSE is below the reference's own
    seeds: int
    rendered: str = ""  # key of the first seed's render
    image: str = ""  # path of the first seed's image
    chosen: str = ""


def summarise(lines, truths):
    """Points of all lines that did not fail, in their order."""
    groups = {}
    for line in lines:
        key = (line["scene"], Method(line["sampler"], line["filter"]), line["stop"], line["spp"])
        groups.setdefault(key, []).append(line)
    points = []
    for (scene, method, stop, spp), of in groups.items():
        of = [line for line in of if not line["failed"]]
        if not of:
            continue
        floor = truths[scene]["floor"]

        def mean(field, of=of):
            values = [line[field] for line in of if line.get(field) is not None]
            return statistics.fmean(values) if values else float("nan")

        errors = {"ssim": max(1 - mean("ssim"), 1e-6), "flip": max(mean("flip"), 1e-6)}
        for name in ("mrse", "relmse"):  # a tenth of the reference's error stands for what can't be told from it
            errors[name] = max(mean(f"{name}_above"), floor[name] / 10) if floor else max(mean(name), 1e-9)
        points.append(Point(
            scene, method, stop, spp, mean("mean_spp"), max(mean("cpu_seconds"), 1e-6), mean("sampling_seconds"),
            mean("wall_seconds"), errors, mean("energy"), mean("bad"), bool(floor) and mean("mrse_above") < floor["mrse"],
            len(of), of[0]["render"], of[0]["image"], of[0].get("chosen") or ""))
    return points


def curves(points, measure, scene=None):
    """(time, error) of each method's sample budgets."""
    out = {}
    for point in points:
        if point.stop == "spp" and scene in (None, point.scene):
            out.setdefault(point.method, []).append((point.time, point.errors[measure]))
    return out


def find(points, scene, method, spp=None, stop="spp"):
    return next((p for p in points if (p.scene, p.method, p.stop) == (scene, method, stop) and (spp is None or p.spp == spp)),
                None)


def over_all(points, anchor_spp):
    """Points as of one scene: times and errors over those of unfiltered uniform sampling at `anchor_spp` samples of the
    same scene, geometric means over the scenes. Only what all scenes have."""
    scenes = list(dict.fromkeys(p.scene for p in points))
    base = {s: find(points, s, BASE, anchor_spp) for s in scenes}
    if any(b is None for b in base.values()):
        return []
    groups = {}
    for point in points:
        groups.setdefault((point.method, point.stop, point.spp), []).append(point)
    out = []
    for (method, stop, spp), of in groups.items():
        if len({p.scene for p in of}) < len(scenes):
            continue

        def mean(value, of=of):
            return geomean(value(p) / value(base[p.scene]) for p in of)

        out.append(Point(
            "all", method, stop, spp, geomean(p.mean_spp for p in of), mean(lambda p: p.time), mean(lambda p: p.sampling),
            mean(lambda p: p.wall), {m: mean(lambda p, m=m: p.errors[m]) for m in of[0].errors},
            geomean(max(p.energy, 1e-9) for p in of), sum(p.bad for p in of), False, of[0].seeds))
    return out
