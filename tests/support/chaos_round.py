"""One farm, one job, and what must hold at its end."""
import faulthandler
import json
import re
import threading
import time

from chaos_events import TICK
from chaos_farm import Failure, Farm

# `extend`: the samples a pixel that the job is extended to when it is done.
KINDS = {
    'uniform': (('--spp', '192', '--sampler', 'uniform', '--filter', 'none'), None),
    'adaptive': (('--spp', '128', '--filter', 'bilateral'), None),
    'auto': (('--spp', '64'), None),
    'target': (('--target', '0.003', '--filter', 'none'), None),
    'samples': (('--spp', '8', '--sampler', 'uniform', '--filter', 'rpf', '--keep-samples'), None),
    'extended': (('--spp', '32', '--sampler', 'uniform', '--filter', 'none'), '128'),
}
SLOWLY_FILTERED = ('auto', 'samples')  # long enough that the server can be killed in it
OUT_OF_REACH = 4      # exit code of `relume`
STOP_PATIENCE = 30    # seconds, until one has followed SIGTERM
OUTAGE_PATIENCE = 60  # seconds that a client tries again


class Client(threading.Thread):
    """Hands in the job and waits for its end, as a patient user does."""

    def __init__(self, farm, arguments, extend, patience):
        super().__init__(daemon=True)
        self.farm, self.arguments, self.extend, self.patience = farm, arguments, extend, patience
        self.result, self.problem = None, None

    def submit(self):
        code, out, err = self.farm.ask('submit', *self.arguments, '--quiet')
        if code != 0:
            raise Failure(f'submit ended with {code}: {err.strip()}')
        self.farm.job = out.strip()
        self.start()

    def run(self):
        try:
            self.result = self._watch()
            if self.extend:
                self._extend()
                self.result = self._watch()
        except Failure as failure:
            self.problem = str(failure)

    def _watch(self):
        end = time.monotonic() + OUTAGE_PATIENCE
        while True:
            code, out, err = self.farm.ask('watch', self.farm.job, '--json', '--quiet', patience=self.patience,
                                           watches=True)
            if code == 0:
                return json.loads(out)
            # The server may be down when it begins.
            if code != OUT_OF_REACH or time.monotonic() > end:
                raise Failure(f'watch ended with {code}: {err.strip()}')
            time.sleep(0.2)

    def _extend(self):
        end = time.monotonic() + OUTAGE_PATIENCE
        while True:
            code, _, err = self.farm.ask('extend', self.farm.job, '--spp', self.extend)
            if code == 0:
                return
            answer, out, _ = self.farm.ask('jobs', '--json')
            job = next((j for j in json.loads(out) if j['job'] == self.farm.job), None) if answer == 0 else None
            if job and job['budget'] > self.result['budget']:
                return  # it was, and the answer was lost
            if time.monotonic() > end:
                raise Failure(f'extend ended with {code}: {err.strip()}')
            time.sleep(0.2)


def check(farm, job):
    """Of the job's end; the digest is told."""
    ledger = job['ledger'] or {}
    if job['state'] != 'succeeded':
        raise Failure(f"the job is {job['state']}: {job['message']}")
    if not (ledger.get('clean') and ledger['samples'] == ledger['film_samples'] == job['samples']):
        raise Failure(f"ledger of {job['samples']} samples: {ledger}")
    image = farm.folder / 'image.exr'
    code, _, err = farm.ask('fetch', farm.job, '-o', image)
    if code != 0:
        raise Failure(f'fetch ended with {code}: {err.strip()}')
    _, out, err = farm.ask('info', image, '--json')
    if not out or json.loads(out)['digest'] != job['image_sha256']:
        raise Failure(f'the fetched image is not the one of the job: {err.strip()}')
    return job['image_sha256']


class Round:
    """One farm and one job. `run` is done once; the other members tell of it."""

    def __init__(self, options, kind, events, seed, can, folder):
        self.options, self.kind, self.events, self.seed, self.can = options, kind, events, seed, can
        self.folder = folder
        self.seconds, self.filter_seconds = 0, 0
        self.job, self.paused, self.mangled, self.kills, self.restarts = None, 0, 0, 0, 0
        self.diagnosis = ''

    def run(self):
        """The digest. Failure: with what does not hold."""
        # Whatever happens, this program does not hang: it tells where it is, and all others go with it.
        faulthandler.dump_traceback_later(2 * self.options.patience + 8 * STOP_PATIENCE, exit=True)
        try:
            with Farm(self.options.bin, self.folder, self.options.workers, self.seed,
                      self.options.certs if 'tls' in self.can else None, 'small_disk' in self.can,
                      self.options.clocks if 'clocks' in self.can else None) as farm:
                try:
                    return self._run(farm)
                except Failure as failure:
                    self.diagnosis = farm.diagnose()
                    raise Failure('; '.join(dict.fromkeys((str(failure), *farm.findings)))) from None
        finally:
            faulthandler.cancel_dump_traceback_later()

    def _run(self, farm):
        deadline = time.monotonic() + self.options.patience
        while farm.workers_there() < self.options.workers:
            farm.tend()
            if farm.findings or time.monotonic() > deadline:
                raise Failure('the farm does not start')
            time.sleep(TICK)
        start = time.monotonic()
        arguments, extend = KINDS[self.kind]
        client = Client(farm, (self.options.scene, '--size', '96x96', '--seed', '5', *arguments), extend,
                        self.options.patience + OUTAGE_PATIENCE)  # this thread is the first to lose it
        client.submit()
        deadline = time.monotonic() + self.options.patience
        while client.is_alive():
            now = time.monotonic()
            for event in self.events:
                event.step(farm, now - start)
            farm.tend()
            if now > deadline:
                raise Failure(f'the job is not over after {self.options.patience:.0f} s')
            time.sleep(TICK)
        self.seconds = time.monotonic() - start
        self.kills, self.restarts = farm.server.kills, farm.server.restarts
        farm.leave_alone()
        farm.tend()
        if client.problem:
            raise Failure(client.problem)
        deadline = time.monotonic() + self.options.patience
        self.job, self.paused = client.result, farm.paused
        self.mangled = sum(link.mangled for link in farm.links)
        self.filter_seconds = sum(float(s) for s in re.findall(r': filtered in ([0-9.]+) s', farm.server.said()))
        while farm.server.process.poll() is not None:  # killed just now
            farm.tend()
            if time.monotonic() > deadline:
                raise Failure('the server does not start')
            time.sleep(TICK)
        digest = check(farm, self.job)
        farm.stop(STOP_PATIENCE)
        if farm.findings:
            raise Failure(farm.findings[0])
        return digest
