// Distances and weights of non-local means against their definition, and the same bits however
// computed.
#include "server/denoise/nlm_weights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "server/denoise/nlm_filter.h"
#include "tests/unit/denoise/reference_nlm.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

// Patch sums of floats round at 6e-8 of their largest term, at most 1 + 1/k^2 where weights are not
// 0; exp is right to 4e-6.
constexpr double kTolerance = 1e-5;

// Values near each other, so that weights are neither all 0 nor all 1.
Frame GentleFrame(int width, int height, unsigned seed) {
    Frame frame = MakeRandomFrame(width, height, seed);
    for (int c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            frame.variance[c][i] = 0.02f + 0.25f * frame.variance[c][i];
        }
    }
    return frame;
}

NlmGuide GuideOf(const Frame& frame, float scale = 1) {
    return {frame.width, frame.height, frame.color, frame.variance, scale};
}

std::vector<NlmOptions> SomeOptions() {
    std::vector<NlmOptions> all(8);
    all[1] = {.k = 1, .alpha = 0.5f, .epsilon = 1e-3f, .patch = 0};
    all[2] = {.k = 0.7f, .largest = 2, .patch = 1};
    all[3] = {.symmetric = true};
    all[4] = {.patch = 2, .symmetric = true};
    all[5] = {.symmetric = true, .weight_patch = 3, .least_weight = 0.05f};
    all[6] = {.k = 0.45f, .patch = 1, .weight_patch = 1, .least_weight = 0.4f};
    all[7] = {.patch = 2, .own_variance = true, .symmetric = true};
    return all;
}

TEST(NlmWeights, FollowTheDefinition) {
    const Frame frame = GentleFrame(40, 29, 1);
    const NlmGuide guide = GuideOf(frame, 1.5f);
    // A corner, the middle, the far corner, one pixel.
    const TileRect tiles[] = {{0, 0, 17, 12}, {9, 8, 30, 20}, {31, 13, 40, 29}, {20, 28, 21, 29}};
    int between_0_and_1 = 0, cut = 0;
    for (const NlmOptions& options : SomeOptions()) {
        const ReferenceNlm reference(guide, options);
        for (const TileRect& tile : tiles) {
            NlmWeights weights(options, 5, 21, 16);
            weights.Load(guide, tile);
            for (const auto& [dx, dy] :
                 {std::pair{1, 0}, {-5, 5}, {4, 3}, {0, 2}, {-3, 0}, {2, -4}}) {
                weights.ComputeWeights(dx, dy);
                for (int y = tile.y0; y < tile.y1; ++y) {
                    for (int x = tile.x0; x < tile.x1; ++x) {
                        const std::ptrdiff_t at = (y - tile.y0) * weights.stride() + x - tile.x0;
                        const double w = reference.Weight(x, y, dx, dy);
                        between_0_and_1 += w > 0.1 && w < 0.9;
                        cut += w == 0;
                        if (std::abs(w - options.least_weight) > kTolerance) {
                            ASSERT_NEAR(weights.forward()[at], w, kTolerance)
                                << x << ", " << y << " to " << dx << ", " << dy;
                        }
                        const double back = reference.Weight(x, y, -dx, -dy);
                        if (std::abs(back - options.least_weight) > kTolerance) {
                            ASSERT_NEAR(weights.backward()[at], back, kTolerance)
                                << x << ", " << y << " to " << -dx << ", " << -dy;
                        }
                    }
                }
            }
        }
    }
    EXPECT_GT(between_0_and_1, 3000);
    EXPECT_GT(cut, 1000);
}

TEST(NlmWeights, DistancesAndAllWeightsAreThoseOfEachOffset) {
    const Frame frame = GentleFrame(33, 20, 2);
    const NlmGuide guide = GuideOf(frame);
    const NlmOptions options{.patch = 2};
    const ReferenceNlm reference(guide, options);
    constexpr int kRadius = 3, kSide = 7;
    const TileRect tile = {12, 0, 33, 9};
    NlmWeights weights(options, kRadius, 32, 32);
    weights.Load(guide, tile);
    std::vector<float> all(kSide * kSide * tile.area(), -1.0f);
    weights.ComputeAllWeights(all.data());
    for (int dy = -kRadius; dy <= kRadius; ++dy) {
        for (int dx = -kRadius; dx <= kRadius; ++dx) {
            if (dx != 0 || dy != 0) {
                weights.ComputeDistances(dx, dy);
            }
            for (int y = 0; y < tile.height(); ++y) {
                for (int x = 0; x < tile.width(); ++x) {
                    const auto plane =
                        static_cast<std::size_t>((dy + kRadius) * kSide + dx + kRadius);
                    const float w =
                        all[plane * tile.area() + static_cast<std::size_t>(y * tile.width() + x)];
                    if (dx == 0 && dy == 0) {
                        ASSERT_EQ(w, 1);
                        continue;
                    }
                    ASSERT_NEAR(w, reference.Weight(tile.x0 + x, tile.y0 + y, dx, dy), kTolerance);
                    const double d = reference.Distance(tile.x0 + x, tile.y0 + y, dx, dy);
                    ASSERT_NEAR(weights.forward()[y * weights.stride() + x], d,
                                kTolerance * std::max(1.0, d));
                }
            }
        }
    }
}

