#pragma once

#include <cstddef>
#include <cstdint>

#include "worker/render/sampler/sampler.h"

namespace relume::render {

// The random numbers of many samples at once: the same bits as Sampler's, in loops that compilers
// turn into vector instructions (half the time of a path's vertex went into them one by one).
template <std::size_t kSize>
class SamplerBatch {
  public:
    // Row i belongs to `sampler`.
    void Set(std::size_t i, const Sampler& sampler) {
        keys_[i] = sampler.key();
        indices_[i] = sampler.reversed_index();
    }

    // Sampler::Pair of the first n rows.
    void Pairs(std::uint32_t dimension, std::size_t n, float* x, float* y) const {
        for (std::size_t i = 0; i < n; ++i) {
            const Vec2f pair = Sampler::Pair(keys_[i], indices_[i], dimension);
            x[i] = pair.x;
            y[i] = pair.y;
        }
    }
    // Sampler::OneBits.
    void OneBits(std::uint32_t dimension, std::size_t n, std::uint32_t* bits) const {
        for (std::size_t i = 0; i < n; ++i) {
            bits[i] = Sampler::OneBits(keys_[i], indices_[i], dimension);
        }
    }
    // Sampler::Bits.
    void Bits(std::uint32_t dimension, std::size_t n, std::uint32_t* bits) const {
        for (std::size_t i = 0; i < n; ++i) {
            bits[i] = Sampler::Bits(keys_[i], indices_[i], dimension);
        }
    }

  private:
    alignas(32) std::uint32_t keys_[kSize];
    alignas(32) std::uint32_t indices_[kSize];
};

}  // namespace relume::render
