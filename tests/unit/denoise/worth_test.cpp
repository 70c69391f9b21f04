#include "server/denoise/worth.h"

#include <gtest/gtest.h>

namespace relume::denoise {
namespace {

TEST(Worth, SamplesForAGainAreWhatLowersTheErrorAsMuch) {
    EXPECT_DOUBLE_EQ(SamplesFor(1), 0);
    // Twice the samples: 2^-0.8 of the error.
    EXPECT_NEAR(SamplesFor(0.5743), 1, 1e-3);
    EXPECT_GT(SamplesFor(0.3), SamplesFor(0.31));
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
