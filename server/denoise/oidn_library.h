#pragma once

#include <array>

#include "core/base/cancel_token.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// Open Image Denoise's own library, 2.3 or newer, if the build has found one
// (cmake/dependencies.cmake): what oidn.cpp then runs in place of its networks by network/.
bool HasOidnLibrary();

// One run of its filter "RT".
struct OidnTask {
    // Sizes of the network for colour; for features alone kBase is the smallest.
    enum class Size { kSmall, kBase, kLarge };

    int width, height;
    // Null: not there. Colour is linear radiance, and with it the others are looked at; else one of
    // them is filtered by itself. Normals are in [-1, 1].
    const std::array<Plane, 3>*color, *albedo, *normal;
    bool clean = false;  // what is looked at has no noise
    Size size = Size::kBase;
};

// Throws kCancelled soon after `cancel` is set; with what the library says, if it fails,
// kResourceExhausted where it lacks memory, else kInternal.
std::array<Plane, 3> RunOidnLibrary(const OidnTask& task, const CancelToken& cancel);

}  // namespace relume::denoise
