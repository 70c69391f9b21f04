#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace relume {

enum class PlyType { kInt8, kUInt8, kInt16, kUInt16, kInt32, kUInt32, kFloat32, kFloat64 };
std::size_t SizeOf(PlyType type);  // bytes

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::kFloat32;
    bool is_list = false;
    PlyType count_type = PlyType::kUInt8;
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties;

    std::uint64_t MinimumSize(bool ascii) const;  // bytes of one, lists empty
    int Find(std::string_view property) const;    // index; -1 if there is none
};

struct PlyHeader {
    enum class Format { kAscii, kLittle, kBig };
    Format format = Format::kAscii;
    std::vector<PlyElement> elements;
    std::size_t size = 0;  // of the header itself, bytes
};

// Throws naming `name` and the line.
PlyHeader ReadPlyHeader(std::string_view bytes, const std::string& name);

}  // namespace relume
