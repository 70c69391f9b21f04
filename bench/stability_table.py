"""What bench/stability makes of its results: cells, tables on the terminal, a heat map and a page."""
import base64
import dataclasses
import html
import math
import os
import statistics
import struct
import sys
import zlib

import numpy as np
from chart import exr
from stability_scenes import SCENES

# Errors below this (a hundredth of a per cent of a pixel) are none: ratios of them say nothing.
NO_ERROR = 1e-8
WORSE, ENERGY_BAR = 1.05, 0.01
RED, GRAY, PLAIN = "\033[41m", "\033[100m", "\033[0m"


@dataclasses.dataclass
class Cell:
    crashed: str = None  # without an image: what was said
    ratio: float = math.nan  # of the means of MrSE
    worst: float = math.nan  # of one seed
    better: int = 0  # seeds that are better than unfiltered
    mrse: float = math.nan
    energy: float = math.nan
    energy_error: float = math.nan
    bad: int = 0
    negative: int = 0
    chosen: dict = None  # filter that auto took: number of seeds

    def word(self):
        """Of a cell without an image: refused in words, or worse."""
        return "crash" if "ended by" in self.crashed or "took longer" in self.crashed else "refused"

    def worse(self):
        return self.ratio > WORSE

    def off(self):
        """In energy."""
        return not abs(self.energy - 1) <= ENERGY_BAR + 3 * self.energy_error


def cells_of(results, unfiltered, floor):
    """`results` and `unfiltered`: a seed each."""
    failed = [r["failed"] for r in results if r["failed"]]
    if failed or any(r["failed"] for r in unfiltered):
        return Cell(crashed=f"{len(failed)} of {len(results)} seeds: {failed[0]}" if failed else "no image to compare with")
    def error(result):
        return max(result["mrse"] - floor, 0) + NO_ERROR
    ratios = [error(a) / error(b) for a, b in zip(results, unfiltered)]
    # Of black images it is nothing over nothing.
    energies = [1.0 if r["mrse"] < NO_ERROR else math.inf if r["energy"] is None else r["energy"] for r in results]
    chosen = {}
    for r in results:
        chosen[r["chosen"]] = chosen.get(r["chosen"], 0) + 1
    mrse = statistics.fmean(map(error, results))
    return Cell(ratio=mrse / statistics.fmean(map(error, unfiltered)), worst=max(ratios), better=sum(r < 1 for r in ratios),
                mrse=mrse, energy=statistics.fmean(energies),
                energy_error=statistics.stdev(energies) / len(energies) ** 0.5 if math.isfinite(sum(energies)) else 0.0,
                bad=sum(r["bad"] for r in results), negative=sum(r["negative"] for r in results), chosen=chosen)


def faults(name, cell):
    """Where a method leaves its bars: (kind, text)."""
    if cell.crashed:
        return [("crash", f"{name}: {cell.crashed}")]
    found = []
    if cell.bad:
        found.append(("values", f"{name}: {cell.bad} pixels are NaN or infinite"))
    if cell.negative:
        found.append(("values", f"{name}: {cell.negative} pixels are negative"))
    if cell.worse():
        found.append(("error", f"{name}: MrSE is {cell.ratio:.3g} times the unfiltered image's, worst seed {cell.worst:.3g}; "
                               f"at most {WORSE} in the mean"))
    if cell.off():
        found.append(("energy", f"{name}: energy {cell.energy:.4f} +- {cell.energy_error:.4f} of the reference's; "
                                f"{ENERGY_BAR:.0%} and three standard errors are allowed"))
    return found


def differing(cells):
    """Scenes whose image is to be that of another scene, and is not: unfiltered, with the same samples."""
    found = []
    for name, of in cells.items():
        like = cells.get(SCENES[name].same_as)
        if like and not of["unfiltered"].crashed:
            ratio = of["unfiltered"].mrse / like["unfiltered"].mrse
            if not 0.98 < ratio < 1.02:
                found.append(f"{name}: unfiltered MrSE is {ratio:.3g} times that of {SCENES[name].same_as}, which shows the same")
    return found


