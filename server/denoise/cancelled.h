#pragma once

#include "core/base/cancel_token.h"
#include "core/base/error.h"

namespace relume::denoise {

// Throws kCancelled if it is set.
inline void ThrowIfCancelled(const CancelToken& cancel) {
    if (cancel.cancelled()) {
        throw Error(ErrorCode::kCancelled, "the filter was cancelled");
    }
}

}  // namespace relume::denoise
