#include "worker/render/accel/accel.h"

#include <fmt/format.h>
#include <immintrin.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <span>

#include "core/base/parallel.h"
#include "worker/render/accel/device.h"
#include "worker/render/accel/geometry.h"
#include "worker/render/floating_point_mode.h"

namespace relume::render {
namespace {

// Below this many triangles, copies of instanced meshes cost less memory than textures do, and one
// level of structure is faster than two.
constexpr std::uint64_t kFlattenTriangles = 2'000'000;

constexpr float kSmallest = std::numeric_limits<float>::min();

// Unit length, of any length that floats have; 0 stays 0.
Vec3f UnitNormal(Vec3f n) {
    constexpr float kSafe = 1e-30f;  // squares beyond these lose bits, or overflow
    float length2 = Length2(n);
    if (!(length2 > kSafe && length2 < 1 / kSafe)) {
        n = n / std::max(MaxComponent(Max(n, -n)), kSmallest);
        length2 = Length2(n);
        if (!(length2 > 0)) {
            return {};
        }
    }
    return n * (1 / std::sqrt(length2));
}

bool NeedsTriangleData(const Mesh& mesh, const CompiledMaterial& material) {
    return !mesh.normals.empty() || (!mesh.uvs.empty() && material.NeedsUv());
}

// Whether shading wants the triangles of each key of the motion.
bool KeepsDataOfKeys(const Mesh& mesh, const CompiledMaterial& material) {
    return !mesh.motion.empty() && NeedsTriangleData(mesh, material) &&
           (!mesh.normals.empty() || material.needs_tangents);
}

// One level of structure rather than two? Of what moves, its vertices at each key in the one level
// were 5 to 9 % slower to trace than a moving transform (a wheel that fills the picture, 3 to 33
// keys; no difference at 2), and take more memory.
bool Flatten(const Instance& instance, bool only_use, bool flatten_all) {
    return instance.motion.empty() && (flatten_all || only_use);
}

float LargestScale(std::span<const Transform> keys) {
    float scale = 0;
    for (const Transform& key : keys) {
        Object object;
        object.SetTransform(key);
        scale = std::max(scale, object.scale);
    }
    return scale;
}

float LargestCoordinate(const Box3f& box) {
    float m = 0;
    for (int c = 0; c < 3; ++c) {
        m = std::max({m, std::abs(box.lower[c]), std::abs(box.upper[c])});
    }
    return m;
}

}  // namespace

struct Accel::Embree {
    Device device;
    RTCScene scene = nullptr;
    std::vector<RTCScene> mesh_scenes;  // by mesh; null where flattened
    std::vector<FilterMesh> filters;    // by mesh
    std::uint64_t flat_triangles = 0, shared_triangles = 0;

    ~Embree() {
        if (scene != nullptr) {
            rtcReleaseScene(scene);
        }
        for (RTCScene s : mesh_scenes) {
            if (s != nullptr) {
                rtcReleaseScene(s);
            }
        }
    }

    // Watertight: else about one ray in 300 000 slips between two triangles of a fine mesh, and
    // brings the sky into a closed room. Costs a seventh of the traversal.
    RTCScene NewScene() const {
        const RTCScene made = rtcNewScene(device.get());
        rtcSetSceneFlags(made, RTC_SCENE_FLAG_ROBUST);
        return made;
    }
};

Accel::Accel(const Scene& scene, const std::vector<CompiledMaterial>& materials,
             const TextureSet& textures)
    : triangles_(scene.meshes.size()),
      gradients_(scene.meshes.size()),
      embree_(std::make_unique<Embree>()) {
    std::vector<int> uses(scene.meshes.size(), 0);
    for (const Instance& instance : scene.instances) {
        ++uses[static_cast<std::size_t>(instance.mesh)];
    }
    ParallelFor(0, scene.meshes.size(), 1, [&](std::size_t begin, std::size_t end) {
        const FloatingPointMode mode;
        for (std::size_t i = begin; i < end; ++i) {
            const Mesh& mesh = scene.meshes[i];
            const CompiledMaterial& material = materials[static_cast<std::size_t>(mesh.material)];
            if (uses[i] > 0 && NeedsTriangleData(mesh, material)) {
                triangles_[i] = KeepsDataOfKeys(mesh, material)
                                    ? GatherMovingTriangles(mesh, material.needs_tangents)
                                    : GatherTriangles(mesh, material.needs_tangents);
            }
            if (uses[i] > 0 && material.bump_texture >= 0 && !mesh.uvs.empty()) {
                gradients_[i] = GatherUvGradients(mesh);
            }
        }
    });
    Embree& embree = *embree_;
    embree.mesh_scenes.resize(scene.meshes.size(), nullptr);
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
        const TriangleData* data = triangles_[i].empty() ? nullptr : triangles_[i].data();
        embree.filters.push_back({scene.meshes[i].uvs.empty() ? nullptr : data,
                                  &materials[static_cast<std::size_t>(scene.meshes[i].material)],
                                  &textures});
    }

