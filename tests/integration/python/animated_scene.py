"""A small animated scene, for tests: a checkered ball that goes and turns under a lamp, and a camera that goes, too."""
import math
import pathlib
import sys

from processes import SOURCE

sys.path.insert(0, str(SOURCE / 'scenes'))
from gltf import FLOAT, Writer
from png import rgb
from shapes import quad, sphere

SECONDS = 0.25  # of the animation


def write(folder, name='ball', still=False):
    """Writes NAME.gltf and its files, without animation if `still`; answers with the path."""
    out = Writer(str(folder), name)
    checks = out.texture('checks.png', rgb(64, 64, lambda x, y: (230, 40, 40) if (x // 8 + y // 8) % 2 else (240, 240, 240)))
    out.place('floor', quad((-2, 0, 2), (4, 0, 0), (0, 0, -4)).without_uvs(), out.material('grey', (.6, .6, .6)))
    out.place('lamp', quad((-.5, 2.5, -.5), (1, 0, 0), (0, 0, 1)).without_uvs(),
              out.material('lamp', (0, 0, 0), emissive=(12, 12, 12)))
    ball = out.place('ball', sphere(.5, 8), out.material('checks', color_texture=checks), at=(-1, .5, 0))
    out.camera((0, 1, 4), (0, .5, 0), 40, 16 / 9)
    camera = out.json['nodes'][-1]
    del camera['matrix']
    camera['translation'], camera['rotation'] = [0, 1, 4], turn(0, -7)
    if not still:
        times = [0, SECONDS / 2, SECONDS]
        animate(out, ball, 'translation', 'LINEAR', times, [(-1, .5, 0), (0, .5, 0), (1, .7, 0)])
        animate(out, ball, 'rotation', 'CUBICSPLINE', times,
                [key for q in (turn(0, 0), turn(50, 0), turn(100, 20)) for key in ([0] * 4, q, [0] * 4)])
        animate(out, len(out.json['nodes']) - 1, 'translation', 'STEP', times, [(0, 1, 4), (.1, 1, 4), (.2, 1.1, 4)])
    out.save()
    return pathlib.Path(folder) / f'{name}.gltf'


def turn(y, x):
    """A quaternion: about x, then about y; degrees."""
    a, b = math.radians(y) / 2, math.radians(x) / 2
    return [math.cos(a) * math.sin(b), math.sin(a) * math.cos(b), -math.sin(a) * math.sin(b), math.cos(a) * math.cos(b)]


def animate(out, node, path, interpolation, times, values):
    kind = 'VEC4' if path == 'rotation' else 'VEC3'
    flat = [c for value in values for c in value]
    view = out._accessor(flat + [0] * (-len(flat) % 3), FLOAT, 'VEC3', None)
    out.json['accessors'][view].update(type=kind, count=len(values))
    for bound in ('min', 'max'):
        out.json['accessors'][view].pop(bound, None)
    sampler = {'input': out._accessor(times, FLOAT, 'SCALAR', None), 'output': view, 'interpolation': interpolation}
    out._add('animations', {'samplers': [sampler], 'channels': [{'sampler': 0, 'target': {'node': node, 'path': path}}]})
