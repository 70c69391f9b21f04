#!/usr/bin/env python3
"""Cuts small seeds for the fuzzers: make_seeds.py FOLDER SCENES. FOLDER/KIND/NAME; SCENES "-": this repository's alone.

Scenes are cut to a few KiB, since mutations of long files hardly ever hit anything. See read_input.h for %%FILE.
"""

import base64
import glob
import json
import os
import re
import struct
import subprocess
import sys
import zlib

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SEPARATOR = b"\n%%FILE\n"
LIMIT = 16384


def write(folder, kind, name, data):
    if isinstance(data, str):
        data = data.encode()
    os.makedirs(os.path.join(folder, kind), exist_ok=True)
    with open(os.path.join(folder, kind, name), "wb") as file:
        file.write(data)


def read(path):
    with open(path, "rb") as file:
        return file.read()


# --- pictures -------------------------------------------------------------------------------------

def png(width, height, color, depth, interlace=0):
    channels = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}[color]
    row = b"\0" + bytes((i * 37) % 256 for i in range((width * channels * depth + 7) // 8))
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    palette = chunk(b"PLTE", bytes(range(48))) if color == 3 else b""
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, color, 0, 0, interlace))
            + palette + chunk(b"IDAT", zlib.compress(row * height)) + chunk(b"IEND", b""))


