#!/usr/bin/python3
"""Whatever is killed, jobs end with the same bits.

    restart_test.py BIN_DIR SOURCE_DIR

Real processes on loopback: the server is killed (SIGKILL) at random instants, chosen by a seed, while it renders
and while it filters, and started again on its folder and port; workers are killed; clients come back. The image of
every job is that of an undisturbed run, and the ledger says that each sample is counted once.
"""
import json
import pathlib
import random
import subprocess
import sys
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from processes import BIN, Farm, ROOM, environment, relume

JOB = (ROOM, '--size', '112x70', '--spp', '64', '--seed', '3', '--filter', 'bilateral')


def submit(farm, *job):
    return relume('submit', *job, server=farm.address).stdout.strip()


def watch(farm, name):
    """The job as `relume watch` tells it in the end."""
    return json.loads(relume('watch', name, '--json', '--quiet', server=farm.address).stdout)


class RestartTest(unittest.TestCase):
    def check_ledger(self, job):
        ledger = job['ledger']
        self.assertTrue(ledger['clean'], ledger)
        self.assertEqual(ledger['samples'], job['samples'])
        self.assertEqual(ledger['film_samples'], job['samples'])

    def test_a_server_that_is_killed_while_it_renders_costs_no_bit(self):
        killed = 0
        with Farm('--save-every', '0.1') as farm:
            for _ in range(2):
                farm.start_worker()
            start = time.monotonic()
            expected = watch(farm, submit(farm, *JOB))
            seconds = time.monotonic() - start
            for seed in range(4):
                instants = random.Random(seed)
                name = submit(farm, *JOB)
                client = subprocess.Popen([BIN / 'relume', 'watch', name, '--quiet'],
                                          env=environment(farm.address))
                for _ in range(2):
                    time.sleep(instants.uniform(0, 0.7 * seconds))
                    killed += farm.job(name)['state'] != 'succeeded'
                    farm.kill_server()
                    time.sleep(instants.uniform(0, 0.3))
                    farm.start_server()
                job = watch(farm, name)
                self.assertEqual(job['image_sha256'], expected['image_sha256'], f'seed {seed}')
                self.check_ledger(job)
                self.assertEqual(client.wait(timeout=60), 0)
            self.assertEqual(farm.alive(), [True, True, True])
        self.assertGreater(killed, 2, 'no kill met a job under way: the test is void')

    def test_a_server_that_is_killed_while_it_filters_filters_again(self):
        job = (ROOM, '--size', '400x250', '--spp', '4', '--filter', 'nfor')
        with Farm('--save-every', '0.1') as farm:
            farm.start_worker()
            expected = watch(farm, submit(farm, *job))
            name = submit(farm, *job)
            for _ in range(2):
                while (state := farm.job(name)['state']) != 'filtering':
                    self.assertNotEqual(state, 'succeeded', 'the filter was too fast to be caught: the test is void')
                    time.sleep(0.02)
                farm.kill_server()
                farm.start_server()
            again = watch(farm, name)
            self.assertEqual(again['image_sha256'], expected['image_sha256'])
            self.check_ledger(again)
            self.assertGreater(again['restarts'], 0)

    def test_what_was_done_before_is_still_to_be_fetched(self):
        with Farm() as farm:
            farm.start_worker()
            name = submit(farm, ROOM, '--size', '40x25', '--spp', '4')
            watch(farm, name)
            first, second = farm.folder / 'first.exr', farm.folder / 'second.exr'
            relume('fetch', name, '-o', first, server=farm.address)
            farm.kill_server()
            farm.start_server()
            relume('fetch', name, '-o', second, server=farm.address)
            self.assertEqual(first.read_bytes(), second.read_bytes())

    def test_a_job_is_extended_across_a_kill(self):
        size = ('--size', '64x40', '--sampler', 'uniform', '--filter', 'none')
        with Farm() as farm:
            farm.start_worker()
            expected = watch(farm, submit(farm, ROOM, *size, '--spp', '64'))
            name = submit(farm, ROOM, *size, '--spp', '8')
            watch(farm, name)
            while not farm.job(name)['save_seconds']:
                time.sleep(0.02)
            farm.kill_server()
            farm.start_server()
            relume('extend', name, '--spp', '64', server=farm.address)
            farm.kill_server()
            farm.start_server()
            job = watch(farm, name)
            self.assertEqual(job['image_sha256'], expected['image_sha256'])
            self.assertEqual(job['samples'], 64 * 64 * 40)
            self.check_ledger(job)

    def test_workers_that_are_killed_cost_no_bit(self):
        with Farm('--save-every', '0.1') as farm:
            farm.start_worker()
            expected = watch(farm, submit(farm, *JOB))
            name = submit(farm, *JOB)
            instants = random.Random(7)
            for _ in range(3):
                worker = farm.start_worker()
                time.sleep(instants.uniform(0.1, 0.5))
                worker.kill()
                worker.wait()
            job = watch(farm, name)
            self.assertEqual(job['image_sha256'], expected['image_sha256'])
            self.check_ledger(job)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
