"""Curves of time against error: interpolation, the front, and the time that an error takes. All on log axes."""
import math


def geomean(values):
    values = list(values)
    return math.exp(sum(math.log(v) for v in values) / len(values)) if values else float("nan")


def curve(points):
    """(time, error) sorted by time; of points at one time the best."""
    best = {}
    for time, error in points:
        best[time] = min(error, best.get(time, math.inf))
    return sorted(best.items())


def _between(x, x0, y0, x1, y1):
    """Along the straight line through two points on log axes."""
    t = (math.log(x) - math.log(x0)) / (math.log(x1) - math.log(x0))
    return math.exp(math.log(y0) + t * (math.log(y1) - math.log(y0)))


def error_at(points, time):
    """The least error that a method has after `time`: None before its first point; after the last its best so far, for
    more time never has to make an image worse."""
    points = curve(points)
    if not points or time < points[0][0]:
        return None
    best = math.inf
    for k, (t, e) in enumerate(points):
        if t > time:
            t0, e0 = points[k - 1]
            return min(best, _between(time, t0, e0, t, e))
        best = min(best, e)
    return best


def time_for(points, error, limit=64):
    """(time, how) that a method takes to come down to `error`. how: "" between its points, "<" if its first point is
    better already, "~" extrapolated by its last two points' slope. (None, ">") if it does not fall, or not within `limit`
    times its last point's time."""
    points = curve(points)
    if not points:
        return None, ">"
    if points[0][1] <= error:
        return points[0][0], "<"
    for (t0, e0), (t1, e1) in zip(points, points[1:]):
        if e1 <= error:
            return (_between(error, e0, t0, e1, t1) if e1 < e0 else t1), ""
    if len(points) < 2:
        return None, ">"
    (t0, e0), (t1, e1) = points[-2:]
    slope = (math.log(e1) - math.log(e0)) / (math.log(t1) - math.log(t0))
    if slope >= -0.05:  # steps of 64 times the samples would gain less than a fifth
        return None, ">"
    time = t1 * math.exp((math.log(error) - math.log(e1)) / slope)
    return (time, "~") if time <= limit * t1 else (None, ">")


def front(points):
    """Indices of the (time, error) that no other one beats in both, by time."""
    order = sorted(range(len(points)), key=lambda i: points[i])
    out, best = [], math.inf
    for i in order:
        if points[i][1] < best:
            out.append(i)
            best = points[i][1]
    return out


def best_at(curves, time):
    """(error, name) of the method that is best after `time`; (None, None) if none has finished by then."""
    best = (None, None)
    for name, points in curves.items():
        error = error_at(points, time)
        if error is not None and (best[0] is None or error < best[0]):
            best = (error, name)
    return best


def distance_from_front(curves, name):
    """How far a method's points leave the front of the others: for each of its (time, error) the error over that of the
    best other method after the same time (None: no other has finished by then), and that method's name."""
    others = {k: v for k, v in curves.items() if k != name}
    out = []
    for time, error in curves[name]:
        best, by = best_at(others, time)
        out.append((time, error, error / best if best else None, by))
    return out
