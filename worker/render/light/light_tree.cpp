#include "worker/render/light/light_tree.h"

#include <algorithm>
#include <array>

#include "worker/render/sampler/warp.h"

namespace relume::render {
namespace {

constexpr int kBins = 12;
// From here down groups are halved, so that the turns fit into 64 bits.
constexpr int kDeepest = 30;
constexpr double kBelowOne = 1 - 0x1p-53;

// The measure of a group's directions (Conty Estevez and Kulla 2018, equation 1).
float DirectionMeasure(const LightExtent& e) {
    const auto sincos = [](float angle) { return SinCosTurn(angle * (0.5f * kInvPi)); };
    const float end = std::min(e.spread + e.reach, kPi);
    const SinCos spread = sincos(e.spread);
    const float turned = e.spread - 2 * end;  // in [-2 pi, pi]
    return 2 * kPi * (1 - spread.cos) + 0.5f * kPi *
                                            (2 * end * spread.sin - sincos(std::abs(turned)).cos -
                                             2 * e.spread * spread.sin + spread.cos);
}

// Half the box's surface; a little more, so that lights in a row have some.
float AreaMeasure(const Box3f& box) {
    const Vec3f d = box.upper - box.lower;
    return d.x * d.y + d.y * d.z + d.z * d.x + 0.01f * Length2(d);
}

float Cost(const LightExtent& e) {
    return e.strength > 0 ? e.strength * DirectionMeasure(e) * AreaMeasure(e.box) : 0;
}

// Where to cut a group: along `axis` before bin `bin` of its centres.
struct Cut {
    int axis = -1, bin = 0;
    float lower = 0, scale = 0;

