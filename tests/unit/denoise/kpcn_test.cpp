#include "server/denoise/kpcn.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/parallel.h"
#include "server/denoise/kpcn_inputs.h"
#include "tests/unit/denoise/reference_network.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using testing::HasSubstr;

TensorArchive SomeWeights(int hidden, int side) {
    TensorArchive weights;
    AddWeights("conv1", hidden, kKpcnInputs, 5, 1, &weights);
    AddWeights("conv2", hidden, hidden, 5, 2, &weights);
    AddWeights("conv3", side * side, hidden, 5, 3, &weights);
    return weights;
}

Result Filter(const Frame& frame, const TensorArchive& weights, int tile) {
    return RunDenoiser(*MakeKpcn(weights, "some", tile), frame, CancelToken{});
}

int Mirror(int at, int size) {
    while (at < 0 || at >= size) {
        at = at < 0 ? -at : 2 * (size - 1) - at;
    }
    return at;
}

// By the definition: the network on the mirrored frame, softmax, weighted mean.
std::array<Plane, 3> Reference(const Frame& frame, const TensorArchive& weights, int side) {
    const KpcnInputs inputs = MakeKpcnInputs(frame);
    const int pad = 6, width = frame.width + 2 * pad, height = frame.height + 2 * pad;
    std::vector<Plane> padded;
    for (const Plane& plane : inputs.planes) {
        Plane& to = padded.emplace_back();
        for (int y = -pad; y < frame.height + pad; ++y) {
            for (int x = -pad; x < frame.width + pad; ++x) {
                to.push_back(plane[static_cast<std::size_t>(Mirror(y, frame.height) * frame.width +
                                                            Mirror(x, frame.width))]);
            }
        }
    }
    const GraphSpec graph = {{Convolution("conv1", "input"), Convolution("conv2", "conv1"),
                              Convolution("conv3", "conv2", false)}};
    const auto logits = ReferenceNetwork(graph, weights, padded, width, height, 1);
    std::array<Plane, 3> out;
    for (int y = 0; y < frame.height; ++y) {
        for (int x = 0; x < frame.width; ++x) {
            double sum = 0, color[3] = {};
            for (int k = 0; k < side * side; ++k) {
                const double weight = std::exp(static_cast<double>(logits[static_cast<std::size_t>(
                    k)][static_cast<std::size_t>((y + pad) * width + x + pad)]));
                const int from = Mirror(y + k / side - side / 2, frame.height) * frame.width +
                                 Mirror(x + k % side - side / 2, frame.width);
                sum += weight;
                for (std::size_t c = 0; c < 3; ++c) {
                    color[c] += weight * inputs.color[c][static_cast<std::size_t>(from)];
                }
            }
            const auto i = static_cast<std::size_t>(y * frame.width + x);
            for (std::size_t c = 0; c < 3; ++c) {
                out[c].push_back(static_cast<float>(color[c] / sum * inputs.albedo[c][i]));
            }
        }
    }
    return out;
}

TEST(Kpcn, EqualsItsDefinition) {
    const TensorArchive weights = SomeWeights(8, 7);
    for (const auto& [width, height] : {std::pair{41, 29}, {13, 40}, {7, 7}}) {
        const Frame frame = FrameFromFilm(MakeFilm(Truth{width, height}, 4, 1));
        const auto expected = Reference(frame, weights, 7);
        for (const int tile : {0, 16}) {
            const Result result = Filter(frame, weights, tile);
            for (std::size_t c = 0; c < 3; ++c) {
                for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                    // Logits of some 10 make 1e-5 of float32's 1e-6.
                    ASSERT_NEAR(result.color[c][i], expected[c][i], 1e-4 * (1 + expected[c][i]))
                        << width << "x" << height << ", tile " << tile;
                }
            }
        }
    }
}

