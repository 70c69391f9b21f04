#include "tests/unit/scene/pbrt_file.h"

namespace relume::test {

Scene LoadPbrtText(const std::string& text, const PbrtFiles& files, bool decode) {
    MapSource source;
    source.files = files;
    source.files["scene.pbrt"] = text;
    return LoadScene(source, "scene.pbrt", {.decode_images = decode});
}

Scene LoadPbrtWorld(const std::string& world, const PbrtFiles& files, bool decode) {
    return LoadPbrtText("Camera \"perspective\"\nWorldBegin\n" + world + kPbrtTriangle, files,
                        decode);
}

double Area(const Mesh& mesh) {
    double area = 0;
    for (const Vec3u& t : mesh.triangles) {
        const Vec3f p = mesh.positions[t.x];
        area += 0.5 * Length(Cross(mesh.positions[t.y] - p, mesh.positions[t.z] - p));
    }
    return area;
}

double Volume(const Mesh& mesh) {
    double volume = 0;
    for (const Vec3u& t : mesh.triangles) {
        volume += Dot(mesh.positions[t.x], Cross(mesh.positions[t.y], mesh.positions[t.z])) / 6.0;
    }
    return volume;
}

std::vector<float> Floats(const Material& material, const std::string& name) {
    return material.params.GetFloats(name, {});
}

std::string Text(const Scene& scene) {
    std::string text;
    for (const std::string& note : scene.notes) {
        text += note + "\n";
    }
    return text;
}

}  // namespace relume::test
