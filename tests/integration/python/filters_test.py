#!/usr/bin/python3
"""The default filter takes no more than a scene needs, and says what it tried; methods plan by their own rules.

    filters_test.py BIN_DIR SOURCE_DIR
"""
import json
import pathlib
import shutil
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from processes import ROOM, relume

CORNELL = ROOM.parent.parent / 'cornell' / 'cornell.gltf'
EVENLY_LIT = {
    'asset': {'version': '2.0'}, 'scenes': [{'nodes': [0]}],
    'nodes': [{'mesh': 0, 'scale': [100, 100, 1]}],
    'meshes': [{'primitives': [{'attributes': {'POSITION': 0}, 'indices': 1, 'material': 0}]}],
    'materials': [{'emissiveFactor': [0.5, 0.25, 1], 'doubleSided': True,
                   'pbrMetallicRoughness': {'baseColorFactor': [0, 0, 0, 1]}}],
    'buffers': [{'uri': 'data:application/octet-stream;base64,AACAvwAAgL8AAAAAAACAPwAAgL8AAAAAAAAAAAAAgD8AAAAA'
                        'AAAAAAEAAAACAAAA', 'byteLength': 48}],
    'bufferViews': [{'buffer': 0, 'byteLength': 36}, {'buffer': 0, 'byteOffset': 36, 'byteLength': 12}],
    'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 3, 'type': 'VEC3', 'min': [-1, -1, 0],
                   'max': [1, 1, 0]},
                  {'bufferView': 1, 'componentType': 5125, 'count': 3, 'type': 'SCALAR'}]}


class FiltersTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())

    def tearDown(self):
        shutil.rmtree(self.folder)

    def render(self, scene, *options):
        report = self.folder / 'report.json'
        relume('render', scene, '-o', self.folder / 'out.exr', '--report', report, '--quiet', *options)
        return json.loads(report.read_text())['filter']

    def test_albedo_is_of_no_use_in_a_box_without_textures(self):
        told = self.render(CORNELL, '--size', '192x192', '--spp', '24', '--filter', 'auto:effort=10')
        self.assertIn('albedo', told['dropped'])
        self.assertTrue(told['reason'])
        names = [candidate['filter'] for candidate in told['candidates']]
        self.assertEqual(names[:2], ['none', 'bilateral:mode=robust,energy=restore'])
        self.assertIn(told['filter'], names)
        self.assertLess(told['error']['relmse'], told['unfiltered_error']['relmse'])

    def test_an_image_without_noise_is_not_filtered(self):
        scene = self.folder / 'scene.gltf'
        scene.write_text(json.dumps(EVENLY_LIT))
        told = self.render(scene, '--size', '64x48', '--spp', '8', '--look-from', '0,0,3', '--look-at', '0,0,0')
        self.assertEqual(told['filter'], 'none')
        self.assertEqual(told['error']['relmse'], 0)

    def test_methods_plan_and_filter_by_their_own_rules(self):
        for method in ('gem', 'nlm', 'sbf', 'rd', 'wlr'):
            digests = []
            for workers in (1, 2):
                report = self.folder / 'report.json'
                relume('render', ROOM, '-o', self.folder / 'out.exr', '--report', report, '--quiet', '--size', '48x36',
                       '--spp', '32', '--sampler', method, '--filter', method, '--workers', str(workers))
                told = json.loads(report.read_text())
                self.assertEqual(told['filter']['filter'].split(':')[0], method)
                self.assertAlmostEqual(told['spp'], 32, delta=0.01)
                self.assertGreaterEqual(len(told['passes']), 2)
                digests.append(told['image']['sha256'])
            self.assertEqual(*digests)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