def short(method):
    return method.replace("bilateral:mode=", "").replace("neighbours=", "")


def number(x):
    return f"{x:.3f}"[1:] if x < 0.9995 else f"{x:.2f}" if x < 99.5 else f"{x:.0f}" if x < 1e4 else f"{x:.0e}"


def marks(cell):
    return "!" * bool(cell.bad) + "-" * bool(cell.negative)


def print_tables(cells, methods, floors, refusals):
    color = sys.stdout.isatty()
    def table(title, text, is_bad):
        print(f"\n{title}\n{'':18}" + "".join(f"{short(m)[:12]:>13}" for m in methods))
        for name, of in cells.items():
            line = f"{name:18}"
            for m in methods:
                said = f"{of[m].word() if of[m].crashed else text(of[m]):>13}"
                back = GRAY if of[m].crashed else RED if is_bad(of[m]) else ""
                line += back + said + PLAIN if color and back else said
            print(line)
    table("MrSE over the unfiltered image's; * worse in the mean, ~ on some seed; ! not finite, - negative",
          lambda c: number(c.ratio) + marks(c) + ("*" if c.worse() else "~" if c.worst > WORSE else " "), Cell.worse)
    table("the same of the worst seed", lambda c: number(c.worst) + " ", lambda c: c.worst > WORSE)
    table("energy over the reference's (standard error in thousandths)",
          lambda c: f"{c.energy:.3f}({1e3 * c.energy_error:.0f})",
          Cell.off)
    print("\nunfiltered images: MrSE, energy (standard error); error of the reference over theirs")
    for name, of in cells.items():
        c = of["unfiltered"]
        if c.crashed:
            print(f"{name:18} {c.crashed}")
            continue
        share = floors[name] / max(c.mrse, NO_ERROR)
        doubt = "  the reference has not converged: ratios below it say nothing" if share > 0.05 else ""
        print(f"{name:18} {c.mrse:10.3g} {c.energy:8.4f} ({c.energy_error:.4f}) {share:8.4f}{doubt}")
    for method in methods:
        if any(of[method].chosen for of in cells.values()) and method in ("auto", "default"):
            print(f"\n{method} took")
            for name, of in cells.items():
                print(f"{name:18} " + ", ".join(f"{k} x{v}" for k, v in (of[method].chosen or {}).items()))
    for name, said in refusals.items():
        print(f"{name:18} {said or 'refused, as it is to be'}")
    for name, of in cells.items():
        for m in methods:
            if of[m].crashed:
                print(f"{name}, {m}: {of[m].crashed}")


def fill(cell):
    """Green where better, white at 1, red from 1.05 on; grey for a crash."""
    if cell.crashed or not math.isfinite(cell.ratio):
        return "#999999"
    if cell.bad or cell.negative:
        return "#c020c0"
    if cell.ratio > WORSE:
        depth = min(1, 0.35 + 0.35 * math.log10(cell.ratio))
        return f"rgb(230,{round(190 * (1 - depth))},{round(190 * (1 - depth))})"
    depth = min(1, max(0, -math.log10(max(cell.ratio, 1e-3)) / 2))
    return f"rgb({round(255 - 155 * depth)},{round(255 - 55 * depth)},{round(255 - 155 * depth)})"


