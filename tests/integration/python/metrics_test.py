#!/usr/bin/python3
"""What is seen of a farm from outside: its metrics, scraped over loopback, and its JSON logs.

    metrics_test.py BIN_DIR SOURCE_DIR
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from processes import BIN, relume, ROOM, SOURCE

# One series a line: name, labels, value.
SERIES = re.compile(r'^([a-zA-Z_:][a-zA-Z0-9_:]*)(?:\{(.*)\})? (\S+)$')


class LoggedFarm:
    """A server with metrics and a worker, both logging JSON to files."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        common = ['--log-format', 'json', '--log-level', 'debug', f'--with-parent={os.getpid()}']
        self.logs = {name: open(self.folder / f'{name}.log', 'wb') for name in ('server', 'worker')}
        self.server = subprocess.Popen(
            [BIN / 'relume-server', '--listen', '127.0.0.1:0', '--metrics', '127.0.0.1:0',
             '--data', self.folder / 'data', *common],
            stdout=subprocess.PIPE, stderr=self.logs['server'], text=True)
        self.address = self.server.stdout.readline().split()[-1]
        self.worker = subprocess.Popen(
            [BIN / 'relume-worker', '--server', self.address, '--threads', '1', '--name', 'box "1"',
             '--cache', self.folder / 'cache', *common], stderr=self.logs['worker'])

    def lines(self, name):
        """The log so far; a line that is no JSON object fails here."""
        whole = (self.folder / f'{name}.log').read_bytes().decode().split('\n')[:-1]
        return [json.loads(line) for line in whole]

    def page(self):
        urls = [line['msg'].split()[-1] for line in self.lines('server')
                if line['msg'].startswith('metrics on ')]
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        with opener.open(urls[0], timeout=20) as answer:
            assert answer.headers['Content-Type'].startswith('text/plain'), answer.headers
            return answer.read().decode()

    def stop(self):
        for process in (self.worker, self.server):
            process.terminate()
        codes = [process.wait(timeout=20) for process in (self.worker, self.server)]
        self.server.stdout.close()
        for log in self.logs.values():
            log.close()
        return codes


def names(page):
    """Families and their types."""
    return dict(line.split()[2:4] for line in page.splitlines() if line.startswith('# TYPE '))


def values(page):
    """Sums over all series of a name."""
    sums = {}
    for line in page.splitlines():
        if not line.startswith('#'):
            name, _, value = SERIES.match(line).groups()
            sums[name] = sums.get(name, 0) + float(value)
    return sums


class MetricsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.farm = LoggedFarm(cls.folder.name)
        root = pathlib.Path(cls.folder.name)
        cls.empty = cls.farm.page()
        relume('render', ROOM, '--size', '64x48', '--spp', '8', '--filter', 'bilateral', '-o', root / 'a.exr',
               '--report', root / 'a.json', '--quiet', server=cls.farm.address)
        cls.report = json.loads((root / 'a.json').read_text())
        cls.full = cls.farm.page()
        cls.codes = cls.farm.stop()

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_values_are_those_of_the_report(self):
        before, after, report = values(self.empty), values(self.full), self.report
        self.assertEqual(before['relume_samples_total'], 0)
        self.assertEqual(after['relume_samples_total'], report['samples'])
        self.assertEqual(after['relume_rays_total'], report['rays'])
        self.assertEqual(after['relume_leases_issued_total'], report['leases']['issued'])
        self.assertEqual(after['relume_leases_reissued_total'], report['leases']['reissued'])
        self.assertEqual(after['relume_worker_samples_total'], report['samples'])
        self.assertEqual(after['relume_blob_store_bytes'], report['scene']['bytes'])
        self.assertAlmostEqual(after['relume_filter_seconds_sum'], report['filter']['seconds'], places=6)
        self.assertAlmostEqual(after['relume_render_core_seconds_total'],
                               report['workers'][0]['busy_seconds'], places=6)
        # Blobs came in from the client and went out to the worker.
        sent = dict(re.findall(r'relume_sent_bytes_total\{kind="(\w+)"\} (\S+)', self.full))
        self.assertEqual(float(sent['blob']), report['scene']['bytes'])
        self.assertEqual(float(sent['result']), report['image']['bytes'])
        self.assertEqual(self.codes, [0, 0])

    def test_log_lines_are_json_with_ids(self):
        job = self.report['job']
        for name in ('server', 'worker'):
            for line in self.farm.lines(name):
                self.assertEqual(list(line)[:5], ['ts', 'level', 'logger', 'pid', 'msg'])
                self.assertEqual(line['logger'], 'relume-' + name)
                self.assertLessEqual(set(line), {'ts', 'level', 'logger', 'pid', 'msg', 'job', 'worker', 'lease'})
        server, worker = self.farm.lines('server'), self.farm.lines('worker')
        known = self.report['workers'][0]['name']
        self.assertNotEqual(known, 'box "1"', 'the server has its own name for it')
        for lines in (server, worker):
            about = [line for line in lines if line.get('job') == job and 'lease' in line]
            self.assertEqual({line['worker'] for line in about}, {known})
            self.assertEqual(len({line['lease'] for line in about}), self.report['leases']['issued'])
        self.assertTrue(any('is here with 1 threads' in line['msg'] and line['worker'] == known
                            for line in server))
        self.assertTrue(any('filtered in' in line['msg'] and line['job'] == job for line in server))
        self.assertTrue(any('scene ready' in line['msg'] and line['job'] == job for line in worker))

    def test_the_board_asks_for_metrics_that_exist(self):
        board = json.loads((SOURCE / 'deploy/grafana/relume.json').read_text())
        types = names(self.full)
        exist = set(types)
        for name, kind in types.items():
            if kind == 'summary':
                exist |= {name + '_sum', name + '_count'}
        asked = set()
        for panel in board['panels']:
            for target in panel['targets']:
                found = re.findall(r'relume_\w+', target['expr'])
                self.assertTrue(found, target['expr'])
                asked |= set(found)
                self.check_labels(target['expr'])
        asked |= set(re.findall(r'relume_\w+', json.dumps(board['templating'])))
        self.assertEqual(asked - exist, set())
        self.assertGreater(len(asked), 25)
        ids = [panel['id'] for panel in board['panels']]
        self.assertEqual(len(ids), len(set(ids)))

    def check_labels(self, expression):
        """Values of labels that a query names are on the page, but those of jobs under way."""
        for name, selector in re.findall(r'(relume_\w+)\{([^}]*)\}', expression):
            for label, value in re.findall(r'(\w+)="([^"$]*)"', selector):
                if not name.startswith('relume_job_'):
                    self.assertRegex(self.full, rf'(?m)^{name}\{{.*{label}="{value}"')

    def test_the_manual_lists_them_all(self):
        manual = (SOURCE / 'docs/operations.md').read_text()
        rows = re.findall(r'^\| (`relume_[^|]*) \| (\w+) \|', manual, re.M)
        listed = {name: kind for cell, kind in rows for name in re.findall(r'`(relume_\w+)`', cell)}
        real = {n: t for n, t in names(self.full).items() if n.startswith('relume_')}
        self.assertEqual(listed, real)

    def test_promtool_has_nothing_to_say(self):
        promtool = shutil.which('promtool')
        if promtool is None:
            self.skipTest('promtool (Debian: prometheus) is not installed')
        # The page's own; what the library adds is not ours.
        page = '\n'.join(line for line in self.full.splitlines() if 'exposer_' not in line) + '\n'
        check = subprocess.run([promtool, 'check', 'metrics'], input=page, text=True,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.assertEqual((check.returncode, check.stdout), (0, ''))
        subprocess.run([promtool, 'check', 'config', SOURCE / 'deploy/prometheus.yml'], check=True,
                       stdout=subprocess.DEVNULL)


class OptionsTest(unittest.TestCase):
    def fails(self, *arguments, log='text'):
        with tempfile.TemporaryDirectory() as folder:
            run = subprocess.run(
                [BIN / 'relume-server', '--listen', '127.0.0.1:0', '--data', folder, '--log-format', log, *arguments],
                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=60)
        self.assertEqual(run.returncode, 1)
        return run.stderr

    def test_beyond_loopback_only_if_told(self):
        words = self.fails('--metrics', '0.0.0.0:0')
        self.assertIn('--metrics 0.0.0.0:0', words)
        self.assertIn('--insecure', words)

    def test_what_is_no_address_or_format_is_refused(self):
        self.assertIn("'9464' is no address", self.fails('--metrics', '9464'))
        self.assertIn("unknown log format 'xml'; known: text, json", self.fails(log='xml'))

    def test_the_last_words_are_json_as_well(self):
        for line in self.fails('--metrics', '203.0.113.1:1', '--insecure', log='json').splitlines():
            last = json.loads(line)
        self.assertEqual(last['level'], 'critical')
        self.assertIn("can't listen on 203.0.113.1:1", last['msg'])


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
