#include "server/denoise/nlm_filter.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/base/parallel.h"

namespace relume::denoise {
namespace {

constexpr int kWidth = 128, kHeight = 64;  // of a tile

// A plane's part around a tile, 0 outside of the image, so that neighbours are read without asking.
class HaloPlane {
  public:
    HaloPlane(int radius)
        : radius_(radius),
          stride_(kWidth + 2 * radius),
          data_(static_cast<std::size_t>(stride_ * (kHeight + 2 * radius) + kNlmLanes)) {}

    void Load(const Plane& plane, int width, int height, const TileRect& tile) {
        std::ranges::fill(data_, 0.0f);
        const int x0 = std::max(tile.x0 - radius_, 0), x1 = std::min(tile.x1 + radius_, width);
        for (int y = std::max(tile.y0 - radius_, 0); y < std::min(tile.y1 + radius_, height); ++y) {
            std::copy_n(plane.data() + static_cast<std::ptrdiff_t>(y) * width + x0, x1 - x0,
                        data_.data() + (y - tile.y0 + radius_) * stride_ + x0 - tile.x0 + radius_);
        }
    }
    const float* At(int dx, int dy) const {
        return data_.data() + (dy + radius_) * stride_ + dx + radius_;
    }
    std::ptrdiff_t stride() const { return stride_; }

  private:
    int radius_;
    std::ptrdiff_t stride_;
    std::vector<float> data_;
};

}  // namespace

void ForEachNlmTile(const NlmGuide& guide, const NlmOptions& options, int radius,
                    const NlmKernels& kernels, const CancelToken& cancel,
                    const std::function<void(NlmWeights&, const TileRect&)>& body) {
    const auto across = static_cast<std::size_t>((guide.width + kWidth - 1) / kWidth);
    const auto down = static_cast<std::size_t>((guide.height + kHeight - 1) / kHeight);
    ParallelFor(0, across * down, 1, [&](std::size_t begin, std::size_t end) {
        NlmWeights weights(options, radius, kWidth, kHeight, kernels);
        for (std::size_t t = begin; t < end; ++t) {
            if (cancel.cancelled()) {
                throw Error(ErrorCode::kCancelled, "the filter was cancelled");
            }
            const int x0 = static_cast<int>(t % across) * kWidth;
            const int y0 = static_cast<int>(t / across) * kHeight;
            const TileRect tile = {x0, y0, std::min(x0 + kWidth, guide.width),
                                   std::min(y0 + kHeight, guide.height)};
            weights.Load(guide, tile);
            body(weights, tile);
        }
    });
}

void FilterNlm(const NlmGuide& guide, const NlmOptions& options, int radius,
               std::span<const Plane* const> in, std::span<Plane* const> out,
               const CancelToken& cancel, const NlmKernels& kernels) {
    for (Plane* plane : out) {
        plane->resize(static_cast<std::size_t>(guide.width) *
                      static_cast<std::size_t>(guide.height));
    }
    const auto offsets = HalfWindow(radius);
    const Plane ones(kWidth * kHeight + kNlmLanes, 1.0f);
    ForEachNlmTile(
        guide, options, radius, kernels, cancel, [&](NlmWeights& weights, const TileRect& tile) {
            const int width = tile.width(), height = tile.height();
            std::vector<HaloPlane> planes(in.size(), HaloPlane(radius));
            // The sum of weights, then of each input; the pixel itself first.
            std::vector<Plane> sums(1 + in.size(), ones);
            for (std::size_t k = 0; k < in.size(); ++k) {
                planes[k].Load(*in[k], guide.width, guide.height, tile);
                for (int y = 0; y < height; ++y) {
                    std::copy_n(planes[k].At(0, y), width, sums[1 + k].data() + y * kWidth);
                }
            }
            for (const auto& [dx, dy] : offsets) {
                weights.ComputeWeights(dx, dy);
                for (const int sign : {1, -1}) {
                    const float* w = sign > 0 ? weights.forward() : weights.backward();
                    kernels.accumulate(w, weights.stride(), ones.data(), kWidth, width, height,
                                       sums[0].data(), kWidth);
                    for (std::size_t k = 0; k < in.size(); ++k) {
                        kernels.accumulate(w, weights.stride(), planes[k].At(sign * dx, sign * dy),
                                           planes[k].stride(), width, height, sums[1 + k].data(),
                                           kWidth);
                    }
                }
            }
            for (std::size_t k = 0; k < out.size(); ++k) {
                for (int y = 0; y < height; ++y) {
                    float* to = out[k]->data() +
                                static_cast<std::ptrdiff_t>(tile.y0 + y) * guide.width + tile.x0;
                    for (int x = 0; x < width; ++x) {
                        to[x] = sums[1 + k][static_cast<std::size_t>(y * kWidth + x)] /
                                sums[0][static_cast<std::size_t>(y * kWidth + x)];
                    }
                }
            }
        });
}

}  // namespace relume::denoise