TEST(Kpcn, InputsAreThoseOfTheMethod) {
    Frame frame = MakeGaussianFrame({20, 10}, 3);
    frame.count.assign(frame.pixel_count(), 4.0f);
    for (int c = 0; c < 3; ++c) {
        frame.feature[kAlbedoR + c][0] = 0.005f;  // no surface
        frame.feature[kAlbedoR + c][25] = c == 0 ? 0.5f : 0.0f;
        frame.color[c][25] = 2.0f;
        frame.variance[c][25] = 0.03f;
        frame.feature_variance[kNormalX + c][25] = 0.12f;
    }
    const KpcnInputs inputs = MakeKpcnInputs(frame);
    ASSERT_EQ(inputs.planes.size(), static_cast<std::size_t>(kKpcnInputs));
    EXPECT_EQ(inputs.albedo[1][0], 1);
    EXPECT_FLOAT_EQ(inputs.albedo[0][25], 0.50316f);
    EXPECT_FLOAT_EQ(inputs.albedo[1][25], 0.00316f);
    EXPECT_FLOAT_EQ(inputs.color[0][25], 2 / 0.50316f);
    EXPECT_FLOAT_EQ(inputs.planes[0][25], std::log(1 + 2 / 0.50316f));
    const float red = 0.50316f + 2, green = 0.00316f + 2;  // albedo (1 + colour / albedo)
    EXPECT_FLOAT_EQ(inputs.planes[3][25], 0.01f * (1 / (red * red) + 2 / (green * green)));
    EXPECT_FLOAT_EQ(inputs.planes[4][25], inputs.planes[0][25] - inputs.planes[0][24]);
    EXPECT_FLOAT_EQ(inputs.planes[8][25], inputs.planes[1][25] - inputs.planes[1][5]);
    EXPECT_EQ(inputs.planes[4][20], 0);
    EXPECT_EQ(inputs.planes[7][5], 0);
    EXPECT_EQ(inputs.planes[11][25], frame.feature[kNormalY][25]);
    EXPECT_FLOAT_EQ(inputs.planes[13][25], 0.03f);  // of the mean of four
    EXPECT_FLOAT_EQ(*std::ranges::max_element(inputs.planes[20]), 1);
    EXPECT_EQ(inputs.planes[24][25], 0.5f);
}

TEST(Kpcn, AveragesNeighbours) {
    const TensorArchive weights = SomeWeights(8, 7);
    // Softmax makes a mean: constants stay, and nothing is brighter or darker than its window.
    const Frame constant =
        FrameFromFilm(MakeFilm(Truth{70, 33}, 4, 1, [](int, int, int, PixelSample* sample) {
            sample->radiance = {0.25f, 3, 700};
            for (int c = 0; c < 3; ++c) {
                sample->features[static_cast<std::size_t>(kAlbedoR + c)] = 0.5f;
            }
        }));
    const Result result = Filter(constant, weights, 0);
    for (std::size_t i = 0; i < constant.pixel_count(); ++i) {
        ASSERT_NEAR(result.color[0][i], 0.25, 0.25e-5);
        ASSERT_NEAR(result.color[2][i], 700, 700e-5);
    }
}

TEST(Kpcn, TakesAnySizeAnyFeaturesAndWildSamples) {
    const TensorArchive weights = SomeWeights(8, 5);
    for (const auto& [width, height] : {std::pair{0, 0}, {1, 1}, {3, 7}, {1, 60}, {65, 33}}) {
        for (const float value : {1.0f, NAN, 1e14f}) {
            Frame frame = FrameFromFilm(MakeFilm(Truth{width, height}, 4, 2,
                                                 [&](int x, int y, int index, PixelSample* sample) {
                                                     if (x == 0 && y == 0 && index == 1) {
                                                         sample->radiance = {value, value, value};
                                                     }
                                                 }));
            for (const bool blind : {false, true}) {
                for (int f = 0; f < kFeatureCount && blind; ++f) {
                    frame.feature[f].clear();
                    frame.feature_variance[f].clear();
                }
                const Result result = Filter(frame, weights, 0);
                for (const Plane& plane : result.color) {
                    ASSERT_EQ(plane.size(), frame.pixel_count());
                    for (const float v : plane) {
                        ASSERT_TRUE(std::isfinite(v) && v >= 0);
                    }
                }
            }
        }
    }
}

TEST(Kpcn, BitsDoNotDependOnThreads) {
    const TensorArchive weights = SomeWeights(16, 9);
    const Frame frame = FrameFromFilm(MakeFilm(Truth{90, 70}, 4, 3));
    const int threads = ThreadCount();
    SetThreadCount(1);
    const Result one = Filter(frame, weights, 32);
    SetThreadCount(3);
    const Result three = Filter(frame, weights, 32);
    SetThreadCount(threads);
    for (int c = 0; c < 3; ++c) {
        EXPECT_TRUE(one.color[c] == three.color[c]);
    }
}

TEST(Kpcn, WithoutWeightsSaysWhatItNeeds) {
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("kpcn"); }), HasSubstr("weights=NAME"));
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("kpcn:weights=no-such"); }),
                HasSubstr("no-such.tza"));
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("kpcn:weights=../x"); }),
                HasSubstr("without folder"));
    TensorArchive even = SomeWeights(8, 4);
    EXPECT_THAT(MessageOf([&] { (void)MakeKpcn(even, "some", 0); }), HasSubstr("16 outputs"));
    EXPECT_THAT(MessageOf([&] { (void)MakeKpcn({}, "some", 0); }), HasSubstr("some"));
}

}  // namespace
}  // namespace relume::denoise
