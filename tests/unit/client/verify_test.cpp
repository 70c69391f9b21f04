#include "client/lib/verify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "core/base/error.h"

namespace relume::client {
namespace {

constexpr int kWidth = 48, kHeight = 40;

// An image of unequal brightness whose error is normal and, relative to it, of unequal size: the
// true RelMSE is `relmse`. Its probe has halves with normal noise at one pixel in `stride`.
struct Case {
    Image image{kWidth, kHeight, {"R", "G", "B", "noisy.R", "noisy.G", "noisy.B"}};
    Image probe{kWidth,
                kHeight,
                {"buffer_a.R", "buffer_a.G", "buffer_a.B", "buffer_b.R", "buffer_b.G", "buffer_b.B",
                 "samples.Y"}};
    double truth = 0;  // of this very image: RelMSE over all its pixels
};

Case MakeCase(std::uint32_t seed, double relmse, double probe_noise, std::size_t stride = 2) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Case made;
    for (std::size_t i = 0; i < made.image.pixel_count(); ++i) {
        const double brightness = 0.05 + 0.01 * static_cast<double>(i % 97);
        const double spread = std::sqrt(brightness * brightness + 0.01);
        // Factors of a mean square of 1: a tenth of the pixels has nine tenths of the error.
        const double size = i % 10 == 0 ? 3 : 1 / 3.0;
        for (int c = 0; c < 3; ++c) {
            const std::string channel(1, "RGB"[c]);
            const double error = spread * size * std::sqrt(relmse) * normal(random);
            made.image.Plane("noisy." + channel)[i] = static_cast<float>(brightness + error);
            made.image.Plane(channel)[i] = static_cast<float>(brightness + error / 2);
            made.truth += error * error / (spread * spread) / 3 /
                          static_cast<double>(made.image.pixel_count());
            for (const char* half : {"buffer_a.", "buffer_b."}) {
                made.probe.Plane(half + channel)[i] =
                    static_cast<float>(brightness + spread * probe_noise * normal(random));
            }
        }
        made.probe.Plane("samples.Y")[i] = random() % stride == 0 ? 64 : 0;
    }
    return made;
}

TEST(MeasureError, IntervalCoversTheTruthAsOftenAsItSays) {
    // 19 in 20; of 400, four deviations are 17. The noise of the probe is as large as the error.
    int noisy = 0, filtered = 0;
    double mean = 0;
    for (std::uint32_t seed = 0; seed < 400; ++seed) {
        const Case c = MakeCase(seed, 0.004, 0.06);
        const MeasuredError error = MeasureError(c.image, "noisy", c.probe);
        noisy += error.low <= c.truth && c.truth <= error.high;
        mean += error.relmse / 400;
        const MeasuredError half = MeasureError(c.image, "", c.probe);
        filtered += half.low <= c.truth / 4 && c.truth / 4 <= half.high;
    }
    // The truth is that of the image; choosing half of its pixels, without repetition, leaves less
    // to chance than the interval allows for.
    EXPECT_GE(noisy, 380 - 17);
    EXPECT_GE(filtered, 380 - 17);
    EXPECT_NEAR(mean, 0.004, 0.0001);
}

TEST(MeasureError, NoiseOfTheProbeIsNotTakenForError) {
    double mean = 0;
    for (std::uint32_t seed = 0; seed < 200; ++seed) {
        const Case c = MakeCase(seed, 0, 0.05);  // an image without error
        const MeasuredError error = MeasureError(c.image, "", c.probe);
        mean += error.relmse / 200;
        EXPECT_LT(error.low, error.high);
    }
    // The halves' own mean square is 0.0025; its mean over 200 x 960 pixels is known to 1e-5.
    EXPECT_NEAR(mean, 0, 2e-5);
}

TEST(MeasureError, IsTheFormulaOfItsHeader) {
    Image image(2, 1, {"R", "G", "B"});
    Image probe(2, 1,
                {"buffer_a.R", "buffer_a.G", "buffer_a.B", "buffer_b.R", "buffer_b.G", "buffer_b.B",
                 "samples.Y"});
    image.SetWindow(10, 20, 100, 100);
    probe.SetWindow(10, 20, 100, 100);
    image.Plane("R")[0] = 3;
    probe.Plane("buffer_a.R")[0] = 1;
    probe.Plane("buffer_b.R")[0] = 2;
    image.Plane("G")[1] = 0.5f;
    probe.Plane("buffer_a.G")[1] = -1;
    probe.Plane("buffer_b.G")[1] = 1;  // their product is below 0: the denominator is 0.01
    probe.Plane("samples.Y")[0] = probe.Plane("samples.Y")[1] = 8;
    const double first = 2.0 * 1.0 / 2.01 / 3, second = 1.5 * -0.5 / 0.01 / 3;
    const MeasuredError error = MeasureError(image, "", probe);
    EXPECT_EQ(error.pixels, 2u);
    EXPECT_NEAR(error.relmse, (first + second) / 2, 1e-6);
    EXPECT_NEAR(error.standard_error, std::abs(first - second) / 2, 1e-6);
    EXPECT_EQ(error.worst_share, 0);  // the sum is below 0
    image.Plane("G")[1] = 3;
    const double third = 4.0 * 2.0 / 0.01 / 3;
    const MeasuredError other = MeasureError(image, "", probe);
    EXPECT_NEAR(other.worst_share, third / (first + third), 1e-6);
    EXPECT_EQ(other.worst_x, 11);
    EXPECT_EQ(other.worst_y, 20);
}

TEST(MeasureError, LeavesOutPixelsThatLostTheirSamples) {
    Case c = MakeCase(1, 0.004, 0.06);
    c.probe.Plane("buffer_a.R")[0] = 1000;
    c.probe.Plane("buffer_b.R")[0] = -1000;
    c.probe.Plane("samples.Y")[0] = 33;
    const MeasuredError with = MeasureError(c.image, "noisy", c.probe);
    c.probe.Plane("samples.Y")[0] = 32;
    const MeasuredError without = MeasureError(c.image, "noisy", c.probe);
    EXPECT_EQ(without.pixels, with.pixels - 1);
    EXPECT_GT(std::abs(with.relmse), 10 * without.relmse);
}

TEST(MeasureError, RefusesWhatCanNotBeCompared) {
    const Case c = MakeCase(1, 0.004, 0.06);
    Image moved = c.image;
    moved.SetWindow(1, 0, 100, 100);
    EXPECT_THROW(MeasureError(moved, "", c.probe), Error);
    EXPECT_THROW(MeasureError(c.image, "other", c.probe), Error);
    Image empty = c.probe;
    std::ranges::fill(empty.Plane("samples.Y"), 0.0f);
    EXPECT_THROW(MeasureError(c.image, "", empty), Error);
    Image broken = c.image;
    std::ranges::fill(broken.Plane("G"), std::numeric_limits<float>::quiet_NaN());
    try {
        MeasureError(broken, "", c.probe);
        FAIL() << "nothing was thrown";
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("not finite"));
    }
}

