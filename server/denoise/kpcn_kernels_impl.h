// Body of the kernel, included by one source per instruction set with RELUME_LANES (floats a
// vector) defined.
#include "server/denoise/kpcn_kernels.h"
#include "server/denoise/lanes_impl.h"

namespace relume::denoise {
namespace {

void Kpcn(const float* logits, std::ptrdiff_t logit_step, const float* const* image,
          std::ptrdiff_t stride, int radius, float* out) {
    const int side = 2 * radius + 1;
    for (int x = 0; x < kKpcnBlock; x += RELUME_LANES) {
        Floats most = Load(logits + x);
        for (int k = 1; k < side * side; ++k) {
            most = Max(Load(logits + k * logit_step + x), most);
        }
        Floats weights{}, sums[3]{}, own{};
        const float* logit = logits + x;
        for (int dy = -radius; dy <= radius; ++dy) {
            // Row by row: sums of few terms lose less to rounding.
            Floats row_weights{}, row_sums[3]{};
            const std::ptrdiff_t to = dy * stride + x;
            for (int dx = -radius; dx <= radius; ++dx, logit += logit_step) {
                const Floats w = ExpOfMinus(most - Load(logit), 80.0f);
                row_weights += w;
                for (int c = 0; c < 3; ++c) {
                    row_sums[c] += w * Load(image[c] + to + dx);
                }
                if (dy == 0 && dx == 0) {
                    own = w;
                }
            }
            weights += row_weights;
            for (int c = 0; c < 3; ++c) {
                sums[c] += row_sums[c];
            }
        }
        for (int c = 0; c < 3; ++c) {
            Store(out + c * kKpcnBlock + x, sums[c] / weights);
        }
        Store(out + 3 * kKpcnBlock + x, own / weights);
    }
}

}  // namespace
}  // namespace relume::denoise
