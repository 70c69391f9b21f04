"""The sections of a page that every suite may have: charts, speed-ups, errors, pictures, parsimony."""
import statistics

from . import front, page, parsimony, pictures, plots, words
from .methods import BASE, DEFAULT
from .summary import MEASURES, curves, find, over_all

TIME = "CPU seconds / threads"
RELATIVE = "time over the base's"


class Results:
    """What sections are made of."""

    def __init__(self, suite, runs, points, truths):
        self.suite, self.runs, self.points, self.truths = suite, runs, points, truths
        self.scenes = list(dict.fromkeys(p.scene for p in points))
        self.methods = list(dict.fromkeys(p.method for p in points))
        self.looks = plots.Looks(self.methods)

    def of(self, scene):
        return [p for p in self.points if p.scene == scene]

    def report(self, key):
        return self.runs.store.get(key)["report"]


def number(value, digits=3):
    return "-" if value is None or value != value else f"{value:.{digits}g}"


def pareto(results):
    anchor = results.suite.anchor
    parts = [page.text(words.PARETO)]
    every = over_all(results.points, anchor)
    if every and len(results.scenes) > 1:
        parts += [page.chart(
            plots.svg(plots.pareto(every, results.looks, "All scenes", RELATIVE)),
            page.text(words.OVER_ALL, front=front_text(every), anchor=anchor)["text"])]
    for scene in results.scenes:
        figure = plots.pareto(results.of(scene), results.looks, scene, TIME)
        parts.append(page.chart(plots.svg(figure), front_text(results.of(scene))))
    return page.section("Time against error", parts)


def front_text(points):
    """The front by MrSE, in words."""
    of = [p for p in points if p.stop == "spp"]
    best = [of[i] for i in front.front([(p.time, p.errors["mrse"]) for p in of])]
    return "Front by MrSE: " + "; ".join(f"{p.method}, {p.spp:g} spp" for p in best)


def speedup(results):
    """Time that each method needs for the error of the default."""
    spp = results.suite.anchor
    anchors = {s: find(results.points, s, DEFAULT, spp) for s in results.scenes}
    scenes = [s for s in results.scenes if anchors[s]]
    parts = [page.text(words.SPEEDUP, spp=spp)]
    if not scenes:
        return page.section("Speed-up", [page.text("The default was not run.")])
    for measure, title in MEASURES.items():
        by_scene = {s: curves(results.points, measure, s) for s in scenes}
        rows = []
        for method in [m for m in results.methods if m != DEFAULT]:
            cells, known = [], []
            for scene in scenes:
                time, how = front.time_for(by_scene[scene].get(method, []), anchors[scene].errors[measure])
                ratio = time / anchors[scene].time if time else None
                known += [ratio] if ratio else []
                cell = f"{how}{number(ratio, 2)}" if ratio else ">"
                cells.append(page.marked(cell, "bad") if ratio and ratio < 1 else cell)
            mean = number(front.geomean(known), 2) if known else ">"
            mean += f" ({len(known)})" if 0 < len(known) < len(scenes) else ""
            rows.append([str(method), *cells, mean])
        parts.append(page.table(["method", *scenes, "mean"], rows, title))
    return page.section("Speed-up", parts)


def equal_time(results):
    """The default's MrSE over a rival's after the same time."""
    rival, times = results.suite.rival, results.suite.times
    ratios = {}
    for scene in results.scenes:
        lines = curves(results.points, "mrse", scene)
        for time in times:
            ours, theirs = (front.error_at(lines.get(m, []), time) for m in (DEFAULT, rival))
            ratios[scene, time] = ours / theirs if ours and theirs else None
    rows = [[scene, *(_ratio_cell(ratios[scene, t]) for t in times)] for scene in results.scenes]
    for name, mean in ("mean", statistics.fmean), ("geometric mean", front.geomean):
        known = [[ratios[s, t] for s in results.scenes if ratios[s, t]] for t in times]
        rows.append([name, *(_ratio_cell(mean(values) if values else None) for values in known)])
    head = ["scene", *(f"{t:g} s" for t in times)]
    return page.section("Equal time", [page.text(words.EQUAL_TIME, rival=rival), page.table(head, rows)])


