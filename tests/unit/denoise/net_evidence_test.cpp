// The weights of `net`, held to what was sampled; and what it mixes in thin images.
#include "server/denoise/net_evidence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/filter_frame.h"
#include "server/denoise/net.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using testing::HasSubstr;

constexpr int kSide = 24;
constexpr std::size_t kMiddle = 12 * kSide + 12;
constexpr float kLevel = 0.2f, kDeviation = 0.02f;

// A grey wall whose samples agree, and three candidates that are it: the noisy one, the bilateral
// one, and one that the network likes best.
struct Wall {
    Frame frame;
    Result results[3];
    NetCandidates candidates{};
    std::array<Plane, kNetSlotCount> weights;

    Wall() {
        frame.width = frame.height = kSide;
        const Plane grey(frame.pixel_count(), kLevel);
        const Plane noise(frame.pixel_count(), kDeviation * kDeviation);
        for (std::size_t c = 0; c < 3; ++c) {
            frame.color[c] = grey;
            frame.variance[c] = noise;
            for (Result& result : results) {
                result.color[c] = grey;
            }
        }
        const std::size_t slots[] = {0, kBilateralSlot, kOidnSlot};
        const float weight[] = {0.1f, 0.2f, 0.7f};
        for (std::size_t k = 0; k < 3; ++k) {
            candidates[slots[k]] = &results[k];
            weights[slots[k]].assign(frame.pixel_count(), weight[k]);
        }
    }
    void SetPixel(Plane* planes, float value) const {
        for (int c = 0; c < 3; ++c) {
            planes[c][kMiddle] = value;
        }
    }
    void Hold() { HoldToSamples(frame, candidates, &weights); }
    float Sum() const {
        return weights[0][kMiddle] + weights[kBilateralSlot][kMiddle] + weights[kOidnSlot][kMiddle];
    }
};

TEST(HoldToSamples, WhatIsWithinTheNoiseKeepsItsWeight) {
    Wall wall;
    wall.SetPixel(wall.results[2].color, kLevel + kDeviation);
    const auto before = wall.weights;
    wall.Hold();
    for (const std::size_t k : {std::size_t{0}, kBilateralSlot, kOidnSlot}) {
        for (std::size_t i = 0; i < before[k].size(); ++i) {
            EXPECT_NEAR(wall.weights[k][i], before[k][i], 1e-6f);
        }
    }
    EXPECT_TRUE(wall.weights[kRdSlot].empty());
}

TEST(HoldToSamples, WhatOneCandidateMakesUpIsBoundedByTheNoise) {
    for (const float made_up : {1.0f, 100.0f, 1e8f, 1e30f}) {
        Wall wall;
        wall.SetPixel(wall.results[2].color, made_up);
        wall.Hold();
        EXPECT_NEAR(wall.Sum(), 1, 1e-6f);
        const float added = wall.weights[kOidnSlot][kMiddle] * (made_up - kLevel);
        EXPECT_LT(added, 0.7f / 0.3f * 1.5f * kDeviation * 1.01f) << made_up;
        // The others keep their shares of what is left, and pixels beside it theirs.
        EXPECT_NEAR(wall.weights[kBilateralSlot][kMiddle] / wall.weights[0][kMiddle], 2, 1e-4f);
        EXPECT_NEAR(wall.weights[kOidnSlot][kMiddle + 1], 0.7f, 1e-6f);
    }
}

TEST(HoldToSamples, AFireflyIsNoEvidence) {
    Wall wall;
    wall.SetPixel(wall.frame.color, 50);
    wall.SetPixel(wall.frame.variance, 2500);
    wall.Hold();
    EXPECT_NEAR(wall.weights[kOidnSlot][kMiddle], 0.7f, 1e-6f);
}