// A feature of one channel takes the same way as a colour of three.
TEST(NlmWeights, OneChannelAndAnotherImagesWeights) {
    const Frame frame = GentleFrame(50, 31, 3);
    NlmGuide guide;
    guide.width = frame.width;
    guide.height = frame.height;
    guide.value = {&frame.color[1]};
    guide.variance = {&frame.variance[2]};
    const NlmOptions options{.k = 1};
    Plane out[2];
    FilterNlm(guide, options, 4, std::vector{&frame.half[0][0], &frame.color[2]},
              std::vector{&out[0], &out[1]}, {});
    const ReferenceNlm reference(guide, options);
    for (const auto& [x, y] : {std::pair{0, 0}, {25, 15}, {49, 30}, {3, 30}}) {
        const auto i = static_cast<std::size_t>(y * frame.width + x);
        EXPECT_NEAR(out[0][i], reference.Filter(frame.half[0][0], 4, x, y), kTolerance);
        EXPECT_NEAR(out[1][i], reference.Filter(frame.color[2], 4, x, y), kTolerance);
    }
}

TEST(NlmWeights, EqualColorsWeighOneAndUnlikeOnesWithoutNoiseNothing) {
    Frame frame = MakeRandomFrame(20, 12, 4);
    for (int c = 0; c < 3; ++c) {
        std::ranges::fill(frame.variance[c], 0.0f);
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            frame.color[c][i] = i % 20 < 10 ? 0.25f : 0.75f;
        }
    }
    NlmWeights weights({.patch = 0}, 1, 20, 12);
    weights.Load(GuideOf(frame), {0, 0, 20, 12});
    weights.ComputeWeights(1, 0);
    for (int x = 0; x < 20; ++x) {
        EXPECT_EQ(weights.forward()[x], x == 9 || x == 19 ? 0 : 1) << x;
        EXPECT_EQ(weights.backward()[x], x == 0 || x == 10 ? 0 : 1) << x;
    }
}

// What a distance becomes if one pixel alone changes, seen from that pixel: at a corner, an edge,
// in the middle, and where the neighbour lies within the patch or not.
TEST(NlmWeights, NudgedDistancesAreThoseOfANudgedPixel) {
    const Frame frame = GentleFrame(21, 17, 9);
    constexpr float kFactor = 1.25f;
    const TileRect tile = {0, 0, 21, 17};
    for (const int patch : {1, 3}) {
        const NlmOptions options{.k = 0.7f, .largest = 4, .patch = patch, .symmetric = true};
        NlmWeights weights(options, 5, 21, 17);
        weights.Load(GuideOf(frame, 2), tile);
        for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 1}, {2, 3}, {0, 4}, {5, 0}, {-3, 2}}) {
            weights.ComputeDistances(dx, dy);
            weights.ComputeNudgedDistances(dx, dy, kFactor);
            for (const auto& [x, y] :
                 {std::pair{0, 0}, {20, 16}, {1, 2}, {10, 8}, {4, 15}, {16, 4}, {19, 8}}) {
                Frame changed = frame;
                for (Plane& plane : changed.color) {
                    plane[static_cast<std::size_t>(y * 21 + x)] *= kFactor;
                }
                const NlmGuide guide = GuideOf(changed, 2);
                const ReferenceNlm reference(guide, options);
                const std::ptrdiff_t at = y * weights.stride() + x;
                const auto expect = [&](NlmDirection direction, double d) {
                    EXPECT_NEAR(weights.nudged(direction)[at], d, kTolerance * std::max(1.0, d))
                        << x << ", " << y << " to " << dx << ", " << dy;
                };
                expect(kForward, reference.Distance(x, y, dx, dy));
                expect(kBackward, reference.Distance(x, y, -dx, -dy));
                if (reference.Distance(x, y, dx, dy) < kNlmOutside &&
                    reference.Distance(x, y, -dx, -dy) < kNlmOutside) {
                    expect(kBetween, reference.Between(x, y, dx, dy));
                }
            }
        }
    }
}

