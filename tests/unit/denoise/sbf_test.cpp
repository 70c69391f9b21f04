// SBF against its equations: its candidates, what they are judged by, its gradient, its planner.
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/parallel.h"
#include "server/denoise/crop_frame.h"
#include "server/denoise/sbf.h"
#include "server/denoise/sbf_bank.h"
#include "server/denoise/sbf_gradient.h"
#include "server/denoise/share_samples.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

// Floats of weights and sums round at 6e-8, some hundred of them add up; exp is right to 4e-6.
constexpr double kTolerance = 2e-5;

double Square(double x) { return x * x; }

double Sigma(int k) { return std::pow(2.0, 0.5 * (k % kCandidates)); }

// d^2 / (2 sigma^2 max(s_i + s_j, 0.01)) of one feature.
double Term(double sigma, double scale, const Plane& feature, const Plane& variance, std::size_t i,
            std::size_t j) {
    return Square(scale * (feature[i] - feature[j])) /
           (2 * sigma * sigma *
            std::max(0.01, Square(scale) * (static_cast<double>(variance[i]) + variance[j])));
}

// Exponent of the weights by features.
class Exponent {
  public:
    explicit Exponent(const Frame& frame)
        : frame_(frame), farthest_(*std::ranges::max_element(frame.feature[kDepth])) {}

    double operator()(std::size_t i, std::size_t j) const {
        double e = 0;
        for (int f = kAlbedoR; f <= kDepth; ++f) {
            const double sigma = f < kNormalX ? 0.25 : f < kDepth ? 0.8 : 0.6;
            e += Term(sigma, f == kDepth ? 1 / farthest_ : 1, frame_.feature[f],
                      frame_.feature_variance[f], i, j);
        }
        return e;
    }

  private:
    const Frame& frame_;
    double farthest_;
};

// Mean of `plane` by weights exp(-exponent(i, j)) and a Gaussian cut at 2 sigma.
template <typename Fn>
double WindowMean(const Frame& frame, const Plane& plane, std::size_t i, double sigma,
                  const Fn& exponent, double* weights) {
    const int x = static_cast<int>(i) % frame.width, y = static_cast<int>(i) / frame.width;
    const int radius = std::min(16, static_cast<int>(std::lround(2 * sigma)));
    double sum = 0;
    *weights = 0;
    for (int v = std::max(y - radius, 0); v <= std::min(y + radius, frame.height - 1); ++v) {
        for (int u = std::max(x - radius, 0); u <= std::min(x + radius, frame.width - 1); ++u) {
            const auto j = static_cast<std::size_t>(v * frame.width + u);
            const double w = std::exp(
                -((u - x) * (u - x) + (v - y) * (v - y)) / (2 * sigma * sigma) - exponent(i, j));
            sum += w * plane[j];
            *weights += w;
        }
    }
    return sum / *weights;
}

// All rows of a bank at once.
struct WholeBank {
    explicit WholeBank(const Frame& frame, bool gradient = false) : guides(MakeSbfGuides(frame)) {
        if (gradient) {
            AddGradientGuide(frame, {}, &guides);
        }
        target = MakeSbfTarget(frame);
        bank = std::make_unique<SbfBank>(frame, guides, target, BestSbfKernels());
        for (std::size_t k = 0; k < static_cast<std::size_t>(bank->size()); ++k) {
            candidates.emplace_back();
        }
        // No band ends before the last row.
        bank->ForEachBand(frame.height, {}, [&](int, int) {
            for (int k = 0; k < bank->size(); ++k) {
                candidates[static_cast<std::size_t>(k)] = (*bank)[k];
            }
        });
    }

    SbfGuides guides;
    SbfTarget target;
    std::unique_ptr<SbfBank> bank;
    std::vector<SbfCandidate> candidates;
};

