// Body of the kernel, included by one source per instruction set with RELUME_LANES (floats a
// vector) defined.
#include "server/denoise/bilateral_kernels.h"
#include "server/denoise/lanes_impl.h"
#include "server/denoise/net_printed_kernels.h"

namespace relume::denoise {
namespace {

// exp(-e) of (7) for the pixels at `to` in the windows of those at `at`.
inline Floats PairWeight(const float* const* planes, std::ptrdiff_t to, const Floats* center,
                         float squared_distance, Floats* range) {
    const auto squares = [&](int first, int count) {
        Floats s{};
        for (int p = first; p < first + count; ++p) {
            const Floats d = Load(planes[p] + to) - center[p];
            s += d * d;
        }
        return s;
    };
    Floats e = squared_distance * center[kNetPrintedScale];
    for (int c = 0; c < 3; ++c) {
        const Floats d = Load(planes[kNetPrintedColor + c] + to) - center[kNetPrintedColor + c];
        range[c] = d * d;
    }
    e += (range[0] + range[1] + range[2]) * center[kNetPrintedScale + 1];
    const Floats distance[3] = {squares(kNetPrintedNormal, 3), squares(kNetPrintedAlbedo, 3),
                                squares(kNetPrintedDepth, 1)};
    for (int g = 0; g < 3; ++g) {
        const Floats variance =
            center[kNetPrintedVariance + g] + Load(planes[kNetPrintedVariance + g] + to);
        // (8): D is a root, and is used without a square.
        e += Sqrt(distance[g] / Max(variance, Fill(1e-10f))) * center[kNetPrintedScale + 2 + g];
    }
    return ExpOfMinus(e, 80.0f) * Load(planes[kNetPrintedInside] + to);
}

void NetPrinted(const float* const* planes, std::ptrdiff_t stride, int height, float* out) {
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < kTileWidth; x += RELUME_LANES) {
            const std::ptrdiff_t at = y * stride + x;
            Floats center[kNetPrintedPlanes];
            for (int p = 0; p < kNetPrintedPlanes; ++p) {
                center[p] = Load(planes[p] + at);
            }
            Floats sum[kNetPrintedOutputs]{};
            for (int dy = -kNetPrintedRadius; dy <= kNetPrintedRadius; ++dy) {
                // Row by row: sums of few terms lose less to rounding.
                Floats row[kNetPrintedOutputs]{};
                for (int dx = -kNetPrintedRadius; dx <= kNetPrintedRadius; ++dx) {
                    const std::ptrdiff_t to = at + dy * stride + dx;
                    Floats range[3];
                    const Floats w = PairWeight(planes, to, center,
                                                static_cast<float>(dx * dx + dy * dy), range);
                    for (int c = 0; c < 3; ++c) {
                        row[c] += w * Load(planes[kNetPrintedColor + c] + to);
                        row[4 + c] += w * range[c];
                    }
                    row[3] += w;
                }
                for (int s = 0; s < kNetPrintedOutputs; ++s) {
                    sum[s] += row[s];
                }
            }
            // Tiles reach beyond the image, where there is nothing to divide by.
            const Floats weight = sum[3] > 0.0f ? sum[3] : Fill(1.0f);
            for (int s = 0; s < kNetPrintedOutputs; ++s) {
                Store(out + s * kTileArea + y * kTileWidth + x, s < 3 ? sum[s] / weight : sum[s]);
            }
        }
    }
}

}  // namespace
}  // namespace relume::denoise
