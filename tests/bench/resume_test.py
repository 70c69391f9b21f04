#!/usr/bin/python3
"""A study that is killed and started again repeats no finished run, and what filters make of a kept film is what a render
with the filter gives.

    resume_test.py BIN_DIR SOURCE_DIR
"""
import csv
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import paths
from chart.methods import IN_RENDER
from chart.programs import BenchError, Programs
from chart.runs import Runs
from chart.scenes import make_view
from chart.suite import load

SUITE = '''
scenes: [{name: box, file: own/cornell/cornell.gltf, size: 32x32}, {name: gone, file: nowhere.gltf}]
samplers: [uniform]
filters: [none, bilateral, gem]
spp: [2, 4]
seeds: [1, 2]
reference_spp: 16
sections: [pareto, speedup, errors, pictures, parsimony]
'''


class ResumeTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.store = self.folder / 'store'
        self.suite = self.folder / 'tiny.yaml'
        self.suite.write_text(SUITE)
        self.command = [str(paths.SOURCE / 'bench' / 'relume-bench'), str(self.suite), '--store', str(self.store),
                        '--programs', str(paths.BIN), '--threads', '2']

    def tearDown(self):
        shutil.rmtree(self.folder)

    def records(self):
        return {path.name: (path.stat().st_ino, path.stat().st_mtime_ns) for path in self.store.glob('runs/*/*.json')}

    def run_to_the_end(self):
        done = subprocess.run(self.command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=300, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stderr

    def test_a_killed_study_repeats_nothing(self):
        with subprocess.Popen(self.command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as study:
            end = time.monotonic() + 120
            while len(self.records()) < 4 and study.poll() is None and time.monotonic() < end:
                time.sleep(0.01)
            os.kill(study.pid, signal.SIGKILL)
        before = self.records()
        self.assertGreaterEqual(len(before), 4)
        said = self.run_to_the_end()
        self.assertIn('gone: skipped', said)
        after = self.records()
        self.assertGreater(len(after), len(before), 'the study was over before it was killed')
        self.assertEqual({name: after[name] for name in before}, before)
        self.run_to_the_end()
        self.assertEqual(self.records(), after)
        self.assertFalse(list(self.store.glob('farm-*')))
        with open(self.store / 'tiny' / 'results.csv', encoding='utf-8') as file:
            lines = list(csv.DictReader(line for line in file if not line.startswith('#')))
        self.assertEqual(len(lines), (3 + 1) * 2 * 2)  # three methods and the default, two counts, two seeds
        self.assertTrue(all(float(line['mrse']) > 0 and float(line['cpu_seconds']) > 0 for line in lines))

    def test_filters_make_the_same_of_a_film_and_in_a_render(self):
        view = make_view({'name': 'box', 'file': 'own/cornell/cornell.gltf', 'size': '48x40'})
        with Runs(str(self.store), Programs(str(paths.BIN))) as runs:
            film = runs.render(view, 'uniform', 4, 1)
            for name in ('bilateral', 'bilateral:mode=printed', 'gem', 'nlm', 'sbf', 'sbf-gradient', 'wlr'):
                self.assertNotIn(name, IN_RENDER)
                errors = runs.compare({**runs.render(view, 'uniform', 4, 1, name), 'floor': None}, runs.denoise(film, name))
                self.assertLess(errors['mrse'], 1e-7, name)

    def test_a_round_measures_once_more_and_keeps_the_least_time(self):
        view = make_view({'name': 'box', 'file': 'own/cornell/cornell.gltf', 'size': '24x24'})
        with Runs(str(self.store), Programs(str(paths.BIN))) as runs:
            film = runs.render(view, 'uniform', 4, 1)
            image = runs.denoise(film, 'bilateral')
            pixels = pathlib.Path(film['image']).read_bytes()
            slow = {**film, 'image': '.exr', 'seconds': {**film['seconds'], 'cpu': 1e9}}
            quick = {**image, 'image': '.exr', 'process': {'cpu': 1e-9, 'wall': 1e-9}}
            runs.store.put(film['key'], slow)
            runs.store.put(image['key'], quick)
            done = runs.done
            with runs.another_round():
                again = runs.render(view, 'uniform', 4, 1)
                self.assertEqual(runs.render(view, 'uniform', 4, 1), again)
                self.assertEqual(runs.denoise(again, 'bilateral')['process'], quick['process'])
            self.assertEqual(runs.done, done + 3)  # film, filter, and what the process itself takes: once each
            self.assertLess(again['seconds']['cpu'], 1e9)
            self.assertEqual(pathlib.Path(again['image']).read_bytes(), pixels)
            self.assertEqual(runs.render(view, 'uniform', 4, 1), again)
            self.assertEqual(runs.done, done + 3)

    def test_what_fails_is_a_result_or_an_error_by_whose_fault_it_is(self):
        view = make_view({'name': 'box', 'file': 'own/cornell/cornell.gltf', 'size': '16x16'})
        with Runs(str(self.store), Programs(str(paths.BIN))) as runs:
            wrong = runs.render(view, 'uniform', 2, 1, 'nosuchfilter')
            self.assertIn('nosuchfilter', wrong['failed'])
            self.assertIsNone(wrong['image'])
            done = runs.done
            self.assertEqual(runs.render(view, 'uniform', 2, 1, 'nosuchfilter')['failed'], wrong['failed'])
            self.assertEqual(runs.done, done)
        with self.assertRaisesRegex(BenchError, 'deploy/build'):
            Programs(str(self.folder))

    def test_other_counts_in_place_of_a_suites_are_the_defaults_too(self):
        self.suite.write_text(SUITE + 'default_spp: [8, 32]\n')
        self.assertEqual(load(str(self.suite)).default_spp, [8, 32])
        self.assertEqual(load(str(self.suite), spp=[4, 8, 64]).default_spp, [8])
        self.assertEqual(load(str(self.suite), spp=[2, 4]).default_spp, [2, 4])

    def test_suites_say_what_is_wrong_with_them(self):
        for text, said in (('scenes: [a', 'no YAML'), ('spp: 8', 'mapping with `scenes`'), (SUITE + 'sample: 3', 'no field sample'),
                           (SUITE.replace('errors', 'erors'), 'no section erors'), ('scenes: [nosuch]', 'scene nosuch')):
            self.suite.write_text(text)
            with self.assertRaisesRegex(BenchError, said):
                load(str(self.suite))


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
