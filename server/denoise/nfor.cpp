// Nonlinearly weighted first-order regression (Bitterli, Rousselle, Moon, Iglesias-Guitian, Adler,
// Mitchell, Jarosz, Novak 2016; methods 2.8). No parameters.
//
// 1. The features are filtered, each half by the other (nfor_features.h).
// 2. Each half of the colour is fitted by the features of the other one, with weights of non-local
//    means on the other one's colour: once with k = 1, once with 0.5 (regression.h).
// 3. Each result is judged by the half that it has not seen. The squared errors are smoothed by
//    non-local means, each pixel takes the k of the smaller, and that choice is smoothed, too.
// 4. The mean of the halves is fitted once more, k = 1, its variance taken from how they differ.
//
// The estimated error is that of step 3, for the chosen k. It is too low by a few percent of the
// noise: the half that judges has had a part in the weights.
//
// As the authors' program, not their paper: weights from the other half, x and y among the columns.
// Different on purpose: weights are of the distances' mean over the three channels, not the least
// of the channels' own, which costs a sixth more time and wins only where samples are few; normal
// equations with a ridge of 1e-4 in place of a decomposition of the matrix; errors in step 3 are
// relative, over F^2 + 0.01, F the mean of the candidates: else the few bright pixels of a window
// choose for the dark ones, and the result may be worse than no filter. Features are all that the
// frame has of albedo, normal, depth and visibility and that are not constant.
//
// Without halves: one fit with k = 1 by features that were filtered by themselves; the error is too
// low by twice what the pixel's own noise has in its result.
//
// Limits: what the features don't show is kept no better than by non-local means; next to noisy
// highlights dark pixels can become too bright.
#include <fmt/format.h>

#include <array>
#include <memory>
#include <utility>

#include "server/denoise/denoiser.h"
#include "server/denoise/halves.h"
#include "server/denoise/nfor_features.h"
#include "server/denoise/nlm_filter.h"
#include "server/denoise/regression.h"

namespace relume::denoise {
namespace {

using Color = std::array<Plane, 3>;

constexpr NlmOptions kColorNlm = {.k = 1, .patch = 3};
constexpr NlmOptions kErrorNlm = {.k = 1, .patch = 1};
constexpr int kErrorRadius = 9;
constexpr float kImportanceFloor = 0.01f;  // that of RelMSE

// Step 2: one half's colour with k = 1 and k = 0.5.
std::vector<Color> RegressHalf(const Frame& frame, const NforFeatures& features, std::size_t half,
                               const CancelToken& cancel) {
    const std::size_t other = 1 - half;
    Plane variance[3];
    for (std::size_t c = 0; c < 3; ++c) {
        variance[c] = HalfVariance(frame, c, static_cast<int>(other));
    }
    RegressionInput input;
    input.guide = NlmGuide(frame.width, frame.height, frame.half[other], variance);
    input.weights = kColorNlm;
    for (const Plane& plane : features.half[other]) {
        input.features.push_back(&plane);
    }
    for (std::size_t c = 0; c < 3; ++c) {
        input.color[c] = &frame.half[half][c];
    }
    return RegressFirstOrder(input, 2, cancel);
}

// By non-local means with the frame's colour as guide, in place.
void SmoothByColor(const Frame& frame, std::vector<Plane>* planes, const CancelToken& cancel) {
    std::vector<Plane> smooth(planes->size());
    std::vector<const Plane*> in;
    std::vector<Plane*> out;
    for (std::size_t k = 0; k < planes->size(); ++k) {
        in.push_back(&(*planes)[k]);
        out.push_back(&smooth[k]);
    }
    FilterNlm(NlmGuide(frame.width, frame.height, frame.color, frame.variance), kErrorNlm,
              kErrorRadius, in, out, cancel);
    *planes = std::move(smooth);
}

// The halves of step 3, blended of their candidates.
struct Blend {
    Color half[2];
    Plane error;      // estimated, of the halves' mean, a pixel
    double wide = 0;  // share of k = 1
};

Blend ChooseK(const Frame& frame, std::vector<Color> (&candidate)[2], const CancelToken& cancel) {
    const std::size_t pixels = frame.pixel_count();
    std::vector<Plane> error(6, Plane(pixels)), importance(3, Plane(pixels));
    for (std::size_t c = 0; c < 3; ++c) {
        const Plane va = HalfVariance(frame, c, 0), vb = HalfVariance(frame, c, 1);
        for (std::size_t i = 0; i < pixels; ++i) {
            float sum = 0;
            for (const auto& half : candidate) {
                sum += half[0][c][i] + half[1][c][i];
            }
            importance[c][i] = 0.0625f * sum * sum + kImportanceFloor;
            for (std::size_t k = 0; k < 2; ++k) {
                const float fa = candidate[0][k][c][i], fb = candidate[1][k][c][i];
                const float to_a = frame.half[0][c][i] - fb, to_b = frame.half[1][c][i] - fa;
                // What the mean of both has less than one of them: a quarter of their difference.
                const float squared = 0.5f * (to_a * to_a - va[i] + to_b * to_b - vb[i]) -
                                      0.25f * (fa - fb) * (fa - fb);
                error[3 * k + c][i] = squared / importance[c][i];
            }
        }
    }
    SmoothByColor(frame, &error, cancel);
    std::vector<Plane> share(3, Plane(pixels));  // of k = 1
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < pixels; ++i) {
            share[c][i] = error[c][i] < error[3 + c][i] ? 1.0f : 0.0f;
        }
    }
    SmoothByColor(frame, &share, cancel);
    Blend blend;
    blend.error.resize(pixels);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < pixels; ++i) {
            const float s = share[c][i];
            blend.wide += s;
            blend.error[i] +=
                (s * error[c][i] + (1 - s) * error[3 + c][i]) * importance[c][i] * (1.0f / 3.0f);
            for (auto& half : candidate) {
                half[0][c][i] = s * half[0][c][i] + (1 - s) * half[1][c][i];
            }
        }
    }
    blend.wide /= 3 * static_cast<double>(pixels > 0 ? pixels : 1);
    blend.half[0] = std::move(candidate[0][0]);
    blend.half[1] = std::move(candidate[1][0]);
    return blend;
}

