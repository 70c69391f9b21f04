// GEM against its equations: which Gaussian it chooses, the error that it reports, and its planner.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "core/base/parallel.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/gem_plan.h"
#include "server/denoise/planes.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using Doubles = std::vector<double>;

double Square(double x) { return x * x; }

// Weight at a distance along one axis: a Gaussian cut at 3 sigma; for sigma 0, the pixel alone.
double Tap(double sigma, int d) {
    return std::abs(d) > std::ceil(3 * sigma) ? 0.0
           : d == 0                           ? 1.0
                                              : std::exp(-d * d / (2 * sigma * sigma));
}

// The plain definition, in two dimensions.
struct Reference {
    Reference(const Frame& frame, const GemScales& scales) {
        const auto pixels = frame.pixel_count();
        scale.assign(pixels, -1);
        doubt.assign(pixels, INFINITY);
        error.resize(pixels);
        std::vector<bool> stopped(pixels, false);
        std::vector<Doubles> fine = Level(frame, 0);
        for (std::size_t i = 0; i < pixels; ++i) {
            error[i] = (fine[3][i] + fine[4][i] + fine[5][i]) / 3;
        }
        for (std::size_t s = 0; s < scales.sigma.size(); ++s) {
            const double sigma = scales.sigma[s], before = s > 0 ? scales.sigma[s - 1] : 0;
            const std::vector<Doubles> coarse = Level(frame, sigma);
            const double beta =
                s == 0 ? 1 : (Square(sigma) + Square(before)) / (Square(sigma) - Square(before));
            const double noise = NoiseOfDifference(before, sigma);
            Doubles flag(pixels), balance(pixels), change(pixels);
            for (std::size_t i = 0; i < pixels; ++i) {
                const double z = -std::log(1 - std::pow(1.9 * scales.gamma, std::sqrt(0.5))) *
                                 (1 - 1 / coarse[6][i]);
                for (std::size_t c = 0; c < 3; ++c) {
                    const double loss = beta * Square(coarse[c][i] - fine[c][i]);
                    const double gain = fine[3 + c][i] - coarse[3 + c][i];
                    balance[i] += z * loss - gain;
                    change[i] += (loss - beta * noise * fine[3 + c][i] - gain) / 3;
                }
                flag[i] = balance[i] >= 0;
            }
            for (std::size_t i = 0; i < pixels; ++i) {
                double sum = 0, weights = 0;
                ForWindow(frame, i, scales.flag_blur * sigma, [&](std::size_t j, double w) {
                    sum += j == i ? 0 : w * flag[j];
                    weights += j == i ? 0 : w;
                });
                const double own = std::min(0.01, 1 / (1 + weights));
                const double smooth = own * flag[i] + (1 - own) * sum / weights;
                const bool stop = smooth >= 0.5 && (!scales.own_flag_needed || flag[i] > 0);
                doubt[i] = std::min({doubt[i], std::abs(smooth - 0.5), std::abs(balance[i])});
                stopped[i] = stopped[i] || stop;
                if (!stopped[i]) {
                    scale[i] = static_cast<int>(s);
                    error[i] += change[i];
                }
            }
            fine = coarse;
        }
    }

    template <typename Fn>
    static void ForWindow(const Frame& frame, std::size_t i, double sigma, const Fn& fn) {
        const int x = static_cast<int>(i) % frame.width, y = static_cast<int>(i) / frame.width;
        for (int v = 0; v < frame.height; ++v) {
            for (int u = 0; u < frame.width; ++u) {
                const double w = Tap(sigma, u - x) * Tap(sigma, v - y);
                if (w > 0) {
                    fn(static_cast<std::size_t>(v * frame.width + u), w);
                }
            }
        }
    }

