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

    bool operator==(const Texture&) const = default;
};

// type "metallic_roughness" (glTF 2.0), parameters (textures are indices into Scene::textures,
// absent = none):
//   base_color 3 numbers [1 1 1], base_color_texture (alpha in its 4th channel), base_alpha [1]
//   metallic [1], roughness [1], metallic_roughness_texture (G = roughness, B = metallic)
//   normal_texture, normal_scale [1] · emissive 3 numbers [0 0 0] (radiance), emissive_texture
//   alpha_mode "opaque" "mask" "blend" ["opaque"], alpha_cutoff [0.5] · double_sided bool [false]
//   transmission [0], transmission_texture (R), ior [1.5], thin bool [true]: no volume behind the
//   surface · absorption 3 numbers [0 0 0]: per scene unit on the way inside, if not thin
//   specular [1], specular_texture (A), specular_color 3 numbers [1 1 1], specular_color_texture
//   clearcoat [0], clearcoat_texture (R), clearcoat_roughness [0], clearcoat_roughness_texture (G),
//   clearcoat_normal_texture, clearcoat_normal_scale [1]
//   sheen_color 3 numbers [0 0 0], sheen_color_texture, sheen_roughness [0],
//   sheen_roughness_texture (A)
//
// Of every type, beside those named with it:
//   emissive 3 numbers [0 0 0] (radiance), emissive_texture · double_sided bool [false]: it shines
//   from its back too (all types reflect on both sides)
//   normal_texture, normal_scale [1] · bump_texture: displacement along the normal, times
//   bump_scale [1] scene units; only the shading normal follows it
//   alpha [1], alpha_texture: opacity · alpha_mode, alpha_cutoff as above
// A colour or number X that may have a texture is X times what X_texture gives (index; a number
// reads the first channel); "+" marks those that do.
//
// type "diffuse": base_color+, base_color_texture's 4th channel as above · sigma [0]: degrees, the
//   slopes of Oren and Nayar
// type "coated_diffuse": base_color+ (of the diffuse base) under a smooth or rough dielectric
//   interface, with light going to and fro between the two: ior [1.5], alpha_u+, alpha_v+ [0]: GGX
//   alpha along u and v, 0 (below 0.001) is smooth
// type "conductor": eta 3 numbers, k 3 numbers, or reflectance+ 3 numbers instead: straight on,
//   which means eta 1 and k 2 sqrt(r / (1 - r)); fresnel bool [true], false: `reflectance` at every
//   angle · alpha_u+, alpha_v+ [0]
// type "coated_conductor": as "conductor" under an interface: ior [1.5], alpha_u+, alpha_v+ [0] of
//   the interface, conductor_alpha_u+, conductor_alpha_v+ [0] of the metal
// type "dielectric": closed glass: ior [1.5], alpha_u+, alpha_v+ [0] (or roughness [0], whose
// square
//   is both), reflect+ 3 numbers [1 1 1], tint+ 3 numbers [1 1 1] (of what goes through),
//   absorption 3 numbers [0 0 0]: per scene unit on the way inside (its back's side)
// type "thin_dielectric": a pane without thickness: ior [1.5]; straight through, all reflections
//   between its two sides included
// type "diffuse_transmission": base_color+ (reflected), transmittance+ 3 numbers [0 0 0], both
//   Lambertian
// type "mix": material_a, material_b (indices of Scene::materials), amount+ [0.5]: share of b.
//   Emission, alpha, bump and normals are the mix's own
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
    // Deforming: positions at equally spaced times, the first at the shutter's opening (equal to
    // `positions`) and the last at its closing; each as long as `positions`. Empty: it keeps its
    // shape.
    std::vector<std::vector<Vec3f>> motion;
    int material = 0;
    SourceLocation source;
};

struct Instance {
    int mesh = 0;
    Transform to_world;
    // Moving: to_world at equally spaced times, as Mesh::motion; between them matrices are
    // interpolated linearly. Empty: it stands still.
    std::vector<Transform> motion;
};

// Punctual and other delta lights. type "point": intensity 3 numbers (W/sr); "spot": intensity,
// inner_angle, outer_angle (radians, half angles; outer up to pi), falloff "gltf" "smoothstep"
// "quartic" ["gltf"]: between the angles, with t = (cos - cos outer) / (cos inner - cos outer),
// t^2, 3 t^2 - 2 t^3 or t^4; "directional": irradiance 3 numbers (W/m^2); "goniometric": intensity,
// image (index of Scene::images, latitude-longitude as Environment's: scales intensity). They shine
// along local -z. type "sun_disk" and others may come. Area lights are meshes whose material has
// `emissive`.
struct Light {
    std::string name;
    std::string type;
    ParamSet params;
    Transform to_world;
    SourceLocation source;
};

// type "perspective": yfov (radians, full vertical angle), or xfov, or fov_short (full angle along
// the picture's shorter side) if that is set instead; aspect_ratio only advises on the image's
// shape. Local space looks along -z, +x right, +y up; to_world may mirror (pbrt's world is
// left-handed). Lens: lens_radius [0], focus_distance. type "orthographic": xmag, ymag (half
// extents), or mag_short (half extent along the shorter side). Both: screen_window x_min x_max
// y_min y_max [of the image's shape, so that its shorter side is -1 to 1]: what is seen, in units
// of tan(fov_short / 2) at distance 1, or of scene units.
struct Camera {
    std::string name;
    std::string type;
    ParamSet params;
    Transform to_world;
    std::vector<Transform> motion;  // as Instance::motion
    SourceLocation source;
};

// Latitude-longitude map: u = 0.5 + atan2(x, -z) / 2 pi, v = acos(y) / pi (row 0 looks up), in the
// light's local space; to_world turns and may mirror it. image -1: constant `color`.
struct Environment {
    int image = -1;
    Rgb color{1, 1, 1};  // scales the image
    Transform to_world;
};

// How the file itself asks to be rendered; 0 = does not say.
struct RenderHints {
    int width = 0, height = 0;
    int max_depth = 0;  // path segments, as RenderSettings::max_depth
    int spp = 0;
    float animation_seconds = 0;  // the last time at which its animations or transforms change
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
    RenderHints hints;

    Box3f Bounds() const;  // of all instances, world space, while the shutter is open
    std::uint64_t TriangleCount() const;  // instances counted
    // True if anything can shine: environment, lights, or an instance with an emissive material.
    bool HasLight() const;
};

// The camera of this name, or else of this index; the first one for "". Null if the scene has none
// and none is asked for. Throws kInvalidArgument that lists the cameras if there is no such one.
const Camera* FindCamera(const Scene& scene, const std::string& camera);

// A perspective camera (yfov 40 degrees) that sees the whole of `bounds` from slightly above, for
// files without one. `aspect` is width/height.
Camera FitCamera(const Box3f& bounds, const std::string& scene_name, float aspect);

struct LookCamera;  // render_settings.h
Camera MakeLookCamera(const LookCamera& look);

}  // namespace relume
