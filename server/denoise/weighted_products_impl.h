// Weighted sums of products of columns: what the normal equations of least squares are made of.
// Included only by the bodies of kernels, with RELUME_LANES defined; every lane is a problem of its
// own.
#include "server/denoise/lanes_impl.h"

namespace relume::denoise {
namespace {

constexpr int kMostRows = 19;  // that AddProducts takes at a time: so many stay in the first cache

// Rows of a design matrix.
struct WeightedRows {
    int count = 0;
    Floats weight[kMostRows];
    const Floats* row[kMostRows];  // each has all columns
};

// Adds to a block of the matrix, as large as fits the registers; on the diagonal only to what is
// not below.
template <int kHeight, int kWidth, bool kDiagonal>
__attribute__((noinline)) void AddBlock(const WeightedRows& rows, int from, int to, Floats* cross,
                                        int columns) {
    Floats block[kHeight][kWidth];
#pragma GCC unroll 4
    for (int r = 0; r < kHeight; ++r) {
#pragma GCC unroll 7
        for (int c = 0; c < kWidth; ++c) {
            block[r][c] = cross[(from + r) * columns + to + c];
        }
    }
    for (int k = 0; k < rows.count; ++k) {
        const Floats* row = rows.row[k];
        const Floats w = rows.weight[k];
        Floats weighted[kHeight];
#pragma GCC unroll 4
        for (int r = 0; r < kHeight; ++r) {
            weighted[r] = row[from + r] * w;
        }
#pragma GCC unroll 7
        for (int c = 0; c < kWidth; ++c) {
            const Floats value = row[to + c];
#pragma GCC unroll 4
            for (int r = 0; r < kHeight; ++r) {
                if (!kDiagonal || c >= r) {
                    block[r][c] += weighted[r] * value;
                }
            }
        }
    }
#pragma GCC unroll 4
    for (int r = 0; r < kHeight; ++r) {
#pragma GCC unroll 7
        for (int c = 0; c < kWidth; ++c) {
            cross[(from + r) * columns + to + c] = block[r][c];
        }
    }
}

using BlockKernel = void (*)(const WeightedRows&, int, int, Floats*, int);

template <int kHeight>
constexpr BlockKernel kDiagonalBlocks[7] = {AddBlock<kHeight, 1, true>, AddBlock<kHeight, 2, true>,
                                            AddBlock<kHeight, 3, true>, AddBlock<kHeight, 4, true>,
                                            AddBlock<kHeight, 5, true>, AddBlock<kHeight, 6, true>,
                                            AddBlock<kHeight, 7, true>};

template <int kHeight>
constexpr BlockKernel kFullBlocks[5] = {AddBlock<kHeight, 1, false>, AddBlock<kHeight, 2, false>,
                                        AddBlock<kHeight, 3, false>, AddBlock<kHeight, 4, false>,
                                        AddBlock<kHeight, 5, false>};

template <int kHeight>
void AddBlockRow(const WeightedRows& rows, int from, int columns, Floats* cross) {
    int to = from, left = columns - from;
    int width = left < 7 ? left : 7;
    kDiagonalBlocks<kHeight>[width - 1](rows, from, to, cross, columns);
    for (to += width, left -= width; left > 0; to += width, left -= width) {
        width = left < 5 ? left : 5;
        kFullBlocks<kHeight>[width - 1](rows, from, to, cross, columns);
    }
}

// cross[a * columns + b] += sum over rows of weight x column a x column b, for a < height and a <=
// b < columns.
inline void AddProducts(const WeightedRows& rows, int height, int columns, Floats* cross) {
    int from = 0;
    for (; from + 4 <= height; from += 4) {
        AddBlockRow<4>(rows, from, columns, cross);
    }
    switch (height - from) {
        case 3:
            return AddBlockRow<3>(rows, from, columns, cross);
        case 2:
            return AddBlockRow<2>(rows, from, columns, cross);
        case 1:
            return AddBlockRow<1>(rows, from, columns, cross);
    }
}

}  // namespace
}  // namespace relume::denoise
