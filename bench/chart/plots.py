"""Charts by matplotlib, as SVG text or PNG files."""
import io
import re

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot, ticker  # noqa: E402

from . import front  # noqa: E402
from .methods import BASE, DEFAULT, short  # noqa: E402
from .summary import MEASURES, curves  # noqa: E402

# Okabe and Ito 2008: told apart by colour-blind eyes. Beyond seven the same colours come dashed, then dotted.
COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#7a5c00"]
DASHES = ["-", (0, (5, 1.5)), (0, (1, 1.2))]
MARKERS = ["o", "s", "^", "D", "v", "P", "<", ">", "h", "p"]
GREY = "#aaaaaa"
STYLE = {"font.size": 9, "font.family": "DejaVu Sans", "axes.spines.top": False, "axes.spines.right": False,
         "axes.grid": True, "grid.color": "#e6e6e6", "grid.linewidth": 0.6, "axes.axisbelow": True, "svg.fonttype": "none",
         "svg.hashsalt": "relume", "axes.titlesize": 10, "axes.titleweight": "bold", "legend.frameon": False,
         "legend.fontsize": 8}


def colour(k):
    """The k-th colour and dash."""
    return {"color": COLOURS[k % len(COLOURS)], "linestyle": DASHES[k // len(COLOURS) % len(DASHES)]}


class Looks:
    """The same colour for a filter and the same marker for a sampler on every chart of a page."""

    def __init__(self, methods):
        filters = sorted({m.filter for m in methods} - {"none", "auto"})
        samplers = sorted({m.sampler for m in methods} - {"uniform", "adaptive"})
        self.filters = {"none": {"color": GREY}, "auto": {"color": "black"}, **{f: colour(k) for k, f in enumerate(filters)}}
        self.samplers = {"uniform": "o", "adaptive": "*", **{s: MARKERS[1 + k % 9] for k, s in enumerate(samplers)}}

    def line(self, method):
        return {**self.filters[method.filter], "marker": self.samplers[method.sampler]}


def _plain(axis):
    """2, 5, 10 ... as plain numbers on log axes, few enough to be read."""
    axis.set_major_locator(ticker.LogLocator(subs=(1.0, 2.0, 5.0), numticks=12))
    axis.set_major_formatter(ticker.FuncFormatter(lambda v, _: f"{v:g}"))
    axis.set_minor_formatter(ticker.NullFormatter())


def _thin(axes, axis):
    """At most seven labels or so: where 1, 2, 5 are too many, 1 and 3, then powers of ten."""
    low, high = axes.get_xlim() if axis is axes.xaxis else axes.get_ylim()
    if high / low > 30:
        axis.set_major_locator(ticker.LogLocator(subs=(1.0, 3.0) if high / low < 1000 else (1.0,), numticks=8))


def _panel(axes, points, measure, looks, unit):
    lines = curves(points, measure)
    base = front.curve(lines.pop(BASE, []))
    times = [p.time for p in points]
    errors = [p.errors[measure] for p in points]
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(min(times) / 1.25, max(times) * 1.25)
    axes.set_ylim(min(errors) / 1.3, max(errors) * 1.3)
    if base:
        axes.plot(*zip(*base), color=GREY, linewidth=5, alpha=0.7, solid_capstyle="round", zorder=1)
        if measure == "mrse":
            t, e = base[-1]
            axes.plot([t, t * 1000], [e, e / 1000], color=GREY, linewidth=1.5, dashes=(4, 2), zorder=1)
    for method, of in lines.items():
        of = front.curve(of)
        default = method == DEFAULT
        axes.plot(*zip(*of), **looks.line(method), linewidth=2.2 if default else 1.1, markersize=9 if default else 4,
                  alpha=1 if default else 0.75, markeredgewidth=0, zorder=4 if default else 2)
    every = [(t, e, m) for m, of in {BASE: base, **lines}.items() for t, e in of]
    best = [every[i] for i in front.front([(t, e) for t, e, _ in every])]
    axes.plot([t for t, _, _ in best], [e for _, e, _ in best], color="black", linewidth=0.8, linestyle=":", marker="o",
              markersize=8, markerfacecolor="none", markeredgewidth=0.8, zorder=5)
    for point in points:
        if point.stop != "spp":
            axes.plot(point.time, point.errors[measure], marker="x", color=looks.filters[point.method.filter]["color"],
                      markersize=9, markeredgewidth=2.2, zorder=6)
    axes.set_title(MEASURES[measure])
    axes.set_xlabel(unit)
    for axis in (axes.xaxis, axes.yaxis):
        _plain(axis)
        _thin(axes, axis)


def _legend(figure, points, looks):
    line = matplotlib.lines.Line2D
    methods = {p.method for p in points}
    filters = [f for f in looks.filters if any(m.filter == f for m in methods)]
    samplers = [s for s in looks.samplers if any(m.sampler == s for m in methods)]
    entries = [line([], [], color=GREY, linewidth=5, alpha=0.7, label="uniform, unfiltered")] if BASE in methods else []
    if DEFAULT in methods:
        entries.append(line([], [], color="black", linewidth=2.2, marker="*", markersize=9, label="default: adaptive, auto"))
    entries += [line([], [], **looks.filters[f], linewidth=2, label=short(f)) for f in filters
                if f != "none" and (f != "auto" or any(m.filter == f and m != DEFAULT for m in methods))]
    entries += [line([], [], color="#555555", linewidth=0, markersize=5, marker=looks.samplers[s],
                     label=f"sampler {short(s)}") for s in samplers]
    entries.append(line([], [], color="black", linestyle=":", linewidth=0.8, marker="o", markersize=8, markerfacecolor="none",
                        label="front"))
    if any(p.stop != "spp" for p in points):
        entries.append(line([], [], color="black", linewidth=0, marker="x", markersize=8, markeredgewidth=2.2,
                            label="a stop rule ends"))
    figure.legend(handles=entries, loc="center left", bbox_to_anchor=(1.0, 0.5))


def pareto(points, looks, title, unit="CPU seconds / threads", measures=tuple(MEASURES)):
    """Time against each measure, a panel each."""
    with matplotlib.rc_context(STYLE):
        figure, panels = pyplot.subplots(1, len(measures), figsize=(4.3 * len(measures), 3.9), constrained_layout=True)
        for axes, measure in zip(panels if len(measures) > 1 else [panels], measures):
            _panel(axes, points, measure, looks, unit)
        _legend(figure, points, looks)
        if title:
            figure.suptitle(title, x=0.01, ha="left", fontsize=11, fontweight="bold")
        return figure


def lines_chart(panels, ylabel, xlabel="samples a pixel", log_y=True):
    """Panels of (title, {label: (x, y, line style)}): convergence and the like."""
    with matplotlib.rc_context(STYLE):
        figure, every = pyplot.subplots(1, len(panels), figsize=(5.6 * len(panels), 3.8), constrained_layout=True,
                                        sharey=True, squeeze=False)
        for axes, (title, lines) in zip(every[0], panels):
            axes.set_xscale("log", base=2)
            if log_y:
                axes.set_yscale("log")
            for label, (x, y, style) in lines.items():
                axes.plot(x, y, label=label, markeredgewidth=0, **style)
            axes.xaxis.set_major_formatter(ticker.FuncFormatter(lambda v, _: f"{v:g}"))
            _plain(axes.yaxis)
            axes.set_title(title)
            axes.set_xlabel(xlabel)
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        every[0][0].set_ylabel(ylabel)
        return figure


def svg(figure):
    """The figure's SVG element, without XML's head; ids are its own, so that many stand on one page."""
    out = io.StringIO()
    figure.savefig(out, format="svg", bbox_inches="tight", metadata={"Date": None})
    pyplot.close(figure)
    text = out.getvalue()
    svg.count += 1
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg"):], flags=re.DOTALL)
    text = re.sub(r'\bid="', f'id="c{svg.count}-', text)
    return re.sub(r'(href="|url\()#', rf"\1#c{svg.count}-", text)


svg.count = 0


def png(figure, path, dpi=90):
    figure.savefig(path, dpi=dpi, bbox_inches="tight", metadata={"Software": None})
    pyplot.close(figure)
