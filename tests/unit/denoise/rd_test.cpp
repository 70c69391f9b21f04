// Robust denoising: what is its own beside what every filter owes (filters_test.cpp).
#include "server/denoise/rd.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/error.h"
#include "server/denoise/rd_filter.h"
#include "tests/unit/denoise/authors_rows.h"
#include "tests/unit/denoise/reference_nlm.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

// Unsmoothed features with noise of their own, a colour with noise: weights of all sizes.
struct Fixture {
    explicit Fixture(int width, int height, unsigned seed)
        : frame(MakeRandomFrame(width, height, seed)) {
        PrefilteredFeatures given;
        for (int f = 0; f < kFeatureCount; ++f) {
            given.feature[f] = frame.feature[f];
            for (float& x : given.feature[f]) {
                x *= f == kDepth ? 1.0f : 0.6f;
            }
            given.variance[f] = frame.feature_variance[f];
            for (float& v : given.variance[f]) {
                v = 0.01f + 0.1f * v;
            }
        }
        features = MakeRdFeatures(frame, given);
        for (int c = 0; c < 3; ++c) {
            for (float& v : frame.variance[c]) {
                v = 0.02f + 0.25f * v;
            }
        }
    }
    NlmGuide Guide() const { return {frame.width, frame.height, frame.color, frame.variance}; }

    Frame frame;
    RdFeaturePlanes features;
};

// The weight of one neighbour in double.
class ReferenceRd {
  public:
    ReferenceRd(const Fixture& fixture, const NlmGuide& guide, const RdFilter& filter)
        : fixture_(fixture), filter_(filter), color_(guide, filter.color.value_or(NlmOptions{})) {}

    double Weight(int x, int y, int dx, int dy) const {
        const auto weight = [](double d) { return std::exp(-d); };
        if (!Inside(x + dx, y + dy)) {
            return 0;
        }
        const double a = Distance(x, y, dx, dy);
        if (!Inside(x - dx, y - dy)) {
            return weight(a);
        }
        const double b = Distance(x, y, -dx, -dy);
        double s = FeatureDistance(x, y, dx, dy, true);
        if (filter_.color) {
            s = std::max(s, color_.Between(x, y, dx, dy));
        }
        const double r =
            a < 25 && b < 25 ? std::clamp(weight(s) / (weight(a) + weight(b)) - 1, 0.0, 1.0) : 0;
        return r * weight(s) + (1 - r) * weight(a);
    }

    double Filter(const Plane& plane, int radius, int x, int y) const {
        double sum = 0, weights = 0, own = 1e-3;
        const auto at = [&](int u, int v) {
            return static_cast<double>(
                plane[static_cast<std::size_t>(v * fixture_.frame.width + u)]);
        };
        for (int dy = -radius; dy <= radius; ++dy) {
            for (int dx = -radius; dx <= radius; ++dx) {
                if ((dx != 0 || dy != 0) && Inside(x + dx, y + dy)) {
                    const double w = Weight(x, y, dx, dy);
                    sum += w * at(x + dx, y + dy);
                    weights += w;
                    own = std::max(own, w);
                }
            }
        }
        return (sum + own * at(x, y)) / (weights + own);
    }

  private:
    bool Inside(int x, int y) const {
        return x >= 0 && y >= 0 && x < fixture_.frame.width && y < fixture_.frame.height;
    }
    double Distance(int x, int y, int dx, int dy) const {
        const double d = FeatureDistance(x, y, dx, dy, false);
        return filter_.color ? std::max(d, color_.Distance(x, y, dx, dy)) : d;
    }
    double FeatureDistance(int x, int y, int dx, int dy, bool between) const {
        const RdFeaturePlanes& f = fixture_.features;
        const auto index = [&](int u, int v) {
            return static_cast<std::size_t>(v * fixture_.frame.width + u);
        };
        const std::size_t i = index(x, y), j = index(x + dx, y + dy);
        const std::size_t k = between ? index(x - dx, y - dy) : j;
        double largest = 0;
        std::size_t c = 0;
        for (const int size : f.group_size) {
            double sum = 0;
            for (const std::size_t end = c + static_cast<std::size_t>(size); c < end; ++c) {
                const double tau = filter_.tau;
                const auto spread = [&](std::size_t p) {
                    return std::max<double>(f.spread[c][p], tau);
                };
                const double vi = f.variance[c][i];
                double other = f.value[c][j], vj = f.variance[c][j], dj = spread(j);
                if (between) {
                    other = (other + f.value[c][k]) / 2;
                    vj = (vj + f.variance[c][k]) / 4;
                    dj = (dj + spread(k)) / 4;
                }
                const double step = f.value[c][i] - other;
                sum += (step * step - (vi + std::min(vi, vj))) / (1e-10 + 0.36 * (spread(i) + dj));
            }
            largest = std::max(largest, sum / size);
        }
        return largest;
    }