TEST(Sbf, EveryCandidateFollowsTheEquations) {
    const Frame frame = MakeRandomFrame(150, 70, 1);
    const Exponent by_features(frame);
    const WholeBank whole(frame);
    ASSERT_EQ(whole.candidates.size(), 7u);
    for (int k = 0; k < kCandidates; ++k) {
        const SbfCandidate& candidate = whole.candidates[static_cast<std::size_t>(k)];
        for (std::size_t i = 0; i < frame.pixel_count(); i += k < 4 ? 37 : 211) {
            double weights = 0, risk = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                const double mean =
                    WindowMean(frame, frame.color[c], i, Sigma(k), by_features, &weights);
                ASSERT_NEAR(candidate.filtered[c][i], mean, kTolerance) << k << ", " << i;
                risk += Square(mean - whole.target.color[c][i]) / 3 +
                        whole.target.variance[c][i] * (2 / weights - 1) / 3;
            }
            ASSERT_NEAR(candidate.own[i], 1 / weights, kTolerance);
            ASSERT_NEAR(candidate.risk[i], risk, kTolerance);
        }
    }
}

TEST(Sbf, GradientKindsFollowTheEquations) {
    const Frame frame = MakeRandomFrame(60, 50, 2);
    const Exponent by_features(frame);
    const WholeBank whole(frame, true);
    ASSERT_EQ(whole.candidates.size(), 21u);
    const double sigma_g[] = {INFINITY, 1, 0.5};
    double between = 0;
    for (const int k : {0, 4, 6, 7, 11, 13, 14, 18, 20}) {
        const SbfCandidate& candidate = whole.candidates[static_cast<std::size_t>(k)];
        // Back from the kernel's units: floor 0.01, sigma 1.
        Plane gradient = whole.guides.gradient, spread = whole.guides.gradient_spread;
        for (std::size_t i = 0; i < gradient.size(); ++i) {
            gradient[i] *= std::sqrt(0.02f);
            spread[i] *= 0.01f;
        }
        const auto exponent = [&](std::size_t i, std::size_t j) {
            return by_features(i, j) + Term(sigma_g[k / 7], 1, gradient, spread, i, j);
        };
        for (std::size_t i = 0; i < frame.pixel_count(); i += 53) {
            double weights = 0;
            const double mean = WindowMean(frame, frame.color[1], i, Sigma(k), exponent, &weights);
            ASSERT_NEAR(candidate.filtered[1][i], mean, kTolerance) << k << ", " << i;
            between +=
                std::abs(mean - whole.candidates[static_cast<std::size_t>(k % 7)].filtered[1][i]);
        }
    }
    EXPECT_GT(between, 1) << "the gradient has no say";
}

// The pixel filter, at a pixel whose window lies in the image and at a corner.
TEST(Sbf, TargetIsTheImageUnderThePixelFilter) {
    const Frame frame = MakeRandomFrame(20, 10, 3);
    const SbfTarget target = MakeSbfTarget(frame);
    for (const auto& [x, y] : {std::pair{8, 5}, {0, 0}}) {
        double sum = 0, weights = 0;
        for (int v = std::max(y - 2, 0); v <= y + 2; ++v) {
            for (int u = std::max(x - 2, 0); u <= x + 2; ++u) {
                // A sample anywhere in (u, v), seen from the middle of (x, y).
                double w = 0;
                for (int s = 0; s < 400; ++s) {
                    const double dx = u - x + (s % 20 + 0.5) / 20 - 0.5;
                    const double dy = v - y + (s / 20 + 0.5) / 20 - 0.5;
                    const auto f = [](double d) {
                        return std::max(0.0, std::exp(-2 * d * d) - std::exp(-8));
                    };
                    w += f(dx) * f(dy);
                }
                sum += w * frame.color[0][static_cast<std::size_t>(v * 20 + u)];
                weights += w;
            }
        }
        EXPECT_NEAR(target.color[0][static_cast<std::size_t>(y * 20 + x)], sum / weights, 1e-3);
    }
}

