#!/usr/bin/python3
"""Frames are rendered and packed; a second run makes only what lacks; a scene that fails stops no other.

    frames_test.py BIN_DIR SOURCE_DIR
"""
import json
import os
import sys
import tempfile
import time
import unittest

import paths

paths.need('numpy', 'PIL')
import numpy as np  # noqa: E402

import frames  # noqa: E402


class FramesTest(unittest.TestCase):
    def setUp(self):
        self.place = tempfile.TemporaryDirectory()
        self.addCleanup(self.place.cleanup)
        self.folder = self.place.name
        self.shards = os.path.join(self.folder, 'shards')

    def make(self, scenes, program=None, *more):
        program = program or os.path.join(paths.BIN, 'relume-network-inputs') + ' --candidates rd --threads 1'
        return frames.main(['--out', self.folder, '--relume', os.path.join(paths.BIN, 'relume'), '--network-inputs',
                            program, '--scenes', str(scenes), '--jobs', '2', '--size', '32', '--frames', '2',
                            '--reference-spp', '16', *more])

    def times(self):
        return {n: os.stat(os.path.join(self.shards, n)).st_mtime_ns for n in os.listdir(self.shards)}

    def test_frames_are_whole_and_made_once(self):
        self.assertEqual(self.make(2), 0)
        with open(os.path.join(self.shards, '000001.json')) as source:
            record = json.load(source)
        load = lambda name: np.load(os.path.join(self.shards, '000001.%s.npy' % name)).astype(float)
        inputs, candidates, reference = load('inputs'), load('candidates'), load('reference')
        self.assertEqual(record['candidates'], ['none', 'bilateral', 'rd'])
        self.assertEqual(inputs.shape, (2, len(record['inputs']), 32, 32))
        self.assertEqual(candidates.shape, (2, 9, 32, 32))
        self.assertEqual(reference.shape, (6, 32, 32))
        self.assertLess(abs(np.log2(reference[:3].mean())), 0.6)  # scaled to about 1
        self.assertTrue((reference[3:] >= 0).all() and reference[3:].max() > 0)
        # The bilateral candidate is nearer to the reference than the noisy one, and as bright.
        error = lambda k: np.mean(np.abs(candidates[:, 3 * k:3 * k + 3] - reference[None, :3]))
        self.assertLess(error(1), error(0))
        before = self.times()
        self.assertEqual(self.make(3), 0)
        after = self.times()
        self.assertEqual({n: after[n] for n in before}, before)
        self.assertIn('000003.json', after)
        self.assertEqual(os.listdir(os.path.join(self.folder, 'scenes')), [])

    def test_a_scene_that_fails_is_told_and_not_tried_again(self):
        self.assertEqual(self.make(1, 'false'), 1)
        with open(os.path.join(self.folder, 'failed', '000001.txt')) as source:
            self.assertIn('ended with 1', source.read())
        self.assertEqual(self.make(2), 0)
        self.assertEqual(sorted(n for n in os.listdir(self.shards) if n.endswith('.json')), ['000002.json'])

    def left_running(self):
        """Command lines that name this test's folder."""
        mine, found = self.folder.encode(), []
        for pid in filter(str.isdigit, os.listdir('/proc')):
            try:
                with open('/proc/%s/cmdline' % pid, 'rb') as source:
                    line = source.read()
            except OSError:
                continue
            if mine in line:
                found.append(line)
        return found

    def test_when_time_is_over_nothing_is_left_running(self):
        self.assertEqual(self.make(40, None, '--seconds', '1'), 0)
        give_up = time.monotonic() + 30  # a server gives its workers a moment to end what they do
        while self.left_running() and time.monotonic() < give_up:
            time.sleep(0.05)
        self.assertEqual(self.left_running(), [])


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
