// Vectors of RELUME_LANES floats for the inner loops of filters; included only by the bodies of
// kernels, which are compiled once for each instruction set. It includes no library header and
// calls nothing: an inline function compiled here for a newer processor could be what the linker
// keeps for the whole program. Every width does the same operations in the same order on each lane,
// so that the bits are the same.
#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace relume::denoise {
namespace {

typedef float Floats __attribute__((vector_size(RELUME_LANES * 4)));
typedef unsigned Bits __attribute__((vector_size(RELUME_LANES * 4)));

inline Floats Load(const float* from) {
    Floats v;
    __builtin_memcpy(&v, from, sizeof v);
    return v;
}

inline void Store(float* to, Floats v) { __builtin_memcpy(to, &v, sizeof v); }

inline Floats Fill(float value) { return Floats{} + value; }

inline Floats Max(Floats a, Floats b) { return a > b ? a : b; }
inline Floats Min(Floats a, Floats b) { return a < b ? a : b; }

inline Floats Sqrt(Floats x) {
#if RELUME_LANES == 16
    return _mm512_maskz_sqrt_ps(0xffff, x);  // not _mm512_sqrt_ps: GCC 12 warns of its own header
#elif RELUME_LANES == 8
    return _mm256_sqrt_ps(x);
#elif defined(__SSE2__)
    return _mm_sqrt_ps(x);
#else
    for (int i = 0; i < RELUME_LANES; ++i) {
        x[i] = __builtin_sqrtf(x[i]);
    }
    return x;
#endif
}

// Whether any lane is below.
inline bool AnyBelow(Floats x, float bound) {
#if RELUME_LANES == 16
    return _mm512_cmp_ps_mask(x, _mm512_set1_ps(bound), _CMP_LT_OQ) != 0;
#elif RELUME_LANES == 8
    return _mm256_movemask_ps(_mm256_cmp_ps(x, _mm256_set1_ps(bound), _CMP_LT_OQ)) != 0;
#elif defined(__SSE2__)
    return _mm_movemask_ps(_mm_cmplt_ps(x, _mm_set1_ps(bound))) != 0;
#else
    for (int i = 0; i < RELUME_LANES; ++i) {
        if (x[i] < bound) {
            return true;
        }
    }
    return false;
#endif
}

// exp(x) for -87 <= x <= 0, relative error below 4e-6; exactly 1 at 0. 2^n in the exponent's bits
// times a polynomial for 2^f, |f| <= 1/2 (minimax fit with constant term 1). Elsewhere the result
// is any bits.
inline Floats Exp(Floats x) {
    constexpr float kRound =
        12582912.0f;  // 1.5 x 2^23: adding it leaves the nearest integer in the low bits
    const Floats t = x * 1.44269504f;
    const Floats rounded = t + kRound;
    const Floats f = t - (rounded - kRound);
    Floats p = f * 0.00132647271f + 0.00967151265f;
    p = p * f + 0.0555073374f;
    p = p * f + 0.240222421f;
    p = p * f + 0.693146978f;
    p = p * f + 1.0f;
    return (Floats)((Bits)p + ((Bits)rounded << 23));
}

// Weights below exp(-cut) are 0: they are under the last bit of a sum that has the centre's 1 in
// it, and products with them could become denormal numbers, which are slow.
inline Floats ExpOfMinus(Floats e, float cut) { return e < cut ? Exp(-e) : Floats{}; }

}  // namespace
}  // namespace relume::denoise
