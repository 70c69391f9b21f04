// Body of the kernel, included by one source per instruction set with RELUME_LANES (floats a
// vector) defined.
#include "server/denoise/convolve_kernels.h"
#include "server/denoise/lanes_impl.h"

namespace relume::denoise {
namespace {

// kVectors at once, so that the next one's sum begins before the last one's has ended.
template <int kVectors>
inline void ConvolveVectors(const float* from, std::ptrdiff_t step, const float* taps, int count,
                            float* to) {
    Floats sum[kVectors]{};
    for (int k = 0; k < count; ++k) {
        const float tap = taps[k];
        for (int v = 0; v < kVectors; ++v) {
            sum[v] += tap * Load(from + k * step + v * RELUME_LANES);
        }
    }
    for (int v = 0; v < kVectors; ++v) {
        Store(to + v * RELUME_LANES, sum[v]);
    }
}

void Convolve(const float* from, std::ptrdiff_t step, const float* taps, int count, int width,
              float* to) {
    int x = 0;
    for (; x + 4 * RELUME_LANES <= width; x += 4 * RELUME_LANES) {
        ConvolveVectors<4>(from + x, step, taps, count, to + x);
    }
    for (; x + RELUME_LANES <= width; x += RELUME_LANES) {
        ConvolveVectors<1>(from + x, step, taps, count, to + x);
    }
    for (; x < width; ++x) {
        float sum = 0;
        for (int k = 0; k < count; ++k) {
            sum += taps[k] * from[k * step + x];
        }
        to[x] = sum;
    }
}

}  // namespace
}  // namespace relume::denoise
