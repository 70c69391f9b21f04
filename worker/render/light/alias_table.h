#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace relume::render {

// Draws an index with probability proportional to its weight in constant time (Walker 1974, Vose
// 1991).
class AliasTable {
  public:
    AliasTable() = default;
    // Weights are finite and not negative; if all are 0, the table is empty.
    explicit AliasTable(std::span<const double> weights);

    bool empty() const { return entries_.empty(); }
    std::size_t size() const { return entries_.size(); }
    float Probability(std::size_t i) const { return entries_[i].probability; }

    std::size_t Sample(float u) const {
        const float x = u * static_cast<float>(entries_.size());
        const std::size_t i = std::min(static_cast<std::size_t>(x), entries_.size() - 1);
        return x - static_cast<float>(i) < entries_[i].threshold ? i : entries_[i].alias;
    }

  private:
    struct Entry {
        float threshold;
        std::uint32_t alias;
        float probability;
    };
    std::vector<Entry> entries_;
};

}  // namespace relume::render
