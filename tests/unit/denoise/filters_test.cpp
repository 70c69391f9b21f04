// What every filter owes, whatever it does.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "core/base/error.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/output_image.h"
#include "tests/unit/denoise/authors_rows.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using testing::HasSubstr;

class EveryFilter : public testing::TestWithParam<const char*> {
  protected:
    Result Filter(const Frame& frame) {
        return RunDenoiser(*MakeDenoiser(GetParam()), frame, CancelToken{});
    }
};

void ExpectFinite(const Frame& frame, const Result& result) {
    for (const Plane& plane : result.color) {
        ASSERT_EQ(plane.size(), frame.pixel_count());
        for (const float value : plane) {
            ASSERT_TRUE(std::isfinite(value));
        }
    }
    ASSERT_TRUE(result.error);
    for (const float value : *result.error) {
        ASSERT_TRUE(std::isfinite(value));
    }
}

// Samples that have the same colour everywhere.
Film FlatFilm(int width, int height, Rgb color) {
    return MakeFilm(Truth{width, height}, 4, 1,
                    [=](int, int, int, PixelSample* sample) { sample->radiance = color; });
}

TEST_P(EveryFilter, KeepsAConstantImage) {
    if (GetParam() == std::string_view("kpcn")) {
        GTEST_SKIP() << "it keeps constant radiance over albedo";
    }
    const Frame frame = FrameFromFilm(FlatFilm(80, 40, {0.25f, 3, 700}));
    const Result result = Filter(frame);
    ExpectFinite(frame, result);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        ASSERT_NEAR(result.color[0][i], 0.25, 0.25e-6);
        ASSERT_NEAR(result.color[1][i], 3, 3e-6);
        ASSERT_NEAR(result.color[2][i], 700, 700e-6);
    }
}

TEST_P(EveryFilter, KeepsBlack) {
    const Frame frame = FrameFromFilm(FlatFilm(70, 33, {0, 0, 0}));
    const Result result = Filter(frame);
    for (const Plane& plane : result.color) {
        EXPECT_EQ(plane, Plane(frame.pixel_count(), 0.0f));
    }
    ExpectFinite(frame, result);
}

TEST_P(EveryFilter, TakesAnySize) {
    for (const auto& [width, height] :
         {std::pair{1, 1}, {3, 7}, {1, 400}, {400, 1}, {64, 32}, {65, 33}, {2, 2}}) {
        const Frame frame = FrameFromFilm(MakeFilm(Truth{width, height}, 4, 2));
        ExpectFinite(frame, Filter(frame));
    }
}

TEST_P(EveryFilter, NoVarianceNoFeaturesNoNan) {
    Frame frame = MakeGaussianFrame({70, 40}, 3);
    for (int c = 0; c < 3; ++c) {
        frame.variance[c].assign(frame.pixel_count(), 0.0f);
        frame.sample_variance[c] = frame.variance[c];
    }
    ExpectFinite(frame, Filter(frame));
    for (int f = 0; f < kFeatureCount; ++f) {
        frame.feature_variance[f].assign(frame.pixel_count(), 0.0f);
    }
    ExpectFinite(frame, Filter(frame));
    for (int f = 0; f < kFeatureCount; ++f) {
        frame.feature[f].clear();
        frame.feature_variance[f].clear();
    }
    ExpectFinite(frame, Filter(frame));
}

TEST_P(EveryFilter, FewSamplesAreEnough) {
    for (const int spp : {1, 2, 3}) {
        const Frame frame = FrameFromFilm(MakeFilm(Truth{66, 34}, spp, 4));
        const Needs needs = MakeDenoiser(GetParam())->GetNeeds();
        if ((spp == 1 && needs.halves) || spp < needs.min_spp) {
            EXPECT_THROW((void)Filter(frame), Error);  // half b of one has none
        } else {
            ExpectFinite(frame, Filter(frame));
        }
    }
}

