"""Runs what a suite asks for, with progress, and gathers the lines of its results."""
import csv
import datetime
import io
import json
import os
import platform
import sys
import time

from .methods import DEFAULT, row

COLUMNS = ["scene", "width", "height", "sampler", "filter", "stop", "spp", "mean_spp", "seed", "cpu_seconds",
           "sampling_seconds", "wall_seconds", "mrse", "mrse_above", "mrse_trimmed", "relmse", "relmse_above", "ssim", "psnr",
           "flip", "energy", "bad", "chosen", "stopped_by", "failed"]


class Progress:
    """Lines on stderr: what is done, what is being run, and when it will be over. Weights are samples to be traced."""

    def __init__(self, weights, out=sys.stderr):
        self.total, self.passed, self.count, self.of = sum(weights), 0.0, 0, len(weights)
        self.run, self.run_seconds, self.out, self.last = 0.0, 0.0, out, 0.0

    def step(self, weight, what, seconds, was_run):
        self.count, self.passed = self.count + 1, self.passed + weight
        if was_run:
            self.run, self.run_seconds = self.run + weight, self.run_seconds + seconds
        now = time.monotonic()
        if now - self.last < (0.2 if self.out.isatty() else 5) and self.count < self.of:
            return
        self.last = now
        left = (self.total - self.passed) * self.run_seconds / self.run if self.run else 0
        text = f"{self.count}/{self.of} {what}" + (f", {duration(left)} left" if self.run and self.count < self.of else "")
        live = self.out.isatty()
        print(f"\r{text:<100}" if live else text, end="" if live and self.count < self.of else "\n", file=self.out, flush=True)


def duration(seconds):
    seconds = int(round(seconds))
    return f"{seconds} s" if seconds < 90 else f"{seconds // 60} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def tasks(suite):
    """(view, method, spp, seed, extra, stop) in the order in which they are run: scene by scene."""
    for view in suite.views:
        methods = {DEFAULT: suite.default_spp, **suite.methods} if suite.default else suite.methods
        for method, counts in methods.items():
            for spp in counts:
                for seed in suite.seeds:
                    yield view, method, spp, seed, (), "spp"
        for seed in suite.seeds:
            for method in suite.stops:
                for target in suite.targets:
                    if target == "own":
                        if method == DEFAULT:  # others would take a fixed number of samples
                            yield view, method, None, seed, ("--max-spp", suite.max_spp), "own rule"
                    else:
                        budget = ("--target", target, "--max-spp", suite.max_spp)
                        yield view, method, None, seed, budget, f"target {target:g}"
            for seconds in suite.seconds if suite.default else []:
                yield view, DEFAULT, None, seed, ("--time-limit", seconds), f"{seconds:g} s"


def weight(task):
    """A guess of its cost in samples: the filter is as dear as ten samples a pixel, auto as fifty."""
    view, method, spp, _, _, _ = task
    samples = spp if spp is not None else 64
    return view.pixels() * (samples + {"none": 0, "auto": 50, "rpf": 500}.get(method.filter.split(":")[0], 10))


def run(suite, runs, out=sys.stderr):
    """(lines, references by scene). Killed and started again, it runs what is missing."""
    every = list(dict.fromkeys(tasks(suite)))
    weights = {t: weight(t) for t in every}
    truths, lines = {}, []
    progress = Progress([*weights.values(), *(v.pixels() * suite.reference_spp for v in suite.views)], out)
    for task in every:
        view, method, spp, seed, extra, stop = task
        if view.name not in truths:
            _timed(progress, runs, view.pixels() * suite.reference_spp, f"{view.name}: reference",
                   lambda v=view: truths.__setitem__(v.name, runs.reference(v, suite.reference_spp)))
        what = f"{view.name}: {method}, {f'{spp:g} spp' if spp is not None else stop}, seed {seed}"
        _timed(progress, runs, weights[task], what, lambda: lines.append(
            row(runs, view, truths[view.name], method, spp, seed, extra, stop)))
        if lines[-1]["failed"]:
            print(f"\n{what}: failed: {lines[-1]['failed']}", file=out)
    return lines, truths


def measure_again(suite, runs, truths, pairs, out=sys.stderr):
    """Once more, in turns, what methods of a scene took: pairs of (scene, methods)."""
    with runs.another_round():
        for task in tasks(suite):
            view, method, spp, seed, extra, stop = task
            if stop == "spp" and any(view.name == scene and method in methods for scene, methods in pairs):
                print(f"{view.name}: {method}, {spp:g} spp, seed {seed}, once more", file=out)
                row(runs, view, truths[view.name], method, spp, seed, extra, stop)


def _timed(progress, runs, amount, what, act):
    start, before = time.monotonic(), runs.done
    act()
    progress.step(amount, what, time.monotonic() - start, runs.done > before)


def machine():
    model = platform.processor()
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            model = next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        pass
    return {"processor": model, "cores": os.cpu_count(), "system": platform.platform(terse=True)}


def heading(suite, runs):
    """Machine, build and date, for every output."""
    now = datetime.datetime.now().astimezone()
    return {"suite": suite.name, "title": suite.title, "version": runs.programs.version(), "build": runs.renders[:12],
            "machine": machine(), "threads": runs.threads, "date": now.strftime("%Y-%m-%d %H:%M"),
            "seeds": suite.seeds, "reference_spp": suite.reference_spp, "missing": suite.missing}


def write(folder, about, lines, put):
    """results.csv and results.json."""
    text = io.StringIO()
    comment = ", ".join(f"{k}: {v}" for k, v in about.items() if isinstance(v, (str, int)))
    text.write(f"# {comment}, {about['machine']['processor']}\n")
    table = csv.DictWriter(text, COLUMNS, extrasaction="ignore", lineterminator="\n")
    table.writeheader()
    table.writerows(lines)
    put(os.path.join(folder, "results.csv"), text.getvalue())
    kept = [{k: line.get(k) for k in COLUMNS} for line in lines]
    put(os.path.join(folder, "results.json"), json.dumps({"about": about, "results": kept}, indent=1))
