#include "worker/render/light/alias_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace relume::render {
namespace {

TEST(AliasTable, FrequenciesAreTheProbabilities) {
    const std::vector<double> weights{1, 0, 3, 0.5, 5.5};
    const AliasTable table(weights);
    std::vector<int> counts(weights.size());
    constexpr int kSteps = 1 << 20;
    for (int i = 0; i < kSteps; ++i) {  // all inputs, evenly
        ++counts[table.Sample(static_cast<std::uint32_t>(i) << 12)];
    }
    for (std::size_t i = 0; i < weights.size(); ++i) {
        EXPECT_NEAR(table.Probability(i), weights[i] / 10, 1e-6);
        EXPECT_NEAR(counts[i], kSteps * weights[i] / 10, 4) << i;
    }
}

TEST(AliasTable, ManyEntriesStayExact) {
    // A million entries of two kinds: the share of one kind must not suffer from the bits of the
    // input running out.
    std::vector<double> weights(1000000);
    for (std::size_t i = 0; i < weights.size(); ++i) {
        weights[i] = i % 2 == 0 ? 0.3 : 0.7;
    }
    const AliasTable table(weights);
    constexpr std::uint32_t kSteps = 4000000;
    std::uint32_t odd = 0;
    for (std::uint32_t i = 0; i < kSteps; ++i) {
        odd += table.Sample(i * 2654435761u) % 2;  // a permutation of all inputs, cut short
    }
    // 4 standard errors of independent draws.
    EXPECT_NEAR(static_cast<double>(odd) / kSteps, 0.7, 4 * std::sqrt(0.21 / kSteps));
}

TEST(AliasTable, NothingToDrawIsEmpty) {
    EXPECT_TRUE(AliasTable(std::vector<double>{}).empty());
    EXPECT_TRUE(AliasTable(std::vector<double>{0, 0}).empty());
    EXPECT_FALSE(AliasTable(std::vector<double>{0, 1e-300}).empty());
}

}  // namespace
}  // namespace relume::render
