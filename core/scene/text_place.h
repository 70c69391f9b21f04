#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/scene/scene.h"

// What loaders of text formats share: places in files, notes with them, paths.
namespace relume::text {

// A place in a file; the name belongs to who reads the file.
struct Place {
    const std::string* file = nullptr;
    int line = 0, column = 0;

    SourceLocation Text() const;  // "scene.pbrt:12:3"
};

[[noreturn]] void Fail(const Place& place, const std::string& problem);

// What was left out or replaced; each message once, with the place where it came up first.
class Notes {
  public:
    void Add(const Place& place, const std::string& message);
    void Merge(const Notes& other);
    std::vector<std::string> Take() const;

  private:
    std::vector<std::pair<std::string, std::string>> notes_;  // place, message
};

// A path that a scene file writes as a name in a FileSource: forward slashes, without "." and "..".
// Throws for an absolute one, or one that leaves the scene's folder.
std::string PathToName(const std::string& path, const Place& place);

}  // namespace relume::text
