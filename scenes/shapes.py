"""Meshes: quads, boxes, lathe bodies, tubes, cushions, leaves. Metres, +y up, counter-clockwise
seen from outside."""

import math


class Shape:
    def __init__(self):
        self.positions, self.normals, self.uvs, self.triangles = [], [], [], []

    def add(self, other):
        base = len(self.positions)
        self.positions += other.positions
        self.normals += other.normals
        self.uvs += other.uvs
        self.triangles += [tuple(i + base for i in t) for t in other.triangles]
        return self

    def without_uvs(self):
        self.uvs = []
        return self


def unit(v):
    length = math.sqrt(sum(c * c for c in v))
    return tuple(c / length for c in v) if length > 0 else (0.0, 1.0, 0.0)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def quad(corner, u, v, uv_size=(1, 1)):
    """The parallelogram corner, +u, +u+v, +v; its front is where that is counter-clockwise.
    uv (0, 1) is at `corner`, so that a picture stands upright; times uv_size."""
    shape = Shape()
    n = unit(cross(u, v))
    for s, t in ((0, 0), (1, 0), (1, 1), (0, 1)):
        shape.positions.append(tuple(c + s * a + t * b for c, a, b in zip(corner, u, v)))
        shape.normals.append(n)
        shape.uvs.append((s * uv_size[0], (1 - t) * uv_size[1]))
    shape.triangles = [(0, 1, 2), (0, 2, 3)]
    return shape


def box(low, high):
    shape = Shape()
    (x, y, z), (a, b, c) = low, sub(high, low)
    for corner, u, v in (
        ((x, y, z + c), (a, 0, 0), (0, b, 0)), ((x + a, y, z), (-a, 0, 0), (0, b, 0)),
        ((x + a, y, z + c), (0, 0, -c), (0, b, 0)), ((x, y, z), (0, 0, c), (0, b, 0)),
        ((x, y + b, z + c), (a, 0, 0), (0, 0, -c)), ((x, y, z), (a, 0, 0), (0, 0, c)),
    ):
        size = (math.sqrt(sum(e * e for e in u)), math.sqrt(sum(e * e for e in v)))
        shape.add(quad(corner, u, v, size))
    return shape


def _stitch(shape, rows, columns, first=0):
    """Triangles of a grid of vertices, rows upward and columns to the right seen from the front;
    those without an area are left out."""
    for r in range(rows - 1):
        for c in range(columns - 1):
            i = first + r * columns + c
            for t in ((i, i + 1, i + columns + 1), (i, i + columns + 1, i + columns)):
                p = [shape.positions[k] for k in t]
                if sum(e * e for e in cross(sub(p[1], p[0]), sub(p[2], p[0]))) > 1e-18:
                    shape.triangles.append(t)


def curve(points, steps):
    """Catmull-Rom through `points`, `steps` pieces between two of them."""
    out = []
    for i in range(len(points) - 1):
        p0, p1, p2 = points[max(i - 1, 0)], points[i], points[i + 1]
        p3 = points[min(i + 2, len(points) - 1)]
        for k in range(steps):
            t = k / steps
            out.append(tuple(
                0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t * t
                       + (3 * b - a - 3 * c + d) * t ** 3)
                for a, b, c, d in zip(p0, p1, p2, p3)))
    return out + [points[-1]]


def lathe(profile, segments, crease=40, uv_size=(1, 1)):
    """Turns (radius, height) about +y. The outside is on the right of the way along the profile:
    up on the outside, then down on the inside of a vessel. Sharper turns than `crease` degrees
    stay edges."""
    steps = [sub(b, a) for a, b in zip(profile, profile[1:])]
    flat = [unit((d[1], -d[0])) for d in steps]  # normal of each piece
    closed = math.dist(profile[0], profile[-1]) < 1e-9  # a ring's profile
    rings, way = [], 0.0
    for i, point in enumerate(profile):
        before = flat[i - 1] if i > 0 or closed else flat[0]
        after = flat[i % len(flat)] if i < len(flat) or closed else flat[-1]
        if i > 0:
            way += math.hypot(*steps[i - 1])
        if before[0] * after[0] + before[1] * after[1] < math.cos(math.radians(crease)):
            rings += [(point, before, way), (point, after, way)]
        else:
            rings.append((point, unit((before[0] + after[0], before[1] + after[1])), way))
    shape = Shape()
    for (radius, height), (out, up), along in rings:
        if radius == 0:
            out, up = 0.0, math.copysign(1, up)
        for k in range(segments + 1):
            angle = 2 * math.pi * (k % segments) / segments
            c, s = math.cos(angle), -math.sin(angle)
            shape.positions.append((radius * c, height, radius * s))
            shape.normals.append((out * c, up, out * s))
            shape.uvs.append((uv_size[0] * k / segments, uv_size[1] * (1 - along / way)))
    _stitch(shape, len(rings), segments + 1)
    return shape


