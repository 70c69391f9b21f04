"""Collects meshes, materials, textures and nodes, and writes them as .gltf, .bin and .png files."""

import json
import math
import os
import struct

FLOAT, USHORT = 5126, 5123


def _short(x):
    """Six digits after the point: short, and the same whatever the mathematics library."""
    x = round(x, 6)
    return int(x) if x == int(x) else x


def matrix(translate=(0, 0, 0), turn=(0, 0, 0), scale=(1, 1, 1)):
    """Column-major 4x4: scale, then turn about x, then z, then y (degrees), then move."""
    (cx, sx), (cy, sy), (cz, sz) = [
        (math.cos(math.radians(a)), math.sin(math.radians(a))) for a in turn
    ]
    about_x = [[1, 0, 0], [0, cx, -sx], [0, sx, cx]]
    about_y = [[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]
    about_z = [[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]
    m = _times(about_y, _times(about_z, about_x))
    columns = []
    for c in range(3):
        columns += [m[r][c] * scale[c] for r in range(3)] + [0]
    return columns + list(translate) + [1]


def look_at(eye, target):
    """Camera to world: looks along -z, +y up."""
    z = _unit([e - t for e, t in zip(eye, target)])
    x = _unit([z[2], 0, -z[0]])
    y = [z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]]
    return x + [0] + y + [0] + z + [0] + list(eye) + [1]


def _times(a, b):
    return [[sum(a[r][k] * b[k][c] for k in range(3)) for c in range(3)] for r in range(3)]


def _unit(v):
    length = math.sqrt(sum(c * c for c in v))
    return [c / length for c in v]


class Writer:
    def __init__(self, folder, name, unit=1):
        """A length of 1 becomes `unit` in the file."""
        self.folder, self.name, self.unit = folder, name, unit
        os.makedirs(folder, exist_ok=True)
        self.binary = bytearray()
        self.json = {
            "asset": {"version": "2.0", "generator": "scenes/make_scenes.py", "copyright": "CC0"},
            "scene": 0,
            "scenes": [{"nodes": []}],
        }
        self.extensions = set()
        self.shapes = {}  # id of a shape: (shape, attributes, indices)
        self.meshes = {}  # (id of a shape, material): mesh

    def _add(self, kind, item):
        items = self.json.setdefault(kind, [])
        items.append(item)
        return len(items) - 1

    def _accessor(self, values, component_type, kind, target):
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[kind]
        offset = len(self.binary)
        code = {FLOAT: "f", USHORT: "H"}[component_type]
        self.binary += struct.pack("<%d%s" % (len(values), code), *values)
        view = {"buffer": 0, "byteOffset": offset, "byteLength": len(self.binary) - offset}
        self.binary += b"\0" * (-len(self.binary) % 4)
        if target is not None:
            view["target"] = target
        accessor = {
            "bufferView": self._add("bufferViews", view),
            "componentType": component_type,
            "count": len(values) // width,
            "type": kind,
        }
        if component_type == FLOAT and width != 2:
            stored = struct.unpack("<%df" % len(values), struct.pack("<%df" % len(values), *values))
            accessor["min"] = [min(stored[c::width]) for c in range(width)]
            accessor["max"] = [max(stored[c::width]) for c in range(width)]
        return self._add("accessors", accessor)

    def texture(self, file_name, png, clamp=False, nearest=False):
        with open(os.path.join(self.folder, file_name), "wb") as out:
            out.write(png)
        wrap = 33071 if clamp else 10497
        mode = 9728 if nearest else 9729
        sampler = {"magFilter": mode, "minFilter": mode, "wrapS": wrap, "wrapT": wrap}
        samplers = self.json.setdefault("samplers", [])
        if sampler not in samplers:
            samplers.append(sampler)
        image = self._add("images", {"uri": file_name})
        return self._add("textures", {"source": image, "sampler": samplers.index(sampler)})

    def texture_info(self, texture, repeat=None):
        info = {"index": texture}
        if repeat is not None:
            self.extensions.add("KHR_texture_transform")
            info["extensions"] = {"KHR_texture_transform": {"scale": list(repeat)}}
        return info

    def material(self, name, color=(1, 1, 1), metallic=0, roughness=1, color_texture=None,
                 rough_texture=None, normal_texture=None, normal_scale=1, repeat=None,
                 emissive=None, emissive_texture=None, mask=False, double_sided=False, glass_ior=0,
                 pane=False, matte=False, unlit=False):
        """Textures are Writer.texture's; `repeat` scales the uv of roughness and normal."""
        pbr = {
            "baseColorFactor": list(color) + [1],
            "metallicFactor": metallic,
            "roughnessFactor": roughness,
        }
        item = {"name": name, "pbrMetallicRoughness": pbr}
        extensions = {}
        if color_texture is not None:
            pbr["baseColorTexture"] = self.texture_info(color_texture)
        if rough_texture is not None:
            pbr["metallicRoughnessTexture"] = self.texture_info(rough_texture, repeat)
        if normal_texture is not None:
            item["normalTexture"] = self.texture_info(normal_texture, repeat)
            item["normalTexture"]["scale"] = normal_scale
        if emissive is not None:
            strength = max(1, *emissive)
            item["emissiveFactor"] = [_short(e / strength) for e in emissive]
            if strength > 1:
                extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
            if emissive_texture is not None:
                item["emissiveTexture"] = self.texture_info(emissive_texture)
        if glass_ior:  # a closed body of clear glass
            extensions["KHR_materials_transmission"] = {"transmissionFactor": 1}
            extensions["KHR_materials_volume"] = {"thicknessFactor": 0.1}
            extensions["KHR_materials_ior"] = {"ior": glass_ior}
        if pane:  # thin clear glass that reflects nothing
            extensions["KHR_materials_transmission"] = {"transmissionFactor": 1}
            extensions["KHR_materials_ior"] = {"ior": 1}
        if matte:  # without the gloss that every other surface has
            extensions["KHR_materials_specular"] = {"specularFactor": 0}
        if unlit:  # shines with its colour, whatever the light
            extensions["KHR_materials_unlit"] = {}
        if mask:
            item["alphaMode"] = "MASK"
        if double_sided:
            item["doubleSided"] = True
        if extensions:
            item["extensions"] = extensions
            self.extensions.update(extensions)
        return self._add("materials", item)

    def place(self, name, shape, material, at=None, **transform):
        """A node with a shape; a shape is stored once however often it is placed. Returns the node."""
        if id(shape) not in self.shapes:
            if len(shape.positions) > 65535:
                raise ValueError("%s has too many vertices for 16-bit indices" % name)
            attributes = {"POSITION": self._vectors(shape.positions, "VEC3", self.unit)}
            if shape.normals:
                attributes["NORMAL"] = self._vectors(shape.normals, "VEC3")
            if shape.uvs:
                attributes["TEXCOORD_0"] = self._vectors(shape.uvs, "VEC2")
            flat = [i for t in shape.triangles for i in t]
            indices = self._accessor(flat, USHORT, "SCALAR", 34963)
            self.shapes[id(shape)] = (shape, attributes, indices)
        _, attributes, indices = self.shapes[id(shape)]
        key = (id(shape), material)
        if key not in self.meshes:
            primitive = {"attributes": attributes, "indices": indices, "material": material}
            self.meshes[key] = self._add("meshes", {"name": name, "primitives": [primitive]})
        node = {"name": name, "mesh": self.meshes[key]}
        if at is not None and not transform:
            node["translation"] = self._moved(at)
        elif at is not None or transform:
            node["matrix"] = self._matrix(matrix(at or (0, 0, 0), **transform))
        index = self._add("nodes", node)
        self.json["scenes"][0]["nodes"].append(index)
        return index

    def animate(self, node, times, ways):
        """Moves a node, placed with `at` alone: where it is at each of the times, linear between them."""
        sampler = {
            "input": self._accessor([_short(t) for t in times], FLOAT, "SCALAR", None),
            "output": self._accessor([c for w in ways for c in self._moved(w)], FLOAT, "VEC3", None),
        }
        channel = {"sampler": 0, "target": {"node": node, "path": "translation"}}
        self._add("animations", {"samplers": [sampler], "channels": [channel]})

    def _moved(self, at):
        return [_short(c) * self.unit for c in at]

    def _matrix(self, columns):
        return [_short(c) for c in columns[:12]] + self._moved(columns[12:15]) + [1]

    def _vectors(self, vectors, kind, scale=1):
        return self._accessor([_short(c) * scale for v in vectors for c in v], FLOAT, kind, 34962)

    def camera(self, eye, target, yfov_degrees, aspect):
        perspective = {
            "yfov": _short(math.radians(yfov_degrees)), "aspectRatio": aspect, "znear": 0.01 * self.unit
        }
        self._camera({"type": "perspective", "perspective": perspective}, eye, target)

    def orthographic_camera(self, eye, target, half_width, half_height):
        sides = {"xmag": half_width * self.unit, "ymag": half_height * self.unit, "znear": 0, "zfar": 100 * self.unit}
        self._camera({"type": "orthographic", "orthographic": sides}, eye, target)

    def _camera(self, camera, eye, target):
        node = {"name": "camera", "camera": self._add("cameras", camera)}
        node["matrix"] = self._matrix(look_at(eye, target))
        self.json["scenes"][0]["nodes"].append(self._add("nodes", node))

    def save(self):
        if self.extensions:
            self.json["extensionsUsed"] = sorted(self.extensions)
        self.json["buffers"] = [{"uri": self.name + ".bin", "byteLength": len(self.binary)}]
        with open(os.path.join(self.folder, self.name + ".bin"), "wb") as out:
            out.write(self.binary)
        with open(os.path.join(self.folder, self.name + ".gltf"), "w", encoding="utf-8") as out:
            out.write(_pretty(self.json))


def _pretty(document):
    """One line for each mesh, node, accessor, ...: short, and it shows changes well."""
    lines = []
    for key, value in document.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            items = ",\n  ".join(json.dumps(v, separators=(",", ":")) for v in value)
            lines.append('"%s":[\n  %s]' % (key, items))
        else:
            lines.append('"%s":%s' % (key, json.dumps(value, separators=(",", ":"))))
    return "{\n" + ",\n".join(lines) + "\n}\n"
