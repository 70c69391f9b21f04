#include "core/scene/manifest.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "core/base/error.h"
#include "core/base/sha256.h"

namespace relume {
namespace {

constexpr std::size_t kMaxEntries = 100'000;

}  // namespace

bool IsSafeRelativePath(const std::string& path) {
    // A line break would let two manifests have one digest.
    const auto is_control = [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 127; };
    if (path.empty() || path.size() > 1024 || path.find('\\') != std::string::npos ||
        std::any_of(path.begin(), path.end(), is_control)) {
        return false;
    }
    for (std::size_t begin = 0; begin <= path.size();) {
        const std::size_t end = std::min(path.find('/', begin), path.size());
        const std::string part = path.substr(begin, end - begin);
        if (part.empty() || part == "." || part == "..") {
            return false;
        }
        begin = end + 1;
    }
    return true;
}

void ValidateManifest(const SceneManifest& manifest) {
    if (manifest.entries.size() > kMaxEntries) {
        ThrowInvalidArgument(fmt::format("scene has {} files, at most {} are taken",
                                         manifest.entries.size(), kMaxEntries));
    }
    std::set<std::string> seen;
    for (const auto& entry : manifest.entries) {
        if (!IsSafeRelativePath(entry.path)) {
            ThrowInvalidArgument(
                fmt::format("scene file '{:.200}': the path must be relative and stay below the "
                            "scene's folder, "
                            "with no control characters and at most 1024 bytes",
                            Printable(entry.path)));
        }
        if (!IsSha256Hex(entry.sha256)) {
            ThrowInvalidArgument(
                fmt::format("scene file '{}': its SHA-256 is malformed", entry.path));
        }
        if (!seen.insert(entry.path).second) {
            ThrowInvalidArgument(fmt::format("scene file '{}' is listed twice", entry.path));
        }
    }
    if (seen.count(manifest.main) == 0) {
        ThrowInvalidArgument(
            fmt::format("the main scene file '{}' is not among the scene's files", manifest.main));
    }
}

std::string ManifestDigest(const SceneManifest& manifest) {
    auto entries = manifest.entries;
    std::sort(entries.begin(), entries.end(),
              [](const ManifestEntry& a, const ManifestEntry& b) { return a.path < b.path; });
    Sha256 sha;
    sha.Update(manifest.main + "\n");
    for (const auto& entry : entries) {
        sha.Update(entry.path + "\n" + entry.sha256 + "\n");
    }
    return sha.HexDigest();
}

}  // namespace relume
