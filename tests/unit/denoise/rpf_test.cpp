#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/error_estimate.h"
#include "server/denoise/halves.h"
#include "server/denoise/rpf.h"
#include "server/denoise/rpf_information.h"
#include "server/denoise/rpf_kernels.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using testing::HasSubstr;

constexpr const char* kFew = "rpf:neighbours=few";

// A sample of a white wall that faces the camera; its random numbers are drawn, its colour is for
// the test to fill in.
using Shade = std::function<void(int x, int y, SampleRecord* record)>;

Frame MakeFrame(int width, int height, int spp, const Shade& shade) {
    std::mt19937 rng(7);
    Film film({0, 0, width, height}, width, height);
    TileResult result;
    result.rect = film.window();
    result.planes.resize(film.pixel_count() * kFilmChannelCount);
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        const int x = static_cast<int>(i) % width, y = static_cast<int>(i) / width;
        PixelMoments moments;
        for (int s = 0; s < spp; ++s) {
            SampleRecord record;
            record.x = static_cast<float>(Uniform(&rng));
            record.y = static_cast<float>(Uniform(&rng));
            record.random[3] = static_cast<float>(Uniform(&rng));
            record.random[4] = static_cast<float>(Uniform(&rng));
            record.hits[0] = {
                {static_cast<float>(x) + record.x, static_cast<float>(y) + record.y, 0},
                {0, 0, 1},
                {0.5f, 0.5f, 0.5f}};
            shade(x, y, &record);
            PixelSample sample;
            sample.radiance = record.radiance;
            moments.Add(static_cast<std::uint32_t>(s), sample);
            result.samples.push_back(record);
        }
        moments.Store(result.planes.data() + i, film.pixel_count());
        result.pixels.push_back(static_cast<std::uint32_t>(i));
    }
    film.Merge(result);
    return FrameFromFilm(film);
}

Result Filter(const char* filter, const Frame& frame) {
    return RunDenoiser(*MakeDenoiser(filter), frame, CancelToken{});
}

double Mean(const Plane& plane, const Frame& frame, const std::function<bool(int x, int y)>& of) {
    double sum = 0, count = 0;
    for (int y = 0; y < frame.height; ++y) {
        for (int x = 0; x < frame.width; ++x) {
            if (of(x, y)) {
                sum += plane[static_cast<std::size_t>(y * frame.width + x)];
                count += 1;
            }
        }
    }
    return sum / count;
}

double SquaredError(const Plane& plane, float truth) {
    double sum = 0;
    for (const float value : plane) {
        sum += (value - truth) * (value - truth);
    }
    return sum / static_cast<double>(plane.size());
}

TEST(Rpf, NoiseOfRandomNumbersAloneIsRemoved) {
    const Frame frame = MakeFrame(40, 30, 8, [](int, int, SampleRecord* record) {
        const float noise = record->random[3] < 0.5f ? 0.2f : 1.8f;
        record->radiance = {noise, noise, noise};
    });
    for (const auto& [filter, left] : {std::pair{"rpf", 0.01}, {kFew, 0.6}}) {
        const Result result = Filter(filter, frame);
        EXPECT_LT(SquaredError(result.color[1], 1), left * SquaredError(frame.color[1], 1))
            << filter;
    }
}

// The contrast, 0.08, is below what tells first hits apart: only weights can keep it.
TEST(Rpf, TextureThatFeaturesShowIsKept) {
    const auto is_light = [](int x, int y) { return (x / 3 + y / 3) % 2 == 0; };
    const Frame frame = MakeFrame(42, 30, 8, [&](int x, int y, SampleRecord* record) {
        const float albedo = is_light(x, y) ? 0.58f : 0.5f;
        record->hits[0].albedo = {albedo, albedo, albedo};
        const float shade = albedo + 0.02f * (record->random[3] - 0.5f);
        record->radiance = {shade, shade, shade};
    });
    for (const char* filter : {"rpf", kFew}) {
        const Result result = Filter(filter, frame);
        const double light = Mean(result.color[0], frame, is_light);
        const double dark =
            Mean(result.color[0], frame, [&](int x, int y) { return !is_light(x, y); });
        EXPECT_GT(light - dark, 0.8 * 0.08) << filter;
    }
}

