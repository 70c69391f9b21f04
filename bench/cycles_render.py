"""Runs inside Blender: renders a glTF file with Cycles as bench/peers asks. One JSON line on stdout, after "RESULT ".

blender --background --factory-startup --python-exit-code 1 --python bench/cycles_render.py -- REQUEST.json
REQUEST.json: scene, environment, scale (of its radiance), output (.exr), width, height, spp, segments, threads,
seed, repeats.
"""

import json
import math
import os
import resource
import sys
import time

import bpy
import numpy

# Blender 3.4's importer says numpy.bool, which Debian's numpy has no more.
if "bool" not in numpy.__dict__:
    numpy.bool = bool


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def set_environment(scene, path, scale):
    """The map as glTF's users (and Relume) turn it: the middle column lies at glTF's -z, Blender's +y.

    Blender's own zero is +x, a quarter turn away.
    """
    world = bpy.data.worlds.new("environment")
    scene.world = world
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    nodes.clear()
    coordinates = nodes.new("ShaderNodeTexCoord")
    mapping = nodes.new("ShaderNodeMapping")
    mapping.vector_type = "POINT"
    mapping.inputs["Rotation"].default_value = (0, 0, -math.pi / 2)
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image = bpy.data.images.load(path)
    background = nodes.new("ShaderNodeBackground")
    background.inputs["Strength"].default_value = scale
    output = nodes.new("ShaderNodeOutputWorld")
    links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], background.inputs["Color"])
    links.new(background.outputs["Background"], output.inputs["Surface"])
    # The whole map is searched for bright texels, as Relume does.
    world.cycles.sampling_method = "MANUAL"
    world.cycles.sample_map_resolution = texture.image.size[0]


def set_cycles(scene, request):
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = request["width"], request["height"]
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", request["threads"]
    render.use_persistent_data = True  # what is built for the first render serves the next ones
    render.film_transparent = False
    render.use_motion_blur = False
    render.use_compositing = render.use_sequencer = False
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.image_settings.exr_codec = "ZIP"
    cycles.device = "CPU"
    cycles.samples = request["spp"]
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.time_limit = 0
    cycles.seed = request["seed"]
    cycles.pixel_filter_type = "BOX"  # the own pixel, as Relume's
    # Cycles counts what follows the first scattering: a light at the end of `segments` path segments
    # is seen after segments - 1 scatterings, which are segments - 2 bounces there.
    bounces = max(request["segments"] - 2, 0)
    cycles.max_bounces = bounces
    cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = bounces
    cycles.volume_bounces = 0
    cycles.transparent_max_bounces = 256  # cutouts, which are no bounces with Relume
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.blur_glossy = 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.light_sampling_threshold = 0
    cycles.use_fast_gi = False
    if hasattr(cycles, "use_auto_tile"):
        cycles.use_auto_tile = False


def main():
    with open(sys.argv[sys.argv.index("--") + 1], encoding="utf-8") as file:
        request = json.load(file)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=request["scene"])
    scene = bpy.context.scene
    scene.camera = next(o for o in scene.objects if o.type == "CAMERA")
    for light in [o for o in scene.objects if o.type == "LIGHT"]:
        print("light of the file:", light.name)
    set_environment(scene, request["environment"], request["scale"])
    set_cycles(scene, request)

    # The first render builds everything.
    scene.cycles.samples = 1
    bpy.ops.render.render()
    scene.cycles.samples = request["spp"]
    times = []
    for repeat in range(request["repeats"]):
        scene.cycles.seed = request["seed"] + repeat
        scene.update_tag()  # else what persists has the settings of the first render
        wall, cpu = time.perf_counter(), cpu_seconds()
        bpy.ops.render.render()
        times.append({"wall": time.perf_counter() - wall, "cpu": cpu_seconds() - cpu})
    if request["output"]:
        bpy.data.images["Render Result"].save_render(os.path.abspath(request["output"]))
    print("RESULT " + json.dumps({"version": bpy.app.version_string, "times": times}))


main()
