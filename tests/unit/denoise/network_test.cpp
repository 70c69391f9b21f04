#include "server/denoise/network/network.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "server/denoise/oidn_networks.h"
#include "tests/unit/denoise/reference_network.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::vector<Plane> RandomPlanes(int channels, int width, int height, unsigned seed) {
    std::mt19937 rng(seed);
    std::vector<Plane> planes(static_cast<std::size_t>(channels));
    for (Plane& plane : planes) {
        for (int i = 0; i < width * height; ++i) {
            plane.push_back(static_cast<float>(Normal(&rng)));
        }
    }
    return planes;
}

std::vector<Plane> RunOn(const Network& network, const std::vector<Plane>& inputs, int width,
                         int height, std::size_t most_bytes = Network::kMostBytes) {
    std::vector<const float*> pointers;
    for (const Plane& plane : inputs) {
        pointers.push_back(plane.data());
    }
    return network.Run(pointers, width, height, CancelToken{}, most_bytes);
}

// The largest difference over the largest value.
double RelativeDifference(const std::vector<Plane>& a, const std::vector<Plane>& b) {
    EXPECT_EQ(a.size(), b.size());
    double difference = 0, largest = 0;
    for (std::size_t c = 0; c < a.size(); ++c) {
        EXPECT_EQ(a[c].size(), b[c].size());
        for (std::size_t i = 0; i < a[c].size(); ++i) {
            difference = std::max(difference, std::abs(static_cast<double>(a[c][i]) - b[c][i]));
            largest = std::max(largest, std::abs(static_cast<double>(b[c][i])));
        }
    }
    EXPECT_GT(largest, 0.01);
    return difference / largest;
}

struct Case {
    const char* name;
    GraphSpec graph;
    TensorArchive weights;
};

TensorArchive Weights(
    std::initializer_list<std::tuple<const char*, int, int, int>> name_outputs_inputs_kernel) {
    TensorArchive archive;
    unsigned seed = 1;
    for (const auto& [name, outputs, inputs, kernel] : name_outputs_inputs_kernel) {
        AddWeights(name, outputs, inputs, kernel, seed++, &archive);
    }
    return archive;
}

TensorArchive OidnWeights() {
    return Weights({{"enc_conv0", 32, 9, 3},
                    {"enc_conv1", 32, 32, 3},
                    {"enc_conv2", 48, 32, 3},
                    {"enc_conv3", 64, 48, 3},
                    {"enc_conv4", 80, 64, 3},
                    {"enc_conv5a", 96, 80, 3},
                    {"enc_conv5b", 96, 96, 3},
                    {"dec_conv4a", 112, 160, 3},
                    {"dec_conv4b", 112, 112, 3},
                    {"dec_conv3a", 96, 160, 3},
                    {"dec_conv3b", 96, 96, 3},
                    {"dec_conv2a", 64, 128, 3},
                    {"dec_conv2b", 64, 64, 3},
                    {"dec_conv1a", 64, 73, 3},
                    {"dec_conv1b", 32, 64, 3},
                    {"dec_conv0", 3, 32, 3}});
}

