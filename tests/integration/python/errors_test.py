#!/usr/bin/python3
"""What goes wrong ends in one clear line with file and remedy, leaves nothing, and harms no server.

    errors_test.py BIN_DIR SOURCE_DIR
"""
import json
import pathlib
import shutil
import struct
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from processes import Farm, ROOM, relume


def triangle(positions, indices=(0, 1, 2), **more):
    """A glTF file of one triangle, its buffer beside it, as (json, bytes)."""
    data = b''.join(struct.pack('<3f', *p) for p in positions) + struct.pack(
        f'<{len(indices)}I', *indices)
    gltf = {
        'asset': {'version': '2.0'}, 'scenes': [{'nodes': [0]}], 'nodes': [{'mesh': 0}],
        'meshes': [{'primitives': [{'attributes': {'POSITION': 0}, 'indices': 1, 'material': 0}]}],
        'materials': [{'emissiveFactor': [1, 1, 1]}],
        'buffers': [{'uri': 'scene.bin', 'byteLength': len(data)}],
        'bufferViews': [{'buffer': 0, 'byteLength': 12 * len(positions)},
                        {'buffer': 0, 'byteOffset': 12 * len(positions),
                         'byteLength': 4 * len(indices)}],
        'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': len(positions), 'type': 'VEC3',
                       'min': [0, 0, 0], 'max': [1, 1, 0]},
                      {'bufferView': 1, 'componentType': 5125, 'count': len(indices),
                       'type': 'SCALAR'}]}
    gltf.update(more)
    return gltf, data


GOOD = ((0, 0, 0), (1, 0, 0), (0, 1, 0))


class ErrorsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.farm = Farm()
        cls.farm.start_worker()
        cls.farm.start_worker()

    @classmethod
    def tearDownClass(cls):
        cls.farm.stop()

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())

    def tearDown(self):
        self.assertEqual(self.farm.alive(), [True] * 3, 'server and workers live')
        shutil.rmtree(self.folder)

    def write(self, gltf, data, name='scene.gltf'):
        (self.folder / name).write_text(json.dumps(gltf))
        (self.folder / 'scene.bin').write_bytes(data)
        return self.folder / name

    def fails(self, scene, *options, code, says):
        """Expects one line that names all of `says`, the exit code, and no file made."""
        out = self.folder / 'results'
        out.mkdir(exist_ok=True)
        size = () if '--size' in options else ('--size', '32x32')
        run = relume('render', scene, '-o', out / 'out.exr', *size, '--spp', '4', '--quiet', *options,
                     server=self.farm.address, check=False)
        self.assertEqual(run.returncode, code, run.stderr)
        lines = [line for line in run.stderr.splitlines() if line]
        self.assertEqual(len(lines), 1, run.stderr)
        for word in says:
            self.assertIn(word, lines[0])
        self.assertEqual(list(out.iterdir()), [])

    def test_missing_scene(self):
        self.fails(self.folder / 'none.gltf', code=3, says=['none.gltf'])

    def test_truncated_gltf(self):
        scene = self.folder / 'cut.gltf'
        scene.write_text(ROOM.read_text()[:2000])
        self.fails(scene, code=3, says=['cut.gltf'])

    def test_missing_texture(self):
        gltf, data = triangle(GOOD, images=[{'uri': 'gone.png'}], textures=[{'source': 0}], materials=[
            {'emissiveFactor': [1, 1, 1], 'pbrMetallicRoughness': {'baseColorTexture': {'index': 0}}}])
        self.fails(self.write(gltf, data), code=3, says=['gone.png'])

    def test_nan_vertex(self):
        scene = self.write(*triangle(((0, 0, 0), (float('nan'), 0, 0), (0, 1, 0))))
        self.fails(scene, code=3, says=['scene.gltf', 'mesh 0'])

    def test_empty_mesh(self):
        gltf, data = triangle(GOOD)
        gltf['meshes'][0]['primitives'] = []
        self.fails(self.write(gltf, data), code=3, says=['scene.gltf', 'mesh 0'])

    def test_no_light(self):
        scene = self.write(*triangle(GOOD, materials=[{}]))
        self.fails(scene, code=3, says=['--allow-black'])

    def test_sizes_without_sense(self):
        for size in ('0x0', '0x10', '1000000000x1000000000'):
            self.fails(ROOM, '--size', size, code=2, says=[size.split('x')[0], '65536'])

    def test_unknown_option(self):
        self.fails(ROOM, '--sizes', '1x1', code=2, says=['--sizes'])

    def test_unknown_filter(self):
        self.fails(ROOM, '--filter', 'blur', code=2, says=['blur', 'bilateral'])

    def test_samples_that_are_not_kept(self):
        self.fails(ROOM, '--filter', 'rpf', code=2, says=["filter 'rpf", '--keep-samples'])
        self.fails(ROOM, '--filter', 'none', '--keep-samples', code=2, says=['leave --keep-samples out'])
        self.fails(ROOM, '--filter', 'rpf', '--keep-samples', '--size', '8192x4096', code=1,
                   says=['33554432 pixels', '4 are the most', '--size, --crop, --spp or --max-spp'])
        self.fails(ROOM, '--filter', 'rpf', '--keep-samples', '--max-spp', '1', code=2, says=['needs 2 samples'])
        self.fails(ROOM, '--filter', 'rpf', '--keep-samples', '--time-limit', '9', code=2, says=['--time-limit'])

    def test_unreachable_server(self):
        self.fails(ROOM, '--server', '127.0.0.1:1', code=4, says=['127.0.0.1:1'])

    def test_output_folder_that_is_not_there(self):
        run = relume('render', ROOM, '-o', self.folder / 'no' / 'out.exr', '--quiet', check=False)
        self.assertEqual(run.returncode, 6, run.stderr)
        self.assertIn('no', run.stderr)

    def test_no_camera_gets_a_fitted_one_and_says_so(self):
        scene = self.write(*triangle(GOOD))
        run = relume('render', scene, '-o', self.folder / 'out.exr', '--size', '32x32', '--spp', '4',
                     server=self.farm.address)
        self.assertIn('camera', run.stderr)
        self.assertTrue((self.folder / 'out.exr').is_file())


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
