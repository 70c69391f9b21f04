#include <fmt/format.h>
#include <gtest/gtest.h>

#include <numeric>

#include "server/jobs/neyman.h"
#include "server/jobs/noise_rule.h"
#include "server/jobs/pass.h"
#include "server/jobs/planner.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {
namespace {

constexpr int kWidth = 48, kHeight = 32;

// Adds `counts` samples, whose radiance is value(x, y, index), grey.
template <class Value>
void Render(const std::vector<std::uint32_t>& counts, Value value, Film* film) {
    for (std::size_t i = 0; i < counts.size(); ++i) {
        if (counts[i] == 0) {
            continue;
        }
        const int x = static_cast<int>(i) % film->width(), y = static_cast<int>(i) / film->width();
        PixelMoments moments;
        const std::uint32_t first = film->NextIndex(i);
        for (std::uint32_t k = first; k < first + counts[i]; ++k) {
            PixelSample sample;
            const float v = value(x, y, k);
            sample.radiance = {v, v, v};
            sample.indirect_luminance = v;
            moments.Add(k, sample);
        }
        TileResult result;
        result.rect = {x, y, x + 1, y + 1};
        result.pixels = {0};
        result.planes.resize(kFilmChannelCount);
        moments.Store(result.planes.data(), 1);
        film->Merge(result);
    }
}

// One light that a sample finds with chance p, three times as bright on the right half.
auto RareLight(float p) {
    return [p](int x, int y, std::uint32_t index) {
        const float light = x < kWidth / 2 ? 1.0f : 3.0f;
        return PseudoUniform(x, y, index, 0) < p ? light / p : 0.0f;
    };
}

std::uint64_t Sum(const std::vector<std::uint32_t>& counts) {
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
}

template <class Value>
Film RunAdaptive(std::uint64_t budget, Value value) {
    Film film({0, 0, kWidth, kHeight}, kWidth, kHeight);
    const auto planner = MakePlanner("adaptive");
    for (;;) {
        const Plan plan = planner->NextPass({film, budget});
        if (plan.counts.empty()) {
            return film;
        }
        budget -= Sum(plan.counts);
        Render(plan.counts, value, &film);
    }
}

TEST(NoiseRule, SharesInProportionCountingWhatIsThere) {
    const std::vector<std::uint32_t> planned{8, 8};
    // 40 in all as 1 to 3: 10 and 30.
    const auto counts = ShareByDeviation(planned, {1, 3}, 24, 1);
    EXPECT_EQ(Sum(counts), 24u);
    EXPECT_NEAR(counts[0], 2, 2);
    EXPECT_NEAR(counts[1], 22, 2);
    // At most three times what is there; what that leaves goes to the others.
    const auto most = ShareByDeviation(planned, {1, 1000}, 40, 1);
    EXPECT_EQ(Sum(most), 40u);
    EXPECT_NEAR(most[1], 24, 2);
    EXPECT_EQ(Sum(ShareByDeviation(planned, {0, 0}, 40, 1)), 0u);
}

TEST(NoiseRule, DeviationIsRelativeAndPooled) {
    // Noise of the same relative size in dark and bright halves.
    Film film({0, 0, kWidth, kHeight}, kWidth, kHeight);
    Render(
        std::vector<std::uint32_t>(kWidth * kHeight, 64),
        [](int x, int y, std::uint32_t index) {
            const float level = x < kWidth / 2 ? 1.0f : 10.0f;
            return level * (0.5f + PseudoUniform(x, y, index, 0));
        },
        &film);
    const auto deviation = RelativeDeviation(film);
    for (const int x : {8, 40}) {
        EXPECT_NEAR(deviation[static_cast<std::size_t>(16 * kWidth + x)], std::sqrt(1 / 12.0),
                    0.08);
    }
}

TEST(NoiseRule, APixelsOwnSamplesTakeNoPart) {
    // One firefly: all about it become noisier, it does not.
    const auto value = [](float firefly) {
        return [firefly](int x, int y, std::uint32_t index) {
            return x == 20 && y == 16 && index == 3 ? firefly
                                                    : 0.5f + PseudoUniform(x, y, index, 0);
        };
    };
    Film calm({0, 0, kWidth, kHeight}, kWidth, kHeight), hit = calm;
    const std::vector<std::uint32_t> counts(kWidth * kHeight, 8);
    Render(counts, value(1), &calm);
    Render(counts, value(2000), &hit);
    const auto before = RelativeDeviation(calm), after = RelativeDeviation(hit);
    const std::size_t here = 16 * kWidth + 20, beside = here + 2;
    EXPECT_GT(after[beside], 10 * before[beside]);
    EXPECT_LT(after[here], 0.8f * after[beside]);
}

TEST(NoiseRule, APixelThatSawNothingBesideLightIsInQuestion) {
    Film film({0, 0, kWidth, kHeight}, kWidth, kHeight);
    Render(
        std::vector<std::uint32_t>(kWidth * kHeight, 8),
        [](int x, int, std::uint32_t index) { return x == 20 && index == 3 ? 5.0f : 0.0f; }, &film);
    const auto deviation = RelativeDeviation(film);
    const float near = deviation[16 * kWidth + 22], around = deviation[16 * kWidth + 29],
                far = deviation[16 * kWidth + 40];
    EXPECT_GT(around, 0.3f * near);  // within 10 pixels of what saw the light
    EXPECT_LT(far, 0.3f * around);   // nothing seen far and wide
    EXPECT_GT(far, 0);               // but not given up
}

TEST(Adaptive, KeepsTheEnergyOfRareLight) {
    // methods 3.2, the table's rows p = .05, .02, .005: energy of the image after 32 spp.
    for (const float p : {0.05f, 0.02f, 0.005f}) {
        const Film film = RunAdaptive(32 * kWidth * kHeight, RareLight(p));
        EXPECT_NEAR(film.TotalSamples(), 32 * kWidth * kHeight, 2);
        double sum = 0;
        for (std::size_t i = 0; i < film.pixel_count(); ++i) {
            sum += film.Mean(i).y;
        }
        const double mean = sum / static_cast<double>(film.pixel_count());
        // Of 49152 samples, a share p lit: 3 standard errors of the mean (1 to 3, mean 2).
        const double error = 2.3 / std::sqrt(p * film.TotalSamples());
        EXPECT_NEAR(mean, 2, 3 * error) << p;
    }
}

TEST(Adaptive, SpendsWhereTheFilteredHalvesDisagree) {
    // All pixels are as noisy; the guide says that only the left half matters.
    const auto value = [](int x, int y, std::uint32_t index) {
        return 0.5f + PseudoUniform(x, y, index, 0);
    };
    Film film({0, 0, kWidth, kHeight}, kWidth, kHeight);
    const Guide guide = [](const Film& f, double) {
        std::vector<float> out(f.pixel_count());
        for (std::size_t i = 0; i < out.size(); ++i) {
            out[i] = i % kWidth < kWidth / 2 ? 1.0f : 0.01f;
        }
        return out;
    };
    const struct {
        const char* sampler;
        double rays;  // a sample: few are not worth the look
        bool looks;
    } kCases[] = {{"adaptive", 0, true},
                  {"adaptive", 3, true},
                  {"adaptive", 2.9, false},
                  {"adaptive:by=filter", 2.9, true},
                  {"adaptive:by=noise", 9, false}};
    for (const auto& [sampler, rays, looks] : kCases) {
        SCOPED_TRACE(fmt::format("{}, {} rays", sampler, rays));
        const auto planner = MakePlanner(sampler);
        Render(planner->NextPass({film, 100'000}).counts, value, &film);
        const Plan plan = planner->NextPass({film, 100'000, {}, &guide, rays});
        const auto sum = [&](int x0) {
            std::uint64_t total = 0;
            for (int y = 0; y < kHeight; ++y) {
                for (int x = x0; x < x0 + kWidth / 2; ++x) {
                    total += plan.counts[static_cast<std::size_t>(y * kWidth + x)];
                }
            }
            return static_cast<double>(total);
        };
        const double ratio = sum(0) / sum(kWidth / 2);
        if (looks) {
            EXPECT_GT(ratio, 2);
        } else {
            EXPECT_NEAR(ratio, 1, 0.2);
        }
    }
}

TEST(Adaptive, SpendsWhereTheNoiseIs) {
    const auto half_noisy = [](int x, int y, std::uint32_t index) {
        return x < kWidth / 2 ? 1.0f : 2 * PseudoUniform(x, y, index, 0);
    };
    const Film film = RunAdaptive(32 * kWidth * kHeight, half_noisy);
    EXPECT_LT(film.SampleCount(16 * kWidth + 8), 14);
    EXPECT_GT(film.SampleCount(16 * kWidth + 40), 40);
}

TEST(Adaptive, AnImageWithoutNoiseIsDone) {
    const Film film =
        RunAdaptive(64 * kWidth * kHeight, [](int, int, std::uint32_t) { return 0.0f; });
    EXPECT_EQ(film.TotalSamples(), 4 * kWidth * kHeight);
}

}  // namespace
}  // namespace relume::jobs
