#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace relume::bench {

// Looks over Embree's shoulder. The linker hands this program's calls of rtcIntersect1,
// rtcOccluded1 and rtcNewDevice to the probe first (--wrap, bench/CMakeLists.txt), so that the
// renderer knows nothing of it, and pays for it in this program alone.

struct RecordedRay {
    float origin[3];
    float far;
    float direction[3];
    float time;
    std::uint32_t seed;  // RayContext::seed
    bool shadow;         // rtcOccluded1
};

// Rays in the order in which one thread traced them, all in one scene.
struct RayLog {
    std::vector<RecordedRay> rays;
    void* scene = nullptr;  // RTCScene
};

// Until the next call, rays of the calling thread go into `log`; null: nowhere.
void RecordRays(RayLog* log);

// Traces the rays again by rtcIntersect1 and rtcOccluded1 alone, filter functions of partly
// transparent surfaces included. Returns how many met something.
std::uint64_t Replay(const RayLog& log);

// What all Embree devices of this process hold, and the most they ever held, in bytes.
std::size_t EmbreeBytes();
std::size_t EmbreePeakBytes();

}  // namespace relume::bench
