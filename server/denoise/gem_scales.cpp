#include "server/denoise/gem_scales.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

constexpr float kLargestOwnFlag = 0.01f;  // share of a pixel's own flag in the smoothed one
constexpr int kPoolRadius = 2;            // of the window that a pixel's variance is compared with
constexpr std::size_t kRowGrain = 8;

// A frame's means, their variances and the samples behind them at one scale.
struct Level {
    std::array<Plane, 3> mean, variance;
    Plane samples, own;
};

class Ladder {
  public:
    Ladder(const Frame& frame, const CancelToken& cancel)
        : frame_(frame),
          cancel_(cancel),
          counts_(frame.count.empty() ? Plane(frame.pixel_count(), 1.0f) : frame.count) {
        const Plane inside =
            SumBox(Plane(frame.pixel_count(), 1.0f), frame.width, frame.height, kPoolRadius);
        for (std::size_t c = 0; c < 3; ++c) {
            variance_[c] = SumBox(frame.variance[c], frame.width, frame.height, kPoolRadius);
            for (std::size_t i = 0; i < inside.size(); ++i) {
                variance_[c][i] = std::max(frame.variance[c][i], variance_[c][i] / inside[i]);
            }
        }
    }

    // The pixels themselves.
    Level Pixels() const {
        return {{frame_.color[0], frame_.color[1], frame_.color[2]},
                variance_,
                counts_,
                Plane(frame_.pixel_count(), 1.0f)};
    }

    Level Blurred(float sigma) const {
        const std::vector<float> taps = GaussianTaps(sigma);
        std::vector<float> squares = taps;
        for (float& tap : squares) {
            tap *= tap;
        }
        const Sums sums(*this, taps), square_sums(*this, squares);
        Level level;
        for (std::size_t c = 0; c < 3; ++c) {
            level.mean[c] = Blur(frame_.color[c], taps);
            level.variance[c] = Blur(variance_[c], squares);
        }
        level.samples = Blur(counts_, taps);
        level.own.resize(frame_.pixel_count());
        ForEachPixel([&](std::size_t i, int x, int y) {
            const float inverse = 1 / sums(x, y), squared = inverse * inverse;
            for (std::size_t c = 0; c < 3; ++c) {
                level.mean[c][i] *= inverse;
                level.variance[c][i] *= squared;
            }
            level.samples[i] *= sums(x, y) / square_sums(x, y);
            level.own[i] = inverse;
        });
        return level;
    }

    // Flags, 0 or 1, over a Gaussian in which a pixel's own counts at most kLargestOwnFlag.
    Plane BlurFlags(const Plane& flags, float sigma) const {
        const std::vector<float> taps = GaussianTaps(sigma);
        const Sums sums(*this, taps);
        Plane out = Blur(flags, taps);
        ForEachPixel([&](std::size_t i, int x, int y) {
            const float all = sums(x, y);  // 1 of which is the pixel's own
            if (all * kLargestOwnFlag >= 1) {
                out[i] /= all;
            } else if (all > 1) {
                out[i] = kLargestOwnFlag * flags[i] +
                         (1 - kLargestOwnFlag) * (out[i] - flags[i]) / (all - 1);
            }
        });
        return out;
    }

    template <typename Fn>
    void ForEachPixel(const Fn& fn) const {
        ParallelFor(
            0, static_cast<std::size_t>(frame_.height), kRowGrain,
            [&](std::size_t y0, std::size_t y1) {
                for (std::size_t y = y0; y < y1; ++y) {
                    for (int x = 0; x < frame_.width; ++x) {
                        fn(y * static_cast<std::size_t>(frame_.width) + static_cast<std::size_t>(x),
                           x, static_cast<int>(y));
                    }
                }
            });
    }

  private:
    // Of the taps that lie in the image.
    class Sums {
      public:
        Sums(const Ladder& ladder, const std::vector<float>& taps)
            : across_(TapSums(ladder.frame_.width, taps)),
              down_(TapSums(ladder.frame_.height, taps)) {}
        float operator()(int x, int y) const {
            return across_[static_cast<std::size_t>(x)] * down_[static_cast<std::size_t>(y)];
        }

      private:
        std::vector<float> across_, down_;
    };

    Plane Blur(const Plane& plane, const std::vector<float>& taps) const {
        if (cancel_.cancelled()) {
            throw Error(ErrorCode::kCancelled, "the filter was cancelled");
        }
        return Convolve(plane, frame_.width, frame_.height, taps);
    }

    const Frame& frame_;
    const CancelToken& cancel_;
    Plane counts_;
    std::array<Plane, 3> variance_;  // of a pixel, at least the mean of those around
};

