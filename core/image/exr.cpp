#include "core/image/exr.h"

#include <ImfAttribute.h>
#include <ImfChannelList.h>
#include <ImfCompression.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfPartType.h>
#include <ImfStringAttribute.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "core/base/error.h"
#include "core/base/files.h"

namespace relume {
namespace {

// All planes of a file together, 4 GiB.
constexpr std::int64_t kMaxValues = std::int64_t{1} << 30;

// More values than a byte of the file can stand for: a file that claims more is cut short, and is
// refused before memory is taken for it. zlib packs at most 1032 bytes into one (Deutsch, RFC
// 1951; zlib's technical notes), a value has at least two; for the wavelet and block methods the
// bound is a generous one.
std::int64_t MaxValuesPerByte(Imf::Compression compression) {
    switch (compression) {
        case Imf::NO_COMPRESSION:
            return 1;
        case Imf::RLE_COMPRESSION:
        case Imf::ZIPS_COMPRESSION:
        case Imf::ZIP_COMPRESSION:
        case Imf::PXR24_COMPRESSION:
            return 1032;
        default:
            return std::int64_t{1} << 18;
    }
}

[[noreturn]] void ThrowTruncated(const std::string& name) {
    throw Error(ErrorCode::kDataLoss, name + ": the EXR is truncated; restore the file");
}

class MemoryInput final : public Imf::IStream {
  public:
    MemoryInput(std::string_view bytes, const std::string& name)
        : IStream(name.c_str()), bytes_(bytes) {}

    bool read(char* to, int n) override {
        if (n < 0 || at_ > bytes_.size() || static_cast<std::size_t>(n) > bytes_.size() - at_) {
            ThrowTruncated(fileName());
        }
        std::memcpy(to, bytes_.data() + at_, static_cast<std::size_t>(n));
        at_ += static_cast<std::size_t>(n);
        return at_ < bytes_.size();
    }
    std::uint64_t tellg() override { return at_; }
    void seekg(std::uint64_t to) override { at_ = to; }

  private:
    std::string_view bytes_;
    std::uint64_t at_ = 0;
};

class MemoryOutput final : public Imf::OStream {
  public:
    MemoryOutput() : OStream("EXR in memory") {}

    void write(const char* from, int n) override {
        const auto size = static_cast<std::size_t>(n);
        bytes.resize(std::max(bytes.size(), at_ + size));
        std::memcpy(bytes.data() + at_, from, size);
        at_ += size;
    }
    std::uint64_t tellp() override { return at_; }
    void seekp(std::uint64_t to) override { at_ = to; }

    std::string bytes;

  private:
    std::size_t at_ = 0;
};

[[noreturn]] void ThrowTooLarge(const std::string& name, std::int64_t width, std::int64_t height) {
    throw Error(ErrorCode::kResourceExhausted,
                fmt::format("{}: {}x{} pixels are too many; at most {} are read", name, width,
                            height, kMaxReadPixels));
}

// The library takes memory for what headers claim before it looks whether the file can hold it, so
// that they are walked here first (OpenEXR file layout: name, type, size and value of each
// attribute, an empty name at the end of a part, an empty part at the end of many).
void CheckHeaders(std::string_view bytes, const std::string& name) {
    constexpr std::uint32_t kManyParts = 0x1000;
    MemoryInput input(bytes, name);
    input.seekg(4);
    const auto number = [&] {
        std::int32_t value = 0;
        input.read(reinterpret_cast<char*>(&value), 4);
        return value;
    };
    const auto text = [&] {
        const auto end = bytes.find('\0', input.tellg());
        if (end == bytes.npos) {
            ThrowTruncated(name);
        }
        const auto value = bytes.substr(input.tellg(), end - input.tellg());
        input.seekg(end + 1);
        return value;
    };
    const bool many = (static_cast<std::uint32_t>(number()) & kManyParts) != 0;
    do {
        for (auto attribute = text(); !attribute.empty(); attribute = text()) {
            text();
            const std::int32_t size = number();
            if (size < 0 || static_cast<std::uint64_t>(size) > bytes.size() - input.tellg()) {
                ThrowTruncated(name);
            }
            const std::uint64_t next = input.tellg() + static_cast<std::uint64_t>(size);
            if (attribute == "dataWindow") {
                const std::int64_t x0 = number(), y0 = number();
                const std::int64_t width = number() - x0 + 1, height = number() - y0 + 1;
                if (width > 0 && height > 0 && width > kMaxReadPixels / height) {
                    ThrowTooLarge(name, width, height);
                }
                // At most 256 lines share a block, and each block has an entry in a table.
                if (height / 256 > static_cast<std::int64_t>(bytes.size())) {
                    ThrowTruncated(name);
                }
            }
            input.seekg(next);
        }
    } while (many && input.tellg() < bytes.size() && bytes[input.tellg()] != '\0');
}

// Of a part's header these say how the file is laid out, not what it shows.
bool IsStructural(const std::string& attribute) {
    return attribute == "type" || attribute == "name";
}

[[noreturn]] void ThrowUnsupported(const std::string& name, const std::string& what) {
    throw Error(ErrorCode::kUnimplemented,
                fmt::format("{}: {}; convert it to a plain scanline EXR", name, what));
}

// An image of zeros with the windows, channels and texts of the header, after all checks.
Image MakeImage(const Imf::Header& header, std::size_t file_size, const std::string& name) {
    const auto& data = header.dataWindow();
    const auto& display = header.displayWindow();
    const auto extent = [](int low, int high) { return std::int64_t{high} - low + 1; };
    const std::int64_t width = extent(data.min.x, data.max.x);
    const std::int64_t height = extent(data.min.y, data.max.y);
    std::vector<std::string> channels;
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
        if (it.channel().xSampling != 1 || it.channel().ySampling != 1) {
            ThrowUnsupported(name, fmt::format("channel '{}' is subsampled", it.name()));
        }
        channels.emplace_back(it.name());
    }
    if (width < 1 || height < 1 || channels.empty()) {
        ThrowInvalidArgument(name + ": the EXR has no pixels; replace it");
    }
    const auto count = static_cast<std::int64_t>(channels.size());
    if (width > kMaxReadPixels / height) {
        ThrowTooLarge(name, width, height);
    }
    if (count > kMaxValues / (width * height)) {
        throw Error(ErrorCode::kResourceExhausted,
                    fmt::format("{}: {}x{} pixels of {} channels are too much; at most {} values "
                                "are read",
                                name, width, height, count, kMaxValues));
    }
    if (header.hasTileDescription() &&
        std::int64_t{header.tileDescription().xSize} * header.tileDescription().ySize >
            kMaxReadPixels) {
        ThrowUnsupported(name, "its tiles are too large");
    }
    // Above 1 GiB of values the wavelet and block methods get no more than the others.
    constexpr std::int64_t kManyValues = std::int64_t{1} << 28;
    const std::int64_t values = width * height * count;
    const std::int64_t a_byte = MaxValuesPerByte(header.compression());
    if (values / (values > kManyValues ? std::min<std::int64_t>(a_byte, 1032) : a_byte) >
        static_cast<std::int64_t>(file_size)) {
        ThrowTruncated(name);
    }
    Image image(static_cast<int>(width), static_cast<int>(height), channels);
    const auto to_int = [&](std::int64_t value) {
        if (value < std::numeric_limits<int>::min() || value > std::numeric_limits<int>::max()) {
            ThrowInvalidArgument(name + ": the EXR's windows lie too far apart; replace it");
        }
        return static_cast<int>(value);
    };
    image.SetWindow(to_int(std::int64_t{data.min.x} - display.min.x),
                    to_int(std::int64_t{data.min.y} - display.min.y),
                    to_int(extent(display.min.x, display.max.x)),
                    to_int(extent(display.min.y, display.max.y)));
    for (auto it = header.begin(); it != header.end(); ++it) {
        const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute());
        if (text != nullptr && !IsStructural(it.name())) {
            image.metadata()[it.name()] = text->value();
        }
    }
    return image;
}

