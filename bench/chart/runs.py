"""Renders, filters and compares by relume's commands: what is in the store is not run again.

    with Runs("build/bench", Programs("build/ci/bin")) as runs:
        truth = runs.reference(view, spp=1024)
        film = runs.render(view, sampler="uniform", spp=8, seed=1)
        image = runs.denoise(film, "bilateral")
        errors = runs.compare(truth, image)

All records are dictionaries of plain values, with

    key       digest of programs, scene files, command and seed: the name in the store
    image     path of an EXR; None after a failure
    failed    None, or one line: what the program said, or the signal that ended it
    seconds   cpu: of all threads, wall; see each method for what is counted

Failures that the product answers for (it said so, or crashed, or took longer than `timeout`) are kept in the store as
results are. What others did (no server, full disk, Ctrl-C) raises BenchError.
"""
import contextlib
import json
import os
import resource
import signal
import subprocess
import time

from . import exr
from .farm import Farm
from .programs import FILTERS, RENDERS, BenchError, digest
from .store import Store

REFERENCE_SEED = 1_000_003  # no study's own
OTHERS_FAULT = {4, 6, 130, 143}  # exit codes of relume
FORMAT = 4  # of records; another number, other keys
QUICK, REPEATS = 1.0, 3  # until so much processor time is spent, or so often, a thing is run; the least counts


def _children_cpu():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


