// kpcn: its inputs, how kernels are applied, and the whole with random weights.
#include "server/denoise/kpcn.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "server/denoise/crop_frame.h"
#include "server/denoise/kpcn_inputs.h"
#include "server/denoise/network/network.h"
#include "server/denoise/network/plain_stack.h"
#include "server/denoise/network/weights.h"
#include "tests/unit/denoise/random_stack.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using testing::HasSubstr;

TensorArchive LiteWeights() { return RandomStack({34, 32, 32, 32, 32, 169}, 5, 3); }

// Index in a mirrored row, by walking.
int Reflect(int p, int n) {
    int at = 0, step = n > 1 ? 1 : 0;
    for (int k = 0; k < std::abs(p); ++k) {
        if (at + step < 0 || at + step >= n) {
            step = -step;
        }
        at += step;
    }
    return at;  // to the left as to the right: the mirror stands at 0
}

// The definition, in double precision: pixel (x, y) of a frame, by logits of the whole frame.
double NaiveMean(const std::vector<Plane>& logits, const Plane& image, int width, int height, int x,
                 int y, double* own) {
    const int radius = static_cast<int>(std::sqrt(logits.size())) / 2;
    const std::size_t at = static_cast<std::size_t>(y * width + x);
    double most = -INFINITY, sum = 0, weights = 0;
    for (const Plane& plane : logits) {
        most = std::max<double>(most, plane[at]);
    }
    std::size_t k = 0;
    for (int dy = -radius; dy <= radius; ++dy) {
        for (int dx = -radius; dx <= radius; ++dx, ++k) {
            const double w = std::exp(logits[k][at] - most);
            weights += w;
            sum += w * image[static_cast<std::size_t>(Reflect(y + dy, height) * width +
                                                      Reflect(x + dx, width))];
            if (dx == 0 && dy == 0) {
                *own = w;
            }
        }
    }
    *own /= weights;
    return sum / weights;
}

TEST(KpcnKernels, AreTheMeanOfTheWindow) {
    struct Case {
        int width, height, radius;
        TileRect area, inner;
    };
    for (const Case& c :
         {Case{41, 23, 3, {0, 0, 41, 23}, {0, 0, 41, 23}},
          Case{41, 23, 2, {7, 4, 37, 20}, {9, 6, 35, 18}},
          Case{41, 23, 6, {20, 0, 41, 23}, {26, 0, 41, 13}},
          Case{3, 1, 5, {0, 0, 3, 1}, {0, 0, 3, 1}}, Case{1, 6, 10, {0, 0, 1, 6}, {0, 0, 1, 6}}}) {
        const int side = 2 * c.radius + 1;
        const Frame frame = MakeRandomFrame(c.width, c.height, 5);
        Numbers numbers(9);
        std::vector<Plane> logits(static_cast<std::size_t>(side * side)), cut;
        for (Plane& plane : logits) {
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                plane.push_back(static_cast<float>(12 * numbers.Draw() - 6));
            }
            cut.push_back(CropPlane(plane, c.width, c.area));
        }
        std::array<Plane, 3> image;
        for (std::size_t k = 0; k < 3; ++k) {
            image[k] = CropPlane(frame.color[k], c.width, c.area);
        }
        const KpcnArea tile = {{image[0].data(), image[1].data(), image[2].data()},
                               c.area,
                               c.inner,
                               c.width,
                               c.height};
        std::array<Plane, kKpcnOutputs> first;
        const KpcnList usable = UsableKpcn();
        for (int k = 0; k < usable.size; ++k) {
            std::array<Plane, kKpcnOutputs> out;
            for (Plane& plane : out) {
                plane.assign(frame.pixel_count(), -1.0f);
            }
            ApplyKpcnKernels(cut, tile, usable.list[k], {&out[0], &out[1], &out[2], &out[3]});
            if (k > 0) {
                EXPECT_TRUE(out == first);
                continue;
            }
            for (int y = 0; y < c.height; ++y) {
                for (int x = 0; x < c.width; ++x) {
                    const auto i = static_cast<std::size_t>(y * c.width + x);
                    double own = -1;
                    const bool inside = c.inner.Contains({x, y, x + 1, y + 1});
                    for (std::size_t s = 0; s < 3; ++s) {
                        const double mean = inside ? NaiveMean(logits, frame.color[s], c.width,
                                                               c.height, x, y, &own)
                                                   : -1;
                        ASSERT_NEAR(out[s][i], mean, 1e-5) << x << ", " << y;
                    }
                    ASSERT_NEAR(out[3][i], own, 1e-5);
                }
            }
            first = out;
        }
    }
}

