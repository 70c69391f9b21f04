"""Collects meshes, materials, textures and lights of one scene and writes them as PBRT (version 4),
PLY, PNG and HDR files in one folder."""

import os

import numpy as np

import meshes
import pictures


class Texture(str):
    """The name of a texture, as a value of a parameter."""


def _numbers(values):
    return " ".join("%.6g" % v for v in np.ravel(values))


def _parameters(values):
    parts = []
    for name, value in values.items():
        if isinstance(value, Texture):
            parts.append('"texture %s" "%s"' % (name, value))
        elif isinstance(value, bool):
            parts.append('"bool %s" %s' % (name, str(value).lower()))
        elif isinstance(value, str):
            kind = "spectrum" if name in ("eta", "k") else "string"
            parts.append('"%s %s" "%s"' % (kind, name, value))
        elif np.ndim(value):
            parts.append('"rgb %s" [%s]' % (name, _numbers(value)))
        else:
            parts.append('"float %s" %s' % (name, _numbers(value)))
    return " ".join(parts)


class Scene:
    def __init__(self, folder):
        self.folder = folder
        os.makedirs(folder, exist_ok=True)
        self.lines = []
        self.count = 0
        self.view = None
        self.max_depth = 6

    def _file(self, kind):
        self.count += 1
        return "%03d.%s" % (self.count, kind)

    def _name(self, kind):
        self.count += 1
        return "%s %d" % (kind, self.count)

    def _texture(self, kind, picture, repeat, linear):
        file_name, name = self._file("png"), self._name("texture")
        pictures.write_png(picture, os.path.join(self.folder, file_name))
        values = {"filename": file_name, "uscale": repeat[0], "vscale": repeat[1]}
        if linear:
            values["encoding"] = "linear"
        self.lines.append('Texture "%s" "%s" "imagemap" %s' % (name, kind, _parameters(values)))
        return Texture(name)

    def color(self, picture, repeat=(1, 1)):
        return self._texture("spectrum", picture, repeat, False)

    def numbers(self, picture, repeat=(1, 1), times=1):
        name = self._texture("float", picture, repeat, True)
        if times == 1:
            return name
        scaled = Texture(self._name("texture"))
        self.lines.append('Texture "%s" "float" "scale" "texture tex" "%s" "float scale" %g'
                          % (scaled, name, times))
        return scaled

    def material(self, kind, **values):
        name = self._name(kind)
        self.lines.append('MakeNamedMaterial "%s" "string type" "%s" %s' % (name, kind, _parameters(values)))
        return name

    def mix(self, first, second, amount):
        name = self._name("mix")
        self.lines.append('MakeNamedMaterial "%s" "string type" "mix" "string materials" ["%s" "%s"] %s'
                          % (name, first, second, _parameters({"amount": amount})))
        return name

    def add(self, mesh, material, light=None, light_picture=None, two_sided=False, alpha=None, move=None,
            turn=0, absorption=None):
        """light: radiance. move: the way that it goes, turn: degrees about z, while the shutter is open."""
        file_name = self._file("ply")
        meshes.write_ply(mesh, os.path.join(self.folder, file_name))
        out = ["AttributeBegin"]
        if absorption is not None:
            medium = self._name("medium")
            out.append('MakeNamedMedium "%s" "string type" "homogeneous" %s' % (
                medium, _parameters({"sigma_a": absorption, "sigma_s": (0, 0, 0)})))
            out.append('MediumInterface "%s" ""' % medium)
        if move is not None or turn:
            middle = (mesh.p.min(0) + mesh.p.max(0)) / 2
            out += ["ActiveTransform EndTime", "Translate " + _numbers(middle + np.asarray(move or (0, 0, 0))),
                    "Rotate %g 0 0 1" % turn, "Translate " + _numbers(-middle), "ActiveTransform All"]
        out.append('NamedMaterial "%s"' % material)
        if light is not None:
            values = {"L": light, "twosided": two_sided}
            if light_picture is not None:
                values = {"filename": self._file("png"), "twosided": two_sided}
                pictures.write_png(light_picture, os.path.join(self.folder, values["filename"]))
                values["scale"] = np.mean(light)
            out.append('AreaLightSource "diffuse" ' + _parameters(values))
        shape = {"filename": file_name}
        if alpha is not None:
            shape["alpha"] = alpha
        out += ['Shape "plymesh" ' + _parameters(shape), "AttributeEnd"]
        self.lines += out

    def point(self, at, intensity):
        self.lines.append('LightSource "point" "point3 from" [%s] %s' % (
            _numbers(at), _parameters({"I": intensity})))

    def spot(self, at, to, intensity, angle=30, soft=10):
        self.lines.append('LightSource "spot" "point3 from" [%s] "point3 to" [%s] %s' % (
            _numbers(at), _numbers(to), _parameters(
                {"I": intensity, "coneangle": angle, "conedeltaangle": min(soft, angle)})))

    def distant(self, way, irradiance):
        self.lines.append('LightSource "distant" "point3 from" [0 0 0] "point3 to" [%s] %s' % (
            _numbers(way), _parameters({"L": irradiance})))

    def environment(self, picture, times=1.0):
        file_name = self._file("hdr")
        pictures.write_hdr(np.asarray(picture) * times, os.path.join(self.folder, file_name))
        self.lines.append('LightSource "infinite" "string filename" "%s"' % file_name)

    def glow(self, radiance):
        self.lines.append('LightSource "infinite" ' + _parameters({"L": radiance}))

    def camera(self, eye, target, fov, lens=0.0, focus=None):
        """fov: degrees of the picture's shorter side."""
        eye, target = np.asarray(eye, float), np.asarray(target, float)
        focus = np.linalg.norm(target - eye) if focus is None else focus
        self.view = (eye, target, fov, lens, focus)

    def write(self, exposure=1.0):
        """All light times exposure. Returns the file to render."""
        eye, target, fov, lens, focus = self.view
        up = (0, 0, 1) if abs(meshes.unit(target - eye)[2]) < 0.98 else (0, 1, 0)
        head = [
            "LookAt " + "  ".join(_numbers(v) for v in (eye, target, up)),
            'Camera "perspective" "float fov" %g "float lensradius" %g "float focaldistance" %g'
            % (fov, lens, focus),
            'Film "rgb" "integer xresolution" 160 "integer yresolution" 160',
            'Integrator "path" "integer maxdepth" %d' % self.max_depth,
            "WorldBegin",
        ]
        lines = self.lines
        if exposure != 1:
            lines = [_brighter(line, exposure) for line in lines]
        path = os.path.join(self.folder, "scene.pbrt")
        with open(path, "w") as out:
            out.write("\n".join(head + lines) + "\n")
        return path


def _brighter(line, exposure):
    if not line.startswith(("LightSource", "AreaLightSource")):
        return line
    if '"float scale"' in line:
        before, value = line.split('"float scale" ')
        number, _, after = value.partition(" ")
        return '%s"float scale" %g %s' % (before, float(number) * exposure, after)
    return line + ' "float scale" %g' % exposure
