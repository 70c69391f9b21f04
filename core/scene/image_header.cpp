#include "core/scene/image_header.h"

#include <fmt/format.h>

#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <limits>

#include "core/base/error.h"

namespace relume {
namespace {

[[noreturn]] void ThrowTruncated(const std::string& name) {
    throw Error(ErrorCode::kDataLoss,
                fmt::format("{}: the picture is truncated; restore the file", name));
}

// Reads numbers at an offset; past the end is an Error, so that no check is forgotten.
class Reader {
  public:
    Reader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

    std::uint32_t Byte(std::size_t at) const {
        if (at >= bytes_.size()) {
            ThrowTruncated(name_);
        }
        return static_cast<unsigned char>(bytes_[at]);
    }
    std::uint32_t Big16(std::size_t at) const { return Byte(at) << 8 | Byte(at + 1); }
    std::uint32_t Big32(std::size_t at) const { return Big16(at) << 16 | Big16(at + 2); }
    std::uint32_t Little16(std::size_t at) const { return Byte(at) | Byte(at + 1) << 8; }
    std::uint32_t Little32(std::size_t at) const { return Little16(at) | Little16(at + 2) << 16; }
    // Up to `end`, which is not part of it; `at` moves behind `end`.
    std::string_view Until(char end, std::size_t* at) const {
        const auto found = bytes_.find(end, *at);
        if (found == std::string_view::npos) {
            ThrowTruncated(name_);
        }
        const std::string_view text = bytes_.substr(*at, found - *at);
        *at = found + 1;
        return text;
    }

