#!/usr/bin/python3
"""Samples, target, time and caps end a job; results and reports say which did. Never how long it took: only why it ended.

    budgets_test.py BIN_DIR SOURCE_DIR
"""
import json
import pathlib
import shutil
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from processes import ROOM, relume


class BudgetsTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())

    def tearDown(self):
        shutil.rmtree(self.folder)

    def render(self, *options):
        report = self.folder / 'report.json'
        relume('render', ROOM, '-o', self.folder / 'out.exr', '--size', '64x48', '--filter', 'none', '--report', report,
               '--quiet', *options)
        self.assertTrue((self.folder / 'out.exr').is_file())
        return json.loads(report.read_text())

    def refused(self, *options, says):
        run = relume('render', ROOM, '-o', self.folder / 'out.exr', '--quiet', *options, check=False)
        self.assertEqual(run.returncode, 2, run.stderr)
        self.assertIn(says, run.stderr)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_time_limit(self):
        report = self.render('--time-limit', '4', '--sampler', 'adaptive', '--target', '1e-9', '--png',
                             self.folder / 'view.png')
        self.assertEqual(report['stop_reason'], 'time-limit')
        self.assertIn('time limit', report['why_stopped'])
        self.assertEqual(report['settings']['time_limit'], 4)
        self.assertIsNone(report['settings']['spp'])
        self.assertEqual(report['passes'][0]['samples'], 2 * 64 * 48)
        self.assertGreater(report['forecast']['finish_seconds'], 0)

    def test_a_time_limit_that_is_too_short_says_so(self):
        report = self.render('--time-limit', '0.01')
        self.assertEqual(report['stop_reason'], 'time-limit')
        self.assertIn('too short', report['why_stopped'])
        self.assertEqual(report['spp'], 2)

    def test_target(self):
        digests = set()
        for options in (['--workers', '1'], ['--workers', '2', '--tile-size', '16']):
            report = self.render('--target', '0.02', '--sampler', 'adaptive', '--threads', '1', *options)
            self.assertEqual(report['stop_reason'], 'target')
            self.assertIn('target reached', report['why_stopped'])
            self.assertLessEqual(report['passes'][-1]['image_relmse'], 0.02)
            self.assertGreater(report['passes'][-1]['image_relmse'], 0.01)
            self.assertIsNotNone(report['passes'][-1]['relmse_predicted'])
            self.assertGreaterEqual(len(report['forecast']['curve']), 1)
            digests.add(report['image']['sha256'])
        self.assertEqual(len(digests), 1, 'passes follow from the image alone')

    def test_the_first_that_is_met_ends_it(self):
        report = self.render('--spp', '12', '--target', '1e-9', '--max-spp', '100', '--time-limit', '600')
        self.assertEqual(report['stop_reason'], 'spp')
        self.assertEqual(report['spp'], 12)
        self.assertEqual(report['why_stopped'], 'sample budget spent')

    def test_max_spp_and_min_spp(self):
        report = self.render('--max-spp', '14', '--min-spp', '10', '--sampler', 'uniform')
        self.assertEqual(report['stop_reason'], 'max-spp')
        self.assertEqual(report['spp'], 14)
        self.assertEqual(report['passes'][0]['samples'], 10 * 64 * 48)

    def test_without_a_budget_adaptive_ends_by_itself(self):
        report = self.render('--sampler', 'adaptive', '--max-depth', '1')
        self.assertIn(report['stop_reason'], ('target', 'sampler'))
        self.assertEqual(report['settings']['target'], 0.005)
        self.assertLess(report['relmse'], 0.0055)

    def test_what_makes_no_sense_is_refused(self):
        self.refused('--min-spp', '9', '--max-spp', '8', says='min-spp 9 is more than max-spp 8')
        self.refused('--target', '0', says='--target 0: must be a number above 0')
        self.refused('--time-limit', 'nan', says='--time-limit nan: must be a number above 0')
        self.refused('--max-spp', '1.5', says='--max-spp 1.5: must be a whole number')


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
