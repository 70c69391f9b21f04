"""What can be done to a farm, and schedules of it that a seed decides."""
import json
import re
import signal
import time

from chaos_links import DOWN, UP

HELD_PATIENCE = 20  # seconds, until a job that renders says that it is paused by a full disk
ASK_PATIENCE = 10   # seconds
TICK = 0.02         # seconds


class Event:
    """`run(farm)` is a generator that waits by yielding seconds; it begins `at` seconds after the job was handed in."""

    def __init__(self, at, word, run):
        self.at, self.word, self.run = at, word, run
        self.steps, self.wake = None, at

    def step(self, farm, now):
        """To be called often, with the seconds since the job was handed in."""
        if now >= self.wake:
            self.steps = self.steps or self.run(farm)
            pause = next(self.steps, None)
            self.wake = float('inf') if pause is None else now + pause

    def begun(self):
        return self.steps is not None


class Schedule:
    """Makes the events of a round. `seconds`: that an undisturbed job takes, its filter `filter_seconds` of them;
    `longest`: seconds of one disturbance; `can`: 'tls', 'small_disk', 'clocks', as far as the round has them."""

    def __init__(self, rng, number, seconds, filter_seconds, workers, longest, can):
        self.rng, self.number, self.seconds, self.filter_seconds = rng, number, seconds, filter_seconds
        self.workers, self.longest, self.can = workers, longest, can

    def events(self):
        kinds = [self.kill_worker] * 2 + [self.stop_worker] * 2 + [self.partition] * 2
        kinds += [self.stop_server, self.kill_server, self.kill_client, self.one_way, self.slow, self.reset]
        kinds += [self.mangle] * 4
        kinds += [self.disk_full] * 2 if 'small_disk' in self.can else []
        kinds += [self.clock_jump] * 2 if 'clocks' in self.can else []
        chosen = self.rng.choices(kinds, k=self.rng.randint(2, 4))
        sure = self.sure_of(self.number)
        if sure == 'kill-server':
            chosen[0] = self.kill_server
        elif sure == 'kill-filtering':
            chosen[0] = self.kill_filtering
        elif sure == 'disk-full' and 'small_disk' in self.can:
            # Alone with the job first, so that it must say what is wrong.
            chosen = [self.disk_full] + [k for k in chosen[1:] if k not in (self.kill_server, self.stop_server)]
        # The sure one is early: it must meet the job on a machine that has become faster since, too.
        return sorted((kind(self.rng.uniform(0.05, 0.4 if sure and k == 0 else 0.85) * self.seconds)
                       for k, kind in enumerate(chosen)), key=lambda e: e.at)

    @staticmethod
    def sure_of(number):
        """What a round must have, that others may have."""
        return {0: 'kill-server', 2: 'kill-filtering', 5: 'disk-full', 7: 'kill-server'}.get(number % 10)

    def _long(self):
        return min(self.rng.choice([0.3, 1, 1, 3, 12]) * self.rng.uniform(0.5, 1.5), self.longest)

    def _worker(self):
        return self.rng.randrange(self.workers)

    def _link(self):
        """A worker's, or that of who watches."""
        i = self.rng.randrange(self.workers + 1)
        return i, f'worker{i}' if i < self.workers else 'client'

    # --- processes ---

    def kill_worker(self, at):
        i, pause = self._worker(), self.rng.uniform(0, 1)
        return Event(at, f'kill worker{i}', lambda farm: killed(farm, i, pause))

    def kill_server(self, at):
        pause = self.rng.choice([0, 0.3, 2]) * self.rng.random()
        return Event(at, f'kill server, {pause:.1f} s', lambda farm: killed(farm, 'server', pause))

    def kill_filtering(self, at):
        del at
        pause = self.rng.uniform(0, 0.3)
        after = self.rng.uniform(0, 0.9) * self.filter_seconds

        def run(farm):
            # The server says so when all samples are in.
            while not (farm.job and re.search(rf'{farm.job}: \d+ samples in ', farm.server.said())):
                yield TICK
            yield after
            yield from killed(farm, 'server', pause)
        return Event(0, f'kill server {after:.2f} s into the filter', run)

    def kill_client(self, at):
        pause = self.rng.uniform(0, 0.5)

        def run(farm):
            client = farm.start_client('watch', farm.job, '--quiet', watches=True)
            yield pause
            farm.end_client(client)
        return Event(at, 'kill a client', run)

    def stop_worker(self, at):
        i, long = self._worker(), self._long()
        return Event(at, f'stop worker{i} {long:.1f} s', lambda farm: stopped(farm, i, long))

    def stop_server(self, at):
        long = self._long()
        return Event(at, f'stop server {long:.1f} s', lambda farm: stopped(farm, 'server', long))

    # --- links ---

    def _disturbance(self, at, what, begin, ends_with_cut=False):
        (i, name), long = self._link(), self._long()

        def run(farm):
            begin(farm.links[i])
            yield long
            farm.links[i].heal()
            if ends_with_cut:
                farm.links[i].cut()
        return Event(at, f'{what} {name} {long:.1f} s{" and cut" if ends_with_cut else ""}', run)

    def partition(self, at):
        def begin(link):
            link.stalled = frozenset((UP, DOWN))
        return self._disturbance(at, 'partition', begin, self.rng.random() < 0.5)

    def one_way(self, at):
        way = self.rng.choice((UP, DOWN))

        def begin(link):
            link.stalled = frozenset((way,))
        return self._disturbance(at, f'partition {way}', begin, self.rng.random() < 0.5)

    def slow(self, at):
        speed, delay = self.rng.choice((2e4, 1e5, 5e5)), self.rng.choice((0, 0.05, 0.3))

        def begin(link):
            link.bytes_per_second, link.delay = speed, delay
        return self._disturbance(at, f'slow {speed / 1000:.0f} kB/s+{1000 * delay:.0f} ms', begin)

    def reset(self, at):
        i, name = self._link()

        def run(farm):
            farm.links[i].cut()
            yield 0
        return Event(at, f'reset {name}', run)

    def mangle(self, at):
        (i, name), chunks = self._link(), self.rng.randint(1, 4)
        how = self.rng.choice(('corrupt', 'duplicate', 'reorder'))
        way = self.rng.choice((UP, DOWN))
        if 'tls' not in self.can:
            # Of samples alone the server knows by itself what is due.
            i, way = self._worker(), UP
            name = f'worker{i}'

        def run(farm):
            farm.links[i].mangle = [(how, way)] * chunks
            yield 0
        return Event(at, f'{how} {chunks} chunks {way} {name}', run)

    # --- the machine ---

    def clock_jump(self, at):
        who = self.rng.choice(['server', *range(self.workers)])
        # Certificates, made just now, are not valid before.
        seconds = self.rng.choice([60, 3600] if 'tls' in self.can else [-86400, -3600, -60, 60, 3600, 86400])
        name = who if who == 'server' else f'worker{who}'

        def run(farm):
            farm.processes[who].clock.jump(seconds)
            yield 0
        return Event(at, f'clock of {name} {seconds:+} s', run)

    def disk_full(self, at):
        long = self._long()
        return Event(at, f'disk full {long:.1f} s', lambda farm: disk_filled(farm, long))