TEST(Agree, RejectsATrueClaimOnceInTwentyAndOneFourTimesTooSmallAlways) {
    int rejected = 0;
    for (std::uint32_t seed = 0; seed < 400; ++seed) {
        const Case c = MakeCase(seed, 0.004, 0.03);
        const MeasuredError measured = MeasureError(c.image, "noisy", c.probe);
        rejected += !Agree({c.truth, c.truth, c.truth}, measured);
        for (const double factor : {0.25, 4.0}) {
            const double claim = factor * c.truth;
            EXPECT_FALSE(Agree({claim, 0.8 * claim, 1.2 * claim}, measured)) << seed;
        }
    }
    EXPECT_LE(rejected, 20 + 17);
    EXPECT_GT(rejected, 0);
}

TEST(Agree, CombinesBothIntervals) {
    MeasuredError measured;
    measured.relmse = 0.02;
    measured.standard_error = 0.002;  // 1.96 of them: a factor of exp(0.196)
    EXPECT_TRUE(Agree({0.02 * std::exp(0.19), 0.02, 0.03}, measured));
    EXPECT_FALSE(Agree({0.02 * std::exp(0.2), 0.02 * std::exp(0.2), 0.03}, measured));
    // The claim's own interval towards the measurement, here a factor of exp(0.1): together
    // sqrt(0.196^2 + 0.1^2) = 0.22.
    const double claim = 0.02 * std::exp(0.2);
    EXPECT_TRUE(Agree({claim, claim * std::exp(-0.1), claim}, measured));
    EXPECT_FALSE(Agree({claim, claim, 2 * claim}, measured));
    // Its interval reaches down to 0.
    EXPECT_TRUE(Agree({100, 0, 100}, measured));
    // Too close to 0 for a logarithm.
    measured.standard_error = 0.02;
    EXPECT_TRUE(Agree({0, 0, 0}, measured));
    EXPECT_TRUE(Agree({0.059, 0.059, 0.059}, measured));
    EXPECT_FALSE(Agree({0.06, 0.06, 0.06}, measured));
    EXPECT_TRUE(Agree({0.06, 0.03, 0.06}, measured));
    // A black image.
    EXPECT_TRUE(Agree({0, 0, 0}, {}));
}

TEST(ReadClaim, TakesNumbersInOrder) {
    Image image(1, 1);
    EXPECT_FALSE(ReadClaim(image, "relume.relmse"));
    image.metadata()["relume.relmse"] = "0.0125";
    EXPECT_THROW(ReadClaim(image, "relume.relmse"), Error);
    image.metadata()["relume.relmse_interval"] = "0.01 1.5e-2";
    const auto claim = ReadClaim(image, "relume.relmse");
    ASSERT_TRUE(claim);
    EXPECT_EQ(claim->relmse, 0.0125);
    EXPECT_EQ(claim->low, 0.01);
    EXPECT_EQ(claim->high, 0.015);
    for (const char* interval : {"", "0.01", "0.01 x", "0.01 0.015 0.02", "0.015 0.01", "nan 1",
                                 "-1 1", "0.02 0.03", "0.001,0.02"}) {
        image.metadata()["relume.relmse_interval"] = interval;
        EXPECT_THROW(ReadClaim(image, "relume.relmse"), Error) << interval;
    }
}

}  // namespace
}  // namespace relume::client
