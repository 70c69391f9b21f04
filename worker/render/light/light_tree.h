#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "worker/render/light/light_bounds.h"

namespace relume::render {

// Chooses among lights by what each of them may give to a receiver: down a binary tree of groups,
// at each node to either side in proportion to the bounds of both (Conty Estevez and Kulla 2018),
// and in a leaf among a few lights by their own. Immutable, thread-safe; no allocation after it is
// built, and no libm, so that a choice has the same bits everywhere.
class LightTree {
  public:
    LightTree() = default;
    // Lights of strength 0 are never chosen.
    explicit LightTree(std::span<const LightExtent> lights);

    bool empty() const { return order_.empty(); }
    // Lights that can be chosen.
    std::size_t size() const { return order_.size(); }

    // The light chosen by u in [0, 1), with its probability; false: none gives anything.
    bool Sample(const LightReceiver& at, double u, std::uint32_t* light, float* probability) const;
    // Of `light` to be chosen.
    float Probability(const LightReceiver& at, std::uint32_t light) const;

  private:
    static constexpr std::size_t kLeaf = 4;  // lights at most; measured (docs/adr, light tree)

    struct alignas(64) Node {
        LightBounds bounds;
        std::uint32_t first = 0;  // inner: the left child, the right one follows; leaf: in order_
        std::uint32_t count = 0;  // lights of a leaf; 0: inner
    };
    static_assert(sizeof(Node) == 64);
    // Where a light is: its place in order_, and the turns on the way down to it (bit 0 first).
    struct Place {
        std::uint64_t turns = 0;
        std::uint32_t index = kNowhere;
    };
    static constexpr std::uint32_t kNowhere = 0xffffffff;

    void Build(std::span<const LightExtent> lights, std::uint32_t node, std::uint32_t begin,
               std::uint32_t end, int depth, std::uint64_t turns);
    // Probability of the left child; negative if neither gives anything.
    float LeftShare(const LightReceiver& at, const Node& parent) const;

    std::vector<Node> nodes_;
    std::vector<std::uint32_t> order_;   // lights, leaf after leaf
    std::vector<LightBounds> in_order_;  // theirs
    std::vector<Place> places_;          // by light
};

}  // namespace relume::render
