#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace relume {

// A scene as a set of files by content. `path` is relative to the main file's folder.
struct ManifestEntry {
    std::string path;
    std::uint64_t size = 0;
    std::string sha256;
};

struct SceneManifest {
    std::string main;
    std::vector<ManifestEntry> entries;  // main file first
};

// Throws kInvalidArgument that names the entry: a path that is absolute, leaves its folder or comes
// twice, a malformed digest, a main file that is not among the entries, more than 100,000 entries.
void ValidateManifest(const SceneManifest& manifest);

// True if `path` is relative, not empty, and has no "..", empty or "." part, backslash or control
// character, and at most 1024 bytes.
bool IsSafeRelativePath(const std::string& path);

// The scene's digest: of its main path, and of the paths and digests of its entries in order of
// path.
std::string ManifestDigest(const SceneManifest& manifest);

}  // namespace relume