    embree.device.Build([&] {
        const bool flatten_all = scene.TriangleCount() <= kFlattenTriangles;
        embree.scene = embree.NewScene();
        std::vector<Box3f> bounds(scene.meshes.size());
        for (std::size_t i = 0; i < scene.instances.size(); ++i) {
            const Instance& instance = scene.instances[i];
            const std::size_t mesh_index = static_cast<std::size_t>(instance.mesh);
            const Mesh& mesh = scene.meshes[mesh_index];
            Object object;
            object.triangles =
                triangles_[mesh_index].empty() ? nullptr : triangles_[mesh_index].data();
            object.gradients =
                gradients_[mesh_index].empty() ? nullptr : gradients_[mesh_index].data();
            object.material = static_cast<std::uint32_t>(mesh.material);
            object.has_normals = !mesh.normals.empty();
            std::span<const Transform> keys(&instance.to_world, 1);
            if (!instance.motion.empty()) {
                keys = instance.motion;
            }
            object.SetTransform(keys.front());
            if (keys.size() > 1 || !mesh.motion.empty()) {
                const bool data =
                    KeepsDataOfKeys(mesh, materials[static_cast<std::size_t>(mesh.material)]);
                motions_.push_back(
                    {instance.motion, data ? mesh.motion.size() : 0, mesh.triangles.size()});
                object.motion = &motions_.back();
            }
            const float scale = LargestScale(keys);
            RTCGeometry geometry;
            if (Flatten(instance, uses[mesh_index] == 1, flatten_all)) {
                geometry = MakeTriangles(embree.device.get(), mesh, instance.to_world,
                                         embree.filters[mesh_index]);
                embree.flat_triangles += mesh.triangles.size();
            } else {
                RTCScene& shared = embree.mesh_scenes[mesh_index];
                if (shared == nullptr) {
                    shared = embree.NewScene();
                    const RTCGeometry part = MakeTriangles(embree.device.get(), mesh, Transform(),
                                                           embree.filters[mesh_index]);
                    rtcAttachGeometry(shared, part);
                    rtcReleaseGeometry(part);
                    rtcCommitScene(shared);
                    embree.shared_triangles += mesh.triangles.size();
                    for (const Vec3f p : mesh.positions) {
                        bounds[mesh_index].Add(p);
                    }
                    for (const std::vector<Vec3f>& positions : mesh.motion) {
                        for (const Vec3f p : positions) {
                            bounds[mesh_index].Add(p);
                        }
                    }
                }
                geometry = MakeInstance(embree.device.get(), shared, keys);
                object.nested = true;
                object.extent = scale * LargestCoordinate(bounds[mesh_index]);
            }
            // Where each triangle's size is not kept, or not of all times.
            if (object.triangles == nullptr || !mesh.motion.empty()) {
                float largest = 0;
                for (const Vec3u t : mesh.triangles) {
                    largest = std::max(largest, LargestEdge(mesh, t));
                }
                object.extent = std::max(object.extent, scale * largest);
            }
            rtcAttachGeometryByID(embree.scene, geometry, static_cast<unsigned>(i));
            rtcReleaseGeometry(geometry);
            objects_.push_back(object);
        }
        rtcCommitScene(embree.scene);
    });
}

Accel::~Accel() = default;

bool Accel::Intersect(const Ray& ray, Hit* hit) const {
    RayContext context;
    InitContext(&context, ray.seed);
    RTCRayHit r;
    r.ray.org_x = ray.origin.x;
    r.ray.org_y = ray.origin.y;
    r.ray.org_z = ray.origin.z;
    r.ray.tnear = 0;
    r.ray.dir_x = ray.direction.x;
    r.ray.dir_y = ray.direction.y;
    r.ray.dir_z = ray.direction.z;
    r.ray.time = ray.time;
    r.ray.tfar = ray.far;
    r.ray.mask = 0xffffffffu;
    r.ray.id = 0;
    r.ray.flags = 0;
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    Intersect1(embree_->scene, &context, &r);
    if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
        return false;
    }
    hit->t = r.ray.tfar;
    hit->u = r.hit.u;
    hit->v = r.hit.v;
    hit->triangle = r.hit.primID;
    hit->object = r.hit.instID[0] != RTC_INVALID_GEOMETRY_ID ? r.hit.instID[0] : r.hit.geomID;
    hit->time = ray.time;
    std::optional<Object> moved;
    const Object& object = objects_[hit->object].At(ray.time, &moved);
    hit->normal = {r.hit.Ng_x, r.hit.Ng_y, r.hit.Ng_z};
    if (object.triangles != nullptr) {  // shading will want it
        _mm_prefetch(reinterpret_cast<const char*>(object.triangles + hit->triangle), _MM_HINT_T0);
    }
    hit->normal = object.nested     ? object.TransformNormal(UnitNormal(hit->normal))
                  : object.mirrored ? -hit->normal
                                    : hit->normal;
    hit->normal = UnitNormal(hit->normal);
    if (hit->normal == Vec3f{}) {
        hit->normal = -Normalize(ray.direction);
    }
    return true;
}

bool Accel::Occluded(const Ray& ray) const {
    RayContext context;
    InitContext(&context, ray.seed);
    RTCRay r;
    r.org_x = ray.origin.x;
    r.org_y = ray.origin.y;
    r.org_z = ray.origin.z;
    r.tnear = 0;
    r.dir_x = ray.direction.x;
    r.dir_y = ray.direction.y;
    r.dir_z = ray.direction.z;
    r.time = ray.time;
    r.tfar = ray.far;
    r.mask = 0xffffffffu;
    r.id = 0;
    r.flags = 0;
    Occluded1(embree_->scene, &context, &r);
    return r.tfar < 0;
}

std::string Accel::Describe() const {
    return fmt::format("{} triangles in world space, {} shared by instances{}",
                       embree_->flat_triangles, embree_->shared_triangles,
                       moves() ? fmt::format(", {} objects that move", motions_.size()) : "");
}

void CheckEmbree() { const Device device; }

}  // namespace relume::render
