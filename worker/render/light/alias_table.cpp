#include "worker/render/light/alias_table.h"

#include <algorithm>
#include <numeric>

namespace relume::render {

AliasTable::AliasTable(std::span<const double> weights) {
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    if (!(sum > 0)) {
        return;
    }
    const double n = static_cast<double>(weights.size());
    entries_.resize(weights.size());
    std::vector<double> scaled(weights.size());
    std::vector<std::uint32_t> small, large;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        scaled[i] = weights[i] / sum * n;
        entries_[i] = {1, static_cast<std::uint32_t>(i), static_cast<float>(weights[i] / sum)};
        (scaled[i] < 1 ? small : large).push_back(static_cast<std::uint32_t>(i));
    }
    while (!small.empty() && !large.empty()) {
        const std::uint32_t s = small.back(), l = large.back();
        small.pop_back();
        entries_[s].threshold = static_cast<float>(scaled[s]);
        entries_[s].alias = l;
        scaled[l] -= 1 - scaled[s];
        if (scaled[l] < 1) {
            large.pop_back();
            small.push_back(l);
        }
    }
    // Left over by rounding: full, unless they must never be drawn.
    for (const std::uint32_t s : small) {
        if (weights[s] == 0) {
            const auto largest = std::max_element(weights.begin(), weights.end());
            entries_[s].threshold = 0;
            entries_[s].alias = static_cast<std::uint32_t>(largest - weights.begin());
        }
    }
}

}  // namespace relume::render
