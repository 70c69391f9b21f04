#pragma once

#include <algorithm>

namespace relume::render {

// Directional albedo of single-scattering GGX reflection with Schlick's Fresnel term: for
// reflectance f0 it is f0 a + b (the split of Karis 2013), so a + b is that of a perfect conductor.
struct Albedo {
    float a, b;

    // Of reflectance f0 straight on and f90 at grazing angles.
    float operator()(float f0, float f90) const { return f0 * a + f90 * b; }
    float Full() const { return a + b; }
};

// The table at one roughness: linear in roughness and in cosine.
class AlbedoRow {
  public:
    AlbedoRow() = default;
    explicit AlbedoRow(float roughness);  // sqrt of GGX's alpha, in [0, 1]

    Albedo At(float cos_theta) const {
        const float x = std::clamp(cos_theta, 0.0f, 1.0f) * (kSize - 1);
        const int i = std::min(static_cast<int>(x), kSize - 2);
        const float t = x - static_cast<float>(i);
        const float w00 = (1 - t) * (1 - weight_), w10 = t * (1 - weight_);
        const float w01 = (1 - t) * weight_, w11 = t * weight_;
        return {
            w00 * lower_[i].a + w10 * lower_[i + 1].a + w01 * upper_[i].a + w11 * upper_[i + 1].a,
            w00 * lower_[i].b + w10 * lower_[i + 1].b + w01 * upper_[i].b + w11 * upper_[i + 1].b};
    }
    // Cosine-weighted mean over the hemisphere.
    Albedo Mean() const { return mean_; }

    static constexpr int kSize = 32;

  private:
    const Albedo* lower_ = nullptr;
    const Albedo* upper_ = nullptr;
    float weight_ = 0;
    Albedo mean_{0, 0};
};

}  // namespace relume::render