def arc(center, radius, begin, end, steps):
    """(radius, height) points of a circle's arc for lathe; degrees, 0 = outward, 90 = up."""
    angles = [math.radians(begin + (end - begin) * k / steps) for k in range(steps + 1)]
    points = [(center[0] + radius * math.cos(a), center[1] + radius * math.sin(a)) for a in angles]
    return [(0.0 if abs(r) < 1e-9 else r, h) for r, h in points]


def sphere(radius, steps):
    return lathe(arc((0, 0), radius, -90, 90, steps), 2 * steps)


def torus(major, minor, segments, around):
    return lathe(arc((major, 0), minor, -180, 180, around), segments, crease=180)


def tube(path, radii, around):
    """A pipe along `path`, open at its ends; radii one for each point, or one for all."""
    if not isinstance(radii, (list, tuple)):
        radii = [radii] * len(path)
    shape = Shape()
    side = None
    for i, point in enumerate(path):
        ahead = unit(sub(path[min(i + 1, len(path) - 1)], path[max(i - 1, 0)]))
        if side is None:
            side = unit(cross(ahead, (0, 1, 0) if abs(ahead[1]) < 0.9 else (1, 0, 0)))
        other = unit(cross(ahead, side))
        side = cross(other, ahead)  # carried along without twist
        for k in range(around + 1):
            a = 2 * math.pi * (k % around) / around
            n = tuple(math.cos(a) * s + math.sin(a) * o for s, o in zip(side, other))
            shape.positions.append(tuple(p + radii[i] * c for p, c in zip(point, n)))
            shape.normals.append(n)
            shape.uvs.append((k / around, i / (len(path) - 1)))
    _stitch(shape, len(path), around + 1)
    return shape


def rounded_box(size, radius, corner=3, flat=0, bulge=0.0):
    """Centred. `corner` pieces over an eighth of a turn; with `flat` more pieces in between, faces
    swell by `bulge`. uv in metres."""
    half = tuple(s / 2 for s in size)
    shape = Shape()

    def line(h):
        ends = [math.tan(math.pi / 4 * (1 - k / corner)) for k in range(corner + 1)]
        core = h - radius
        middle = [(core * (2 * (k + 1) / (flat + 1) - 1), 0.0) for k in range(flat)]
        return ([(-core, -t) for t in ends] + middle + [(core, t) for t in reversed(ends)])

    for axis in range(3):
        for sign in (-1, 1):
            u, v = ((axis + 1) % 3, (axis + 2) % 3)
            if sign < 0:
                u, v = v, u
            first = len(shape.positions)
            across, up = line(half[u]), line(half[v])
            for b, tb in up:
                for a, ta in across:
                    n = [0.0] * 3
                    n[u], n[v], n[axis] = ta, tb, sign
                    n = unit(n)
                    p = [radius * c for c in n]
                    p[u] += a
                    p[v] += b
                    p[axis] += sign * (half[axis] - radius)
                    s, t = a / (half[u] - radius), b / (half[v] - radius)
                    p[axis] += sign * bulge * max(0, 1 - s * s) * max(0, 1 - t * t)
                    shape.positions.append(tuple(p))
                    shape.normals.append(n)
                    shape.uvs.append((p[u], p[v]))
            _stitch(shape, len(up), len(across), first)
    return smooth(shape) if bulge else shape


def pillow(width, height, thickness, steps):
    """Two swollen sheets sewn together at the rim; stands in the xy plane."""
    shape = Shape()
    for sign in (1, -1):
        first = len(shape.positions)
        for j in range(steps + 1):
            for i in range(steps + 1):
                # Denser toward the rim, where it turns.
                s, t = math.sin(math.pi * (i / steps - 0.5)), math.sin(math.pi * (j / steps - 0.5))
                swell = max(0.0, (1 - s * s) * (1 - t * t)) ** 0.42
                pinch = 1 - 0.10 * (1 - abs(s)) * t * t, 1 - 0.10 * (1 - abs(t)) * s * s
                shape.positions.append((sign * s * width / 2 * pinch[1],
                                        t * height / 2 * pinch[0], sign * swell * thickness / 2))
                shape.uvs.append((s * width / 2, t * height / 2))
        _stitch(shape, steps + 1, steps + 1, first)
    return smooth(shape)


def smooth(shape):
    """Normals from the triangles, by area, shared by vertices at the same place."""
    sums = {}
    keys = [tuple(round(c, 5) for c in p) for p in shape.positions]
    for t in shape.triangles:
        p = [shape.positions[i] for i in t]
        n = cross(sub(p[1], p[0]), sub(p[2], p[0]))
        for i in t:
            old = sums.get(keys[i], (0, 0, 0))
            sums[keys[i]] = tuple(a + b for a, b in zip(old, n))
    shape.normals = [unit(sums.get(k, (0, 1, 0))) for k in keys]
    return shape


def sheet(rows, columns, point):
    """A smooth open surface: point(s, t) for s to the right and t upward, both 0..1."""
    shape = Shape()
    for j in range(rows + 1):
        for i in range(columns + 1):
            shape.positions.append(point(i / columns, j / rows))
            shape.uvs.append((i / columns, 1 - j / rows))
    _stitch(shape, rows + 1, columns + 1)
    return smooth(shape)
