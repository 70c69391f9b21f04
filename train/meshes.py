"""Triangle meshes of numpy arrays. Metres, z up; bodies stand on z = 0 unless said otherwise."""

import numpy as np


class Mesh:
    """p: n x 3 positions; uv: n x 2; f: m x 3 vertices of triangles; n: n x 3 normals or None (flat)."""

    def __init__(self, p, f, uv=None, n=None):
        self.p = np.asarray(p, np.float32).reshape(-1, 3)
        self.f = np.asarray(f, np.int32).reshape(-1, 3)
        self.uv = np.zeros((len(self.p), 2)) if uv is None else np.asarray(uv).reshape(-1, 2)
        self.uv = self.uv.astype(np.float32)
        self.n = None if n is None else np.asarray(n, np.float32).reshape(-1, 3)

    def moved(self, at=(0, 0, 0), turn=(0, 0, 0), scale=1):
        """Scaled (a number or three), turned about x, y, then z (radians), then moved."""
        scale = np.ones(3) * scale
        m = rotation(*turn)
        normals = None
        if self.n is not None:
            normals = unit((self.n / scale) @ m.T)
        return Mesh((self.p * scale) @ m.T + np.asarray(at, float), self.f, self.uv, normals)

    def smooth(self):
        """With normals that are the triangles' around a vertex, by area."""
        a, b, c = (self.p[self.f[:, i]] for i in range(3))
        face = np.cross(b - a, c - a)
        n = np.zeros_like(self.p)
        for i in range(3):
            np.add.at(n, self.f[:, i], face)
        self.n = unit(n)
        return self


def unit(v):
    v = np.asarray(v, float)
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)


def rotation(x, y, z):
    cx, sx, cy, sy, cz, sz = np.cos(x), np.sin(x), np.cos(y), np.sin(y), np.cos(z), np.sin(z)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def joined(meshes):
    """One mesh; has normals if all have them."""
    starts = np.cumsum([0] + [len(m.p) for m in meshes])
    normals = None
    if all(m.n is not None for m in meshes):
        normals = np.concatenate([m.n for m in meshes])
    return Mesh(np.concatenate([m.p for m in meshes]),
                np.concatenate([m.f + s for m, s in zip(meshes, starts)]),
                np.concatenate([m.uv for m in meshes]), normals)


def scattered(mesh, at, turns, scales):
    """Copies of a mesh as one: at n x 3; turns n x 3 x 3 matrices; scales n, or n x 3."""
    scales = np.asarray(scales, float)
    scales = scales[:, None] if scales.ndim == 1 else scales
    count, size = len(at), len(mesh.p)
    p = np.einsum("kij,kvj->kvi", turns, mesh.p[None] * scales[:, None]) + np.asarray(at)[:, None]
    f = mesh.f[None] + (np.arange(count) * size)[:, None, None]
    n = None
    if mesh.n is not None:
        n = unit(np.einsum("kij,kvj->kvi", turns, mesh.n[None] / scales[:, None]))
    return Mesh(p, f, np.tile(mesh.uv, (count, 1)), n)


def random_turns(rng, count, tilt=np.pi):
    """Rotations: about z at random, then tilted by up to `tilt` in a random direction."""
    result = np.empty((count, 3, 3))
    for k in range(count):
        spin, way = rng.uniform(0, 2 * np.pi, 2)
        result[k] = rotation(0, 0, way) @ rotation(rng.uniform(0, tilt), 0, 0) @ rotation(0, 0, spin)
    return result


# --- noise ---


def _lattice(i, j, k, seed):
    h = (i * 374761393 + j * 668265263 + k * 2147483647 + seed * 974634777) & 0xFFFFFFFF
    h = ((h ^ (h >> 13)) * 1274126177) & 0xFFFFFFFF
    return ((h ^ (h >> 16)) & 0xFFFF) / 65535.0