// How far one sample of pixel (120, 70) is seen, pixels. The variance is regularised over 10.
int HaloOf(std::string_view filter) {
    static const std::map<std::string_view, int> kHalos = {
        {"none", 0},
        // Window 16, choice by SURE blurred over 12; robust mode's weights see the variance through
        // its guide, 2, and its share is blurred over 24.
        {"bilateral:mode=robust", 10 + 2 + 16 + 12 + 24},
        {"bilateral:mode=corrected", 16 + 12},
        {"bilateral:mode=printed", 16 + 12},
        {"bilateral:mode=printed,taylor=0", 16 + 12},
        // The widest of its parts', nfor's.
        {"blend", 10 + 3 + 9 + 9 + 2 * (1 + 9) + 3 + 9 + 9},
        // The widest Gaussian ends at 24, and the flags are blurred over 48.
        {"gem", 10 + 24 + 48},
        // Five layers of 5x5 that see steps from pixel to pixel, window 6.
        {"kpcn", 10 + 1 + 10 + 6},
        // Six layers of 3x3 that see the gradient, window 8.
        {"net:mode=printed", 10 + 1 + 6 + 8},
        // Window 10, two patches of 3.
        {"nlm", 10 + 10 + 3 + 3},
        // Features filtered over 5 by patches of 3 after their variance was regularised too,
        // blurred over 1, gradient 1, window 10; then the error is smoothed over 1 and the choice
        // over 5, both by patches of 3, the residual variance blurred over 1, and a second window
        // is 5 by patches of 3.
        {"rd", 10 + 5 + 3 + 1 + 1 + 10 + 1 + 5 + 1 + 5 + 3},
        {"rd:radius=5", 10 + 5 + 3 + 1 + 1 + 5 + 1 + 5 + 1 + 5 + 3},
        // Window 16, smoothed over 16; the gradient is that of an image filtered over 2, whose
        // variance it sees, too.
        {"sbf", 16 + 16},
        // Patch and window of the first fit, from which it writes to a window; errors and choice
        // smoothed; the last fit.
        {"nfor", 10 + 3 + 9 + 9 + 2 * (1 + 9) + 3 + 9 + 9},
        // Neighbours of four passes in boxes of 55, 35, 17, 7.
        {"rpf:neighbours=64", 27 + 17 + 8 + 3},
        {"sbf-gradient", 10 + 2 + 1 + 16 + 16},
        // Window; bandwidths smoothed.
        {"wlr", 10 + 9 + 3},
    };
    return kHalos.at(filter);
}

TEST_P(EveryFilter, OneBadSampleStaysInItsHalo) {
    const Truth truth{240, 140};
    constexpr int kX = 120, kY = 70;
    const int halo = HaloOf(GetParam());
    const Frame clean = FrameFromFilm(MakeFilm(truth, 4, 5));
    const Result reference = Filter(clean);
    for (const float value : {NAN, INFINITY, -INFINITY, 1e6f, 1e14f, 3e38f}) {
        const Frame frame =
            FrameFromFilm(MakeFilm(truth, 4, 5, [&](int x, int y, int index, PixelSample* sample) {
                if (x == kX && y == kY && index == 1) {
                    sample->radiance = {value, value, value};
                }
            }));
        const Result result = Filter(frame);
        ExpectFinite(frame, result);
        const bool printed = std::string_view(GetParam()).find("printed") != std::string::npos;
        if (printed && result.notes != reference.notes) {
            continue;  // one sigma_s for the frame: that one pixel may decide it
        }
        for (int y = 0; y < truth.height; ++y) {
            for (int x = 0; x < truth.width; ++x) {
                const auto i = static_cast<std::size_t>(y * truth.width + x);
                if (std::max(std::abs(x - kX), std::abs(y - kY)) > halo) {
                    ASSERT_EQ(result.color[0][i], reference.color[0][i])
                        << value << " at " << x << ", " << y;
                }
            }
        }
    }
}

// Linear fits and what is taken from fireflies swing below it.
TEST_P(EveryFilter, NothingIsDarkerThanBlack) {
    const Truth truth{60, 40};
    const Frame frame =
        FrameFromFilm(MakeFilm(truth, 4, 8, [](int x, int y, int index, PixelSample* sample) {
            const bool firefly = (7 * x + 13 * y + 5 * index) % 97 == 0;
            const float ramp = y < 20 ? 0.0f : 0.3f * std::max(0.0f, static_cast<float>(x - 30));
            const float radiance = firefly && y < 20 ? 200.0f : ramp * (1 + 0.1f * (index % 3 - 1));
            sample->radiance = {radiance, radiance, radiance};
            for (int c = 0; c < 3; ++c) {
                sample->features[static_cast<std::size_t>(kAlbedoR + c)] =
                    static_cast<float>(x) / 60;
            }
        }));
    const Result result = Filter(frame);
    for (const Plane& plane : result.color) {
        for (const float value : plane) {
            ASSERT_GE(value, 0);
        }
    }
}

TEST_P(EveryFilter, APixelWithoutSamplesIsFilled) {
    const Truth truth{60, 40};
    const Frame frame =
        FrameFromFilm(MakeFilm(truth, 4, 6, [](int x, int y, int, PixelSample* sample) {
            if (x >= 10 && x < 14 && y >= 10 && y < 13) {
                sample->radiance = {NAN, 0, 0};
            }
        }));
    const std::size_t hole = 11 * 60 + 12;
    EXPECT_EQ(frame.flagged[hole], 1);
    EXPECT_EQ(frame.count[hole], 0);
    const Result result = Filter(frame);
    ExpectFinite(frame, result);
    EXPECT_GT(result.color[0][hole], 0.05f);
    EXPECT_LT(result.color[0][hole], 3);
}

