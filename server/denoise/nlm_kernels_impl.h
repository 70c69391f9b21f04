// Body of the kernels, included by one source per instruction set with RELUME_LANES (floats a
// vector) defined.
#include "server/denoise/lanes_impl.h"
#include "server/denoise/nlm_kernels.h"

namespace relume::denoise {
namespace {

static_assert(kNlmLanes % RELUME_LANES == 0);

constexpr float kLargestExponent = 40;

// The distance of a pair from its squared difference and the centre's and the neighbour's variance.
// A value or variance near the end of the floats' range may make one that is no number: Min takes
// it to `largest`.
inline Floats Spread(Floats va, Floats vb, const NlmPair& pair) {
    return 1.0f / ((va + vb) * pair.k_squared + pair.epsilon);
}

inline Floats Noise(Floats va, Floats vb, const NlmPair& pair) {
    return (va + Min(va, vb)) * pair.alpha;
}

void Pair(const NlmPair& pair, int width, int height, float* forward, float* backward,
          std::ptrdiff_t stride) {
    const Floats largest = Fill(pair.largest);
    const float scale = 1.0f / static_cast<float>(pair.channels);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; x += RELUME_LANES) {
            const std::ptrdiff_t at = y * pair.stride + x;
            Floats to{}, from{};
            for (int c = 0; c < pair.channels; ++c) {
                const Floats d = Load(pair.value[c] + at) - Load(pair.value[c] + at + pair.shift);
                const Floats va = Load(pair.variance[c] + at);
                const Floats vb = Load(pair.variance[c] + at + pair.shift);
                const Floats square = d * d;
                Floats ahead, back;
                if (pair.own_variance) {
                    ahead = Spread(va, va, pair);
                    back = Spread(vb, vb, pair);
                } else {
                    ahead = back = Spread(va, vb, pair);
                }
                to += Min((square - Noise(va, vb, pair)) * ahead, largest);
                from += Min((square - Noise(vb, va, pair)) * back, largest);
            }
            Store(forward + y * stride + x, to * scale);
            Store(backward + y * stride + x, from * scale);
        }
    }
}

// A pixel and the mean of its neighbours, in one channel.
struct Between3 {
    Floats own, next, previous, own_variance, mean_variance, inverse;
};

inline Between3 LoadBetween(const NlmPair& pair, int c, std::ptrdiff_t at) {
    const std::ptrdiff_t next = at + pair.shift, previous = at - pair.shift;
    Between3 b;
    b.own = Load(pair.value[c] + at);
    b.next = Load(pair.value[c] + next);
    b.previous = Load(pair.value[c] + previous);
    b.own_variance = Load(pair.variance[c] + at);
    b.mean_variance = (Load(pair.variance[c] + next) + Load(pair.variance[c] + previous)) * 0.25f;
    b.inverse = Spread(b.own_variance, pair.own_variance ? b.own_variance : b.mean_variance, pair);
    return b;
}

inline Floats DistanceBetween(const NlmPair& pair, const Between3& b) {
    const Floats d = b.own - (b.next + b.previous) * 0.5f;
    return Min((d * d - Noise(b.own_variance, b.mean_variance, pair)) * b.inverse,
               Fill(pair.largest));
}

void Between(const NlmPair& pair, int width, int height, float* out, std::ptrdiff_t stride) {
    const float scale = 1.0f / static_cast<float>(pair.channels);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; x += RELUME_LANES) {
            Floats sum{};
            for (int c = 0; c < pair.channels; ++c) {
                sum += DistanceBetween(pair, LoadBetween(pair, c, y * pair.stride + x));
            }
            Store(out + y * stride + x, sum * scale);
        }
    }
}

// By how much the distances of a pixel and its neighbour at `shift` change, summed over the
// channels: `centre` as the pixel sees it, `neighbour` as the other does.
struct Change {
    Floats centre{}, neighbour{};
};

inline Change NudgePair(const NlmPair& pair, std::ptrdiff_t at, std::ptrdiff_t shift,
                        float factor) {
    const Floats largest = Fill(pair.largest);
    Change change;
    for (int c = 0; c < pair.channels; ++c) {
        const Floats a = Load(pair.value[c] + at), b = Load(pair.value[c] + at + shift);
        const Floats va = Load(pair.variance[c] + at), vb = Load(pair.variance[c] + at + shift);
        const Floats d = a - b, nudged = a * factor - b;
        const Floats before = d * d, after = nudged * nudged;
        const Floats inverse = Spread(va, vb, pair);
        const Floats ahead = Noise(va, vb, pair), back = Noise(vb, va, pair);
        change.centre +=
            Min((after - ahead) * inverse, largest) - Min((before - ahead) * inverse, largest);
        change.neighbour +=
            Min((after - back) * inverse, largest) - Min((before - back) * inverse, largest);
    }
    return change;
}

