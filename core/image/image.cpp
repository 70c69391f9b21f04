#include "core/image/image.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

#include "core/base/error.h"
#include "core/base/sha256.h"

namespace relume {

Image::Image(int width, int height, std::vector<std::string> channels)
    : width_(width), height_(height), display_width_(width), display_height_(height) {
    for (const auto& name : channels) {
        Add(name);
    }
}

void Image::SetWindow(int x0, int y0, int display_width, int display_height) {
    x0_ = x0;
    y0_ = y0;
    display_width_ = display_width;
    display_height_ = display_height;
}

int Image::Find(const std::string& channel) const {
    const auto it = std::find(channels_.begin(), channels_.end(), channel);
    return it == channels_.end() ? -1 : static_cast<int>(it - channels_.begin());
}

int Image::Add(const std::string& channel) {
    if (Has(channel)) {
        throw Error(ErrorCode::kAlreadyExists, "the image has a channel '" + channel + "' already");
    }
    channels_.push_back(channel);
    planes_.emplace_back(pixel_count(), 0.0f);
    return static_cast<int>(channels_.size()) - 1;
}

std::span<const float> Image::Plane(const std::string& channel) const {
    const int index = Find(channel);
    if (index < 0) {
        ThrowNotFound(fmt::format("the image has no channel '{}'; it has {}", channel,
                                  fmt::join(channels_, ", ")));
    }
    return Plane(index);
}

std::span<float> Image::Plane(const std::string& channel) {
    const auto plane = static_cast<const Image*>(this)->Plane(channel);
    return {const_cast<float*>(plane.data()), plane.size()};
}

std::string ImageDigest(const Image& image) {
    std::vector<std::size_t> order(image.channels().size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return image.channels()[a] < image.channels()[b];
    });
    Sha256 sha;
    sha.Update(fmt::format("{} {} {} {} {} {}\n", image.x0(), image.y0(), image.width(),
                           image.height(), image.display_width(), image.display_height()));
    for (const std::size_t i : order) {
        sha.Update(image.channels()[i] + "\n");
        const auto plane = image.Plane(static_cast<int>(i));
        sha.Update(plane.data(), plane.size_bytes());
    }
    return sha.HexDigest();
}

}  // namespace relume
