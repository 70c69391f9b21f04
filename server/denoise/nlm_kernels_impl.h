// Body of the kernels, included by one source per instruction set with RELUME_LANES (floats a
// vector) defined.
#include "server/denoise/lanes_impl.h"
#include "server/denoise/nlm_kernels.h"

namespace relume::denoise {
namespace {

static_assert(kNlmLanes % RELUME_LANES == 0);

constexpr float kLargestExponent = 40;

// One over what a squared difference is in units of. A value or variance near the end of the
// floats' range may make a distance that is no number: Min takes it to `largest`.
inline Floats InverseSpread(Floats va, Floats vb, const NlmPair& pair) {
    return 1.0f / ((va + vb) * pair.k_squared + pair.epsilon);
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
                const Floats square = d * d, least = Min(va, vb);
                const Floats inverse = InverseSpread(va, vb, pair);
                to += Min((square - (va + least) * pair.alpha) * inverse, largest);
                from += Min((square - (vb + least) * pair.alpha) * inverse, largest);
            }
            Store(forward + y * stride + x, to * scale);
            Store(backward + y * stride + x, from * scale);
        }
    }
}

void Between(const NlmPair& pair, int width, int height, float* out, std::ptrdiff_t stride) {
    const Floats largest = Fill(pair.largest);
    const float scale = 1.0f / static_cast<float>(pair.channels);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; x += RELUME_LANES) {
            const std::ptrdiff_t at = y * pair.stride + x;
            const std::ptrdiff_t next = at + pair.shift, previous = at - pair.shift;
            Floats sum{};
            for (int c = 0; c < pair.channels; ++c) {
                const Floats mean =
                    (Load(pair.value[c] + next) + Load(pair.value[c] + previous)) * 0.5f;
                const Floats d = Load(pair.value[c] + at) - mean;
                const Floats va = Load(pair.variance[c] + at);
                const Floats vb =
                    (Load(pair.variance[c] + next) + Load(pair.variance[c] + previous)) * 0.25f;
                sum += Min((d * d - (va + Min(va, vb)) * pair.alpha) * InverseSpread(va, vb, pair),
                           largest);
            }
            Store(out + y * stride + x, sum * scale);
        }
    }
}

void Box(const float* in, std::ptrdiff_t in_stride, int radius, int width, int height,
         const float* across, const float* down, bool keep_larger, float* row, float* out,
         std::ptrdiff_t stride) {
    for (int y = 0; y < height; ++y, out += stride) {
        const float* first = in + (y - radius) * in_stride - radius;
        for (int x = 0; x < width + 2 * radius; x += RELUME_LANES) {
            Floats sum = Load(first + x);
            for (int k = 1; k <= 2 * radius; ++k) {
                sum += Load(first + k * in_stride + x);
            }
            Store(row + x, sum);
        }
        for (int x = 0; x < width; x += RELUME_LANES) {
            Floats sum = Load(row + x);
            for (int k = 1; k <= 2 * radius; ++k) {
                sum += Load(row + x + k);
            }
            sum *= Load(across + x) * down[y];
            Store(out + x, keep_larger ? Max(sum, Load(out + x)) : sum);
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