INSTANTIATE_TEST_SUITE_P(Filters, EveryFilter,
                         testing::Values("none", "bilateral:mode=robust",
                                         "bilateral:mode=corrected", "bilateral:mode=printed",
                                         "bilateral:mode=printed,taylor=0", "blend", "gem", "kpcn",
                                         "net:mode=printed", "nfor", "nlm", "rd", "rd:radius=5",
                                         "rpf:neighbours=64", "sbf", "sbf-gradient", "wlr"),
                         [](const auto& param) {
                             std::string name = param.param;
                             std::erase_if(name, [](char c) { return std::isalnum(c) == 0; });
                             return name;
                         });

// Filters with a planner of their own.
class EveryPlanner : public testing::TestWithParam<const char*> {};

TEST_P(EveryPlanner, CountsSumToWhatIsAskedFor) {
    const auto denoiser = MakeDenoiser(GetParam());
    for (const auto& [width, height] : {std::pair{1, 1}, {3, 7}, {150, 70}}) {
        for (const Frame& frame : {FrameFromFilm(MakeFilm(Truth{width, height}, 4, 9)),
                                   FrameFromFilm(FlatFilm(width, height, {0, 0, 0}))}) {
            for (const double mean : {0.5, 3.0, 30.0, 3000.0}) {
                const double samples = mean * width * height;
                const Plane counts = denoiser->PlanSamples(frame, samples, CancelToken{});
                ASSERT_EQ(counts.size(), frame.pixel_count());
                double sum = 0;
                for (const float n : counts) {
                    ASSERT_TRUE(n >= 0 && std::isfinite(n)) << n;
                    sum += n;
                }
                EXPECT_NEAR(sum / samples, 1, 1e-3) << width << " x " << height << ", " << mean;
            }
        }
    }
    EXPECT_TRUE(denoiser->PlanSamples(FrameFromFilm(FlatFilm(0, 0, {})), 9, CancelToken{}).empty());
}

INSTANTIATE_TEST_SUITE_P(Filters, EveryPlanner,
                         testing::Values("gem", "nlm", "rd", "sbf", "sbf-gradient", "wlr"),
                         [](const auto& param) {
                             std::string name = param.param;
                             std::erase_if(name, [](char c) { return std::isalnum(c) == 0; });
                             return name;
                         });

TEST(Filters, NothingInNothingOut) {
    const Frame frame = FrameFromFilm(MakeFilm(Truth{0, 0}, 4, 1));
    for (const char* name : {"none", "bilateral", "blend", "gem", "kpcn", "net:mode=printed", "nlm",
                             "rd", "sbf", "sbf-gradient", "wlr"}) {
        const Result result = RunDenoiser(*MakeDenoiser(name), frame, CancelToken{});
        EXPECT_TRUE(result.color[0].empty());
        EXPECT_EQ(AssembleLayers(frame, result, nullptr, true).pixel_count(), 0u);
    }
}

class Bilateral : public testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Modes, Bilateral,
                         testing::Values("bilateral:mode=robust", "bilateral:mode=corrected"),
                         [](const auto& param) { return std::string(param.param).substr(15); });

TEST_P(Bilateral, LowersNoiseAndKeepsEdges) {
    const Truth truth{120, 80};
    const int edge = 72;
    for (const int spp : {4, 8, 32}) {
        const Frame frame = FrameFromFilm(MakeFilm(truth, spp, 7));
        const Result result = RunDenoiser(*MakeDenoiser(GetParam()), frame, CancelToken{});
        // 1/spp noisy; a tenth of that is what four windows of some ten pixels leave at least.
        EXPECT_LT(MrSE(truth, result.color, 0, 120), 0.1 * MrSE(truth, frame.color, 0, 120)) << spp;
        EXPECT_LT(MrSE(truth, result.color, edge - 2, edge + 2),
                  0.2 * MrSE(truth, frame.color, edge - 2, edge + 2))
            << spp;
    }
}

TEST_F(AuthorsRows, BilateralComesWithinFivePercentOfSbf) {
    const Image reference = Row("reference.exr");
    const double sbf = MrSEOf(reference, Row("sbf.exr"));
    for (const char* mode : {"bilateral:mode=robust", "bilateral:mode=corrected"}) {
        EXPECT_LT(MrSEOf(reference, Filter(mode)), 1.05 * sbf) << mode;
    }
}

TEST_F(AuthorsRows, SbfIsTheirs) {
    const Image reference = Row("reference.exr"), theirs = Row("sbf.exr");
    const double row = MrSEOf(reference, theirs);
    for (const char* filter : {"sbf", "sbf-gradient"}) {
        const Image ours = Filter(filter);
        EXPECT_LT(MrSEOf(reference, ours), 1.1 * row) << filter;
        EXPECT_LT(MrSEOf(theirs, ours), 0.15 * row) << filter;
    }
}