    int BinOf(const LightExtent& e) const {
        return std::clamp(static_cast<int>((e.box.center()[axis] - lower) * scale), 0, kBins - 1);
    }
};

// The surface area orientation heuristic (section 4.4), over bins. No axis: it can't be cut.
Cut FindCut(std::span<const LightExtent> lights, std::span<const std::uint32_t> group) {
    Box3f centers, box;
    for (const std::uint32_t i : group) {
        centers.Add(lights[i].box.center());
        box.Add(lights[i].box.lower);
        box.Add(lights[i].box.upper);
    }
    Cut best;
    float best_cost = std::numeric_limits<float>::infinity();
    const Vec3f size = box.upper - box.lower;
    for (int axis = 0; axis < 3; ++axis) {
        const float width = centers.upper[axis] - centers.lower[axis];
        Cut cut{axis, 0, centers.lower[axis], static_cast<float>(kBins) / width};
        if (!(width > 0) || !std::isfinite(cut.scale)) {
            continue;
        }
        std::array<LightExtent, kBins> bins;
        for (const std::uint32_t i : group) {
            LightExtent& bin = bins[static_cast<std::size_t>(cut.BinOf(lights[i]))];
            bin = Unite(bin, lights[i]);
        }
        std::array<float, kBins> right{};
        LightExtent sum;
        for (int b = kBins - 1; b > 0; --b) {
            sum = Unite(bins[static_cast<std::size_t>(b)], sum);
            right[static_cast<std::size_t>(b)] = sum.strength > 0 ? Cost(sum) : -1;
        }
        sum = {};
        for (cut.bin = 1; cut.bin < kBins; ++cut.bin) {
            const auto b = static_cast<std::size_t>(cut.bin);
            sum = Unite(sum, bins[b - 1]);
            if (!(sum.strength > 0) || right[b] < 0) {
                continue;
            }
            // Thin boxes are kept from being cut along their short sides.
            const float cost = (Cost(sum) + right[b]) * (MaxComponent(size) / size[axis]);
            if (cost < best_cost) {
                best_cost = cost;
                best = cut;
            }
        }
    }
    return best;
}

}  // namespace

LightTree::LightTree(std::span<const LightExtent> lights) : places_(lights.size()) {
    for (std::uint32_t i = 0; i < lights.size(); ++i) {
        if (lights[i].strength > 0) {
            order_.push_back(i);
        }
    }
    if (order_.empty()) {
        return;
    }
    nodes_.emplace_back();
    Build(lights, 0, 0, static_cast<std::uint32_t>(order_.size()), 0, 0);
    in_order_.reserve(order_.size());
    for (std::uint32_t i = 0; i < order_.size(); ++i) {
        in_order_.emplace_back(lights[order_[i]]);
        places_[order_[i]].index = i;
    }
}

void LightTree::Build(std::span<const LightExtent> lights, std::uint32_t node, std::uint32_t begin,
                      std::uint32_t end, int depth, std::uint64_t turns) {
    const std::span<std::uint32_t> group(order_.data() + begin, end - begin);
    LightExtent all;
    for (const std::uint32_t i : group) {
        all = Unite(all, lights[i]);
    }
    nodes_[node].bounds = LightBounds(all);
    if (group.size() <= kLeaf) {
        nodes_[node].first = begin;
        nodes_[node].count = end - begin;
        for (const std::uint32_t i : group) {
            places_[i].turns = turns;
        }
        return;
    }
    std::uint32_t middle = begin + (end - begin) / 2;
    const Cut cut = depth < kDeepest ? FindCut(lights, group) : Cut{};
    if (cut.axis >= 0) {
        const auto right = std::stable_partition(group.begin(), group.end(), [&](std::uint32_t i) {
            return cut.BinOf(lights[i]) < cut.bin;
        });
        middle = begin + static_cast<std::uint32_t>(right - group.begin());
    }
    const auto left = static_cast<std::uint32_t>(nodes_.size());
    nodes_[node].first = left;
    nodes_.resize(nodes_.size() + 2);
    Build(lights, left, begin, middle, depth + 1, turns);
    Build(lights, left + 1, middle, end, depth + 1, turns | std::uint64_t{1} << depth);
}

float LightTree::LeftShare(const LightReceiver& at, const Node& parent) const {
    const float left = nodes_[parent.first].bounds.Importance(at);
    const float right = nodes_[parent.first + 1].bounds.Importance(at);
    const float sum = left + right;
    return sum > 0 ? left / sum : -1;
}

bool LightTree::Sample(const LightReceiver& at, double u, std::uint32_t* light,
                       float* probability) const {
    const Node* node = nodes_.data();
    float p = 1;
    while (node->count == 0) {
        const float left = LeftShare(at, *node);
        if (left < 0) {
            return false;
        }
        if (u < left) {
            u = u / left;
            p *= left;
            node = &nodes_[node->first];
        } else {
            u = (u - left) / (1 - static_cast<double>(left));
            p *= 1 - left;
            node = &nodes_[node->first + 1];
        }
        u = std::min(u, kBelowOne);
    }
    if (node->count == 1) {
        *light = order_[node->first];
        *probability = p;
        return true;
    }
    std::array<float, kLeaf> importance;
    float sum = 0;
    for (std::uint32_t i = 0; i < node->count; ++i) {
        importance[i] = in_order_[node->first + i].Importance(at);
        sum += importance[i];
    }
    if (!(sum > 0)) {
        return false;
    }
    double left = u * sum;
    std::uint32_t chosen = 0;
    for (std::uint32_t i = 0; i < node->count; ++i) {
        if (importance[i] > 0) {
            chosen = i;
            if (left < importance[i]) {
                break;
            }
        }
        left -= importance[i];
    }
    *light = order_[node->first + chosen];
    *probability = p * (importance[chosen] / sum);
    return true;
}

float LightTree::Probability(const LightReceiver& at, std::uint32_t light) const {
    const Place& place = places_[light];
    if (place.index == kNowhere) {
        return 0;
    }
    const Node* node = nodes_.data();
    float p = 1;
    for (std::uint64_t turns = place.turns; node->count == 0; turns >>= 1) {
        const float left = LeftShare(at, *node);
        const bool right = (turns & 1) != 0;
        p *= left < 0 ? 0 : right ? 1 - left : left;
        if (p == 0) {
            return 0;
        }
        node = &nodes_[node->first + (right ? 1 : 0)];
    }
    if (node->count == 1) {
        return p;
    }
    float sum = 0, own = 0;
    for (std::uint32_t i = 0; i < node->count; ++i) {
        const float importance = in_order_[node->first + i].Importance(at);
        sum += importance;
        own = node->first + i == place.index ? importance : own;
    }
    return sum > 0 ? p * (own / sum) : 0;
}

}  // namespace relume::render
