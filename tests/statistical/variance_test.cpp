#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/film/moments.h"
#include "tests/support/scenes.h"

namespace relume::test {
namespace {

constexpr int kSeeds = 200;

// Mean over seeds of the estimate of variance from the halves, over the true variance of the mean
// among seeds.
double Ratio(std::uint32_t spp) {
    RenderSettings settings = Settings(12, 12, 5);
    const auto scene = CornellBox();
    const std::size_t pixels = 12 * 12;
    std::vector<Moments> means(pixels * 3);
    double estimated = 0;
    for (int seed = 0; seed < kSeeds; ++seed) {
        settings.seed = static_cast<std::uint32_t>(seed);
        const Film film = RenderAll(scene, settings, spp);
        for (std::size_t i = 0; i < pixels; ++i) {
            const Rgb mean = film.Mean(i), variance = film.HalfVariance(i);
            for (int c = 0; c < 3; ++c) {
                means[3 * i + static_cast<std::size_t>(c)].Add(mean[c]);
                estimated += variance[c];
            }
        }
    }
    double truth = 0;
    for (const Moments& m : means) {
        truth += m.SampleVariance();
    }
    return estimated / kSeeds / truth;
}

TEST(Variance, OfHalvesIsThatAmongSeeds) {
    for (const std::uint32_t spp : {4u, 16u}) {
        const double ratio = Ratio(spp);
        EXPECT_GT(ratio, 0.9) << spp;
        EXPECT_LT(ratio, 1.1) << spp;
    }
}

TEST(Variance, EvenAndOddSamplesHaveTheSameExpectation) {
    const Film film = RenderAll(CornellBox(), Settings(16, 16, 5), 256);
    Moments difference;
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        difference.Add(film.Plane(kMeanA)[i] - film.Plane(kMeanB)[i]);
    }
    EXPECT_LT(std::abs(difference.mean), 3.5 * std::sqrt(difference.MeanVariance()));
}

}  // namespace
}  // namespace relume::test