class Runs:
    """A context manager: it holds a warm farm. `threads` of worker, server and filter; `timeout` of a run in seconds."""

    def __init__(self, store, programs, threads=2, timeout=1800):
        self.store, self.programs, self.threads, self.timeout = Store(store), programs, threads, timeout
        self.renders, self.filters = programs.digest(RENDERS), programs.digest(FILTERS)
        self.worker = programs.digest(("relume-worker",))
        self.scenes, self.done = {}, 0  # digests by view; runs that were not in the store
        self.farm, self.farm_of, self.storing = None, None, {}
        self.again = None  # keys of what was measured again in this round; None: outside of one

    # ---- what is run

    def render(self, view, sampler="adaptive", spp=None, seed=0, filter_="none", extra=()):
        """One `relume render` with all layers. `extra`: further options, e.g. ["--target", "0.01"].

        seconds.cpu: the worker's in leases and the server's (plans, merging, filter), without what loading the scene and
        writing the file take. seconds.wall: the report's render and filter. seconds.samples_cpu: the leases alone.
        report: that of --report, see docs/report.md.
        """
        arguments = self._arguments(view, sampler, spp, seed, filter_, extra)
        key = self._render_key(view, arguments, self.renders, self.threads)
        record = self.store.get(key)
        if record and not self._is_due(key, record):
            return record
        return self._render(key, view, arguments, record, spp=spp, sampler=sampler, filter=filter_, seed=seed)

    def reference(self, view, spp=1024, seed=REFERENCE_SEED):
        """An unfiltered uniform render, or the view's own file. Kept by the digest of relume-worker alone: other programs
        have no say in it. floor: its own error, {"mrse", "relmse"}, from its two halves; None of a file."""
        if view.reference:
            return {"key": digest(view.reference), "image": view.reference, "failed": None, "floor": None, "spp": None}
        arguments = self._arguments(view, "uniform", spp, seed, "none", ())
        key = self._render_key(view, arguments, "reference " + self.worker)
        record = self.store.get(key)
        if record is None:
            record = self._render(key, view, arguments, None, spp=spp, sampler="uniform", filter="none", seed=seed,
                                  floor_of_halves=True)
        if record["failed"]:
            raise BenchError(f"{view.name}: no reference: {record['failed']}")
        return record

    def denoise(self, film, filter_):
        """`relume denoise` on the image of a render with filter none. seconds: of the process, less what it takes with
        filter `none`. The image kept has RGB alone. Of nfor, rd and auto it is not quite what a render with them gives: see
        chart.methods.IN_RENDER."""
        key = digest(FORMAT, "denoise", self.filters, film["key"], filter_, self.threads)
        record = self.store.get(key)
        if record and not self._is_due(key, record):
            return record
        if film["failed"]:
            raise BenchError(f"no film to filter: {film['failed']}")
        idle = self.denoise(film, "none")["process"] if filter_ != "none" else None
        out = self.store.path(key, f".{os.getpid()}.new.exr")
        process, spent = record["process"] if record else None, 0.0
        for _ in range(REPEATS):
            code, said, taken = self._timed(["denoise", film["image"], "-o", out, "--filter", filter_, "--threads",
                                             str(self.threads)])
            if process is None or taken["cpu"] < process["cpu"]:
                process = taken
            spent += taken["cpu"]
            if code != 0 or spent >= QUICK:
                break
        failed = self._failure(code, said)
        record = {"kind": "denoise", "filter": filter_, "film": film["key"], "failed": failed, "image": None,
                  "process": process, "said": said, "threads": self.threads,
                  "seconds": {k: max(0.0, process[k] - idle[k]) if idle else 0.0 for k in process}}
        if not failed:
            _, texts = exr.read(out)
            record["told"] = {k: v for k, v in texts.items() if k.startswith("relume.filter")}
            exr.write_rgb(self.store.path(key, ".exr"), exr.read_rgb(out), texts)
            record["image"] = ".exr"
            os.remove(out)
        return self._put(key, record)

    def compare(self, reference, image):
        """Errors by `relume compare`: mrse, mrse_trimmed, relmse, ssim, psnr, flip, energy (ratio), bad (pixels that are
        not finite); see docs/commands.md. With a floor also mrse_above and relmse_above: less the reference's own."""
        key = digest(FORMAT, "compare", self.programs.digest(("relume",)), reference["key"], image["key"])
        record = self.store.get(key)
        if record is None:
            if image["failed"]:
                raise BenchError(f"no image to compare: {image['failed']}")
            errors = json.loads(self.programs.run("compare", "--json", reference["image"], image["image"]).stdout)[0]
            record = self._put(key, {"kind": "compare", "errors": errors})
        errors = {k: v for k, v in record["errors"].items() if k not in ("test", "reference")}
        if reference["floor"]:
            errors.update({f"{k}_above": errors[k] - reference["floor"][k] for k in reference["floor"]})
        return errors

    @contextlib.contextmanager
    def another_round(self):
        """Within it whatever is asked for is measured once more; the least time of all its runs counts."""
        self.again = set()
        try:
            yield
        finally:
            self.again = None

    def is_done(self, view, **what):
        """Whether render(view, **what) is in the store."""
        what = {"sampler": "adaptive", "spp": None, "seed": 0, "filter_": "none", "extra": (), **what}
        return self.store.get(self._render_key(view, self._arguments(view, **what), self.renders,
                                               self.threads)) is not None

    # ---- how

    @staticmethod
    def _arguments(view, sampler, spp, seed, filter_, extra):
        budget = ["--spp", str(spp)] if spp is not None else []
        return [*view.arguments(), "--sampler", sampler, "--filter", filter_, "--seed", str(seed), *budget,
                *map(str, extra)]

    def _render_key(self, view, arguments, *programs):
        # Paths of scene and map don't matter, their bytes do.
        plain = [os.path.basename(a) if os.path.sep in a else a for a in arguments]
        return digest(FORMAT, "render", programs, self._scene_digest(view), plain)

    def _scene_digest(self, view):
        at = (view.scene, *view.environment())
        if at not in self.scenes:
            told = self.programs.run("info", "--json", view.scene, *view.environment(), check=False)
            if told.returncode == 0:
                self.scenes[at] = json.loads(told.stdout)["sha256"]
            else:  # a scene that is wrong on purpose
                with open(view.scene, "rb") as file:
                    self.scenes[at] = digest(file.read().hex())
        return self.scenes[at]

    def _is_due(self, key, record):
        """Whether what is in the store is to be measured again: once a round. Failures are not."""
        if self.again is None or key in self.again or record["failed"]:
            return False
        self.again.add(key)
        return True

    def _render(self, key, view, arguments, stored, floor_of_halves=False, **record):
        """Quick ones run several times, for the least time: the image is the same. `stored`: what the store has of it."""
        best, spent = {**stored, "image": ".exr"} if stored else None, 0.0
        for _ in range(REPEATS):
            made = self._render_once(key, view, arguments, floor_of_halves, **record)
            if made["failed"]:
                best = best or made
                break
            spent += made["seconds"]["cpu"]
            if best is None or made["seconds"]["cpu"] < best["seconds"]["cpu"]:
                best = made
            if spent >= QUICK:
                break
        return self._put(key, best)

    def _render_once(self, key, view, arguments, floor_of_halves, **record):
        out, report = self.store.path(key, f".{os.getpid()}.new.exr"), self.store.path(key, f".{os.getpid()}.report")
        farm = self._warm(view)
        storing, before = self.storing.get(view, 0.0), farm.server_cpu()
        try:
            code, said, process = self._timed(["render", *arguments, "--layers", "all", "--server", farm.address, "-o", out,
                                               "--report", report, "--quiet"])
            server = farm.server_cpu() - before
            if not farm.alive():
                self._close_farm()
                code = -signal.SIGSEGV
                said = said or "server or worker ended"
            failed = self._failure(code, said)
            record.update(kind="render", view=view.name, failed=failed, image=None, threads=self.threads, process=process,
                          seconds=None, report=None)
            if not failed:
                with open(report, encoding="utf-8") as file:
                    told = json.load(file)
                samples = sum(worker["busy_seconds"] for worker in told["workers"])
                record.update(report=told, image=".exr", mean_spp=told["spp"], seconds={
                    "cpu": samples + max(0.0, server - storing), "samples_cpu": samples, "server_cpu": server,
                    "storing_cpu": storing, "wall": told["seconds"]["render"] + told["seconds"]["filter"]})
                if floor_of_halves:
                    record["floor"] = self._floor(out)
                os.replace(out, self.store.path(key, ".exr"))
        finally:
            for path in (out, report):
                if os.path.exists(path):
                    os.remove(path)
        return record

    def _floor(self, image):
        """(A - B)^2 / 4 = (A - mean)^2 is the error of the mean of two halves that are independent."""
        half = json.loads(self.programs.run("compare", "--json", "--layer", "buffer_a", image, image).stdout)[0]
        return {k: half[k] for k in ("mrse", "relmse")}

    def _warm(self, view):
        """A farm that has the view's scene loaded. One scene a farm: results of old jobs go with it."""
        if self.farm is None or not self.farm.alive() or self.farm_of != view.scene:
            self._close_farm()
            self.farm, self.farm_of = Farm(self.programs, self.store.folder, self.threads), view.scene
            self.storing = {}
        if view not in self.storing:
            self.storing[view] = self._find_storing(view)
        return self.farm

    def _find_storing(self, view):
        """What a job costs the server beside plans and filter, mostly writing its file: that of two samples a pixel, once
        scene, networks and programs are warm."""
        cost = 0.0
        for spp, filter_ in (8, "auto"), (2, "none"):
            before = self.farm.server_cpu()
            out = os.path.join(self.farm.folder, "warm.exr")
            code, _, _ = self._timed(["render", *self._arguments(view, "uniform", spp, 0, filter_, ()), "--layers", "all",
                                      "--server", self.farm.address, "-o", out, "--quiet"])
            if code != 0:
                return 0.0
            cost = self.farm.server_cpu() - before
        return cost

    def _close_farm(self):
        if self.farm is not None:
            self.farm.close()
            self.farm = None

    def _timed(self, arguments):
        """Exit code (negative: signal; None: timeout), last line of stderr, and seconds of process and its children."""
        environment = {k: v for k, v in os.environ.items() if k != "RELUME_SERVER"}
        start, before = time.monotonic(), _children_cpu()
        with subprocess.Popen([self.programs.path(), *arguments], env=environment, stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, text=True) as process:
            try:
                said, code = process.communicate(timeout=self.timeout)[1], process.returncode
            except subprocess.TimeoutExpired:
                process.terminate()  # relume cancels its job
                said, code = process.communicate()[1], None
            except BaseException:
                process.terminate()
                raise
        cpu = _children_cpu() - before
        lines = said.strip().splitlines()
        return code, lines[-1] if lines else "", {"cpu": cpu, "wall": time.monotonic() - start}

    def _failure(self, code, said):
        if code == 0:
            return None
        if code is None:
            return f"took longer than {self.timeout:g} s"
        if code in OTHERS_FAULT or code in (-signal.SIGTERM, -signal.SIGINT, -signal.SIGKILL):
            raise BenchError(f"interrupted, or no fault of the run: {said or f'signal {-code}'}")
        return said if code > 0 else f"ended by {signal.Signals(-code).name}"

    def _put(self, key, record):
        self.done += 1
        return self.store.put(key, record)

    def close(self):
        self._close_farm()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
