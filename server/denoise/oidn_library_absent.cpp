// In place of oidn_library.cpp where the build has not found the library.
#include "core/base/error.h"
#include "server/denoise/oidn_library.h"

namespace relume::denoise {

bool HasOidnLibrary() { return false; }

std::array<Plane, 3> RunOidnLibrary(const OidnTask&, const CancelToken&) {
    throw Error(ErrorCode::kFailedPrecondition,
                "this build has not found Open Image Denoise's library");
}

}  // namespace relume::denoise
