"""The page of a suite: its sections in the order in which it names them; what goes into documents, where asked for."""
from . import documents, page, paper_sections, sections


def build(suite, runs, points, truths, about, documents_folder=None):
    """The HTML text."""
    results = sections.Results(suite, runs, points, truths)
    chess = paper_sections.chess_passes(results) if {"passes", "claims"} & set(suite.sections) else {}
    makers = {
        "pareto": sections.pareto, "speedup": sections.speedup, "equal_time": sections.equal_time, "errors": sections.errors,
        "pictures": sections.picture_section, "parsimony": sections.parsimony_section, "tables": paper_sections.tables,
        "convergence": paper_sections.convergence, "gradient": paper_sections.gradient,
        "passes": lambda r: paper_sections.passes(r, chess),
        "claims": lambda r: paper_sections.claim_table(r, chess)}
    made = {name: makers[name](results) for name in suite.sections}
    if documents_folder:
        documents.write(results, made, documents_folder, runs.store.put_text)
    return page.render(suite.title, suite.text, about, made.values())