def _ratio_cell(ratio):
    return page.marked(number(ratio), "bad") if ratio and ratio > 1 else number(ratio)


def errors(results, spps=None):
    """A table a scene and number of samples."""
    parts = [page.text(words.ERRORS)]
    for scene in results.scenes:
        floor = results.truths[scene]["floor"]
        for spp in spps or results.suite.spp:
            of = [p for p in results.of(scene) if p.spp == spp and p.stop == "spp"]
            own = f"; error of the reference {floor['mrse']:.1g}" if floor else ""
            parts.append(errors_table(of, f"{scene}, {spp:g} spp{own}"))
        of = [p for p in results.of(scene) if p.stop != "spp"]
        if of:
            parts.append(errors_table(of, f"{scene}, other budgets", stop=True))
    return page.section("Errors", parts)


def errors_table(points, caption, stop=False):
    best = {m: min((p.errors[m] for p in points), default=0) for m in ("mrse", "relmse", "ssim", "flip")}
    rows = []
    for p in points:
        def cell(measure, value, p=p):
            return page.marked(value, "best") if p.errors[measure] <= best[measure] else value
        energy = f"{p.energy:.3f}"
        rows.append([str(p.method) + (f", {p.stop}" if stop else ""), f"{p.mean_spp:.1f}",
                     cell("mrse", ("~" if p.tie else "") + f"{p.errors['mrse']:.5f}"),
                     cell("relmse", f"{p.errors['relmse']:.5f}"),
                     cell("ssim", f"{1 - p.errors['ssim']:.4f}"), cell("flip", f"{p.errors['flip']:.4f}"),
                     page.marked(energy, "bad") if abs(p.energy - 1) > 0.01 else energy,
                     f"{p.time:.3f}", f"{p.sampling:.3f}", f"{p.wall:.3f}"])
    heads = ["method", "spp", "MrSE", "RelMSE", "SSIM", "FLIP", "energy", "time", "of it sampling", "wall"]
    return page.table(heads, rows, caption)


def picture_methods(results, scene, limit=7):
    """The base, the default, and of the others the best by FLIP at the anchor's samples, one a filter."""
    of = [p for p in results.of(scene) if p.stop == "spp" and p.spp == results.suite.anchor and p.image]
    chosen = [p for m in (BASE, DEFAULT) for p in of if p.method == m]
    seen = {p.method.filter for p in chosen}
    for p in sorted(of, key=lambda p: p.errors["flip"]):
        if p.method.filter not in seen and len(chosen) < limit:
            chosen.append(p)
            seen.add(p.method.filter)
    return chosen


def picture_section(results):
    parts = [page.text(words.PICTURES, spp=results.suite.anchor)]
    for scene in results.scenes:
        reference = results.truths[scene]
        if not reference["image"].startswith(results.runs.store.folder):
            continue  # others' files: not all of their compressions are read here
        entries = [(f"{p.method}: MrSE {p.errors['mrse']:.3g}", p.image) for p in picture_methods(results, scene)]
        view = next(v for v in results.suite.views if v.name == scene)
        parts.append({"kind": "compare", "title": scene, "width": min(2 * view.size[0], 640),
                      "entries": pictures.strip(entries, reference["image"])})
    return page.section("Pictures", parts)


def parsimony_section(results):
    made = parsimony.rows(results.points, results.report, results.suite.anchor)
    rows = [[r["scene"], r["budget"], f"{r['spp']:.1f}", f"{r['uniform_how']}{number(r['uniform'])}", str(r["passes"]),
             str(r["tried"]), r["chosen"], r["dropped"], r["reason"], f"{r['sampling']:.2f}", f"{r['rest']:.2f}",
             f"{r['whole']:.2f}", number(r["over"], 2)] for r in made]
    heads = ["scene", "budget", "spp", "uniform spp", "passes", "tried", "chosen", "dropped", "why", "sampling s",
             "plan, filter s", "all filters s", "cost over all on"]
    return page.section("Parsimony", [
        page.text(words.PARSIMONY),
        page.table(heads, rows, texts=(0, 6, 7, 8)),
        page.table(["scene", "built and noted"], [list(pair) for pair in {r["scene"]: r["built"] for r in made}.items()],
                   texts=(0, 1))])
