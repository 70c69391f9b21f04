#include "core/scene/ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/base/error.h"
#include "core/scene/ply_header.h"

namespace relume {
namespace {

static_assert(std::endian::native == std::endian::little);

// The numbers behind the header, one after the other.
class Values {
  public:
    Values(std::string_view bytes, const PlyHeader& header, const std::string& name)
        : bytes_(bytes), at_(header.size), format_(header.format), name_(name) {}

    bool ascii() const { return format_ == PlyHeader::Format::kAscii; }
    std::uint64_t left() const { return bytes_.size() - at_; }

    double Next(PlyType type) { return ascii() ? NextText() : NextBinary(type); }

    void Skip(PlyType type, std::uint64_t count) {
        if (!ascii()) {
            Require(count <= left() / SizeOf(type));
            at_ += count * SizeOf(type);
            return;
        }
        for (std::uint64_t i = 0; i < count; ++i) {
            NextText();
        }
    }

    void Require(bool enough) const {
        if (!enough) {
            throw Error(ErrorCode::kDataLoss,
                        fmt::format("{}: the mesh is truncated; restore the file", name_));
        }
    }

  private:
    template <class T>
    double Read(const char* bytes) {
        T value;
        std::memcpy(&value, bytes, sizeof(T));
        return static_cast<double>(value);
    }

    double NextBinary(PlyType type) {
        const std::size_t size = SizeOf(type);
        Require(size <= left());
        char bytes[8];
        std::memcpy(bytes, bytes_.data() + at_, size);
        at_ += size;
        if (format_ == PlyHeader::Format::kBig) {
            std::reverse(bytes, bytes + size);
        }
        switch (type) {
            case PlyType::kInt8:
                return Read<std::int8_t>(bytes);
            case PlyType::kUInt8:
                return Read<std::uint8_t>(bytes);
            case PlyType::kInt16:
                return Read<std::int16_t>(bytes);
            case PlyType::kUInt16:
                return Read<std::uint16_t>(bytes);
            case PlyType::kInt32:
                return Read<std::int32_t>(bytes);
            case PlyType::kUInt32:
                return Read<std::uint32_t>(bytes);
            case PlyType::kFloat32:
                return Read<float>(bytes);
            case PlyType::kFloat64:
                return Read<double>(bytes);
        }
        return 0;
    }

    double NextText() {
        at_ = std::min(bytes_.find_first_not_of(" \t\r\n", at_), bytes_.size());
        Require(at_ < bytes_.size());
        const char* const begin = bytes_.data() + at_;
        double value = 0;
        const auto [end, error] = std::from_chars(begin, bytes_.data() + bytes_.size(), value);
        if (error == std::errc::invalid_argument) {
            ThrowInvalidArgument(
                fmt::format("{}: byte {} is not a number; export the mesh again", name_, at_));
        }
        at_ += static_cast<std::size_t>(end - begin);
        return value;
    }

    std::string_view bytes_;
    std::size_t at_;
    PlyHeader::Format format_;
    const std::string& name_;
};

class Reader {
  public:
    Reader(std::string_view bytes, const std::string& name, ArrayRoom* room)
        : name_(name),
          room_(room),
          header_(ReadPlyHeader(bytes, name)),
          values_(bytes, header_, name) {}

    PlyMesh Read() {
        bool has_vertices = false;
        for (const PlyElement& element : header_.elements) {
            const std::uint64_t least = element.MinimumSize(values_.ascii());
            // One more byte: text may end without a blank.
            values_.Require(least == 0 || element.count <= (values_.left() + 1) / least);
            if (least == 0) {
                continue;
            }
            if (element.name == "vertex") {
                ReadVertices(element);
                has_vertices = true;
            } else {
                ReadOthers(element);
            }
        }
        if (!has_vertices) {
            Fail("it has no vertices");
        }
        for (const Vec3u& t : mesh_.triangles) {
            if (std::max(t.x, std::max(t.y, t.z)) >= mesh_.positions.size()) {
                Fail(fmt::format("a face refers to vertex {} of {}",
                                 std::max(t.x, std::max(t.y, t.z)), mesh_.positions.size()));
            }
        }
        return std::move(mesh_);
    }

  private:
    [[noreturn]] void Fail(const std::string& problem) const {
        ThrowInvalidArgument(fmt::format("{}: {}; export the mesh again", name_, problem));
    }

