// Half of the colour, or of the only other image, with the rules that the library's documentation
// has: parameters before the commit, the commit before the execution, every image of one size.
#include "tests/unit/denoise/oidn_library/stand_in.h"

#include <cstring>
#include <utility>

namespace {

struct Image {
    float* data;
    std::size_t width, height;
};

OIDNError failure = OIDN_ERROR_NONE, pending = OIDN_ERROR_NONE;
std::string pending_message, failure_message;
void (*half_hook)(void*) = nullptr;
void* half_user = nullptr;
int live_filters = 0;

void Raise(OIDNError error, const std::string& message) {
    if (pending == OIDN_ERROR_NONE) {  // the first is kept
        pending = error;
        pending_message = message;
    }
}

}  // namespace

struct OIDNDeviceImpl {
    bool committed = false;
};

struct OIDNFilterImpl {
    std::map<std::string, Image> images;
    std::map<std::string, int> parameters;
    OIDNProgressMonitorFunction monitor = nullptr;
    void* user = nullptr;
    bool committed = false;
};

OIDNDevice oidnNewDevice(OIDNDeviceType type) {
    return type == OIDN_DEVICE_TYPE_CPU ? new OIDNDeviceImpl : nullptr;
}

void oidnReleaseDevice(OIDNDevice device) { delete device; }

void oidnSetDeviceBool(OIDNDevice, const char* name, bool) {
    if (std::strcmp(name, "setAffinity") != 0) {
        Raise(OIDN_ERROR_INVALID_ARGUMENT, "unknown device parameter");
    }
}

void oidnSetDeviceInt(OIDNDevice, const char* name, int value) {
    if (std::strcmp(name, "numThreads") != 0 || value < 0) {
        Raise(OIDN_ERROR_INVALID_ARGUMENT, "unknown device parameter");
    }
}

OIDNError oidnGetDeviceError(OIDNDevice, const char** message) {
    static std::string told;
    told = pending_message;
    *message = told.c_str();
    return std::exchange(pending, OIDN_ERROR_NONE);
}

void oidnCommitDevice(OIDNDevice device) { device->committed = true; }

OIDNFilter oidnNewFilter(OIDNDevice device, const char* type) {
    if (!device->committed || std::strcmp(type, "RT") != 0) {
        Raise(OIDN_ERROR_INVALID_OPERATION, "no such filter yet");
        return nullptr;
    }
    ++live_filters;
    return new OIDNFilterImpl;
}

void oidnReleaseFilter(OIDNFilter filter) {
    --live_filters;
    delete filter;
}

void oidnSetSharedFilterImage(OIDNFilter filter, const char* name, void* data, OIDNFormat format,
                              std::size_t width, std::size_t height, std::size_t offset,
                              std::size_t pixel_stride, std::size_t row_stride) {
    static const std::set<std::string> kNames = {"color", "albedo", "normal", "output"};
    if (!kNames.contains(name) || format != OIDN_FORMAT_FLOAT3 || offset != 0 ||
        pixel_stride != 0 || row_stride != 0) {
        Raise(OIDN_ERROR_INVALID_ARGUMENT, "image");
    }
    filter->images[name] = {static_cast<float*>(data), width, height};
    filter->committed = false;
}

void oidnSetFilterBool(OIDNFilter filter, const char* name, bool value) {
    filter->parameters[name] = value ? 1 : 0;
    filter->committed = false;
}

void oidnSetFilterInt(OIDNFilter filter, const char* name, int value) {
    filter->parameters[name] = value;
    filter->committed = false;
}

void oidnSetFilterProgressMonitorFunction(OIDNFilter filter, OIDNProgressMonitorFunction function,
                                          void* user) {
    filter->monitor = function;
    filter->user = user;
}

void oidnCommitFilter(OIDNFilter filter) { filter->committed = true; }

void oidnExecuteFilter(OIDNFilter filter) {
    if (!filter->committed) {
        Raise(OIDN_ERROR_INVALID_OPERATION, "changes to the filter are not committed");
        return;
    }
    if (failure != OIDN_ERROR_NONE) {
        Raise(std::exchange(failure, OIDN_ERROR_NONE), failure_message);
        return;
    }
    relume::denoise::stand_in::Run run;
    const Image output = filter->images.at("output");
    for (const auto& [name, image] : filter->images) {
        if (image.width != output.width || image.height != output.height) {
            Raise(OIDN_ERROR_INVALID_OPERATION, "images of several sizes");
            return;
        }
        if (name != "output") {
            run.images.insert(name);
        }
    }
    if (!run.images.contains("color") && run.images.size() != 1) {
        Raise(OIDN_ERROR_INVALID_OPERATION, "unsupported combination of images");
        return;
    }
    run.parameters = filter->parameters;
    relume::denoise::stand_in::Runs().push_back(run);
    const Image& input =
        filter->images.at(run.images.contains("color") ? "color" : *run.images.begin());
    const std::size_t values = 3 * output.width * output.height;
    for (std::size_t i = 0; i < values; ++i) {
        if (i == values / 2) {
            if (half_hook != nullptr) {
                std::exchange(half_hook, nullptr)(half_user);
            }
            if (filter->monitor != nullptr && !filter->monitor(filter->user, 0.5)) {
                Raise(OIDN_ERROR_CANCELLED, "execution was cancelled");
                return;
            }
        }
        output.data[i] = 0.5f * input.data[i];
    }
}

namespace relume::denoise::stand_in {

std::vector<Run>& Runs() {
    static std::vector<Run> runs;
    return runs;
}

void Fail(OIDNError error, const std::string& message) {
    failure = error;
    failure_message = message;
}

void OnHalf(void (*hook)(void*), void* user) {
    half_hook = hook;
    half_user = user;
}

int LiveFilters() { return live_filters; }

}  // namespace relume::denoise::stand_in
