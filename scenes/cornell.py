"""The Cornell box after the measurements at graphics.cornell.edu/online/box/data.html, in metres,
x mirrored so that it is seen along -z; closed to the eye by an open front."""

from gltf import Writer
from shapes import Shape, cross, quad, sub, unit

SIDE, HEIGHT, DEPTH = 0.556, 0.5488, 0.5592


def block(footprint, height):
    """A prism over four points (x, z), counter-clockwise seen from above."""
    shape = Shape()
    base = [(x, 0.0, -z) for x, z in footprint]
    top = [(x, height, -z) for x, z in footprint]
    faces = [(base[i], base[(i + 1) % 4], top[(i + 1) % 4], top[i]) for i in range(4)] + [top]
    for face in faces:
        first = len(shape.positions)
        shape.positions += face
        shape.normals += [unit(cross(sub(face[1], face[0]), sub(face[2], face[0])))] * 4
        shape.triangles += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    return shape


def make(folder):
    out = Writer(folder, "cornell")
    white = out.material("white", (0.73, 0.73, 0.73))
    red = out.material("red", (0.63, 0.06, 0.05))
    green = out.material("green", (0.14, 0.45, 0.09))
    light = out.material("light", (0.78, 0.78, 0.78), emissive=(28, 21, 13))

    w, h, d = SIDE, HEIGHT, DEPTH
    shell = quad((0, 0, 0), (w, 0, 0), (0, 0, -d)).add(quad((0, h, -d), (w, 0, 0), (0, 0, d)))
    shell.add(quad((0, 0, -d), (w, 0, 0), (0, h, 0)))
    out.place("floor, ceiling, back", shell.without_uvs(), white)
    out.place("left wall", quad((0, 0, 0), (0, 0, -d), (0, h, 0)).without_uvs(), red)
    out.place("right wall", quad((w, 0, -d), (0, 0, d), (0, h, 0)).without_uvs(), green)
    lamp = quad((0.213, h - 0.0005, -0.332), (0.13, 0, 0), (0, 0, 0.105))
    out.place("light", lamp.without_uvs(), light)

    # The data's x runs to the left.
    low = [(0.130, 0.065), (0.082, 0.225), (0.240, 0.272), (0.290, 0.114)]
    tall = [(0.423, 0.247), (0.265, 0.296), (0.314, 0.456), (0.472, 0.406)]
    for name, footprint, height in (("short block", low, 0.165), ("tall block", tall, 0.330)):
        out.place(name, block([(w - x, z) for x, z in footprint], height), white)

    # From the data's distance; the front opening fills the height of the image.
    eye = (w / 2, h / 2, 0.8)
    out.camera(eye, (w / 2, h / 2, 0), 37.8, 1)
    out.save()