TEST(KpcnInputs, FollowTheirDefinition) {
    Frame frame = MakeRandomFrame(9, 5, 2);
    const std::size_t i = 2 * 9 + 4, left = i - 1, above = i - 9, skyward = 7;
    for (int c = 0; c < 3; ++c) {
        frame.feature[kNormalX + c][skyward] = 0;
        frame.feature[kNormalX + c][left] = c == 1 ? 1.0f : 0.0f;
    }
    const KpcnInputs inputs = MakeKpcnInputs(frame, KpcnDepthScale(frame));
    const std::vector<std::string> names = KpcnInputNames();
    ASSERT_EQ(names.size(), 34u);
    ASSERT_EQ(inputs.channels.size(), names.size());
    const auto channel = [&](const std::string& name) -> const Plane& {
        return inputs
            .channels[static_cast<std::size_t>(std::ranges::find(names, name) - names.begin())];
    };
    EXPECT_FLOAT_EQ(inputs.divisor[0][skyward], frame.feature[kAlbedoR][skyward] + 1.03f);
    EXPECT_FLOAT_EQ(inputs.divisor[1][left], frame.feature[kAlbedoG][left] + 0.03f);
    const auto normal = [&](int c) { return frame.feature[kNormalX + c][i]; };
    const float length =
        std::sqrt(normal(0) * normal(0) + normal(1) * normal(1) + normal(2) * normal(2));
    EXPECT_FLOAT_EQ(inputs.divisor[2][i],
                    frame.feature[kAlbedoB][i] + 0.03f + std::max(1 - length, 0.0f));
    const auto log = [&](std::size_t c, std::size_t at) {
        return std::log(1 + frame.color[c][at] / inputs.divisor[c][at]);
    };
    EXPECT_NEAR(channel("color.G")[i], log(1, i), 1e-5);
    EXPECT_NEAR(channel("color.G.dx")[i], log(1, i) - log(1, left), 1e-5);
    EXPECT_NEAR(channel("color.B.dy")[i], log(2, i) - log(2, above), 1e-5);
    EXPECT_EQ(channel("color.R.dx")[9], 0);
    EXPECT_EQ(channel("color.R.dy")[3], 0);
    const auto mean = [](auto value) { return (value(0u) + value(1u) + value(2u)) / 3; };
    const float divisor = mean([&](std::size_t c) { return inputs.divisor[c][i]; });
    const float radiance =
        mean([&](std::size_t c) { return frame.color[c][i] / inputs.divisor[c][i]; });
    const float variance = mean([&](std::size_t c) { return frame.variance[c][i]; });
    EXPECT_NEAR(channel("color.noise")[i], std::sqrt(variance) / divisor / (1 + radiance), 1e-5);
    EXPECT_NEAR(
        channel("N.noise")[i],
        std::sqrt(mean([&](std::size_t c) { return frame.feature_variance[kNormalX + c][i]; }) /
                  std::max(frame.count[i], 1.0f)),
        1e-5);
    EXPECT_EQ(channel("albedo.B")[i], frame.feature[kAlbedoB][i]);
    EXPECT_EQ(*std::ranges::max_element(channel("depth")), 1);
    EXPECT_EQ(channel("depth.dx")[i], channel("depth")[i] - channel("depth")[left]);
}

