#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/scene/scene.h"

namespace relume {

// References from one file to another, as RFC 3986 writes them.

// "data:..." holds the bytes itself.
bool IsDataUri(std::string_view uri);

// The bytes of a data URI, base64 or percent-encoded. Throws naming `place` if it is malformed.
std::string DecodeDataUri(std::string_view uri, const SourceLocation& place);

// A path without its "." and ".." parts; nothing if it is empty, absolute or leaves its folder.
std::optional<std::string> CollapseDots(const std::string& path);

// The name in a FileSource of what a relative URI refers to: percent-decoded, without "." and ".."
// parts. Throws naming `place` for a URI with a scheme, an absolute one, or one that leaves the
// scene's folder.
std::string UriToName(std::string_view uri, const SourceLocation& place);

}  // namespace relume
