#!/usr/bin/python3
"""The paper's claims get the verdicts that the figures ask for.

    claims_test.py BIN_DIR SOURCE_DIR
"""
import sys
import unittest

import paths  # noqa: F401, I001
from chart import claims
from chart.claims import FAILS, HOLDS, OURS, UNKNOWN
from chart.methods import Method
from chart.summary import Point


def point(scene, method, mrse, spp=8, ssim=0.1, time=2.0):
    errors = {'mrse': mrse, 'relmse': mrse, 'ssim': ssim, 'flip': mrse}
    return Point(scene, method, 'spp', spp, spp, time, 1.0, time, errors, 1.0, 0, False, 1)


def ours(scene, printed, corrected, **further):
    return [point(scene, OURS['printed'], printed, **further), point(scene, OURS['corrected'], corrected, **further)]


class ClaimsTest(unittest.TestCase):
    def test_lower_takes_the_better_plan_of_the_peer(self):
        rd = [point('sponza', Method('uniform', 'rd'), 0.5), point('sponza', Method('rd', 'rd'), 0.1)]
        self.assertEqual(claims.lower(rd + ours('sponza', 0.2, 0.3), 'sponza', 'rd', 8, 'Sponza').verdict, HOLDS)
        self.assertEqual(claims.lower(rd + ours('sponza', 0.2, 0.05), 'sponza', 'rd', 8, 'Sponza').verdict, FAILS)
        self.assertEqual(claims.lower(rd, 'sponza', 'rd', 8, 'Sponza').verdict, UNKNOWN)

    def test_everywhere_needs_one_reading_that_wins_all_scenes(self):
        def verdict(second):
            points = [point(s, Method('uniform', 'nlm'), 1, ssim=0.2) for s in 'ab']
            points += ours('a', 1, 1, ssim=0.1) + ours('b', 1, 1, ssim=second)
            return claims.everywhere(points, ['a', 'b'], 8, '', '', lambda p: p.errors['ssim'])
        self.assertEqual(verdict(0.1).verdict, HOLDS)
        self.assertEqual(verdict(0.3).verdict, FAILS)
        self.assertIn('best on 1 of 2; worst b, 1.50 of nlm', verdict(0.3).figures)

    def test_falling_means_at_every_step(self):
        points = ours('a', 0.4, 0.4, spp=4) + ours('a', 0.3, 0.3, spp=8)
        self.assertEqual(claims.falls(points + ours('a', 0.2, 0.2, spp=16), ['a'], [4, 8, 16]).verdict, HOLDS)
        self.assertEqual(claims.falls(points + ours('a', 0.35, 0.2, spp=16), ['a'], [4, 8, 16]).verdict, FAILS)
        self.assertEqual(claims.falls(points, ['a'], [4, 8, 16]).verdict, UNKNOWN)

    def test_passes_are_equal_within_a_quarter(self):
        self.assertEqual(claims.passes({'printed': [4, 8, 9, 10], 'corrected': [4, 12, 20, 28]}).verdict, HOLDS)
        self.assertEqual(claims.passes({'printed': [4, 12, 20, 28]}).verdict, FAILS)
        self.assertEqual(claims.passes({'printed': [4, 8]}).verdict, FAILS)
        self.assertEqual(claims.passes({}).verdict, UNKNOWN)

    def test_blurring_is_less_than_the_reference_and_than_the_others(self):
        self.assertEqual(claims.blurs('v', {'sbf-gradient': 0.8, 'printed': 0.9, 'corrected': 0.9}).verdict, HOLDS)
        self.assertEqual(claims.blurs('v', {'sbf-gradient': 0.8, 'printed': 0.7, 'corrected': 0.9}).verdict, FAILS)

    def test_networks_are_better_than_none_and_as_good_as_kpcn(self):
        def verdicts(printed, mixed):
            errors = {'net:mode=printed': printed, 'net': mixed, 'kpcn': 0.1, 'bilateral:mode=printed': 0.5,
                      'bilateral:mode=corrected': 0.2}
            points = [point('a', Method('uniform', f), e) for f, e in errors.items()]
            return [line.verdict for line in claims.networks(points, ['a'], 8)]
        self.assertEqual(verdicts(0.1, 0.1), [HOLDS, HOLDS])
        self.assertEqual(verdicts(0.3, 0.1), [HOLDS, FAILS])
        self.assertEqual(verdicts(0.1, 0.3), [FAILS, FAILS])

    def test_every_testable_claim_has_a_line_whatever_was_run(self):
        lines = claims.check(ours('a', 0.2, 0.1), ['a'], [8])
        self.assertEqual(len(lines), 12)
        self.assertTrue(all(line.verdict == UNKNOWN and line.why for line in lines if not line.figures))


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
