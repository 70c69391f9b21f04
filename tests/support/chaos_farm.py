"""A farm of processes on loopback that is disturbed on purpose, and looked after as a service manager would: what was
killed comes back. Whatever ends without having been killed is a finding, and so is whatever hangs."""
import json
import mmap
import os
import pathlib
import random
import re
import shutil
import signal
import socket
import struct
import subprocess
import threading
import time

from chaos_links import Link

DISK_MEGABYTES = 64   # of a data folder that can be filled
ASK_PATIENCE = 60     # seconds, for a command that answers at once
KILL_PATIENCE = 30    # seconds, until a process that got SIGKILL is gone
RESTART_SECONDS = 0.2  # between a process's end and its next start, as of service managers


class Failure(Exception):
    """What does not hold."""


def free_port():
    """Outside of the range from which connections get theirs: it stays free while the server is down."""
    for port in random.SystemRandom().sample(range(20000, 32000), 100):
        with socket.socket() as s:
            try:
                s.bind(('127.0.0.1', port))
                return port
            except OSError:
                pass
    raise Failure('no port is free')


class Clock:
    """The wall clock of one process, which jumps (support/clock_jump.cpp)."""

    def __init__(self, library, path):
        path.write_bytes(bytes(8))
        self.environment = {'LD_PRELOAD': str(library), 'RELUME_CHAOS_CLOCK': str(path)}
        with open(path, 'r+b') as file:
            self.memory = mmap.mmap(file.fileno(), 8)

    def jump(self, seconds):
        then, = struct.unpack('q', self.memory)
        self.memory[:] = struct.pack('q', then + int(seconds * 1e9))

    @staticmethod
    def works(library, folder):
        """Whether programs that load it live at another time."""
        clock = Clock(library, folder / 'clock')
        clock.jump(-1e6)
        run = subprocess.run(['date', '+%s'], env={**os.environ, **clock.environment}, stdout=subprocess.PIPE,
                             timeout=60)
        return run.returncode == 0 and abs(float(run.stdout) + 1e6 - time.time()) < 1e5


class Process:
    """A program of the farm through all its lives: `who` is 'server' or the number of a worker."""

    def __init__(self, farm, who, role, clock, command):
        self.farm, self.who, self.role, self.clock, self.command = farm, who, role, clock, command
        self.name = 'server' if who == 'server' else f'worker{who}'
        self.log = farm.folder / f'{self.name}.log'
        self.killed = self.down = self.stopped = False  # down: not to be started yet
        self.restarts, self.kills = -1, 0
        self.ended_at = None
        self.start()

    def start(self):
        self.began_at = self.log.stat().st_size if self.log.exists() else 0  # this life's first byte of the log
        self.disk_was_full = self.farm.disk_full > 0
        self.mangled_before = self.farm.links[self.who].mangled if self.role == 'worker' else 0
        self.killed = self.stopped = False
        self.restarts += 1
        self.ended_at = None
        environment = {**self.farm.environment(self.role), **(self.clock.environment if self.clock else {})}
        with open(self.log, 'a') as out:
            self.process = subprocess.Popen(self.command, env=environment, stdin=subprocess.DEVNULL, stdout=out,
                                            stderr=out)

    def said(self):
        """The log of this life."""
        with open(self.log, errors='replace') as log:
            log.seek(self.began_at)
            return log.read()

    def kill(self):
        if self.process.poll() is None:
            self.killed = self.down = True
            self.kills += 1
            self.process.kill()
            self.process.wait(timeout=KILL_PATIENCE)

    def signal(self, number):
        if self.process.poll() is None:
            self.stopped = number == signal.SIGSTOP
            self.process.send_signal(number)

    def tend(self):
        code = self.process.poll()
        if code is None or self.down:
            return
        if self.ended_at is None:
            self.ended_at = time.monotonic()
            if not self.killed and not self._may_end(code):
                self.farm.findings.append(f'{self.name} ended by itself with {code}: {last_line(self.said())}')
        if time.monotonic() > self.ended_at + RESTART_SECONDS:
            self.start()

    def _may_end(self, code):
        said = self.said()
        if self.role == 'worker':
            # Its first words, or the answer to them, were mangled: it believes in the wrong server, or the server in
            # a wrong worker.
            mangled = self.farm.links[self.who].mangled > self.mangled_before
            return code == 1 and mangled and ('works for' not in said or 'refuses this worker' in said)
        # It can't begin without a disk, and says so.
        return code == 1 and self.disk_was_full and 'listening on' not in said and 'free some space' in said


