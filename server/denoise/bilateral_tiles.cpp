#include "server/denoise/bilateral_tiles.h"

#include <algorithm>

#include "core/base/parallel.h"
#include "server/denoise/cancelled.h"

namespace relume::denoise {
namespace {

// Guides beyond this would overflow the product of the three denominators.
constexpr float kLargestGuide = 1e4f;

// Copies a group of `count` features from `first` on, divided by `scale`; zeros if the frame lacks
// it.
void AddGroup(const Frame& frame, int first, int count, float scale, const char* name, Plane* to,
              Plane* variance, std::string* names) {
    variance->assign(frame.pixel_count(), 0.0f);
    if (frame.feature[first].empty()) {
        std::fill_n(to, count, Plane(frame.pixel_count(), 0.0f));
        return;
    }
    *names += (names->empty() ? "" : ", ") + std::string(name);
    for (int k = 0; k < count; ++k) {
        to[k] = frame.feature[first + k];
        for (float& value : to[k]) {
            value = std::clamp(value * scale, -kLargestGuide, kLargestGuide);
        }
        const Plane& from = frame.feature_variance[first + k];
        for (std::size_t i = 0; i < from.size(); ++i) {
            (*variance)[i] = std::min((*variance)[i] + from[i] * scale * scale, kLargestGuide);
        }
    }
}

}  // namespace

Guides MakeGuides(const Frame& frame) {
    float largest = 0;
    for (const float z : frame.feature[kDepth]) {
        largest = std::max(largest, z);
    }
    Guides guides;
    AddGroup(frame, kNormalX, 3, 1, "normal", guides.feature, &guides.variance[0], &guides.names);
    AddGroup(frame, kAlbedoR, 3, 1, "albedo", guides.feature + 3, &guides.variance[1],
             &guides.names);
    AddGroup(frame, kDepth, 1, largest > 0 ? 1 / largest : 0, "depth", guides.feature + 6,
             &guides.variance[2], &guides.names);
    return guides;
}

TilePlanes::TilePlanes(int count, const TileShape& shape)
    : shape_(shape),
      stride_(PlaneStride(shape.width, shape.halo)),
      plane_size_(PlaneSize(shape.width, shape.height, shape.halo)),
      data_(static_cast<std::size_t>(count * plane_size_)) {
    for (int p = 0; p < count; ++p) {
        planes_.push_back(data_.data() + p * plane_size_ + shape.halo * stride_ + shape.halo);
    }
}

void TilePlanes::Load(int index, const Plane& plane, int width, int height, int x0, int y0,
                      float outside) {
    float* to = data_.data() + index * plane_size_;
    const int left = x0 - shape_.halo, from = std::max(left, 0);
    const int until = std::clamp(left + static_cast<int>(stride_), from, std::max(width, from));
    for (int y = y0 - shape_.halo; y < y0 + shape_.height + shape_.halo; ++y, to += stride_) {
        if (y < 0 || y >= height) {
            std::fill_n(to, stride_, outside);
            continue;
        }
        const auto row = plane.begin() + static_cast<std::ptrdiff_t>(y) * width;
        std::fill_n(to, from - left, outside);
        std::copy(row + from, row + until, to + (from - left));
        std::fill_n(to + (until - left), stride_ - (until - left), outside);
    }
}

void ForEachTile(const Frame& frame, int planes, int radius, const CancelToken& cancel,
                 const std::function<void(const TileArea&, TilePlanes&)>& body) {
    ForEachTile(frame, {0, frame.height}, planes, {.halo = radius}, cancel, body);
}

void ForEachTile(const Frame& frame, RowRange rows, int planes, const TileShape& shape,
                 const CancelToken& cancel,
                 const std::function<void(const TileArea&, TilePlanes&)>& body) {
    const std::size_t across = static_cast<std::size_t>(frame.width + shape.width - 1) /
                               static_cast<std::size_t>(shape.width);
    const std::size_t down = static_cast<std::size_t>(rows.end - rows.begin + shape.height - 1) /
                             static_cast<std::size_t>(shape.height);
    ParallelFor(0, across * down, 1, [&](std::size_t begin, std::size_t end) {
        TilePlanes scratch(planes, shape);
        for (std::size_t t = begin; t < end; ++t) {
            ThrowIfCancelled(cancel);
            const int x0 = static_cast<int>(t % across) * shape.width;
            const int y0 = rows.begin + static_cast<int>(t / across) * shape.height;
            body({x0, y0, std::min(shape.width, frame.width - x0),
                  std::min(shape.height, rows.end - y0)},
                 scratch);
        }
    });
}

}  // namespace relume::denoise
