"""What the default built, sampled, tried, chose and dropped, and what it cost less than all of it would have."""
from . import front
from .methods import BASE, DEFAULT, Method, short
from .summary import find


def plain(filter_):
    """The name of a filter without features dropped."""
    return filter_.split(":")[0]


def everything_on(filter_report):
    """(candidates, expected seconds of each of them once on the whole image with all features). The expected seconds are
    those that `auto` measured on a part of it."""
    whole = [c for c in filter_report["candidates"] if "without=" not in c["filter"] and c["filter"] != "none"]
    return len(filter_report["candidates"]), sum(c["seconds"] for c in whole)


def uniform_samples(points, scene, point):
    """Samples a pixel that uniform sampling with the chosen filter (unfiltered, if that was not run) takes for the same
    error, with the mark of front.time_for; (None, "") if it can't be told."""
    name = plain(point.chosen)
    candidates = [p.method for p in points if p.scene == scene and p.method.sampler == "uniform"
                  and plain(p.method.filter) == name]
    method = candidates[0] if candidates else BASE
    line = [(p.mean_spp, p.errors["mrse"]) for p in points if p.scene == scene and p.method == method and p.stop == "spp"]
    return *front.time_for(line, point.errors["mrse"]), method


def rows(points, report_of, anchor):
    """A dictionary a scene and budget (the anchor's samples, the own rule). report_of(key): the render's report."""
    out = []
    for scene in dict.fromkeys(p.scene for p in points):
        for point in (find(points, scene, DEFAULT, anchor), find(points, scene, DEFAULT, None, "own rule")):
            if point is None:
                continue
            report = report_of(point.rendered)
            tried, whole = everything_on(report["filter"])
            took = report["filter"]["seconds"]
            planned = report["seconds"]["planning_filter"]
            samples, how, method = uniform_samples(points, scene, point)
            sample = point.sampling / point.mean_spp
            out.append({
                "over": point.time / ((samples or point.mean_spp) * sample + whole) if whole else None,
                "scene": scene, "budget": f"{anchor:g} spp" if point.stop == "spp" else "own rule",
                "spp": point.mean_spp, "passes": len(report["passes"]), "built": "; ".join(report["notes"]),
                "tried": tried, "chosen": short(report["filter"]["filter"]), "dropped": report["filter"]["dropped"] or "-",
                "reason": report["filter"]["reason"], "sampling": point.sampling, "rest": point.time - point.sampling,
                "filter_wall": took, "planning_wall": planned, "whole": whole,
                "uniform": samples, "uniform_how": how, "uniform_method": str(method) if isinstance(method, Method) else "",
            })
    return out