  private:
    std::string_view bytes_;
    const std::string& name_;
};

bool StartsWith(std::string_view bytes, std::string_view magic) {
    return bytes.substr(0, magic.size()) == magic;
}

ImageSize Size(std::uint32_t width, std::uint32_t height) {
    constexpr std::uint32_t kMax = std::numeric_limits<int>::max();
    return width > kMax || height > kMax
               ? ImageSize{}
               : ImageSize{static_cast<int>(width), static_cast<int>(height), false};
}

// PNG, section 5: a signature, then chunks of length, type, data and CRC; IHDR first, IEND last.
ImageSize PngSize(std::string_view bytes, const std::string& name) {
    const Reader reader(bytes, name);
    for (std::size_t at = 8;; at += std::size_t{12} + reader.Big32(at)) {
        if (at + 12 > bytes.size()) {
            ThrowTruncated(name);
        }
        if (bytes.substr(at + 4, 4) == "IEND") {
            break;
        }
    }
    return Size(reader.Big32(16), reader.Big32(20));
}

// JPEG, ITU T.81 annex B: segments of marker and length up to the frame header (SOF) that has the
// size.
ImageSize JpegSize(std::string_view bytes, const std::string& name) {
    const Reader reader(bytes, name);
    for (std::size_t at = 2;;) {
        if (reader.Byte(at) != 0xff) {
            ThrowTruncated(name);
        }
        const std::uint32_t marker = reader.Byte(at + 1);
        if (marker == 0xff) {
            ++at;  // fill byte
            continue;
        }
        const bool frame =
            marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
        if (frame) {
            // The end marker; one further up would be a thumbnail's.
            const auto end = bytes.rfind("\xff\xd9");
            if (end == std::string_view::npos || end < at) {
                ThrowTruncated(name);
            }
            return Size(reader.Big16(at + 7), reader.Big16(at + 5));
        }
        at += std::size_t{2} + reader.Big16(at + 2);
    }
}

// A whole number at the start of `text`; 0 if there is none.
int LeadingNumber(std::string_view text) {
    int value = 0;
    std::from_chars(text.data(), text.data() + text.size(), value);
    return value;
}

// Radiance: lines, an empty one, then "-Y height +X width".
ImageSize HdrSize(std::string_view bytes, const std::string& name) {
    const Reader reader(bytes, name);
    std::size_t at = 0;
    while (!reader.Until('\n', &at).empty()) {
    }
    const std::string_view line = reader.Until('\n', &at);
    const auto x = line.find("X ");
    if (!StartsWith(line, "-Y ") || x == std::string_view::npos) {
        ThrowInvalidArgument(
            fmt::format("{}: its pixels are not in rows from the top; convert the picture", name));
    }
    return {LeadingNumber(line.substr(x + 2)), LeadingNumber(line.substr(3)), false};
}

// OpenEXR: attributes of name, type, size and value; dataWindow is four 32-bit numbers, both ends
// included.
ImageSize ExrSize(std::string_view bytes, const std::string& name) {
    const Reader reader(bytes, name);
    for (std::size_t at = 8;;) {
        const std::string_view attribute = reader.Until('\0', &at);
        if (attribute.empty()) {
            ThrowInvalidArgument(fmt::format("{}: has no data window; replace the picture", name));
        }
        reader.Until('\0', &at);
        const std::uint32_t size = reader.Little32(at);
        at += 4;
        if (attribute == "dataWindow") {
            return Size(reader.Little32(at + 8) - reader.Little32(at) + 1,
                        reader.Little32(at + 12) - reader.Little32(at + 4) + 1);
        }
        at += size;
    }
}

// PFM: "PF" or "Pf", width and height, scale; then 32-bit floats.
ImageSize PfmSize(std::string_view bytes, const std::string& name) {
    const Reader reader(bytes, name);
    std::size_t at = 3;
    std::string header = std::string(reader.Until('\n', &at));
    if (header.find(' ') == std::string::npos) {
        header += ' ';
        header += reader.Until('\n', &at);
    }
    reader.Until('\n', &at);  // scale
    const ImageSize size{LeadingNumber(header),
                         LeadingNumber(std::string_view(header).substr(header.find(' ') + 1))};
    const std::uint64_t channels = bytes[1] == 'F' ? 3 : 1;
    if (size.width > 0 && size.height > 0 &&
        (bytes.size() - at) / 4 / channels / static_cast<std::uint64_t>(size.width) <
            static_cast<std::uint64_t>(size.height)) {
        ThrowTruncated(name);
    }
    return size;
}

// TGA has no signature: a header that is plausible in each field.
bool IsTga(std::string_view bytes) {
    if (bytes.size() < 18) {
        return false;
    }
    const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(bytes[at]); };
    const int type = byte(2), depth = byte(16);
    return byte(1) <= 1 && (type == 1 || type == 2 || type == 3 || (type >= 9 && type <= 11)) &&
           (depth == 8 || depth == 15 || depth == 16 || depth == 24 || depth == 32);
}

ImageSize SizeOf(std::string_view bytes, const std::string& name) {
    if (StartsWith(bytes, "\x89PNG\r\n\x1a\n")) {
        return PngSize(bytes, name);
    }
    if (StartsWith(bytes, "\xff\xd8")) {
        return JpegSize(bytes, name);
    }
    if (StartsWith(bytes, "#?RADIANCE") || StartsWith(bytes, "#?RGBE")) {
        return HdrSize(bytes, name);
    }
    if (StartsWith(bytes, "\x76\x2f\x31\x01")) {
        return ExrSize(bytes, name);
    }
    if (StartsWith(bytes, "PF\n") || StartsWith(bytes, "Pf\n")) {
        return PfmSize(bytes, name);
    }
    if (IsTga(bytes)) {
        const Reader reader(bytes, name);
        return Size(reader.Little16(12), reader.Little16(14));
    }
    ThrowInvalidArgument(fmt::format(
        "{}: is not a PNG, JPEG, TGA, Radiance HDR, OpenEXR or PFM picture; convert it", name));
}

}  // namespace

ImageSize ReadImageHeader(std::string_view bytes, const std::string& name) {
    ImageSize size = SizeOf(bytes, name);
    if (size.width < 1 || size.height < 1) {
        ThrowInvalidArgument(fmt::format("{}: the picture has no pixels; replace it", name));
    }
    size.floats = bytes.starts_with("#?") || bytes.starts_with("PF") || bytes.starts_with("Pf") ||
                  bytes.starts_with("\x76\x2f\x31\x01");
    return size;
}

}  // namespace relume