def heat_map(cells, methods):
    """An SVG: a row a scene, a column a method."""
    left, top, width, height = 150, 96, 58, 22
    right, bottom = left + width * len(methods), top + height * len(cells)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {right + 30} {bottom + 8}" width="{right + 30}" '
           f'height="{bottom + 8}" font-family="sans-serif" font-size="11"><rect width="100%" height="100%" fill="#fff"/>']
    for i, m in enumerate(methods):
        x = left + width * (i + 0.5)
        out.append(f'<text x="{x}" y="{top - 6}" transform="rotate(-45 {x} {top - 6})">{html.escape(short(m))}</text>')
    for j, (name, of) in enumerate(cells.items()):
        y = top + height * j
        out.append(f'<text x="{left - 6}" y="{y + 15}" text-anchor="end">{name}</text>')
        for i, m in enumerate(methods):
            c, x = of[m], left + width * i
            tip = c.crashed or (f"{name}, {m}: MrSE {c.ratio:.4g} of the unfiltered image's, worst seed {c.worst:.4g}; energy "
                                f"{c.energy:.4f} +- {c.energy_error:.4f}; not finite {c.bad}, negative {c.negative}")
            text = c.word() if c.crashed else number(c.ratio) + marks(c)
            out.append(f'<g><title>{html.escape(tip)}</title><rect x="{x}" y="{y}" width="{width - 1}" height="{height - 1}" '
                       f'fill="{fill(c)}"/><text x="{x + width / 2}" y="{y + 15}" text-anchor="middle">{text}</text>'
                       + (f'<circle cx="{x + width - 6}" cy="{y + 5}" r="2.5" fill="#d00"/>'
                          if not c.crashed and c.worst > WORSE >= c.ratio else "") + "</g>")
    return "\n".join(out) + "\n</svg>\n"


def png_view(path):
    """sRGB, clamped, as a data URI."""
    rgb = np.nan_to_num(exr.read_rgb(path), nan=1, posinf=1, neginf=0).clip(0, 1)
    bytes_ = np.rint(255 * np.where(rgb < 0.0031308, 12.92 * rgb, 1.055 * rgb ** (1 / 2.4) - 0.055)).astype(np.uint8)
    height, width, _ = rgb.shape
    raw = b"".join(b"\0" + row.tobytes() for row in bytes_)
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)), (b"IDAT", zlib.compress(raw, 9)), (b"IEND", b"")]
    png = b"\x89PNG\r\n\x1a\n" + b"".join(struct.pack(">I", len(data)) + kind + data
                                          + struct.pack(">I", zlib.crc32(data, zlib.crc32(kind))) for kind, data in chunks)
    return "data:image/png;base64," + base64.b64encode(png).decode()


def write_page(folder, cells, methods, refusals, images):
    """`images`: by scene and method, EXR files."""
    os.makedirs(folder, exist_ok=True)
    svg = heat_map(cells, methods)
    with open(os.path.join(folder, "table.svg"), "w", encoding="utf-8") as file:
        file.write(svg)
    strips = []
    for name, of in images.items():
        strip = "".join(f'<figure><img src="{png_view(path)}" alt="{html.escape(what)}"><figcaption>'
                        f"{html.escape(short(what))}</figcaption></figure>" for what, path in of.items())
        strips.append(f"<h3>{name}</h3><p>{html.escape(SCENES[name].why)}</p><div>{strip}</div>")
    refused = "".join(f"<li>{n}: {html.escape(said or 'refused, as it is to be')}</li>" for n, said in refusals.items())
    with open(os.path.join(folder, "index.html"), "w", encoding="utf-8") as file:
        file.write(f"""<!doctype html><html lang="en"><meta charset="utf-8"><title>Stability</title>
<style>body{{font-family:sans-serif;margin:2em}} div{{display:flex;flex-wrap:wrap;gap:8px}} figure{{margin:0}}
img{{image-rendering:pixelated;width:192px;max-height:384px}} figcaption{{font-size:12px}}</style>
<h1>Where methods fail</h1>
<p>MrSE over the unfiltered image's, means over the seeds. Red: worse than unfiltered by more than 5 %; a red dot: so on some
seed; purple: values that are not finite, or negative; grey: crash.</p>
{svg}<h2>Files that are to be refused</h2><ul>{refused}</ul><h2>Images of the first seed</h2>{''.join(strips)}</html>
""")