def tga(width, height, bits, kind, descriptor):
    pixels = bytes((i * 11) % 256 for i in range(width * height * bits // 8))
    if kind == 10:
        size = bits // 8
        pixels = b"".join(bytes([width - 1 | 128]) + pixels[:size] for _ in range(height))
    return struct.pack("<BBBHHBHHHHBB", 0, 0, kind, 0, 0, 0, 0, 0, width, height, bits, descriptor) + pixels


def hdr(width, height, runs):
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1\n\n-Y {height} +X {width}\n".encode()
    if not runs:
        return head + b"\x80\x40\x20\x81" * (width * height)
    row = bytes([2, 2, width >> 8, width & 255])
    for channel in range(4):
        row += bytes([128 + width // 2, 100 + channel]) + bytes([width - width // 2]) + bytes(width - width // 2)
    return head + row * height


def pfm(width, height, magic, scale):
    channels = 3 if magic == "PF" else 1
    return f"{magic}\n{width} {height}\n{scale}\n".encode() + b"\0\0\x80\x3f" * (width * height * channels)


def exr(width, height, compression):
    """Scanlines of three float channels, stored as they are or ZIPS-packed."""
    def attribute(name, kind, data):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(data)) + data
    channels = b"".join(c + b"\0" + struct.pack("<IIII", 2, 0, 1, 1) for c in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    head = (struct.pack("<II", 20000630, 2) + attribute("channels", "chlist", channels)
            + attribute("compression", "compression", bytes([compression])) + attribute("dataWindow", "box2i", window)
            + attribute("displayWindow", "box2i", window) + attribute("lineOrder", "lineOrder", b"\0")
            + attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
            + attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0))
            + attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0")
    lines, at = [], len(head) + 8 * height
    offsets = b""
    for y in range(height):
        raw = struct.pack("<f", 0.5) * (3 * width)
        if compression == 2:
            split = raw[0::2] + raw[1::2]
            delta = bytes([split[0]] + [(split[i] - split[i - 1] + 128) % 256 for i in range(1, len(split))])
            packed = zlib.compress(delta)
            raw = packed if len(packed) < len(raw) else raw
        line = struct.pack("<iI", y, len(raw)) + raw
        offsets += struct.pack("<Q", at)
        at += len(line)
        lines.append(line)
    return head + offsets + b"".join(lines)


# A baseline JPEG of 16x8 pixels.
JPEG = base64.b64decode(
    "/9j/4AAQSkZJRgABAQAAAQABAAD/4QAMTmVvR2VvAAAAHv/bAEMAGxIUFxQRGxcWFx4cGyAoQisoJSUoUTo9MEJgVWVkX1VdW2p4mYFqcZBzW12F"
    "tYaQnqOrratngLzJuqbHmairpP/bAEMBHB4eKCMoTisrTqRuXW6kpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSk"
    "pKSkpP/AABEIAAgAEAMBIgACEQEDEQH/xAAfAAABBQEBAQEBAQAAAAAAAAAAAQIDBAUGBwgJCgv/xAC1EAACAQMDAgQDBQUEBAAAAX0BAgMABBEF"
    "EiExQQYTUWEHInEUMoGRoQgjQrHBFVLR8CQzYnKCCQoWFxgZGiUmJygpKjQ1Njc4OTpDREVGR0hJSlNUVVZXWFlaY2RlZmdoaWpzdHV2d3h5eoOE"
    "hYaHiImKkpOUlZaXmJmaoqOkpaanqKmqsrO0tba3uLm6wsPExcbHyMnK0tPU1dbX2Nna4eLj5OXm5+jp6vHy8/T19vf4+fr/xAAfAQADAQEBAQEB"
    "AQEBAAAAAAAAAQIDBAUGBwgJCgv/xAC1EQACAQIEBAMEBwUEBAABAncAAQIDEQQFITEGEkFRB2FxEyIygQgUQpGhscEJIzNS8BVictEKFiQ04SXx"
    "FxgZGiYnKCkqNTY3ODk6Q0RFRkdISUpTVFVWV1hZWmNkZWZnaGlqc3R1dnd4eXqCg4SFhoeIiYqSk5SVlpeYmZqio6Slpqeoqaqys7S1tre4ubrC"
    "w8TFxsfIycrS09TV1tfY2dri4+Tl5ufo6ery8/T19vf4+fr/2gAMAwEAAhEDEQA/AKFt9wf9d/6GoT9wf9c0/nRRSj/X4k/8D8j/2Q==")


def pictures(folder, scenes):
    for color, depth in ((0, 8), (2, 8), (3, 4), (4, 8), (6, 8), (2, 16), (0, 1)):
        write(folder, "image", f"c{color}d{depth}.png", png(5, 4, color, depth))
    write(folder, "image", "interlaced.png", png(9, 9, 2, 8, 1))
    for bits, kind in ((24, 2), (32, 2), (8, 3), (24, 10), (32, 10)):
        write(folder, "image", f"t{kind}b{bits}.tga", tga(5, 4, bits, kind, 0x20))
    write(folder, "image", "flat.hdr", hdr(4, 3, False))
    write(folder, "image", "runs.hdr", hdr(16, 3, True))
    write(folder, "image", "color.pfm", pfm(3, 2, "PF", -1.0))
    write(folder, "image", "grey.pfm", pfm(3, 2, "Pf", 1.0))
    write(folder, "image", "plain.exr", exr(4, 3, 0))
    write(folder, "image", "zips.exr", exr(8, 3, 2))
    write(folder, "image", "small.jpg", JPEG)
    found = glob.glob(os.path.join(ROOT, "scenes", "*", "*.png"))
    for extension in ("png", "jpg", "tga", "hdr", "exr", "pfm"):
        found += sorted(glob.glob(os.path.join(scenes, "*", "**", "*." + extension), recursive=True),
                        key=os.path.getsize)[:4]
    for i, path in enumerate(found):
        write(folder, "image", f"cut{i}-{os.path.basename(path)}", read(path)[:LIMIT])


# --- meshes ---------------------------------------------------------------------------------------

def cut_ply(data):
    """The first vertices, and faces that use them alone."""
    end = data.index(b"end_header\n") + len(b"end_header\n")
    head = data[:end].decode("latin-1")
    if "binary_little_endian" not in head:
        return data[:LIMIT]
    vertex = re.search(r"element vertex (\d+)\n((?:property .*\n)+)", head)
    stride = 4 * vertex.group(2).count("property")
    keep = 12
    faces = b"".join(b"\3" + struct.pack("<3i", i, i + 1, i + 2) for i in range(keep - 2))
    head = re.sub(r"element vertex \d+", f"element vertex {keep}", head)
    head = re.sub(r"element face \d+", f"element face {keep - 2}", head)
    return head.encode("latin-1") + data[end:end + keep * stride] + faces


def meshes(folder, scenes):
    head = ("ply\nformat {}\ncomment seed\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
            "property float nx\nproperty float ny\nproperty float nz\nproperty float u\nproperty float v\n"
            "element face 2\nproperty list uchar int vertex_indices\nproperty int face_indices\nend_header\n")
    rows = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    text = "".join(f"{x} {y} {z} 0 0 1 {x} {y}\n" for x, y, z in rows) + "4 0 1 2 3 7\n3 0 1 2 8\n"
    write(folder, "ply", "ascii.ply", head.format("ascii 1.0") + text)
    for name, order in (("little", "<"), ("big", ">")):
        binary = b"".join(struct.pack(order + "8f", x, y, z, 0, 0, 1, x, y) for x, y, z in rows)
        binary += struct.pack(order + "B4ii", 4, 0, 1, 2, 3, 7) + struct.pack(order + "B3ii", 3, 0, 1, 2, 8)
        write(folder, "ply", name + ".ply", head.format(f"binary_{name}_endian 1.0").encode() + binary)
    for i, path in enumerate(sorted(glob.glob(os.path.join(scenes, "*", "**", "*.ply"), recursive=True),
                                    key=os.path.getsize)[:40:8]):
        write(folder, "ply", f"cut{i}.ply", cut_ply(read(path)))
    write(folder, "obj", "cube.obj", "mtllib a.mtl\no a\ng b\ns 1\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0 1\nvt 0 0\nvt 1 0\n"
          "vt 1 1\nvn 0 0 1\nusemtl m\nf 1/1/1 2/2/1 3/3/1 4//1\nf -4 -3 -2\nf 1/1 2/2 3/3\n\n%%FILE\n"
          "newmtl m\nKd 0.5 0.4 0.3\nKs 0.1 0.1 0.1\nNs 20\nNi 1.5\nd 0.5\nTr 0.5\nillum 2\nKe 1 1 1\nPr 0.5\nPm 1\n"
          "map_Kd -s 2 2 1 -o 0 0 0 a.pfm\nmap_Bump -bm 0.5 b.pfm\nnorm c.pfm\nmap_d d.pfm\n")


# --- scenes ---------------------------------------------------------------------------------------

def floats(*values):
    return struct.pack(f"<{len(values)}f", *values)


def small_gltf():
    positions = floats(0, 0, 0, 1, 0, 0, 0, 1, 0)
    normals, uvs = floats(0, 0, 1) * 3, floats(0, 0, 1, 0, 0, 1)
    indices = struct.pack("<4H", 0, 1, 2, 0)
    times, rotations = floats(0, 1), floats(0, 0, 0, 1, 0, 1, 0, 0)
    buffer, views = b"", []
    for part in (positions, normals, uvs, indices, times, rotations):
        views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(part)})
        buffer += part
    gltf = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 2, 3]}],
        "nodes": [{"mesh": 0, "children": [1], "rotation": [0, 0, 0, 1]},
                  {"mesh": 0, "translation": [1, 0, 0], "scale": [2, 2, 2]},
                  {"camera": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]},
                  {"extensions": {"KHR_lights_punctual": {"light": 0}}}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3,
                                    "material": 0, "mode": 4}]}],
        "materials": [{"name": "m", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0,
                       "baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}}},
                       "normalTexture": {"index": 0, "scale": 0.5}, "alphaMode": "MASK", "alphaCutoff": 0.4,
                       "emissiveFactor": [1, 1, 1], "doubleSided": True,
                       "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1},
                                      "KHR_materials_ior": {"ior": 1.4}, "KHR_materials_volume": {"thicknessFactor": 1}}}],
        "textures": [{"source": 0, "sampler": 0}], "samplers": [{"wrapS": 33071, "magFilter": 9728}],
        "images": [{"uri": "data:image/png;base64," + base64.b64encode(png(2, 2, 6, 8)).decode()}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC2"},
            {"bufferView": 3, "componentType": 5123, "count": 3, "type": "SCALAR"},
            {"bufferView": 4, "componentType": 5126, "count": 2, "type": "SCALAR"},
            {"bufferView": 5, "componentType": 5126, "count": 2, "type": "VEC4"}],
        "animations": [{"samplers": [{"input": 4, "output": 5, "interpolation": "LINEAR"}],
                        "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}]}],
        "bufferViews": views, "buffers": [{"byteLength": len(buffer)}],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 2, "spot": {}}]}},
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_transmission"]}
    return gltf, buffer