TEST(Sbf, SmoothIsAMeanByFeaturesOverAWindow) {
    const Frame frame = MakeRandomFrame(70, 150, 4);
    const Exponent by_features(frame);
    const SbfGuides guides = MakeSbfGuides(frame);
    const SbfTarget target = MakeSbfTarget(frame);
    SbfBank bank(frame, guides, target, BestSbfKernels());
    int bands = 0;
    bank.ForEachBand(16, {}, [&](int from, int to) {
        ++bands;
        // Ten planes: more than a group.
        std::vector<Plane> data;
        for (std::size_t p = 0; p < 10; ++p) {
            const Plane& whole = frame.feature_variance[p % kFeatureCount];
            data.emplace_back(whole.begin() + bank.begin() * 70, whole.begin() + bank.end() * 70);
            data.back()[5] += static_cast<float>(p);
        }
        std::vector<const Plane*> planes;
        for (const Plane& plane : data) {
            planes.push_back(&plane);
        }
        for (const int k : {4, 6}) {
            const auto smooth = bank.Smooth(planes, k, from, to, {});
            ASSERT_EQ(smooth.size(), 10u);
            for (const std::size_t p : {0u, 7u, 9u}) {
                Plane whole = frame.feature_variance[p % kFeatureCount];
                whole[static_cast<std::size_t>(bank.begin()) * 70 + 5] += static_cast<float>(p);
                ASSERT_EQ(smooth[p].size(), static_cast<std::size_t>(to - from) * 70);
                for (std::size_t i = 0; i < smooth[p].size(); i += 307) {
                    double weights = 0;
                    const double mean =
                        WindowMean(frame, whole, static_cast<std::size_t>(from) * 70 + i, Sigma(k),
                                   by_features, &weights);
                    ASSERT_NEAR(smooth[p][i], mean, kTolerance) << p << ", " << i;
                }
            }
        }
    });
    EXPECT_EQ(bands, 2);
}

TEST(Sbf, TakesTheCandidateOfLeastSmoothedRisk) {
    const Frame frame = MakeGaussianFrame({64, 48}, 5);
    const Exponent by_features(frame);
    const WholeBank whole(frame);
    const Result result = MakeSbf(false, BestSbfKernels())->Reconstruct(frame, {});
    for (const std::size_t i : {0u, 64u * 20 + 31, 64u * 47 + 5, 64u * 24 + 63}) {
        double least = INFINITY;
        std::size_t choice = 0;
        for (std::size_t k = 0; k < kCandidates; ++k) {
            double weights = 0;
            const double risk =
                WindowMean(frame, whole.candidates[k].risk, i, 8, by_features, &weights);
            if (risk < least) {
                least = risk;
                choice = k;
            }
        }
        EXPECT_EQ(result.color[1][i], whole.candidates[choice].filtered[1][i]) << "pixel " << i;
        EXPECT_EQ((*result.derivative)[0][i], whole.candidates[choice].own[i]);
    }
}

// What the result is reported to be wrong by.
TEST(Sbf, EstimatesTheErrorOfWhatItReturns) {
    const Truth truth{96, 80};
    for (const bool gradient : {false, true}) {
        const auto denoiser = MakeSbf(gradient, BestSbfKernels());
        double estimated = 0, real = 0, noisy = 0;
        for (unsigned run = 0; run < 10; ++run) {
            const Frame frame = MakeGaussianFrame(truth, 200 + run);
            const Result result = denoiser->Reconstruct(frame, {});
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                const Rgb color = truth.Color(static_cast<int>(i) % 96, static_cast<int>(i) / 96);
                estimated += 3 * (*result.error)[i];
                for (int c = 0; c < 3; ++c) {
                    real += Square(result.color[c][i] - color[c]);
                    noisy += frame.variance[c][i];
                }
            }
        }
        EXPECT_LT(real, 0.15 * noisy);
        EXPECT_LT(std::abs(estimated - real), 0.02 * noisy);
    }
}

