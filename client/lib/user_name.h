#pragma once

#include <string>

namespace relume::client {

// Who runs this process, and where: "ann@render3", at most 64 bytes.
std::string UserAtHost();

}  // namespace relume::client
