// The filter that chooses: what it takes, and what it drops.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "server/denoise/crop_frame.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/filter_frame.h"
#include "server/denoise/halves.h"
#include "server/denoise/net.h"
#include "server/denoise/without_features.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr const char* kRobust = "bilateral:mode=robust";

// Samples without noise.
Film ExactFilm(const Truth& truth, int spp) {
    return MakeFilm(truth, spp, 1, [&](int x, int y, int, PixelSample* sample) {
        sample->radiance = truth.Color(x, y);
    });
}

// Takes a filter that makes all black, judged against `base`, which it seems to be 100 times as bad
// as.
class Misled final : public Denoiser {
  public:
    explicit Misled(const char* base) : base_(base) {}
    std::string Describe() const override { return "misled"; }
    std::optional<Choice> Choose(const Frame&, const CancelToken&) const override {
        Choice choice;
        choice.denoiser = std::make_shared<Misled>(base_);
        choice.base = MakeDenoiser(base_);
        choice.over_base = 100;
        return choice;
    }
    Result Reconstruct(const Frame& frame, const CancelToken&) const override {
        Result result;
        for (Plane& plane : result.color) {
            plane.resize(frame.pixel_count());
        }
        return result;
    }

  private:
    const char* base_;
};

TEST(Auto, WhatMakesTheImageWorseGivesWayToWhatItWasJudgedAgainst) {
    const Frame noisy = FrameFromFilm(MakeFilm({96, 64}, 8, 3));
    const Filtered better = FilterFrame(std::make_shared<Misled>(kRobust), noisy, CancelToken());
    EXPECT_EQ(better.filter, kRobust);
    EXPECT_THAT(better.choice->reason, HasSubstr("worse than none"));
    ASSERT_TRUE(better.error);
    EXPECT_LT(better.error->relmse, better.error->unfiltered);
    EXPECT_EQ(better.result.color[0],
              RunDenoiser(*MakeDenoiser(kRobust), noisy, CancelToken()).color[0]);
    // A base that is no better than the noise: none.
    const Frame exact = FrameFromFilm(ExactFilm({96, 64}, 4));
    const auto blurred = std::make_shared<Misled>("bilateral:mode=printed");
    EXPECT_EQ(FilterFrame(blurred, exact, CancelToken()).filter, "none");
}

TEST(Auto, LeavesAnImageWithoutNoiseAlone) {
    const Frame frame = FrameFromFilm(ExactFilm({96, 64}, 4));
    const Filtered filtered = FilterFrame("auto", frame, CancelToken());
    EXPECT_EQ(filtered.filter, "none");
    for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_EQ(filtered.result.color[c], frame.color[c]);
    }
}

TEST(Auto, FiltersANoisyImageAndSaysWhy) {
    const Frame frame = FrameFromFilm(MakeFilm({128, 96}, 8, 3));
    const Filtered filtered = FilterFrame("auto", frame, CancelToken());
    ASSERT_TRUE(filtered.choice);
    EXPECT_NE(filtered.filter, "none");
    const auto& candidates = filtered.choice->candidates;
    ASSERT_GE(candidates.size(), 3u);
    EXPECT_EQ(candidates[0].filter, "none");
    EXPECT_EQ(candidates[1].filter, std::string(kRobust) + ",energy=restore");
    EXPECT_THAT(candidates.back().filter, HasSubstr("net:candidates="));
    EXPECT_FALSE(filtered.choice->reason.empty());
    double least = INFINITY, taken = 0, above = 0, uncertainty = 0;
    for (const auto& candidate : candidates) {
        EXPECT_GE(candidate.seconds, 0);
        least = std::min(least, candidate.relmse);
        if (filtered.filter == candidate.filter) {
            taken = candidate.relmse;
            above = candidate.above_best;
            uncertainty = candidate.uncertainty;
        }
    }
    EXPECT_GT(taken, 0);
    EXPECT_LE(above, uncertainty);
    EXPECT_LT(taken, 0.2 * candidates[0].relmse);
    EXPECT_LE(filtered.error->relmse, filtered.error->unfiltered);
}

TEST(Auto, DropsAFeatureThatSaysNothingAndKeepsOneThatDoes) {
    // One wall of one colour, lit evenly; then the same where albedo is all that tells.
    const auto film = [](bool textured) {
        return MakeFilm({128, 128}, 8, 5, [&](int x, int y, int, PixelSample* sample) {
            const bool dark = textured && (x / 8 + y / 8) % 2 == 0;
            const float albedo = dark ? 0.1f : 0.8f;
            const float noise = sample->radiance.x / Truth{128, 128}.Color(x, y).x;
            sample->radiance = {albedo * noise, albedo * noise, albedo * noise};
            sample->features = {};
            sample->features[kNormalZ] = 1;
            sample->features[kDepth] = 1;
            for (int c = 0; c < 3; ++c) {
                sample->features[static_cast<std::size_t>(c)] = albedo;
            }
        });
    };
    const auto flat = MakeDenoiser("auto")->Choose(FrameFromFilm(film(false)), CancelToken());
    EXPECT_THAT(flat->dropped, HasSubstr("albedo"));
    const auto textured = MakeDenoiser("auto")->Choose(FrameFromFilm(film(true)), CancelToken());
    EXPECT_THAT(textured->dropped, Not(HasSubstr("albedo")));
    EXPECT_THAT(textured->dropped, HasSubstr("depth"));
}

