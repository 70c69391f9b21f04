#pragma once

#include <cstddef>
#include <span>

namespace relume::denoise {

// A file of network/weights as part of the program; the list is made by the build
// (network/built_in.cmake).
struct BuiltInNetwork {
    const char* name;  // without .tza
    std::span<const std::byte> bytes;
};
std::span<const BuiltInNetwork> BuiltInNetworks();

}  // namespace relume::denoise
