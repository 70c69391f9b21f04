#pragma once

#include <algorithm>
#include <vector>

namespace relume::render {

// Directional albedo of the reflection by a dielectric interface of GGX roughness, seen from
// outside, single scattering: linear in the square root of alpha and in the square root of the
// cosine. A smooth interface (alpha below ggx::kSmallestAlpha) is Fresnel's formula.
class CoatTable {
  public:
    explicit CoatTable(float ior);

    // The table at one alpha.
    class Row {
      public:
        Row() = default;
        float At(float cos_theta) const;
        // Cosine-weighted mean over the hemisphere.
        float Mean() const { return mean_; }

      private:
        friend class CoatTable;
        const float* lower_ = nullptr;  // null: smooth
        const float* upper_ = nullptr;
        float weight_ = 0, mean_ = 0, ior_ = 1.5f;
    };
    Row At(float alpha) const;
    float ior() const { return ior_; }

    static constexpr int kCosines = 32, kAlphas = 16;

  private:
    float ior_, smooth_mean_ = 0;
    std::vector<float> albedos_;  // [alpha][cosine]
    std::vector<float> means_;
};

}  // namespace relume::render