// The same of the distance of the pixel to the mean of its neighbours; near: and of those of the
// neighbours, each of which has the pixel for a neighbour.
inline Floats NudgeBetween(const NlmPair& pair, const NlmNudge& nudge, std::ptrdiff_t at) {
    Floats sum{}, next{}, previous{};
    for (int c = 0; c < pair.channels; ++c) {
        const auto change = [&](Between3 b, Floats Between3::*moved) {
            const Floats before = DistanceBetween(pair, b);
            b.*moved *= nudge.factor;
            return DistanceBetween(pair, b) - before;
        };
        sum += change(LoadBetween(pair, c, at), &Between3::own);
        if (nudge.near) {
            next += change(LoadBetween(pair, c, at + pair.shift), &Between3::previous);
            previous += change(LoadBetween(pair, c, at - pair.shift), &Between3::next);
        }
    }
    if (nudge.near) {
        sum += next * Load(nudge.inside + at + 2 * pair.shift);
        sum += previous * Load(nudge.inside + at - 2 * pair.shift);
    }
    return sum;
}

void Nudge(const NlmPair& pair, const NlmNudge& nudge, int width, int height) {
    const float scale = 1.0f / static_cast<float>(pair.channels);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; x += RELUME_LANES) {
            const std::ptrdiff_t at = y * pair.stride + x, to = y * nudge.stride + x;
            const auto store = [&](NlmDirection direction, Floats change) {
                const Floats patch =
                    Load(nudge.across[direction] + x) * (nudge.down[direction][y] * scale);
                Store(nudge.nudged[direction] + to,
                      Load(nudge.distance[direction] + to) + change * patch);
            };
            const Change next = NudgePair(pair, at, pair.shift, nudge.factor);
            const Change previous = NudgePair(pair, at, -pair.shift, nudge.factor);
            Floats forward = next.centre, backward = previous.centre;
            if (nudge.near) {
                forward += previous.neighbour * Load(nudge.inside + at - pair.shift);
                backward += next.neighbour * Load(nudge.inside + at + pair.shift);
            }
            store(kForward, forward);
            store(kBackward, backward);
            if (nudge.distance[kBetween] != nullptr) {
                store(kBetween, NudgeBetween(pair, nudge, at));
            }
        }
    }
}

// Sums of 7 values each are made of sums of two, which neighbouring ones share; all in one order,
// (01 + 23) + (45 + 6).
template <int kRows>
inline void SumSevenRows(const float* first, std::ptrdiff_t stride, Floats (&sums)[kRows]) {
    Floats value[kRows + 6], pair[kRows + 5];
#pragma GCC unroll 10
    for (int k = 0; k < kRows + 6; ++k) {
        value[k] = Load(first + k * stride);
    }
#pragma GCC unroll 9
    for (int k = 0; k < kRows + 5; ++k) {
        pair[k] = value[k] + value[k + 1];
    }
#pragma GCC unroll 4
    for (int r = 0; r < kRows; ++r) {
        sums[r] = (pair[r] + pair[r + 2]) + (pair[r + 4] + value[r + 6]);
    }
}

#if RELUME_LANES == 16
// a[kBy ..] followed by b.
template <int kBy>
inline Floats Shift(Floats a, Floats b) {
    return __builtin_shufflevector(a, b, kBy, kBy + 1, kBy + 2, kBy + 3, kBy + 4, kBy + 5, kBy + 6,
                                   kBy + 7, kBy + 8, kBy + 9, kBy + 10, kBy + 11, kBy + 12,
                                   kBy + 13, kBy + 14, kBy + 15);
}
#endif

// Calls use(x, sum of row[x .. x + 6]) along a row.
template <typename Use>
inline void SumSevenAlong(const float* row, int width, const Use& use) {
#if RELUME_LANES == 16
    // Neighbours come from registers: a load that crosses a cache line costs two.
    Floats value = Load(row), next = Load(row + 16);
    Floats pair = value + Shift<1>(value, next);
    for (int x = 0; x < width; x += 16) {
        const Floats after = Load(row + x + 32);
        const Floats next_pair = next + Shift<1>(next, after);
        use(x, (pair + Shift<2>(pair, next_pair)) +
                   (Shift<4>(pair, next_pair) + Shift<6>(value, next)));
        value = next;
        next = after;
        pair = next_pair;
    }
#else
    for (int x = 0; x < width; x += RELUME_LANES) {
        Floats sum[1];
        SumSevenRows(row + x, 1, sum);
        use(x, sum[0]);
    }
#endif
}

