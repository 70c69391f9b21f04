#!/usr/bin/python3
"""Fronts, interpolation and means on curves whose answers are known, and EXRs written and read.

    front_test.py BIN_DIR SOURCE_DIR
"""
import sys
import tempfile
import unittest

import paths  # noqa: F401, I001
import numpy as np

from chart import exr, front, page, plots, summary
from chart.judge import ROUNDS, TIME_NOISE, Verdict, confirmed, judge
from chart.methods import BASE, DEFAULT, Method
from chart.summary import Point

BILATERAL = Method('uniform', 'bilateral')


def point(scene, method, spp, time, error, stop='spp'):
    return Point(scene, method, stop, spp, spp or 10, time, time / 2, time, dict.fromkeys(('mrse', 'relmse', 'ssim', 'flip'), error),
                 1.0, 0, False, 1)


class FrontTest(unittest.TestCase):
    HALVING = [(1, 0.8), (2, 0.4), (4, 0.2)]  # error 0.8 / time

    def test_errors_between_points_follow_the_power_law(self):
        self.assertAlmostEqual(front.error_at(self.HALVING, 3), 0.8 / 3)
        self.assertAlmostEqual(front.error_at(self.HALVING, 2), 0.4)

    def test_nothing_is_known_before_the_first_point_and_nothing_is_gained_after_the_last(self):
        self.assertIsNone(front.error_at(self.HALVING, 0.9))
        self.assertEqual(front.error_at(self.HALVING, 100), 0.2)

    def test_a_method_that_gets_worse_keeps_its_best(self):
        self.assertEqual(front.error_at([(1, 0.1), (2, 0.3)], 2), 0.1)

    def test_time_for_an_error(self):
        self.assertEqual(front.time_for(self.HALVING, 0.3)[1], '')
        self.assertAlmostEqual(front.time_for(self.HALVING, 0.3)[0], 0.8 / 0.3)
        self.assertEqual(front.time_for(self.HALVING, 0.9), (1, '<'))
        time, how = front.time_for(self.HALVING, 0.05)
        self.assertAlmostEqual(time, 16)
        self.assertEqual(how, '~')

    def test_time_for_what_is_out_of_reach(self):
        self.assertEqual(front.time_for(self.HALVING, 0.0001), (None, '>'))  # 8000 s, above 64 times the last
        self.assertEqual(front.time_for([(1, 0.5), (2, 0.5)], 0.4), (None, '>'))
        self.assertEqual(front.time_for([(1, 0.5)], 0.4), (None, '>'))

    def test_front_is_what_no_other_beats(self):
        self.assertEqual(front.front([(1, 5), (2, 6), (3, 2), (3, 1), (0.5, 9)]), [4, 0, 3])

    def test_distance_names_who_beats_a_method(self):
        lines = {'ours': [(2, 0.5), (0.5, 1)], 'them': self.HALVING, 'slow': [(8, 0.01)]}
        (_, _, ratio, by), (_, _, none, nobody) = front.distance_from_front(lines, 'ours')
        self.assertAlmostEqual(ratio, 0.5 / 0.4)
        self.assertEqual((by, none, nobody), ('them', None, None))

    def test_geometric_mean(self):
        self.assertAlmostEqual(front.geomean([1, 100]), 10)


class SummaryTest(unittest.TestCase):
    def test_scenes_weigh_alike_over_all(self):
        points = [point('a', BASE, 8, 1, 0.1), point('a', BILATERAL, 8, 2, 0.05),
                  point('b', BASE, 8, 100, 10), point('b', BILATERAL, 8, 800, 1.25), point('a', DEFAULT, 8, 1, 0.1)]
        every = {p.method: p for p in summary.over_all(points, 8)}
        self.assertNotIn(DEFAULT, every)  # not run on b
        self.assertAlmostEqual(every[BASE].time, 1)
        self.assertAlmostEqual(every[BILATERAL].time, 4)
        self.assertAlmostEqual(every[BILATERAL].errors['mrse'], 0.25)

    def test_errors_below_the_references_own_are_ties(self):
        line = {'scene': 'a', 'sampler': 'uniform', 'filter': 'none', 'stop': 'spp', 'spp': 8, 'seed': 1, 'failed': None,
                'mean_spp': 8, 'cpu_seconds': 1, 'sampling_seconds': 1, 'wall_seconds': 1, 'mrse': 0.0205, 'mrse_above': 0.0005,
                'relmse': 0.1, 'relmse_above': 0.08, 'ssim': 0.9, 'flip': 0.1, 'energy': 1, 'bad': 0, 'render': '', 'image': ''}
        made, = summary.summarise([line, {**line, 'seed': 2, 'mrse_above': -0.0015}, {**line, 'seed': 3, 'failed': 'x'}],
                                  {'a': {'floor': {'mrse': 0.02, 'relmse': 0.02}}})
        self.assertTrue(made.tie)
        self.assertEqual(made.seeds, 2)
        self.assertAlmostEqual(made.errors['mrse'], 0.002)
        self.assertAlmostEqual(made.errors['relmse'], 0.08)


