#!/usr/bin/python3
"""On scenes that break methods, `relume render` as it comes is no worse than plain samples; and the check sees it if one is.

    stability_test.py BIN_DIR SOURCE_DIR
"""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from processes import BIN, SOURCE


class StabilityTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def check(self, *options):
        run = subprocess.run([sys.executable, SOURCE / 'bench' / 'stability', '--quick', '--check', '--programs', BIN,
                              '--store', self.folder / 'store', '--json', self.folder / 'cells.json', *options],
                             stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
        self.assertIn(run.returncode, (0, 1), run.stderr)
        return run.returncode, run.stdout, json.loads((self.folder / 'cells.json').read_text())

    def test_the_default_stays_within_its_bars(self):
        code, said, found = self.check()
        self.assertEqual(code, 0, said)
        self.assertGreater(len(found['cells']), 20)
        self.assertGreater(len(found['refusals']), 2)

    def test_a_method_that_blurs_what_has_no_noise_is_caught(self):
        code, said, _ = self.check('--scenes', 'spp_128', '--filters', 'bilateral:mode=corrected', '--judge',
                                   'bilateral:mode=corrected', '--seeds', '2', '--reference', '8')
        self.assertEqual(code, 1)
        self.assertRegex(said, r'\nspp_128: MrSE is [0-9.]+ times')

    def test_an_image_of_the_wrong_brightness_is_caught(self):
        code, said, _ = self.check('--scenes', 'rare_light', '--filters', 'wlr', '--judge', 'wlr')
        self.assertEqual(code, 1)
        self.assertRegex(said, r'\nrare_light: energy 0\.')


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
