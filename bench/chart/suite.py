"""A suite: the declarative YAML file of a study. See docs/bench.md for its fields."""
import dataclasses
import os

import yaml

from .methods import BASE, DEFAULT, Method
from .programs import BenchError
from .scenes import SHARED, make_view

FIELDS = {"title", "text", "scenes", "size", "samplers", "filters", "methods", "default", "default_spp", "spp", "targets",
          "stops", "max_spp", "seconds", "seeds", "reference_spp", "anchor", "rival", "times", "sections", "allowed"}
SECTIONS = ("pareto", "speedup", "pictures", "parsimony", "tables", "convergence", "gradient", "passes", "claims", "errors",
            "equal_time")


@dataclasses.dataclass
class Suite:
    """What is to be run, and what is made of it."""
    name: str
    title: str
    text: str
    views: list
    missing: list  # scenes whose files are absent
    methods: dict  # but for the default: the samples a pixel that each is run at
    default: bool
    default_spp: list
    spp: list
    targets: list  # estimated RelMSE where `stops` stop; "own": no budget at all
    stops: list  # methods
    max_spp: int  # cap of `targets`: some scenes take hours to get to an error
    seconds: list  # --time-limit of the default
    seeds: list
    reference_spp: int
    anchor: float  # samples of the default that speed-ups and pictures are stated for
    rival: Method  # whom the default is compared with after the same `times`, seconds
    times: list
    sections: list
    allowed: float  # error of the default over the front's that passes


def as_list(value):
    return value if isinstance(value, list) else [value]


def scene_name(entry):
    return entry if isinstance(entry, str) else entry.get("name", entry.get("file"))


def load(path, shared=SHARED, only=None, spp=None, scale=1):
    """Reads and checks a suite. `only`: names of scenes; spp: in place of the suite's, and
    of its default_spp those that are among them, or all if none is; scale: of the pictures' sides."""
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
            size = tuple(max(1, round(scale * side)) for side in view.size)
            views.append(dataclasses.replace(view, size=size))
        else:
            missing.append(scene_name(entry))
    if not views:
        raise BenchError(f"{path}: none of its scenes is there; --scenes names the folder of the shared ones")
    default = bool(told.get("default", True))
    given, spp = spp, spp or as_list(told.get("spp", [8]))
    default_spp = as_list(told.get("default_spp", spp))
    if given:
        default_spp = [n for n in default_spp if n in spp] or spp
    methods = {Method(s, f): spp for s in told.get("samplers", []) for f in told.get("filters", [])}
    methods.update({Method(*entry[:2]): entry[2] if len(entry) > 2 else spp for entry in told.get("methods", [])})
    methods = {BASE: spp, **methods}
    rival = Method(*told.get("rival", BASE.parts()))
    if rival not in methods:
        raise BenchError(f"{path}: rival {rival} is none of its methods")
    if default:
        methods.pop(DEFAULT, None)
    return Suite(
        name=os.path.splitext(os.path.basename(path))[0], title=told.get("title", "Study"), text=told.get("text", ""),
        views=views, missing=missing, methods=methods, default=default, default_spp=default_spp, spp=spp,
        targets=as_list(told.get("targets", [])), max_spp=told.get("max_spp", 512),
        stops=[Method(*pair) for pair in told.get("stops", [])] + [DEFAULT] * default, seconds=as_list(told.get("seconds", [])),
        seeds=as_list(told.get("seeds", [1])), reference_spp=told.get("reference_spp", 1024),
        anchor=told.get("anchor", spp[len(spp) // 2]), rival=rival, times=as_list(told.get("times", [5, 20, 60])), sections=sections, allowed=told.get("allowed", 1.1))