def last_line(text):
    lines = text.strip().splitlines()
    return lines[-1][:300] if lines else '(it said nothing)'


class Farm:
    """`folder`: new, for data, caches and logs. `certs`: made by deploy/certs; None: all in the clear. `small_disk`:
    the data folder is a file system of its own, which can be filled. `clocks`: the library of clocks that jump, or None.
    A context manager."""

    def __init__(self, bin_folder, folder, workers, seed, certs=None, small_disk=False, clocks=None):
        self.bin, self.folder, self.certs = bin_folder, folder, certs
        self.findings = []
        self.job = None     # its name
        self.paused = 0     # times that the job said that it waits for room on the disk
        self.disk_full = 0  # of how many events
        self.mutex = threading.Lock()
        self.clients = set()  # guarded by mutex
        self.ended = False    # likewise
        self.data = folder / 'data'
        self.data.mkdir(parents=True)
        self.mounted = small_disk
        if small_disk:
            subprocess.run(['mount', '-t', 'tmpfs', '-o', f'size={DISK_MEGABYTES}m', 'none', self.data], check=True)
        self.port = free_port()
        # One for each worker, and one for who watches the job.
        self.links = [Link(('127.0.0.1', self.port), f'{seed}/{i}') for i in range(workers + 1)]
        self.server = Process(self, 'server', 'server', self._clock(clocks, 'server'), self._server_command())
        self.workers = [Process(self, i, 'worker', self._clock(clocks, f'worker{i}'), self._worker_command(i))
                        for i in range(workers)]
        self.processes = {'server': self.server, **dict(enumerate(self.workers))}

    # --- processes ---

    def _clock(self, library, name):
        return Clock(library, self.folder / f'{name}.clock') if library else None

    def environment(self, role):
        env = {k: v for k, v in os.environ.items() if not k.startswith('RELUME_')}
        if self.certs:
            env.update({f'RELUME_TLS_{k.upper()}': str(self.certs / role / f'{k}.pem') for k in ('ca', 'cert', 'key')})
        return env

    def _command(self, program, *arguments):
        own = (self.bin / program, f'--with-parent={os.getpid()}', '--log-level', 'debug')
        return [str(a) for a in (*own, *arguments)]

    def _server_command(self):
        own = self.certs and self.certs / 'server'
        tls = ('--tls-cert', own / 'cert.pem', '--tls-key', own / 'key.pem', '--tls-ca', own / 'ca.pem') if own else ()
        return self._command('relume-server', '--listen', f'127.0.0.1:{self.port}', '--data', self.data,
                             '--save-every', '0.1', *tls)

    def _worker_command(self, i):
        return self._command('relume-worker', '--server', self.links[i].address, '--threads', 1, '--name', f'worker{i}',
                             '--cache', self.folder / f'cache{i}')

    def start_client(self, *arguments, watches=False):
        """A command of `relume`; `watches`: through the link of those who watch."""
        server = self.links[-1].address if watches else f'127.0.0.1:{self.port}'
        with self.mutex:
            if self.ended:
                raise Failure('the round is over')
            client = subprocess.Popen([self.bin / 'relume', *map(str, arguments)], text=True,
                                      env={**self.environment('client'), 'RELUME_SERVER': server},
                                      stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            self.clients.add(client)
        return client

    def end_client(self, client):
        if client.poll() is None:
            client.kill()
        client.wait(timeout=KILL_PATIENCE)
        with self.mutex:
            self.clients.discard(client)

    def ask(self, *arguments, patience=ASK_PATIENCE, watches=False):
        """Exit code, stdout and stderr of a command of `relume`."""
        client = self.start_client(*arguments, watches=watches)
        try:
            out, err = client.communicate(timeout=patience)
        except subprocess.TimeoutExpired:
            raise Failure(f'`relume {" ".join(map(str, arguments))}` has no answer after {patience:.0f} s:\n'
                          f'{stacks_of(client.pid)}') from None
        finally:
            self.end_client(client)
        return client.returncode, out, err

    def workers_there(self):
        code, out, _ = self.ask('workers', '--json')
        return len(json.loads(out)) if code == 0 else 0

    def tend(self):
        """To be called often: starts what has ended, and notes what had no reason to end."""
        for process in self.processes.values():
            process.tend()

    # --- the disk ---

    def fill_disk(self):
        self.disk_full += 1
        with open(self.data / 'balloon', 'wb', buffering=0) as balloon:
            for size in (1 << 20, 1 << 12):
                try:
                    while balloon.write(bytes(size)) == size:
                        pass
                except OSError:
                    pass

    def free_disk(self):
        self.disk_full -= 1
        if self.disk_full == 0:
            (self.data / 'balloon').unlink(missing_ok=True)

    # --- the end ---

    def leave_alone(self):
        """All is well again, for good; but clocks stay as they are."""
        for process in self.processes.values():
            process.down = False
            if process.stopped:
                process.signal(signal.SIGCONT)
        for link in self.links:
            link.heal()
        while self.disk_full:
            self.free_disk()

    def stop(self, patience):
        """SIGTERM to all; findings are those that don't follow it in `patience` seconds, or end with an error."""
        for process in (*self.workers, self.server):
            if process.process.poll() is None:
                process.process.terminate()
            try:
                code = process.process.wait(timeout=patience)
                if code != 0 and not process.killed:
                    self.findings.append(f'{process.name} ended with {code} on SIGTERM: {last_line(process.said())}')
            except subprocess.TimeoutExpired:
                self.findings.append(f'{process.name} did not end within {patience} s of SIGTERM:\n'
                                     f'{stacks_of(process.process.pid)}')

    def diagnose(self):
        """What each process is at, and the last it said."""
        lines = []
        for process in self.processes.values():
            code = process.process.poll()
            state = state_of(process.process.pid) if code is None else f'ended with {code}'
            lines.append(f'    {process.name} ({state}, {process.restarts} restarts), at last:')
            lines += [f'        {line[:300]}' for line in process.said().strip().splitlines()[-3:]]
        with self.mutex:
            clients = list(self.clients)
        lines += [f'    {" ".join(map(str, c.args[:3]))} ({state_of(c.pid)}):\n{stacks_of(c.pid)}'
                  for c in clients if c.poll() is None]
        return '\n'.join(lines)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with self.mutex:
            self.ended = True
            clients = list(self.clients)
        for process in (*(p.process for p in self.processes.values()), *clients):
            if process.poll() is None:
                process.kill()
            process.wait(timeout=KILL_PATIENCE)
        for link in self.links:
            link.__exit__()
        if self.mounted:
            subprocess.run(['umount', self.data], check=True)


# --- of processes that hang ---

def state_of(pid):
    try:
        status = pathlib.Path(f'/proc/{pid}/status').read_text()
        return re.search(r'State:\s+(.*)', status)[1]
    except OSError:
        return 'gone'


def stacks_of(pid):
    """What its threads are at, where there is gdb."""
    if not shutil.which('gdb'):
        return '        (with gdb its stacks would be told)'
    try:
        run = subprocess.run(['gdb', '-p', str(pid), '-batch', '-ex', 'thread apply all bt 16'], text=True,
                             stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=60)
    except subprocess.TimeoutExpired:
        return '        (gdb has no answer)'
    lines = [f'        {line[:160]}' for line in run.stdout.splitlines() if line.startswith(('#', 'Thread'))]
    return '\n'.join(lines) or '        (gdb tells no stacks)'
