#include "server/denoise/worth.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "server/denoise/purse.h"

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

TEST(Purse, BuysWhatSamplesOfTheSameGainWouldCostMoreFor) {
    const double gain = 0.8, worth = 0.6 * 32 * SampleCost({}) * SamplesFor(gain, {});
    Purse purse(0.6, 0, {}, 32, 0);
    EXPECT_FALSE(purse.Buy(1.01 * worth, gain));
    // What was bought leaves as much for the next: each is weighed by its own gain.
    EXPECT_TRUE(purse.Buy(0.99 * worth, gain));
    EXPECT_TRUE(purse.Buy(0.99 * worth, gain));
    EXPECT_FALSE(purse.Buy(0.1, 1));
    EXPECT_TRUE(Purse(0.6, 0, {}, 64, 0).Buy(1.9 * worth, gain));
    EXPECT_TRUE(Purse(0.6, 0, {.rays = 100}, 32, 0).Buy(1.01 * worth, gain));
    EXPECT_FALSE(Purse(0.6, 0, {.falls = 2}, 32, 0).Buy(0.99 * worth, gain));
}

TEST(Purse, HasNoMoreThanItsSeconds) {
    Purse purse(0, 3, {}, 1, 0.5);  // six times the bilateral filter
    purse.Spend(2);
    EXPECT_TRUE(purse.Buy(3, 0.99));
    EXPECT_FALSE(purse.Buy(1.5, 0.01));
    EXPECT_TRUE(purse.Buy(1, 0.99));
    EXPECT_TRUE(Purse(0, 0, {}, 1, 0.5).Buy(1e6, 0.99));  // no bounds
}

TEST(Worth, WithoutItsWeightsOidnGainsNothing) {
    for (const Gain& gain : ExpectedGains(false, 0.1)) {
        EXPECT_EQ(gain.gain < 1, gain.slot != kOidnSlot);
    }
}

}  // namespace
}  // namespace relume::denoise
