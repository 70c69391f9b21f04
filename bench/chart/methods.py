"""A method: a sampler and a filter. How its image is come by, what it costs, how far it is off."""
import dataclasses

# The unfiltered EXR doesn't hold single samples, which rpf looks at, nor what a job lets auto spend. They run in the render.
IN_RENDER = ("auto", "rpf")
OF_SAMPLES = ("rpf",)


@dataclasses.dataclass(frozen=True, order=True)
class Method:
    """Both as the command line has them."""
    sampler: str
    filter: str

    def __str__(self):
        return f"{short(self.sampler)} + {short(self.filter)}"

    def parts(self):
        return [self.sampler, self.filter]

    def in_render(self):
        """Whether one `relume render` must do all: the plan of `adaptive` looks at the filtered halves, too."""
        name = self.filter.split(":")[0]
        return name in IN_RENDER or name != "none" and is_guided(self.sampler)


DEFAULT = Method("adaptive", "auto")
BASE = Method("uniform", "none")


def short(text):
    return text.replace("mode=", "").replace("bilateral:", "bilateral ").replace(":", " ")


def is_guided(sampler):
    return sampler.split(":")[0] == "adaptive" and "by=noise" not in sampler


def film(runs, view, method, spp, seed):
    """The unfiltered render that the method's filter is given."""
    return runs.render(view, method.sampler, spp, seed)


def image(runs, view, method, spp, seed, extra=()):
    """(record with the image, cpu and wall seconds of sampling and filter together, of sampling alone, the render)."""
    name = method.filter.split(":")[0]
    if method.in_render() or spp is None:
        options = [*extra, "--keep-samples"] if name in OF_SAMPLES else list(extra)
        made = runs.render(view, method.sampler, spp, seed, method.filter, options)
        seconds = made["seconds"] or {}
        return made, seconds, seconds.get("samples_cpu"), made
    noisy = film(runs, view, method, spp, seed)
    if name == "none" or noisy["failed"]:
        seconds = noisy["seconds"] or {}
        return noisy, seconds, seconds.get("samples_cpu"), noisy
    filtered = runs.denoise(noisy, method.filter)
    seconds = {k: noisy["seconds"][k] + filtered["seconds"][k] for k in ("cpu", "wall")}
    return filtered, seconds, noisy["seconds"]["samples_cpu"], noisy


def row(runs, view, truth, method, spp, seed, extra=(), stop="spp"):
    """One line of the results: plain values, None where there is none. Processor seconds are over the threads."""
    made, seconds, samples, render = image(runs, view, method, spp, seed, extra)
    line = {"scene": view.name, "sampler": method.sampler, "filter": method.filter, "stop": stop, "spp": spp, "seed": seed,
            "width": view.size[0], "height": view.size[1], "failed": made["failed"], "image": made["image"],
            "key": made["key"], "render": render["key"]}
    if made["failed"]:
        return line
    chosen = made.get("told", {}).get("relume.filter") or (made.get("report") or {}).get("filter", {}).get("filter")
    line.update(mean_spp=render["mean_spp"], cpu_seconds=seconds["cpu"] / runs.threads,
                sampling_seconds=samples / runs.threads, wall_seconds=seconds["wall"], chosen=chosen,
                stopped_by=render["report"]["stop_reason"])
    line.update(runs.compare(truth, made))
    return line