    // Of two scales' difference, by all the weights in a plane, over the finer one's.
    static double NoiseOfDifference(double fine, double coarse) {
        double fine_sum = 0, coarse_sum = 0;
        for (int i = 0; i < 101 * 101; ++i) {
            fine_sum += Tap(fine, i % 101 - 50) * Tap(fine, i / 101 - 50);
            coarse_sum += Tap(coarse, i % 101 - 50) * Tap(coarse, i / 101 - 50);
        }
        double both = 0, alone = 0;
        for (int i = 0; i < 101 * 101; ++i) {
            const double f = Tap(fine, i % 101 - 50) * Tap(fine, i / 101 - 50) / fine_sum;
            const double c = Tap(coarse, i % 101 - 50) * Tap(coarse, i / 101 - 50) / coarse_sum;
            both += Square(c - f);
            alone += f * f;
        }
        return both / alone;
    }

    // At least the mean over 5x5 pixels.
    static double Variance(const Frame& frame, std::size_t c, std::size_t i) {
        const int x = static_cast<int>(i) % frame.width, y = static_cast<int>(i) / frame.width;
        double sum = 0, count = 0;
        for (int v = std::max(y - 2, 0); v <= std::min(y + 2, frame.height - 1); ++v) {
            for (int u = std::max(x - 2, 0); u <= std::min(x + 2, frame.width - 1); ++u) {
                sum += frame.variance[c][static_cast<std::size_t>(v * frame.width + u)];
                ++count;
            }
        }
        return std::max<double>(frame.variance[c][i], sum / count);
    }

    // Means, their variances, samples.
    static std::vector<Doubles> Level(const Frame& frame, double sigma) {
        std::vector<Doubles> level(7, Doubles(frame.pixel_count()));
        std::vector<Doubles> variance(3, Doubles(frame.pixel_count()));
        for (std::size_t c = 0; c < 3; ++c) {
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                variance[c][i] = Variance(frame, c, i);
            }
        }
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            double weights = 0, squares = 0;
            ForWindow(frame, i, sigma, [&](std::size_t j, double w) {
                weights += w;
                squares += w * w;
                for (std::size_t c = 0; c < 3; ++c) {
                    level[c][i] += w * frame.color[c][j];
                    level[3 + c][i] += w * w * variance[c][j];
                }
                level[6][i] += w * frame.count[j];
            });
            for (std::size_t c = 0; c < 3; ++c) {
                level[c][i] /= weights;
                level[3 + c][i] /= Square(weights);
            }
            level[6][i] *= weights / squares;
        }
        return level;
    }

    std::vector<int> scale;
    Doubles error, doubt;  // how near a decision was to the other
};

class GemChoice : public testing::TestWithParam<bool> {};

TEST_P(GemChoice, FollowsTheEquations) {
    const GemScales scales = GetParam() ? FinalGemScales(0.2f) : PlanGemScales(0.2f);
    Frame frame = MakeGaussianFrame({60, 44}, 1);
    for (std::size_t i = 0; i < frame.pixel_count(); i += 3) {
        frame.variance[i % 2][i] = 0;
    }
    const GemSelection selection = SelectScales(frame, scales, {});
    const Reference reference(frame, scales);
    std::vector<int> histogram(scales.sigma.size() + 1, 0);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        ++histogram[static_cast<std::size_t>(reference.scale[i] + 1)];
        if (reference.doubt[i] > 1e-6) {
            ASSERT_EQ(selection.scale[i], reference.scale[i]) << i;
            ASSERT_NEAR(selection.error[i], reference.error[i], 1e-6) << i;
        }
    }
    EXPECT_GE(std::ranges::count_if(histogram, [](int n) { return n > 10; }), 3)
        << "little to test";
}

INSTANTIATE_TEST_SUITE_P(Gem, GemChoice, testing::Bool(),
                         [](const auto& p) { return p.param ? "image" : "plan"; });

TEST(Gem, ConfidenceIsThePapers) {
    EXPECT_NEAR(GemConfidence(0.2f, INFINITY), 0.702, 1e-3);
    EXPECT_NEAR(GemConfidence(0.2f, 4), 0.75 * 0.702, 1e-3);
    EXPECT_EQ(GemConfidence(0.2f, 1), 0);
}