// A shadow's edge: no feature shows it, but no random number brings it about, either.
TEST(Rpf, WhatHangsOnThePlaceIsKept) {
    const Frame frame = MakeFrame(40, 30, 8, [](int x, int, SampleRecord* record) {
        const float light = x < 20 ? 1.0f : 0.2f;
        record->radiance = {light, light, light};
    });
    const Result result = Filter("rpf", frame);
    const double left = Mean(result.color[0], frame, [](int x, int) { return x == 19; });
    const double right = Mean(result.color[0], frame, [](int x, int) { return x == 20; });
    EXPECT_GT(left - right, 0.9 * 0.8);
}

TEST(Rpf, AnotherSurfaceIsLeftOut) {
    const Frame frame = MakeFrame(40, 30, 8, [](int x, int, SampleRecord* record) {
        const bool wall = x >= 20;
        record->hits[0].normal = wall ? Vec3f{1, 0, 0} : Vec3f{0, 0, 1};
        const float noise = (wall ? 0.25f : 1.0f) * 2 * record->random[3];
        record->radiance = {noise, noise, noise};
    });
    const Result result = Filter(kFew, frame);
    EXPECT_NEAR(Mean(result.color[0], frame, [](int x, int) { return x == 19; }), 1, 0.1);
    EXPECT_NEAR(Mean(result.color[0], frame, [](int x, int) { return x == 20; }), 0.25, 0.025);
}

// By its halves, whatever the number of pixels; not with too few samples for that.
TEST(Rpf, ErrorIsEstimatedByHalves) {
    const auto make = [](int spp) {
        return MakeFrame(40, 30, spp, [](int, int, SampleRecord* record) {
            const float noise = 2 * record->random[3];
            record->radiance = {noise, noise, noise};
        });
    };
    const Frame frame = make(8);
    const auto denoiser = MakeDenoiser("rpf");
    const Result result = RunDenoiser(*denoiser, frame, CancelToken{});
    const auto estimate = EstimateByHalves(*denoiser, frame, CancelToken{});
    ASSERT_TRUE(estimate);
    // The truth is 1. Of the unfiltered image: 1 / 3 / 8.
    EXPECT_NEAR(estimate->relmse, SquaredError(result.color[0], 1), 0.1 / 24);
    EXPECT_NEAR(estimate->unfiltered, 1.0 / 24, 0.1 / 24);
    EXPECT_FALSE(EstimateByHalves(*denoiser, make(3), CancelToken{}));
}

TEST(HalfFrame, HasEveryOtherSample) {
    const Frame frame = FrameFromFilm(MakeFilm(Truth{9, 5}, 5, 3));
    for (const std::size_t h : {0u, 1u}) {
        const Frame half = HalfFrame(frame, static_cast<int>(h));
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            const auto all = frame.samples->Of(i), some = half.samples->Of(i);
            ASSERT_EQ(some.size(), 3 - h);
            for (std::size_t k = 0; k < some.size(); ++k) {
                EXPECT_EQ(some[k].radiance, all[2 * k + h].radiance);
            }
        }
    }
}

TEST(Rpf, SameBitsWhateverTheThreadsAndInstructions) {
    const Frame frame = FrameFromFilm(MakeFilm(Truth{50, 37}, 8, 3));
    const ParamSet params = ParseNamedParams(kFew).params;
    const int threads = ThreadCount();
    const Result reference = MakeRpf(params, kRpfBaseline)->Reconstruct(frame, CancelToken{});
    const RpfList usable = UsableRpfs();
    for (const int count : {1, 2, 5}) {
        SetThreadCount(count);
        for (int k = 0; k < usable.size; ++k) {
            const Result result =
                MakeRpf(params, usable.list[k])->Reconstruct(frame, CancelToken{});
            for (int c = 0; c < 3; ++c) {
                EXPECT_EQ(result.color[c], reference.color[c]) << count << " threads, " << k;
            }
        }
    }
    SetThreadCount(threads);
}

