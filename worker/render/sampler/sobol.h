#pragma once

#include <cstdint>

namespace relume::render {

inline std::uint32_t ReverseBits(std::uint32_t x) {
    x = __builtin_bswap32(x);
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
    x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
    return x;
}

// Hash in which each bit depends on lower bits alone (Laine and Karras 2011, "Stratified Sampling
// for Stochastic Transparency", section 3.1; multipliers by N. Vegdahl 2021). Between two bit
// reversals it is a nested uniform (Owen) scramble: Burley 2020, "Practical Hash-based Owen
// Scrambling", section 3.
inline std::uint32_t LaineKarras(std::uint32_t x, std::uint32_t seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// Second Sobol' dimension of a point whose index is given with its bits reversed (which is the
// first dimension). Its matrix is Pascal's triangle modulo 2: digit j is the sum of the index bits
// i whose binary digits include those of j (Lucas), applied here in five steps.
inline std::uint32_t SecondSobol(std::uint32_t reversed_index) {
    std::uint32_t v = reversed_index;
    v ^= v << 16;
    v ^= (v & 0x00ff00ffu) << 8;
    v ^= (v & 0x0f0f0f0fu) << 4;
    v ^= (v & 0x33333333u) << 2;
    v ^= (v & 0x55555555u) << 1;
    return v;
}

}  // namespace relume::render
