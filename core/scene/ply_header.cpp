#include "core/scene/ply_header.h"

#include <fmt/format.h>

#include <charconv>
#include <iterator>

#include "core/base/error.h"

namespace relume {
namespace {

constexpr std::size_t kMaxLines = 1000;

struct TypeName {
    std::string_view name;
    PlyType type;
};
constexpr TypeName kTypes[] = {
    {"char", PlyType::kInt8},       {"int8", PlyType::kInt8},       {"uchar", PlyType::kUInt8},
    {"uint8", PlyType::kUInt8},     {"short", PlyType::kInt16},     {"int16", PlyType::kInt16},
    {"ushort", PlyType::kUInt16},   {"uint16", PlyType::kUInt16},   {"int", PlyType::kInt32},
    {"int32", PlyType::kInt32},     {"uint", PlyType::kUInt32},     {"uint32", PlyType::kUInt32},
    {"float", PlyType::kFloat32},   {"float32", PlyType::kFloat32}, {"double", PlyType::kFloat64},
    {"float64", PlyType::kFloat64},
};

class HeaderReader {
  public:
    HeaderReader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

    PlyHeader Read() {
        NextLine();
        if (words_.size() != 1 || words_[0] != "ply") {
            ThrowInvalidArgument(fmt::format(
                "{}: is not a PLY file (it does not begin with 'ply'); if it is compressed, "
                "unpack it",
                name_));
        }
        for (NextLine(); words_.empty() || words_[0] != "end_header"; NextLine()) {
            if (!words_.empty()) {
                ReadLine();
            }
        }
        if (!has_format_) {
            Fail("the header has no format line");
        }
        header_.size = at_;
        return std::move(header_);
    }

  private:
    [[noreturn]] void Fail(const std::string& problem) const {
        ThrowInvalidArgument(
            fmt::format("{}:{}: {}; export the mesh again", name_, line_, problem));
    }

    void NextLine() {
        const auto end = bytes_.find('\n', at_);
        if (end == std::string_view::npos || ++line_ > kMaxLines) {
            Fail("the header has no end");
        }
        words_.clear();
        for (std::size_t i = at_; i < end;) {
            const auto begin = bytes_.find_first_not_of(" \t\r", i);
            const auto stop = std::min(bytes_.find_first_of(" \t\r\n", begin), end);
            if (begin >= end) {
                break;
            }
            words_.push_back(bytes_.substr(begin, stop - begin));
            i = stop;
        }
        at_ = end + 1;
    }

    void ReadLine() {
        const std::string_view key = words_[0];
        if (key == "format" && words_.size() >= 2) {
            using Format = PlyHeader::Format;
            has_format_ = true;
            if (words_[1] == "ascii") {
                header_.format = Format::kAscii;
            } else if (words_[1] == "binary_little_endian") {
                header_.format = Format::kLittle;
            } else if (words_[1] == "binary_big_endian") {
                header_.format = Format::kBig;
            } else {
                Fail(fmt::format("the format '{}' is not known", words_[1]));
            }
        } else if (key == "element" && words_.size() == 3) {
            PlyElement element;
            element.name = words_[1];
            const std::string_view count = words_[2];
            const auto [end, error] =
                std::from_chars(count.data(), count.data() + count.size(), element.count);
            if (error != std::errc() || end != count.data() + count.size()) {
                Fail(fmt::format("'{}' is not a count", count));
            }
            header_.elements.push_back(std::move(element));
        } else if (key == "property" && !header_.elements.empty()) {
            ReadProperty();
        } else if (key != "comment" && key != "obj_info") {
            Fail(fmt::format("'{}' is not understood here", key));
        }
    }

    void ReadProperty() {
        PlyProperty property;
        property.is_list = words_.size() == 5 && words_[1] == "list";
        if (!property.is_list && words_.size() != 3) {
            Fail("a property has a type and a name");
        }
        if (property.is_list) {
            property.count_type = Type(words_[2]);
        }
        property.type = Type(words_[words_.size() - 2]);
        property.name = words_.back();
        header_.elements.back().properties.push_back(std::move(property));
    }

    PlyType Type(std::string_view name) const {
        for (const TypeName& known : kTypes) {
            if (known.name == name) {
                return known.type;
            }
        }
        Fail(fmt::format("the type '{}' is not known", name));
    }

    std::string_view bytes_;
    const std::string& name_;
    PlyHeader header_;
    std::vector<std::string_view> words_;  // of the current line
    std::size_t at_ = 0, line_ = 0;
    bool has_format_ = false;
};

}  // namespace

std::size_t SizeOf(PlyType type) {
    switch (type) {
        case PlyType::kInt8:
        case PlyType::kUInt8:
            return 1;
        case PlyType::kInt16:
        case PlyType::kUInt16:
            return 2;
        case PlyType::kInt32:
        case PlyType::kUInt32:
        case PlyType::kFloat32:
            return 4;
        case PlyType::kFloat64:
            return 8;
    }
    return 1;
}

std::uint64_t PlyElement::MinimumSize(bool ascii) const {
    std::uint64_t size = 0;
    for (const PlyProperty& property : properties) {
        // A digit and a blank; the file's last number may lack the blank.
        size += ascii ? 2 : SizeOf(property.is_list ? property.count_type : property.type);
    }
    return size;
}

int PlyElement::Find(std::string_view property) const {
    for (std::size_t i = 0; i < properties.size(); ++i) {
        if (properties[i].name == property) {
            return static_cast<int>(i);
        }
    }
    return -1;
}

PlyHeader ReadPlyHeader(std::string_view bytes, const std::string& name) {
    return HeaderReader(bytes, name).Read();
}

}  // namespace relume