    const Fixture& fixture_;
    RdFilter filter_;
    ReferenceNlm color_;
};

constexpr RdFilter kFilters[] = {{NlmOptions{.patch = 1}, 1e-3f},
                                 {NlmOptions{.patch = 3, .own_variance = true}, 5e-2f},
                                 {std::nullopt, 5e-2f}};

TEST(RdFilter, IsTheMeanByTheLeastOfAllWeights) {
    const Fixture fixture(75, 40, 1);
    const NlmGuide guide = fixture.Guide();
    const Frame& frame = fixture.frame;
    const RdScene scene{guide, fixture.features,
                        4,     false,
                        false, {&frame.color[0], &frame.color[1], &frame.color[2], &frame.count}};
    const auto out = ApplyRdFilters(scene, kFilters, {}, BestNlmKernels());
    double moved = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const ReferenceRd reference(fixture, guide, kFilters[k]);
        for (const auto& [x, y] : {std::pair{0, 0}, {64, 31}, {63, 32}, {74, 39}, {30, 1}}) {
            const auto i = static_cast<std::size_t>(y * 75 + x);
            EXPECT_NEAR(out[k].out[1][i], reference.Filter(frame.color[1], 4, x, y), 2e-5) << k;
            EXPECT_NEAR(out[k].out[3][i], reference.Filter(frame.count, 4, x, y), 3e-4) << k;
            moved += std::abs(out[k].out[1][i] - frame.color[1][i]);
        }
    }
    EXPECT_GT(moved, 0.5);  // they filter
}

// By filtering a frame whose one pixel is brighter by as much.
TEST(RdFilter, DerivativeAndSureAreThoseOfAnotherRun) {
    const Fixture fixture(40, 30, 2);
    const NlmGuide guide = fixture.Guide();
    const Frame& frame = fixture.frame;
    const auto in = [](const Frame& f) {
        return std::vector<const Plane*>{&f.color[0], &f.color[1], &f.color[2]};
    };
    const RdFilter filters[] = {
        {NlmOptions{.patch = 1}, 1e-2f}, {NlmOptions{.patch = 3}, 1e-2f}, {std::nullopt, 1e-2f}};
    const RdScene scene{guide, fixture.features, 4, true, true, in(frame)};
    const auto out = ApplyRdFilters(scene, filters, {}, BestNlmKernels());
    int measured = 0;
    for (const auto& [x, y] : {std::pair{0, 0}, {39, 3}, {20, 15}, {7, 28}, {31, 29}}) {
        const auto i = static_cast<std::size_t>(y * 40 + x);
        Frame changed = frame;
        for (Plane& plane : changed.color) {
            plane[i] *= 1.01f;
        }
        const NlmGuide nudged(40, 30, changed.color, changed.variance);
        const RdScene again{nudged, fixture.features, 4, false, true, in(changed)};
        const auto other = ApplyRdFilters(again, filters, {}, BestNlmKernels());
        for (std::size_t k = 0; k < 3; ++k) {
            double sure = 0, derivative = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                const double y_i = frame.color[c][i], f = out[k].out[c][i];
                double slope = (other[k].out[c][i] - f) / (0.01 * y_i);
                measured += slope >= 0 && slope <= 1;
                if (slope < 0 || slope > 1) {
                    // The pixel's own share, from a plane that is 0 but there.
                    Plane delta(frame.pixel_count());
                    delta[i] = 1;
                    const RdScene one{guide, fixture.features,        4, false,
                                      false, {&delta, &delta, &delta}};
                    slope = ApplyRdFilters(one, filters, {}, BestNlmKernels())[k].out[0][i];
                }
                derivative += slope / 3;
                sure += ((f - y_i) * (f - y_i) + frame.variance[c][i] * (2 * slope - 1)) / 3;
            }
            // Differences of results, 6e-8 each, over 0.01.
            EXPECT_NEAR(out[k].derivative[i], derivative, 1e-3) << k << " at " << x << ", " << y;
            EXPECT_NEAR(out[k].sure[i], sure, 1e-3);
        }
    }
    EXPECT_GT(measured, 30);
}

