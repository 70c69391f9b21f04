// What NFOR owes beyond every filter's properties.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/halves.h"
#include "server/denoise/nfor_features.h"
#include "tests/unit/denoise/authors_rows.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

Result Filter(const Frame& frame) {
    return RunDenoiser(*MakeDenoiser("nfor"), frame, CancelToken{});
}

// Weights are broad, since the variances say that there is noise; the fit alone keeps the image.
TEST(Nfor, KeepsARampOnFeaturesFreeOfNoise) {
    const Truth truth{90, 50};
    Frame frame = MakeGaussianFrame(truth, 1);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        const auto x = static_cast<float>(i % 90), y = static_cast<float>(i / 90);
        for (std::size_t c = 0; c < 3; ++c) {
            const float value = 0.5f + 0.004f * x - 0.003f * y +
                                0.2f * frame.feature[kAlbedoR + c][i] -
                                0.01f * frame.feature[kDepth][i];
            for (Plane* plane : {&frame.half[0][c], &frame.half[1][c], &frame.color[c]}) {
                (*plane)[i] = value;
            }
        }
    }
    for (Plane& variance : frame.feature_variance) {
        std::ranges::fill(variance, 0.0f);
    }
    const Result result = Filter(frame);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            ASSERT_NEAR(result.color[c][i], frame.color[c][i], 1e-4) << i;
        }
    }
}

TEST(Nfor, LowersNoiseAndKeepsEdges) {
    const Truth truth{120, 80};
    const int edge = 72;
    for (const int spp : {4, 8, 32}) {
        const Frame frame = FrameFromFilm(MakeFilm(truth, spp, 7));
        const Result result = Filter(frame);
        EXPECT_LT(MrSE(truth, result.color, 0, 120), 0.1 * MrSE(truth, frame.color, 0, 120)) << spp;
        // At the edge colours are no linear function of the features: albedo counts half there.
        EXPECT_LT(MrSE(truth, result.color, edge - 2, edge + 2),
                  0.3 * MrSE(truth, frame.color, edge - 2, edge + 2))
            << spp;
    }
}

// Each half is judged by the other, whose noise had a part in the weights: what that hides is a few
// percent of the noise.
TEST(Nfor, EstimatesItsErrorButForAFewPercentOfTheNoise) {
    const Truth truth{160, 120};
    const Frame frame = MakeGaussianFrame(truth, 1);
    const Result result = Filter(frame);
    double claimed = 0, found = 0, noise = 0;
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        claimed += (*result.error)[i];
        noise += frame.variance[0][i];
        const int x = static_cast<int>(i) % truth.width, y = static_cast<int>(i) / truth.width;
        for (int c = 0; c < 3; ++c) {
            const double d = result.color[c][i] - truth.Color(x, y)[c];
            found += d * d / 3;
        }
    }
    EXPECT_LT(found, 0.05 * noise);
    EXPECT_NEAR(claimed, found, 0.03 * noise);
}

TEST(Nfor, LeavesOutWhatIsTheSameEverywhere) {
    Frame frame = MakeGaussianFrame({40, 30}, 2);
    EXPECT_EQ(Filter(frame).notes.at("features"), "albedo, normal, depth");  // all is lit
    std::ranges::fill(frame.feature[kAlbedoR], 0.5f);
    NforFeatures features = FilterHalfFeatures(frame, {});
    // A normal turns from Z to X.
    EXPECT_EQ(features.group, (std::vector<std::size_t>{2, 2, 1}));
    EXPECT_EQ(features.half[0].size(), 5u);
    EXPECT_EQ(CombineFeatures(std::move(features), 40, 30, {}).size(), 5u);
    for (int f = 0; f < kFeatureCount; ++f) {
        std::ranges::fill(frame.feature[f], 2.0f);
    }
    EXPECT_EQ(Filter(frame).notes.at("features"), "none");
}

TEST(Nfor, DoesWithOneHalf) {
    const Truth truth{96, 64};
    const Frame frame = FrameFromFilm(MakeFilm(truth, 16, 5));
    const Frame half = HalfFrame(frame, 0);
    const Result one = RunDenoiser(*MakeDenoiser("nfor"), half, CancelToken());
    const Result both = RunDenoiser(*MakeDenoiser("nfor"), frame, CancelToken());
    EXPECT_LT(MrSE(truth, one.color, 0, 96), 0.25 * MrSE(truth, half.color, 0, 96));
    EXPECT_LT(MrSE(truth, both.color, 0, 96), MrSE(truth, one.color, 0, 96));
    EXPECT_EQ(one.notes.at("halves"), "none: one fit");
    EXPECT_EQ(both.notes.count("halves"), 0u);
}

TEST(Nfor, BitsDoNotDependOnThreads) {
    const Frame frame = MakeRandomFrame(150, 70, 9);
    SetThreadCount(1);
    const Result reference = Filter(frame);
    SetThreadCount(5);
    const Result result = Filter(frame);
    SetThreadCount(0);
    for (int c = 0; c < 3; ++c) {
        EXPECT_EQ(result.color[c], reference.color[c]);
    }
    EXPECT_EQ(result.error, reference.error);
}

// The image of its authors' program on the same samples, and its distance from the reference.
TEST_F(AuthorsRows, NforComesNear) {
    const Image reference = Row("reference.exr"), theirs = Row("nfor.exr"), ours = Filter("nfor");
    const double row = MrSEOf(reference, theirs);
    EXPECT_LT(MrSEOf(reference, ours), 1.02 * row);
    EXPECT_LT(MrSEOf(theirs, ours), 0.1 * row);
}

}  // namespace
}  // namespace relume::denoise
