#include "tests/unit/denoise/reference_nlm.h"

#include <gtest/gtest.h>

#include <optional>
#include "core/base/parallel.h"

#include <algorithm>
#include <cmath>

namespace relume::denoise {

// `between`: to the mean of the neighbours at +-(dx, dy), all of which must be inside.
double ReferenceNlm::PatchDistance(int x, int y, int dx, int dy, bool between) const {
    const auto channels = guide_.value.size();
    std::vector<double> sum(channels);
    int count = 0;
    for (int v = y - options_.patch; v <= y + options_.patch; ++v) {
        for (int u = x - options_.patch; u <= x + options_.patch; ++u) {
            if (!Inside(u, v) || !Inside(u + dx, v + dy) || (between && !Inside(u - dx, v - dy))) {
                continue;
            }
            ++count;
            for (std::size_t c = 0; c < channels; ++c) {
                const auto at = [&](const Plane& plane, int px, int py) {
                    return static_cast<double>(
                        plane[static_cast<std::size_t>(py * guide_.width + px)]);
                };
                const Plane &value = *guide_.value[c], &variance = *guide_.variance[c];
                const double scale = guide_.variance_scale;
                const double ui = at(value, u, v), vi = scale * at(variance, u, v);
                double uj = at(value, u + dx, v + dy), vj = scale * at(variance, u + dx, v + dy);
                if (between) {
                    uj = (uj + at(value, u - dx, v - dy)) / 2;
                    vj = (vj + scale * at(variance, u - dx, v - dy)) / 4;
                }
                const double square = (ui - uj) * (ui - uj);
                const double k = options_.k;
                const double other = options_.own_variance ? vi : vj;
                sum[c] += std::min<double>((square - options_.alpha * (vi + std::min(vi, vj))) /
                                               (options_.epsilon + k * k * (vi + other)),
                                           options_.largest);
            }
        }
    }
    double mean = 0;
    for (const double s : sum) {
        mean += s / count / static_cast<double>(channels);
    }
    return mean;
}

double ReferenceNlm::Distance(int x, int y, int dx, int dy) const {
    return Inside(x, y) && Inside(x + dx, y + dy) ? PatchDistance(x, y, dx, dy, false)
                                                  : kNlmOutside;
}

double ReferenceNlm::PairWeight(int x, int y, int dx, int dy) const {
    const auto weight = [](double d) { return std::exp(-std::max(d, 0.0)); };
    const double w = weight(Distance(x, y, dx, dy));
    if (!options_.symmetric || !Inside(x + dx, y + dy) || !Inside(x - dx, y - dy)) {
        return w;
    }
    const double ws = weight(PatchDistance(x, y, dx, dy, true));
    const double both = w + weight(Distance(x, y, -dx, -dy));
    const double r = both > 0 ? std::clamp(ws / both - 1, 0.0, 1.0) : ws > 0 ? 1 : 0;
    return r * ws + (1 - r) * w;
}

double ReferenceNlm::Weight(int x, int y, int dx, int dy) const {
    if (!Inside(x, y) || !Inside(x + dx, y + dy)) {
        return 0;
    }
    double sum = 0;
    int count = 0;
    for (int v = y - options_.weight_patch; v <= y + options_.weight_patch; ++v) {
        for (int u = x - options_.weight_patch; u <= x + options_.weight_patch; ++u) {
            if (Inside(u, v) && Inside(u + dx, v + dy)) {
                sum += PairWeight(u, v, dx, dy);
                ++count;
            }
        }
    }
    return sum / count < options_.least_weight ? 0 : sum / count;
}

double ReferenceNlm::Filter(const Plane& plane, int radius, int x, int y) const {
    double sum = 0, weights = 0;
    for (int dy = -radius; dy <= radius; ++dy) {
        for (int dx = -radius; dx <= radius; ++dx) {
            if (Inside(x + dx, y + dy)) {
                const double w = dx == 0 && dy == 0 ? 1 : Weight(x, y, dx, dy);
                sum += w * plane[static_cast<std::size_t>((y + dy) * guide_.width + x + dx)];
                weights += w;
            }
        }
    }
    return sum / weights;
}

void ExpectSameBits(const Frame& frame,
                    const std::function<std::unique_ptr<Denoiser>(const NlmKernels&)>& make) {
    std::optional<Result> first;
    Plane plan;
    const NlmKernelList usable = UsableNlmKernels();
    for (int k = 0; k < usable.size; ++k) {
        for (const int threads : {1, 4}) {
            SetThreadCount(threads);
            const auto denoiser = make(*usable.list[k]);
            const Result result = denoiser->Reconstruct(frame, {});
            const Plane counts = denoiser->PlanSamples(frame, 1000, {});
            if (!first) {
                first = result;
                plan = counts;
            }
            for (int c = 0; c < 3; ++c) {
                EXPECT_EQ(result.color[c], first->color[c]) << usable.list[k]->name;
            }
            EXPECT_EQ(*result.error, *first->error);
            EXPECT_EQ(counts, plan);
        }
    }
    SetThreadCount(0);
}

}  // namespace relume::denoise
