// The bilateral filter's modes against their equations, and the same bits however computed.
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/parallel.h"
#include "server/denoise/bilateral.h"
#include "server/denoise/bilateral_bank.h"
#include "server/denoise/crop_frame.h"
#include "tests/unit/denoise/reference_bilateral.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

// Floats of weights and sums round at 6e-8, some hundred of them add up; exp is right to 4e-6.
constexpr double kTolerance = 2e-5;

void ExpectNear(const Plane& plane, const Plane& reference, const std::string& what) {
    ASSERT_EQ(plane.size(), reference.size());
    for (std::size_t i = 0; i < plane.size(); ++i) {
        ASSERT_NEAR(plane[i], reference[i], kTolerance * std::max(1.0f, std::abs(reference[i])))
            << what << ", pixel " << i;
    }
}

TEST(CorrectedBilateral, EveryCandidateFollowsTheEquations) {
    const Frame frame = MakeRandomFrame(71, 37, 1);
    const CandidateBank bank = ComputeBank(frame, BestKernels(), {});
    for (int k = 0; k < kCandidates; ++k) {
        const ReferenceResult reference = ReferenceCorrected(frame, std::pow(2.0, 0.5 * k));
        for (int c = 0; c < 3; ++c) {
            ExpectNear(bank.filtered[k][c], reference.color[c], "colour " + std::to_string(k));
        }
        ExpectNear(bank.sure[k], reference.sure, "SURE " + std::to_string(k));
    }
}

TEST(CorrectedBilateral, TakesTheCandidateOfLeastSmoothedSure) {
    const Truth truth{64, 48};
    const Frame frame = MakeGaussianFrame(truth, 2);
    const CandidateBank bank = ComputeBank(frame, BestKernels(), {});
    const Result result = MakeCorrectedBilateral(BestKernels())->Reconstruct(frame, {});
    // Smoothed by the definition: a Gaussian of 4 pixels cut at 12, clipped.
    for (const std::size_t i : {0u, 64u * 20 + 31, 64u * 47 + 5, 64u * 24 + 63}) {
        const int x = static_cast<int>(i) % 64, y = static_cast<int>(i) / 64;
        double best = INFINITY;
        int choice = -1;
        for (int k = 0; k < kCandidates; ++k) {
            double sum = 0, weights = 0;
            for (int v = std::max(y - 12, 0); v <= std::min(y + 12, 47); ++v) {
                for (int u = std::max(x - 12, 0); u <= std::min(x + 12, 63); ++u) {
                    const double w = std::exp(-((u - x) * (u - x) + (v - y) * (v - y)) / 32.0);
                    sum += w * bank.sure[k][static_cast<std::size_t>(v * 64 + u)];
                    weights += w;
                }
            }
            if (sum / weights < best) {
                best = sum / weights;
                choice = k;
            }
        }
        EXPECT_EQ(result.color[1][i], bank.filtered[choice][1][i]) << "pixel " << i;
        EXPECT_NEAR((*result.error)[i], best, 1e-6);
    }
}

TEST(CorrectedBilateral, SureIsUnbiased) {
    const Truth truth{48, 40};
    constexpr int kRuns = 40;
    double sum[kCandidates] = {}, squares[kCandidates] = {}, derivative[kCandidates] = {};
    for (int run = 0; run < kRuns; ++run) {
        const Frame frame = MakeGaussianFrame(truth, 100 + static_cast<unsigned>(run));
        const CandidateBank bank = ComputeBank(frame, BestKernels(), {});
        for (int k = 0; k < kCandidates; ++k) {
            double difference = 0, without = 0;
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                const Rgb color = truth.Color(static_cast<int>(i) % 48, static_cast<int>(i) / 48);
                double error = 0, residual = 0;
                for (int c = 0; c < 3; ++c) {
                    const double filtered = bank.filtered[k][c][i];
                    error += (filtered - color[c]) * (filtered - color[c]) / 3;
                    const double r = filtered - frame.color[c][i];
                    residual += (r * r - frame.variance[c][i]) / 3;
                }
                difference += bank.sure[k][i] - error;
                without += residual - error;
            }
            difference /= static_cast<double>(frame.pixel_count());
            sum[k] += difference;
            squares[k] += difference * difference;
            derivative[k] += without / static_cast<double>(frame.pixel_count());
        }
    }
    for (int k = 0; k < kCandidates; ++k) {
        const double mean = sum[k] / kRuns;
        const double deviation = std::sqrt((squares[k] / kRuns - mean * mean) / (kRuns - 1));
        // Seven tests at once: 3.2 standard errors is 1 % for all.
        EXPECT_LT(std::abs(mean), 3.2 * deviation) << "candidate " << k;
        // Without the derivative the same test would fail.
        EXPECT_LT(derivative[k] / kRuns, -3.2 * deviation) << "candidate " << k;
    }
}