    void ReadVertices(const PlyElement& element) {
        const auto find = [&](std::initializer_list<std::string_view> names) {
            for (const std::string_view name : names) {
                if (const int index = element.Find(name); index >= 0) {
                    return index;
                }
            }
            return -1;
        };
        // Where each property goes: x y z, nx ny nz, u v.
        const int wanted[8] = {find({"x"}),
                               find({"y"}),
                               find({"z"}),
                               find({"nx"}),
                               find({"ny"}),
                               find({"nz"}),
                               find({"u", "s", "texture_u", "texture_s"}),
                               find({"v", "t", "texture_v", "texture_t"})};
        if (wanted[0] < 0 || wanted[1] < 0 || wanted[2] < 0) {
            Fail("its vertices have no x, y and z");
        }
        const bool has_normals = wanted[3] >= 0 && wanted[4] >= 0 && wanted[5] >= 0;
        const bool has_uvs = wanted[6] >= 0 && wanted[7] >= 0;
        std::vector<int> slot_of(element.properties.size(), 8);
        for (int i = 0; i < 8; ++i) {
            if (wanted[i] >= 0) {
                slot_of[static_cast<std::size_t>(wanted[i])] = i;
            }
        }
        if (element.count > std::numeric_limits<std::int32_t>::max()) {
            Fail(fmt::format("it has {} vertices, more than 2^31", element.count));
        }
        const auto count = static_cast<std::size_t>(element.count);
        const auto place = [&] { return fmt::format("{}: {} vertices", name_, count); };
        room_->Reserve(&mesh_.positions, count, place);
        room_->Reserve(&mesh_.normals, has_normals ? count : 0, place);
        room_->Reserve(&mesh_.uvs, has_uvs ? count : 0, place);
        mesh_.positions.resize(count);
        mesh_.normals.resize(has_normals ? count : 0);
        mesh_.uvs.resize(has_uvs ? count : 0);
        float v[9] = {};
        for (std::size_t i = 0; i < count; ++i) {
            for (std::size_t p = 0; p < slot_of.size(); ++p) {
                const PlyProperty& property = element.properties[p];
                if (property.is_list) {
                    values_.Skip(property.type, Count(property));
                } else {
                    v[slot_of[p]] = static_cast<float>(values_.Next(property.type));
                }
            }
            mesh_.positions[i] = {v[0], v[1], v[2]};
            if (has_normals) {
                mesh_.normals[i] = {v[3], v[4], v[5]};
            }
            if (has_uvs) {
                mesh_.uvs[i] = {v[6], v[7]};
            }
        }
    }

    // Faces, and what is passed over.
    void ReadOthers(const PlyElement& element) {
        int indices = -1;
        if (element.name == "face") {
            indices = std::max(element.Find("vertex_indices"), element.Find("vertex_index"));
            room_->Reserve(&mesh_.triangles, static_cast<std::size_t>(element.count),
                           [&] { return fmt::format("{}: {} faces", name_, element.count); });
        }
        for (std::uint64_t i = 0; i < element.count; ++i) {
            for (std::size_t p = 0; p < element.properties.size(); ++p) {
                const PlyProperty& property = element.properties[p];
                const std::uint64_t count = property.is_list ? Count(property) : 1;
                if (static_cast<int>(p) == indices && property.is_list) {
                    ReadFace(property.type, count);
                } else {
                    values_.Skip(property.type, count);
                }
            }
        }
    }

    void ReadFace(PlyType type, std::uint64_t count) {
        std::uint32_t first = 0, last = 0;
        for (std::uint64_t i = 0; i < count; ++i) {
            const double value = values_.Next(type);
            if (!(value >= 0) || !(value <= std::numeric_limits<std::int32_t>::max())) {
                Fail(fmt::format("a face refers to vertex {}", value));
            }
            const auto index = static_cast<std::uint32_t>(value);
            if (i >= 2) {
                room_->ForOneMore(mesh_.triangles, [&] {
                    return fmt::format("{}: face {}", name_, mesh_.triangles.size());
                });
                mesh_.triangles.push_back({first, last, index});
            }
            first = i == 0 ? index : first;
            last = index;
        }
    }

    // A list's count; each entry takes at least one byte.
    std::uint64_t Count(const PlyProperty& property) {
        const double count = values_.Next(property.count_type);
        if (!(count >= 0)) {
            Fail("the count of a list is negative");
        }
        values_.Require(count <= static_cast<double>(values_.left()));
        return static_cast<std::uint64_t>(count);
    }

    const std::string& name_;
    ArrayRoom* room_;
    PlyHeader header_;
    Values values_;
    PlyMesh mesh_;
};

}  // namespace

PlyMesh ReadPly(std::string_view bytes, const std::string& name, ArrayRoom* room) {
    ArrayRoom endless(std::numeric_limits<std::uint64_t>::max());
    return Reader(bytes, name, room == nullptr ? &endless : room).Read();
}

}  // namespace relume