// Noise of one light's brightness, the same in all channels relative to their values: what nudging
// a pixel's channels together is right for.
Frame GreyNoise(const Truth& truth, unsigned seed) {
    Frame frame = MakeGaussianFrame(truth, seed);
    std::mt19937 rng(seed + 1000);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        const Rgb color =
            truth.Color(static_cast<int>(i) % truth.width, static_cast<int>(i) / truth.width);
        const auto noise = static_cast<float>(0.1 * Normal(&rng));
        for (int c = 0; c < 3; ++c) {
            frame.color[c][i] = color[c] * (1 + noise);
            frame.variance[c][i] = 0.01f * color[c] * color[c];
        }
    }
    return frame;
}

// The candidates on frames whose noise is known: SURE against the error, over many runs.
TEST(RdFilter, SureTellsTheError) {
    const Truth truth{64, 48};
    constexpr int kRuns = 20;
    const RdFilter filters[] = {
        {NlmOptions{.patch = 1}, 1e-3f}, {NlmOptions{.patch = 3}, 1e-3f}, {std::nullopt, 1e-4f}};
    double sure[3] = {}, error[3] = {};
    for (int run = 0; run < kRuns; ++run) {
        const Frame frame = GreyNoise(truth, 50 + static_cast<unsigned>(run));
        const RdFeaturePlanes features = MakeRdFeatures(frame, PrefilterFeatures(frame, {}));
        const NlmGuide guide(64, 48, frame.color, frame.variance);
        const RdScene scene{guide, features, 10,
                            true,  false,    {&frame.color[0], &frame.color[1], &frame.color[2]}};
        const auto out = ApplyRdFilters(scene, filters, {}, BestNlmKernels());
        for (std::size_t k = 0; k < 3; ++k) {
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                const Rgb color = truth.Color(static_cast<int>(i) % 64, static_cast<int>(i) / 64);
                for (int c = 0; c < 3; ++c) {
                    const double d = out[k].out[static_cast<std::size_t>(c)][i] - color[c];
                    error[k] += d * d / 3;
                }
                sure[k] += out[k].sure[i];
            }
        }
    }
    for (int k = 0; k < 3; ++k) {
        const double pixels = 64 * 48 * kRuns;
        // A pixel's SURE scatters by 2 v |F - y| / v, v some 0.003: 1.5e-5 in the mean of all. That
        // the derivative is bounded lowers it by a few per cent; without any it would be 2e-4 less.
        EXPECT_NEAR(sure[k] / pixels, error[k] / pixels, 3e-5 + 0.07 * error[k] / pixels) << k;
        EXPECT_LT(error[k] / pixels, 0.3 * 0.01);
    }
}

TEST(Rd, SameBitsForAnyInstructionSetAndThreadCount) {
    ExpectSameBits(MakeGaussianFrame({100, 50}, 3),
                   [](const NlmKernels& kernels) { return MakeRd(kernels); });
}

TEST(Rd, BandsDoNotShow) {
    const Frame frame = FrameFromFilm(MakeFilm({90, 130}, 4, 10));
    const Result whole = MakeRd(BestNlmKernels())->Reconstruct(frame, {});
    for (const std::size_t pixels : {90u * 40, 90u * 7}) {
        const Result bands = MakeRd(BestNlmKernels(), pixels)->Reconstruct(frame, {});
        for (int c = 0; c < 3; ++c) {
            EXPECT_EQ(bands.color[c], whole.color[c]);
        }
        EXPECT_EQ(*bands.error, *whole.error);
        EXPECT_EQ(bands.notes, whole.notes);
    }
}

TEST(Rd, AnyRadius) {
    const Truth truth{90, 130};
    const Frame frame = FrameFromFilm(MakeFilm(truth, 4, 10));
    const Result usual = MakeDenoiser("rd")->Reconstruct(frame, {});
    EXPECT_EQ(MakeDenoiser("rd:radius=10")->Describe(), "rd");
    EXPECT_EQ(MakeDenoiser("rd:radius=10")->Reconstruct(frame, {}).color[0], usual.color[0]);
    double last = MrSE(truth, frame.color, 0, 90);
    for (const int radius : {1, 3, 20}) {
        const std::string name = fmt::format("rd:radius={}", radius);
        EXPECT_EQ(MakeDenoiser(name)->Describe(), name);
        const Result whole = MakeDenoiser(name)->Reconstruct(frame, {});
        const Result bands =
            MakeRd(BestNlmKernels(), 90u * 7, radius)->Reconstruct(frame, CancelToken());
        EXPECT_EQ(bands.color[1], whole.color[1]) << radius;
        const double error = MrSE(truth, whole.color, 0, 90);
        EXPECT_LT(error, last) << radius;
        last = error;
    }
    for (const char* wrong : {"rd:radius=0", "rd:radius=21", "rd:radius=-3"}) {
        EXPECT_THROW((void)MakeDenoiser(wrong), Error) << wrong;
    }
}