TEST(SbfGradient, MagnitudeAndVarianceOfANoisyRamp) {
    constexpr int kSize = 100;
    constexpr float kSlope = 1, kVariance = 0.01f;
    std::mt19937 rng(6);
    double sum = 0, squares = 0, predicted = 0;
    for (int run = 0; run < 4; ++run) {
        Plane values;
        for (int i = 0; i < kSize * kSize; ++i) {
            values.push_back(kSlope * static_cast<float>(i % kSize) +
                             static_cast<float>(std::sqrt(kVariance) * Normal(&rng)));
        }
        const Gradient gradient =
            SobelGradient(values, Plane(values.size(), kVariance), kSize, kSize);
        for (int y = 1; y < kSize - 1; ++y) {
            for (int x = 1; x < kSize - 1; ++x) {
                const auto i = static_cast<std::size_t>(y * kSize + x);
                sum += gradient.magnitude[i];
                squares += Square(gradient.magnitude[i]);
                predicted += gradient.variance[i];
            }
        }
    }
    constexpr double kCount = 4 * (kSize - 2) * (kSize - 2);
    const double mean = sum / kCount;
    EXPECT_NEAR(mean, 8 * kSlope, 0.02);
    // 12 times the variance of one: some 6000 of the 38000 are independent, 1.8 %.
    EXPECT_NEAR((squares / kCount - mean * mean) / (12 * kVariance), 1, 0.07);
    EXPECT_NEAR(predicted / kCount / (12 * kVariance), 1, 1e-3);
}

TEST(SbfGradient, FlatGroundHasNone) {
    const Gradient gradient = SobelGradient(Plane(12, 3.0f), Plane(12, 0.0f), 4, 3);
    EXPECT_EQ(gradient.magnitude, Plane(12, 0.0f));
    EXPECT_EQ(gradient.variance, Plane(12, 0.0f));
}

class SbfBits : public testing::TestWithParam<bool> {};

TEST_P(SbfBits, SameForEveryKernel) {
    const Frame frame = MakeRandomFrame(150, 140, 7);
    const SbfKernelList usable = UsableSbfKernels();
    const auto denoiser = MakeSbf(GetParam(), *usable.list[0]);
    const Result reference = denoiser->Reconstruct(frame, {});
    const Plane plan = denoiser->PlanSamples(frame, 1e5, {});
    for (int k = 1; k < usable.size; ++k) {
        const auto other = MakeSbf(GetParam(), *usable.list[k]);
        const Result result = other->Reconstruct(frame, {});
        EXPECT_TRUE(result.color[0] == reference.color[0]) << usable.list[k]->name;
        EXPECT_EQ(result.notes, reference.notes);
        EXPECT_TRUE(other->PlanSamples(frame, 1e5, {}) == plan) << usable.list[k]->name;
    }
}

TEST_P(SbfBits, SameForEveryNumberOfThreads) {
    const Frame frame = MakeRandomFrame(270, 140, 8);
    const auto denoiser = MakeSbf(GetParam(), BestSbfKernels());
    SetThreadCount(1);
    const Result reference = denoiser->Reconstruct(frame, {});
    SetThreadCount(5);
    const Result result = denoiser->Reconstruct(frame, {});
    SetThreadCount(0);
    for (int c = 0; c < 3; ++c) {
        EXPECT_TRUE(result.color[c] == reference.color[c]);
    }
    EXPECT_TRUE(result.error == reference.error);
}