def killed(farm, who, pause):
    farm.processes[who].kill()
    yield pause
    farm.processes[who].down = False


def stopped(farm, who, long):
    farm.processes[who].signal(signal.SIGSTOP)
    yield long
    farm.processes[who].signal(signal.SIGCONT)


def disk_filled(farm, long):
    """Until the job has said that it waits, and some time longer."""
    life = farm.server.restarts
    farm.fill_disk()
    end = time.monotonic() + HELD_PATIENCE
    while True:
        answer = yield from asked(farm, 'jobs', '--json')
        if farm.server.restarts != life or farm.server.process.poll() is not None or farm.server.stopped:
            break  # somebody else has disturbed it, too
        job = next((j for j in answer or () if j['job'] == farm.job), None)
        if job and job['state'] in ('succeeded', 'failed', 'cancelled'):
            break
        if job and job['held']:
            if 'free some space' not in job['held']:
                farm.findings.append(f"the job is paused and does not say what to do: {job['held']}")
            farm.paused += 1
            break
        if not job or job['state'] != 'rendering':
            end = time.monotonic() + HELD_PATIENCE  # a filter that runs needs no disk before it is done
        if time.monotonic() > end:
            farm.findings.append(f'the disk is full for {HELD_PATIENCE} s, and the job that renders does not say so')
            break
        yield TICK
    yield long
    farm.free_disk()


def asked(farm, *arguments):
    """The JSON that a command of `relume` prints; None, if it prints none in time."""
    client = farm.start_client(*arguments)
    end = time.monotonic() + ASK_PATIENCE
    while client.poll() is None and time.monotonic() < end:
        yield TICK
    out = client.stdout.read() if client.poll() == 0 else ''
    farm.end_client(client)
    return json.loads(out) if out else None