std::vector<Case> Cases() {
    const std::string in = "input";
    return {
        {"one3x3", {{Convolution("a", in, false)}}, Weights({{"a", 5, 3, 3}})},
        {"one3x3Relu", {{Convolution("a", in)}}, Weights({{"a", 33, 17, 3}})},
        {"one5x5", {{Convolution("a", in)}}, Weights({{"a", 100, 34, 5}})},
        {"one1x1", {{Convolution("a", in, false)}}, Weights({{"a", 2, 3, 1}})},
        {"kpcnLite",
         {{Convolution("a", in), Convolution("b", "a"), Convolution("c", "b", false)}},
         Weights({{"a", 32, 34, 5}, {"b", 32, 32, 5}, {"c", 169, 32, 5}})},
        {"poolAndUpsample",
         {{Convolution("a", in), Pool("p", "a"), Upsample("u", "p"), Convolution("b", "u", false)}},
         Weights({{"a", 4, 3, 3}, {"b", 2, 4, 3}})},
        {"poolOfWhatIsReadAgain",
         {{Convolution("a", in), Pool("p", "a"), Upsample("u", "p"), Concatenate("c", {"u", "a"}),
           Convolution("b", "c", false)}},
         Weights({{"a", 4, 3, 3}, {"b", 2, 8, 3}})},
        {"poolOfInput",
         {{Convolution("a", in), Pool("p", in), Upsample("u", "p"),
           Concatenate("c", {"a", "u", in}), Convolution("b", "c", false)}},
         Weights({{"a", 4, 3, 3}, {"b", 2, 10, 3}})},
        {"poolOfConcatenation",
         {{Convolution("a", in), Concatenate("c", {"a", in}), Pool("p", "c"), Upsample("u", "p"),
           Convolution("b", "u", false)}},
         Weights({{"a", 4, 3, 3}, {"b", 2, 7, 5}})},
        {"upsampleTwice",
         {{Convolution("a", in), Pool("p", "a"), Pool("q", "p"), Convolution("r", "q"),
           Concatenate("qr", {"q", "r"}), Upsample("u", "qr"), Concatenate("pu", {"p", "u"}),
           Upsample("v", "pu"), Convolution("b", "v", false)}},
         Weights({{"a", 4, 3, 3}, {"r", 3, 4, 3}, {"b", 2, 11, 3}})},
        {"oidn", OidnGraph(), OidnWeights()},
    };
}

class Layers : public testing::TestWithParam<Case> {};

TEST_P(Layers, EqualTheirDefinition) {
    const auto& [name, graph, weights] = GetParam();
    const Network network(graph, weights, "test");
    for (const auto& [width, height] : {std::pair{48, 32}, {37, 51}, {1, 1}, {3, 7}, {1, 70}}) {
        const auto inputs = RandomPlanes(network.input_channels(), width, height, 7);
        EXPECT_LT(RelativeDifference(
                      RunOn(network, inputs, width, height),
                      ReferenceNetwork(graph, weights, inputs, width, height, network.alignment())),
                  1e-5)
            << width << "x" << height;
    }
}

TEST_P(Layers, ThreadsLeaveTheBitsAloneAndTilesTheValues) {
    const auto& [name, graph, weights] = GetParam();
    const Network network(graph, weights, "test");
    const int width = 409, height = 283;
    const auto inputs = RandomPlanes(network.input_channels(), width, height, 8);
    const auto whole = RunOn(network, inputs, width, height);
    const int threads = ThreadCount();
    for (const int count : {1, 3}) {
        SetThreadCount(count);
        EXPECT_TRUE(RunOn(network, inputs, width, height) == whole) << count;
    }
    SetThreadCount(threads);
    const bool deep = network.halo() > 50;
    for (const int most_kilobytes : {deep ? 24000 : 1200, deep ? 6000 : 200}) {
        const auto bytes = static_cast<std::size_t>(most_kilobytes) * 1000;
        EXPECT_LT(RelativeDifference(RunOn(network, inputs, width, height, bytes), whole), 1e-5)
            << most_kilobytes;
    }
}

// But for the rounding of Winograd's sums.
TEST_P(Layers, AWildPixelStaysInItsHalo) {
    const auto& [name, graph, weights] = GetParam();
    const Network network(graph, weights, "test");
    const int width = 320, height = 40;
    auto inputs = RandomPlanes(network.input_channels(), width, height, 9);
    const auto before = RunOn(network, inputs, width, height);
    const int wild = 171, at = 20 * width + wild;
    inputs[0][static_cast<std::size_t>(at)] = 1e4f;
    const auto after = RunOn(network, inputs, width, height);
    float inside = 0, outside = 0;
    for (std::size_t c = 0; c < before.size(); ++c) {
        for (int i = 0; i < width * height; ++i) {
            float& largest = std::abs(i % width - wild) <= network.halo() ? inside : outside;
            const auto k = static_cast<std::size_t>(i);
            largest = std::max(largest, std::abs(before[c][k] - after[c][k]));
        }
    }
    EXPECT_GT(inside, 10);
    EXPECT_LT(outside, 1e-6f * inside);
}

INSTANTIATE_TEST_SUITE_P(Networks, Layers, testing::ValuesIn(Cases()),
                         [](const auto& param) { return std::string(param.param.name); });