def noise(p, seed=0, octaves=1):
    """Smooth value noise, about -1 to 1, of n x 3 points."""
    p = np.asarray(p, float)
    total, weight, norm = np.zeros(len(p)), 1.0, 0.0
    for octave in range(octaves):
        q = p * 2 ** octave + 17.3 * octave
        base = np.floor(q).astype(np.int64)
        t = q - base
        t = t * t * (3 - 2 * t)
        value = np.zeros(len(p))
        for c in range(8):
            d = (c & 1, c >> 1 & 1, c >> 2)
            w = np.prod([t[:, a] if d[a] else 1 - t[:, a] for a in range(3)], axis=0)
            value += w * _lattice(base[:, 0] + d[0], base[:, 1] + d[1], base[:, 2] + d[2],
                                  int(seed) + octave)
        total += weight * (2 * value - 1)
        norm += weight
        weight *= 0.5
    return total / norm


# --- surfaces ---


def grid(point, nu, nv, wrap_u=False):
    """point(u, v) of arrays in 0..1 gives n x 3; front where u x v points."""
    u, v = np.meshgrid(np.linspace(0, 1, nu + 1), np.linspace(0, 1, nv + 1), indexing="ij")
    p = point(u.ravel(), v.ravel())
    i, j = np.meshgrid(np.arange(nu), np.arange(nv), indexing="ij")
    a = (i * (nv + 1) + j).ravel()
    b, c, d = a + nv + 1, a + nv + 2, a + 1
    mesh = Mesh(p, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]),
                np.stack([u.ravel(), v.ravel()], 1)).smooth()
    if wrap_u:  # the seam's two rows are one
        first, last = np.arange(nv + 1), nu * (nv + 1) + np.arange(nv + 1)
        mean = unit(mesh.n[first] + mesh.n[last])
        mesh.n[first] = mesh.n[last] = mean
    return mesh


def quad(corner, u, v, uv_size=(1, 1)):
    """The parallelogram corner, +u, +u+v, +v; front where u x v points."""
    c, u, v = (np.asarray(x, float) for x in (corner, u, v))
    s, t = uv_size
    n = np.tile(unit(np.cross(u, v)), (4, 1))
    return Mesh([c, c + u, c + u + v, c + v], [[0, 1, 2], [0, 2, 3]],
                [[0, 0], [s, 0], [s, t], [0, t]], n)


def box(size=(1, 1, 1), uv_metres=False):
    """Of this size, its middle above the origin. Texture coordinates 0..1 a side, or metres."""
    x, y, z = (s / 2 for s in size)
    sides = []
    for corner, u, v in (((-x, -y, -z), (0, 2 * y, 0), (2 * x, 0, 0)),
                         ((-x, -y, z), (2 * x, 0, 0), (0, 2 * y, 0)),
                         ((-x, -y, -z), (2 * x, 0, 0), (0, 0, 2 * z)),
                         ((x, y, -z), (-2 * x, 0, 0), (0, 0, 2 * z)),
                         ((x, -y, -z), (0, 2 * y, 0), (0, 0, 2 * z)),
                         ((-x, y, -z), (0, -2 * y, 0), (0, 0, 2 * z))):
        lengths = (np.linalg.norm(u), np.linalg.norm(v)) if uv_metres else (1, 1)
        sides.append(quad(corner, u, v, lengths))
    return joined(sides).moved((0, 0, z))


def wall(corner, u, v, holes=()):
    """A parallelogram with rectangular holes (u0, v0, u1, v1) in metres along u and v."""
    corner, u, v = (np.asarray(x, float) for x in (corner, u, v))
    lu, lv = np.linalg.norm(u), np.linalg.norm(v)
    du, dv = u / lu, v / lv
    us = sorted({0.0, lu, *(h[0] for h in holes), *(h[2] for h in holes)})
    vs = sorted({0.0, lv, *(h[1] for h in holes), *(h[3] for h in holes)})
    parts = []
    for u0, u1 in zip(us, us[1:]):
        for v0, v1 in zip(vs, vs[1:]):
            mu, mv = (u0 + u1) / 2, (v0 + v1) / 2
            if any(h[0] < mu < h[2] and h[1] < mv < h[3] for h in holes):
                continue
            part = quad(corner + du * u0 + dv * v0, du * (u1 - u0), dv * (v1 - v0))
            part.uv = np.array([[u0, v0], [u1, v0], [u1, v1], [u0, v1]], np.float32)
            parts.append(part)
    return joined(parts)


