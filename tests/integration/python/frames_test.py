#!/usr/bin/python3
"""Frames of an animation: the same bits whoever renders them, each its own picture, and nothing lost when it breaks off.

    frames_test.py BIN_DIR SOURCE_DIR
"""
import json
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import animated_scene
from processes import BIN, Farm, environment, relume

LOOK = ('--size', '48x27', '--sampler', 'uniform', '--filter', 'none', '--quiet')
OPTIONS = (*LOOK, '--spp', '8')


class FramesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scenes = tempfile.TemporaryDirectory()
        cls.scene = animated_scene.write(cls.scenes.name)

    @classmethod
    def tearDownClass(cls):
        cls.scenes.cleanup()

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())

    def tearDown(self):
        shutil.rmtree(self.folder)

    def render(self, *options, scene=None, frames='0-4x2', pattern='out.####.exr', **more):
        return relume('render', scene or self.scene, '--frames', frames, *OPTIONS, '-o', self.folder / pattern, *options,
                      **more)

    def digests(self, *options, **more):
        """Of each frame, from --json."""
        result = json.loads(self.render(*options, '--json', **more).stdout)
        self.assertEqual(result['failed'], [])
        return {frame['frame']: frame['image_sha256'] for frame in result['frames']}

    def files(self):
        return sorted(path.name for path in self.folder.iterdir())

    def test_same_bits_for_any_number_of_workers_and_each_frame_its_own(self):
        one = self.digests('--workers', 1)
        self.assertEqual(self.files(), ['out.0000.exr', 'out.0002.exr', 'out.0004.exr'])
        self.assertEqual(len(set(one.values())), 3, 'all frames differ')
        self.assertEqual(self.digests('--workers', 2), one)
        # Each is the picture that is rendered alone at its time, by a worker that knows no other.
        alone = relume('render', self.scene, '--time', 4 / 24, *OPTIONS, '-o', self.folder / 'alone.exr', '--json')
        self.assertEqual(json.loads(alone.stdout)['image_sha256'], one[4])
        # In another order, at another rate.
        self.assertEqual(self.digests('--fps', 12, frames='2,1,0'), {0: one[0], 1: one[2], 2: one[4]})

    def test_motion_blur_of_each_frame(self):
        sharp = self.digests(frames='1-2')
        blurred = self.digests('--shutter', 1 / 48, frames='1-2')
        self.assertEqual(len({*sharp.values(), *blurred.values()}), 4)
        self.assertEqual(self.digests('--shutter', 1 / 48, '--workers', 2, frames='2-1'), blurred)

    def test_views_and_reports_have_patterns_too(self):
        self.render('--png', self.folder / 'view.%02d.png', '--report', self.folder / 'r#.json', frames='1,3')
        self.assertEqual(self.files(), ['out.0001.exr', 'out.0003.exr', 'r1.json', 'r3.json', 'view.01.png', 'view.03.png'])
        self.assertTrue(json.loads((self.folder / 'r3.json').read_text())['image'])

    def test_what_is_there_is_skipped(self):
        self.render(frames='0,2')
        (self.folder / 'out.0002.exr').unlink()
        before = (self.folder / 'out.0000.exr').stat()
        result = json.loads(self.render('--skip-existing', '--json', frames='0-2').stdout)
        self.assertEqual([frame['frame'] for frame in result['frames']], [1, 2])
        self.assertEqual(result['skipped'], [0])
        self.assertEqual((self.folder / 'out.0000.exr').stat(), before)
        self.assertEqual(json.loads(self.render('--skip-existing', '--json', frames='0-2').stdout)['frames'], [])

    def test_groups_are_watched_fetched_and_cancelled(self):
        expected = self.digests()
        with Farm() as farm:
            farm.start_worker()
            submit = ('submit', self.scene, '--frames', '0-4x2', *OPTIONS)
            group = relume(*submit, server=farm.address).stdout.strip()
            self.assertTrue(group.startswith('groups/'), group)
            other = json.loads(relume(*submit, '--json', server=farm.address).stdout)
            self.assertNotEqual(other['group'], group)
            self.assertEqual([job['frame'] for job in other['jobs']], [0, 2, 4])

            watched = json.loads(relume('watch', group, '--json', '--quiet', server=farm.address).stdout)
            self.assertEqual({job['frame']: job['image_sha256'] for job in watched}, expected)
            fetched = relume('fetch', group, '-o', self.folder / 'got.##.exr', server=farm.address).stdout
            self.assertEqual(fetched.splitlines(), [f'{self.folder}/got.{frame:02}.exr: image digest {digest}'
                                                    for frame, digest in sorted(expected.items())])
            self.assertEqual([name for name in self.files() if name.startswith('got')], ['got.00.exr', 'got.02.exr', 'got.04.exr'])
            again = relume('fetch', group, '-o', self.folder / 'got.##.exr', '--skip-existing', server=farm.address)
            self.assertEqual(again.stdout, '')
            # Some of them, by name.
            names = [job['job'] for job in other['jobs']][1:]
            relume('watch', *names, '--quiet', server=farm.address)
            relume('fetch', *names, '-o', self.folder / 'some.#.exr', server=farm.address)
            self.assertEqual([name for name in self.files() if name.startswith('some')], ['some.2.exr', 'some.4.exr'])

            cancelled = relume('submit', self.scene, '--frames', '0-99', *LOOK, '--spp', '4096', server=farm.address).stdout.strip()
            lines = relume('pause', cancelled, server=farm.address).stdout.splitlines()
            self.assertEqual(len([line for line in lines if 'paused' in line]), 100, lines[0])
            self.assertEqual(len(relume('resume', cancelled, server=farm.address).stdout.splitlines()), 100)
            # All of these are over.
            self.assertEqual(relume('update', group, '--priority', '3', server=farm.address).stdout, '')
            lines = relume('cancel', cancelled, server=farm.address).stdout.splitlines()
            self.assertEqual(len(lines), 100)
            run = relume('watch', cancelled, '--quiet', server=farm.address, check=False)
            self.assertEqual(run.returncode, 5)
            self.assertIn('of 100 jobs have not succeeded', run.stderr)
            run = relume('fetch', 'groups/unknown', '-o', self.folder / 'x.#.exr', server=farm.address, check=False)
            self.assertEqual((run.returncode, run.stderr.count('\n')), (5, 1))
            self.assertIn('no such group', run.stderr)

    def test_a_frame_that_fails_stops_no_other(self):
        with Farm() as farm:
            process = subprocess.Popen(
                [BIN / 'relume', 'render', self.scene, '--frames', '0-3', *OPTIONS, '--json', '-o', self.folder / 'out.#.exr'],
                env=environment(farm.address), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            name = None
            while name is None:  # bounded by ctest's own time limit
                jobs = json.loads(relume('jobs', '--json', server=farm.address).stdout)
                name = next((job['job'] for job in jobs if job['frame'] == 3), None)
            relume('cancel', name, server=farm.address)
            farm.start_worker()
            out, error = process.communicate(timeout=240)
            self.assertEqual(process.returncode, 5, error)
            self.assertIn('1 of 4 frames failed: 3', error)
            result = json.loads(out)
            self.assertEqual([frame['frame'] for frame in result['frames']], [0, 1, 2])
            self.assertEqual([frame['frame'] for frame in result['failed']], [3])
            self.assertEqual(self.files(), ['out.0.exr', 'out.1.exr', 'out.2.exr'])

    def test_ctrl_c_cancels_what_is_left_and_the_next_run_goes_on(self):
        expected = self.digests(frames='0-5')
        for path in self.folder.iterdir():
            path.unlink()
        with Farm() as farm:
            farm.start_worker()
            process = subprocess.Popen(
                [BIN / 'relume', 'render', self.scene, '--frames', '0-99', *OPTIONS, '-o', self.folder / 'out.####.exr'],
                env=environment(farm.address), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            process.stdout.readline()  # the first frame is there
            process.send_signal(signal.SIGINT)
            _, error = process.communicate(timeout=240)
            self.assertEqual(process.returncode, 130, error)
            self.assertRegex(error, r'interrupted; \d+ of 100 frames are written')
            states = {'rendering'}
            while not states <= {'succeeded', 'cancelled'}:  # bounded by ctest's own time limit
                jobs = json.loads(relume('jobs', '--json', server=farm.address).stdout)
                states = {job['state'] for job in jobs}
            self.assertLess(len(jobs), 100)
            self.assertFalse([name for name in self.files() if not name.endswith('.exr')], 'nothing half-written')
            result = self.render('--skip-existing', '--json', frames='0-5', server=farm.address)
            for frame in json.loads(result.stdout)['frames']:
                self.assertEqual(frame['image_sha256'], expected[frame['frame']])
            self.assertTrue({f'out.{frame:04}.exr' for frame in range(6)} <= set(self.files()))

    def test_faults_are_one_line(self):
        still = animated_scene.write(self.folder / 'still', still=True)
        cases = (
            (2, 'e.g. 1-48', dict(frames='1-')),
            (2, 'before the animation', dict(frames='-1-3')),
            (2, 'all frames would go into one file', dict(pattern='out.exr')),
            (2, '--png', dict(more=('--png', self.folder / 'view.png'))),
            (2, '--time', dict(more=('--time', 1))),
            (2, 'fps', dict(more=('--fps', 0))),
            (3, 'nothing moves in this scene', dict(scene=still)),
            (6, 'is not there', dict(pattern='nowhere/out.#.exr')))
        for code, text, case in cases:
            more = case.pop('more', ())
            run = self.render(*more, check=False, **case)
            self.assertEqual(run.returncode, code, run.stderr)
            self.assertEqual(run.stderr.count('\n'), 1, run.stderr)
            self.assertIn(text, run.stderr)
            self.assertEqual(run.stdout, '')
        run = relume('render', self.scene, '--fps', 24, '-o', self.folder / 'x.exr', check=False)
        self.assertEqual(run.returncode, 2)
        run = relume('submit', self.scene, '--frames', '1-2', '--time-limit', 5, '--server', '127.0.0.1:1', check=False)
        self.assertEqual(run.returncode, 2)
        self.assertIn('--time-limit', run.stderr)
        self.assertEqual(self.files(), ['still'])


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
