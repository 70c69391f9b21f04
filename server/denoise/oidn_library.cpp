#include "server/denoise/oidn_library.h"

#include <OpenImageDenoise/oidn.h>
#include <fmt/format.h>

#include <memory>
#include <type_traits>
#include <vector>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "server/denoise/cancelled.h"

namespace relume::denoise {
namespace {

constexpr std::size_t kChannels = 3;

struct Release {
    void operator()(OIDNDevice device) const { oidnReleaseDevice(device); }
    void operator()(OIDNFilter filter) const { oidnReleaseFilter(filter); }
};
using Device = std::unique_ptr<std::remove_pointer_t<OIDNDevice>, Release>;
using Filter = std::unique_ptr<std::remove_pointer_t<OIDNFilter>, Release>;

// The first error of this thread since the last call. `device` may be null.
void ThrowError(OIDNDevice device) {
    const char* message = "";
    const OIDNError error = oidnGetDeviceError(device, &message);
    if (error == OIDN_ERROR_NONE || error == OIDN_ERROR_CANCELLED) {
        return;  // cancelled: the caller asks its token
    }
    throw Error(
        error == OIDN_ERROR_OUT_OF_MEMORY ? ErrorCode::kResourceExhausted : ErrorCode::kInternal,
        fmt::format("Open Image Denoise's library: {}", message));
}

// Calls of several threads wait for each other in it.
OIDNDevice TheDevice() {
    static const Device device = [] {
        Device made(oidnNewDevice(OIDN_DEVICE_TYPE_CPU));
        if (!made) {
            ThrowError(nullptr);
            throw Error(ErrorCode::kInternal, "Open Image Denoise's library: no CPU device");
        }
        // The process has other work for its threads than to stay on one core each.
        oidnSetDeviceBool(made.get(), "setAffinity", false);
        oidnSetDeviceInt(made.get(), "numThreads", ThreadCount());
        oidnCommitDevice(made.get());
        ThrowError(made.get());
        return made;
    }();
    return device.get();
}

OIDNQuality QualityOf(OidnTask::Size size) {
    return size == OidnTask::Size::kSmall  ? OIDN_QUALITY_FAST
           : size == OidnTask::Size::kBase ? OIDN_QUALITY_BALANCED
                                           : OIDN_QUALITY_HIGH;
}

std::vector<float> Interleave(const std::array<Plane, 3>& planes) {
    std::vector<float> pixels(kChannels * planes[0].size());
    for (std::size_t i = 0; i < planes[0].size(); ++i) {
        for (std::size_t c = 0; c < kChannels; ++c) {
            pixels[kChannels * i + c] = planes[c][i];
        }
    }
    return pixels;
}

bool GoesOn(void* cancel, double) { return !static_cast<const CancelToken*>(cancel)->cancelled(); }

}  // namespace

bool HasOidnLibrary() { return true; }

std::array<Plane, 3> RunOidnLibrary(const OidnTask& task, const CancelToken& cancel) {
    ThrowIfCancelled(cancel);
    OIDNDevice device = TheDevice();
    const Filter filter(oidnNewFilter(device, "RT"));
    ThrowError(device);
    const auto pixels =
        static_cast<std::size_t>(task.width) * static_cast<std::size_t>(task.height);
    std::vector<std::vector<float>> images;
    const auto set = [&](const char* name, std::vector<float> image) {
        images.push_back(std::move(image));
        oidnSetSharedFilterImage(filter.get(), name, images.back().data(), OIDN_FORMAT_FLOAT3,
                                 static_cast<std::size_t>(task.width),
                                 static_cast<std::size_t>(task.height), 0, 0, 0);
    };
    for (const auto& [name, planes] :
         {std::pair{"color", task.color}, {"albedo", task.albedo}, {"normal", task.normal}}) {
        if (planes != nullptr) {
            set(name, Interleave(*planes));
        }
    }
    set("output", std::vector<float>(kChannels * pixels));
    if (task.color != nullptr) {
        oidnSetFilterBool(filter.get(), "hdr", true);
        oidnSetFilterBool(filter.get(), "cleanAux", task.clean);
    }
    oidnSetFilterInt(filter.get(), "quality", QualityOf(task.size));
    oidnSetFilterProgressMonitorFunction(filter.get(), GoesOn, const_cast<CancelToken*>(&cancel));
    oidnCommitFilter(filter.get());
    oidnExecuteFilter(filter.get());
    ThrowError(device);
    ThrowIfCancelled(cancel);
    const std::vector<float>& output = images.back();
    std::array<Plane, 3> out;
    for (std::size_t c = 0; c < kChannels; ++c) {
        out[c].resize(pixels);
        for (std::size_t i = 0; i < pixels; ++i) {
            out[c][i] = output[kChannels * i + c];
        }
    }
    return out;
}

}  // namespace relume::denoise
