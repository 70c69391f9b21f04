#include "core/image/float_formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>

#include "core/base/error.h"
#include "core/image/image.h"

namespace relume {
namespace {

static_assert(std::endian::native == std::endian::little);

[[noreturn]] void ThrowTruncated(const std::string& name) {
    throw Error(ErrorCode::kDataLoss, name + ": the picture is truncated; restore the file");
}

[[noreturn]] void ThrowDamaged(const std::string& name, const std::string& what) {
    throw Error(ErrorCode::kDataLoss,
                fmt::format("{}: the picture is damaged ({}); restore the file", name, what));
}

// Takes bytes, lines and words from the front; past the end is an Error.
class Cursor {
  public:
    Cursor(std::string_view bytes, const std::string& name) : rest_(bytes), name_(name) {}

    std::size_t left() const { return rest_.size(); }
    std::uint8_t Peek(std::size_t at) const {
        return at < rest_.size() ? static_cast<std::uint8_t>(rest_[at]) : 0;
    }
    std::string_view Take(std::size_t n) {
        if (n > rest_.size()) {
            ThrowTruncated(name_);
        }
        const auto taken = rest_.substr(0, n);
        rest_.remove_prefix(n);
        return taken;
    }
    std::uint8_t Byte() { return static_cast<std::uint8_t>(Take(1)[0]); }
    // Up to a line feed, which is taken too.
    std::string_view Line() {
        const auto line =
            Take(rest_.find('\n') == rest_.npos ? rest_.size() + 1 : rest_.find('\n'));
        Take(1);
        return line;
    }
    // The next word and the one white space behind it.
    std::string_view Word() {
        const auto start = std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size());
        Take(start);
        const auto end = rest_.find_first_of(" \t\r\n");
        const auto word = Take(end == rest_.npos ? rest_.size() + 1 : end);
        Take(1);
        return word;
    }

  private:
    std::string_view rest_;
    const std::string& name_;
};

template <typename T>
T ToNumber(std::string_view text, const std::string& name) {
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) {
        ThrowDamaged(name, fmt::format("'{}' where a number is due", text));
    }
    return value;
}

// One scanline of RGBE, component after component (Ward, "Real Pixels", Graphics Gems II).
void ReadRuns(Cursor& in, std::size_t width, std::vector<std::uint8_t>& line,
              const std::string& name) {
    for (std::size_t c = 0; c < 4; ++c) {
        for (std::size_t x = 0; x < width;) {
            const std::uint8_t code = in.Byte();
            const std::size_t n = code > 128 ? code - 128u : code;
            if (n == 0 || n > width - x) {
                ThrowDamaged(name, "a run is too long or empty");
            }
            if (code > 128) {
                std::fill_n(line.begin() + static_cast<std::ptrdiff_t>(c * width + x), n,
                            in.Byte());
            } else {
                std::memcpy(&line[c * width + x], in.Take(n).data(), n);
            }
            x += n;
        }
    }
}

void StoreRgbe(float* rgb, std::uint8_t r, std::uint8_t g, std::uint8_t b, std::uint8_t e) {
    const float scale = e == 0 ? 0.0f : std::ldexp(1.0f, e - (128 + 8));
    rgb[0] = static_cast<float>(r) * scale;
    rgb[1] = static_cast<float>(g) * scale;
    rgb[2] = static_cast<float>(b) * scale;
}

}  // namespace

void CheckImageSize(std::int64_t width, std::int64_t height, const std::string& name) {
    if (width < 1 || height < 1) {
        ThrowInvalidArgument(name + ": the picture has no pixels; replace it");
    }
    if (width > kMaxReadPixels / height) {
        throw Error(ErrorCode::kResourceExhausted,
                    fmt::format("{}: {}x{} pixels are too many; at most {} are read", name, width,
                                height, kMaxReadPixels));
    }
}

DecodedImage DecodeHdr(std::string_view bytes, const std::string& name) {
    Cursor in(bytes, name);
    for (auto line = in.Line(); !line.empty(); line = in.Line()) {
        if (line.substr(0, 7) == "FORMAT=" && line.substr(7, 15) != "32-bit_rle_rgbe") {
            ThrowInvalidArgument(
                fmt::format("{}: its {} is not 32-bit_rle_rgbe; convert it", name, line));
        }
    }
    const std::string_view line = in.Line();
    const auto x = line.find(" +X ");
    if (line.substr(0, 3) != "-Y " || x == line.npos || x < 3) {
        ThrowInvalidArgument(name + ": its pixels are not in rows from the top; convert it");
    }
    const auto height = ToNumber<std::int64_t>(line.substr(3, x - 3), name);
    const auto width = ToNumber<std::int64_t>(line.substr(x + 4), name);
    CheckImageSize(width, height, name);
    // A run of at most 127 pixels takes two bytes.
    if (width * height / 64 > static_cast<std::int64_t>(in.left())) {
        ThrowTruncated(name);
    }
    DecodedImage image{static_cast<int>(width), static_cast<int>(height), 3, {}, {}};
    const auto w = static_cast<std::size_t>(width);
    image.floats.resize(w * static_cast<std::size_t>(height) * 3);
    std::vector<std::uint8_t> runs(w * 4);
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
        float* row = &image.floats[y * w * 3];
        const bool encoded = w >= 8 && w < 32768 && in.Peek(0) == 2 && in.Peek(1) == 2 &&
                             (in.Peek(2) << 8 | in.Peek(3)) == static_cast<int>(width);
        if (encoded) {
            in.Take(4);
            ReadRuns(in, w, runs, name);
            for (std::size_t i = 0; i < w; ++i) {
                StoreRgbe(row + 3 * i, runs[i], runs[w + i], runs[2 * w + i], runs[3 * w + i]);
            }
        } else {
            const std::string_view flat = in.Take(w * 4);
            for (std::size_t i = 0; i < w; ++i) {
                std::uint8_t rgbe[4];
                std::memcpy(rgbe, flat.data() + 4 * i, 4);
                StoreRgbe(row + 3 * i, rgbe[0], rgbe[1], rgbe[2], rgbe[3]);
            }
        }
    }
    return image;
}

DecodedImage DecodePfm(std::string_view bytes, const std::string& name) {
    Cursor in(bytes, name);
    const int channels = in.Word() == "PF" ? 3 : 1;
    const auto width = ToNumber<std::int64_t>(in.Word(), name);
    const auto height = ToNumber<std::int64_t>(in.Word(), name);
    const auto scale = ToNumber<float>(in.Word(), name);
    CheckImageSize(width, height, name);
    if (!std::isfinite(scale) || scale == 0) {
        ThrowDamaged(name, "its scale is not a number other than 0");
    }
    const std::size_t row = static_cast<std::size_t>(width) * static_cast<std::size_t>(channels);
    const std::string_view pixels = in.Take(row * static_cast<std::size_t>(height) * 4);
    DecodedImage image{static_cast<int>(width), static_cast<int>(height), channels, {}, {}};
    image.floats.resize(row * static_cast<std::size_t>(height));
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
        // Rows are stored from the bottom.
        float* to = &image.floats[(static_cast<std::size_t>(height) - 1 - y) * row];
        for (std::size_t i = 0; i < row; ++i) {
            std::uint32_t bits;
            std::memcpy(&bits, pixels.data() + (y * row + i) * 4, 4);
            to[i] =
                std::bit_cast<float>(scale < 0 ? bits : __builtin_bswap32(bits)) * std::abs(scale);
        }
    }
    return image;
}

}  // namespace relume
