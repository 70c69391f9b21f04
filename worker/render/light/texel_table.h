#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "worker/render/light/sphere_map.h"

namespace relume::render {

// Draws a texel of a map by its weight (a): a block by rows and columns of few enough blocks that
// their sums stay in a processor's second cache, then in steps of 4 x 4 down to the texel, each
// step on one cache line. Both numbers stay stratified, as if whole rows and columns were inverted.
class TexelTable {
  public:
    struct Texel {
        int x = 0, y = 0;
    };

    TexelTable() = default;
    // Some weight is above 0.
    explicit TexelTable(const SphereMap& map);

    // What is left of u is stretched to [0, 1)^2 again.
    Texel Sample(Vec2f* u) const;

  private:
    // Of 4 x 4 parts: running sums along each row.
    struct alignas(64) Block {
        std::array<float, 16> sums{};
    };
    struct Step {
        int width = 0;  // in blocks; row-major
        std::vector<Block> blocks;
    };
    // One row of cumulative probabilities, inverted from a table of first guesses (Chen and Asau
    // 1974).
    struct Row {
        const float* cumulative;     // n + 1
        const std::uint16_t* guess;  // n
        int n;
        // Index and what is left of u.
        int Sample(float* u) const;
    };
    Row RowOf(int y) const;  // y = height_: of the rows' sums

    int width_ = 0, height_ = 0;  // in blocks
    std::vector<float> cumulative_;
    std::vector<std::uint16_t> guess_;
    std::vector<Step> steps_;  // from large to small
};

}  // namespace relume::render
