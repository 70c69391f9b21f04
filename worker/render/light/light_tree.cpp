#include "worker/render/light/light_tree.h"

#include <algorithm>
#include <array>

#include "worker/render/sampler/warp.h"

namespace relume::render {
namespace {

constexpr int kBins = 12;
// From here down groups are halved, so that the turns fit into 64 bits (20 levels).
constexpr int kDeepest = 8;
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

// Cuts a group in two, anyhow if need be.
std::size_t CutGroup(std::span<const LightExtent> lights, std::span<std::uint32_t> group,
                     bool halve) {
    const Cut cut = halve ? Cut{} : FindCut(lights, group);
    if (cut.axis < 0) {
        return group.size() / 2;
    }
    const auto right = std::stable_partition(group.begin(), group.end(), [&](std::uint32_t i) {
        return cut.BinOf(lights[i]) < cut.bin;
    });
    return static_cast<std::size_t>(right - group.begin());
}

LightExtent UniteAll(std::span<const LightExtent> lights, std::span<const std::uint32_t> group) {
    LightExtent all;
    for (const std::uint32_t i : group) {
        all = Unite(all, lights[i]);
    }
    return all;
}

struct Part {
    std::span<std::uint32_t> group;
    LightExtent extent;
    float cost = 0;
};

// Cuts a group into up to eight, that of the highest cost first.
std::vector<Part> CutIntoParts(std::span<const LightExtent> lights, std::span<std::uint32_t> group,
                               bool halve) {
    const auto make = [&](std::span<std::uint32_t> part) {
        const LightExtent extent = UniteAll(lights, part);
        return Part{part, extent, part.size() > 1 ? Cost(extent) : -1};
    };
    std::vector<Part> parts = {make(group)};
    while (parts.size() < LightGroup::kSize) {
        const auto worst =
            std::max_element(parts.begin(), parts.end(), [&](const Part& a, const Part& b) {
                return halve ? a.group.size() < b.group.size() : a.cost < b.cost;
            });
        const std::span<std::uint32_t> whole = worst->group;
        if (whole.size() < 2) {
            break;
        }
        const std::size_t left = CutGroup(lights, whole, halve);
        *worst = make(whole.first(left));
        parts.push_back(make(whole.subspan(left)));
    }
    return parts;
}

}  // namespace

LightTree::LightTree(std::span<const LightExtent> lights) : turns_(lights.size()) {
    std::vector<std::uint32_t> order;
    for (std::uint32_t i = 0; i < lights.size(); ++i) {
        if (lights[i].strength > 0) {
            order.push_back(i);
        }
    }
    size_ = order.size();
    if (!order.empty()) {
        nodes_.emplace_back();
        Build(lights, 0, order, 0, 0);
    }
}

void LightTree::Build(std::span<const LightExtent> lights, std::uint32_t node,
                      std::span<std::uint32_t> group, int depth, std::uint64_t turns) {
    const std::vector<Part> parts = CutIntoParts(lights, group, depth >= kDeepest);
    for (std::size_t i = 0; i < parts.size(); ++i) {
        nodes_[node].group.Set(i, parts[i].extent);
        const std::uint64_t way = turns | static_cast<std::uint64_t>(i) << (3 * depth);
        if (parts[i].group.size() == 1) {
            const std::uint32_t light = parts[i].group.front();
            nodes_[node].children[i] = light | kLight;
            turns_[light] = way | std::uint64_t{1} << (3 * (depth + 1));
            continue;
        }
        const auto child = static_cast<std::uint32_t>(nodes_.size());
        nodes_[node].children[i] = child;
        nodes_.emplace_back();
        Build(lights, child, parts[i].group, depth + 1, way);
    }
}

bool LightTree::Sample(const LightReceiver& at, double u, std::uint32_t* light,
                       float* probability) const {
    std::uint32_t child = 0;
    float p = 1;
    if (size_ == 1) {
        *light = nodes_[0].children[0] & ~kLight;
        *probability = 1;
        return true;
    }
    do {
        const Node& node = nodes_[child];
        const Float8 importance = node.group.Importance(at);
        float sum = 0;
        for (std::size_t i = 0; i < LightGroup::kSize; ++i) {
            sum += importance[i];
        }
        if (!(sum > 0)) {
            return false;
        }
        double left = u * sum;
        std::size_t chosen = 0;
        for (std::size_t i = 0; i < LightGroup::kSize; ++i) {
            if (importance[i] > 0) {
                chosen = i;
                if (left < importance[i]) {
                    break;
                }
                left -= importance[i];
            }
        }
        u = std::min(left / importance[chosen], kBelowOne);
        p *= importance[chosen] / sum;
        child = node.children[chosen];
    } while ((child & kLight) == 0);
    *light = child & ~kLight;
    *probability = p;
    return p > 0;
}

float LightTree::Probability(const LightReceiver& at, std::uint32_t light) const {
    std::uint64_t turns = turns_[light];
    if (turns == 0 || size_ == 1) {
        return turns == 0 ? 0 : 1;
    }
    float p = 1;
    for (std::uint32_t child = 0; turns > 1; turns >>= 3) {
        const Node& node = nodes_[child];
        const Float8 importance = node.group.Importance(at);
        float sum = 0;
        for (std::size_t i = 0; i < LightGroup::kSize; ++i) {
            sum += importance[i];
        }
        const float own = importance[turns & 7];
        if (!(own > 0)) {
            return 0;
        }
        p *= own / sum;
        child = node.children[turns & 7];
    }
    return p;
}

}  // namespace relume::render
