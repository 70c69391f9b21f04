"""The programs of a build, and digests by which results are known again."""
import functools
import hashlib
import json
import os
import subprocess
import sys

RENDERS = ("relume", "relume-server", "relume-worker")
FILTERS = ("relume", "relume-denoise")


def can_be_made(denoise, filter_):
    """Whether relume-denoise has what the filter needs, such as weights; said on stderr if not."""
    run = subprocess.run([denoise, "-", "-o", "-", "--filter", filter_], stderr=subprocess.PIPE, text=True, check=False)
    if run.returncode == 2:  # the filter's own fault; that of the input, which does not exist, would be 3
        print(f"{filter_}: left out: {run.stderr.strip()}", file=sys.stderr)
    return run.returncode != 2


class BenchError(Exception):
    """One line for whoever runs the bench: what is wrong, and what to do."""


def digest(*parts):
    """Short digest of strings, numbers, lists and dictionaries."""
    text = json.dumps(parts, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:24]


@functools.lru_cache(maxsize=None)
def file_digest(path):
    with open(path, "rb") as file:
        return hashlib.sha256(file.read()).hexdigest()


class Programs:
    """Those in `folder`, e.g. build/ci/bin."""

    def __init__(self, folder):
        self.folder = os.path.abspath(folder)
        for name in {*RENDERS, *FILTERS}:
            if not os.access(self.path(name), os.X_OK):
                raise BenchError(f"{self.path(name)} is absent: build it (deploy/build release), or name the folder of the "
                                 "programs with --programs")

    def path(self, name="relume"):
        return os.path.join(self.folder, name)

    def digest(self, names):
        return digest(*(file_digest(self.path(name)) for name in names))

    def version(self):
        return self.run("--version").stdout.strip()

    def run(self, *arguments, check=True):
        """`relume ARGUMENTS` to its end; no server of the caller's takes part."""
        environment = {k: v for k, v in os.environ.items() if k != "RELUME_SERVER"}
        done = subprocess.run([self.path(), *map(str, arguments)], env=environment, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True, check=False)
        if check and done.returncode != 0:
            raise BenchError(f"relume {arguments[0]} failed: {done.stderr.strip()}")
        return done
