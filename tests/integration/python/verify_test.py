#!/usr/bin/python3
"""`relume verify`: an image's claim of its error holds; the same one made smaller does not.

    verify_test.py BIN_DIR SOURCE_DIR
"""
import json
import pathlib
import re
import shutil
import struct
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from processes import Farm, ROOM, SOURCE, relume

CORNELL = SOURCE / 'scenes' / 'cornell' / 'cornell.gltf'


def forge(data, key, change):
    """The bytes of an EXR with one of its text attributes changed by change(text), length kept."""
    head = key.encode() + b'\0string\0'
    start = data.index(head) + len(head)
    size, = struct.unpack_from('<I', data, start)
    text = data[start + 4:start + 4 + size].decode()
    new = change(text).encode()
    assert len(new) == size, (text, new)
    return data[:start + 4] + new + data[start + 4 + size:]


def scaled(factor):
    """A change that multiplies all numbers, each written as long as it was."""
    def number(match):
        digits = match.group()
        return f'{float(digits) * factor:.{len(digits) - 2}f}'[:len(digits)]
    return lambda text: re.sub(r'0\.\d+', number, text)


class VerifyTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.farm = Farm()
        cls.farm.start_worker()
        cls.farm.start_worker()
        cls.image = cls.folder / 'out.exr'
        cls.render(cls.image)

    @classmethod
    def tearDownClass(cls):
        cls.farm.stop()
        shutil.rmtree(cls.folder)

    @classmethod
    def render(cls, out, *options, spp=64):
        relume('render', CORNELL, '-o', out, '--size', '40x30', '--spp', spp, '--sampler', 'uniform',
               '--quiet', *options, server=cls.farm.address)

    def verify(self, image, *options, scene=CORNELL, pixels=600):
        return relume('verify', image, scene, '--pixels', pixels, '--spp', '128', '--quiet', *options,
                      server=self.farm.address, check=False)

    def forged(self, key, change):
        path = self.folder / 'forged.exr'
        path.write_bytes(forge(self.image.read_bytes(), key, change))
        return path

    def test_a_true_claim_holds(self):
        run = self.verify(self.image, '--json')
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        result = json.loads(run.stdout)
        self.assertEqual(result['pixels'], 600)
        self.assertTrue(result['holds'])
        check = result['checks'][0]
        self.assertEqual((check['of'], check['verdict']), ('unfiltered', 'holds'))
        low, high = check['measured_interval']
        self.assertLess(low, check['measured'])
        self.assertLess(check['measured'], high)
        self.assertEqual(run.stderr, '')

    def test_what_it_measures_is_the_distance_from_a_reference(self):
        reference = self.folder / 'reference.exr'
        self.render(reference, '--seed', '9', '--filter', 'none', spp=2048)
        checks = json.loads(self.verify(self.image, '--json', pixels=1200).stdout)['checks']
        self.assertEqual([check['of'] for check in checks], ['unfiltered', 'filtered'])
        for check, layer in zip(checks, (('--layer', 'noisy'), ())):
            run = relume('compare', reference, self.image, *layer, '--json')
            truth = json.loads(run.stdout)[0]['relmse']
            # All pixels: what is left is the noise of the probe.
            self.assertAlmostEqual(check['measured'], truth, delta=0.15 * truth, msg=check)

    def test_a_claim_four_times_too_small_does_not_hold(self):
        path = self.forged('relume.relmse', scaled(0.25))
        path.write_bytes(forge(path.read_bytes(), 'relume.relmse_interval', scaled(0.25)))
        run = self.verify(path)
        self.assertEqual(run.returncode, 7, run.stdout + run.stderr)
        self.assertIn('does not hold', run.stdout)

    def test_another_seed_chooses_other_pixels_and_the_same_one_the_same(self):
        first, again, other = (json.loads(self.verify(self.image, '--json', *seed).stdout)
                               for seed in ((), (), ('--seed', '5')))
        self.assertEqual(first['checks'], again['checks'])
        self.assertNotEqual(first['checks'], other['checks'])
        run = self.verify(self.image, '--seed', '0')
        self.assertEqual(run.returncode, 2, run.stderr)
        self.assertIn("image's own", run.stderr)

    def test_a_crop_is_verified_as_it_lies(self):
        out = self.folder / 'crop.exr'
        self.render(out, '--crop', '10,5,34,25')
        run = self.verify(out, '--json')
        result = json.loads(run.stdout)
        self.assertEqual(result['pixels'], 24 * 20)
        x, y = result['checks'][0]['worst_pixel']
        self.assertTrue(10 <= x < 34 and 5 <= y < 25)

    def test_another_scene_is_refused(self):
        run = self.verify(self.image, scene=ROOM)
        self.assertEqual(run.returncode, 3, run.stderr)
        self.assertIn('is not the scene of', run.stderr)

    def test_an_image_without_claims_is_refused(self):
        run = self.verify(self.forged('relume.settings', lambda text: '}' * len(text)))
        self.assertEqual(run.returncode, 3, run.stderr)
        self.assertIn('relume.settings', run.stderr)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
