#include "worker/render/light/sphere_map.h"

#include <fmt/format.h>
#include <immintrin.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "worker/render/sampler/warp.h"

namespace relume::render {
namespace {

constexpr float kLargest = 65504;    // of a 16-bit float: what an infinity in a map is taken for
constexpr int kLargestSide = 65535;  // tables of environments count with 16 bits

}  // namespace

SphereMap::SphereMap(const Scene& scene, int image_index, Rgb scale) {
    const SceneImage& image = scene.images.at(static_cast<std::size_t>(image_index));
    if (image.floats.empty() || image.width < 1 || image.height < 1 || image.width > kLargestSide ||
        image.height > kLargestSide) {
        ThrowInvalidArgument(
            fmt::format("{}: a map of directions must hold floats (HDR, EXR), at most {} "
                        "pixels a side",
                        image.name, kLargestSide));
    }
    width_ = image.width;
    height_ = image.height;
    const std::size_t w = static_cast<std::size_t>(width_), h = static_cast<std::size_t>(height_);
    const std::size_t channels = static_cast<std::size_t>(image.channels);
    texels_.resize(w * h);
    double sines = 0;
    for (std::size_t y = 0; y < h; ++y) {
        const float sine =
            SinCosTurn(0.5f * (static_cast<float>(y) + 0.5f) / static_cast<float>(h)).sin;
        for (std::size_t x = 0; x < w; ++x) {
            const float* in = image.floats.data() + (y * w + x) * channels;
            Rgb c{in[0], in[channels >= 3 ? 1 : 0], in[channels >= 3 ? 2 : 0]};
            for (int k = 0; k < 3; ++k) {
                if (!(c[k] >= 0 && c[k] <= std::numeric_limits<float>::max())) {
                    c[k] = c[k] > 0 ? kLargest : 0;
                    ++repaired_;
                }
            }
            c *= scale;
            const float weight = Average(c) * sine;
            texels_[y * w + x] = {c.x, c.y, c.z, weight};
            sum_ += weight;
        }
        sines += static_cast<double>(sine) * static_cast<double>(w);
    }
    mean_ = sum_ / sines;
}

double SphereMap::solid_angle_scale() const {
    return 2 * kPi * static_cast<double>(kPi) / static_cast<double>(texels_.size());
}

SphereMap::Footprint SphereMap::FootprintOf(float x, float y) const {
    x -= 0.5f;
    y -= 0.5f;
    const float fx = std::floor(x), fy = std::floor(y);
    Footprint f;
    f.x0 = static_cast<int>(fx);
    f.y0 = static_cast<int>(fy);
    f.x1 = f.x0 + 1;
    f.y1 = f.y0 + 1;
    f.x0 = f.x0 < 0 ? width_ - 1 : std::min(f.x0, width_ - 1);
    f.x1 = f.x1 >= width_ ? 0 : f.x1;
    f.y0 = std::clamp(f.y0, 0, height_ - 1);
    f.y1 = std::clamp(f.y1, 0, height_ - 1);
    f.tx = x - fx;
    f.ty = y - fy;
    return f;
}

Rgba SphereMap::Interpolate(float x, float y) const {
    const Footprint f = FootprintOf(x, y);
    const auto at = [&](int column, int row) { return _mm_load_ps(&At(column, row).r); };
    const auto mix = [](__m128 a, __m128 b, float t) {
        return _mm_add_ps(a, _mm_mul_ps(_mm_sub_ps(b, a), _mm_set1_ps(t)));
    };
    Rgba out;
    _mm_store_ps(&out.r, mix(mix(at(f.x0, f.y0), at(f.x1, f.y0), f.tx),
                             mix(at(f.x0, f.y1), at(f.x1, f.y1), f.tx), f.ty));
    return out;
}

void SphereMap::Prefetch(float x, float y) const {
    const Footprint f = FootprintOf(x, y);
    for (const int row : {f.y0, f.y1}) {
        _mm_prefetch(reinterpret_cast<const char*>(&At(f.x0, row)), _MM_HINT_T0);
        _mm_prefetch(reinterpret_cast<const char*>(&At(f.x1, row)), _MM_HINT_T0);
    }
}

}  // namespace relume::render
