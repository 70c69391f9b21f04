#include "bench/embree_probe.h"

#include <atomic>

#include "worker/render/accel/embree.h"

using relume::render::RayContext;

// What the linker calls the wrapped functions themselves, and what it calls instead.
extern "C" {
#if RTC_VERSION_MAJOR >= 4
void __real_rtcIntersect1(RTCScene scene, RTCRayHit* ray, RTCIntersectArguments* arguments);
void __real_rtcOccluded1(RTCScene scene, RTCRay* ray, RTCOccludedArguments* arguments);
#else
void __real_rtcIntersect1(RTCScene scene, RTCIntersectContext* context, RTCRayHit* ray);
void __real_rtcOccluded1(RTCScene scene, RTCIntersectContext* context, RTCRay* ray);
#endif
RTCDevice __real_rtcNewDevice(const char* config);
}

namespace relume::bench {
namespace {

thread_local RayLog* recording = nullptr;

std::atomic<std::int64_t> embree_bytes{0}, embree_peak{0};

bool CountMemory(void*, ssize_t bytes, bool) {
    const std::int64_t now = embree_bytes += bytes;
    std::int64_t peak = embree_peak;
    while (now > peak && !embree_peak.compare_exchange_weak(peak, now)) {
    }
    return true;
}

void Record(RTCScene scene, const void* context, const RTCRay& ray, bool shadow) {
    // All contexts of the renderer are RayContexts, which begin with Embree's.
    const auto seed = static_cast<const RayContext*>(context)->seed;
    recording->scene = scene;
    recording->rays.push_back({{ray.org_x, ray.org_y, ray.org_z},
                               ray.tfar,
                               {ray.dir_x, ray.dir_y, ray.dir_z},
                               ray.time,
                               seed,
                               shadow});
}

void Restore(const RecordedRay& from, RTCRay* ray) {
    ray->org_x = from.origin[0];
    ray->org_y = from.origin[1];
    ray->org_z = from.origin[2];
    ray->tnear = 0;
    ray->dir_x = from.direction[0];
    ray->dir_y = from.direction[1];
    ray->dir_z = from.direction[2];
    ray->time = from.time;
    ray->tfar = from.far;
    ray->mask = 0xffffffffu;
    ray->id = 0;
    ray->flags = 0;
}

void BareIntersect(RTCScene scene, RayContext* context, RTCRayHit* ray) {
#if RTC_VERSION_MAJOR >= 4
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.context = &context->base;
    __real_rtcIntersect1(scene, ray, &arguments);
#else
    __real_rtcIntersect1(scene, &context->base, ray);
#endif
}

void BareOccluded(RTCScene scene, RayContext* context, RTCRay* ray) {
#if RTC_VERSION_MAJOR >= 4
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.context = &context->base;
    __real_rtcOccluded1(scene, ray, &arguments);
#else
    __real_rtcOccluded1(scene, &context->base, ray);
#endif
}

}  // namespace

void RecordRays(RayLog* log) { recording = log; }

std::uint64_t Replay(const RayLog& log) {
    const auto scene = static_cast<RTCScene>(log.scene);
    std::uint64_t met = 0;
    for (const RecordedRay& recorded : log.rays) {
        RayContext context;
        render::InitContext(&context, recorded.seed);
        if (recorded.shadow) {
            RTCRay ray;
            Restore(recorded, &ray);
            BareOccluded(scene, &context, &ray);
            met += ray.tfar < 0 ? 1 : 0;
        } else {
            RTCRayHit ray;
            Restore(recorded, &ray.ray);
            ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
            BareIntersect(scene, &context, &ray);
            met += ray.hit.geomID != RTC_INVALID_GEOMETRY_ID ? 1 : 0;
        }
    }
    return met;
}

std::size_t EmbreeBytes() { return static_cast<std::size_t>(embree_bytes.load()); }
std::size_t EmbreePeakBytes() { return static_cast<std::size_t>(embree_peak.load()); }

}  // namespace relume::bench

extern "C" {
#if RTC_VERSION_MAJOR >= 4
void __wrap_rtcIntersect1(RTCScene scene, RTCRayHit* ray, RTCIntersectArguments* arguments) {
    if (relume::bench::recording != nullptr) {
        relume::bench::Record(scene, arguments->context, ray->ray, false);
    }
    __real_rtcIntersect1(scene, ray, arguments);
}

void __wrap_rtcOccluded1(RTCScene scene, RTCRay* ray, RTCOccludedArguments* arguments) {
    if (relume::bench::recording != nullptr) {
        relume::bench::Record(scene, arguments->context, *ray, true);
    }
    __real_rtcOccluded1(scene, ray, arguments);
}
#else
void __wrap_rtcIntersect1(RTCScene scene, RTCIntersectContext* context, RTCRayHit* ray) {
    if (relume::bench::recording != nullptr) {
        relume::bench::Record(scene, context, ray->ray, false);
    }
    __real_rtcIntersect1(scene, context, ray);
}

void __wrap_rtcOccluded1(RTCScene scene, RTCIntersectContext* context, RTCRay* ray) {
    if (relume::bench::recording != nullptr) {
        relume::bench::Record(scene, context, *ray, true);
    }
    __real_rtcOccluded1(scene, context, ray);
}
#endif

RTCDevice __wrap_rtcNewDevice(const char* config) {
    const RTCDevice device = __real_rtcNewDevice(config);
    if (device != nullptr) {
        rtcSetDeviceMemoryMonitorFunction(device, relume::bench::CountMemory, nullptr);
    }
    return device;
}
}
