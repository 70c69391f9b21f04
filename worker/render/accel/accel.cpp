#include "worker/render/accel/accel.h"

#include <fmt/format.h>
#include <immintrin.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <span>
#include <unordered_map>

#include "core/base/parallel.h"
#include "core/base/sha256.h"
#include "worker/render/accel/device.h"
#include "worker/render/accel/shapes.h"
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
    std::shared_ptr<const Device> device;
    // What stands still, in world space, and what has two levels; null: there is none. One after
    // the other is what Embree does with triangles and instances of one scene, too.
    std::shared_ptr<const Structure> flat, nested;
    std::vector<std::shared_ptr<const Shape>> shapes;            // by mesh
    std::vector<std::shared_ptr<const NestedMesh>> nested_mesh;  // by mesh; null where flattened
    std::uint64_t flat_triangles = 0, shared_triangles = 0;

    template <class T>
    using Parts = std::unordered_map<std::string, std::shared_ptr<const T>>;
    // By key.
    template <class T>
    static Parts<T> Index(const std::vector<std::shared_ptr<const T>>& parts) {
        Parts<T> index;
        for (const auto& part : parts) {
            if (part != nullptr && !part->key.empty()) {
                index.emplace(part->key, part);
            }
        }
        return index;
    }
    template <class T>
    static std::shared_ptr<const T> Find(const Parts<T>& index, const std::string& key) {
        const auto it = index.find(key);
        return it == index.end() ? nullptr : it->second;
    }
};

Accel::Accel(const Scene& scene, const std::vector<CompiledMaterial>& materials,
             const TextureSet& textures, Reuse reuse, const Accel* before)
    : embree_(std::make_unique<Embree>()) {
    Embree& embree = *embree_;
    std::vector<int> uses(scene.meshes.size(), 0);
    for (const Instance& instance : scene.instances) {
        ++uses[static_cast<std::size_t>(instance.mesh)];
    }

    // What is gathered of each mesh.
    Embree::Parts<Shape> known_shapes;
    Embree::Parts<NestedMesh> known_nested;
    if (before != nullptr) {
        known_shapes = Embree::Index(before->embree_->shapes);
        known_nested = Embree::Index(before->embree_->nested_mesh);
    }
    embree.shapes.resize(scene.meshes.size());
    ParallelFor(0, scene.meshes.size(), 1, [&](std::size_t begin, std::size_t end) {
        const FloatingPointMode mode;
        for (std::size_t i = begin; i < end; ++i) {
            const Mesh& mesh = scene.meshes[i];
            const std::string key = reuse == Reuse::kLater && uses[i] > 0 ? ShapeKey(mesh) : "";
            embree.shapes[i] = Embree::Find(known_shapes, key);
            if (embree.shapes[i] == nullptr) {
                embree.shapes[i] =
                    MakeShape(mesh, materials[static_cast<std::size_t>(mesh.material)], textures,
                              uses[i] > 0, key);
            }
        }
    });

    // Objects, and which of them are flattened.
    const bool flatten_all = scene.TriangleCount() <= kFlattenTriangles;
    std::vector<bool> flat(scene.instances.size());
    Sha256 flat_key;
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const Instance& instance = scene.instances[i];
        const std::size_t mesh_index = static_cast<std::size_t>(instance.mesh);
        flat[i] = Flatten(instance, uses[mesh_index] == 1, flatten_all);
        if (flat[i] && reuse == Reuse::kLater) {
            flat_key.Update(fmt::format("{} {}", i, embree.shapes[mesh_index]->key));
            flat_key.Update(instance.to_world.rows().data(), sizeof(float) * 12);
        }
    }

    embree.device = before != nullptr ? before->embree_->device : std::make_shared<Device>();
    embree.device->Build([&] {
        auto flat_scene = std::make_shared<Structure>(embree.device);
        auto nested_scene = std::make_shared<Structure>(embree.device);
        flat_scene->key = reuse == Reuse::kLater ? flat_key.HexDigest() : "";
        const bool known_flat = before != nullptr && before->embree_->flat != nullptr &&
                                !flat_scene->key.empty() &&
                                before->embree_->flat->key == flat_scene->key;
        embree.nested_mesh.resize(scene.meshes.size());
        for (std::size_t i = 0; i < scene.instances.size(); ++i) {
            const Instance& instance = scene.instances[i];
            const std::size_t mesh_index = static_cast<std::size_t>(instance.mesh);
            const Mesh& mesh = scene.meshes[mesh_index];
            const std::shared_ptr<const Shape>& shape = embree.shapes[mesh_index];
            Object object;
            object.triangles = shape->triangles.empty() ? nullptr : shape->triangles.data();
            object.gradients = shape->gradients.empty() ? nullptr : shape->gradients.data();
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
            if (flat[i]) {
                embree.flat_triangles += mesh.triangles.size();
                if (!known_flat) {
                    flat_scene->Attach(
                        MakeTriangles(embree.device->get(), mesh, instance.to_world, shape->filter),
                        static_cast<std::uint32_t>(i), shape);
                }
            } else {
                std::shared_ptr<const NestedMesh>& shared = embree.nested_mesh[mesh_index];
                if (shared == nullptr) {
                    shared = Embree::Find(known_nested, shape->key);
                    if (shared == nullptr) {
                        shared = std::make_shared<NestedMesh>(embree.device, mesh, shape);
                    }
                    embree.shared_triangles += mesh.triangles.size();
                }
                nested_scene->Attach(
                    MakeInstance(embree.device->get(), shared->structure.get(), keys),
                    static_cast<std::uint32_t>(i), shared);
                object.nested = true;
                object.extent = scale * LargestCoordinate(shared->bounds);
            }
            // Where each triangle's size is not kept, or not of all times.
            if (object.triangles == nullptr || !mesh.motion.empty()) {
                float largest = 0;
                for (const Vec3u t : mesh.triangles) {
                    largest = std::max(largest, LargestEdge(mesh, t));
                }
                object.extent = std::max(object.extent, scale * largest);
            }
            objects_.push_back(object);
        }
        if (known_flat) {
            embree.flat = before->embree_->flat;
        } else if (!flat_scene->empty()) {
            flat_scene->Commit();
            embree.flat = std::move(flat_scene);
        }
        if (!nested_scene->empty()) {
            nested_scene->Commit();
            embree.nested = std::move(nested_scene);
        }
    });
    // For hits: one look at the pointers instead of three.
    flat_ = embree.flat != nullptr ? embree.flat->get() : nullptr;
    nested_ = embree.nested != nullptr ? embree.nested->get() : nullptr;
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
    if (flat_ != nullptr) {
        Intersect1(flat_, &context, &r);
    }
    if (nested_ != nullptr) {
        Intersect1(nested_, &context, &r);
    }
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
    if (flat_ != nullptr) {
        Occluded1(flat_, &context, &r);
        if (r.tfar < 0) {
            return true;
        }
    }
    if (nested_ != nullptr) {
        Occluded1(nested_, &context, &r);
    }
    return r.tfar < 0;
}

std::string Accel::Describe() const {
    return fmt::format("{} triangles in world space, {} shared by instances{}",
                       embree_->flat_triangles, embree_->shared_triangles,
                       moves() ? fmt::format(", {} objects that move", motions_.size()) : "");
}

void CheckEmbree() { const Device device; }

}  // namespace relume::render