TEST(Network, SaysWhatItIs) {
    const Network network(OidnGraph(), OidnWeights(), "test");
    EXPECT_EQ(network.input_channels(), 9);
    EXPECT_EQ(network.output_channels(), 3);
    EXPECT_EQ(network.alignment(), 16);
    // 5, 3, 3, 3 and 2 convolutions at scales 1 to 16, and the other pixel of four pairs.
    EXPECT_EQ(network.halo(), 5 + 3 * 2 + 3 * 4 + 3 * 8 + 2 * 16 + 1 + 2 + 4 + 8);
}

TEST(Network, NothingInNothingOut) {
    const Network network(OidnGraph(), OidnWeights(), "test");
    const auto outputs = RunOn(network, std::vector<Plane>(9), 0, 0);
    ASSERT_EQ(outputs.size(), 3u);
    EXPECT_TRUE(outputs[0].empty());
}

TEST(Network, EndsWhenCancelled) {
    const Network network(OidnGraph(), OidnWeights(), "test");
    const auto inputs = RandomPlanes(9, 64, 64, 1);
    std::vector<const float*> pointers;
    for (const Plane& plane : inputs) {
        pointers.push_back(plane.data());
    }
    CancelToken cancel;
    cancel.Cancel();
    EXPECT_THAT(MessageOf([&] { (void)network.Run(pointers, 64, 64, cancel); }),
                HasSubstr("cancelled"));
}

TEST(Network, WhatDoesNotFitIsRefusedByName) {
    const auto message = [](const GraphSpec& graph, const TensorArchive& weights) {
        return MessageOf([&] { Network(graph, weights, "some.tza"); });
    };
    const TensorArchive weights = Weights({{"a", 4, 3, 3}, {"b", 2, 4, 3}, {"even", 2, 4, 2}});
    const std::string in = "input";
    EXPECT_THAT(message({{Convolution("a", in), Convolution("c", "a")}}, weights),
                AllOf(HasSubstr("some.tza"), HasSubstr("'c'"), HasSubstr("c.weight")));
    EXPECT_THAT(message({{Convolution("a", in), Convolution("b", "input")}}, weights),
                AllOf(HasSubstr("'b'"), HasSubstr("4 channels"), HasSubstr("reads 3")));
    EXPECT_THAT(message({{Convolution("a", in), Convolution("b", "x")}}, weights),
                AllOf(HasSubstr("'b'"), HasSubstr("'x'")));
    EXPECT_THAT(message({{Convolution("a", in), Convolution("even", "a")}}, weights),
                HasSubstr("2x2"));
    EXPECT_THAT(
        message({{Convolution("a", in), Upsample("u", "a"), Convolution("b", "u")}}, weights),
        HasSubstr("larger than the input"));
    EXPECT_THAT(message({{Convolution("a", in), Pool("p", "a"), Convolution("b", "p")}}, weights),
                HasSubstr("at the input's size"));
    EXPECT_THAT(message({{Convolution("a", in), Pool("p", "a"), Concatenate("c", {"p", "a"}),
                          Convolution("b", "c")}},
                        weights),
                HasSubstr("different sizes"));
    EXPECT_THAT(message({{Convolution("a", in), Pool("p", "a")}}, weights),
                HasSubstr("is the last"));
    EXPECT_THAT(message({{Pool("p", in), Convolution("b", "p")}}, weights),
                HasSubstr("is the first"));
    EXPECT_THAT(message({{Convolution("a", in), Convolution("a", in)}}, weights),
                HasSubstr("twice"));
    EXPECT_THAT(
        message({{Convolution("a", in), Concatenate("c", {"a"}), Convolution("b", "c")}}, weights),
        HasSubstr("number of inputs"));
    EXPECT_THAT(message({}, weights), HasSubstr("is the last"));
    TensorArchive short_bias = weights;
    short_bias["b.bias"] = {{1}, {0}};
    EXPECT_THAT(message({{Convolution("a", in), Convolution("b", "a")}}, short_bias),
                AllOf(HasSubstr("2 outputs"), HasSubstr("bias of 1")));
}

}  // namespace
}  // namespace relume::denoise
