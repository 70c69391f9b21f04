"""The tables and figures of Xing, Chen, Li 2020 again, from our own runs."""
from . import claims, exr, page, pictures, plots, words
from .front import geomean
from .methods import BASE, DEFAULT, Method, film, short
from .sections import errors_table
from .summary import find

READINGS = {"printed": "paper:mode=printed", "corrected": "paper"}


def tables(results):
    """Figs 6 to 9: all methods at 8 samples."""
    spp = results.suite.anchor
    parts = [page.text(words.TABLES, spp=spp)]
    for scene in results.scenes:
        of = [p for p in results.of(scene) if p.spp == spp and p.stop == "spp"]
        parts.append(errors_table(of, scene))
    return page.section("Figs 6 to 9", parts)


def _line(results, method, counts):
    """Geometric mean over the scenes of MrSE over that of the base at the first count; None if a scene lacks it."""
    out = []
    for spp in counts:
        of = [(find(results.points, s, method, spp), find(results.points, s, BASE, counts[0])) for s in results.scenes]
        if not all(p and b for p, b in of):
            return None
        out.append(geomean(p.errors["mrse"] / b.errors["mrse"] for p, b in of))
    return out


def convergence_figure(results):
    """Two panels: filters, samplers and whole methods."""
    counts = results.suite.spp

    def lines(methods, label):
        out = {}
        for method in methods:
            y = _line(results, method, counts)
            if y:
                style = {**results.looks.line(method), "linewidth": 4 if method == BASE else 2 if method == DEFAULT else 1.2,
                         "alpha": 0.8 if method == BASE else 1, "markersize": 8 if method == DEFAULT else 4}
                out[label(method)] = (counts, y, style)
        return out
    filters = lines([m for m in results.methods if m.sampler == "uniform"] + [DEFAULT],
                    lambda m: "default" if m == DEFAULT else short(m.filter))
    samplers = lines([m for m in results.methods if m.filter == "none"] + [Method(s, f) for s, f in
                     ((m.sampler, m.filter) for m in results.methods) if s not in ("uniform", "adaptive") and f != "none"],
                     lambda m: short(m.sampler) if m.filter == "none" else f"{short(m.sampler)} + {short(m.filter)}")
    # Samplers by colour here: most of them share the filter.
    for k, (label, (_, _, style)) in enumerate(samplers.items()):
        if label != "uniform":
            style.update(plots.colour(k - 1))
    return plots.lines_chart([("filters, uniform sampling", filters), ("samplers, and methods as a whole", samplers)],
                             f"MrSE over unfiltered, {counts[0]:g} spp")


def convergence(results):
    """Fig. 10, with sampler and filter told apart."""
    return page.section("Fig. 10 convergence", [page.text(words.CONVERGENCE, spp=results.suite.spp[0]),
                                                page.chart(plots.svg(convergence_figure(results)))])


def gradient(results):
    """Fig. 11: SBF with the gradient as a feature against the paper's filter."""
    spp = results.suite.anchor
    filters = ["sbf", "sbf-gradient", *(m.filter for m in claims.OURS.values())]
    shown = [*(Method("uniform", f) for f in filters), DEFAULT]
    rows = []
    for scene in results.scenes:
        of = [find(results.points, scene, m, spp) for m in shown]
        best = min((p.errors["mrse"] for p in of if p), default=0)
        rows.append([scene, *(page.marked(f"{p.errors['mrse']:.4f}", "best" if p.errors["mrse"] <= best else "") if p else "-"
                              for p in of)])
    return page.section("Fig. 11 gradient", [
        page.text(words.GRADIENT),
        page.table(["scene"] + ["default" if m == DEFAULT else short(m.filter) for m in shown], rows)])


def _chess(results):
    return next((v for v in results.suite.views if v.name == "chess"), None)


def chess_passes(results):
    """Renders of chess by the paper's sampler, four passes and no budget, by reading."""
    view = _chess(results)
    if view is None:
        return {}
    out = {}
    for reading, sampler in READINGS.items():
        whole = f"{sampler}{',' if ':' in sampler else ':'}pilot=4,passes=4"
        made = film(results.runs, view, Method(whole, "none"), None, results.suite.seeds[0])
        if not made["failed"]:
            out[reading] = made
    return out


def spp_of_passes(made, pixels):
    total, out = 0, []
    for one in made["report"]["passes"]:
        total += one["samples"]
        out.append(total / pixels)
    return out


def passes(results, chess):
    """Fig. 3: samples after each pass, and where they went."""
    view, parts = _chess(results), [page.text(words.PASSES, spp=", ".join(f"{c:g}" for c in claims.CHESS_SPP))]
    rows = []
    for reading, made in chess.items():
        relmse = [one["relmse"] for one in made["report"]["passes"]]
        counts = spp_of_passes(made, view.pixels())
        rows.append([reading, ", ".join(f"{c:.1f}" for c in counts), ", ".join(f"{e:.3g}" for e in relmse)])
    parts.append(page.table(["reading", "spp after each pass", "estimated RelMSE"], rows, texts=(0, 1, 2)))
    for scene in results.scenes:
        entries = []
        for method in [DEFAULT, Method("adaptive:by=noise", "none"), *claims.OURS.values()]:
            point = find(results.points, scene, method, results.suite.anchor)
            made = results.runs.store.get(point.rendered) if point else None
            if made:
                counts = exr.read(made["image"])[0]["samples.Y"]
                entries.append({"label": f"{short(method.sampler)}, {point.mean_spp:.1f} spp",
                                "image": pictures.uri(pictures.sample_map(counts))})
        if entries:
            parts.append({"kind": "strip", "title": f"{scene}: samples", "entries": entries})
    return page.section("Fig. 3 passes", parts)


def sharpness(results, scene="veach-ajar"):
    reference = results.truths.get(scene)
    if not reference:
        return {}
    truth, out = exr.read_rgb(reference["image"]), {}
    wanted = {"sbf": Method("uniform", "sbf"), "sbf-gradient": Method("uniform", "sbf-gradient"), **claims.OURS}
    for label, method in wanted.items():
        point = find(results.points, scene, method, results.suite.anchor)
        if point and point.image:
            out[label] = pictures.sharpness(exr.read_rgb(point.image), truth)
    return out


def claim_table(results, chess):
    """Every claim, with its verdict."""
    counts = {k: spp_of_passes(made, _chess(results).pixels()) for k, made in chess.items()}
    lines = claims.check(results.points, results.scenes, results.suite.spp, results.suite.anchor, sharpness(results), counts)
    marks = {claims.HOLDS: "good", claims.FAILS: "bad"}
    rows = [[c.where, c.says, page.marked(c.verdict, marks.get(c.verdict, "")), c.figures, c.why] for c in lines]
    return page.section("Claims", [
        page.text(words.CLAIMS, spp=results.suite.anchor),
        page.table(["where", "the paper", "verdict", "figures", "note"], rows, texts=(0, 1, 2, 3, 4))])