// Theirs placed its samples itself, and could use a third of these.
TEST_F(AuthorsRows, GemIsNoWorseThanTheirs) {
    const Image reference = Row("reference.exr");
    EXPECT_LT(MrSEOf(reference, Filter("gem")), MrSEOf(reference, Row("gem.exr")));
}

TEST(Registry, UnknownNamesAreAnsweredWithTheKnownOnes) {
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("bilatral"); }),
                testing::AllOf(HasSubstr("'bilatral'"), HasSubstr("none, bilateral")));
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("bilateral:mod=printed"); }),
                testing::AllOf(HasSubstr("'mod'"), HasSubstr("mode")));
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("bilateral:mode=right"); }),
                testing::AllOf(HasSubstr("right"), HasSubstr("corrected"), HasSubstr("printed")));
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("bilateral:mode=printed,taylor=65"); }),
                HasSubstr("0 to 64"));
    for (const char* gamma : {"0", "0.6", "-1"}) {
        EXPECT_THAT(MessageOf([&] { (void)MakeDenoiser(std::string("gem:gamma=") + gamma); }),
                    HasSubstr("at most 0.5"));
    }
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("blend:bilateral=0,rd=0,nfor=0"); }),
                HasSubstr("all weights are 0"));
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("blend:rd=-1"); }), HasSubstr("0 to 1000"));
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("blend:bilateral-without=hue"); }),
                HasSubstr("albedo"));
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("blend:bilateral=0,bilateral-without=albedo"); }),
                HasSubstr("needs bilateral above 0"));
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("none:x=1"); }), HasSubstr("'x'"));
}

TEST(Registry, DescribesItselfSoThatItCanBeMadeAgain) {
    for (const char* text :
         {"none", "bilateral:mode=robust", "bilateral:mode=corrected",
          "bilateral:mode=printed,taylor=3", "blend:bilateral=3,rd=5,nfor=2",
          "blend:bilateral=1,rd=0,nfor=4,bilateral-without=albedo-depth", "gem:gamma=0.3", "nlm",
          "rd", "rpf:neighbours=64,variance=0.02", "sbf", "sbf-gradient", "wlr"}) {
        EXPECT_EQ(MakeDenoiser(text)->Describe(), text);
        EXPECT_EQ(MakeDenoiser(MakeDenoiser(text)->Describe())->Describe(), text);
    }
    EXPECT_EQ(MakeDenoiser("bilateral")->Describe(), "bilateral:mode=robust");
    EXPECT_EQ(MakeDenoiser("bilateral:mode=printed")->Describe(),
              "bilateral:mode=printed,taylor=8");
    for (const char* word : {"none ", "bilateral ", "mode=robust", "taylor=8", "blend ", "gem ",
                             "gamma=0.2", "sbf ", "nlm ", "rd ", "wlr ", "sbf-gradient "}) {
        EXPECT_THAT(DescribeDenoisers(), HasSubstr(word));
    }
}

TEST(Registry, WhatAFilterNeedsIsRefusedByName) {
    Frame frame = MakeGaussianFrame({20, 10}, 8);
    for (auto& half : frame.half) {
        for (auto& plane : half) {
            plane.clear();
        }
    }
    EXPECT_THAT(MessageOf([&] {
                    (void)RunDenoiser(*MakeDenoiser("bilateral:mode=printed"), frame,
                                      CancelToken{});
                }),
                testing::AllOf(HasSubstr("printed"), HasSubstr("buffer_a")));

    class Demanding final : public Denoiser {
      public:
        explicit Demanding(Needs needs) : needs_(std::move(needs)) {}
        std::string Describe() const override { return "demanding"; }
        Needs GetNeeds() const override { return needs_; }
        Result Reconstruct(const Frame& f, const CancelToken&) const override {
            Result result;
            for (int c = 0; c < 3; ++c) {
                result.color[c].assign(f.pixel_count(), NAN);
            }
            return result;
        }

      private:
        Needs needs_;
    };
    frame.feature[kVisibility].clear();
    EXPECT_THAT(MessageOf([&] {
                    (void)RunDenoiser(Demanding({.features = {kVisibility}}), frame, CancelToken{});
                }),
                testing::AllOf(HasSubstr("demanding"), HasSubstr("visibility")));
    EXPECT_THAT(
        MessageOf([&] { (void)RunDenoiser(Demanding({.min_spp = 9}), frame, CancelToken{}); }),
        testing::AllOf(HasSubstr("9"), HasSubstr("has 8")));
    // And what comes out non-finite is replaced.
    const Result result = RunDenoiser(Demanding({}), frame, CancelToken{});
    EXPECT_EQ(result.color[2], frame.color[2]);
}

}  // namespace
}  // namespace relume::denoise