class JudgeTest(unittest.TestCase):
    def verdict(self, error, floor, time=3):
        points = [point('a', BILATERAL, 8, 1, 0.8), point('a', BILATERAL, 32, 4, 0.2), point('a', DEFAULT, 8, time, error)]
        verdict, = judge(points, {'a': {'floor': {'mrse': floor, 'relmse': floor}}}, 1.1)
        return verdict

    def test_a_tenth_is_allowed_and_more_names_who_is_better(self):
        between = 0.8 / (3 * (1 - TIME_NOISE))
        self.assertFalse(self.verdict(1.09 * between, 0.01).beaten)
        verdict = self.verdict(1.11 * between, 0.01)
        self.assertEqual((verdict.beaten, verdict.scene, verdict.by), (True, 'a', BILATERAL))
        self.assertIn('1.11 of uniform + bilateral', verdict.text)

    def test_what_the_reference_cannot_tell_apart_is_a_tie(self):
        self.assertFalse(self.verdict(0.4, 0.4).beaten)

    def test_the_fastest_is_not_beaten_and_an_absent_default_is(self):
        self.assertFalse(self.verdict(0.9, 0.01, time=0.5).beaten)
        verdict, = judge([point('a', BILATERAL, 8, 1, 0.8)], {'a': {'floor': None}}, 1.1)
        self.assertEqual((verdict.beaten, verdict.by), (True, None))

    def test_what_is_beaten_is_measured_again_with_what_beats_it(self):
        asked = []

        def answers(*verdicts):
            left = list(verdicts)
            asked.clear()
            return lambda pairs: (asked.append(pairs), [left.pop(0)])[1]
        lost, won = Verdict('a', '', True, BILATERAL), Verdict('a', '')
        self.assertEqual(confirmed([lost], answers(lost, won)), [won])
        self.assertEqual(asked, [[('a', [DEFAULT, BILATERAL])]] * 2)
        self.assertEqual(confirmed([lost], answers(*[lost] * 9)), [lost])
        self.assertEqual(len(asked), ROUNDS)
        self.assertEqual(confirmed([won], answers()), [won])
        never_run = Verdict('a', '', True)
        self.assertEqual(confirmed([never_run], answers()), [never_run])


class OutputTest(unittest.TestCase):
    def test_exr_keeps_every_bit(self):
        image = np.random.default_rng(1).normal(size=(37, 21, 3)).astype(np.float32)
        image[3, 4] = (np.nan, np.inf, -0.0)
        with tempfile.NamedTemporaryFile(suffix='.exr') as file:
            exr.write_rgb(file.name, image, {'relume.filter': 'x'})
            self.assertEqual(exr.read_rgb(file.name).tobytes(), image.tobytes())
            self.assertEqual(exr.read(file.name)[1]['relume.filter'], 'x')

    def test_pages_load_nothing(self):
        points = [point('a', m, s, t * s, e / s, stop) for m, t, e, stop in (
            (BASE, 1, 1, 'spp'), (BILATERAL, 1.2, 0.3, 'spp'), (DEFAULT, 2, 0.1, 'spp'), (DEFAULT, 3, 0.1, 'own rule')) for s in (4, 8)]
        figure = plots.pareto(points, plots.Looks([p.method for p in points]), 'a')
        text = page.render('<t>', 'words', {'version': '', 'build': '', 'date': '', 'machine': {'processor': ''}, 'threads': 2,
                                            'seeds': [1], 'missing': []},
                           [page.section('One', [page.chart(plots.svg(figure)), page.table(['h'], [[page.marked('1', 'best')]])])])
        self.assertNotIn('<t>', text)
        self.assertIn('class="best text"', text)
        for outside in ('src="http', 'href="http', '@import', '<link rel="stylesheet"'):
            self.assertNotIn(outside, text)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
