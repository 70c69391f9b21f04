#!/usr/bin/python3
"""Every layout makes a scene that Relume reads whole, the same one from the same seed, as bright as asked for.

    scenes_test.py BIN_DIR SOURCE_DIR
"""
import filecmp
import os
import subprocess
import sys
import tempfile
import unittest

import paths

paths.need('numpy', 'PIL')
import exr  # noqa: E402
import scenes  # noqa: E402


def render(scene, out, *more):
    subprocess.run([os.path.join(paths.BIN, 'relume'), 'render', scene, '--size', '24x24', '--spp', '4', '--filter',
                    'none', '--workers', '1', '--threads', '1', '--allow-black', '--quiet', '-o', out, *more],
                   check=True, stdout=subprocess.DEVNULL)


class ScenesTest(unittest.TestCase):
    def setUp(self):
        self.place = tempfile.TemporaryDirectory()
        self.addCleanup(self.place.cleanup)
        self.folder = self.place.name

    def test_every_layout_is_read_and_nothing_of_it_is_left_out(self):
        for layout in scenes.LAYOUTS:
            scene, _ = scenes.make(3, os.path.join(self.folder, layout), layout)
            told = subprocess.run([os.path.join(paths.BIN, 'relume'), 'info', scene.write()], check=True,
                                  capture_output=True, text=True)
            for word in ('not supported', 'ignored', 'left out', 'not used', 'unknown'):
                self.assertNotIn(word, told.stdout + told.stderr, layout)

    def test_a_seed_is_a_scene(self):
        folders = [os.path.join(self.folder, n) for n in 'ab']
        for folder in folders:
            scenes.make(5, folder)[0].write()
        names = sorted(os.listdir(folders[0]))
        self.assertEqual(names, sorted(os.listdir(folders[1])))
        same, _, _ = filecmp.cmpfiles(*folders, names, shallow=False)
        self.assertEqual(len(same), len(names))

    def test_exposure_scales_all_light(self):
        for layout in ('gallery', 'desk', 'landscape'):
            scene, _ = scenes.make(4, os.path.join(self.folder, layout), layout)
            images = []
            for exposure in (1, 8):
                out = os.path.join(self.folder, '%s_%d.exr' % (layout, exposure))
                render(scene.write(exposure), out, '--sampler', 'uniform')
                images.append(exr.rgb(exr.read(out), 'noisy.'))
            self.assertGreater(images[0].mean(), 0)
            self.assertAlmostEqual(images[1].mean() / images[0].mean(), 8, delta=0.01)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
