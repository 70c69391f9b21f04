#include "server/denoise/halves.h"

#include <algorithm>
#include <utility>

namespace relume::denoise {
namespace {

constexpr float kEpsilon = 1e-3f;

std::shared_ptr<const SampleRecords> EveryOther(const SampleRecords& samples, std::size_t first) {
    auto out = std::make_shared<SampleRecords>(samples.pixel_count());
    std::vector<SampleRecord> half;
    for (std::size_t i = 0; i < samples.pixel_count(); ++i) {
        const auto all = samples.Of(i);
        half.clear();
        for (std::size_t k = first; k < all.size(); k += 2) {
            half.push_back(all[k]);
        }
        out->Append(i, half);
    }
    return out;
}

}  // namespace

Plane HalfVariance(const Frame& frame, std::size_t c, int half) {
    Plane variance = frame.variance[c];
    for (std::size_t i = 0; i < variance.size(); ++i) {
        const float n = frame.count.empty() ? 2 : std::max(frame.count[i], 1.0f);
        variance[i] *= n / std::max(1.0f, HalfCount(n, half));
    }
    return variance;
}

Frame HalfFrame(const Frame& frame, int half) {
    const auto h = static_cast<std::size_t>(half);
    Frame out;
    out.width = frame.width;
    out.height = frame.height;
    out.flagged = frame.flagged;
    out.brightest = frame.brightest;
    const std::size_t pixels = frame.pixel_count();
    out.count.resize(pixels);
    if (frame.samples) {
        out.samples = EveryOther(*frame.samples, h);
    }
    Plane scale(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        const float n = frame.count.empty() ? 2 : frame.count[i];
        out.count[i] = std::max(1.0f, HalfCount(n, half));
        scale[i] = std::max(n, 1.0f) / out.count[i];
    }
    for (std::size_t c = 0; c < 3; ++c) {
        out.color[c] = frame.half[h][c];
        out.variance[c] = frame.variance[c];
        out.sample_variance[c] = frame.sample_variance[c];
        for (std::size_t i = 0; i < pixels; ++i) {
            out.variance[c][i] *= scale[i];
            if (!out.sample_variance[c].empty()) {
                out.sample_variance[c][i] *= scale[i];
            }
        }
    }
    for (std::size_t f = 0; f < kFeatureCount; ++f) {
        out.feature[f] =
            frame.feature_half[h][f].empty() ? frame.feature[f] : frame.feature_half[h][f];
        out.feature_variance[f] = frame.feature_variance[f];
    }
    return out;
}

Frame ShrinkFrame(const Frame& frame) {
    Frame out;
    out.width = (frame.width + 1) / 2;
    out.height = (frame.height + 1) / 2;
    out.flagged.assign(out.pixel_count(), 0);
    // Sum over a block times 1 / pixels^power.
    const auto shrink = [&](const Plane& in, int power) {
        Plane small;
        if (in.empty()) {
            return small;
        }
        small.resize(out.pixel_count());
        for (int y = 0; y < out.height; ++y) {
            for (int x = 0; x < out.width; ++x) {
                float sum = 0, pixels = 0;
                for (int v = 2 * y; v < std::min(2 * y + 2, frame.height); ++v) {
                    for (int u = 2 * x; u < std::min(2 * x + 2, frame.width); ++u) {
                        sum +=
                            in[static_cast<std::size_t>(v) * static_cast<std::size_t>(frame.width) +
                               static_cast<std::size_t>(u)];
                        ++pixels;
                    }
                }
                small[static_cast<std::size_t>(y) * static_cast<std::size_t>(out.width) +
                      static_cast<std::size_t>(x)] = power == 0   ? sum
                                                     : power == 1 ? sum / pixels
                                                                  : sum / (pixels * pixels);
            }
        }
        return small;
    };
    for (std::size_t c = 0; c < 3; ++c) {
        out.color[c] = shrink(frame.color[c], 1);
        out.variance[c] = shrink(frame.variance[c], 2);
        out.sample_variance[c] = shrink(frame.sample_variance[c], 2);
        for (std::size_t h = 0; h < 2; ++h) {
            out.half[h][c] = shrink(frame.half[h][c], 1);
        }
    }
    out.count = shrink(frame.count, 0);
    for (std::size_t f = 0; f < kFeatureCount; ++f) {
        out.feature[f] = shrink(frame.feature[f], 1);
        out.feature_variance[f] = shrink(frame.feature_variance[f], 1);
        for (std::size_t h = 0; h < 2; ++h) {
            out.feature_half[h][f] = shrink(frame.feature_half[h][f], 1);
        }
    }
    return out;
}

FilteredHalves FilterHalves(const Denoiser& denoiser, const Frame& frame,
                            const CancelToken& cancel) {
    FilteredHalves out;
    for (int half = 0; half < 2; ++half) {
        Result result = RunDenoiser(denoiser, HalfFrame(frame, half), cancel);
        for (std::size_t c = 0; c < 3; ++c) {
            out.color[static_cast<std::size_t>(half)][c] = std::move(result.color[c]);
        }
    }
    return out;
}

Plane Disagreement(const FilteredHalves& halves) {
    Plane out(halves.color[0][0].size(), 0.0f);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < out.size(); ++i) {
            const float a = halves.color[0][c][i], b = halves.color[1][c][i];
            const float mean = 0.5f * (a + b), d = a - b;
            out[i] += d * d / (mean * mean + kEpsilon) * (1.0f / 3.0f);
        }
    }
    return out;
}

std::array<Plane, 3> HalvesError(const Frame& frame, const FilteredHalves& halves,
                                 const std::array<Plane, 3>& noise) {
    std::array<Plane, 3> error;
    for (std::size_t c = 0; c < 3; ++c) {
        error[c].resize(frame.pixel_count());
        for (std::size_t i = 0; i < error[c].size(); ++i) {
            const std::array<float, 2> f = {halves.color[0][c][i], halves.color[1][c][i]};
            error[c][i] =
                HalvesProduct(frame.half[0][c][i], frame.half[1][c][i], f, f, noise[c][i]);
        }
    }
    return error;
}

}  // namespace relume::denoise
