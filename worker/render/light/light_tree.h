#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "worker/render/light/light_bounds.h"

namespace relume::render {

// Chooses among lights by what each of them may give to a receiver: down a tree of groups of eight,
// at each node to one of them in proportion to their bounds (Conty Estevez and Kulla 2018, but
// wider: docs/adr, light tree). Up to eight lights are one node. Immutable, thread-safe; no
// allocation after it is built, and no libm, so that a choice has the same bits everywhere.
class LightTree {
  public:
    LightTree() = default;
    // Lights of strength 0 are never chosen.
    explicit LightTree(std::span<const LightExtent> lights);

    bool empty() const { return size_ == 0; }
    // Lights that can be chosen.
    std::size_t size() const { return size_; }

    // The light chosen by u in [0, 1), with its probability; false: none gives anything.
    bool Sample(const LightReceiver& at, double u, std::uint32_t* light, float* probability) const;
    // Of `light` to be chosen.
    float Probability(const LightReceiver& at, std::uint32_t light) const;

  private:
    struct Node {
        LightGroup group;
        // Of each in the group: a light plus kLight, or a node.
        std::array<std::uint32_t, LightGroup::kSize> children{};
    };
    static constexpr std::uint32_t kLight = 0x80000000;

    void Build(std::span<const LightExtent> lights, std::uint32_t node,
               std::span<std::uint32_t> group, int depth, std::uint64_t turns);

    std::size_t size_ = 0;
    std::vector<Node> nodes_;
    // By light: the children on the way down to it, three bits each, and a 1 above them; 0: it is
    // not in the tree.
    std::vector<std::uint64_t> turns_;
};

}  // namespace relume::render
