#include "server/denoise/network/winograd.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "server/denoise/network/convolution.h"
#include "server/denoise/network/graph.h"
#include "tests/unit/denoise/reference_network.h"

namespace relume::denoise {
namespace {

std::vector<float> RandomFloats(int count, std::mt19937* rng) {
    std::uniform_real_distribution<float> uniform(-1, 1);
    std::vector<float> values;
    for (int i = 0; i < count; ++i) {
        values.push_back(uniform(*rng));
    }
    return values;
}

// A tile of 6x6 pixels for each of `count`, whose 4x4 results are compared with their definition.
void ExpectTilesEqualDefinition(const WinogradKernels& kernels, int inputs, int outputs,
                                int count) {
    std::mt19937 rng(3);
    const double tolerance = 1e-5 + 1e-5 * inputs;  // some 1e-5 of the largest results
    const int lanes = kernels.lanes, groups = (inputs + lanes - 1) / lanes;
    const auto weights = RandomFloats(outputs * inputs * 9, &rng);
    const auto bias = RandomFloats(outputs, &rng);
    const WinogradWeights prepared(kernels, weights, bias, inputs);
    const std::ptrdiff_t pitch = groups * lanes, step = count * pitch + lanes;
    const std::ptrdiff_t sums_step = count * prepared.outputs() + lanes;
    std::vector<float> tiles(static_cast<std::size_t>(36 * step));
    std::vector<float> sums(static_cast<std::size_t>(36 * sums_step));
    // Tile, group, row, column, channel.
    const auto pixels = RandomFloats(count * groups * 36 * lanes, &rng);
    const auto pixel = [&](int tile, int channel, int y, int x) {
        return pixels[static_cast<std::size_t>(
            (((tile * groups + channel / lanes) * 6 + y) * 6 + x) * lanes + channel % lanes)];
    };
    const std::ptrdiff_t columns[6] = {0, lanes, 2 * lanes, 3 * lanes, 4 * lanes, 5 * lanes};
    for (int t = 0; t < count; ++t) {
        for (int g = 0; g < groups; ++g) {
            const float* rows[6];
            for (int y = 0; y < 6; ++y) {
                rows[y] = pixels.data() + ((t * groups + g) * 6 + y) * 6 * lanes;
            }
            kernels.transform_input(rows, columns, tiles.data() + t * pitch + g * lanes, step);
        }
    }
    prepared.Multiply(tiles.data(), step, pitch, count, sums.data(), sums_step);
    for (int t = 0; t < count; ++t) {
        for (int o = 0; o < outputs; ++o) {
            std::vector<float> plain(static_cast<std::size_t>(16 * lanes));
            std::vector<float> pooled(static_cast<std::size_t>(4 * lanes));
            const float* from = sums.data() + t * prepared.outputs() + o / lanes * lanes;
            const float* offset = prepared.bias() + o / lanes * lanes;
            kernels.transform_output(from, sums_step, offset, false, false, plain.data(),
                                     4 * lanes);
            kernels.transform_output(from, sums_step, offset, true, true, pooled.data(), 2 * lanes);
            double most[4] = {};
            for (int y = 0; y < 4; ++y) {
                for (int x = 0; x < 4; ++x) {
                    double sum = bias[static_cast<std::size_t>(o)];
                    for (int k = 0; k < inputs; ++k) {
                        for (int i = 0; i < 9; ++i) {
                            sum +=
                                static_cast<double>(
                                    weights[static_cast<std::size_t>((o * inputs + k) * 9 + i)]) *
                                pixel(t, k, y + i / 3, x + i % 3);
                        }
                    }
                    EXPECT_NEAR(plain[static_cast<std::size_t>((4 * y + x) * lanes + o % lanes)],
                                sum, tolerance)
                        << t << " " << o;
                    double& four = most[y / 2 * 2 + x / 2];
                    four = std::max(four, sum);
                }
            }
            for (int i = 0; i < 4; ++i) {
                EXPECT_NEAR(pooled[static_cast<std::size_t>(i * lanes + o % lanes)], most[i],
                            tolerance);
            }
        }
    }
}

TEST(Winograd, TilesEqualTheirDefinitionInAllInstructions) {
    bool any = false;
    for (const int lanes : {8, 16}) {
        const WinogradKernels* kernels = FindWinogradKernels(lanes);
        if (kernels == nullptr) {
            continue;
        }
        any = true;
        ASSERT_EQ(kernels->lanes, lanes);
        // Panels of each width, and counts of tiles that leave each remainder.
        for (const int outputs : {3, 16, 32, 48, 64, 112}) {
            for (const int count : {1, 5, 23, 24}) {
                ExpectTilesEqualDefinition(*kernels, outputs / 3 + 2, outputs, count);
            }
        }
    }
    if (!any) {
        GTEST_SKIP() << "this processor has no instructions that it is written for";
    }
}

TEST(PlanMemory, WhatOneStepHandsToTheNextIsNotKeptWhole) {
    if (FindWinogradKernels(VectorLanes()) == nullptr) {
        GTEST_SKIP() << "steps are run one after another on this processor";
    }
    TensorArchive weights;
    unsigned seed = 1;
    for (const char* name : {"a", "b", "c"}) {
        AddWeights(name, 4, 4, 3, seed++, &weights);
    }
    const Graph graph = LowerGraph(
        {{Convolution("a", "input"), Convolution("b", "a"), Convolution("c", "b", false)}}, weights,
        "test");
    const PlanMemory memory = LayOut(graph, 1024, 1024);
    ASSERT_EQ(memory.chains.size(), 1u);
    EXPECT_EQ(memory.rows[0], 1024);
    for (const int tensor : {1, 2}) {
        EXPECT_LT(memory.rows[static_cast<std::size_t>(tensor)], 100);
        EXPECT_NE(memory.buffer[0], memory.buffer[static_cast<std::size_t>(tensor)]);
    }
    EXPECT_NE(memory.buffer[1], memory.buffer[2]);
}

TEST(PlanMemory, WhatIsGivenBackIsLentAgain) {
    constexpr std::size_t kFloats = 5'000'000;
    PlanBuffer first = BorrowBuffer(kFloats);
    const float* const at = first.get();
    first.reset();
    EXPECT_EQ(BorrowBuffer(kFloats - 1000).get(), at);
    const PlanBuffer one = BorrowBuffer(kFloats), other = BorrowBuffer(kFloats);
    EXPECT_NE(one.get(), other.get());
}

}  // namespace
}  // namespace relume::denoise
