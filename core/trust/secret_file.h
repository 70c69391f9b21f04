#pragma once

#include <string>

namespace relume {

// A file's bytes, its error as kInvalidArgument that begins with `option`, by which it was named.
std::string ReadNamedFile(const std::string& option, const std::string& path);

// The same for what must stay secret: refused if others than its owner and group may read it.
std::string ReadSecretFile(const std::string& option, const std::string& path);

}  // namespace relume
