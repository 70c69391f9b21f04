// Body of the kernels, included by one source per instruction set with RELUME_LANES (floats a
// vector) defined.
#include "server/denoise/lanes_impl.h"
#include "server/denoise/rd_kernels.h"

namespace relume::denoise {
namespace {

static_assert(kNlmLanes % RELUME_LANES == 0);

constexpr float kLargestExponent = 40;
constexpr float kTrickBelow = 25;  // distance

// Mean of one or three quotients, with one division. Features are about 1 and denominators lie
// between epsilon and 1e4, so that the product of three is in range.
inline Floats MeanQuotient(const Floats (&above)[3], const Floats (&below)[3], int size) {
    if (size == 1) {
        return above[0] / below[0];
    }
    const Floats ab = below[0] * below[1];
    return ((above[0] * below[1] + above[1] * below[0]) * below[2] + above[2] * ab) /
           (ab * below[2] * 3.0f);
}

// The channels of one group at a pixel, its neighbours and the mean of these.
struct Group {
    Floats above[kNlmDirections][3];  // squared difference less noise
    Floats spread[3], next_spread[3], previous_spread[3];
};

inline Group LoadGroup(const RdFeatures& features, int first, int size, std::ptrdiff_t at) {
    const std::ptrdiff_t next = at + features.shift, previous = at - features.shift;
    Group group;
    for (int k = 0; k < size; ++k) {
        const int c = first + k;
        const Floats f = Load(features.value[c] + at), v = Load(features.variance[c] + at);
        const auto above = [f, v](Floats other, Floats variance) {
            const Floats difference = f - other;
            return difference * difference - (v + Min(v, variance));
        };
        const Floats f1 = Load(features.value[c] + next), v1 = Load(features.variance[c] + next);
        const Floats f2 = Load(features.value[c] + previous);
        const Floats v2 = Load(features.variance[c] + previous);
        group.above[kForward][k] = above(f1, v1);
        group.above[kBackward][k] = above(f2, v2);
        group.above[kBetween][k] = above((f1 + f2) * 0.5f, (v1 + v2) * 0.25f);
        group.spread[k] = Load(features.spread[c] + at);
        group.next_spread[k] = Load(features.spread[c] + next);
        group.previous_spread[k] = Load(features.spread[c] + previous);
    }
    return group;
}

void Features(const RdFeatures& features, int width, int height) {
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; x += RELUME_LANES) {
            Floats largest[kRdFloors][kNlmDirections]{};
            for (int g = 0, first = 0; g < features.groups; first += features.size[g], ++g) {
                const int size = features.size[g];
                const Group group = LoadGroup(features, first, size, y * features.stride + x);
                for (int t = 0; t < features.floors; ++t) {
                    const Floats tau = Fill(features.tau[t]);
                    Floats below[kNlmDirections][3];
                    for (int k = 0; k < size; ++k) {
                        const Floats d = Max(group.spread[k], tau);
                        const Floats d1 = Max(group.next_spread[k], tau);
                        const Floats d2 = Max(group.previous_spread[k], tau);
                        const auto denominator = [&](Floats sum) {
                            return sum * features.k_squared + features.epsilon;
                        };
                        below[kForward][k] = denominator(d + d1);
                        below[kBackward][k] = denominator(d + d2);
                        below[kBetween][k] = denominator(d + (d1 + d2) * 0.25f);
                    }
                    for (int to = 0; to < kNlmDirections; ++to) {
                        largest[t][to] =
                            Max(MeanQuotient(group.above[to], below[to], size), largest[t][to]);
                    }
                }
            }
            for (int t = 0; t < features.floors; ++t) {
                for (int to = 0; to < kNlmDirections; ++to) {
                    Store(features.distance[t][to] + y * features.distance_stride + x,
                          largest[t][to]);
                }
            }
        }
    }
}

struct WeightPair {
    Floats forward, backward;
};

// Weights of distances that are at least 0. Where a neighbour lies outside, its distance keeps the
// trick off.
inline WeightPair WeightsOf(const Floats (&distance)[kNlmDirections]) {
    const Floats a = ExpOfMinus(distance[kForward], kLargestExponent);
    const Floats b = ExpOfMinus(distance[kBackward], kLargestExponent);
    const Floats s = ExpOfMinus(distance[kBetween], kLargestExponent);
    // 0/0 becomes 0 in Max.
    Floats r = Min(Max(s / (a + b) - 1.0f, Floats{}), Fill(1.0f));
    r = Max(distance[kForward], distance[kBackward]) < kTrickBelow ? r : Floats{};
    return {r * s + (1.0f - r) * a, r * s + (1.0f - r) * b};
}

inline void AddTo(float* to, Floats value) { Store(to, Load(to) + value); }

inline void AddWeights(const WeightPair& w, float* sum, float* largest) {
    AddTo(sum, w.forward);
    AddTo(sum, w.backward);
    Store(largest, Max(Load(largest), Max(w.forward, w.backward)));
}

inline void AddInput(const WeightPair& w, Floats next, Floats previous, float* sum) {
    Store(sum, Load(sum) + w.forward * next + w.backward * previous);
}

void Gather(const RdPair& pair, const RdSums& sums, int width, int height) {
    const bool nudged = sums.nudged_weight != nullptr;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; x += RELUME_LANES) {
            Floats feature[kNlmDirections], distance[kNlmDirections], moved[kNlmDirections];
            for (int d = 0; d < kNlmDirections; ++d) {
                feature[d] = Load(pair.feature[d] + y * pair.feature_stride + x);
                distance[d] = moved[d] = feature[d];
                if (pair.color[d] != nullptr) {
                    const std::ptrdiff_t at = y * pair.color_stride + x;
                    distance[d] = Max(feature[d], Load(pair.color[d] + at));
                    if (nudged) {
                        moved[d] = Max(feature[d], Load(pair.nudged[d] + at));
                    }
                }
            }
            // If all is too far, all that follows would be 0.
            const Floats least = Min(distance[kForward], distance[kBackward]);
            const Floats least_moved = Min(moved[kForward], moved[kBackward]);
            if (!AnyBelow(nudged ? Min(least, least_moved) : least, kLargestExponent)) {
                continue;
            }
            const std::ptrdiff_t to = y * sums.stride + x;
            const std::ptrdiff_t next = y * pair.in_stride + x + pair.shift;
            const std::ptrdiff_t previous = y * pair.in_stride + x - pair.shift;
            const WeightPair w = WeightsOf(distance);
            AddWeights(w, sums.weight + to, sums.largest + to);
            if (sums.squares != nullptr) {
                AddInput(w, w.forward, w.backward, sums.squares + to);
            }
            WeightPair m{};
            if (nudged) {
                m = WeightsOf(moved);
                AddWeights(m, sums.nudged_weight + to, sums.nudged_largest + to);
            }
            for (int k = 0; k < pair.inputs; ++k) {
                const Floats a = Load(pair.in[k] + next), b = Load(pair.in[k] + previous);
                AddInput(w, a, b, sums.sum[k] + to);
                if (nudged && k < 3) {
                    AddInput(m, a, b, sums.nudged_sum[k] + to);
                }
            }
        }
    }
}

}  // namespace
}  // namespace relume::denoise
