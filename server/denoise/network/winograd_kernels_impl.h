// Body of the kernels, included by one source per instruction set with RELUME_LANES (floats a
// vector) defined.
#include "server/denoise/lanes_impl.h"
#include "server/denoise/network/winograd_kernels.h"

namespace relume::denoise {
namespace {

// Of one row or column; `at` floats from one number to the next.
inline void InputLine(const Floats* d, int at, Floats* to) {
    const Floats d0 = d[0], d1 = d[at], d2 = d[2 * at], d3 = d[3 * at], d4 = d[4 * at],
                 d5 = d[5 * at];
    const Floats a = d4 - 4.0f * d2, b = d3 - 4.0f * d1;
    const Floats c = d4 - d2, e = d3 - d1;
    to[0] = (d0 * 4.0f + d4) - 5.0f * d2;
    to[at] = a + b;
    to[2 * at] = a - b;
    to[3 * at] = c + 2.0f * e;
    to[4 * at] = c - 2.0f * e;
    to[5 * at] = (d1 * 4.0f + d5) - 5.0f * d3;
}

// Two of the six columns of the result, 0 and 5, 1 and 2, or 3 and 4: more would not stay in
// registers.
template <int kColumn>
inline void TransformColumns(const float* const* rows, const std::ptrdiff_t* columns, float* to,
                             std::ptrdiff_t step) {
    Floats first[6], second[6];
#pragma GCC unroll 6
    for (int y = 0; y < 6; ++y) {
        const float* row = rows[y];
        if constexpr (kColumn == 0) {
            const Floats d0 = Load(row + columns[0]), d1 = Load(row + columns[1]),
                         d2 = Load(row + columns[2]), d3 = Load(row + columns[3]),
                         d4 = Load(row + columns[4]), d5 = Load(row + columns[5]);
            first[y] = (d0 * 4.0f + d4) - 5.0f * d2;
            second[y] = (d1 * 4.0f + d5) - 5.0f * d3;
        } else {
            const Floats d1 = Load(row + columns[1]), d2 = Load(row + columns[2]),
                         d3 = Load(row + columns[3]), d4 = Load(row + columns[4]);
            if constexpr (kColumn == 1) {
                const Floats a = d4 - 4.0f * d2, b = d3 - 4.0f * d1;
                first[y] = a + b;
                second[y] = a - b;
            } else {
                const Floats c = d4 - d2, e = d3 - d1;
                first[y] = c + 2.0f * e;
                second[y] = c - 2.0f * e;
            }
        }
    }
    constexpr int kFirst = kColumn == 0 ? 0 : 2 * kColumn - 1,
                  kSecond = kColumn == 0 ? 5 : 2 * kColumn;
    Floats out[6];
    InputLine(first, 1, out);
#pragma GCC unroll 6
    for (int y = 0; y < 6; ++y) {
        Store(to + (6 * y + kFirst) * step, out[y]);
    }
    InputLine(second, 1, out);
#pragma GCC unroll 6
    for (int y = 0; y < 6; ++y) {
        Store(to + (6 * y + kSecond) * step, out[y]);
    }
}

void TransformInput(const float* const* rows, const std::ptrdiff_t* columns, float* to,
                    std::ptrdiff_t step) {
    TransformColumns<0>(rows, columns, to, step);
    TransformColumns<1>(rows, columns, to, step);
    TransformColumns<2>(rows, columns, to, step);
}

inline void OutputLine(const Floats* m, int at, Floats* to, int to_at) {
    const Floats m1 = m[at], m2 = m[2 * at], m3 = m[3 * at], m4 = m[4 * at];
    const Floats a = m1 + m2, b = m1 - m2, c = m3 + m4, d = m3 - m4;
    to[0] = m[0] + a + c;
    to[to_at] = b + 2.0f * d;
    to[2 * to_at] = a + 4.0f * c;
    to[3 * to_at] = (b + 8.0f * d) + m[5 * at];
}

void TransformOutput(const float* from, std::ptrdiff_t step, const float* bias, bool relu,
                     bool pool, float* to, std::ptrdiff_t row) {
    Floats half[24];  // 4 rows of 6
    for (int x = 0; x < 6; ++x) {
        Floats line[6];
        for (int y = 0; y < 6; ++y) {
            line[y] = Load(from + (6 * y + x) * step);
        }
        OutputLine(line, 1, half + x, 6);
    }
    const Floats offset = Load(bias);
    Floats result[16];
    for (int y = 0; y < 4; ++y) {
        OutputLine(half + 6 * y, 1, result + 4 * y, 1);
        for (int x = 0; x < 4; ++x) {
            const Floats sum = result[4 * y + x] + offset;
            result[4 * y + x] = relu ? Max(sum, Floats{}) : sum;
        }
    }
    if (pool) {
        for (int y = 0; y < 2; ++y) {
            for (int x = 0; x < 2; ++x) {
                const Floats* four = result + 8 * y + 2 * x;
                Store(to + y * row + x * RELUME_LANES,
                      Max(Max(four[0], four[1]), Max(four[4], four[5])));
            }
        }
        return;
    }
    for (int y = 0; y < 4; ++y) {
        for (int x = 0; x < 4; ++x) {
            Store(to + y * row + x * RELUME_LANES, result[4 * y + x]);
        }
    }
}

// As many sums as stay in registers.
template <int kTiles, int kVectors>
inline void MultiplyTiles(const float* tiles, std::ptrdiff_t pitch, const float* weights,
                          int inputs, float* to, std::ptrdiff_t to_pitch) {
    Floats sum[kTiles][kVectors]{};
    for (int k = 0; k < inputs; ++k, weights += kVectors * RELUME_LANES) {
        Floats weight[kVectors];
#pragma GCC unroll 32
        for (int v = 0; v < kVectors; ++v) {
            weight[v] = Load(weights + v * RELUME_LANES);
        }
#pragma GCC unroll 32
        for (int t = 0; t < kTiles; ++t) {
            const Floats value = tiles[t * pitch + k] - Floats{};
#pragma GCC unroll 32
            for (int v = 0; v < kVectors; ++v) {
                sum[t][v] += value * weight[v];
            }
        }
    }
#pragma GCC unroll 32
    for (int t = 0; t < kTiles; ++t) {
#pragma GCC unroll 32
        for (int v = 0; v < kVectors; ++v) {
            Store(to + t * to_pitch + v * RELUME_LANES, sum[t][v]);
        }
    }
}

template <int kTiles, int kVectors>
void MultiplyPanel(const float* tiles, std::ptrdiff_t pitch, int count, const float* weights,
                   int inputs, float* to, std::ptrdiff_t to_pitch) {
    for (; count >= kTiles; count -= kTiles, tiles += kTiles * pitch, to += kTiles * to_pitch) {
        MultiplyTiles<kTiles, kVectors>(tiles, pitch, weights, inputs, to, to_pitch);
    }
    if constexpr (kTiles > 1) {
        MultiplyPanel<kTiles / 2, kVectors>(tiles, pitch, count, weights, inputs, to, to_pitch);
    }
}

#if RELUME_LANES == 16
constexpr int kSums = 24, kMostVectors = 4;  // of 32 registers
#else
constexpr int kSums = 12, kMostVectors = 2;  // of 16
#endif

void Multiply(const float* tiles, std::ptrdiff_t pitch, int count, const float* weights, int inputs,
              int vectors, float* to, std::ptrdiff_t to_pitch) {
    switch (vectors) {
        case 1:
            return MultiplyPanel<kSums, 1>(tiles, pitch, count, weights, inputs, to, to_pitch);
        case 2:
            return MultiplyPanel<kSums / 2, 2>(tiles, pitch, count, weights, inputs, to, to_pitch);
#if RELUME_LANES == 16
        case 3:
            return MultiplyPanel<kSums / 3, 3>(tiles, pitch, count, weights, inputs, to, to_pitch);
        case 4:
            return MultiplyPanel<kSums / 4, 4>(tiles, pitch, count, weights, inputs, to, to_pitch);
#endif
    }
}

constexpr WinogradKernels kWinograd = {RELUME_LANES, kMostVectors, TransformInput, Multiply,
                                       TransformOutput};

}  // namespace
}  // namespace relume::denoise