// A light that few samples meet: where none has, the pixel is black and its samples agree.
TEST(HoldToSamples, NeitherIsAPixelThatHasMissedTheLight) {
    Wall wall;
    for (std::size_t i = 0; i < wall.frame.pixel_count(); ++i) {
        const bool met = i % 8 == 3;
        for (std::size_t c = 0; c < 3; ++c) {
            wall.frame.color[c][i] = met ? 8 * kLevel : 0;
            wall.frame.variance[c][i] = met ? 64 * kLevel * kLevel : 0;
        }
    }
    ASSERT_EQ(wall.frame.color[0][kMiddle], 0);
    wall.Hold();
    EXPECT_NEAR(wall.weights[kOidnSlot][kMiddle], 0.7f, 1e-6f);
}

TEST(HoldToSamples, BlackStaysBlack) {
    Wall wall;
    for (std::size_t c = 0; c < 3; ++c) {
        wall.frame.color[c].assign(wall.frame.pixel_count(), 0);
        wall.frame.variance[c] = wall.results[1].color[c] = wall.results[0].color[c] =
            wall.frame.color[c];
    }
    wall.Hold();
    EXPECT_LT(wall.weights[kOidnSlot][kMiddle] * kLevel, 1e-4f);
    EXPECT_NEAR(wall.Sum(), 1, 1e-6f);
}

TEST(HoldToSamples, BitsDoNotDependOnThreads) {
    const Frame frame = MakeRandomFrame(90, 70, 3);
    const Result base = RunDenoiser(*MakeDenoiser("none"), frame, CancelToken{});
    const Frame other = MakeRandomFrame(90, 70, 4);
    const Result wild = RunDenoiser(*MakeDenoiser("none"), other, CancelToken{});
    std::array<Plane, kNetSlotCount> held[2];
    for (int k = 0; k < 2; ++k) {
        SetThreadCount(k == 0 ? 1 : 3);
        NetCandidates candidates{&base, &base, &wild};
        for (const std::size_t slot : {std::size_t{0}, kBilateralSlot, kRdSlot}) {
            held[k][slot].assign(frame.pixel_count(), 1.0f / 3);
        }
        HoldToSamples(frame, candidates, &held[k]);
    }
    SetThreadCount(0);
    EXPECT_EQ(held[0], held[1]);
    EXPECT_NE(held[0][kRdSlot], held[0][kBilateralSlot]);
}

TEST(Net, LeavesOidnOutOfThinImages) {
    Frame frame;
    frame.width = 400;
    frame.height = 16;
    EXPECT_TRUE(SuitsNetSlot(kOidnSlot, frame));
    frame.height = 15;
    EXPECT_FALSE(SuitsNetSlot(kOidnSlot, frame));
    EXPECT_TRUE(SuitsNetSlot(kNforSlot, frame));
}

TEST(Net, WhatAutoTakesOfAThinImageIsWhatFilters) {
    if (!HasNetSlot(kOidnSlot)) {
        GTEST_SKIP() << "needs Open Image Denoise's weights: deploy/fetch-oidn, or RELUME_NETWORKS";
    }
    for (const int spp : {2, 8}) {
        for (const int height : {12, 40}) {
            const Frame frame = FrameFromFilm(MakeFilm({200, height}, spp, 3));
            const Filtered filtered = FilterFrame("auto", frame, CancelToken());
            EXPECT_THAT(filtered.filter, HasSubstr("net:candidates="));
            EXPECT_EQ(filtered.filter.find("oidn") != std::string::npos, height == 40)
                << filtered.filter;
            EXPECT_EQ(filtered.result.notes.contains("share.oidn"), height == 40);
        }
    }
    const Frame thin = FrameFromFilm(MakeFilm({60, 12}, 4, 3));
    const Result result = RunDenoiser(*MakeDenoiser("net:candidates=oidn"), thin, CancelToken());
    EXPECT_THAT(result.notes.at("left_out"), HasSubstr("oidn"));
}

}  // namespace
}  // namespace relume::denoise
