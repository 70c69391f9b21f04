#include "worker/render/accel/geometry.h"

#include <algorithm>

#include "worker/render/sampler/hash.h"

namespace relume::render {
namespace {

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

// Null if memory lacks.
template <class T>
T* NewBuffer(RTCGeometry geometry, RTCBufferType type, std::size_t slot, RTCFormat format,
             std::size_t count) {
    return static_cast<T*>(rtcSetNewGeometryBuffer(geometry, type, static_cast<unsigned>(slot),
                                                   format, sizeof(T), count));
}

}  // namespace

RTCGeometry MakeTriangles(RTCDevice device, const Mesh& mesh, const Transform& to_world,
                          const FilterMesh& filter) {
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    const bool identity = to_world == Transform();
    const std::size_t steps = std::max(mesh.motion.size(), std::size_t{1});
    if (steps > 1) {
        rtcSetGeometryTimeStepCount(geometry, static_cast<unsigned>(steps));
    }
    for (std::size_t step = 0; step < steps; ++step) {
        auto* vertices = NewBuffer<Vec3f>(geometry, RTC_BUFFER_TYPE_VERTEX, step, RTC_FORMAT_FLOAT3,
                                          mesh.positions.size());
        if (vertices == nullptr) {
            break;
        }
        const std::vector<Vec3f>& positions =
            mesh.motion.empty() ? mesh.positions : mesh.motion[step];
        for (std::size_t i = 0; i < positions.size(); ++i) {
            vertices[i] = identity ? positions[i] : to_world.Point(positions[i]);
        }
    }
    if (auto* triangles = NewBuffer<Vec3u>(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                           mesh.triangles.size())) {
        std::copy(mesh.triangles.begin(), mesh.triangles.end(), triangles);
    }
    if (filter.material->SeesThrough()) {
        rtcSetGeometryUserData(geometry, const_cast<FilterMesh*>(&filter));
        rtcSetGeometryIntersectFilterFunction(geometry, FilterTransparent);
        rtcSetGeometryOccludedFilterFunction(geometry, FilterTransparent);
    }
    rtcCommitGeometry(geometry);
    return geometry;
}

RTCGeometry MakeInstance(RTCDevice device, RTCScene shared, std::span<const Transform> to_world) {
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, shared);
    if (to_world.size() > 1) {
        rtcSetGeometryTimeStepCount(geometry, static_cast<unsigned>(to_world.size()));
    }
    for (std::size_t step = 0; step < to_world.size(); ++step) {
        rtcSetGeometryTransform(geometry, static_cast<unsigned>(step),
                                RTC_FORMAT_FLOAT3X4_ROW_MAJOR, to_world[step].rows().data());
    }
    rtcCommitGeometry(geometry);
    return geometry;
}

}  // namespace relume::render