template <int kRows>
inline void BoxSevenRows(const float* in, std::ptrdiff_t in_stride, int width, const float* across,
                         const float* down, float* rows, float* out, std::ptrdiff_t stride) {
    const int row_size = width + 3 * kNlmLanes;
    for (int x = 0; x < width + 6; x += RELUME_LANES) {
        Floats sums[kRows];
        SumSevenRows(in - 3 * in_stride - 3 + x, in_stride, sums);
        for (int r = 0; r < kRows; ++r) {
            Store(rows + r * row_size + x, sums[r]);
        }
    }
    for (int r = 0; r < kRows; ++r) {
        SumSevenAlong(rows + r * row_size, width, [&](int x, Floats sum) {
            Store(out + r * stride + x, sum * (Load(across + x) * down[r]));
        });
    }
}

void Box(const float* in, std::ptrdiff_t in_stride, int radius, int width, int height,
         const float* across, const float* down, float* rows, float* out, std::ptrdiff_t stride) {
    int y = 0;
    if (radius == 3) {
        for (; y + kNlmBoxRows <= height; y += kNlmBoxRows) {
            BoxSevenRows<kNlmBoxRows>(in + y * in_stride, in_stride, width, across, down + y, rows,
                                      out + y * stride, stride);
        }
        for (; y < height; ++y) {
            BoxSevenRows<1>(in + y * in_stride, in_stride, width, across, down + y, rows,
                            out + y * stride, stride);
        }
        return;
    }
    for (; y < height; ++y, out += stride) {
        const float* first = in + (y - radius) * in_stride - radius;
        for (int x = 0; x < width + 2 * radius; x += RELUME_LANES) {
            Floats sum = Load(first + x);
            for (int k = 1; k <= 2 * radius; ++k) {
                sum += Load(first + k * in_stride + x);
            }
            Store(rows + x, sum);
        }
        for (int x = 0; x < width; x += RELUME_LANES) {
            Floats sum = Load(rows + x);
            for (int k = 1; k <= 2 * radius; ++k) {
                sum += Load(rows + x + k);
            }
            Store(out + x, sum * (Load(across + x) * down[y]));
        }
    }
}

inline Floats WeightOf(Floats distance) {
    return ExpOfMinus(Max(distance, Floats{}), kLargestExponent);
}

void Weights(float* plane, std::ptrdiff_t stride, int width, int height) {
    for (int y = 0; y < height; ++y, plane += stride) {
        for (int x = 0; x < width; x += RELUME_LANES) {
            Store(plane + x, WeightOf(Load(plane + x)));
        }
    }
}

void Symmetric(float* forward, float* backward, const float* between, std::ptrdiff_t stride,
               int width, int height) {
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; x += RELUME_LANES) {
            const std::ptrdiff_t at = y * stride + x;
            const Floats a = Load(forward + at), b = Load(backward + at);
            const Floats s = WeightOf(Load(between + at));
            // 0/0 becomes 0 in Max.
            const Floats r = Min(Max(s / (a + b) - 1.0f, Floats{}), Fill(1.0f));
            Store(forward + at, r * s + (1.0f - r) * a);
            Store(backward + at, r * s + (1.0f - r) * b);
        }
    }
}

void Cut(float* plane, std::ptrdiff_t stride, int width, int height, float floor) {
    for (int y = 0; y < height; ++y, plane += stride) {
        for (int x = 0; x < width; x += RELUME_LANES) {
            const Floats w = Load(plane + x);
            Store(plane + x, w < floor ? Floats{} : w);
        }
    }
}

void Accumulate(const float* weight, std::ptrdiff_t weight_stride, const float* in,
                std::ptrdiff_t in_stride, int width, int height, float* sum,
                std::ptrdiff_t sum_stride) {
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; x += RELUME_LANES) {
            float* to = sum + y * sum_stride + x;
            Store(to,
                  Load(to) + Load(weight + y * weight_stride + x) * Load(in + y * in_stride + x));
        }
    }
}

}  // namespace
}  // namespace relume::denoise
