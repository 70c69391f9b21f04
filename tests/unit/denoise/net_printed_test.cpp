// net:mode=printed: the filter by its definition, its inputs, and the whole with random weights.
#include "server/denoise/net_printed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "server/denoise/bilateral.h"
#include "server/denoise/net_printed_inputs.h"
#include "tests/unit/denoise/random_stack.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using testing::HasSubstr;

TensorArchive Weights() { return RandomStack({16, 8, 8, 5}, 3, 3); }

std::vector<Plane> RandomSigmas(const Frame& frame) {
    Numbers numbers(4);
    std::vector<Plane> sigmas;
    for (const float scale : {6.0f, 1.0f, 2.0f, 2.0f, 1.0f}) {
        Plane& plane = sigmas.emplace_back();
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            plane.push_back(scale * static_cast<float>(0.05 + numbers.Draw()));
        }
    }
    return sigmas;
}

// Equations (7) to (9) at pixel (x, y), in double precision, with colour c of that pixel changed by
// `shift`.
std::array<double, 3> Naive(const Frame& frame, const std::vector<Plane>& sigmas, int x, int y,
                            std::size_t c, double shift) {
    const auto i = static_cast<std::size_t>(y * frame.width + x);
    const float largest = *std::ranges::max_element(frame.feature[kDepth]);
    const auto color = [&](std::size_t k, std::size_t at) {
        return frame.color[k][at] + (k == c && at == i ? shift : 0);
    };
    const auto squared = [](double v) { return v * v; };
    double weights = 0;
    std::array<double, 3> sums{};
    for (int v = std::max(y - 8, 0); v <= std::min(y + 8, frame.height - 1); ++v) {
        for (int u = std::max(x - 8, 0); u <= std::min(x + 8, frame.width - 1); ++u) {
            const auto j = static_cast<std::size_t>(v * frame.width + u);
            double e = (squared(u - x) + squared(v - y)) / (2 * squared(sigmas[0][i]));
            for (std::size_t k = 0; k < 3; ++k) {
                e += squared(color(k, j) - color(k, i)) / (2 * squared(sigmas[1][i]));
            }
            const auto feature = [&](int first, int count, float unit, const Plane& sigma) {
                double distance = 0, variance = 0;
                for (int f = first; f < first + count; ++f) {
                    distance += squared(unit * (frame.feature[f][j] - frame.feature[f][i]));
                    variance += squared(unit) *
                                (frame.feature_variance[f][i] + frame.feature_variance[f][j]);
                }
                e += std::sqrt(distance / std::max(variance, 1e-10)) / (2 * squared(sigma[i]));
            };
            feature(kNormalX, 3, 1, sigmas[2]);
            feature(kAlbedoR, 3, 1, sigmas[3]);
            feature(kDepth, 1, 1 / largest, sigmas[4]);
            const double w = std::exp(-e);
            weights += w;
            for (std::size_t k = 0; k < 3; ++k) {
                sums[k] += w * color(k, j);
            }
        }
    }
    for (double& sum : sums) {
        sum /= weights;
    }
    return sums;
}

TEST(FilterBySigmas, IsThePapersFilterByAnyKernel) {
    for (const auto& [width, height] : {std::pair{70, 37}, {5, 3}, {1, 40}}) {
        const Frame frame = MakeRandomFrame(width, height, 8);
        const Guides guides = MakeGuides(frame);
        const std::vector<Plane> sigmas = RandomSigmas(frame);
        const NetPrintedList usable = UsableNetPrinted();
        const Result result = FilterBySigmas(frame, guides, sigmas, usable.list[0], CancelToken{});
        for (int k = 1; k < usable.size; ++k) {
            const Result other =
                FilterBySigmas(frame, guides, sigmas, usable.list[k], CancelToken{});
            EXPECT_TRUE(std::ranges::equal(other.color, result.color));
            EXPECT_TRUE(other.derivative == result.derivative);
        }
        for (int y = 0; y < height; y += 3) {
            for (int x = 0; x < width; x += 2) {
                const auto i = static_cast<std::size_t>(y * width + x);
                const std::array<double, 3> expected = Naive(frame, sigmas, x, y, 0, 0);
                for (std::size_t c = 0; c < 3; ++c) {
                    ASSERT_NEAR(result.color[c][i], expected[c], 1e-5) << x << ", " << y;
                    constexpr double kStep = 1e-4;
                    const double slope = (Naive(frame, sigmas, x, y, c, kStep)[c] -
                                          Naive(frame, sigmas, x, y, c, -kStep)[c]) /
                                         (2 * kStep);
                    ASSERT_NEAR((*result.derivative)[c][i], slope, 1e-4) << x << ", " << y;
                }
            }
        }
    }
}

