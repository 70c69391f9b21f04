"""What of a page goes into documents: charts as PNG, a few sections as Markdown tables."""
import os

from . import paper_sections, plots, sections
from .summary import over_all

IN_WORDS = ("speedup", "equal_time", "parsimony", "claims", "gradient")


def write(results, made, folder, put):
    """made: {name: section}. Files are named after sections and scenes."""
    os.makedirs(folder, exist_ok=True)
    if "pareto" in made:
        charts = {scene: results.of(scene) for scene in results.scenes}
        every = over_all(results.points, results.suite.anchor)
        if every and len(results.scenes) > 1:
            plots.png(plots.pareto(every, results.looks, "All scenes", sections.RELATIVE), os.path.join(folder, "pareto-all.png"))
        for scene, points in charts.items():
            figure = plots.pareto(points, results.looks, scene, sections.TIME)
            plots.png(figure, os.path.join(folder, f"pareto-{scene}.png"))
    if "convergence" in made:
        plots.png(paper_sections.convergence_figure(results), os.path.join(folder, "convergence.png"))
    for name in IN_WORDS:
        if name in made:
            put(os.path.join(folder, f"{name}.md"), markdown(made[name]))


def markdown(section):
    """Texts and tables of a section."""
    out = [f"# {section['title']}"]
    for part in section["parts"]:
        if part["kind"] == "text":
            out.append(part["text"])
        elif part["kind"] == "table":
            if part["caption"]:
                out.append(f"## {part['caption']}")
            lines = [part["head"], ["---"] * len(part["head"]), *part["rows"]]
            out.append("\n".join("| " + " | ".join(_cell(cell) for cell in line) + " |" for line in lines))
    return "\n\n".join(out) + "\n"


def _cell(cell):
    words, mark = (cell["text"], cell["mark"]) if isinstance(cell, dict) else (cell, "")
    words = words.replace("|", "\\|").replace("<", "&lt;").replace("~", "\\~")
    return f"**{words}**" if mark in ("best", "bad") else words