// Step 4. The planes of `half` become the mean and its variance.
Color RegressMean(const Frame& frame, Color (&half)[2], const std::vector<Plane>& features,
                  const CancelToken& cancel) {
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            float &a = half[0][c][i], &b = half[1][c][i];
            const float difference = a - b;
            a = 0.5f * (a + b);
            b = 0.25f * difference * difference;
        }
    }
    RegressionInput input;
    input.guide.width = frame.width;
    input.guide.height = frame.height;
    input.weights = kColorNlm;
    for (std::size_t c = 0; c < 3; ++c) {
        input.guide.value.push_back(&half[0][c]);
        input.guide.variance.push_back(&half[1][c]);
        input.color[c] = &half[0][c];
    }
    for (const Plane& plane : features) {
        input.features.push_back(&plane);
    }
    return std::move(RegressFirstOrder(input, 1, cancel)[0]);
}

// What can be had of a frame without halves, which is also what a half is judged by
// (error_estimate.h): one fit, k = 1, by features that were filtered by themselves.
Result FromOne(const Frame& frame, const CancelToken& cancel) {
    const OneFeatures features = FilterFeatures(frame, cancel);
    RegressionInput input;
    input.guide = NlmGuide(frame.width, frame.height, frame.color, frame.variance);
    input.weights = kColorNlm;
    for (const Plane& plane : features.planes) {
        input.features.push_back(&plane);
    }
    for (std::size_t c = 0; c < 3; ++c) {
        input.color[c] = &frame.color[c];
    }
    Color color = std::move(RegressFirstOrder(input, 1, cancel)[0]);
    Result result;
    std::vector<Plane> error(1, Plane(frame.pixel_count()));
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            const float change = color[c][i] - frame.color[c][i];
            error[0][i] += (change * change - frame.variance[c][i]) * (1.0f / 3.0f);
        }
        result.color[c] = std::move(color[c]);
    }
    SmoothByColor(frame, &error, cancel);
    result.error = std::move(error[0]);
    result.notes["features"] = features.names.empty() ? "none" : features.names;
    result.notes["halves"] = "none: one fit";
    return result;
}

class Nfor final : public Denoiser {
  public:
    std::string Describe() const override { return "nfor"; }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        if (!frame.has_halves()) {
            return FromOne(frame, cancel);
        }
        NforFeatures features = FilterHalfFeatures(frame, cancel);
        Result result;
        result.notes["features"] = features.names.empty() ? "none" : features.names;
        std::vector<Color> candidate[2] = {RegressHalf(frame, features, 0, cancel),
                                           RegressHalf(frame, features, 1, cancel)};
        Blend blend = ChooseK(frame, candidate, cancel);
        result.notes["k"] =
            fmt::format("1: {:.1f} %, 0.5: {:.1f} %", 100 * blend.wide, 100 - 100 * blend.wide);
        Color color = RegressMean(
            frame, blend.half,
            CombineFeatures(std::move(features), frame.width, frame.height, cancel), cancel);
        for (std::size_t c = 0; c < 3; ++c) {
            result.color[c] = std::move(color[c]);
        }
        result.error = std::move(blend.error);
        return result;
    }
};

}  // namespace

std::unique_ptr<Denoiser> MakeNfor(const ParamSet&) { return std::make_unique<Nfor>(); }

}  // namespace relume::denoise