TEST(Kpcn, TilesAreNotSeen) {
    const int width = 470, height = 20;  // two tiles
    const Frame frame = MakeRandomFrame(width, height, 4);
    const Result result =
        MakeKpcn("lite", LiteWeights(), "drawn")->Reconstruct(frame, CancelToken{});
    const KpcnInputs inputs = MakeKpcnInputs(frame, KpcnDepthScale(frame));
    std::vector<const float*> channels;
    for (const Plane& plane : inputs.channels) {
        channels.push_back(plane.data());
    }
    const TensorArchive weights = LiteWeights();
    const std::vector<Plane> logits =
        Network(PlainStack(weights), weights, "drawn").Run(channels, width, height, CancelToken{});
    for (int y = 0; y < height; y += 3) {
        for (int x = 0; x < width; ++x) {
            const auto i = static_cast<std::size_t>(y * width + x);
            for (std::size_t c = 0; c < 3; ++c) {
                double own = 0;
                const double mean =
                    NaiveMean(logits, inputs.demodulated[c], width, height, x, y, &own);
                ASSERT_NEAR(result.color[c][i], inputs.divisor[c][i] * mean, 1e-4 * (1 + mean))
                    << x << ", " << y;
            }
        }
    }
}

TEST(Kpcn, KeepsConstantsAndAnySize) {
    const auto kpcn = MakeKpcn("lite", LiteWeights(), "drawn");
    for (const auto& [width, height] : {std::pair{1, 1}, {3, 7}, {1, 40}, {33, 2}, {0, 0}}) {
        Frame frame = MakeRandomFrame(width, height, 6);
        for (std::size_t c = 0; c < 3; ++c) {
            frame.color[c].assign(frame.pixel_count(), 700.0f);
            for (int f = 0; f < kFeatureCount; ++f) {
                frame.feature[f].clear();
                frame.feature_variance[f].clear();
            }
        }
        const Result result = RunDenoiser(*kpcn, frame, CancelToken{});
        ASSERT_EQ(result.error->size(), frame.pixel_count());
        for (const Plane& plane : result.color) {
            for (const float value : plane) {
                EXPECT_NEAR(value, 700, 700e-6);
            }
        }
    }
}

// The weights don't depend on the colour: each is the mean of its window, and SURE is exact in the
// mean.
TEST(Kpcn, EstimatesItsErrorWhereWeightsAreFixed) {
    TensorArchive weights = RandomStack({34, 25}, 1, 3);
    weights["conv0.weight"].values.assign(34 * 25, 0.0f);
    const auto kpcn = MakeKpcn("lite", weights, "drawn");
    const Truth truth{90, 60};
    double estimated = 0, real = 0;
    for (const unsigned seed : {1u, 2u, 3u}) {
        Frame frame = MakeGaussianFrame(truth, seed);
        for (Plane& plane : frame.feature) {
            plane.clear();  // nothing to be divided by
        }
        const Result result = kpcn->Reconstruct(frame, CancelToken{});
        for (int y = 0; y < truth.height; ++y) {
            for (int x = 0; x < truth.width; ++x) {
                const auto i = static_cast<std::size_t>(y * truth.width + x);
                estimated += (*result.error)[i];
                const Rgb color = truth.Color(x, y);
                const std::array<float, 3> is = {color[0], color[1], color[2]};
                for (int c = 0; c < 3; ++c) {
                    real += std::pow(result.color[c][i] - is[c], 2) / 3;
                }
            }
        }
    }
    EXPECT_NEAR(estimated / real, 1, 0.05);
}

TEST(Kpcn, WeightsThatDontFitAreRefused) {
    EXPECT_THAT(MessageOf([] {
                    (void)MakeKpcn("lite", RandomStack({33, 4, 9}, 3, 1), "a.tza");
                }),
                testing::AllOf(HasSubstr("a.tza"), HasSubstr("33 inputs"), HasSubstr("34 inputs")));
    EXPECT_THAT(MessageOf([] {
                    (void)MakeKpcn("lite", RandomStack({34, 4, 16}, 3, 1), "a.tza");
                }),
                HasSubstr("16 outputs"));
    EXPECT_THAT(MessageOf([] { (void)MakeKpcn("lite", {}, "a.tza"); }), HasSubstr("a.tza"));
}

TEST(Kpcn, TellsWhereWeightsAreLookedForAndWhatMakesThem) {
    if (FindNetworkWeights("relume_kpcn_full")) {
        GTEST_SKIP() << "somebody has trained it";
    }
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("kpcn:size=full"); }),
                testing::AllOf(HasSubstr("relume_kpcn_full"), HasSubstr("relume/networks"),
                               HasSubstr("train/kpcn.py")));
}

}  // namespace
}  // namespace relume::denoise