def lathe(radii, heights, sides=40):
    """Turned about z: outline by radii and heights, from the bottom up."""
    radii, heights = np.asarray(radii, float), np.asarray(heights, float)

    def point(u, v):
        r = np.interp(v * (len(radii) - 1), np.arange(len(radii)), radii)
        z = np.interp(v * (len(radii) - 1), np.arange(len(radii)), heights)
        return np.stack([r * np.cos(2 * np.pi * u), r * np.sin(2 * np.pi * u), z], 1)

    return grid(point, sides, len(radii) - 1, wrap_u=True)


def curve_of(values, count=24):
    """A smooth line through few values, as `count` of them."""
    values = np.asarray(values, float)
    t = np.linspace(0, len(values) - 1, count)
    i = np.clip(t.astype(int), 0, len(values) - 2)
    s = t - i
    get = lambda k: values[np.clip(k, 0, len(values) - 1)]
    a, b, c, d = get(i - 1), get(i), get(i + 1), get(i + 2)
    return b + 0.5 * s * (c - a + s * (2 * a - 5 * b + 4 * c - d + s * (3 * (b - c) + d - a)))


def superellipsoid(e1=1.0, e2=1.0, nu=40, nv=24):
    """Of radius 1 about the origin: 1, 1 a sphere, towards 0 a box."""
    power = lambda x, e: np.sign(x) * np.abs(x) ** e

    def point(u, v):
        a, b = 2 * np.pi * u, np.pi * (v - 0.5)
        c = power(np.cos(b), e1)
        return np.stack([c * power(np.cos(a), e2), c * power(np.sin(a), e2), power(np.sin(b), e1)], 1)

    return grid(point, nu, nv, wrap_u=True)


def blob(rng, bumps=0.3, frequency=1.5, octaves=3, nu=64, nv=40):
    """A sphere of about radius 1 with noise on it."""
    mesh = superellipsoid(nu=nu, nv=nv)
    seed = int(rng.integers(1 << 20))
    mesh.p *= (1 + bumps * noise(mesh.p * frequency + 50, seed, octaves))[:, None].astype(np.float32)
    return mesh.smooth()


def tube(path, radius, sides=8):
    """Along n x 3 points; the radius is a number or one a point."""
    path = np.asarray(path, float)
    radius = np.broadcast_to(np.asarray(radius, float), len(path))
    along = unit(np.gradient(path, axis=0))
    side = np.cross(along, [0.31, 0.17, 0.93])
    side = unit(np.where(np.linalg.norm(side, axis=1, keepdims=True) < 0.1,
                         np.cross(along, [1, 0, 0]), side))
    other = np.cross(along, side)

    def point(u, v):
        k = np.rint(v * (len(path) - 1)).astype(int)
        a = 2 * np.pi * u[:, None]
        return path[k] + radius[k][:, None] * (np.cos(a) * side[k] + np.sin(a) * other[k])

    return grid(point, sides, len(path) - 1, wrap_u=True)


def torus(radius=1.0, thick=0.3, nu=48, nv=20):
    def point(u, v):
        a, b = 2 * np.pi * u, 2 * np.pi * v
        r = radius + thick * np.cos(b)
        return np.stack([r * np.cos(a), r * np.sin(a), thick * np.sin(b)], 1)

    return grid(point, nu, nv)


def prism(rng, corners=None):
    """A star or polygon of radius 1 drawn up by 0.4."""
    count = corners or int(rng.integers(3, 9)) * 2
    inner = rng.uniform(0.45, 1)
    a = np.arange(count) / count * 2 * np.pi
    r = np.where(np.arange(count) % 2 == 0, 1, inner)
    ring = np.stack([r * np.cos(a), r * np.sin(a)], 1)
    parts = []
    for i in range(count):
        p, q = ring[i], ring[(i + 1) % count]
        parts.append(quad((*p, 0), (*(q - p), 0), (0, 0, 0.4)))
        parts.append(Mesh([(0, 0, 0.4), (*p, 0.4), (*q, 0.4)], [[0, 1, 2]],
                          [(0.5, 0.5), p / 2 + 0.5, q / 2 + 0.5], [(0, 0, 1)] * 3))
    return joined(parts)


