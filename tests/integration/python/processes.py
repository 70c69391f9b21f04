"""Programs of Relume as processes on loopback, for tests. BIN and SOURCE come from the command line."""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

BIN, SOURCE = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
ROOM = SOURCE / 'scenes' / 'room' / 'room.gltf'


def environment(server=None, more=None):
    """This process's without what tells of servers; RELUME_SERVER is `server`, or unset."""
    env = {k: v for k, v in os.environ.items() if not k.startswith('RELUME_')}
    if server:
        env['RELUME_SERVER'] = server
    return {**env, **{k: str(v) for k, v in (more or {}).items()}}


def relume(*arguments, server=None, check=True, cwd=None, env=None):
    """Runs a command to its end; RELUME_SERVER is `server`, or unset; `env` adds to the environment."""
    env = environment(server, env)
    run = subprocess.run([BIN / 'relume', *map(str, arguments)], env=env, cwd=cwd, text=True,
                         stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=240)
    if check and run.returncode != 0:
        raise AssertionError(f'relume {arguments} ended with {run.returncode}: {run.stderr}')
    return run


class Farm:
    """A server and workers that this test can kill. A context manager: all are gone at its end."""

    def __init__(self, *server_options, log=None):
        """`log`: a file that gets what the server logs from level info on."""
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.options, self.log = server_options, log
        self.address = '127.0.0.1:0'
        self.workers = []
        self.start_server()

    def start_server(self):
        """The server, on the port and the folder that the one before had."""
        self.server = subprocess.Popen(
            [BIN / 'relume-server', '--listen', self.address, '--data', self.folder / 'data',
             f'--with-parent={os.getpid()}', '--log-level', 'info' if self.log else 'error', *map(str, self.options)],
            env=environment(), stdout=subprocess.PIPE, stderr=self.log, text=True)
        line = self.server.stdout.readline()
        if not line:
            raise AssertionError(f'the server ended with {self.server.wait()} before it listened')
        self.address = line.split()[-1]

    def kill_server(self):
        """SIGKILL."""
        self.server.kill()
        self.server.wait()
        self.server.stdout.close()

    def start_worker(self, *options):
        worker = subprocess.Popen(
            [BIN / 'relume-worker', '--server', self.address, '--threads', '1', '--log-level', 'error',
             '--cache', self.folder / f'cache{len(self.workers)}', f'--with-parent={os.getpid()}', *map(str, options)],
            env=environment())
        self.workers.append(worker)
        return worker

    def alive(self):
        return [p.poll() is None for p in (self.server, *self.workers)]

    def job(self, name):
        jobs = json.loads(relume('jobs', '--json', server=self.address).stdout)
        return next(job for job in jobs if job['job'] == name)

    def __enter__(self):
        return self

    def stop(self):
        """Ends all by SIGTERM; answers with the exit codes, the workers' first."""
        for process in (*self.workers, self.server):
            if process.poll() is None:
                process.terminate()
        codes = [process.wait(timeout=20) for process in (*self.workers, self.server)]
        self.server.stdout.close()
        shutil.rmtree(self.folder)
        return codes

    def __exit__(self, *_):
        self.stop()
