#include "server/denoise/feature_prefilter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

// The truth's features, of which `noisy` have Gaussian noise: `variance` of one sample, 8 samples;
// 64 times that for depth, which is last.
Frame NoisyFeatures(const Truth& truth, const std::vector<int>& noisy, float variance,
                    unsigned seed) {
    Frame frame = MakeGaussianFrame(truth, seed);
    std::mt19937 rng(seed + 100);
    for (int f = 0; f < kFeatureCount; ++f) {
        frame.feature_variance[f].assign(frame.pixel_count(), 0.0f);
        for (auto& half : frame.feature_half) {
            half[f] = frame.feature[f];
        }
    }
    for (const int f : noisy) {
        if (f == kDepth) {
            variance *= 64;  // as much of its largest, 8
        }
        frame.feature_variance[f].assign(frame.pixel_count(), variance);
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            for (auto& half : frame.feature_half) {
                half[f][i] += static_cast<float>(std::sqrt(variance / 4) * Normal(&rng));
            }
            frame.feature[f][i] =
                0.5f * (frame.feature_half[0][f][i] + frame.feature_half[1][f][i]);
        }
    }
    return frame;
}

double SquaredError(const Truth& truth, const Plane& plane, int f) {
    double sum = 0;
    for (std::size_t i = 0; i < plane.size(); ++i) {
        const PixelSample sample =
            truth.Features(static_cast<int>(i) % truth.width, static_cast<int>(i) / truth.width);
        const double d = plane[i] - sample.features[static_cast<std::size_t>(f)];
        sum += d * d;
    }
    return sum / static_cast<double>(plane.size());
}

double Mean(const Plane& plane) {
    double sum = 0;
    for (const float value : plane) {
        sum += value;
    }
    return sum / static_cast<double>(plane.size());
}

TEST(FeaturePrefilter, LeavesFeaturesWithoutNoiseAsTheyAre) {
    const Truth truth{90, 60};
    const Frame frame = NoisyFeatures(truth, {kVisibility}, 0.2f, 1);
    const PrefilteredFeatures out = PrefilterFeatures(frame, {});
    for (int f = 0; f < kFeatureCount; ++f) {
        if (f != kVisibility) {
            EXPECT_EQ(out.feature[f], frame.feature[f]) << FeatureName(f);
            EXPECT_EQ(out.variance[f], Plane(frame.pixel_count(), 0.0f)) << FeatureName(f);
        }
    }
    EXPECT_NE(out.feature[kVisibility], frame.feature[kVisibility]);
}

TEST(FeaturePrefilter, TakesTheNoiseOutAndTellsWhatIsLeft) {
    const Truth truth{120, 90};
    const std::vector<int> noisy = {kAlbedoR, kAlbedoG, kAlbedoB, kNormalX,
                                    kNormalY, kNormalZ, kDepth,   kVisibility};
    for (const bool halves : {true, false}) {
        Frame frame = NoisyFeatures(truth, noisy, 0.02f, 2);
        if (!halves) {
            for (auto& half : frame.feature_half) {
                for (Plane& plane : half) {
                    plane.clear();
                }
            }
        }
        const PrefilteredFeatures out = PrefilterFeatures(frame, {});
        for (const int f : noisy) {
            const double error = SquaredError(truth, out.feature[f], f);
            // Albedo is checks of 8 pixels, in which few patches of 7 are alike.
            const double left = f >= kAlbedoR && f <= kAlbedoB ? 0.7 : 0.2;
            EXPECT_LT(error, left * SquaredError(truth, frame.feature[f], f)) << FeatureName(f);
            EXPECT_GT(Mean(out.variance[f]), 0.4 * error) << FeatureName(f);
            EXPECT_LT(Mean(out.variance[f]), 1.6 * error) << FeatureName(f);
        }
    }
}

TEST(FeaturePrefilter, KeepsEdges) {
    const Truth truth{120, 90};
    const Frame frame = NoisyFeatures(truth, {kDepth}, 0.02f, 3);
    const PrefilteredFeatures out = PrefilterFeatures(frame, {});
    for (int y = 0; y < 90; ++y) {  // the wall begins at 72: 8 before, 4 behind
        EXPECT_NEAR(out.feature[kDepth][static_cast<std::size_t>(y * 120 + 71)], 8, 0.5);
        EXPECT_NEAR(out.feature[kDepth][static_cast<std::size_t>(y * 120 + 72)], 4, 0.5);
    }
}

TEST(FeaturePrefilter, TakesWhatThereIs) {
    Frame frame = NoisyFeatures({40, 30}, {kAlbedoR, kDepth}, 0.02f, 4);
    for (int f : {kNormalX, kNormalY, kNormalZ}) {
        frame.feature[f].clear();
        frame.feature_variance[f].clear();
    }
    frame.feature_variance[kDepth].clear();
    frame.count.clear();
    const PrefilteredFeatures out = PrefilterFeatures(frame, {});
    EXPECT_TRUE(out.feature[kNormalX].empty());
    EXPECT_TRUE(out.variance[kNormalX].empty());
    EXPECT_EQ(out.feature[kDepth], frame.feature[kDepth]);  // nothing says that it is noisy
    EXPECT_EQ(out.variance[kDepth].size(), frame.pixel_count());
    EXPECT_NE(out.feature[kAlbedoR], frame.feature[kAlbedoR]);
}

}  // namespace
}  // namespace relume::denoise
