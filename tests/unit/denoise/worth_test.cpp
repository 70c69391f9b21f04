#include "server/denoise/worth.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace relume::denoise {
namespace {

TEST(Worth, SamplesForAGainAreWhatLowersTheErrorAsMuch) {
    EXPECT_DOUBLE_EQ(SamplesFor(1, {}), 0);
    // Twice the samples: 2^-0.8 of the error.
    EXPECT_NEAR(SamplesFor(0.5743, {}), 1, 1e-3);
    EXPECT_GT(SamplesFor(0.3, {}), SamplesFor(0.31, {}));
}

TEST(Worth, WhereTheErrorFallsQuicklyAFewSamplesDoAsMuch) {
    EXPECT_LT(SamplesFor(0.5, {.falls = 2}), SamplesFor(0.5, {.falls = 1}));
    // Noise that seems to fall more slowly than that of independent samples can't be believed.
    EXPECT_DOUBLE_EQ(SamplesFor(0.5, {.falls = 0.3}), SamplesFor(0.5, {.falls = 1}));
    EXPECT_DOUBLE_EQ(SamplesFor(0.5, {}), SamplesFor(0.5, {.falls = 1}));
    EXPECT_GT(SamplesFor(0.5, {.falls = 1e9}), 0.1);
}

TEST(Worth, SamplesCostWhatTheirRaysDo) {
    EXPECT_DOUBLE_EQ(SampleCost({.rays = 6}), 3 * SampleCost({.rays = 2}));
    EXPECT_GT(SampleCost({.rays = 8}), SampleCost({}));
    EXPECT_LT(SampleCost({.rays = 2}), SampleCost({}));
}

TEST(Worth, MixingASmallImageIsDear) {
    EXPECT_GT(MixCost(20'000), 2 * MixCost(2'000'000));
    EXPECT_LT(MixCost(0), 1);
}

TEST(Sampling, IsReadBackFromMetadata) {
    std::map<std::string, std::string> metadata{{"relume.spp", "8"}};
    WriteSampling({}, &metadata);
    EXPECT_EQ(metadata.size(), 1u);
    EXPECT_EQ(ReadSampling(metadata).rays, 0);
    WriteSampling({.rays = 4.25, .falls = 1.5}, &metadata);
    EXPECT_EQ(ReadSampling(metadata).rays, 4.25);
    EXPECT_EQ(ReadSampling(metadata).falls, 1.5);
    for (const char* odd : {"nan", "inf", "-3", "many", ""}) {
        metadata["relume.rays"] = odd;
        EXPECT_EQ(ReadSampling(metadata).rays, 0) << odd;
    }
}

TEST(Worth, TheNetworkGainsMostWhereTheBilateralFilterDoes) {
    const auto oidn = [](double left) {
        const auto gains = ExpectedGains(true, left);
        EXPECT_EQ(gains[0].slot, kOidnSlot);
        return gains[0].gain;
    };
    EXPECT_LT(oidn(0.05), oidn(0.2));
    EXPECT_LT(oidn(0.2), oidn(0.9));
    EXPECT_LT(oidn(0.99), 1);
    EXPECT_GT(oidn(1e-6), 0.2);  // the line is not followed to nothing
    // Not known, or it has failed: what is usual.
    EXPECT_EQ(oidn(0), oidn(3));
    EXPECT_LT(oidn(0), 0.5);
}

TEST(Worth, WithoutItsWeightsOidnGainsNothing) {
    for (const Gain& gain : ExpectedGains(false, 0.1)) {
        EXPECT_EQ(gain.gain < 1, gain.slot != kOidnSlot);
    }
}

}  // namespace
}  // namespace relume::denoise