TEST(CorrectedBilateral, VarianceFallsByTheSquaresOfTheWeights) {
    Frame frame = MakeGaussianFrame({128, 128}, 3);
    std::mt19937 rng(4);
    for (auto& plane : frame.feature) {
        plane.assign(frame.pixel_count(), 0.5f);
    }
    for (auto& plane : frame.color) {
        for (float& value : plane) {
            value = 1 + static_cast<float>(0.1 * Normal(&rng));
        }
    }
    const CandidateBank bank = ComputeBank(frame, BestKernels(), {});
    for (int k = 0; k < 4; ++k) {
        const double sigma = CandidateSigma(k);
        const int radius = static_cast<int>(std::lround(2 * sigma));
        double weights = 0, squares = 0;
        for (int y = -radius; y <= radius; ++y) {
            for (int x = -radius; x <= radius; ++x) {
                const double w = std::exp(-(x * x + y * y) / (2 * sigma * sigma));
                weights += w;
                squares += w * w;
            }
        }
        double error = 0;
        for (int y = 16; y < 112; ++y) {
            for (int x = 16; x < 112; ++x) {
                for (const Plane& plane : bank.filtered[k]) {
                    const double d = plane[static_cast<std::size_t>(y * 128 + x)] - 1.0;
                    error += d * d;
                }
            }
        }
        // About 3 x 96^2 / (4 pi sigma^2) independent values, 275 at sigma 2.8: 8.5 % deviation.
        EXPECT_NEAR(error / (3 * 96 * 96) / (0.01 * squares / (weights * weights)), 1, 0.27) << k;
    }
}

class PrintedBilateral : public testing::TestWithParam<int> {};

TEST_P(PrintedBilateral, FollowsTheEquations) {
    // Features nearly the same, or their unsquared distance would leave no neighbour any weight.
    Frame frame = MakeRandomFrame(70, 35, 5);
    for (auto& plane : frame.feature) {
        for (float& value : plane) {
            value = 0.5f + 0.02f * value;
        }
    }
    const Result result = MakePrintedBilateral(GetParam(), BestKernels())->Reconstruct(frame, {});
    const double sigma = std::stod(result.notes.at("sigma_s"));
    // The note has three digits.
    const double exact = std::pow(2.0, 0.5 * std::round(2 * std::log2(sigma)));
    const ReferenceResult reference = ReferencePrinted(frame, exact, GetParam());
    double moved = 0;
    for (int c = 0; c < 3; ++c) {
        ExpectNear(result.color[c], reference.color[c], "colour");
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            moved += std::abs(result.color[c][i] - frame.color[c][i]);
        }
    }
    EXPECT_GT(moved / (3 * static_cast<double>(frame.pixel_count())), 0.02) << "nothing to compare";
}

INSTANTIATE_TEST_SUITE_P(Terms, PrintedBilateral, testing::Values(0, 1, 8, 64));

// (15): 64 terms are all of the series for the gradients of a [0,1] image, at most 4.47 (lambda 20
// at sigma 1); the direct form must come out.
TEST(PrintedBilateralSeries, WholeSeriesIsTheDirectForm) {
    const Frame frame = MakeGaussianFrame({50, 30}, 6);
    const Result series = MakePrintedBilateral(64, BestKernels())->Reconstruct(frame, {});
    const Result direct = MakePrintedBilateral(0, BestKernels())->Reconstruct(frame, {});
    ASSERT_EQ(series.notes, direct.notes);
    for (int c = 0; c < 3; ++c) {
        ExpectNear(series.color[c], direct.color[c], "colour");
    }
}

TEST(PrintedBilateralSeries, LargeGradientsNeitherOverflowNorVanish) {
    Frame frame = MakeRandomFrame(40, 20, 7);
    for (int c = 0; c < 3; ++c) {
        for (Plane* plane : {&frame.color[c], &frame.half[0][c], &frame.half[1][c]}) {
            for (float& value : *plane) {
                value *= 255;
            }
        }
    }
    for (const int taylor : {0, 8, 64}) {
        const Result result = MakePrintedBilateral(taylor, BestKernels())->Reconstruct(frame, {});
        for (int c = 0; c < 3; ++c) {
            for (const float value : result.color[c]) {
                ASSERT_TRUE(value >= 0 && value <= 255) << value;  // a mean of the window's
            }
        }
    }
}

TEST(PrintedBilateralSeries, FlatGroundStaysAsItIs) {
    Frame frame = MakeGaussianFrame({40, 20}, 8);
    for (int c = 0; c < 3; ++c) {
        frame.color[c].assign(frame.pixel_count(), 0.3f);
    }
    const Result result = MakePrintedBilateral(8, BestKernels())->Reconstruct(frame, {});
    EXPECT_EQ(result.color[0], frame.color[0]);
}

