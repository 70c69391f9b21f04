// Weighted sums over all pairs of pixels of a tile, for kernels whose weights are the same from
// both ends: each pair is weighed once. Included by the bodies of kernels after lanes_impl.h.
//
// Loops run along rows, in several short passes. One long chain of operations a pair would leave
// the processor waiting: its window for finding independent work holds little more than one such
// chain.
#include "server/denoise/bilateral_kernels.h"

namespace relume::denoise {
namespace {

static_assert(kPairWidth % 16 == 0 && kBankRadius % 16 == 0);

// Planes of a pair tile: [p] is plane p's first pixel of the tile.
struct PairPlanes {
    const float* operator[](int p) const { return first + p * kPairPlane; }
    const float* first;
};

constexpr float kLargestExponent = 40;  // weights below exp(-40) are 0

// The weights of a row of pixels with those `dy` rows below: of kind k of pair (x, x + dx) in
// right(dx, k)[x], -dx <= x < width; of (x, x - dx) in left(dx, k)[x], 0 <= x < width + dx.
template <int kKinds>
class PairRow {
  public:
    static constexpr int kStride = kPairStride;
    static constexpr int kSize = 2 * kKinds * kStride * (kBankRadius + 1);

    explicit PairRow(float* at) : at_(at) {}
    float* right(int dx, int kind) const {
        return at_ + ((2 * dx) * kKinds + kind) * kStride + kBankRadius;
    }
    float* left(int dx, int kind) const { return right(dx, kKinds + kind); }

  private:
    float* at_;
};

inline int RoundUp(int value) { return (value + RELUME_LANES - 1) / RELUME_LANES * RELUME_LANES; }

// Fills a row's weights with the row `below` it, for those 0 <= dx <= radius whose spatial[dx] is
// not 0. `Pair` has kKinds, Center, LoadCenter(at) and Exponents(center, at, e): kinds of weights
// are exp(-e), but the last kExponents, which stay e.
template <class Pair>
inline void WeighRow(const Pair& pair, std::ptrdiff_t row, std::ptrdiff_t below, int radius,
                     const float (&spatial)[kBankRadius + 1], int width,
                     const PairRow<Pair::kKinds>& to) {
    constexpr int kKinds = Pair::kKinds;
    const auto weigh = [&](const typename Pair::Center& center, int x, int step, float* first) {
        Floats e[kKinds];
        pair.Exponents(center, row + below + x + step, e);
        for (int k = 0; k < kKinds; ++k) {
            Store(first + k * PairRow<kKinds>::kStride + x, e[k]);
        }
    };
    // Within a row, (x, x - dx) is (x - dx, x) seen from the other end.
    const bool same_row = below == 0;
    const int reach = RoundUp(radius);
    for (int x = -reach; x < 0; x += RELUME_LANES) {
        const auto center = pair.LoadCenter(row + x);
        for (int dx = -x - RELUME_LANES + 1; dx <= radius; ++dx) {
            if (spatial[dx] != 0) {
                weigh(center, x, dx, to.right(dx, 0));
            }
        }
    }
    for (int x = 0; x < width; x += RELUME_LANES) {
        const auto center = pair.LoadCenter(row + x);
        if (!same_row && spatial[0] != 0) {
            weigh(center, x, 0, to.right(0, 0));
        }
        for (int dx = 1; dx <= radius; ++dx) {
            if (spatial[dx] == 0) {
                continue;
            }
            if (same_row) {
                weigh(center, x, dx, to.right(dx, 0));
            } else {
                // Two at once: while one waits for its division, the other one goes on.
                Floats right[kKinds], left[kKinds];
                pair.Exponents(center, row + below + x + dx, right);
                pair.Exponents(center, row + below + x - dx, left);
                for (int k = 0; k < kKinds; ++k) {
                    Store(to.right(dx, k) + x, right[k]);
                    Store(to.left(dx, k) + x, left[k]);
                }
            }
        }
    }
    for (int x = width; !same_row && x < width + reach; x += RELUME_LANES) {
        const auto center = pair.LoadCenter(row + x);
        for (int dx = x - width + 1; dx <= radius; ++dx) {
            if (spatial[dx] != 0) {
                weigh(center, x, -dx, to.left(dx, 0));
            }
        }
    }
    const auto exponentiate = [](float* at, int from, int until) {
        for (int x = from; x < until; x += RELUME_LANES) {
            Store(at + x, ExpOfMinus(Load(at + x), kLargestExponent));
        }
    };
    for (int dx = same_row ? 1 : 0; dx <= radius; ++dx) {
        if (spatial[dx] == 0) {
            continue;
        }
        for (int k = 0; k < kKinds - Pair::kExponents; ++k) {
            exponentiate(to.right(dx, k), -RoundUp(dx), width);
            if (!same_row && dx > 0) {
                exponentiate(to.left(dx, k), 0, width + RoundUp(dx));
            }
        }
    }
}

// The neighbours of a row of pixels at (+-dx, +-dy): weight[n][x] is that of the pixel at x with
// the one `offset` from it, plus kind * PairRow::kStride for the other kinds.
template <int kCount>
struct Ring {
    const float* weight[kCount];
    std::ptrdiff_t offset[kCount];
};

// The rings of one row of pixels at one dy.
template <int kKinds>
struct RowRings {
    // Calls fn(ring) with the ring at dx, of two or four neighbours.
    template <class Fn>
    void At(int dx, const Fn& fn) const {
        if (below == 0) {
            fn(Ring<2>{{here.right(dx, 0), here.right(dx, 0) - dx}, {dx, -dx}});
        } else if (dx == 0) {
            fn(Ring<2>{{here.right(0, 0), there.right(0, 0)}, {below, -below}});
        } else {
            fn(Ring<4>{{here.right(dx, 0), here.left(dx, 0), there.left(dx, 0) + dx,
                        there.right(dx, 0) - dx},
                       {below + dx, below - dx, -below + dx, -below - dx}});
        }
    }

