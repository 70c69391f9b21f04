"""A server and a worker on loopback that stay from run to run, and what each run costs them.

A scene stays loaded in the worker, so that runs after the first measure sampling, planning and filtering alone.
"""
import os
import select
import shutil
import subprocess
import tempfile
import time


def process_cpu(pid):
    """Processor seconds of all threads of a process so far (the clock of clock_getcpuclockid)."""
    return time.clock_gettime((~pid << 3) | 2)


def remove_orphans(folder):
    """Folders of farms whose program was killed."""
    for name in os.listdir(folder):
        parts = name.split("-")
        if parts[0] == "farm" and len(parts) == 3 and not os.path.exists(f"/proc/{parts[1]}"):
            shutil.rmtree(os.path.join(folder, name), ignore_errors=True)


class Farm:
    """A context manager; ends with the process that started it, however that ends."""

    def __init__(self, programs, folder, threads):
        remove_orphans(folder)
        self.folder = tempfile.mkdtemp(prefix=f"farm-{os.getpid()}-", dir=folder)
        parent = f"--with-parent={os.getpid()}"
        self.processes = [subprocess.Popen(
            [programs.path("relume-server"), "--listen", "127.0.0.1:0", "--data", os.path.join(self.folder, "data"),
             "--threads", str(threads), "--log-level", "error", parent], stdout=subprocess.PIPE, text=True)]
        if not select.select([self.server.stdout], [], [], 60)[0]:
            self.close()
            raise OSError("relume-server does not start")
        self.address = self.server.stdout.readline().split()[-1]
        self.processes.append(subprocess.Popen(
            [programs.path("relume-worker"), "--server", self.address, "--threads", str(threads), "--log-level", "error",
             "--cache", os.path.join(self.folder, "cache"), parent]))

    @property
    def server(self):
        return self.processes[0]

    def alive(self):
        return all(process.poll() is None for process in self.processes)

    def server_cpu(self):
        return process_cpu(self.server.pid) if self.server.poll() is None else float("nan")

    def close(self):
        for process in reversed(self.processes):
            if process.poll() is None:
                process.terminate()
        for process in reversed(self.processes):
            try:
                process.wait(timeout=20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self.server.stdout.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