TEST(Rpf, FeaturesThatItIsNotToLookAtDontMatter) {
    const auto make = [](float scale) {
        return MakeFrame(24, 18, 4, [=](int x, int, SampleRecord* record) {
            record->hits[0].albedo.x = scale * static_cast<float>(x);
            record->radiance = {record->random[3], record->random[4], static_cast<float>(x)};
        });
    };
    const char* blind = "rpf:neighbours=few,without=albedo";
    const Result a = Filter(blind, make(0)), b = Filter(blind, make(1));
    EXPECT_EQ(a.color[0], b.color[0]);
    EXPECT_NE(Filter(kFew, make(0)).color[0], Filter(kFew, make(1)).color[0]);
}

TEST(Rpf, WhatItCantWorkWithIsRefusedByName) {
    Frame frame = FrameFromFilm(MakeFilm(Truth{20, 10}, 4, 3));
    frame.samples.reset();
    EXPECT_THAT(MessageOf([&] { (void)Filter("rpf", frame); }),
                testing::AllOf(HasSubstr("filter 'rpf"), HasSubstr("--keep-samples")));
    const Frame one = FrameFromFilm(MakeFilm(Truth{20, 10}, 1, 3));
    EXPECT_THAT(MessageOf([&] { (void)Filter("rpf", one); }), HasSubstr("needs 2 samples a pixel"));
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("rpf:fireflies=spread"); }),
                HasSubstr("fireflies=spread"));
    for (const char* text : {"rpf:variance=0", "rpf:variance=-1", "rpf:neighbours=some"}) {
        EXPECT_THROW((void)MakeDenoiser(text), Error) << text;
    }
}

TEST(Rpf, StopsWhenCancelled) {
    const Frame frame = FrameFromFilm(MakeFilm(Truth{20, 10}, 4, 3));
    CancelToken cancel;
    cancel.Cancel();
    EXPECT_THROW((void)MakeDenoiser("rpf")->Reconstruct(frame, cancel), Error);
}

TEST(EntropyTerms, AreNLogN) {
    const auto terms = EntropyTerms(100000);
    for (const std::size_t n : {1, 2, 3, 10, 1000, 100000}) {
        const auto x = static_cast<double>(n);
        EXPECT_NEAR(terms[n], x * std::log(x), 1e-11 * (1 + x * std::log(x)));
    }
    EXPECT_EQ(terms[0], 0);
}

TEST(MutualInformation, IsThatOfTheJointHistogram) {
    const auto terms = EntropyTerms(4000);
    std::mt19937 rng(3);
    std::vector<float> a, copy, apart;
    for (int i = 0; i < 4000; ++i) {
        a.push_back(i % 2 == 0 ? 1.0f : -1.0f);
        copy.push_back(-a.back());
        apart.push_back(Uniform(&rng) < 0.5 ? 1.0f : -1.0f);
    }
    a[0] = 1e30f;  // goes to the last bin
    RoundedColumn column, same, other;
    column.Round(a.data(), a.size(), terms);
    same.Round(copy.data(), copy.size(), terms);
    other.Round(apart.data(), apart.size(), terms);
    EXPECT_EQ(column.bins[0], 9);
    EXPECT_NEAR(MutualInformation(column, same, terms), std::log(2), 1e-3);
    // Of independent columns, (2 - 1)(2 - 1) / (2 N) is to be expected.
    EXPECT_LT(MutualInformation(column, other, terms), 2e-3);
    EXPECT_EQ(MutualInformation(column, other, terms), MutualInformation(other, column, terms));
}

}  // namespace
}  // namespace relume::denoise
