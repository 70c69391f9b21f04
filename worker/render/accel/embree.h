#pragma once

// The one door to Embree: version 3.13, or 4 where that is installed instead.
#if __has_include(<embree3/rtcore.h>)
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#include <cstdint>

namespace relume::render {

// What a ray carries to filter functions, beside what Embree wants. `base` comes first: filters get
// its address.
struct RayContext {
#if RTC_VERSION_MAJOR >= 4
    RTCRayQueryContext base;
#else
    RTCIntersectContext base;
#endif
    std::uint32_t seed;  // of decisions about partly transparent surfaces
};

inline void InitContext(RayContext* context, std::uint32_t seed) {
#if RTC_VERSION_MAJOR >= 4
    rtcInitRayQueryContext(&context->base);
#else
    rtcInitIntersectContext(&context->base);
#endif
    context->seed = seed;
}

// Single rays only: packets give other bits.
inline void Intersect1(RTCScene scene, RayContext* context, RTCRayHit* ray) {
#if RTC_VERSION_MAJOR >= 4
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.context = &context->base;
    rtcIntersect1(scene, ray, &arguments);
#else
    rtcIntersect1(scene, &context->base, ray);
#endif
}

// Sets tfar to -infinity if something is in the way.
inline void Occluded1(RTCScene scene, RayContext* context, RTCRay* ray) {
#if RTC_VERSION_MAJOR >= 4
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.context = &context->base;
    rtcOccluded1(scene, ray, &arguments);
#else
    rtcOccluded1(scene, &context->base, ray);
#endif
}

}  // namespace relume::render
