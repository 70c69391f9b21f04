"""Does another method beat the default after the same time?"""
import dataclasses

from . import front
from .methods import DEFAULT

# Of a quick run's processor time, from one to the next of the same command on a machine that does other things, too:
# the default counts as beaten only where it would be with so much less.
TIME_NOISE = 0.05

ROUNDS = 3  # in which what is beaten is measured again


def lines_of(points, floor):
    """(time, MrSE) by method. What is below the reference's own error counts as that: it can't be told apart."""
    out = {}
    for point in points:
        if point.stop == "spp":
            out.setdefault(point.method, []).append((point.time, max(point.errors["mrse"], floor)))
    return out


@dataclasses.dataclass(frozen=True)
class Verdict:
    """Of one image of the default: beaten, by which method (None: it was not run, or nothing was), and the line that says so."""
    scene: str
    text: str
    beaten: bool = False
    by: object = None


def judge(points, truths, allowed):
    """Verdicts for each scene and number of samples of the default. Beaten: its MrSE is more than `allowed` times that of
    another method after the same time, less TIME_NOISE; others are interpolated, and get no better after their last point.
    A scene without the default counts as beaten."""
    out = []
    for scene in dict.fromkeys(p.scene for p in points):
        of = [p for p in points if p.scene == scene]
        floor = truths[scene]["floor"]
        lines = lines_of(of, floor["mrse"] if floor else 0)
        ours = [p for p in of if p.method == DEFAULT and p.stop == "spp"]
        lines[DEFAULT] = [(time * (1 - TIME_NOISE), error) for time, error in lines.get(DEFAULT, [])]
        if not ours:
            out.append(Verdict(scene, f"{scene}: the default was not run", True))
            continue
        for point, (_, error, ratio, by) in zip(ours, front.distance_from_front(lines, DEFAULT)):
            what = f"{scene}, {point.spp:g} spp: MrSE {error:.4g} after {point.time:.2f} s"
            if ratio is None:
                out.append(Verdict(scene, f"{what}, before all others"))
                continue
            what += f", {ratio:.2f} of {by} after the same time"
            if ratio > allowed:
                out.append(Verdict(scene, f"{what}: BEATEN, at most {allowed:g} is allowed", True, by))
            else:
                out.append(Verdict(scene, what))
    return out


def confirmed(verdicts, measure_again):
    """The verdicts, once what is beaten was measured again, and what beats it, in turns: another program's burst of work
    that fell on one of the two doesn't decide. Both get as many runs, and each its least time.

    measure_again([(scene, methods), ...]): measures these once more and gives the verdicts anew."""
    for _ in range(ROUNDS):
        again = {}
        for verdict in verdicts:
            if verdict.by:
                again.setdefault(verdict.scene, {DEFAULT: None})[verdict.by] = None
        if not again:
            break
        verdicts = measure_again([(scene, list(methods)) for scene, methods in again.items()])
    return verdicts