TEST(Auto, AnImageWithoutHalvesGetsTheBilateralFilter) {
    const Frame frame = HalfFrame(FrameFromFilm(MakeFilm({40, 30}, 8, 3)), 0);
    const auto choice = MakeDenoiser("auto")->Choose(frame, CancelToken());
    EXPECT_EQ(choice->denoiser->Describe(), std::string(kRobust) + ",energy=restore");
    EXPECT_THAT(choice->reason, HasSubstr("no halves"));
    EXPECT_TRUE(choice->candidates.empty());
}

TEST(Auto, TwoSamplesAPixelAreFilteredUntried) {
    const Truth truth{120, 90};
    const Frame frame = FrameFromFilm(MakeFilm(truth, 2, 3));
    const Filtered filtered = FilterFrame("auto", frame, CancelToken());
    EXPECT_THAT(filtered.filter, HasSubstr("net:candidates="));
    EXPECT_THAT(filtered.choice->reason, HasSubstr("one sample"));
    EXPECT_EQ(FilterFrame("auto:effort=0.01", frame, CancelToken()).filter,
              std::string(kRobust) + ",energy=restore");
}

TEST(Auto, SpendsNoMoreThanIsWorthIt) {
    const auto tried = [](const char* filter, int spp) {
        const Frame frame = FrameFromFilm(MakeFilm({64, 48}, spp, 3));
        return MakeDenoiser(filter)->Choose(frame, CancelToken())->candidates.size();
    };
    EXPECT_EQ(tried("auto:effort=0.01", 8), 2u);  // none, the bilateral filter
    EXPECT_GT(tried("auto", 8), tried("auto:effort=0.01", 8));
    EXPECT_GT(tried("auto:effort=3", 64), 6u);  // with fewer features, and mixtures
    Frame frame = FrameFromFilm(MakeFilm({64, 48}, 64, 3));
    const auto at = [&](const Sampling& sampling) {
        frame.sampling = sampling;
        return MakeDenoiser("auto:effort=0.6")->Choose(frame, CancelToken())->candidates.size();
    };
    EXPECT_GT(at({.rays = 6, .falls = 1}), 2u);
    EXPECT_EQ(at({.rays = 0.2, .falls = 1}), 2u);
    const double rays = HasNetSlot(kOidnSlot) ? 1 : 6;  // oidn, where it is there, is cheap
    EXPECT_LT(at({.rays = rays, .falls = 3}), at({.rays = rays, .falls = 1}));
    EXPECT_EQ(MakeDenoiser("auto:effort=0.6,seconds=2")->Describe(), "auto:effort=0.6,seconds=2");
    EXPECT_EQ(MakeDenoiser("auto:effort=0")->Describe(), "auto");
    EXPECT_THROW(MakeDenoiser("auto:effort=-1"), Error);
}

TEST(Auto, TheSameChoiceEachTime) {
    const Frame frame = FrameFromFilm(MakeFilm({420, 400}, 4, 9));
    const auto first = MakeDenoiser("auto")->Choose(frame, CancelToken());
    const auto again = MakeDenoiser("auto")->Choose(frame, CancelToken());
    ASSERT_EQ(first->candidates.size(), again->candidates.size());
    for (std::size_t k = 0; k < first->candidates.size(); ++k) {
        EXPECT_EQ(first->candidates[k].relmse, again->candidates[k].relmse);
    }
    EXPECT_EQ(first->denoiser->Describe(), again->denoiser->Describe());
}

TEST(WithoutFeatures, IsBlindToThem) {
    const Frame frame = FrameFromFilm(MakeFilm({60, 40}, 4, 7));
    Frame bare = frame;
    for (int f = kAlbedoR; f < kNormalX; ++f) {
        bare.feature[f] = bare.feature_variance[f] = {};
        bare.feature_half[0][f] = bare.feature_half[1][f] = {};
    }
    const auto blind = MakeDenoiser("bilateral:mode=robust,without=albedo");
    const Result a = RunDenoiser(*blind, frame, CancelToken());
    const Result b = RunDenoiser(*MakeDenoiser(kRobust), bare, CancelToken());
    const Result all = RunDenoiser(*MakeDenoiser(kRobust), frame, CancelToken());
    EXPECT_EQ(a.color[1], b.color[1]);
    EXPECT_NE(a.color[1], all.color[1]);
    EXPECT_EQ(blind->Describe(), "bilateral:mode=robust,without=albedo");
    EXPECT_EQ(MakeDenoiser("nfor:without=depth-normal")->Describe(), "nfor:without=depth-normal");
    for (const char* wrong : {"sbf:without=", "sbf:without=colour", "sbf:without=depth-"}) {
        EXPECT_THROW(MakeDenoiser(wrong), Error) << wrong;
    }
}

TEST(CropFrame, HoldsThatPart) {
    const Frame frame = FrameFromFilm(MakeFilm({30, 20}, 4, 7));
    const Frame part = CropFrame(frame, {3, 5, 13, 11});
    ASSERT_EQ(part.width, 10);
    ASSERT_EQ(part.height, 6);
    ASSERT_EQ(part.color[1].size(), 60u);
    EXPECT_EQ(part.color[1][0], frame.color[1][5 * 30 + 3]);
    EXPECT_EQ(part.half[1][2][59], frame.half[1][2][10 * 30 + 12]);
    EXPECT_EQ(part.feature[kDepth][11], frame.feature[kDepth][6 * 30 + 4]);
    EXPECT_EQ(part.count.size(), 60u);
    EXPECT_EQ(part.flagged.size(), 60u);
}

}  // namespace
}  // namespace relume::denoise
