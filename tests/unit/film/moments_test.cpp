#include "core/film/moments.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "core/film/merge_moments.h"
#include "tests/unit/film/samples.h"

namespace relume {
namespace {

using Planes = std::array<float, kFilmChannelCount>;

Planes Stored(const PixelMoments& moments) {
    Planes planes{};
    moments.Store(planes.data(), 1);
    return planes;
}

void Put(const Planes& planes, std::size_t pixel, MomentsBlock* block) {
    for (std::size_t c = 0; c < planes.size(); ++c) {
        (*block)[c][pixel] = planes[c];
    }
}

Planes Merged(const Planes& planes, const Planes& later) {
    MomentsBlock block{}, more{};
    Put(planes, 0, &block);
    Put(later, 0, &more);
    MergeMoments(more, &block);
    Planes merged{};
    for (std::size_t c = 0; c < merged.size(); ++c) {
        merged[c] = block[c][0];
    }
    return merged;
}

TEST(Moments, AreThoseOfTheTextbook) {
    Moments m;
    for (const double x : {2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0}) {
        m.Add(x);
    }
    EXPECT_EQ(m.n, 8);
    EXPECT_DOUBLE_EQ(m.mean, 5);
    EXPECT_DOUBLE_EQ(m.m2, 32);
    EXPECT_DOUBLE_EQ(m.SampleVariance(), 32.0 / 7);
    EXPECT_DOUBLE_EQ(m.MeanVariance(), 32.0 / 56);
}

TEST(Moments, VarianceNeedsTwoSamples) {
    Moments m;
    EXPECT_EQ(m.SampleVariance(), 0);
    m.Add(3);
    EXPECT_EQ(m.SampleVariance(), 0);
    EXPECT_EQ(m.MeanVariance(), 0);
}

TEST(Moments, MergeEqualsAddingAll) {
    std::vector<double> values;
    for (int i = 0; i < 100; ++i) {
        values.push_back(std::sin(i * 1.7) + 0.01 * i);
    }
    Moments all;
    for (const double x : values) {
        all.Add(x);
    }
    for (std::size_t cut = 0; cut <= values.size(); ++cut) {
        Moments first, second;
        for (std::size_t i = 0; i < values.size(); ++i) {
            (i < cut ? first : second).Add(values[i]);
        }
        first.Merge(second);
        EXPECT_EQ(first.n, all.n);
        EXPECT_NEAR(first.mean, all.mean, 1e-13);  // rounding of 100 sums of numbers about 1
        EXPECT_NEAR(first.m2, all.m2, 1e-12);
    }
}

TEST(Moments, MergingNothingChangesNothing) {
    Moments m, nothing;
    m.Add(1.25);
    m.Add(7);
    const Moments before = m;
    m.Merge(nothing);
    nothing.Merge(before);
    EXPECT_EQ(m.m2, before.m2);
    EXPECT_EQ(m.mean, before.mean);
    EXPECT_EQ(nothing.n, 2);
    EXPECT_EQ(nothing.mean, before.mean);
    EXPECT_EQ(nothing.m2, before.m2);
}

TEST(Moments, SquaredDeviationsSurviveALargeMean) {
    // A difference of sums of squares would lose all digits here, or turn negative.
    Moments m, other;
    for (int i = 0; i < 1000; ++i) {
        (i < 500 ? m : other).Add(1e9 + (i % 2 == 0 ? 0.5 : -0.5));
    }
    m.Merge(other);
    EXPECT_NEAR(m.m2, 250, 1e-3);  // 1e9 in double has steps of 1.2e-7
    Moments constant;
    for (int i = 0; i < 1000; ++i) {
        constant.Add(0.1);
    }
    EXPECT_GE(constant.m2, 0);
    EXPECT_LT(constant.m2, 1e-25);
}

TEST(PixelMoments, HalvesAreByParityOfTheIndex) {
    PixelMoments moments;
    PixelSample sample;
    for (const std::uint32_t index : {10u, 11u, 12u}) {
        sample.radiance = {static_cast<float>(index), 1, 0};
        sample.features[kDepth] = static_cast<float>(index) * 2;
        sample.indirect_luminance = static_cast<float>(20 - index);
        moments.Add(index, sample);
    }
    const Planes planes = Stored(moments);
    EXPECT_EQ(planes[kCountA], 2);
    EXPECT_EQ(planes[kCountB], 1);
    EXPECT_EQ(planes[kBadCount], 0);
    EXPECT_EQ(planes[kMaxLuminance], 10);
    EXPECT_EQ(planes[kMeanA], 11);
    EXPECT_EQ(planes[kM2A], 2);
    EXPECT_EQ(planes[kMeanB], 11);
    EXPECT_EQ(planes[kM2B], 0);
    EXPECT_EQ(planes[int{kFeatureMeanA} + kDepth], 22);
    EXPECT_EQ(planes[int{kFeatureMeanB} + kDepth], 22);
    EXPECT_EQ(planes[int{kFeatureM2} + kDepth], 8);  // 20, 22, 24
}

TEST(MergeMoments, EqualsAddingAll) {
    const Planes all = Stored(MakeMoments(3, 0, 40));
    for (std::uint32_t cut = 0; cut <= 40; ++cut) {
        const Planes planes =
            Merged(Stored(MakeMoments(3, 0, cut)), Stored(MakeMoments(3, cut, 40 - cut)));
        for (std::size_t c = 0; c < planes.size(); ++c) {
            // Sums in another order, rounded to float.
            EXPECT_NEAR(planes[c], all[c], 1e-6f * std::max(1.0f, all[c]))
                << FilmChannelNames()[c] << ", cut at " << cut;
        }
    }
}

TEST(MergeMoments, GoesOnFromRoundedOnes) {
    // Rounded to float at each of five merges.
    Planes planes{};
    for (std::uint32_t first = 0; first < 40; first += 8) {
        planes = Merged(planes, Stored(MakeMoments(3, first, 8)));
    }
    const Planes all = Stored(MakeMoments(3, 0, 40));
    for (std::size_t c = 0; c < planes.size(); ++c) {
        EXPECT_NEAR(planes[c], all[c], 2e-6f * std::max(1.0f, all[c])) << FilmChannelNames()[c];
    }
}

TEST(MergeMoments, NothingChangesNothing) {
    const Planes some = Stored(MakeMoments(1, 0, 9)), none{};
    EXPECT_EQ(Merged(some, none), some);
    EXPECT_EQ(Merged(none, some), some);
}

TEST(MergeMoments, PixelsOfABlockAreApart) {
    MomentsBlock block{}, later{};
    for (std::size_t k = 0; k < kMomentsBlock; ++k) {
        const auto pixel = static_cast<std::uint32_t>(k);
        Put(Stored(MakeMoments(pixel, 0, pixel % 7)), k, &block);
        Put(Stored(MakeMoments(pixel, pixel % 7, pixel % 5)), k, &later);
    }
    MergeMoments(later, &block);
    for (std::size_t k = 0; k < kMomentsBlock; ++k) {
        const auto pixel = static_cast<std::uint32_t>(k);
        const Planes alone = Merged(Stored(MakeMoments(pixel, 0, pixel % 7)),
                                    Stored(MakeMoments(pixel, pixel % 7, pixel % 5)));
        for (std::size_t c = 0; c < alone.size(); ++c) {
            EXPECT_EQ(block[c][k], alone[c]);
        }
    }
}

TEST(PixelMoments, BadSamplesAreCountedAndLeaveNoOtherTrace) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float infinity = std::numeric_limits<float>::infinity();
    PixelMoments moments = MakeMoments(2, 0, 6);
    const Planes before = Stored(moments);
    PixelSample sample = MakeSample(2, 6);
    sample.radiance.y = nan;
    moments.Add(6, sample);
    sample = MakeSample(2, 7);
    sample.features[kNormalZ] = -infinity;
    moments.Add(7, sample);
    sample = MakeSample(2, 8);
    sample.indirect_luminance = infinity;
    moments.Add(8, sample);
    Planes planes = Stored(moments);
    EXPECT_EQ(planes[kBadCount], 3);
    planes[kBadCount] = 0;
    EXPECT_EQ(planes, before);
    EXPECT_EQ(Merged(before, Stored(moments))[kBadCount], 3);
}

TEST(PixelMoments, TheSquareOfAHugeSampleStaysFinite) {
    PixelMoments moments;
    PixelSample sample;
    moments.Add(0, sample);
    sample.radiance = {1e30f, std::numeric_limits<float>::max(), 1};
    sample.features[kDepth] = 1e25f;
    moments.Add(2, sample);
    Planes planes = Stored(moments);
    EXPECT_THAT(planes, testing::Each(testing::Truly([](float x) { return std::isfinite(x); })));
    EXPECT_EQ(planes[kBadCount], 0);
    EXPECT_THAT(Merged(planes, planes),
                testing::Each(testing::Truly([](float x) { return std::isfinite(x); })));
}

TEST(FilmChannels, HaveNamesOfTheirOwnInOrder) {
    const auto& names = FilmChannelNames();
    ASSERT_EQ(names.size(), static_cast<std::size_t>(kFilmChannelCount));
    EXPECT_EQ(kFilmChannelCount, 40);
    EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
    EXPECT_EQ(names[kCountB], "n_b");
    EXPECT_EQ(names[kMeanB + 1], "mean_b.G");
    EXPECT_EQ(names[kM2A], "m2_a.R");
    EXPECT_EQ(names[int{kFeatureMeanA} + kVisibility], "feature_mean_a.visibility.Y");
    EXPECT_EQ(names[int{kFeatureM2} + kDepth], "feature_m2.Z");
}

}  // namespace
}  // namespace relume
