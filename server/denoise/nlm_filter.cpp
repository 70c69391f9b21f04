#include "server/denoise/nlm_filter.h"

#include <algorithm>
#include <memory>

namespace relume::denoise {
namespace {

constexpr int kWidth = 128, kHeight = 64;  // of a tile

}  // namespace

void ForEachNlmTile(const NlmGuide& guide, const NlmOptions& options, int radius,
                    const NlmKernels& kernels, const CancelToken& cancel,
                    const std::function<void(NlmWeights&, const TileRect&)>& body) {
    ForTilesOf(guide.width, guide.height, kWidth, kHeight, cancel, [&]() -> TileBody {
        auto weights = std::make_shared<NlmWeights>(options, radius, kWidth, kHeight, kernels);
        return [&guide, &body, weights](const TileRect& tile) {
            weights->Load(guide, tile);
            body(*weights, tile);
        };
    });
}

void FilterNlm(const NlmGuide& guide, const NlmOptions& options, int radius,
               std::span<const Plane* const> in, std::span<Plane* const> out,
               const CancelToken& cancel, const NlmKernels& kernels, Plane* variance_share) {
    const std::size_t pixels =
        static_cast<std::size_t>(guide.width) * static_cast<std::size_t>(guide.height);
    for (Plane* plane : out) {
        plane->resize(pixels);
    }
    if (variance_share != nullptr) {
        variance_share->resize(pixels);
    }
    const auto offsets = HalfWindow(radius);
    const Plane ones(kWidth * kHeight + kNlmLanes, 1.0f);
    ForEachNlmTile(
        guide, options, radius, kernels, cancel, [&](NlmWeights& weights, const TileRect& tile) {
            const int width = tile.width(), height = tile.height();
            // Sums begin with the pixel itself.
            Plane total = ones, squares = ones;
            std::vector<HaloPlane> planes(in.size(), HaloPlane(kWidth, kHeight, radius));
            std::vector<Plane> sums(in.size(), ones);
            for (std::size_t k = 0; k < in.size(); ++k) {
                planes[k].Load(*in[k], guide.width, guide.height, tile);
                for (int y = 0; y < height; ++y) {
                    std::copy_n(planes[k].origin() + y * planes[k].stride(), width,
                                sums[k].data() + y * kWidth);
                }
            }
            const auto add = [&](int dx, int dy, const float* weight) {
                const auto accumulate = [&](const float* from, std::ptrdiff_t stride, Plane* sum) {
                    kernels.accumulate(weight, weights.stride(), from, stride, width, height,
                                       sum->data(), kWidth);
                };
                accumulate(ones.data(), kWidth, &total);
                if (variance_share != nullptr) {
                    accumulate(weight, weights.stride(), &squares);
                }
                for (std::size_t k = 0; k < in.size(); ++k) {
                    accumulate(planes[k].origin() + dy * planes[k].stride() + dx,
                               planes[k].stride(), &sums[k]);
                }
            };
            for (const auto& [dx, dy] : offsets) {
                weights.ComputeWeights(dx, dy);
                add(dx, dy, weights.forward());
                add(-dx, -dy, weights.backward());
            }
            for (int y = 0; y < height; ++y) {
                const auto row =
                    static_cast<std::size_t>(tile.y0 + y) * static_cast<std::size_t>(guide.width) +
                    static_cast<std::size_t>(tile.x0);
                for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x) {
                    const std::size_t at = static_cast<std::size_t>(y) * kWidth + x;
                    for (std::size_t k = 0; k < out.size(); ++k) {
                        (*out[k])[row + x] = sums[k][at] / total[at];
                    }
                    if (variance_share != nullptr) {
                        (*variance_share)[row + x] = squares[at] / (total[at] * total[at]);
                    }
                }
            }
        });
}

}  // namespace relume::denoise