// Constant and noise: most pixels get the widest Gaussian, whose variance is 1/(4 pi sigma^2).
TEST(Gem, EstimatesTheErrorOnFlatGround) {
    Frame frame = MakeGaussianFrame({160, 120}, 2);
    std::mt19937 rng(3);
    for (auto& plane : frame.color) {
        for (float& value : plane) {
            value = 1 + static_cast<float>(0.1 * Normal(&rng));
        }
    }
    const GemSelection selection = SelectScales(frame, FinalGemScales(0.2f), {});
    double estimated = 0, real = 0;
    int widest = 0;
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        widest += selection.scale[i] == 7;
        estimated += 3 * selection.error[i];
        for (const Plane& mean : selection.mean) {
            real += Square(mean[i] - 1.0);
        }
    }
    const auto pixels = static_cast<double>(frame.pixel_count());
    EXPECT_GT(widest / pixels, 0.9);
    EXPECT_LT(real / (3 * pixels), 0.01 * 0.05);
    // Scales are chosen by the same noise: too low by some of it.
    EXPECT_LT(std::abs(estimated - real) / (3 * pixels), 0.01 * 0.02);
}

// Pixels that the light's samples have missed: dark, without variance.
TEST(Gem, MissedPixelsAreNotDone) {
    Frame frame = MakeGaussianFrame({64, 48}, 8);
    std::mt19937 rng(9);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        const float hits = Uniform(&rng) < 0.3 ? 1.0f / 0.3f : 0.0f;
        for (std::size_t c = 0; c < 3; ++c) {
            frame.color[c][i] = hits;
            frame.variance[c][i] = hits > 0 ? 7.8f : 0.0f;
        }
    }
    const GemSelection selection = SelectScales(frame, FinalGemScales(0.2f), {});
    double mean = 0;
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        mean += selection.mean[0][i] / static_cast<double>(frame.pixel_count());
        EXPECT_GT(selection.mean[0][i], 0.2f) << i;
    }
    EXPECT_NEAR(mean, 1, 0.08);
}

TEST(Gem, KeepsAnEdgeThatStandsOutOfTheNoise) {
    Frame frame = MakeGaussianFrame({64, 40}, 4);
    std::mt19937 rng(5);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            frame.color[c][i] =
                (i % 64 < 32 ? 0.2f : 1.2f) + static_cast<float>(0.03 * Normal(&rng));
        }
        frame.variance[c].assign(frame.pixel_count(), 9e-4f);
    }
    const GemSelection selection = SelectScales(frame, FinalGemScales(0.2f), {});
    for (std::size_t y = 0; y < 40; ++y) {
        EXPECT_LE(selection.scale[y * 64 + 31], 1) << y;
        EXPECT_GE(selection.scale[y * 64 + 8], 3) << y;
        EXPECT_NEAR(selection.mean[0][y * 64 + 29], 0.2, 0.15);
        EXPECT_NEAR(selection.mean[0][y * 64 + 34], 1.2, 0.15);
    }
}

TEST(Gem, SameForEveryNumberOfThreads) {
    const Frame frame = MakeRandomFrame(150, 70, 6);
    const auto denoiser = MakeDenoiser("gem");
    SetThreadCount(1);
    const Result reference = denoiser->Reconstruct(frame, {});
    const Plane plan = denoiser->PlanSamples(frame, 3e4, {});
    SetThreadCount(5);
    const Result result = denoiser->Reconstruct(frame, {});
    EXPECT_TRUE(denoiser->PlanSamples(frame, 3e4, {}) == plan);
    SetThreadCount(0);
    for (int c = 0; c < 3; ++c) {
        EXPECT_TRUE(result.color[c] == reference.color[c]);
    }
    EXPECT_TRUE(result.error == reference.error);
}

