"""One HTML file from sections of parts: nothing in it is loaded from elsewhere."""
import os

import jinja2


def text(words, **values):
    return {"kind": "text", "text": " ".join(words.format(**values).split())}


def head(words):
    return {"kind": "head", "text": words}


def chart(svg, caption=""):
    return {"kind": "chart", "svg": svg, "caption": caption}


def table(headings, rows, caption="", texts=(0,)):
    """Cells are strings, or {"text", "mark"} with mark best, good or bad. texts: columns that are words."""
    return {"kind": "table", "head": headings, "rows": rows, "caption": caption, "texts": set(texts)}


def marked(words, mark):
    return {"text": words, "mark": mark}


def section(title, parts):
    return {"id": title.lower().replace(" ", "-"), "title": title, "parts": parts}


def render(title, words, about, sections):
    here = os.path.dirname(os.path.abspath(__file__))
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(here), autoescape=True, undefined=jinja2.StrictUndefined,
                                     trim_blocks=True, lstrip_blocks=True)
    return environment.get_template("page.html.j2").render(title=title, text=words, about=about, sections=sections)
