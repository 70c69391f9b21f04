"""The scenes of bench/stability: what breaks methods, each small. Files are those of scenes/ (make_scenes.py)."""
import dataclasses
import os

from chart.scenes import OWN, View, parse_size


@dataclasses.dataclass(frozen=True)
class Scene:
    file: str
    why: str
    size: str = "64x64"
    spp: int = 8
    environment: str = None
    options: tuple = ()
    hard: float = 1  # times the samples of a reference
    most_seeds: int = 1000  # where filters are slow
    same_as: str = None  # the scene whose reference is this one's, too
    refused: str = None  # to be told in these words, in place of an image
    known: str = None  # bar that `default` does not keep: "energy" or "error"; why is said in docs/stability.md

    def view(self):
        options = self.options
        if self.environment:
            options += ("--environment", os.path.join(OWN, self.environment))
        return View(self.file, os.path.join(OWN, self.file), parse_size(self.size), options)


LIGHTS, FINE, BROKEN, UNITS = "failure/lights/", "failure/fine/", "failure/broken/", "failure/units/"
CORNELL = "cornell/cornell.gltf"
SCENES = {
    "caustic": Scene("failure/caustic/caustic.gltf", "fireflies through glass and off brass", hard=4),
    "tiny_light": Scene(LIGHTS + "tiny_light.gltf", "a lamp of 1e-4 of the room, seen in brass", hard=2),
    "rare_light": Scene("rare_light/rare_light_005.gltf", "a lamp that one path in 200 finds", size="48x48"),
    "keyhole": Scene(LIGHTS + "keyhole.gltf", "light through a hole, from the next room", hard=4),
    "dynamic_range": Scene(LIGHTS + "dynamic_range.gltf", "a room of .01 and a window of 10,000", hard=2),
    "bulbs": Scene(LIGHTS + "bulbs.gltf", "bulbs of a tenth of a pixel to one, seen", hard=4),
    "black_lit": Scene(LIGHTS + "black_lit.gltf", "a lamp whose light does not get out of its box"),
    "black_unlit": Scene(LIGHTS + "black_unlit.gltf", "nothing shines", options=("--allow-black",)),
    "furnace": Scene(LIGHTS + "furnace.gltf", "all is 1", environment=LIGHTS + "white.hdr", options=("--max-depth", "64")),
    "wires": Scene(FINE + "wires.gltf", "wires of a tenth of a pixel"),
    "grass": Scene(FINE + "grass.gltf", "blades of less than a pixel", size="80x60", environment=LIGHTS + "sky.hdr"),
    "cutouts": Scene(FINE + "cutouts.gltf", "sheets full of small holes"),
    "motion_defocus": Scene(FINE + "motion_defocus.gltf", "fine checks that lens and motion smear",
                            options=("--lens-radius", "0.12", "--focus-distance", "3.4", "--time", "0", "--shutter", "0.5")),
    "defocused_checker": Scene(FINE + "defocused_checker.gltf", "features that are all noise, of a smooth picture",
                               options=("--lens-radius", "0.3", "--focus-distance", "2.4")),
    "unit": Scene(UNITS + "unit.gltf", "a room of 2 m"),
    "unit_huge": Scene(UNITS + "unit_huge.gltf", "the same, of 2,000 km", same_as="unit"),
    "unit_tiny": Scene(UNITS + "unit_tiny.gltf", "the same, of 20 um", same_as="unit"),
    "degenerate": Scene(BROKEN + "degenerate.gltf", "triangles without an area, or twice the same, normals of 0"),
    "faulty_sky": Scene(BROKEN + "faulty_sky.gltf", "a map with NaN, -inf and negative texels", size="80x60",
                        environment=BROKEN + "faulty_sky.exr"),
    "infinite_sky": Scene(BROKEN + "faulty_sky.gltf", "a map with an infinite texel", size="80x60",
                          environment=BROKEN + "infinite_sky.exr"),
    "one_pixel": Scene(CORNELL, "an image of 1x1, of a piece of wall", size="1x1", hard=64, options=(
        "--look-from", "0.278,0.27,0.8", "--look-at", "0.278,0.35,-0.5", "--fov", "6")),
    "column": Scene(CORNELL, "an image of 1x4000", size="1x4000", most_seeds=2),
    "row": Scene(UNITS + "line.gltf", "an image of 4000x1", size="4000x1"),
    "spp_1": Scene(CORNELL, "1 sample a pixel", spp=1),
    "spp_2": Scene(CORNELL, "2 samples a pixel", spp=2),
    "spp_128": Scene(CORNELL, "128 samples a pixel: hardly any noise", spp=128, hard=0.25),
    "nan_position": Scene(BROKEN + "nan_position.gltf", "a vertex that is no number", refused="vertex 5 is not finite"),
    "infinite_position": Scene(BROKEN + "infinite_position.gltf", "a vertex at infinity", refused="vertex 5 is not finite"),
    "nan_normal": Scene(BROKEN + "nan_normal.gltf", "a normal that is no number", refused="normal of vertex 5 is not finite"),
}