TEST(Rd, LowersNoiseAndKeepsEdges) {
    const Truth truth{120, 80};
    for (const int spp : {4, 8, 32}) {
        const Frame frame = FrameFromFilm(MakeFilm(truth, spp, 7));
        const Result result = MakeRd(BestNlmKernels())->Reconstruct(frame, {});
        EXPECT_LT(MrSE(truth, result.color, 0, 120), 0.1 * MrSE(truth, frame.color, 0, 120)) << spp;
        EXPECT_LT(MrSE(truth, result.color, 70, 74), 0.2 * MrSE(truth, frame.color, 70, 74)) << spp;
    }
}

// A shadow that no feature shows, and a texture that colour would blur.
TEST(Rd, KeepsWhatEitherColorOrFeaturesShow) {
    const Truth truth{120, 80};
    Frame frame = MakeGaussianFrame(truth, 8);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        if (i / 120 >= 40) {
            for (int c = 0; c < 3; ++c) {
                const float color =
                    truth.Color(static_cast<int>(i) % 120, static_cast<int>(i) / 120)[c];
                for (Plane* plane : {&frame.half[0][c], &frame.half[1][c], &frame.color[c]}) {
                    (*plane)[i] -= 0.5f * color;
                }
            }
        }
    }
    const Result result = MakeRd(BestNlmKernels())->Reconstruct(frame, {});
    double noisy = 0, edge = 0;
    for (int y = 38; y < 42; ++y) {
        for (int x = 0; x < 70; ++x) {
            const auto i = static_cast<std::size_t>(y * 120 + x);
            for (int c = 0; c < 3; ++c) {
                const float color = truth.Color(x, y)[c] * (y < 40 ? 1.0f : 0.5f);
                noisy += std::pow(frame.color[c][i] - color, 2);
                edge += std::pow(result.color[c][i] - color, 2);
            }
        }
    }
    EXPECT_LT(edge, 0.25 * noisy);
}

TEST(Rd, TellsFeaturesAndCandidates) {
    Frame frame = MakeGaussianFrame({60, 40}, 9);
    const auto rd = MakeRd(BestNlmKernels());
    Result result = rd->Reconstruct(frame, {});
    EXPECT_EQ(result.notes.at("features"), "normal, albedo, depth, visibility");
    EXPECT_EQ(result.notes.at("candidates").substr(0, 5), "fine ");
    for (int f = 0; f < kFeatureCount; ++f) {
        frame.feature[f].clear();
        frame.feature_variance[f].clear();
    }
    result = rd->Reconstruct(frame, {});
    EXPECT_EQ(result.notes.at("features"), "none");
    EXPECT_LT(MrSE({60, 40}, result.color, 0, 60), 0.6 * MrSE({60, 40}, frame.color, 0, 60));
}

TEST(Rd, PlansSamplesWhereTheErrorIs) {
    const Truth truth{120, 80};
    Frame frame = MakeGaussianFrame(truth, 5);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        const int x = static_cast<int>(i) % 120, y = static_cast<int>(i) / 120;
        for (int c = 0; c < 3; ++c) {
            const float scale = x < 60 ? 0.3f : 1;
            for (Plane* plane : {&frame.half[0][c], &frame.half[1][c], &frame.color[c]}) {
                const float color = truth.Color(x, y)[c];
                (*plane)[i] = color + scale * ((*plane)[i] - color);
            }
            frame.variance[c][i] *= scale * scale;
        }
    }
    const Plane counts = MakeRd(BestNlmKernels())->PlanSamples(frame, 40000, {});
    ASSERT_EQ(counts.size(), frame.pixel_count());
    double left = 0, right = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        ASSERT_GE(counts[i], 0);
        (i % 120 < 60 ? left : right) += counts[i];
    }
    EXPECT_NEAR(left + right, 40000, 4);
    EXPECT_GT(right, 3 * left);
}

TEST_F(AuthorsRows, RdIsClearlyBetterThanNlmAlone) {
    const Image reference = Row("reference.exr");
    // As good as NFOR, which its paper puts beside it.
    const double result = MrSEOf(reference, Filter("rd"));
    EXPECT_LT(result, 0.75 * MrSEOf(reference, Row("nlm.exr")));
    EXPECT_LT(result, 1.05 * MrSEOf(reference, Row("nfor.exr")));
}

}  // namespace
}  // namespace relume::denoise