TEST(PrintedNetInputs, FollowTheirDefinition) {
    const Frame frame = MakeRandomFrame(9, 5, 2);
    const Guides guides = MakeGuides(frame);
    const std::vector<Plane> inputs = MakePrintedNetInputs(frame, guides);
    const std::vector<std::string> names = PrintedNetInputNames();
    ASSERT_EQ(names.size(), 16u);
    ASSERT_EQ(inputs.size(), names.size());
    const std::size_t i = 2 * 9 + 4;
    const auto channel = [&](const std::string& name) {
        return inputs[static_cast<std::size_t>(std::ranges::find(names, name) - names.begin())][i];
    };
    EXPECT_NEAR(channel("color.G"), std::log(1 + frame.color[1][i]), 1e-6);
    const auto mean = [i](const Plane* planes) {
        return (planes[0][i] + planes[1][i] + planes[2][i]) / 3;
    };
    EXPECT_NEAR(channel("color.noise"), std::sqrt(mean(frame.variance)) / (1 + mean(frame.color)),
                1e-6);
    EXPECT_EQ(channel("N.Y"), frame.feature[kNormalY][i]);
    EXPECT_EQ(channel("albedo.B"), frame.feature[kAlbedoB][i]);
    const float largest = *std::ranges::max_element(frame.feature[kDepth]);
    const float n = std::max(frame.count[i], 1.0f);
    EXPECT_NEAR(channel("depth"), frame.feature[kDepth][i] / largest, 1e-6);
    EXPECT_NEAR(channel("depth.noise"), std::sqrt(frame.feature_variance[kDepth][i] / n) / largest,
                1e-6);
    EXPECT_NEAR(channel("normal.noise"), std::sqrt(mean(frame.feature_variance + kNormalX) / n),
                1e-6);
    EXPECT_NEAR(channel("gradient"), std::log(1 + SobelMagnitude(frame)[i]), 1e-6);
    EXPECT_NEAR(channel("count"), std::log2(1 + frame.count[i]) / 8, 1e-6);
}

// Zero weights: what the biases say is every pixel's.
TEST(PrintedNet, OutputsBecomeSigmas) {
    TensorArchive weights = RandomStack({16, 5}, 3, 1);
    std::ranges::fill(weights["conv0.weight"].values, 0.0f);
    weights["conv0.bias"].values = {1.5f, -0.5f, 0.25f, -2, 40};
    const Frame frame = MakeRandomFrame(40, 30, 3);
    const Result result = MakePrintedNet(weights, "drawn")->Reconstruct(frame, CancelToken{});
    std::vector<Plane> sigmas;
    for (const double x : weights["conv0.bias"].values) {
        sigmas.emplace_back(frame.pixel_count(),
                            static_cast<float>(0.01 + std::log1p(std::exp(x))));
    }
    const Result expected =
        FilterBySigmas(frame, MakeGuides(frame), sigmas, BestNetPrinted(), CancelToken{});
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        ASSERT_NEAR(result.color[1][i], expected.color[1][i], 1e-5);
    }
    EXPECT_EQ(result.notes.at("sigma_d"), "40 in the mean");
}

TEST(PrintedNet, KeepsConstantsAndAnySize) {
    const auto net = MakePrintedNet(Weights(), "drawn");
    for (const auto& [width, height] : {std::pair{1, 1}, {3, 7}, {1, 40}, {65, 33}, {0, 0}}) {
        Frame frame = MakeRandomFrame(width, height, 6);
        for (Plane& plane : frame.color) {
            plane.assign(frame.pixel_count(), 700.0f);
        }
        const auto check = [&] {
            const Result result = RunDenoiser(*net, frame, CancelToken{});
            ASSERT_EQ(result.error->size(), frame.pixel_count());
            for (const Plane& plane : result.color) {
                for (const float value : plane) {
                    EXPECT_NEAR(value, 700, 700e-6);
                }
            }
        };
        check();
        for (int f = 0; f < kFeatureCount; ++f) {
            frame.feature[f].clear();
            frame.feature_variance[f].clear();
        }
        check();
    }
}

TEST(PrintedNet, EstimatesItsErrorWhereSigmasAreFixed) {
    TensorArchive weights = RandomStack({16, 5}, 3, 1);
    std::ranges::fill(weights["conv0.weight"].values, 0.0f);
    weights["conv0.bias"].values = {2, -1, 0, 0, 0};
    const auto net = MakePrintedNet(weights, "drawn");
    const Truth truth{90, 60};
    double estimated = 0, real = 0;
    for (const unsigned seed : {1u, 2u, 3u}) {
        const Frame frame = MakeGaussianFrame(truth, seed);
        const Result result = net->Reconstruct(frame, CancelToken{});
        for (int y = 0; y < truth.height; ++y) {
            for (int x = 0; x < truth.width; ++x) {
                const auto i = static_cast<std::size_t>(y * truth.width + x);
                estimated += (*result.error)[i];
                const Rgb color = truth.Color(x, y);
                for (std::size_t c = 0; c < 3; ++c) {
                    real += std::pow(result.color[c][i] - color[c], 2) / 3;
                }
            }
        }
    }
    EXPECT_NEAR(estimated / real, 1, 0.1);
}

TEST(PrintedNet, WeightsThatDontFitAreRefused) {
    EXPECT_THAT(MessageOf([] {
                    (void)MakePrintedNet(RandomStack({16, 4, 6}, 3, 1), "a.tza");
                }),
                testing::AllOf(HasSubstr("a.tza"), HasSubstr("6 outputs"), HasSubstr("16 and 5")));
    EXPECT_THAT(MessageOf([] { (void)MakePrintedNet({}, "a.tza"); }), HasSubstr("a.tza"));
}

}  // namespace
}  // namespace relume::denoise
