#pragma once

#include <cstddef>

namespace relume::denoise {

// The inner loops of 3x3 convolutions by Winograd's way, F(4x4, 3x3) (Lavin and Gray 2016): a tile
// of 6x6 pixels becomes 36 numbers a channel, of which each is multiplied by its own matrix of
// weights, and 4x4 pixels of the result come of the 36 sums: a quarter of the multiplications.
// Compiled once for each instruction set; sums are fused with products, so that results of
// different widths differ by rounding.
struct WinogradKernels {
    int lanes;         // channels of a vector
    int most_vectors;  // of a panel of `multiply`

    // 36 vectors, `step` floats from one to the next, of the tile whose pixels are at rows[0..5] +
    // columns[0..5].
    void (*transform_input)(const float* const* rows, const std::ptrdiff_t* columns, float* to,
                            std::ptrdiff_t step);

    // to[t][o] = sum over k of tiles[t][k] x weights[k][o] for `count` tiles, each `pitch` floats
    // (`to_pitch` those of the result) from the next, and o in [0, vectors x lanes).
    void (*multiply)(const float* tiles, std::ptrdiff_t pitch, int count, const float* weights,
                     int inputs, int vectors, float* to, std::ptrdiff_t to_pitch);

    // The result of a tile, 4x4 vectors, or 2x2 where the maximum of each four is taken: rows are
    // `row` floats from one to the next.
    void (*transform_output)(const float* from, std::ptrdiff_t step, const float* bias, bool relu,
                             bool pool, float* to, std::ptrdiff_t row);
};

#if RELUME_WIDE_KERNELS
extern const WinogradKernels kWinogradAvx2, kWinogradAvx512;
#endif

// Of vectors of `lanes` floats; null if this processor has none.
const WinogradKernels* FindWinogradKernels(int lanes);

}  // namespace relume::denoise