// A ramp whose ends differ by far more than its noise: plain weights leave it as it is, the
// pairwise trick filters it and keeps it.
TEST(NlmWeights, ThePairwiseTrickKeepsARamp) {
    Frame frame = MakeRandomFrame(40, 30, 5);
    for (int c = 0; c < 3; ++c) {
        std::ranges::fill(frame.variance[c], 1e-4f);
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            frame.color[c][i] = 0.1f * static_cast<float>(i % 40);
        }
    }
    double sum[2] = {};
    for (const bool symmetric : {false, true}) {
        NlmWeights weights({.patch = 1, .symmetric = symmetric}, 2, 40, 30);
        weights.Load(GuideOf(frame), {0, 0, 40, 30});
        weights.ComputeWeights(2, 0);
        const std::ptrdiff_t at = 15 * weights.stride() + 20;
        sum[symmetric] = weights.forward()[at] + weights.backward()[at];
        EXPECT_EQ(weights.forward()[at], weights.backward()[at]);
    }
    EXPECT_LT(sum[0], 1e-6);
    EXPECT_EQ(sum[1], 2);
}

TEST(FilterNlm, IsTheWeightedMeanOfTheWindow) {
    const Frame frame = GentleFrame(300, 70, 6);  // more than one tile
    const NlmGuide guide = GuideOf(frame, 2);
    for (const NlmOptions& options : {SomeOptions()[5], SomeOptions()[2]}) {
        Plane out[3];
        FilterNlm(guide, options, 3,
                  std::vector{&frame.half[0][0], &frame.half[0][1], &frame.count},
                  std::vector{&out[0], &out[1], &out[2]}, {});
        const ReferenceNlm reference(guide, options);
        for (const auto& [x, y] : {std::pair{0, 0}, {127, 63}, {128, 64}, {299, 69}, {200, 20}}) {
            const auto i = static_cast<std::size_t>(y * frame.width + x);
            EXPECT_NEAR(out[1][i], reference.Filter(frame.half[0][1], 3, x, y), kTolerance);
            EXPECT_NEAR(out[2][i], reference.Filter(frame.count, 3, x, y), 16 * kTolerance);
        }
    }
}

// Uncorrelated noise of variance 1, filtered by weights that don't know of it.
TEST(FilterNlm, TellsHowMuchVarianceIsLeft) {
    const Frame frame = GentleFrame(40, 40, 10);
    const NlmGuide guide = GuideOf(frame);
    const std::vector<NlmOptions> all = SomeOptions();
    constexpr int kRuns = 200;
    std::vector<Plane> noise(kRuns, Plane(frame.pixel_count())), out(kRuns);
    std::mt19937 rng(11);
    std::vector<const Plane*> in;
    std::vector<Plane*> to;
    for (int run = 0; run < kRuns; ++run) {
        for (float& value : noise[static_cast<std::size_t>(run)]) {
            value = static_cast<float>(Normal(&rng));
        }
        in.push_back(&noise[static_cast<std::size_t>(run)]);
        to.push_back(&out[static_cast<std::size_t>(run)]);
    }
    Plane share;
    FilterNlm(guide, all[5], 3, in, to, {}, BestNlmKernels(), &share);
    double expected = 0, measured = 0;
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        expected += share[i];
        for (const Plane& plane : out) {
            measured += plane[i] * plane[i] / kRuns;
        }
    }
    // Some 20 independent places in each of 200 runs: 2 %; three of these.
    EXPECT_NEAR(measured / expected, 1, 0.07);
    EXPECT_LT(expected / static_cast<double>(frame.pixel_count()), 0.5);
}

TEST(FilterNlm, SameBitsForAnyInstructionSetAndThreadCount) {
    const Frame frame = GentleFrame(261, 71, 7);
    const NlmGuide guide = GuideOf(frame);
    for (const NlmOptions& options : SomeOptions()) {
        Plane first;
        const NlmKernelList usable = UsableNlmKernels();
        for (int k = 0; k < usable.size; ++k) {
            for (const int threads : {1, 5}) {
                SetThreadCount(threads);
                Plane out;
                FilterNlm(guide, options, 4, std::vector{&frame.color[0]}, std::vector{&out}, {},
                          *usable.list[k]);
                if (first.empty()) {
                    first = out;
                }
                EXPECT_EQ(out, first) << usable.list[k]->name << ", " << threads << " threads";
            }
        }
    }
    SetThreadCount(0);
}

TEST(FilterNlm, StopsWhenCancelled) {
    const Frame frame = GentleFrame(20, 20, 8);
    CancelToken cancel;
    cancel.Cancel();
    Plane out;
    EXPECT_THROW(
        FilterNlm(GuideOf(frame), {}, 2, std::vector{&frame.color[0]}, std::vector{&out}, cancel),
        Error);
}

}  // namespace
}  // namespace relume::denoise
