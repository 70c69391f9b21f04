#pragma once

#include <string>
#include <string_view>

#include "core/image/decode.h"

namespace relume {

// Radiance HDR with rows from the top (-Y h +X w), flat or run-length encoded; RGBE only. Throws
// Error naming `name`.
DecodedImage DecodeHdr(std::string_view bytes, const std::string& name);

// PFM, "PF" (RGB) or "Pf" (grey), either byte order; values are multiplied by the size of the
// scale. Throws Error naming `name`.
DecodedImage DecodePfm(std::string_view bytes, const std::string& name);

// Throws kResourceExhausted for more than kMaxReadPixels, kInvalidArgument for none.
void CheckImageSize(std::int64_t width, std::int64_t height, const std::string& name);

}  // namespace relume
