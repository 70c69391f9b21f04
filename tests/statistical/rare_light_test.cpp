// What samplers do to light that a path finds with chance p: .05, .02, .005 (scenes/rare_light). At
// 24 samples a pixel in the mean, from the default pilot, unfiltered. bench/rare_light measures the
// same over more seeds.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/rare_light.h"

namespace relume::test {
namespace {

constexpr int kSpp = 24, kSize = 48;

double Error(const Moments& m) { return std::sqrt(m.MeanVariance()); }

class RareLightTest : public testing::TestWithParam<const char*> {};

TEST_P(RareLightTest, IsThereWithUniformSamples) {
    const RareLight r = MeasureRareLight(GetParam(), "uniform", kSpp, kSize, 32);
    EXPECT_NEAR(r.energy.mean, 1, 4 * Error(r.energy));
    EXPECT_LT(Error(r.energy), 0.04);
    // The pattern of the noisy third has 8 bits.
    EXPECT_NEAR(r.other[0].mean, 1, 3e-3);
    EXPECT_NEAR(r.other[1].mean, 1, 1e-5);
}

TEST_P(RareLightTest, IsKeptByAdaptive) {
    // As many seeds as resolve half a per cent.
    const bool rarest = std::string(GetParam()) == "005";
    const RareLight r =
        MeasureRareLight(GetParam(), "adaptive:by=noise", kSpp, kSize, rarest ? 160 : 48);
    EXPECT_NEAR(r.energy.mean, 1, 0.005 + 3 * Error(r.energy));
    const double bound = 0.005 + 3 * Error(r.without_luck);
    EXPECT_NEAR(r.without_luck.mean, 1, bound);
    EXPECT_LT(bound, 0.01) << "more seeds are needed";
    // It is adaptive: the light gets twice its share, and far more than what has no noise.
    EXPECT_GT(r.samples.mean, 1.5 * kSpp);
}

// A documented failure of the paper's rule. A pixel that has seen nothing stops for ever, too dark.
TEST_P(RareLightTest, IsLostByPaperCorrected) {
    const RareLight r = MeasureRareLight(GetParam(), "paper:mode=corrected", kSpp, kSize, 4);
    EXPECT_LT(r.energy.mean, 0.75 - 3 * Error(r.energy));
}

// Equation (5) to the letter makes all pixels go on but those that have just been hit, which stop
// too bright.
TEST_P(RareLightTest, IsExaggeratedByPaperPrinted) {
    const RareLight r = MeasureRareLight(GetParam(), "paper:mode=printed", kSpp, kSize, 4);
    EXPECT_GT(r.energy.mean, 1.25 + 3 * Error(r.energy));
}

INSTANTIATE_TEST_SUITE_P(Chances, RareLightTest, testing::Values("050", "020", "005"));

}  // namespace
}  // namespace relume::test
