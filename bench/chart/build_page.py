"""The page of a suite: its sections in the order in which it names them; charts as PNG where asked for."""
import os

from . import page, paper_sections, plots, sections
from .summary import over_all


def build(suite, runs, points, truths, about, png_folder=None):
    """The HTML text."""
    results = sections.Results(suite, runs, points, truths)
    chess = paper_sections.chess_passes(results) if {"passes", "claims"} & set(suite.sections) else {}
    makers = {
        "pareto": sections.pareto, "speedup": sections.speedup, "errors": sections.errors,
        "pictures": sections.picture_section, "parsimony": sections.parsimony_section, "tables": paper_sections.tables,
        "convergence": paper_sections.convergence, "gradient": paper_sections.gradient,
        "passes": lambda r: paper_sections.passes(r, chess),
        "claims": lambda r: paper_sections.claim_table(r, chess)}
    made = [makers[name](results) for name in suite.sections]
    if png_folder:
        write_pngs(results, png_folder)
    return page.render(suite.title, suite.text, about, made)


def write_pngs(results, folder):
    """pareto-all.png and pareto-SCENE.png."""
    os.makedirs(folder, exist_ok=True)
    every = over_all(results.points, results.suite.anchor)
    if every and len(results.scenes) > 1:
        figure = plots.pareto(every, results.looks, "All scenes", "time over the base's")
        plots.png(figure, os.path.join(folder, "pareto-all.png"))
    for scene in results.scenes:
        figure = plots.pareto(results.of(scene), results.looks, scene, sections.TIME)
        plots.png(figure, os.path.join(folder, f"pareto-{scene}.png"))