// The squared bias of the coarser of two Gaussians less that of the finer, over their squared
// difference: bias grows with the squared radius.
float BiasFactor(float fine, float coarse) {
    return (coarse * coarse + fine * fine) / (coarse * coarse - fine * fine);
}

// Variance of the difference of two scales over that of the finer one, under noise that is the same
// in all pixels. Taps along one axis, the finer's inside of the coarser's.
float NoiseOfDifference(const std::vector<float>& fine, const std::vector<float>& coarse) {
    const std::size_t shift = (coarse.size() - fine.size()) / 2;
    float fine_sum = 0, coarse_sum = 0, fine_squares = 0, coarse_squares = 0, products = 0;
    for (std::size_t k = 0; k < coarse.size(); ++k) {
        const float c = coarse[k];
        const float f = k >= shift && k - shift < fine.size() ? fine[k - shift] : 0.0f;
        fine_sum += f;
        coarse_sum += c;
        fine_squares += f * f;
        coarse_squares += c * c;
        products += f * c;
    }
    // In two dimensions, over those of the finer one.
    const float both = products * fine_sum / (fine_squares * coarse_sum);
    const float alone =
        coarse_squares * fine_sum * fine_sum / (fine_squares * coarse_sum * coarse_sum);
    return 1 - 2 * both * both + alone * alone;
}

}  // namespace

GemScales FinalGemScales(float gamma) {
    GemScales scales;
    for (int s = 0; s < 8; ++s) {
        scales.sigma.push_back(std::exp2(0.5f * static_cast<float>(s - 1)));
    }
    scales.gamma = gamma;
    return scales;
}

GemScales PlanGemScales(float gamma) { return {{1, 2, 4, 8}, gamma, 1, false}; }

float GemConfidence(float gamma, float samples) {
    return -std::log(1 - std::pow(1.9f * gamma, std::sqrt(0.5f))) *
           (1 - 1 / std::max(samples, 1.0f));
}

GemSelection SelectScales(const Frame& frame, const GemScales& scales, const CancelToken& cancel) {
    const Ladder ladder(frame, cancel);
    const std::size_t pixels = frame.pixel_count();
    Level fine = ladder.Pixels();
    GemSelection selection;
    selection.scale.assign(pixels, -1);
    selection.mean = fine.mean;
    selection.error.resize(pixels);
    ladder.ForEachPixel([&](std::size_t i, int, int) {
        for (const Plane& variance : fine.variance) {
            selection.error[i] += variance[i] * (1.0f / 3.0f);
        }
    });
    selection.support = fine.samples;
    selection.own = fine.own;
    std::vector<unsigned char> stopped(pixels, 0);
    const float trust = GemConfidence(scales.gamma, INFINITY);
    std::vector<float> fine_taps = {1};
    for (std::size_t s = 0; s < scales.sigma.size(); ++s) {
        Level coarse = ladder.Blurred(scales.sigma[s]);
        const float factor = s == 0 ? 1 : BiasFactor(scales.sigma[s - 1], scales.sigma[s]);
        const std::vector<float> coarse_taps = GaussianTaps(scales.sigma[s]);
        const float noise = NoiseOfDifference(fine_taps, coarse_taps);
        fine_taps = coarse_taps;
        Plane flag(pixels), change(pixels);  // change: of the estimated error
        ladder.ForEachPixel([&](std::size_t i, int, int) {
            const float z = trust * (1 - 1 / std::max(coarse.samples[i], 1.0f));
            float balance = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                const float difference = coarse.mean[c][i] - fine.mean[c][i];
                const float loss = factor * difference * difference;
                const float gain = fine.variance[c][i] - coarse.variance[c][i];
                balance += z * loss - gain;
                const float by_noise = factor * noise * fine.variance[c][i];
                change[i] += (loss - by_noise - gain) * (1.0f / 3.0f);
            }
            flag[i] = balance >= 0 ? 1.0f : 0.0f;
        });
        const Plane smooth = ladder.BlurFlags(flag, scales.flag_blur * scales.sigma[s]);
        ladder.ForEachPixel([&](std::size_t i, int, int) {
            const bool stop = smooth[i] >= 0.5f && (!scales.own_flag_needed || flag[i] > 0);
            stopped[i] |= stop ? 1 : 0;
            if (stopped[i] == 0) {
                selection.scale[i] = static_cast<signed char>(s);
                for (std::size_t c = 0; c < 3; ++c) {
                    selection.mean[c][i] = coarse.mean[c][i];
                }
                selection.error[i] += change[i];
                selection.support[i] = coarse.samples[i];
                selection.own[i] = coarse.own[i];
            }
        });
        fine = std::move(coarse);
    }
    return selection;
}

}  // namespace relume::denoise
