#include "worker/render/accel/device.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <new>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "worker/render/render.h"

namespace relume::render {
namespace {

constexpr int kBuildTasks = 4;

// Slots that no worker thread is asked for, since there are not that many: TBB would complain on
// stderr. The arena is as wide as ever.
unsigned ReservedSlots() {
    return static_cast<unsigned>(kBuildTasks - std::min(kBuildTasks - 1, ThreadCount() - 1));
}

const char* Reason(RTCError error) {
    switch (error) {
        case RTC_ERROR_INVALID_ARGUMENT:
            return "invalid argument";
        case RTC_ERROR_INVALID_OPERATION:
            return "invalid operation";
        case RTC_ERROR_OUT_OF_MEMORY:
            return "out of memory";
        case RTC_ERROR_UNSUPPORTED_CPU:
            return "this CPU is not supported";
        case RTC_ERROR_CANCELLED:
            return "cancelled";
        default:
            return "unknown error";
    }
}

}  // namespace

Device::Device() {
    tbb::task_arena arena(kBuildTasks, ReservedSlots());
    arena.execute([&] { device_ = rtcNewDevice(fmt::format("isa={}", kIsa).c_str()); });
    if (device_ == nullptr) {
        const RTCError error = rtcGetDeviceError(nullptr);
        if (error == RTC_ERROR_OUT_OF_MEMORY) {
            throw std::bad_alloc();
        }
        throw Error(ErrorCode::kFailedPrecondition,
                    fmt::format("Embree does not start with isa={}: {}; use a machine with AVX2",
                                kIsa, Reason(error)));
    }
    // Rays of 8 are native from AVX on, rays of 16 with AVX-512 only: neither less nor more than
    // asked for.
    const bool avx = rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0;
    const bool avx512 =
        rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
    if (!avx || avx512) {
        rtcReleaseDevice(device_);
        throw Error(
            ErrorCode::kFailedPrecondition,
            fmt::format("Embree does not keep to isa={}: install a build of it with AVX2", kIsa));
    }
}

Device::~Device() { rtcReleaseDevice(device_); }

void Device::Build(const std::function<void()>& build) const {
    tbb::task_arena arena(kBuildTasks, ReservedSlots());
    arena.execute(build);
    const RTCError error = rtcGetDeviceError(device_);
    if (error != RTC_ERROR_NONE) {
        throw Error(
            ErrorCode::kResourceExhausted,
            fmt::format("Embree can't build the scene: {}; render on a machine with more memory",
                        Reason(error)));
    }
}

}  // namespace relume::render
