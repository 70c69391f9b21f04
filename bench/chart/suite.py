"""A suite: the declarative YAML file of a study. See docs/bench.md for its fields."""
import dataclasses
import os
import sys

import yaml

from .methods import DEFAULT, Method
from .programs import BenchError
from .scenes import SHARED, make_view

FIELDS = {"title", "text", "scenes", "size", "samplers", "filters", "methods", "default", "spp", "targets", "seconds",
          "seeds", "reference_spp", "anchor", "sections", "pictures", "allowed"}
SECTIONS = ("pareto", "speedup", "pictures", "parsimony", "tables", "convergence", "gradient", "passes", "claims", "errors")


@dataclasses.dataclass
class Suite:
    """What is to be run, and what is made of it."""
    name: str
    title: str
    text: str
    views: list
    missing: list  # scenes whose files are absent
    methods: list  # without the default
    default: bool
    spp: list
    targets: list  # estimated RelMSE where the default stops; "own": no budget at all
    seconds: list  # --time-limit of the default
    seeds: list
    reference_spp: int
    anchor: float  # samples of the default that speed-ups and pictures are stated for
    sections: list
    allowed: float  # error of the default over the front's that passes


def as_list(value):
    return value if isinstance(value, list) else [value]


def scene_name(entry):
    return entry if isinstance(entry, str) else entry.get("name", entry.get("file"))


def load(path, shared=SHARED, only=None):
    """Reads and checks a suite. `only`: names of scenes."""
    try:
        with open(path, encoding="utf-8") as file:
            told = yaml.safe_load(file)
    except OSError as error:
        raise BenchError(f"{path}: {error.strerror}") from error
    except yaml.YAMLError as error:
        raise BenchError(f"{path}: no YAML: {str(error).splitlines()[0]}") from error
    if not isinstance(told, dict) or "scenes" not in told:
        raise BenchError(f"{path}: a suite is a mapping with `scenes`")
    unknown = set(told) - FIELDS
    if unknown:
        raise BenchError(f"{path}: no field {', '.join(sorted(unknown))}; there are {', '.join(sorted(FIELDS))}")
    sections = told.get("sections", ["pareto", "speedup", "pictures", "parsimony", "errors"])
    for section in sections:
        if section not in SECTIONS:
            raise BenchError(f"{path}: no section {section}; there are {', '.join(SECTIONS)}")
    views, missing = [], []
    for entry in told["scenes"]:
        if only and scene_name(entry) not in only:
            continue
        try:
            view = make_view(entry, shared, os.path.dirname(os.path.abspath(path)), told.get("size"))
        except (KeyError, ValueError) as error:
            raise BenchError(f"{path}: scene {entry}: {error}") from error
        if view:
            views.append(view)
        else:
            missing.append(scene_name(entry))
    if not views:
        raise BenchError(f"{path}: none of its scenes is there" + ("" if only else "; --scenes names their folder"))
    methods = [Method(s, f) for s in told.get("samplers", []) for f in told.get("filters", [])]
    methods += [Method(*pair) for pair in told.get("methods", [])]
    default = bool(told.get("default", True))
    spp = as_list(told.get("spp", [8]))
    return Suite(
        name=os.path.splitext(os.path.basename(path))[0], title=told.get("title", "Study"), text=told.get("text", ""),
        views=views, missing=missing, methods=[m for m in dict.fromkeys(methods) if not (default and m == DEFAULT)],
        default=default, spp=spp, targets=as_list(told.get("targets", [])), seconds=as_list(told.get("seconds", [])),
        seeds=as_list(told.get("seeds", [1])), reference_spp=told.get("reference_spp", 1024),
        anchor=told.get("anchor", spp[len(spp) // 2]), sections=sections, allowed=told.get("allowed", 1.1))


if __name__ == "__main__":
    print(load(sys.argv[1]))