TEST(Gem, CancelEndsIt) {
    CancelToken cancel;
    cancel.Cancel();
    const Frame frame = MakeRandomFrame(40, 30, 7);
    EXPECT_ANY_THROW((void)MakeDenoiser("gem")->Reconstruct(frame, cancel));
    EXPECT_ANY_THROW((void)MakeDenoiser("gem")->PlanSamples(frame, 100, cancel));
}

// One pixel with an error, at (x, y) of a frame of 60 x 40.
GemSelection OneBadPixel(int x, int y, signed char scale) {
    GemSelection selection;
    selection.scale.assign(60 * 40, scale);
    for (Plane& mean : selection.mean) {
        mean.assign(60 * 40, 1.0f);
    }
    selection.error.assign(60 * 40, 0.0f);
    selection.support.assign(60 * 40, 8.0f);
    selection.error[static_cast<std::size_t>(y * 60 + x)] = 1;
    return selection;
}

TEST(GemPlan, ABatchIsSpreadByThePixelsGaussian) {
    const GemScales scales = PlanGemScales(0.2f);
    const Plane counts = PlanGemSamples(OneBadPixel(30, 20, 1), scales, 60, 40, 4);
    for (const auto& [dx, dy] : {std::pair{0, 0}, {1, 0}, {-2, 3}, {5, -5}, {7, 0}}) {
        const double expected =
            std::abs(dx) > 6 ? 0 : 4 * std::exp(-(dx * dx + dy * dy) / 8.0) / (2 * M_PI * 4);
        EXPECT_NEAR(counts[static_cast<std::size_t>((20 + dy) * 60 + 30 + dx)], expected, 2e-3)
            << dx << ", " << dy;
    }
    const Plane alone = PlanGemSamples(OneBadPixel(30, 20, -1), scales, 60, 40, 4);
    EXPECT_FLOAT_EQ(alone[20 * 60 + 30], 4);
    // In a corner, all of it stays in the image.
    const Plane corner = PlanGemSamples(OneBadPixel(0, 0, 3), scales, 60, 40, 4);
    EXPECT_NEAR(std::accumulate(corner.begin(), corner.end(), 0.0), 4, 1e-4);
}

TEST(GemPlan, TheWorstGetTheirBatchesFirst) {
    GemSelection selection = OneBadPixel(0, 0, -1);
    for (std::size_t i = 0; i < selection.error.size(); ++i) {
        selection.error[i] = static_cast<float>(i % 100) + 1;
        // Equal errors, but less to expect of a batch among many samples; and dark.
        selection.support[i] = i % 2 == 0 ? 8.0f : 1e6f;
    }
    // 400 samples: 100 picks, of the largest errors with few samples: 98, 96, 94, 92 and 90.
    const Plane counts = PlanGemSamples(selection, PlanGemScales(0.2f), 60, 40, 400);
    for (std::size_t i = 0; i < counts.size(); ++i) {
        if (counts[i] > 0) {
            EXPECT_FLOAT_EQ(counts[i], 4);
            EXPECT_GE(i % 100, 90u);
            EXPECT_EQ(i % 2, 0u);
        }
    }
    EXPECT_EQ(std::count(counts.begin(), counts.end(), 4.0f), 100);
}

// None of the others has an error: they share what is left evenly.
TEST(GemPlan, WhatNobodyAsksForGoesToTheRest) {
    const Plane counts = PlanGemSamples(OneBadPixel(30, 20, -1), PlanGemScales(0.2f), 60, 40, 2400);
    EXPECT_FLOAT_EQ(counts[20 * 60 + 30], 4);
    EXPECT_NEAR(counts[0], 2396.0 / 2399, 1e-4);
    EXPECT_NEAR(std::accumulate(counts.begin(), counts.end(), 0.0), 2400, 1e-2);
}

}  // namespace
}  // namespace relume::denoise