def terrain(rng, size, height, cells=96, frequency=0.3, octaves=4):
    """size x size about the origin, noise of this height. uv in metres. Returns mesh, height(x, y)."""
    seed = int(rng.integers(1 << 20))
    level = lambda x, y: height * noise(np.stack([x * frequency + 99, y * frequency + 99,
                                                 np.zeros_like(x)], 1), seed, octaves)

    def point(u, v):
        x, y = (u - 0.5) * size, (v - 0.5) * size
        return np.stack([x, y, level(x, y)], 1)

    mesh = grid(point, cells, cells)
    mesh.uv = mesh.p[:, :2] + size / 2
    return mesh, lambda x, y: level(np.atleast_1d(np.float64(x)), np.atleast_1d(np.float64(y)))


def sheet(rng, width, height, folds=6, depth=0.08, cells=60):
    """A hanging cloth in the plane y = 0, in folds."""
    seed = int(rng.integers(1 << 20))

    def point(u, v):
        bend = np.sin(2 * np.pi * folds * u + 2 * noise(np.stack([u * 3 + 9, v * 2, v * 0], 1), seed))
        return np.stack([(u - 0.5) * width, depth * bend * (0.4 + 0.6 * (1 - v)), v * height], 1)

    return grid(point, cells, 12)


def leaf(width=0.5, bend=0.2):
    """One leaf along +y of length 1, of 8 triangles."""
    rows = np.array([0, 0.25, 0.6, 0.85, 1])
    half = width / 2 * np.array([0.05, 0.85, 1, 0.6, 0.02])
    z = bend * rows ** 2
    p = [(s * h, y, zz + 0.15 * abs(s) * h) for y, h, zz in zip(rows, half, z) for s in (-1, 1)]
    f = [t for k in range(4) for t in ((2 * k, 2 * k + 1, 2 * k + 3), (2 * k, 2 * k + 3, 2 * k + 2))]
    return Mesh(p, f, [(0.5 + s * h / width, y) for y, h in zip(rows, half) for s in (-1, 1)]).smooth()


def card(width=1.0, height=1.0):
    """A rectangle along +y for a cut-out picture."""
    return quad((-width / 2, 0, 0), (width, 0, 0), (0, height, 0))


def blade(width=0.03, bend=0.4):
    """A blade of grass of height 1."""
    rows = np.array([0, 0.4, 0.75, 1])
    half = width / 2 * np.array([1, 0.85, 0.5, 0.02])
    p = [(s * h, bend * y * y, y) for y, h in zip(rows, half) for s in (-1, 1)]
    f = [t for k in range(3) for t in ((2 * k, 2 * k + 1, 2 * k + 3), (2 * k, 2 * k + 3, 2 * k + 2))]
    return Mesh(p, f, [(0.5 + s / 2, y) for y in rows for s in (-1, 1)]).smooth()


def write_ply(mesh, file_name):
    fields = [("x", "<f4"), ("y", "<f4"), ("z", "<f4")]
    columns = [mesh.p]
    if mesh.n is not None:
        fields += [("nx", "<f4"), ("ny", "<f4"), ("nz", "<f4")]
        columns.append(mesh.n)
    fields += [("u", "<f4"), ("v", "<f4")]
    columns.append(mesh.uv)
    lines = ["ply", "format binary_little_endian 1.0", "element vertex %d" % len(mesh.p)]
    lines += ["property float " + name for name, _ in fields]
    lines += ["element face %d" % len(mesh.f), "property list uchar int vertex_indices", "end_header"]
    faces = np.empty(len(mesh.f), [("n", "u1"), ("i", "<i4", 3)])
    faces["n"], faces["i"] = 3, mesh.f
    with open(file_name, "wb") as out:
        out.write(("\n".join(lines) + "\n").encode())
        out.write(np.concatenate(columns, 1).astype("<f4").tobytes())
        out.write(faces.tobytes())