    PairRow<kKinds> here, there;  // weights of this row, and of the one dy above
    std::ptrdiff_t below;
};

// Calls add(rings, y, dy) for rows 0 <= y < height of the tile's first `width` columns, whole
// vectors, and 0 <= dy <= radius, where the rings at 0 <= dx <= radius (from 1 for dy = 0) with
// spatial[dy][dx] above 0 have their weights. `scratch` holds PairRow::kSize * (kBankRadius + 1)
// floats.
template <class Pair, class Add>
inline void ForEachRow(const Pair& pair, int radius,
                       const float (&spatial)[kBankRadius + 1][kBankRadius + 1], int width,
                       int height, float* scratch, const Add& add) {
    using Row = PairRow<Pair::kKinds>;
    for (int dy = 0; dy <= radius; ++dy) {
        const std::ptrdiff_t below = dy * kPairStride;
        for (int y = -dy; y < height; ++y) {
            // The rows from y - dy to y are kept, in turn.
            const Row here(scratch + (y + dy) % (dy + 1) * Row::kSize);
            const Row there(scratch + (y + dy + 1) % (dy + 1) * Row::kSize);
            WeighRow(pair, y * kPairStride, below, radius, spatial[dy], width, here);
            if (y >= 0) {
                add(RowRings<Pair::kKinds>{here, there, below}, y, dy);
            }
        }
    }
}

// The first candidate whose window reaches so far.
inline int FirstWindow(const BankTables& tables, int dy, int dx) {
    const int reach = dx > dy ? dx : dy;
    int first = kCandidates - 1;
    while (first > 0 && tables.radius[first - 1] >= reach) {
        --first;
    }
    return first;
}

// Adds what each ring of a row has to the sums of the windows that reach so far, in which the
// widest one's stay in registers. sum(ring, x, to): kSums sums of a ring; total(k, s): the row of
// window k's sum s.
template <int kSums, class Rings, class Sum, class Total>
inline void AddRings(const BankTables& tables, const Rings& rings, int dy, int width,
                     const Sum& sum, const Total& total) {
    constexpr int kWidest = kCandidates - 1;
    const int radius = tables.radius[kWidest];
    int first[kBankRadius + 1];
    for (int dx = 0; dx <= radius; ++dx) {
        first[dx] = FirstWindow(tables, dy, dx);
    }
    for (int x = 0; x < width; x += RELUME_LANES) {
        Floats widest[kSums];
        for (int s = 0; s < kSums; ++s) {
            widest[s] = Load(total(kWidest, s) + x);
        }
        for (int dx = dy == 0 ? 1 : 0; dx <= radius; ++dx) {
            if (tables.spatial[kWidest][dy][dx] == 0) {
                continue;
            }
            rings.At(dx, [&](const auto& ring) {
                Floats add[kSums]{};
                sum(ring, x, add);
                for (int k = first[dx]; k < kWidest; ++k) {
                    const float spatial = tables.spatial[k][dy][dx];
                    for (int s = 0; s < kSums; ++s) {
                        float* to = total(k, s) + x;
                        Store(to, Load(to) + add[s] * spatial);
                    }
                }
                for (int s = 0; s < kSums; ++s) {
                    widest[s] += add[s] * tables.spatial[kWidest][dy][dx];
                }
            });
        }
        for (int s = 0; s < kSums; ++s) {
            Store(total(kWidest, s) + x, widest[s]);
        }
    }
}

}  // namespace
}  // namespace relume::denoise
