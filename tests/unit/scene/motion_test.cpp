#include "core/scene/motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/math/keys.h"

namespace relume::test {
namespace {

SampledTransform Samples(const std::function<Transform(float t)>& at) {
    SampledTransform samples;
    for (const double t : SampleTimes(0, 1)) {
        samples.push_back(at(static_cast<float>(t)));
    }
    return samples;
}

SampledTransform Turning(float radians) {
    return Samples([radians](float t) {
        return Transform::Rotate(0, std::sin(radians * t / 2), 0, std::cos(radians * t / 2));
    });
}

TEST(SampleTimes, SpanTheShutter) {
    EXPECT_EQ(SampleTimes(2, 0), std::vector<double>{2});
    const std::vector<double> times = SampleTimes(2, 0.5);
    ASSERT_EQ(times.size(), kMotionSamples);
    EXPECT_EQ(times.front(), 2);
    EXPECT_EQ(times[32], 2.25);
    EXPECT_EQ(times.back(), 2.5);
}

TEST(MotionKeys, WhatStandsStillHasNone) {
    EXPECT_TRUE(MotionKeys({Transform::Translate({1, 2, 3})}).empty());
    EXPECT_TRUE(MotionKeys(Samples([](float t) {
                    return Transform::Translate({100, 0, 1e-6f * t});  // rounding
                })).empty());
}

TEST(MotionKeys, StraightWaysNeedTwo) {
    const auto keys = MotionKeys(Samples([](float t) {
        return Transform::Translate({1 + t, 2 * t, 0});
    }));
    ASSERT_EQ(keys.size(), 2u);
    EXPECT_EQ(keys[0], Transform::Translate({1, 0, 0}));
    EXPECT_EQ(keys[1], Transform::Translate({2, 2, 0}));
}

TEST(MotionKeys, AsManyAsTheRotationNeeds) {
    // The chord of an angle a is off by 1 - cos(a / 2), of which two axes of three take part:
    // sqrt(2/3) a^2 / 8 = 1e-3 at 5.7 degrees.
    const float degree = kPi / 180;
    EXPECT_EQ(MotionKeys(Turning(5 * degree)).size(), 2u);
    EXPECT_EQ(MotionKeys(Turning(10 * degree)).size(), 3u);
    EXPECT_EQ(MotionKeys(Turning(20 * degree)).size(), 5u);
    EXPECT_EQ(MotionKeys(Turning(40 * degree)).size(), 9u);
    EXPECT_EQ(MotionKeys(Turning(80 * degree)).size(), 17u);
    EXPECT_EQ(MotionKeys(Turning(160 * degree)).size(), 33u);
    EXPECT_EQ(MotionKeys(Turning(1600 * degree)).size(), 33u);
    // And the keys keep to what is promised.
    const SampledTransform samples = Turning(40 * degree);
    const auto keys = MotionKeys(samples);
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const Transform linear =
            Interpolate(keys, static_cast<float>(i) / static_cast<float>(kMotionSamples - 1));
        EXPECT_LT(Length(linear.Point({1, 0, 0}) - samples[i].Point({1, 0, 0})), 2e-3f);
    }
}

TEST(MotionKeys, CurvedWaysNeedMore) {
    const auto keys = MotionKeys(Samples([](float t) {
        return Transform::Translate({std::cos(3 * t), std::sin(3 * t), 0});
    }));
    EXPECT_EQ(keys.size(), 33u);
    EXPECT_EQ(MotionKeys(Samples([](float t) {
                  return Transform::Translate({t, 0.02f * t * t, 0});
              })).size(),
              5u);
}

TEST(MotionKeys, WeightsToo) {
    SampledWeights weights(kMotionSamples, {0.5f, 0.25f});
    EXPECT_EQ(KeysNeeded(weights), 1u);
    for (std::size_t i = 0; i < weights.size(); ++i) {
        weights[i][1] = static_cast<float>(i) / 64;
    }
    EXPECT_EQ(KeysNeeded(weights), 2u);
    for (std::size_t i = 0; i < weights.size(); ++i) {
        weights[i][1] *= weights[i][1];
    }
    EXPECT_EQ(KeysNeeded(weights), 17u);  // 1 / (4 n^2) <= 1e-3
}

}  // namespace
}  // namespace relume::test
