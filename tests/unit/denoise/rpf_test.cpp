#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
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

constexpr const char* kFew = "rpf:neighbours=256";

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
    for (const auto& [filter, left] : {std::pair{"rpf", 0.05}, {"rpf:neighbours=0", 0.01}}) {
        const Result result = Filter(filter, frame);
        EXPECT_LT(SquaredError(result.color[1], 1), left * SquaredError(frame.color[1], 1))
            << filter;
    }
}

// Paths go on after the numbers that are known: what comes of the others hangs on the place no more
// than on those.
TEST(Rpf, NoiseOfUnknownNumbersIsRemoved) {
    std::mt19937 rng(11);
    const Frame frame = MakeFrame(40, 30, 8, [&](int, int, SampleRecord* record) {
        const auto noise = static_cast<float>(2 * Uniform(&rng));
        record->radiance = {noise, noise, noise};
    });
    const Result result = Filter("rpf", frame);
    EXPECT_LT(SquaredError(result.color[1], 1), 0.3 * SquaredError(frame.color[1], 1));
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
                MakeRpf(params, *usable.list[k])->Reconstruct(frame, CancelToken{});
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
    const char* blind = "rpf:neighbours=256,without=albedo";
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
    for (const char* text :
         {"rpf:variance=0", "rpf:variance=-1", "rpf:neighbours=-1", "rpf:neighbours=131073"}) {
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

double InformationOfHistograms(const std::vector<float>& a, const std::vector<float>& b) {
    const auto bin = [](float value) {
        return static_cast<std::size_t>(std::floor(std::clamp(value, -5.0f, 4.0f) + 5.5f));
    };
    double joint[10][10] = {}, of_a[10] = {}, of_b[10] = {}, sum = 0;
    const auto n = static_cast<double>(a.size());
    for (std::size_t k = 0; k < a.size(); ++k) {
        joint[bin(a[k])][bin(b[k])] += 1 / n;
        of_a[bin(a[k])] += 1 / n;
        of_b[bin(b[k])] += 1 / n;
    }
    for (std::size_t i = 0; i < 10; ++i) {
        for (std::size_t j = 0; j < 10; ++j) {
            const double p = joint[i][j];
            sum += p > 0 ? p * std::log(p / (of_a[i] * of_b[j])) : 0;
        }
    }
    return sum;
}

TEST(MutualInformation, IsThatOfTheJointHistogram) {
    const auto terms = EntropyTerms(4000);
    std::mt19937 rng(3);
    std::normal_distribution<float> normal;
    const RpfList usable = UsableRpfs();
    for (const std::size_t count : {1u, 63u, 200u, 3999u}) {
        std::vector<float> a(count), b(count);
        for (std::size_t k = 0; k < count; ++k) {
            a[k] = normal(rng);
            b[k] = 0.6f * a[k] + 0.8f * normal(rng);
        }
        a[0] = 1e30f;  // goes to the last bin
        for (int k = 0; k < usable.size; ++k) {
            RoundedColumn column, other;
            std::vector<float> values = a, others = b;
            values.resize(count + kRpfBlock);
            others.resize(count + kRpfBlock);
            column.Set(values.data(), count, 0, 1, terms, *usable.list[k]);
            other.Set(others.data(), count, 0, 1, terms, *usable.list[k]);
            EXPECT_NEAR(MutualInformation(column, other, terms, *usable.list[k]),
                        InformationOfHistograms(a, b), 1e-9)
                << count << " samples, " << k;
        }
    }
}

TEST(MutualInformation, OfAColumnWithItselfIsItsEntropy) {
    const auto terms = EntropyTerms(4000);
    std::vector<float> a(4000), twice;
    for (std::size_t k = 0; k < a.size(); ++k) {
        a[k] = k % 2 == 0 ? 3.0f : -1.0f;
    }
    twice = a;
    RoundedColumn column, same;
    column.Set(a.data(), a.size(), 1, 0.5f, terms, BestRpf());
    same.Set(twice.data(), twice.size(), 1, -0.5f, terms, BestRpf());
    EXPECT_EQ(a[0], 1);  // scaled in place
    EXPECT_NEAR(MutualInformation(column, same, terms, BestRpf()), std::log(2), 1e-9);
}

}  // namespace
}  // namespace relume::denoise
