#!/usr/bin/python3
"""The image has the same bits for any number of workers, any tile size, and whoever is killed.

    digest_test.py BIN_DIR SOURCE_DIR
"""
import json
import pathlib
import signal
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from processes import Farm, ROOM, relume

JOB = (ROOM, '--size', '160x100', '--spp', '16', '--sampler', 'paper', '--filter', 'bilateral')


class DigestTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.expected = cls.render('--workers', 1)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def render(cls, *options):
        out = pathlib.Path(cls.folder.name) / 'out.exr'
        run = relume('render', *JOB, '-o', out, '--json', '--quiet', *options)
        return json.loads(run.stdout)['image_sha256']

    def test_any_number_of_workers(self):
        for workers in (2, 4):
            self.assertEqual(self.render('--workers', workers), self.expected, workers)

    def test_any_tile_size(self):
        for side in (16, 64):
            self.assertEqual(self.render('--workers', 2, '--tile-size', side), self.expected, side)

    def test_samples_that_are_kept(self):
        def digest(*options):
            out = pathlib.Path(self.folder.name) / 'samples.exr'
            run = relume('render', ROOM, '--size', '48x36', '--spp', '8', '--sampler', 'uniform', '-o', out,
                         '--json', '--quiet', *options)
            return json.loads(run.stdout)['image_sha256']

        kept = {digest('--keep-samples', '--filter', 'rpf', '--workers', workers, '--tile-size', side)
                for workers, side in ((1, 32), (2, 32), (2, 64))}
        self.assertEqual(len(kept), 1)
        self.assertNotIn(digest('--filter', 'none'), kept)

    def test_another_seed_is_another_image(self):
        self.assertNotEqual(self.render('--seed', 1), self.expected)

    def test_a_worker_killed_and_another_started_in_the_middle(self):
        with Farm() as farm:
            victim = farm.start_worker()
            submitted = json.loads(relume('submit', *JOB, '--json', server=farm.address).stdout)
            name = submitted['job']
            while farm.job(name)['samples'] == 0:  # bounded by ctest's own time limit
                pass
            victim.send_signal(signal.SIGKILL)
            victim.wait()
            middle = farm.job(name)
            farm.start_worker()
            relume('watch', name, '--quiet', server=farm.address)
            out = pathlib.Path(self.folder.name) / 'killed.exr'
            fetched = relume('fetch', name, '-o', out, server=farm.address)
            self.assertEqual(fetched.returncode, 0)
            job = farm.job(name)
            self.assertLess(middle['samples'], job['samples'], 'killed too late to count')
            self.assertEqual(job['image_sha256'], self.expected)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
