"""Does another method beat the default after the same time?"""
from . import front
from .methods import DEFAULT

# Of a quick run's processor time, from one to the next of the same command on a machine that does other things, too:
# the default counts as beaten only where it would be with so much less.
TIME_NOISE = 0.05


def lines_of(points, floor):
    """(time, MrSE) by method. What is below the reference's own error counts as that: it can't be told apart."""
    out = {}
    for point in points:
        if point.stop == "spp":
            out.setdefault(point.method, []).append((point.time, max(point.errors["mrse"], floor)))
    return out


def judge(points, truths, allowed):
    """(text, whether it is beaten) for each scene and number of samples of the default. Beaten: its MrSE is more than
    `allowed` times that of another method after the same time, less TIME_NOISE; others are interpolated, and get no better
    after their last point. A scene without the default counts as beaten."""
    out = []
    for scene in dict.fromkeys(p.scene for p in points):
        of = [p for p in points if p.scene == scene]
        floor = truths[scene]["floor"]
        lines = lines_of(of, floor["mrse"] if floor else 0)
        ours = [p for p in of if p.method == DEFAULT and p.stop == "spp"]
        lines[DEFAULT] = [(time * (1 - TIME_NOISE), error) for time, error in lines.get(DEFAULT, [])]
        if not ours:
            out.append((f"{scene}: the default was not run", True))
            continue
        for point, (_, error, ratio, by) in zip(ours, front.distance_from_front(lines, DEFAULT)):
            what = f"{scene}, {point.spp:g} spp: MrSE {error:.4g} after {point.time:.2f} s"
            if ratio is None:
                out.append((f"{what}, before all others", False))
            elif ratio > allowed:
                out.append((f"{what}, {ratio:.2f} of {by} after the same time: BEATEN, at most {allowed:g} is allowed", True))
            else:
                out.append((f"{what}, {ratio:.2f} of {by} after the same time", False))
    return out
