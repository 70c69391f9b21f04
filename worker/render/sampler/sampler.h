#pragma once

#include <cstdint>

#include "core/math/vec.h"
#include "worker/render/sampler/hash.h"
#include "worker/render/sampler/sobol.h"

namespace relume::render {

// The random numbers of one sample of one pixel: a pure function of (seed, pixel, sample index,
// dimension). Each dimension is a padded 2-D Owen-scrambled Sobol' sequence with its own shuffle of
// indices. Even and odd sample indices draw from two independent scrambles, so that the two half
// images are independent estimates; splitting one sequence by parity would not do (docs/adr, two
// scrambles).
class Sampler {
  public:
    Sampler() = default;
    // `x`, `y` in the full frame.
    Sampler(std::uint32_t seed, int x, int y, std::uint32_t index)
        : key_(Hash(Hash(Hash(seed, static_cast<std::uint32_t>(x)), static_cast<std::uint32_t>(y)),
                    index & 1)),
          reversed_index_(ReverseBits(index >> 1)) {}

    // In [0, 1)^2. Every dimension is read at most once a path.
    Vec2f Pair(std::uint32_t dimension) const { return Pair(key_, reversed_index_, dimension); }

    // In [0, 1), stratified over the samples of the pixel.
    float One(std::uint32_t dimension) const { return ToUnit(OneBits(dimension)); }

    // The same as a binary fraction of 32 digits.
    std::uint32_t OneBits(std::uint32_t dimension) const {
        return OneBits(key_, reversed_index_, dimension);
    }

    // 32 bits without structure, for decisions that gain nothing from stratification.
    std::uint32_t Bits(std::uint32_t dimension) const {
        return Bits(key_, reversed_index_, dimension);
    }

    // What these are functions of, for SamplerBatch.
    std::uint32_t key() const { return key_; }
    std::uint32_t reversed_index() const { return reversed_index_; }

    static Vec2f Pair(std::uint32_t own_key, std::uint32_t reversed_index,
                      std::uint32_t dimension) {
        const std::uint32_t key = Hash(own_key, dimension);
        // The shuffled index, bits reversed: also the first coordinate before its scramble.
        const std::uint32_t first = LaineKarras(reversed_index, key);
        const std::uint32_t second = SecondSobol(first);
        return {ToUnit(Scramble(first, Mix(key + 0x51633e2du))),
                ToUnit(Scramble(second, Mix(key + 0xa511e9b3u)))};
    }
    static std::uint32_t OneBits(std::uint32_t own_key, std::uint32_t reversed_index,
                                 std::uint32_t dimension) {
        const std::uint32_t key = Hash(own_key, dimension);
        return Scramble(LaineKarras(reversed_index, key), Mix(key + 0x51633e2du));
    }
    static std::uint32_t Bits(std::uint32_t own_key, std::uint32_t reversed_index,
                              std::uint32_t dimension) {
        return Hash(Hash(own_key, dimension), reversed_index);
    }

  private:
    static std::uint32_t Scramble(std::uint32_t x, std::uint32_t seed) {
        return ReverseBits(LaineKarras(ReverseBits(x), seed));
    }

    std::uint32_t key_ = 0;
    std::uint32_t reversed_index_ = 0;
};

}  // namespace relume::render