TEST_P(SbfBits, DoNotDependOnWhereTilesLie) {
    constexpr int kWidth = 230, kHeight = 200, kLeft = 9, kTop = 5;
    // Windows of 16 twice, and what the gradient is made of.
    const int halo = GetParam() ? 35 : 32;
    Frame frame = MakeRandomFrame(kWidth, kHeight, 9);
    frame.feature[kDepth][70 + 60 * kWidth] = 10;  // the largest, in both
    const Frame crop = CropFrame(frame, {kLeft, kTop, kWidth, kHeight});
    const auto denoiser = MakeSbf(GetParam(), BestSbfKernels());
    const Result whole = denoiser->Reconstruct(frame, {}), part = denoiser->Reconstruct(crop, {});
    for (int y = halo; y < crop.height; ++y) {
        for (int x = halo; x < crop.width; ++x) {
            ASSERT_EQ(part.color[0][static_cast<std::size_t>(y * crop.width + x)],
                      whole.color[0][static_cast<std::size_t>((y + kTop) * kWidth + x + kLeft)])
                << x << ", " << y;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Sbf, SbfBits, testing::Bool(),
                         [](const auto& p) { return p.param ? "gradient" : "plain"; });

TEST(Sbf, CancelEndsIt) {
    CancelToken cancel;
    cancel.Cancel();
    const Frame frame = MakeRandomFrame(70, 35, 12);
    const auto denoiser = MakeSbf(true, BestSbfKernels());
    EXPECT_ANY_THROW((void)denoiser->Reconstruct(frame, cancel));
    EXPECT_ANY_THROW((void)denoiser->PlanSamples(frame, 1e4, cancel));
}

// Half of the frame has ten times the noise: it gets more, and less where it has more already.
TEST(SbfPlan, SamplesGoWhereTheErrorIs) {
    Frame frame = MakeGaussianFrame({120, 80}, 10);
    std::mt19937 rng(11);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        for (int c = 0; c < 3 && i % 120 >= 60; ++c) {
            frame.color[c][i] += static_cast<float>(0.3 * Normal(&rng));
            frame.variance[c][i] += 0.09f;
        }
    }
    const auto share = [&](const Plane& plan) {
        double left = 0, right = 0;
        for (std::size_t i = 0; i < plan.size(); ++i) {
            (i % 120 < 60 ? left : right) += plan[i];
        }
        return right / left;
    };
    const auto denoiser = MakeSbf(false, BestSbfKernels());
    const double samples = 24.0 * 120 * 80;
    const double before = share(denoiser->PlanSamples(frame, samples, {}));
    EXPECT_GT(before, 3);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        frame.count[i] = i % 120 < 60 ? 8.0f : 35.0f;  // 1 + n: four times
    }
    EXPECT_NEAR(share(denoiser->PlanSamples(frame, samples, {})) / before, 0.25, 0.05);
}

TEST(ShareSamples, SumsToWhatIsAskedFor) {
    std::mt19937 rng(12);
    Plane priority(5000);
    for (float& p : priority) {
        p = static_cast<float>(std::pow(Uniform(&rng), 20.0));
    }
    for (const double mean : {0.25, 1.5, 24.0, 500.0, 5000.0}) {
        const Plane counts = ShareSamples(priority, mean * 5000, 1, 1024);
        double sum = 0;
        for (const float n : counts) {
            sum += n;
            EXPECT_GE(n, std::min(mean, 1.0) * 0.99999);
            EXPECT_LE(n, std::max(mean, 1024.0) * 1.00001);
        }
        EXPECT_NEAR(sum / (mean * 5000), 1, 1e-5) << mean;
    }
}

TEST(ShareSamples, IsProportionalWithinItsBounds) {
    const Plane counts = ShareSamples({0, 1, 2, 4, 1e6f}, 100, 1, 50);
    EXPECT_FLOAT_EQ(counts[0], 1);
    EXPECT_NEAR(counts[1], 7, 1e-4);
    EXPECT_NEAR(counts[2], 14, 1e-4);
    EXPECT_NEAR(counts[3], 28, 1e-4);
    EXPECT_FLOAT_EQ(counts[4], 50);
    // Nobody asks; nobody is there.
    EXPECT_EQ(ShareSamples({0, 0}, 6, 1, 50), Plane({3, 3}));
    EXPECT_EQ(ShareSamples({}, 6, 1, 50), Plane());
    // One asks, and has its most: the rest for all.
    EXPECT_EQ(ShareSamples({0, 1}, 20, 1, 12), Plane({4.5, 15.5}));
}

}  // namespace
}  // namespace relume::denoise
