"""What several of the scenes are put together from."""

from shapes import Shape, box, quad


def inside_out(shape):
    """The same, seen from within."""
    shape.normals = [tuple(-c for c in n) for n in shape.normals]
    shape.triangles = [(a, c, b) for a, b, c in shape.triangles]
    return shape


def room(low, high, open_at=None):
    """A box seen from within, without the walls at these z; by default without the one toward the camera."""
    open_at = (high[2],) if open_at is None else open_at
    shape = inside_out(box(low, high)).without_uvs()
    shape.triangles = [t for t in shape.triangles
                       if not any(all(shape.positions[i][2] == z for i in t) for z in open_at)]
    return shape


def lamp(center, width, depth):
    """Shines down."""
    x, y, z = center
    return quad((x - width / 2, y, z - depth / 2), (width, 0, 0), (0, 0, depth)).without_uvs()


def wall_with_hole(width, height, hole, center):
    """In the plane z = 0, x from -width/2, y from 0, seen from both sides; a square hole of that side."""
    (x, y), h = center, hole / 2
    shape = Shape()
    left, right = -width / 2, width / 2
    for a, b, c, d in ((left, 0, x - h, height), (x + h, 0, right, height),
                       (x - h, 0, x + h, y - h), (x - h, y + h, x + h, height)):
        shape.add(quad((a, b, 0), (c - a, 0, 0), (0, d - b, 0)))
    return shape.without_uvs()
