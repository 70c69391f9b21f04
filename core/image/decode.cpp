#include "core/image/decode.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <new>

#include "core/base/error.h"
#include "core/image/exr.h"
#include "core/image/float_formats.h"
#include "core/image/stb_checks.h"

namespace {

// stb says nothing of memory that it did not get, or calls the picture damaged.
thread_local bool memory_is_short = false;

void* Noted(void* memory) {
    memory_is_short = memory_is_short || memory == nullptr;
    return memory;
}

}  // namespace

// Static, so that another copy of the library in the program does no harm.
#define STB_IMAGE_IMPLEMENTATION
// Damaged bytes are no broken invariant. Zeroed memory: a JPEG may use a table that it never
// defined.
#define STBI_ASSERT(condition) static_cast<void>(0)
#define STBI_MALLOC(size) Noted(std::calloc(1, size))
#define STBI_REALLOC(pointer, size) Noted(std::realloc(pointer, size))
#define STBI_FREE(pointer) std::free(pointer)
#define STB_IMAGE_STATIC
#define STBI_NO_STDIO
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#define STBI_ONLY_TGA
#include <stb/stb_image.h>

namespace relume {
namespace {

bool StartsWith(std::string_view bytes, std::string_view magic) {
    return bytes.substr(0, magic.size()) == magic;
}

// Feeds stb and notes whether it asked for more than there is, since it takes zeros for missing
// bytes.
struct Feed {
    std::string_view rest;
    bool past_end = false;

    static int Read(void* user, char* to, int n) {
        auto* feed = static_cast<Feed*>(user);
        const std::size_t taken = std::min(feed->rest.size(), static_cast<std::size_t>(n));
        feed->past_end = feed->past_end || (feed->rest.empty() && n > 0);
        std::memcpy(to, feed->rest.data(), taken);
        feed->rest.remove_prefix(taken);
        return static_cast<int>(taken);
    }
    static void Skip(void* user, int n) {
        auto* feed = static_cast<Feed*>(user);
        const auto wanted = static_cast<std::size_t>(std::max(n, 0));
        feed->past_end = feed->past_end || wanted > feed->rest.size();
        feed->rest.remove_prefix(std::min(wanted, feed->rest.size()));
    }
    static int AtEnd(void* user) { return static_cast<Feed*>(user)->rest.empty() ? 1 : 0; }
};

constexpr stbi_io_callbacks kFeedCallbacks{Feed::Read, Feed::Skip, Feed::AtEnd};

DecodedImage DecodeWithStb(std::string_view bytes, const std::string& name) {
    const bool is_png = StartsWith(bytes, "\x89PNG\r\n\x1a\n");
    const bool is_jpeg = StartsWith(bytes, "\xff\xd8");
    const bool has_magic = is_png || is_jpeg;
    DecodedImage image;
    memory_is_short = false;
    const auto fail = [&](const Feed& feed) {
        if (memory_is_short) {
            throw std::bad_alloc();
        }
        if (!has_magic && image.width == 0) {
            ThrowInvalidArgument(fmt::format(
                "{}: is not a PNG, JPEG, TGA, Radiance HDR, OpenEXR or PFM picture; convert it",
                name));
        }
        throw Error(
            ErrorCode::kDataLoss,
            fmt::format(
                "{}: the picture is {}; restore the file", name,
                feed.past_end ? "truncated" : fmt::format("damaged ({})", stbi_failure_reason())));
    };
    if (is_png) {
        CheckPngForStb(bytes, name);
    } else if (is_jpeg) {
        CheckJpegForStb(bytes, name);
    }
    Feed header{bytes};
    if (stbi_info_from_callbacks(&kFeedCallbacks, &header, &image.width, &image.height,
                                 &image.channels) == 0) {
        image.width = 0;
        fail(header);
    }
    CheckImageSize(image.width, image.height, name);
    if (!has_magic) {
        CheckTgaForStb(bytes, name);
    }
    // No byte stands for more: a PNG has 8 pixels of one bit in each of at most 1032 bytes, a JPEG
    // has a bit a block. Refused before memory is taken for what can't be there.
    if (std::int64_t{image.width} * image.height / 8256 > static_cast<std::int64_t>(bytes.size())) {
        header.past_end = true;
        fail(header);
    }
    Feed feed{bytes};
    const std::unique_ptr<stbi_uc, decltype(&stbi_image_free)> pixels(
        stbi_load_from_callbacks(&kFeedCallbacks, &feed, &image.width, &image.height,
                                 &image.channels, 0),
        &stbi_image_free);
    if (pixels == nullptr || feed.past_end) {
        fail(feed);
    }
    image.bytes.assign(pixels.get(),
                       pixels.get() + std::size_t{1} * image.width * image.height * image.channels);
    return image;
}

// R G B (A), else the one channel there is or Y.
DecodedImage DecodeExr(std::string_view bytes, const std::string& name) {
    const Image exr = ParseExr(bytes, name);
    std::vector<std::string> channels;
    if (exr.Has("R") && exr.Has("G") && exr.Has("B")) {
        channels = {"R", "G", "B"};
        if (exr.Has("A")) {
            channels.emplace_back("A");
        }
    } else if (exr.channels().size() == 1) {
        channels = exr.channels();
    } else if (exr.Has("Y")) {
        channels = {"Y"};
    } else {
        ThrowInvalidArgument(fmt::format("{}: a texture needs the channels R, G, B or Y; it has {}",
                                         name, fmt::join(exr.channels(), ", ")));
    }
    DecodedImage image{exr.width(), exr.height(), static_cast<int>(channels.size()), {}, {}};
    image.floats.resize(exr.pixel_count() * channels.size());
    for (std::size_t c = 0; c < channels.size(); ++c) {
        const auto plane = exr.Plane(channels[c]);
        for (std::size_t i = 0; i < plane.size(); ++i) {
            image.floats[i * channels.size() + c] = plane[i];
        }
    }
    return image;
}

}  // namespace

DecodedImage DecodeImage(std::string_view bytes, const std::string& name) {
    if (StartsWith(bytes, "#?RADIANCE") || StartsWith(bytes, "#?RGBE")) {
        return DecodeHdr(bytes, name);
    }
    if (StartsWith(bytes, "\x76\x2f\x31\x01")) {
        return DecodeExr(bytes, name);
    }
    if (StartsWith(bytes, "PF\n") || StartsWith(bytes, "Pf\n")) {
        return DecodePfm(bytes, name);
    }
    return DecodeWithStb(bytes, name);
}

}  // namespace relume
