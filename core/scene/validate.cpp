#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/scene/formats.h"

namespace relume {
namespace {

[[noreturn]] void Fail(const SourceLocation& place, const std::string& problem) {
    ThrowInvalidArgument(fmt::format("{}: {}", place, problem));
}

void CheckIndex(int index, std::size_t size, const SourceLocation& place, const char* what) {
    if (index < 0 || static_cast<std::size_t>(index) >= size) {
        Fail(place, fmt::format("{} {} does not exist (there are {}); export the scene again", what,
                                index, size));
    }
}

// Undecoded pictures (LoadOptions::decode_images) have a size and no pixels.
void CheckImage(const SceneImage& image, bool decoded) {
    const auto pixels = static_cast<std::size_t>(image.width) *
                        static_cast<std::size_t>(image.height) *
                        static_cast<std::size_t>(image.channels);
    if (image.width < 1 || image.height < 1) {
        Fail(image.name,
             fmt::format("the picture has {}x{} pixels; replace it", image.width, image.height));
    }
    if (decoded && image.bytes.size() != pixels && image.floats.size() != pixels) {
        Fail(image.name, "the picture's pixels do not fit its size; replace it");
    }
}

void CheckTransform(const Transform& transform, const SourceLocation& place) {
    const float determinant = transform.Determinant();
    if (!transform.IsFinite() || !std::isfinite(determinant)) {
        Fail(place, "its transform is not finite; correct its node");
    }
    if (determinant == 0) {
        Fail(place, "its transform is singular (a scale of 0); correct its node");
    }
}

void CheckMotion(const std::vector<Transform>& motion, const SourceLocation& place) {
    if (motion.size() == 1) {
        Fail(place, "its motion has one key; it needs two or more, or none");
    }
    for (const Transform& transform : motion) {
        CheckTransform(transform, place);
    }
}

template <class T>
void CheckAttribute(const std::vector<T>& values, const Mesh& mesh, const char* what) {
    if (!values.empty() && values.size() != mesh.positions.size()) {
        Fail(mesh.source, fmt::format("{} {} for {} vertices; export the scene again",
                                      values.size(), what, mesh.positions.size()));
    }
}

void CheckMesh(const Mesh& mesh, std::size_t material_count) {
    CheckIndex(mesh.material, material_count, mesh.source, "material");
    if (mesh.triangles.empty()) {
        Fail(mesh.source, "the mesh is empty (no triangle with an area); remove or repair it");
    }
    CheckAttribute(mesh.normals, mesh, "normals");
    CheckAttribute(mesh.uvs, mesh, "texture coordinates");
    CheckAttribute(mesh.tangents, mesh, "tangents");
    if (mesh.tangents.size() != mesh.tangent_signs.size()) {
        Fail(mesh.source, "tangents and their signs differ in number; export the scene again");
    }
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        if (!IsFinite(mesh.positions[i])) {
            Fail(mesh.source,
                 fmt::format("vertex {} is not finite (NaN or infinity); repair the mesh", i));
        }
    }
    for (const std::vector<Vec3f>& key : mesh.motion) {
        if (mesh.motion.size() < 2 || key.size() != mesh.positions.size()) {
            Fail(mesh.source, fmt::format("its motion has {} keys, one of {} positions for {} "
                                          "vertices; export the scene again",
                                          mesh.motion.size(), key.size(), mesh.positions.size()));
        }
        if (!std::all_of(key.begin(), key.end(), [](Vec3f p) { return IsFinite(p); })) {
            Fail(mesh.source, "a moving vertex is not finite (NaN or infinity); repair the mesh");
        }
    }
    for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
        if (!IsFinite(mesh.normals[i])) {
            Fail(mesh.source,
                 fmt::format("the normal of vertex {} is not finite; repair the mesh", i));
        }
    }
    for (std::size_t i = 0; i < mesh.uvs.size(); ++i) {
        if (!std::isfinite(mesh.uvs[i].x) || !std::isfinite(mesh.uvs[i].y)) {
            Fail(mesh.source,
                 fmt::format("the texture coordinate of vertex {} is not finite; repair the mesh",
                             i));
        }
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const Vec3u& t = mesh.triangles[i];
        const std::uint32_t largest = std::max(t.x, std::max(t.y, t.z));
        if (largest >= mesh.positions.size()) {
            Fail(mesh.source,
                 fmt::format("triangle {} refers to vertex {} of {}; export the scene again", i,
                             largest, mesh.positions.size()));
        }
    }
}

void CheckMaterial(const Material& material, std::size_t texture_count) {
    for (const auto& [name, value] : material.params.values()) {
        const auto* numbers = std::get_if<std::vector<float>>(&value);
        if (numbers == nullptr) {
            continue;
        }
        for (const float number : *numbers) {
            if (!std::isfinite(number)) {
                Fail(material.source, fmt::format("{} is not finite; correct the material", name));
            }
        }
        constexpr std::string_view kSuffix = "_texture";
        if (name.size() > kSuffix.size() && name.substr(name.size() - kSuffix.size()) == kSuffix &&
            numbers->size() == 1) {
            CheckIndex(static_cast<int>(numbers->front()), texture_count, material.source,
                       name.c_str());
        }
    }
}

}  // namespace

void ValidateScene(const Scene& scene) {
    // What needs a walk over all vertices goes in parallel; the first mesh with a problem is the
    // one told.
    std::vector<std::string> problems(scene.meshes.size());
    ParallelFor(0, scene.meshes.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            try {
                CheckMesh(scene.meshes[i], scene.materials.size());
            } catch (const Error& error) {
                problems[i] = error.what();
            }
        }
    });
    for (const std::string& problem : problems) {
        if (!problem.empty()) {
            ThrowInvalidArgument(problem);
        }
    }
    if (scene.materials.empty()) {
        Fail(scene.name, "the scene has no material; add one");
    }
    for (const Material& material : scene.materials) {
        CheckMaterial(material, scene.textures.size());
    }
    for (const Texture& texture : scene.textures) {
        CheckIndex(texture.image, scene.images.size(), scene.name, "image");
    }
    for (const SceneImage& image : scene.images) {
        CheckImage(image, !image.bytes.empty() || !image.floats.empty());
    }
    for (const Instance& instance : scene.instances) {
        CheckIndex(instance.mesh, scene.meshes.size(), scene.name, "mesh");
        CheckTransform(instance.to_world,
                       scene.meshes[static_cast<std::size_t>(instance.mesh)].source);
        CheckMotion(instance.motion, scene.meshes[static_cast<std::size_t>(instance.mesh)].source);
    }
    for (const Light& light : scene.lights) {
        CheckTransform(light.to_world, light.source);
    }
    for (const Camera& camera : scene.cameras) {
        CheckTransform(camera.to_world, camera.source);
        CheckMotion(camera.motion, camera.source);
    }
    if (scene.environment != nullptr && scene.environment->image != -1) {
        CheckIndex(scene.environment->image, scene.images.size(), scene.name, "environment image");
    }
    if (scene.TriangleCount() == 0) {
        Fail(scene.name, "the scene has no triangles; nothing could be seen");
    }
    // Vertices are finite, and so are transforms, yet their product may overflow.
    const Box3f bounds = scene.Bounds();
    if (!IsFinite(bounds.lower) || !IsFinite(bounds.upper) || !std::isfinite(bounds.radius())) {
        Fail(scene.name, "the scene is too large for single precision; scale it down");
    }
}

}  // namespace relume
