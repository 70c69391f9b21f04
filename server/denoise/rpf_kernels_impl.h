// Body of the kernel, included by one source per instruction set with RELUME_LANES (floats a
// vector) defined.
#include "server/denoise/lanes_impl.h"
#include "server/denoise/rpf_kernels.h"

namespace relume::denoise {
namespace {

void Weigh(const RpfColumns& columns, int own, float* sums) {
    constexpr float kCut = 17;
    constexpr int kVectors = kRpfBlock / RELUME_LANES;
    Floats weights[kVectors]{}, colors[3][kVectors]{};
    for (int j = 0; j < columns.count; j += kRpfBlock) {
        Floats exponent[kVectors];
        for (int v = 0; v < kVectors; ++v) {
            exponent[v] = Load(columns.outside + j + v * RELUME_LANES);
        }
        for (int k = 0; k < columns.compared_count; ++k) {
            const float* column = columns.compared[k];
            const float center = column[own], coefficient = columns.coefficients[k];
            for (int v = 0; v < kVectors; ++v) {
                const Floats d = Load(column + j + v * RELUME_LANES) - center;
                exponent[v] += coefficient * (d * d);
            }
        }
        for (int v = 0; v < kVectors; ++v) {
            const Floats weight = ExpOfMinus(exponent[v], kCut);
            weights[v] += weight;
            for (int c = 0; c < 3; ++c) {
                colors[c][v] += weight * Load(columns.color[c] + j + v * RELUME_LANES);
            }
        }
    }
    for (int v = 0; v < kVectors; ++v) {
        Store(sums + v * RELUME_LANES, weights[v]);
        for (int c = 0; c < 3; ++c) {
            Store(sums + (c + 1) * kRpfBlock + v * RELUME_LANES, colors[c][v]);
        }
    }
}

}  // namespace
}  // namespace relume::denoise
