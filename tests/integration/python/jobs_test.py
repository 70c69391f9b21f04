#!/usr/bin/python3
"""Many jobs on one farm, by the command line: priorities, owners, pausing, resuming, cancelling.

    jobs_test.py BIN_DIR SOURCE_DIR

Real processes on loopback. A paused job lets others pass, stays paused when the server is killed (SIGKILL), and ends in
the bits of an undisturbed run; a cancelled one leaves an image, and can be taken up again; two owners get equal
shares of the core-seconds.
"""
import json
import pathlib
import sys
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from processes import Farm, ROOM, relume

JOB = (ROOM, '--size', '112x70', '--spp', '128', '--filter', 'bilateral')
ENDLESS = (ROOM, '--size', '112x70', '--spp', '1000000', '--sampler', 'uniform', '--filter', 'none')


class JobsTest(unittest.TestCase):
    def ask(self, *arguments, **more):
        return relume(*arguments, server=self.farm.address, **more)

    def submit(self, *job):
        return self.ask('submit', *job).stdout.strip()

    def watch(self, name, check=True):
        return json.loads(self.ask('watch', name, '--json', '--quiet', check=check).stdout)

    def wait_until(self, good):
        end = time.monotonic() + 120
        while not good():
            self.assertLess(time.monotonic(), end, 'waited in vain: ' + self.ask('jobs').stdout)
            time.sleep(0.05)

    def seconds_of(self, owner):
        return sum(job['core_seconds'] for job in json.loads(self.ask('jobs', '--json').stdout) if job['owner'] == owner)

    def test_a_paused_job_outlives_the_server_and_ends_in_the_same_bits(self):
        with Farm('--save-every', '0.1') as self.farm:
            self.farm.start_worker()
            expected = self.watch(self.submit(*JOB))
            name = self.submit(*JOB, '--priority', '3')
            self.wait_until(lambda: self.farm.job(name)['samples'] > 0)
            self.assertEqual(self.ask('pause', name).stdout, f'{name}: paused\n')
            self.farm.kill_server()
            self.farm.start_server()
            self.assertEqual(self.watch(self.submit(*JOB))['image_sha256'], expected['image_sha256'])
            job = self.farm.job(name)
            self.assertEqual((job['paused'], job['priority'], job['share']), (True, 3, None))
            self.assertIn(' paused ', self.ask('jobs').stdout)
            self.ask('resume', name.removeprefix('jobs/'))
            job = self.watch(name)
            self.assertEqual(job['image_sha256'], expected['image_sha256'])
            self.assertEqual(job['restarts'], 1)
            self.assertTrue(job['ledger']['clean'], job['ledger'])
            for verb in ('pause', 'resume'):
                refused = self.ask(verb, name, check=False)
                self.assertEqual(refused.returncode, 5)
                self.assertIn(f'{name} is over', refused.stderr)

    def test_a_cancelled_job_leaves_an_image_and_can_be_taken_up_again(self):
        with Farm('--save-every', '0.1') as self.farm:
            self.farm.start_worker()
            expected = self.watch(self.submit(*JOB))
            name = self.submit(*JOB)
            self.wait_until(lambda: self.farm.job(name)['samples'] > 0)
            self.ask('pause', name)  # so that it does not end before it is cancelled
            self.ask('cancel', name)
            over = self.ask('watch', name, check=False)
            self.assertEqual(over.returncode, 5)
            self.assertIn('relume fetch', over.stderr)
            job = self.farm.job(name)
            self.assertEqual((job['state'], job['stop_reason']), ('cancelled', 'cancelled'))
            self.assertLess(job['samples'], expected['samples'])
            image, report = self.farm.folder / 'part.exr', self.farm.folder / 'part.json'
            self.ask('fetch', name, '-o', image, '--report', report)
            about = json.loads(relume('info', image, '--json').stdout)
            self.assertEqual(about['metadata']['relume.unfinished'], 'cancelled')
            self.assertEqual(json.loads(report.read_text())['state'], 'cancelled')
            self.ask('extend', name, '--spp', '128')
            self.assertEqual(self.watch(name)['image_sha256'], expected['image_sha256'])

            waits = self.submit(*ENDLESS)
            self.assertEqual(self.ask('cancel', '--discard', waits).stdout, f'{waits}: cancelled\n')
            self.assertEqual(self.ask('fetch', waits, '-o', image, check=False).returncode, 5)

    def test_priorities_go_first_and_owners_share_evenly(self):
        with Farm() as self.farm:
            for _ in range(2):
                self.farm.start_worker()
            ann = self.submit(*ENDLESS, '--owner', 'ann')
            self.wait_until(lambda: self.seconds_of('ann') > 1)
            urgent = self.submit(*JOB, '--owner', 'ann', '--priority', '10')
            waits = self.submit(*JOB, '--owner', 'ann')
            self.assertEqual(self.watch(urgent)['state'], 'succeeded')
            self.assertNotEqual(self.farm.job(waits)['state'], 'succeeded')
            for priority in ('101', '-101', 'high'):
                self.assertEqual(self.ask('update', waits, '--priority', priority, check=False).returncode, 2)
            self.assertIn(', priority 1\n', self.ask('update', waits, '--priority', '1').stdout)
            self.assertEqual(self.watch(waits)['state'], 'succeeded')
            # Who comes later gets as much from then on, within what workers stay with one of them (5 s each).
            before = self.seconds_of('ann')
            self.submit(*ENDLESS, '--owner', 'bob')
            self.submit(*ENDLESS, '--owner', 'bob')
            self.wait_until(lambda: self.seconds_of('bob') > 20)
            self.assertLess(abs(self.seconds_of('ann') - before - self.seconds_of('bob')), 2 * 5 + 5)
            listed = self.ask('jobs').stdout
            self.assertIn('OWNER', listed)
            self.assertIn(' bob ', listed)
            self.assertGreater(self.farm.job(ann)['share'], 0)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
