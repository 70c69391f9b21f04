#!/usr/bin/python3
"""deploy/relume-chaos disturbs a farm that it knows by its address alone, and leaves it well.

    chaos_tool_test.py BIN_DIR SOURCE_DIR
"""
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from processes import BIN, Farm, ROOM, SOURCE, environment, relume

TOOL = SOURCE / 'deploy' / 'relume-chaos'
JOB = (ROOM, '--size', '96x64', '--spp', '64', '--sampler', 'uniform', '--seed', '3', '--filter', 'none')


def tls(certs, role):
    return {f'RELUME_TLS_{k.upper()}': certs / role / f'{k}.pem' for k in ('ca', 'cert', 'key')}


def digest(farm, certs):
    name = relume('submit', *JOB, server=farm.address, env=tls(certs, 'client')).stdout.strip()
    out = relume('watch', name, '--json', '--quiet', server=farm.address, env=tls(certs, 'client')).stdout
    return json.loads(out)['image_sha256'], json.loads(out)['ledger']['clean']


class Tool:
    """relume-chaos as a process; `lines` grow as it says them."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen([sys.executable, TOOL, *map(str, arguments)], text=True,
                                        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.lines, self.grown = [], threading.Condition()
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for line in self.process.stdout:
            with self.grown:
                self.lines.append(line.strip())
                self.grown.notify_all()

    def end(self):
        """Its exit code after SIGTERM."""
        self.process.terminate()
        code = self.process.wait(timeout=60)
        self.reader.join(timeout=60)
        self.process.stdout.close()
        return code

    def wait_for(self, *words):
        """The first line with one of these."""
        def found():
            return next((line for line in self.lines if any(word in line for word in words)), None)
        with self.grown:
            if not self.grown.wait_for(found, timeout=120):
                raise AssertionError(f'it did not say {words}: {self.lines}')
            return found()


class ChaosToolTest(unittest.TestCase):
    def test_a_farm_behind_it_ends_jobs_with_the_same_bits(self):
        with tempfile.TemporaryDirectory() as folder:
            certs, trace = pathlib.Path(folder) / 'certs', pathlib.Path(folder) / 'ran'
            subprocess.run([SOURCE / 'deploy' / 'certs', certs], stdout=subprocess.DEVNULL, check=True, timeout=120)
            own = certs / 'server'
            with Farm('--tls-cert', own / 'cert.pem', '--tls-key', own / 'key.pem', '--tls-ca', own / 'ca.pem') as farm:
                def start_worker(address):
                    farm.workers.append(subprocess.Popen(
                        [BIN / 'relume-worker', '--server', address, '--threads', '1', '--log-level', 'error',
                         '--cache', farm.folder / 'cache', f'--with-parent={os.getpid()}'],
                        env=environment(None, tls(certs, 'worker'))))
                    return farm.workers[-1]

                often = ('--server', farm.address, '--seconds', 6, '--every', 0.1, '--longest', 0.3, '--seed', 5)
                worker = start_worker(farm.address)
                expected = digest(farm, certs)
                tools = [Tool(*often, '--run', f'echo >> {trace}'),
                         Tool(*often, '--stop', worker.pid, '--kill', worker.pid)]
                try:
                    tools[1].wait_for('SIGKILL to')
                    self.assertEqual(worker.wait(timeout=60), -signal.SIGKILL)
                    farm.workers.remove(worker)
                    start_worker(tools[0].wait_for('listening on').split()[-1])
                    self.assertEqual(digest(farm, certs), expected)
                    tools[0].wait_for('reset', 'partition', 'slow')
                    tools[0].wait_for('all is well')
                    self.assertTrue(trace.exists(), tools[0].lines)
                finally:
                    for tool in tools:
                        self.assertEqual(tool.end(), 0, tool.lines)

    def test_what_it_cant_do_it_says(self):
        for arguments, code, says in ((('--server', 'nowhere'), 2, 'is no HOST:PORT'),
                                      (('--server', 'a:1', '--kill', '1'), 2, 'above 1'),
                                      (('--server', 'a:1', '--seconds', '0'), 2, 'more than 0'),
                                      (('--server', 'a:1', '--listen', '192.0.2.1:9'), 1, 'choose another --listen')):
            run = subprocess.run([sys.executable, TOOL, *arguments], text=True, stdout=subprocess.PIPE,
                                 stderr=subprocess.PIPE, timeout=60)
            self.assertEqual((run.returncode, says in run.stderr), (code, True), run.stderr)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
