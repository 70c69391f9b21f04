// Texture lookups: where a uv falls, and bilinear interpolation of four texels in one SSE register.
#include <immintrin.h>

#include <array>
#include <cmath>

#include "worker/render/texture/texture_set.h"

namespace relume::render {
namespace {

// Entries 0 to 255: sRGB decoded (IEC 61966-2-1); 256 to 511: n / 255 for alpha.
const std::array<float, 512>& DecodeTable() {
    static const std::array<float, 512> table = [] {
        std::array<float, 512> t{};
        for (std::size_t i = 0; i < 256; ++i) {
            const double v = static_cast<double>(i) / 255;
            t[i] =
                static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
            t[256 + i] = static_cast<float>(v);
        }
        return t;
    }();
    return table;
}
const float* const kDecode = DecodeTable().data();

// The two texels on either side of a coordinate, and the weight of the second.
struct Span {
    int i0, i1;
    float weight;
};

Span Locate(float t, int size, WrapMode wrap, bool nearest) {
    switch (wrap) {
        case WrapMode::kRepeat:
            t -= std::floor(t);
            break;
        case WrapMode::kClamp:
            t = std::min(std::max(t, 0.0f), 1.0f);
            break;
        case WrapMode::kMirror: {
            t -= 2 * std::floor(0.5f * t);
            t = t > 1 ? 2 - t : t;
            break;
        }
    }
    t = t >= 0 && t <= 1 ? t : 0;  // infinite coordinates come out as NaN
    const float x = t * static_cast<float>(size);
    if (nearest) {
        const int i = std::min(static_cast<int>(x), size - 1);
        return {i, i, 0};
    }
    const float low = std::floor(x - 0.5f);
    Span span{static_cast<int>(low), static_cast<int>(low) + 1, x - 0.5f - low};
    if (span.i0 < 0) {
        span.i0 = wrap == WrapMode::kRepeat ? size - 1 : 0;
    }
    if (span.i1 >= size) {
        span.i1 = wrap == WrapMode::kRepeat ? 0 : size - 1;
    }
    return span;
}

struct Footprint {
    Span u, v;
};

Footprint Locate(const TextureView& t, Vec2f uv) {
    if (t.transformed) {
        uv = {t.m[0] * uv.x + t.m[1] * uv.y + t.m[2], t.m[3] * uv.x + t.m[4] * uv.y + t.m[5]};
    }
    return {Locate(uv.x, t.width, t.wrap_u, t.nearest),
            Locate(uv.y, t.height, t.wrap_v, t.nearest)};
}

const std::uint8_t* Texel(const TextureView& t, int x, int y) {
    const int block = (y >> 2) * t.blocks_per_row + (x >> 2);
    return t.bytes + 4 * (static_cast<std::size_t>(block) * 16 +
                          static_cast<std::size_t>((y & 3) * 4 + (x & 3)));
}

__m128 Decode(const TextureView& t, int x, int y) {
    if (t.floats != nullptr) {
        return _mm_load_ps(
            &t.floats[static_cast<std::size_t>(y) * static_cast<std::size_t>(t.width) +
                      static_cast<std::size_t>(x)]
                 .r);
    }
    const std::uint8_t* texel = Texel(t, x, y);
    if (t.srgb) {  // four loads: a gather instruction is slower
        return _mm_setr_ps(kDecode[texel[0]], kDecode[texel[1]], kDecode[texel[2]],
                           kDecode[256 + texel[3]]);
    }
    const __m128i codes = _mm_cvtepu8_epi32(_mm_loadu_si32(texel));
    return _mm_mul_ps(_mm_cvtepi32_ps(codes), _mm_set1_ps(1.0f / 255));
}

const std::uint8_t* PackTexel(const TextureView& t, int x, int y) {
    const int block = (y >> 1) * t.blocks_per_row + (x >> 2);
    return t.bytes + 8 * (static_cast<std::size_t>(block) * 8 +
                          static_cast<std::size_t>((y & 1) * 4 + (x & 3)));
}

__m256 DecodePack(const TextureView& t, int x, int y) {
    const std::uint8_t* texel = PackTexel(t, x, y);
    const __m256i codes = _mm256_cvtepu8_epi32(_mm_loadu_si64(texel));
    const __m256 linear = _mm256_mul_ps(_mm256_cvtepi32_ps(codes), _mm256_set1_ps(1.0f / 255));
    const __m128 base = _mm_setr_ps(kDecode[texel[0]], kDecode[texel[1]], kDecode[texel[2]], 0);
    return _mm256_blend_ps(linear, _mm256_castps128_ps256(base), 0b00000111);
}

__m128 Mix(__m128 a, __m128 b, float t) {
    return _mm_add_ps(a, _mm_mul_ps(_mm_sub_ps(b, a), _mm_set1_ps(t)));
}
__m256 Mix(__m256 a, __m256 b, float t) {
    return _mm256_add_ps(a, _mm256_mul_ps(_mm256_sub_ps(b, a), _mm256_set1_ps(t)));
}

// The nearest texel, or four of them bilinearly. decode(t, x, y): all channels of one.
template <class DecodeTexel>
auto Interpolate(const TextureView& t, Vec2f uv, DecodeTexel decode) {
    const Footprint f = Locate(t, uv);
    const auto first = decode(t, f.u.i0, f.v.i0);
    if (t.nearest) {
        return first;
    }
    const auto upper = Mix(first, decode(t, f.u.i1, f.v.i0), f.u.weight);
    const auto lower = Mix(decode(t, f.u.i0, f.v.i1), decode(t, f.u.i1, f.v.i1), f.u.weight);
    return Mix(upper, lower, f.v.weight);
}

}  // namespace

Rgba TextureSet::Lookup(TextureId id, Vec2f uv) const {
    Rgba out;
    _mm_store_ps(&out.r, Interpolate(views_[static_cast<std::size_t>(id)], uv, Decode));
    return out;
}

SurfaceTexels TextureSet::LookupPack(int pack, Vec2f uv) const {
    alignas(32) float v[8];
    _mm256_store_ps(v, Interpolate(packs_[static_cast<std::size_t>(pack)], uv, DecodePack));
    return {{v[0], v[1], v[2]}, {v[4], v[5], v[3]}, v[6], v[7]};
}

void TextureSet::PrefetchPack(int pack, Vec2f uv) const {
    const TextureView& t = packs_[static_cast<std::size_t>(pack)];
    const Footprint f = Locate(t, uv);
    _mm_prefetch(reinterpret_cast<const char*>(PackTexel(t, f.u.i0, f.v.i0)), _MM_HINT_T0);
    _mm_prefetch(reinterpret_cast<const char*>(PackTexel(t, f.u.i1, f.v.i1)), _MM_HINT_T0);
}

Vec2f TextureSet::TexelSize(TextureId id) const {
    const TextureView& t = views_[static_cast<std::size_t>(id)];
    const float u = std::max(std::abs(t.m[0]), std::abs(t.m[3]));
    const float v = std::max(std::abs(t.m[1]), std::abs(t.m[4]));
    return {1 / (static_cast<float>(t.width) * (u > 0 ? u : 1)),
            1 / (static_cast<float>(t.height) * (v > 0 ? v : 1))};
}

void TextureSet::Prefetch(TextureId id, Vec2f uv) const {
    const TextureView& t = views_[static_cast<std::size_t>(id)];
    if (t.bytes == nullptr) {
        return;
    }
    const Footprint f = Locate(t, uv);
    _mm_prefetch(reinterpret_cast<const char*>(Texel(t, f.u.i0, f.v.i0)), _MM_HINT_T0);
    _mm_prefetch(reinterpret_cast<const char*>(Texel(t, f.u.i1, f.v.i1)), _MM_HINT_T0);
}

}  // namespace relume::render