TEST(Sobel, MagnitudeOfARampAndAnEdge) {
    Frame frame;
    frame.width = 5;
    frame.height = 4;
    for (auto& plane : frame.color) {
        for (int i = 0; i < 20; ++i) {
            plane.push_back(static_cast<float>(i % 5));
        }
    }
    const Plane ramp = SobelMagnitude(frame);
    EXPECT_FLOAT_EQ(ramp[7], 8);  // eight times the slope
    EXPECT_FLOAT_EQ(ramp[5], 4);  // the border is replicated: half of it
    for (auto& plane : frame.color) {
        for (int i = 0; i < 20; ++i) {
            plane[static_cast<std::size_t>(i)] = i < 10 ? 0.0f : 1.0f;
        }
    }
    const Plane edge = SobelMagnitude(frame);
    EXPECT_FLOAT_EQ(edge[2], 0);
    EXPECT_FLOAT_EQ(edge[7], 4);
    EXPECT_FLOAT_EQ(edge[12], 4);
}

struct Mode {
    const char* name;
    std::unique_ptr<Denoiser> (*make)(const BilateralKernels& kernels);
};

constexpr Mode kModes[] = {
    {"robust", MakeRobustBilateral},
    {"corrected", MakeCorrectedBilateral},
    {"printed", [](const BilateralKernels& k) { return MakePrintedBilateral(8, k); }},
    {"direct", [](const BilateralKernels& k) { return MakePrintedBilateral(0, k); }},
};

void ExpectSameBits(const Result& a, const Result& b, const std::string& what) {
    for (int c = 0; c < 3; ++c) {
        EXPECT_TRUE(a.color[c] == b.color[c]) << what;
    }
    EXPECT_TRUE(a.error == b.error) << what;
    EXPECT_EQ(a.notes, b.notes) << what;
}

class BilateralBits : public testing::TestWithParam<Mode> {};

TEST_P(BilateralBits, SameForEveryKernel) {
    const Frame frame = MakeRandomFrame(150, 70, 9);
    const KernelList usable = UsableKernels();
    const Result reference = GetParam().make(*usable.list[0])->Reconstruct(frame, {});
    for (int k = 1; k < usable.size; ++k) {
        ExpectSameBits(GetParam().make(*usable.list[k])->Reconstruct(frame, {}), reference,
                       usable.list[k]->name);
    }
}

TEST_P(BilateralBits, SameForEveryNumberOfThreads) {
    const Frame frame = MakeRandomFrame(150, 70, 10);
    const auto denoiser = GetParam().make(BestKernels());
    SetThreadCount(1);
    const Result reference = denoiser->Reconstruct(frame, {});
    for (const int threads : {2, 5}) {
        SetThreadCount(threads);
        ExpectSameBits(denoiser->Reconstruct(frame, {}), reference, std::to_string(threads));
    }
    SetThreadCount(0);
}

INSTANTIATE_TEST_SUITE_P(Modes, BilateralBits, testing::ValuesIn(kModes),
                         [](const auto& mode) { return std::string(mode.param.name); });

// The internal tiles lie elsewhere over the same pixels; beyond the halo nothing may tell.
// Halo: the window, the blur of SURE; for robust also the guide's window and the blur of the share.
class BilateralTiles : public testing::TestWithParam<std::pair<int, int>> {};

TEST_P(BilateralTiles, BitsDoNotDependOnWhereTilesLie) {
    constexpr int kWidth = 140, kHeight = 190, kLeft = 9, kTop = 5;
    const Mode& mode = kModes[GetParam().first];
    const int halo = GetParam().second;
    Frame frame = MakeRandomFrame(kWidth, kHeight, 11);
    frame.feature[kDepth][70 + 60 * kWidth] = 10;  // the largest, in both
    const Frame crop = CropFrame(frame, {kLeft, kTop, kWidth, kHeight});
    const auto denoiser = mode.make(BestKernels());
    const Result whole = denoiser->Reconstruct(frame, {}), part = denoiser->Reconstruct(crop, {});
    for (int y = halo; y < crop.height; ++y) {
        for (int x = halo; x < crop.width; ++x) {
            ASSERT_EQ(part.color[0][static_cast<std::size_t>(y * crop.width + x)],
                      whole.color[0][static_cast<std::size_t>((y + kTop) * kWidth + x + kLeft)])
                << x << ", " << y;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Modes, BilateralTiles,
                         testing::Values(std::pair{0, 16 + 12 + 2 + 24}, std::pair{1, 16 + 12}));

TEST(CorrectedBilateral, CancelEndsIt) {
    CancelToken cancel;
    cancel.Cancel();
    const Frame frame = MakeRandomFrame(70, 35, 12);
    for (const Mode& mode : kModes) {
        EXPECT_ANY_THROW((void)mode.make(BestKernels())->Reconstruct(frame, cancel)) << mode.name;
    }
}

}  // namespace
}  // namespace relume::denoise
