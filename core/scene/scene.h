#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/base/param_set.h"
#include "core/math/box.h"
#include "core/math/transform.h"
#include "core/math/vec.h"

namespace relume {

// A scene as loaders leave it: plain data, world units as in the file, +y up, linear Rec. 709. What
// a material, light or camera *means* is decided by who makes it (worker/render, by `type` and
// ParamSet), so that loaders and renderer learn of each other only through the parameter names
// listed here.

// Where a thing came from, for messages: "Sponza.gltf: material 3 'bricks'".
using SourceLocation = std::string;

struct SceneImage {
    std::string name;  // relative path, or "embedded image 3"
    int width = 0, height = 0;
    int channels = 0;                 // interleaved; row 0 is the top
    std::vector<std::uint8_t> bytes;  // 8-bit files; empty if LoadOptions::decode_images is false
    std::vector<float> floats;        // HDR files, linear
};

enum class WrapMode { kRepeat, kClamp, kMirror };

struct Texture {
    int image = -1;
    bool srgb = false;  // 8-bit values are sRGB-encoded colours (else linear data)
    bool nearest = false;
    WrapMode wrap_u = WrapMode::kRepeat, wrap_v = WrapMode::kRepeat;
    // uv' = (m[0] u + m[1] v + m[2], m[3] u + m[4] v + m[5]); v runs down the image, as in glTF.
    float uv_transform[6] = {1, 0, 0, 0, 1, 0};
};

// type "metallic_roughness" (glTF 2.0), parameters (textures are indices into Scene::textures,
// absent = none):
//   base_color 3 numbers [1 1 1], base_color_texture (alpha in its 4th channel), base_alpha [1]
//   metallic [1], roughness [1], metallic_roughness_texture (G = roughness, B = metallic)
//   normal_texture, normal_scale [1] · emissive 3 numbers [0 0 0] (radiance), emissive_texture
//   alpha_mode "opaque" "mask" "blend" ["opaque"], alpha_cutoff [0.5] · double_sided bool [false]
//   transmission [0], transmission_texture (R), ior [1.5], thin bool [true]: no volume behind the
//   surface
// type "diffuse": base_color, base_color_texture, and the emissive, normal and alpha ones as above
// type "dielectric": ior [1.5], roughness [0], tint 3 numbers [1 1 1]: closed glass
struct Material {
    std::string name;
    std::string type;
    ParamSet params;
    SourceLocation source;
};

struct Mesh {
    std::string name;
    std::vector<Vec3f> positions;
    std::vector<Vec3f> normals;        // empty (flat shading) or one a position, unit length
    std::vector<Vec2f> uvs;            // empty or one a position
    std::vector<Vec3f> tangents;       // empty or one a position, unit length
    std::vector<float> tangent_signs;  // as tangents: bitangent = sign * cross(normal, tangent)
    std::vector<Vec3u> triangles;      // counter-clockwise seen from the front
    int material = 0;
    SourceLocation source;
};

struct Instance {
    int mesh = 0;
    Transform to_world;
};

// Punctual and other delta lights. type "point": intensity 3 numbers (W/sr); "spot": intensity,
// inner_angle, outer_angle (radians, half angles); "directional": irradiance 3 numbers (W/m^2).
// They shine along local -z. type "sun_disk" and others may come. Area lights are meshes whose
// material has `emissive`.
struct Light {
    std::string name;
    std::string type;
    ParamSet params;
    Transform to_world;
    SourceLocation source;
};

// type "perspective": yfov (radians, full vertical angle) or xfov if that is set instead;
// aspect_ratio only advises on the image's shape. Local space looks along -z, +y up. Lens:
// lens_radius [0], focus_distance. type "orthographic": xmag, ymag (half extents).
struct Camera {
    std::string name;
    std::string type;
    ParamSet params;
    Transform to_world;
    SourceLocation source;
};

// Latitude-longitude map: u = 0.5 + atan2(x, -z) / 2 pi, v = acos(y) / pi (row 0 looks up), in the
// light's local space. image -1: constant `color`.
struct Environment {
    int image = -1;
    Rgb color{1, 1, 1};  // scales the image
    Transform to_world;
};

struct Scene {
    std::string name;
    std::vector<SceneImage> images;
    std::vector<Texture> textures;
    std::vector<Material> materials;  // at least one; meshes without one have the format's default
    std::vector<Mesh> meshes;
    std::vector<Instance> instances;
    std::vector<Light> lights;
    std::vector<Camera> cameras;                     // none in the file: empty, see FitCamera
    std::shared_ptr<const Environment> environment;  // null: black
    std::vector<std::string>
        notes;  // what the loader left out or replaced, each once, for the user

    Box3f Bounds() const;                 // of all instances, world space
    std::uint64_t TriangleCount() const;  // instances counted
    // True if anything can shine: environment, lights, or an instance with an emissive material.
    bool HasLight() const;
};

// A perspective camera (yfov 40 degrees) that sees the whole scene from slightly above, for files
// without one. `aspect` is width/height.
Camera FitCamera(const Scene& scene, float aspect);

}  // namespace relume
