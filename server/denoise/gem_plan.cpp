#include "server/denoise/gem_plan.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

constexpr float kEpsilon = 1e-3f;
constexpr double kBatch = 4;          // samples of one pick
constexpr std::size_t kPickedOf = 4;  // at most one pixel in so many; they get larger batches then

Plane PickingOrder(const GemSelection& selection, float batch) {
    Plane error(selection.error.size());
    for (std::size_t i = 0; i < error.size(); ++i) {
        const float mean =
            (selection.mean[0][i] + selection.mean[1][i] + selection.mean[2][i]) * (1.0f / 3.0f);
        error[i] = std::max(selection.error[i], 0.0f) / (kEpsilon + mean * mean) * batch /
                   (batch + selection.support[i]);
    }
    return error;
}

// The `picks` pixels of largest value; the first of equals.
std::vector<std::size_t> Worst(const Plane& values, std::size_t picks) {
    std::vector<std::size_t> order(values.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto end = order.begin() + static_cast<std::ptrdiff_t>(picks);
    std::nth_element(order.begin(), end, order.end(), [&](std::size_t a, std::size_t b) {
        return values[a] != values[b] ? values[a] > values[b] : a < b;
    });
    order.erase(end, order.end());
    return order;
}

}  // namespace

Plane PlanGemSamples(const GemSelection& selection, const GemScales& scales, int width, int height,
                     double samples) {
    const std::size_t pixels = selection.error.size();
    Plane counts(pixels, 0.0f);
    if (pixels == 0 || samples <= 0) {
        return counts;
    }
    const auto wanted = static_cast<std::size_t>(std::ceil(samples / kBatch));
    const std::size_t picks =
        std::clamp<std::size_t>(wanted, 1, (pixels + kPickedOf - 1) / kPickedOf);
    const auto batch = static_cast<float>(samples / static_cast<double>(picks));
    const Plane error = PickingOrder(selection, batch);
    std::vector<std::size_t> picked = Worst(error, picks);
    std::erase_if(picked, [&](std::size_t i) { return error[i] <= 0; });

    // The batches of each scale, spread together. A batch stays in the image: it is divided by what
    // of its kernel lies there.
    for (int s = -1; s < static_cast<int>(scales.sigma.size()); ++s) {
        Plane batches(pixels, 0.0f);
        bool any = false;
        for (const std::size_t i : picked) {
            if (selection.scale[i] == s) {
                batches[i] = batch;
                any = true;
            }
        }
        if (any && s >= 0) {
            const auto taps = GaussianTaps(scales.sigma[static_cast<std::size_t>(s)]);
            const auto across = TapSums(width, taps), down = TapSums(height, taps);
            for (std::size_t y = 0, i = 0; y < down.size(); ++y) {
                for (std::size_t x = 0; x < across.size(); ++x, ++i) {
                    batches[i] /= across[x] * down[y];
                }
            }
            batches = Convolve(batches, width, height, taps);
        }
        for (std::size_t i = 0; i < pixels && any; ++i) {
            counts[i] += batches[i];
        }
    }

    // Too few pixels have an error: the others would be picked at random.
    const std::size_t others = static_cast<std::size_t>(
        std::count_if(error.begin(), error.end(), [](float e) { return e <= 0; }));
    if (picked.size() < picks && others > 0) {
        const float share =
            batch * static_cast<float>(picks - picked.size()) / static_cast<float>(others);
        for (std::size_t i = 0; i < pixels; ++i) {
            counts[i] += error[i] <= 0 ? share : 0;
        }
    }
    return counts;
}

}  // namespace relume::denoise
