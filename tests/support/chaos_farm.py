"""A farm of processes on loopback that is disturbed on purpose, and looked after as a service manager would: what was
killed comes back. Whatever ends without having been killed is a finding."""
import json
import os
import pathlib
import signal
import socket
import subprocess
import threading

from chaos_links import Links

DISK_MEGABYTES = 64  # of a data folder that can be filled


def free_port():
    with socket.socket() as s:
        s.bind(('127.0.0.1', 0))
        return s.getsockname()[1]


class Farm:
    """`folder`: new, for data, caches and logs. `certs`: made by deploy/certs; None: all in the clear. `small_disk`: the
    data folder is a file system of its own, which a test can fill. A context manager."""

    def __init__(self, bin_folder, folder, workers, seed, certs=None, small_disk=False):
        self.bin, self.folder, self.certs = bin_folder, folder, certs
        self.findings = []
        self.disk_full = False
        self.data = folder / 'data'
        self.data.mkdir(parents=True)
        if small_disk:
            subprocess.run(['mount', '-t', 'tmpfs', '-o', f'size={DISK_MEGABYTES}m', 'none', self.data], check=True)
        self.mounted = small_disk
        self.port = free_port()
        self.links = Links(self.port, workers, seed)
        self.server = self._spawn_server()
        self.workers = [self._spawn_worker(i) for i in range(workers)]
        self.killed = set()  # processes that this test killed
        self.down = set()    # what is not to be started yet: 'server', or the number of a worker
        self.clients = []

    # --- processes ---

    def _environment(self, role):
        env = {k: v for k, v in os.environ.items() if not k.startswith('RELUME_')}
        if self.certs:
            env.update({f'RELUME_TLS_{k.upper()}': str(self.certs / role / f'{k}.pem') for k in ('ca', 'cert', 'key')})
        return env

    def _spawn(self, log, role, program, *arguments):
        with open(self.folder / f'{log}.log', 'a') as out:
            return subprocess.Popen([self.bin / program, f'--with-parent={os.getpid()}', '--log-level', 'debug',
                                     *map(str, arguments)], env=self._environment(role), stdin=subprocess.DEVNULL,
                                    stdout=out, stderr=out)

    def _spawn_server(self):
        own = self.certs and self.certs / 'server'
        tls = ('--tls-cert', own / 'cert.pem', '--tls-key', own / 'key.pem', '--tls-ca', own / 'ca.pem') if own else ()
        return self._spawn('server', 'server', 'relume-server', '--listen', f'127.0.0.1:{self.port}', '--data',
                           self.data, '--save-every', '0.1', *tls)

    def _spawn_worker(self, i):
        return self._spawn(f'worker{i}', 'worker', 'relume-worker', '--server', self.links[i].address, '--threads', 1,
                           '--name', f'worker{i}', '--cache', self.folder / f'cache{i}')

    def client(self, *arguments, **options):
        """Starts a command of `relume`."""
        env = {**self._environment('client'), 'RELUME_SERVER': f'127.0.0.1:{self.port}'}
        return subprocess.Popen([self.bin / 'relume', *map(str, arguments)], env=env, text=True,
                                stdin=subprocess.DEVNULL, **options)

    def ask(self, *arguments):
        """Exit code, stdout and stderr of a command of `relume`."""
        client = self.client(*arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.clients.append(client)
        out, err = client.communicate()
        self.clients.remove(client)
        return client.returncode, out, err

    def workers_there(self):
        code, out, _ = self.ask('workers', '--json')
        return len(json.loads(out)) if code == 0 else 0

    def tend(self):
        """To be called often: starts what has ended, and notes what had no reason to end."""
        if self.server.poll() is not None and 'server' not in self.down:
            if self.server not in self.killed and not self.disk_full:
                self.findings.append(f'the server ended by itself with {self.server.returncode}')
            self.server = self._spawn_server()
        for i, worker in enumerate(self.workers):
            if worker.poll() is not None and i not in self.down:
                if worker not in self.killed:
                    self.findings.append(f'worker {i} ended by itself with {worker.returncode}')
                self.workers[i] = self._spawn_worker(i)

    # --- disturbances ---

    def kill(self, who):
        process = self.server if who == 'server' else self.workers[who]
        if process.poll() is None:
            self.killed.add(process)
            self.down.add(who)
            process.kill()
            process.wait()

    def let_start(self, who):
        self.down.discard(who)

    def signal(self, who, number):
        process = self.server if who == 'server' else self.workers[who]
        if process.poll() is None:
            process.send_signal(number)

    def fill_disk(self):
        self.disk_full = True
        with open(self.data / 'balloon', 'wb', buffering=0) as balloon:
            for size in (1 << 20, 1 << 12):
                try:
                    while balloon.write(bytes(size)) == size:
                        pass
                except OSError:
                    pass

    def free_disk(self):
        (self.data / 'balloon').unlink(missing_ok=True)
        if self.server.poll() is not None:
            self.tend()
        self.disk_full = False

    def leave_alone(self):
        """All is well again, for good."""
        for who in ('server', *range(len(self.workers))):
            self.let_start(who)
            self.signal(who, signal.SIGCONT)
            if who != 'server':
                self.links[who].heal()
        if self.disk_full:
            self.free_disk()

    # --- the end ---

    def stop(self, patience):
        """SIGTERM to all; findings are those that don't follow it in `patience` seconds, or end with an error."""
        for name, process in (*((f'worker {i}', w) for i, w in enumerate(self.workers)), ('the server', self.server)):
            if process.poll() is None:
                process.terminate()
            try:
                if process.wait(timeout=patience) != 0 and process not in self.killed:
                    self.findings.append(f'{name} ended with {process.returncode} on SIGTERM')
            except subprocess.TimeoutExpired:
                self.findings.append(f'{name} did not end within {patience} s of SIGTERM')

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in (*self.workers, self.server, *list(self.clients)):
            if process.poll() is None:
                process.kill()
            process.wait()
        self.links.__exit__()
        if self.mounted:
            subprocess.run(['umount', self.data], check=True)
