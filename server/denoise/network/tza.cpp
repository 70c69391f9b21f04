#include "server/denoise/network/tza.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <cstring>

#include "core/base/error.h"
#include "core/base/files.h"
#include "server/denoise/network/half_floats.h"

namespace relume::denoise {
namespace {

static_assert(std::endian::native == std::endian::little, "archives are little-endian");

constexpr std::uint16_t kMagic = 0x41d7;
constexpr std::uint8_t kMajor = 2;
constexpr std::size_t kAlignment = 64;           // of each tensor's place, bytes
constexpr std::size_t kMostValues = 1ull << 28;  // of a tensor: a gigabyte

class Reader {
  public:
    Reader(std::span<const std::byte> bytes, const std::string& source)
        : bytes_(bytes), source_(source) {}

    [[noreturn]] void Fail(const std::string& what) const {
        ThrowInvalidArgument(fmt::format("{}: {} at byte {}: not a whole tensor archive (.tza)",
                                         source_, what, place_));
    }

    void MoveTo(std::uint64_t place) {
        if (place > bytes_.size()) {
            Fail(fmt::format("a reference beyond the end, to byte {},", place));
        }
        place_ = static_cast<std::size_t>(place);
    }

    std::span<const std::byte> Take(std::size_t size) {
        if (size > bytes_.size() - place_) {
            Fail("it ends");
        }
        const auto taken = bytes_.subspan(place_, size);
        place_ += size;
        return taken;
    }

    template <typename T>
    T Take() {
        T value;
        std::memcpy(&value, Take(sizeof value).data(), sizeof value);
        return value;
    }

    std::string TakeText(std::size_t size) {
        const auto text = Take(size);
        return {reinterpret_cast<const char*>(text.data()), size};
    }

  private:
    std::span<const std::byte> bytes_;
    const std::string& source_;
    std::size_t place_ = 0;
};

std::vector<float> TakeValues(Reader reader, std::uint64_t place, std::size_t count, char type) {
    reader.MoveTo(place);
    const auto bytes = reader.Take(count * (type == 'f' ? 4 : 2));
    std::vector<float> values(count);
    if (type == 'f') {
        std::memcpy(values.data(), bytes.data(), bytes.size());
        return values;
    }
    for (std::size_t i = 0; i < count; ++i) {
        std::uint16_t half;
        std::memcpy(&half, &bytes[2 * i], 2);
        values[i] = HalfToFloat(half);
    }
    return values;
}

template <typename T>
void Append(std::string* to, T value) {
    to->append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

TensorArchive ParseTza(std::span<const std::byte> bytes, const std::string& source) {
    Reader reader(bytes, source);
    if (reader.Take<std::uint16_t>() != kMagic) {
        reader.Fail("wrong magic number");
    }
    const auto major = reader.Take<std::uint8_t>();
    (void)reader.Take<std::uint8_t>();
    if (major != kMajor) {
        reader.Fail(fmt::format("version {}, where 2 is known,", major));
    }
    reader.MoveTo(reader.Take<std::uint64_t>());
    const auto count = reader.Take<std::uint32_t>();
    TensorArchive archive;
    std::size_t all_values = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::string name = reader.TakeText(reader.Take<std::uint16_t>());
        const std::size_t dimensions = reader.Take<std::uint8_t>();
        Tensor tensor;
        std::size_t values = 1;
        for (std::size_t d = 0; d < dimensions; ++d) {
            const auto size = reader.Take<std::uint32_t>();
            if (size == 0 || size > kMostValues / values) {
                reader.Fail(fmt::format("tensor '{}' has a side of {}", name, size));
            }
            values *= size;
            tensor.shape.push_back(static_cast<int>(size));
        }
        const std::string layout = reader.TakeText(dimensions);
        if (layout != "oihw" && layout != "x") {
            reader.Fail(fmt::format("tensor '{}' has a layout other than oihw and x", name));
        }
        const char type = reader.Take<char>();
        if (type != 'f' && type != 'h') {
            reader.Fail(fmt::format("tensor '{}' has a type other than f and h", name));
        }
        all_values += values;
        if (all_values > bytes.size() / 2) {  // even as halves, each at a place of its own
            reader.Fail("more values than it has room for");
        }
        tensor.values = TakeValues(reader, reader.Take<std::uint64_t>(), values, type);
        if (!archive.emplace(name, std::move(tensor)).second) {
            reader.Fail(fmt::format("a second tensor '{}'", name));
        }
    }
    return archive;
}

TensorArchive ReadTza(const std::string& path) {
    const std::string bytes = ReadFile(path);
    return ParseTza(std::as_bytes(std::span(bytes)), path);
}

std::string FormatTza(const TensorArchive& archive, TensorType type) {
    std::string bytes, table;
    Append(&bytes, kMagic);
    Append(&bytes, kMajor);
    Append(&bytes, std::uint8_t{0});
    Append(&bytes, std::uint64_t{0});  // the table's place, below
    Append(&table, static_cast<std::uint32_t>(archive.size()));
    const auto align = [&] {
        bytes.resize((bytes.size() + kAlignment - 1) / kAlignment * kAlignment);
    };
    for (const auto& [name, tensor] : archive) {
        align();
        Append(&table, static_cast<std::uint16_t>(name.size()));
        table += name;
        Append(&table, static_cast<std::uint8_t>(tensor.shape.size()));
        for (const int size : tensor.shape) {
            Append(&table, static_cast<std::uint32_t>(size));
        }
        table += tensor.shape.size() == 4 ? "oihw" : "x";
        table += type == TensorType::kFloat ? 'f' : 'h';
        Append(&table, static_cast<std::uint64_t>(bytes.size()));
        for (const float value : tensor.values) {
            if (type == TensorType::kFloat) {
                Append(&bytes, value);
            } else {
                Append(&bytes, FloatToHalf(value));
            }
        }
    }
    align();
    const std::uint64_t place = bytes.size();
    std::memcpy(&bytes[4], &place, sizeof place);
    return bytes + table;
}

}  // namespace relume::denoise