Imf::Slice FloatSlice(const float* plane, const Imath::Box2i& window, std::int64_t width,
                      std::int64_t height) {
    // The library takes the address that pixel (0, 0) would have, which may lie outside.
    return Imf::Slice::Make(Imf::FLOAT, plane, window.min, width, height, sizeof(float),
                            sizeof(float) * static_cast<std::size_t>(width));
}

Image Parse(std::string_view bytes, const std::string& name) {
    CheckHeaders(bytes, name);
    MemoryInput input(bytes, name);
    Imf::InputFile file(input, 0);
    const Imf::Header& header = file.header();
    Image image = MakeImage(header, bytes.size(), name);
    Imf::FrameBuffer frame;
    for (const auto& channel : image.channels()) {
        frame.insert(channel, FloatSlice(image.Plane(channel).data(), header.dataWindow(),
                                         image.width(), image.height()));
    }
    file.setFrameBuffer(frame);
    file.readPixels(header.dataWindow().min.y, header.dataWindow().max.y);
    return image;
}

std::string Encode(const Image& image) {
    const Imath::Box2i display({0, 0}, {image.display_width() - 1, image.display_height() - 1});
    const Imath::Box2i data({image.x0(), image.y0()},
                            {image.x0() + image.width() - 1, image.y0() + image.height() - 1});
    Imf::Header header(display, data, 1, {0, 0}, 1, Imf::INCREASING_Y, Imf::ZIP_COMPRESSION);
    for (const auto& [key, text] : image.metadata()) {
        if (!IsStructural(key)) {
            header.insert(key, Imf::StringAttribute(text));
        }
    }
    Imf::FrameBuffer frame;
    for (const auto& channel : image.channels()) {
        header.channels().insert(channel, Imf::Channel(Imf::FLOAT));
        frame.insert(channel,
                     FloatSlice(image.Plane(channel).data(), data, image.width(), image.height()));
    }
    MemoryOutput output;
    {
        Imf::OutputFile file(output, header, 0);
        file.setFrameBuffer(frame);
        file.writePixels(image.height());
    }  // the table of lines is written when the file is closed
    return std::move(output.bytes);
}

}  // namespace

Image ParseExr(std::string_view bytes, const std::string& name) {
    if (bytes.substr(0, 4) != "\x76\x2f\x31\x01") {
        ThrowInvalidArgument(name + ": is not an OpenEXR file; convert it");
    }
    try {
        return Parse(bytes, name);
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw Error(ErrorCode::kResourceExhausted,
                    name + ": too little memory for the EXR; use a smaller one");
    } catch (const std::exception& e) {
        throw Error(ErrorCode::kDataLoss,
                    fmt::format("{}: the EXR is damaged ({}); restore the file", name, e.what()));
    }
}

Image ReadExr(const std::filesystem::path& path) { return ParseExr(ReadFile(path), path.string()); }

std::string EncodeExr(const Image& image) {
    if (image.pixel_count() == 0 || image.channels().empty()) {
        ThrowInvalidArgument("an EXR needs at least one pixel and one channel");
    }
    try {
        return Encode(image);
    } catch (const std::exception& e) {
        throw Error(ErrorCode::kInvalidArgument,
                    fmt::format("the image can't be written as EXR: {}", e.what()));
    }
}

void WriteExr(const std::filesystem::path& path, const Image& image) {
    WriteFileAtomically(path, EncodeExr(image));
}

}  // namespace relume
