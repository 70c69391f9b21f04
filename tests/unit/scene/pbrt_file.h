#pragma once

#include <map>
#include <string>
#include <vector>

#include "tests/unit/scene/gltf_file.h"

namespace relume::test {

using PbrtFiles = std::map<std::string, std::string>;  // contents by name

// A scene of pbrt's, "scene.pbrt" with these files beside it, without decoding pictures.
Scene LoadPbrtText(const std::string& text, const PbrtFiles& files = {}, bool decode = false);
// In a world block, after which a triangle follows, so that any text is a scene.
Scene LoadPbrtWorld(const std::string& world, const PbrtFiles& files = {}, bool decode = false);

// A right-angled triangle (0,0,0) (1,0,0) (0,1,0).
inline constexpr const char* kPbrtTriangle =
    "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [0 0 0 1 0 0 0 1 0]\n";

// Sum over a mesh's triangles.
double Area(const Mesh& mesh);
// Of the closed surface; negative if it is inside out.
double Volume(const Mesh& mesh);

std::vector<float> Floats(const Material& material, const std::string& name);
std::string Text(const Scene& scene);  // its notes, a line each

}  // namespace relume::test
