"""A view: a scene file, its options and the size of its picture."""
import dataclasses
import os
import sys

from study_scenes import SCENES

HERE = os.path.dirname(os.path.abspath(__file__))
OWN = os.path.normpath(os.path.join(HERE, "..", "..", "scenes"))
SHARED = os.path.normpath(os.path.join(HERE, "..", "..", "..", "shared", "scenes"))


@dataclasses.dataclass(frozen=True)
class View:
    """What is rendered; `options` are those of `relume render` that make the view, without the size."""
    name: str
    scene: str
    size: tuple  # width, height
    options: tuple = ()
    reference: str = None  # an EXR of that size that others made; none: relume renders one

    def arguments(self):
        return [self.scene, "--size", f"{self.size[0]}x{self.size[1]}", *self.options]

    def pixels(self):
        return self.size[0] * self.size[1]

    def environment(self):
        """The options of `relume info` that name further files of the scene."""
        if "--environment" not in self.options:
            return []
        at = self.options.index("--environment")
        return list(self.options[at:at + 2])


def parse_size(text):
    width, height = (int(side) for side in str(text).split("x"))
    return width, height


def resolve(path, shared, base):
    """The file of a suite: "own/..." in this repository's scenes, else beside the suite, else among the shared ones."""
    if path.startswith("own/"):
        return os.path.join(OWN, path[4:])
    beside = os.path.join(base, path)
    return beside if os.path.exists(beside) else os.path.join(shared, path)


def make_view(entry, shared=SHARED, base=".", size=None):
    """A view of a suite's entry: a name of bench/study_scenes.py, or a mapping with `name` or `file`, `size`, `options`,
    `environment` and `reference`. None, said on stderr, if a file is absent."""
    entry = {"name": entry} if isinstance(entry, str) else dict(entry)
    known = SCENES.get(entry.get("name"))
    file, default, environment, options = known if known and "file" not in entry else (entry["file"], "160x120", None, [])
    environment = os.path.join("environments", environment) if environment else entry.get("environment")
    options = [str(o) for o in entry.get("options", options)]
    reference = entry.get("reference")
    files = {"scene": file, "environment": environment, "reference": reference}
    found = {}
    for what, path in files.items():
        found[what] = resolve(path, shared, base) if path else None
        if path and not os.path.exists(found[what]):
            print(f"{entry.get('name', file)}: skipped, {found[what]} is absent", file=sys.stderr)
            return None
    if environment:
        options += ["--environment", found["environment"]]
    return View(entry.get("name") or os.path.splitext(os.path.basename(file))[0], found["scene"],
                parse_size(entry.get("size") or size or default), tuple(options), found["reference"])
