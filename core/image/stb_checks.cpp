#include "core/image/stb_checks.h"

#include <cstdint>

#include "core/base/error.h"
#include "core/image/float_formats.h"

namespace relume {
namespace {

// 0 past the end: whoever asks has checked, or stb will see the end, too.
std::size_t Byte(std::string_view bytes, std::size_t at) {
    return at < bytes.size() ? static_cast<unsigned char>(bytes[at]) : 0;
}
std::size_t Big16(std::string_view bytes, std::size_t at) {
    return Byte(bytes, at) << 8 | Byte(bytes, at + 1);
}
std::size_t Little16(std::string_view bytes, std::size_t at) {
    return Byte(bytes, at) | Byte(bytes, at + 1) << 8;
}

// The tables of a DHT segment (ITU T.81, B.2.4.2): class and slot, 16 counts, the symbols.
void CheckHuffmanTables(std::string_view segment, const std::string& name) {
    for (std::size_t at = 0; at < segment.size();) {
        std::size_t codes = 0;
        for (std::size_t i = 1; i <= 16; ++i) {
            codes += Byte(segment, at + i);
        }
        if (codes > 256) {
            throw Error(ErrorCode::kDataLoss,
                        name + ": the picture is damaged (bad Huffman table); restore the file");
        }
        at += 17 + codes;
    }
}

}  // namespace

void CheckPngForStb(std::string_view bytes, const std::string& name) {
    if (bytes.size() >= 24) {
        const auto number = [&](std::size_t at) {
            return static_cast<std::int64_t>(Big16(bytes, at) << 16 | Big16(bytes, at + 2));
        };
        CheckImageSize(number(16), number(20), name);
    }
}

void CheckJpegForStb(std::string_view bytes, const std::string& name) {
    // Markers are 0xff and a byte; all but these are followed by a length and that many bytes.
    const auto stands_alone = [](std::size_t marker) {
        return marker <= 0x01 || (marker >= 0xd0 && marker <= 0xd9);
    };
    for (std::size_t at = 2; (at = bytes.find('\xff', at)) != bytes.npos;) {
        while (Byte(bytes, at) == 0xff) {
            ++at;
        }
        const std::size_t marker = Byte(bytes, at++);
        if (stands_alone(marker)) {
            continue;
        }
        constexpr std::size_t kDefineHuffmanTables = 0xc4;
        const std::size_t length = Big16(bytes, at);
        if (marker == kDefineHuffmanTables && at + 2 < bytes.size() && length > 2) {
            CheckHuffmanTables(bytes.substr(at + 2, length - 2), name);
        }
        at += length;
    }
}

void CheckTgaForStb(std::string_view bytes, const std::string& name) {
    // Truevision TGA 2.0, figure 1. Run-length encoded types are above 8: stb asks for their bytes
    // one by one, and sees the end.
    if (Byte(bytes, 2) > 3) {
        return;
    }
    const std::size_t palette =
        Byte(bytes, 1) == 0 ? 0 : Little16(bytes, 5) * ((Byte(bytes, 7) + 7) / 8);
    const std::size_t pixels = Little16(bytes, 12) * Little16(bytes, 14);
    if (bytes.size() < 18 + Byte(bytes, 0) + palette + pixels * ((Byte(bytes, 16) + 7) / 8)) {
        throw Error(ErrorCode::kDataLoss, name + ": the picture is truncated; restore the file");
    }
}

}  // namespace relume
