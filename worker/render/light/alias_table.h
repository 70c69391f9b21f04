#pragma once

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

    // 32 uniform bits: a float's 24 would leave too few for the threshold among many entries.
    std::size_t Sample(std::uint32_t bits) const {
        const std::uint64_t x = static_cast<std::uint64_t>(bits) * entries_.size();
        const Entry& entry = entries_[x >> 32];
        const float rest = static_cast<float>(static_cast<std::uint32_t>(x) >> 8) * 0x1p-24f;
        return rest < entry.threshold ? static_cast<std::size_t>(x >> 32) : entry.alias;
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
