#include "worker/render/light/light_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "worker/render/sampler/warp.h"

namespace relume::render {
namespace {

// Small one-sided lights that face all ways, points and spots among them.
std::vector<LightExtent> RandomLights(std::size_t n, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(0, 0.999999f);
    const auto point = [&] {
        return Vec3f{uniform(random), uniform(random), uniform(random)} * 10.0f;
    };
    std::vector<LightExtent> lights(n);
    for (LightExtent& e : lights) {
        const Vec3f p = point();
        e.box.Add(p);
        e.box.Add(p + Vec3f{uniform(random), uniform(random), uniform(random)} * 0.2f);
        e.axis = SampleSphere({uniform(random), uniform(random)});
        e.reach = kPi / 2;
        e.strength = uniform(random) < 0.1f ? 0 : 0.1f + uniform(random);
        e.both_sides = uniform(random) < 0.2f;
        if (uniform(random) < 0.2f) {
            e.spread = kPi;
        } else if (uniform(random) < 0.2f) {
            e.spread = 0.3f;
            e.reach = 0.4f;
        }
    }
    return lights;
}

std::vector<LightReceiver> Receivers(int n) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> uniform(0, 0.999999f);
    std::vector<LightReceiver> receivers;
    for (int i = 0; i < n; ++i) {
        const Vec3f p = Vec3f{uniform(random), uniform(random), uniform(random)} * 12.0f;
        const Vec3f normal = SampleSphere({uniform(random), uniform(random)});
        receivers.push_back({p, i % 5 == 0 ? Vec3f{} : normal, i % 3 == 0});
    }
    return receivers;
}

TEST(LightTree, ProbabilitiesAreThoseOfSampleAndSumToOne) {
    for (const std::size_t n : {std::size_t{1}, std::size_t{3}, std::size_t{8}, std::size_t{9},
                                std::size_t{60}, std::size_t{700}}) {
        const std::vector<LightExtent> lights = RandomLights(n, 7);
        const LightTree tree(lights);
        std::mt19937 random(11);
        std::uniform_real_distribution<double> uniform(0, 1);
        for (const LightReceiver& at : Receivers(30)) {
            double sum = 0;
            for (std::uint32_t i = 0; i < n; ++i) {
                const float p = tree.Probability(at, i);
                EXPECT_TRUE(p >= 0 && p <= 1);
                EXPECT_TRUE(p == 0 || lights[i].strength > 0);
                sum += p;
            }
            bool any = false;
            for (int k = 0; k < 50; ++k) {
                std::uint32_t light = 0;
                float p = 0;
                if (tree.Sample(at, uniform(random), &light, &p)) {
                    any = true;
                    EXPECT_EQ(p, tree.Probability(at, light));  // the same operations: to the bit
                }
            }
            // A group may promise what none of its lights gives: then nothing is drawn.
            EXPECT_LE(sum, 1 + 1e-4);
            if (n <= 8) {
                EXPECT_NEAR(sum, any ? 1 : 0, 1e-4);
            }
        }
    }
}

TEST(LightTree, DrawsByItsProbabilities) {
    const std::vector<LightExtent> lights = RandomLights(40, 21);
    const LightTree tree(lights);
    constexpr int kDraws = 200000;
    for (const LightReceiver& at : Receivers(3)) {
        std::vector<int> counts(lights.size());
        for (int k = 0; k < kDraws; ++k) {
            std::uint32_t light = 0;
            float p = 0;
            if (tree.Sample(at, (k + 0.5) / kDraws, &light, &p)) {
                ++counts[light];
            }
        }
        for (std::uint32_t i = 0; i < lights.size(); ++i) {
            // u is on a grid: counts are off by the ends of an interval alone.
            EXPECT_NEAR(counts[i], kDraws * static_cast<double>(tree.Probability(at, i)), 2.5);
        }
    }
}

TEST(LightTree, WhatCanContributeIsNeverLeftOut) {
    const std::vector<LightExtent> lights = RandomLights(300, 5);
    const LightTree tree(lights);
    std::mt19937 random(17);
    std::uniform_real_distribution<float> uniform(0, 1);
    int contributing = 0, left_out = 0;
    for (const LightReceiver& at : Receivers(200)) {
        for (std::uint32_t i = 0; i < lights.size(); ++i) {
            const LightExtent& e = lights[i];
            const Vec3f size = e.box.upper - e.box.lower;
            const Vec3f q =
                e.box.lower + size * Vec3f{uniform(random), uniform(random), uniform(random)};
            const Vec3f wi = Normalize(q - at.point);
            const float facing = e.both_sides ? std::abs(Dot(e.axis, wi)) : -Dot(e.axis, wi);
            const float cosine = at.through ? std::abs(Dot(at.normal, wi)) : Dot(at.normal, wi);
            const bool reaches = std::acos(std::clamp(facing, -1.0f, 1.0f)) <
                                 std::min(e.spread + e.reach, kPi) - 1e-3f;
            const bool taken = at.normal == Vec3f{} || cosine > 1e-3f;
            const bool gives = e.strength > 0 && reaches && taken;
            const float p = tree.Probability(at, i);
            contributing += gives ? 1 : 0;
            left_out += p == 0 ? 1 : 0;
            EXPECT_FALSE(gives && p == 0) << "light " << i;
        }
    }
    EXPECT_GT(contributing, 1000);
    EXPECT_GT(left_out, 1000);  // and what can't, is
}

TEST(LightTree, NearLightsAreChosenMoreOften) {
    std::vector<LightExtent> lights(20);
    for (std::size_t i = 0; i < lights.size(); ++i) {
        lights[i].box.Add({static_cast<float>(10 * i), 1, 0});
        lights[i].spread = kPi;
        lights[i].reach = kPi / 2;
        lights[i].strength = 1;
    }
    const LightTree tree(lights);
    for (const std::uint32_t i : {0u, 7u, 19u}) {
        const LightReceiver at{{static_cast<float>(10 * i), 0, 0}, {0, 1, 0}};
        EXPECT_GT(tree.Probability(at, i), 0.8f);  // by strength alone: 0.05
    }
}

TEST(LightTree, LightsInOnePlaceAndNoneAtAll) {
    EXPECT_TRUE(LightTree(std::vector<LightExtent>()).empty());
    EXPECT_TRUE(LightTree(std::vector<LightExtent>(4)).empty());
    std::vector<LightExtent> same(3000);
    for (LightExtent& e : same) {
        e.box.Add({1, 2, 3});
        e.spread = kPi;
        e.reach = kPi / 2;
        e.strength = 2;
    }
    const LightTree tree(same);
    EXPECT_EQ(tree.size(), same.size());
    double sum = 0;
    for (std::uint32_t i = 0; i < same.size(); ++i) {
        sum += tree.Probability({{0, 0, 0}, {0, 1, 0}}, i);
    }
    EXPECT_NEAR(sum, 1, 1e-3);
}

}  // namespace
}  // namespace relume::render
