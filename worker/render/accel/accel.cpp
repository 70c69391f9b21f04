#include "worker/render/accel/accel.h"

#include <fmt/format.h>
#include <immintrin.h>

#include <algorithm>
#include <cstring>

#include "core/base/parallel.h"
#include "worker/render/accel/device.h"
#include "worker/render/floating_point_mode.h"
#include "worker/render/sampler/hash.h"

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

// What the filter of a partly transparent mesh needs.
struct FilterMesh {
    const TriangleData* triangles;  // null: no uvs
    const CompiledMaterial* material;
    const TextureSet* textures;
};

// Called for each hit in any order: the decision is a pure function of ray and triangle.
void FilterTransparent(const RTCFilterFunctionNArguments* args) {
    if (args->valid[0] == 0) {
        return;
    }
    const auto& mesh = *static_cast<const FilterMesh*>(args->geometryUserPtr);
    const unsigned triangle = RTCHitN_primID(args->hit, 1, 0);
    Vec2f uv;
    if (mesh.triangles != nullptr) {
        uv = mesh.triangles[triangle].Uv(RTCHitN_u(args->hit, 1, 0), RTCHitN_v(args->hit, 1, 0));
    }
    const float opacity = Opacity(*mesh.material, *mesh.textures, uv);
    if (opacity >= 1) {
        return;
    }
    bool stopped = false;
    if (opacity > 0) {
        const unsigned instance = RTCHitN_instID(args->hit, 1, 0, 0);
        const unsigned geometry = RTCHitN_geomID(args->hit, 1, 0);
        const std::uint32_t seed = reinterpret_cast<const RayContext*>(args->context)->seed;
        stopped = ToUnit(Hash(Hash(Hash(seed, instance), geometry), triangle)) < opacity;
    }
    if (!stopped) {
        args->valid[0] = 0;
    }
}

bool NeedsTriangleData(const Mesh& mesh, const CompiledMaterial& material) {
    return !mesh.normals.empty() || (!mesh.uvs.empty() && material.NeedsUv());
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

    // A new, committed geometry of the mesh under a transform.
    RTCGeometry MakeGeometry(const Mesh& mesh, std::size_t mesh_index,
                             const Transform& to_world) const {
        const RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* vertices = static_cast<Vec3f*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                    sizeof(Vec3f), mesh.positions.size()));
        auto* triangles = static_cast<Vec3u*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                    sizeof(Vec3u), mesh.triangles.size()));
        if (vertices != nullptr &&
            triangles != nullptr) {  // else Build() reports the lack of memory
            const bool identity = to_world == Transform();
            for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
                vertices[i] = identity ? mesh.positions[i] : to_world.Point(mesh.positions[i]);
            }
            std::copy(mesh.triangles.begin(), mesh.triangles.end(), triangles);
        }
        if (filters[mesh_index].material->SeesThrough()) {
            rtcSetGeometryUserData(geometry, const_cast<FilterMesh*>(&filters[mesh_index]));
            rtcSetGeometryIntersectFilterFunction(geometry, FilterTransparent);
            rtcSetGeometryOccludedFilterFunction(geometry, FilterTransparent);
        }
        rtcCommitGeometry(geometry);
        return geometry;
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
                triangles_[i] = GatherTriangles(mesh, material.needs_tangents);
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
            object.SetTransform(instance.to_world);
            RTCGeometry geometry;
            if (flatten_all || uses[mesh_index] == 1) {
                geometry = embree.MakeGeometry(mesh, mesh_index, instance.to_world);
                embree.flat_triangles += mesh.triangles.size();
            } else {
                RTCScene& shared = embree.mesh_scenes[mesh_index];
                if (shared == nullptr) {
                    shared = embree.NewScene();
                    const RTCGeometry part = embree.MakeGeometry(mesh, mesh_index, Transform());
                    rtcAttachGeometry(shared, part);
                    rtcReleaseGeometry(part);
                    rtcCommitScene(shared);
                    embree.shared_triangles += mesh.triangles.size();
                    for (const Vec3f p : mesh.positions) {
                        bounds[mesh_index].Add(p);
                    }
                }
                geometry = rtcNewGeometry(embree.device.get(), RTC_GEOMETRY_TYPE_INSTANCE);
                rtcSetGeometryInstancedScene(geometry, shared);
                rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR,
                                        instance.to_world.rows().data());
                rtcCommitGeometry(geometry);
                object.nested = true;
                object.extent = object.scale * LargestCoordinate(bounds[mesh_index]);
            }
            if (object.triangles == nullptr) {  // where each triangle's size is not kept
                float largest = 0;
                for (const Vec3u t : mesh.triangles) {
                    largest = std::max(largest, LargestEdge(mesh, t));
                }
                object.extent = std::max(object.extent, object.scale * largest);
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
    r.ray.time = 0;
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
    const Object& object = objects_[hit->object];
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
    r.time = 0;
    r.tfar = ray.far;
    r.mask = 0xffffffffu;
    r.id = 0;
    r.flags = 0;
    Occluded1(embree_->scene, &context, &r);
    return r.tfar < 0;
}

std::string Accel::Describe() const {
    return fmt::format("{} triangles in world space, {} shared by instances",
                       embree_->flat_triangles, embree_->shared_triangles);
}

void CheckEmbree() { const Device device; }

}  // namespace relume::render