def glb(gltf, buffer):
    text = json.dumps(gltf, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    buffer += b"\0" * (-len(buffer) % 4)
    body = struct.pack("<I", len(text)) + b"JSON" + text + struct.pack("<I", len(buffer)) + b"BIN\0" + buffer
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def gltf_scenes(folder, scenes):
    gltf, buffer = small_gltf()
    write(folder, "glb", "small.glb", glb(gltf, buffer))
    sparse = json.loads(json.dumps(gltf))
    sparse["accessors"][0]["sparse"] = {"count": 1, "indices": {"bufferView": 3, "componentType": 5123},
                                        "values": {"bufferView": 0}}
    write(folder, "glb", "sparse.glb", glb(sparse, buffer))
    external = json.loads(json.dumps(gltf))
    external["buffers"][0]["uri"] = "a.bin"
    external["images"][0] = {"uri": "a.pfm"}
    write(folder, "gltf", "external.gltf", json.dumps(external).encode() + SEPARATOR + buffer + SEPARATOR + pfm(1, 1, "PF", -1))
    gltf["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()
    write(folder, "gltf", "embedded.gltf", json.dumps(gltf))
    for path in [os.path.join(ROOT, "scenes", "cornell", "cornell.gltf")] + glob.glob(os.path.join(scenes, "*", "*.gltf")):
        data = read(path)
        if len(data) <= LIMIT:
            write(folder, "gltf", os.path.basename(path), data)


PBRT = """LookAt 0 0 5  0 0 0  0 1 0
Camera "perspective" "float fov" 40 "float lensradius" 0.1 "float focaldistance" 5
Film "rgb" "integer xresolution" [64] "integer yresolution" 32 "string filename" "a.exr"
Sampler "sobol" "integer pixelsamples" 4
Integrator "volpath" "integer maxdepth" [ 5 ]
PixelFilter "triangle" "float xradius" 1
WorldBegin
LightSource "infinite" "rgb L" [0.1 0.2 0.3]
LightSource "point" "blackbody I" 5000 "point3 from" [0 1 2]
LightSource "spot" "float coneangle" 30
MakeNamedMedium "m" "string type" "homogeneous" "rgb sigma_a" [1 2 3] "rgb sigma_s" [0 0 0]
MediumInterface "m" ""
Texture "t" "spectrum" "imagemap" "string filename" "a.pfm" "string wrap" "clamp"
Texture "c" "spectrum" "checkerboard" "float uscale" 2 "rgb tex1" [1 0 0] "texture tex2" "t"
Texture "s" "float" "scale" "float tex" 2 "float scale" .5
MakeNamedMaterial "d" "string type" "diffuse" "texture reflectance" "c"
MakeNamedMaterial "g" "string type" "conductor" "spectrum eta" "metal-Cu-eta" "float roughness" 0.1
AttributeBegin
  NamedMaterial "d"
  AreaLightSource "diffuse" "rgb L" [ 1 1 1 ] "bool twosided" true
  Translate 1 2 3 Rotate 30 0 1 0 Scale 1 -1 1
  Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [0 0 0 1 0 0 1 1 0 0 1 0] "point2 uv" [0 0 1 0 1 1 0 1]
AttributeEnd
ObjectBegin "o"
  Shape "sphere" "float radius" 2 "float zmin" -1 "float phimax" 180
  Shape "plymesh" "string filename" "a.ply"
ObjectEnd
ObjectInstance "o"
ActiveTransform EndTime Translate 0 1 0 ActiveTransform All
Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1]
CoordinateSystem "here" CoordSysTransform "here" ReverseOrientation
Material "coateddiffuse" "rgb reflectance" [.5 .5 .5] "float roughness" .1
Shape "disk" "float innerradius" .5  Shape "cylinder"
Shape "bilinearmesh" "point3 P" [0 0 0 1 0 0 0 1 0 1 1 1]
Shape "loopsubdiv" "integer levels" 2 "integer indices" [0 1 2 0 2 3 0 3 1 1 3 2] "point3 P" [0 0 0 1 0 0 0 1 0 0 0 1]
Shape "curve" "point3 P" [0 0 0 1 0 0 1 1 0 2 1 0] "float width" .1 "string basis" "bspline" "string type" "flat"
Include "b.pbrt"
"""

PBRT_V3 = """Film "image" "integer xresolution" 32 "integer yresolution" 32
Camera "orthographic" "float screenwindow" [-1 1 -1 1]
WorldBegin
Material "matte" "rgb Kd" [1 0 0] "float sigma" 20
Material "uber" "color Ks" [1 1 1] "float opacity" .5
Material "glass" "float index" 1.5
Material "metal" "rgb eta" [1 1 1] "rgb k" [2 2 2] "bool remaproughness" "false"
Material "substrate" "float uroughness" .1 "float vroughness" .2
MakeNamedMaterial "a" "string type" [ "plastic" ] "spectrum Kd" [400 .1 700 .9]
MakeNamedMaterial "b" "string type" "mix" "string namedmaterial1" "a" "string namedmaterial2" "a" "rgb amount" [.1 .2 .3]
NamedMaterial "b"
TransformBegin
Shape "trianglemesh" "integer indices" [0 1 2] "point P" [0 0 0 1 0 0 0 1 0] "normal N" [0 0 1 0 0 1 0 0 1] "float uv" [0 0 1 0 0 1]
TransformEnd
LightSource "distant" "point from" [0 0 1] "point to" [0 0 0] "spectrum L" "a.spd"
LightSource "goniometric" "string mapname" "a.pfm"
WorldEnd
"""


def pbrt_scenes(folder, scenes):
    write(folder, "pbrt", "v4.pbrt", PBRT)
    write(folder, "pbrt", "v3.pbrt", PBRT_V3)
    for path in glob.glob(os.path.join(scenes, "*", "*.pbrt")):
        text = read(path)[:LIMIT // 2]
        name = f"{os.path.basename(os.path.dirname(path))}-{os.path.basename(path)}"
        write(folder, "pbrt", name, text[:text.rfind(b"\n") + 1])


def tza(shapes):
    """Weights of a network, zeros in halves."""
    data, table = bytearray(64), struct.pack("<I", len(shapes))
    for name, shape in shapes.items():
        table += struct.pack("<H", len(name)) + name.encode() + struct.pack(f"<B{len(shape)}I", len(shape), *shape)
        table += (b"oihw" if len(shape) == 4 else b"x") + b"h" + struct.pack("<Q", len(data))
        count = 1
        for size in shape:
            count *= size
        data += bytes(-(-2 * count // 64) * 64)
    data[:12] = struct.pack("<HBBQ", 0x41D7, 2, 0, len(data))
    return bytes(data) + table


# --- messages: see read_messages.h ---------------------------------------------------------------

def encode(kind, text):
    """The bytes of a message of relume.v1, which `text` tells in protobuf's text format."""
    file = "jobs" if kind == "JobSpec" else "types" if kind in ("SceneManifest", "RenderSettings") else "work"
    return subprocess.run(["protoc", f"--proto_path={ROOT}/proto", f"--encode=relume.v1.{kind}",
                           f"relume/v1/{file}.proto"], input=text.encode(), stdout=subprocess.PIPE, check=True).stdout


def messages(folder):
    scene = ('main: "scene.gltf" entries { path: "scene.gltf" size: 5 sha256: "' + "a" * 64 + '" } '
             'entries { path: "maps/b.png" size: 7 sha256: "' + "b" * 64 + '" }')
    settings = ('width: 48 height: 40 seed: 1 max_depth: 5 crop { x1: 9 y1: 9 } camera: "0" lens_radius: 0.1 '
                'look { from { x: 1 } at { y: 2 } up { z: 1 } fov_degrees: 40 }')
    spec = (f'scene {{ {scene} }} settings {{ width: 48 height: 40 }} sampler: "adaptive" filter: "none" spp: 8 '
            'tile_size: 16 max_spp: 64 target: 0.01 owner: "x"')
    rect = "rect { x0: 4 y0: 2 x1: 7 y1: 4 }"
    lease = (f'id: 1 job: "jobs/a" {rect} ' + " ".join(f"first_sample: {i}" for i in range(6)) + " " +
             " ".join(f"sample_count: {i}" for i in (4, 5, 0, 7, 64, 1)) + " epoch: 1 unit: 2")
    planes = "\\000" * 800  # five pixels of 40 floats
    result = f'lease_id: 1 job: "jobs/a" planes: "{planes}" rays: 7 seconds: 0.5 unit: 2'
    for number, (kind, text) in enumerate([("SceneManifest", scene), ("RenderSettings", settings), ("Lease", lease),
                                           ("LeaseResult", result), ("SampleChunk", 'lease_id: 1 data: "x"'),
                                           ("JobSpec", spec)]):
        write(folder, "codec", kind, bytes([number]) + encode(kind, text))
    write(folder, "spec", "spec", encode("JobSpec", spec))
    words = [encode("WorkRequest", text) for text in (
        "report { credits: 3 leases_held: 1 }", 'scene_ready { job: "jobs/a" notes: "x" seconds: 1 }',
        f"result {{ {result} }}", "lease_return { lease_ids: 1 lease_ids: 2 }",
        'problem { job: "jobs/a" message: "x" transient: true }')]
    write(folder, "work", "words", b"".join(struct.pack("<I", len(word)) + word for word in words))


def main():
    folder, scenes = sys.argv[1], sys.argv[2]
    scenes = os.devnull if scenes == "-" else scenes
    pictures(folder, scenes)
    meshes(folder, scenes)
    gltf_scenes(folder, scenes)
    pbrt_scenes(folder, scenes)
    messages(folder)
    write(folder, "tza", "weights", tza({"a.weight": (2, 1, 3, 3), "a.bias": (2,)}))
    write(folder, "texts", "paths", "scene.gltf\ntextures/a%20b.png\n../x\na/./b/../c\n/x\nhttp://a/b\nC:\\x\n"
          "data:image/png;base64,iVBORw0KGgo=\ndata:,a%20b\nfile:///x\n")


if __name__ == "__main__":
    main()
