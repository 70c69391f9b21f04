#include "worker/render/bsdf/coat_table.h"

#include <cmath>

#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/ggx.h"
#include "worker/render/sampler/sobol.h"

namespace relume::render {
namespace {

// Mean of Fresnel times G2/G1 over visible normals; 256 Hammersley points.
float Integrate(float alpha, float cos_theta, float ior) {
    const float c = std::max(cos_theta, 1e-3f);
    if (alpha < ggx::kSmallestAlpha) {
        return FresnelDielectric(c, ior);
    }
    constexpr std::uint32_t kPoints = 256;
    const Vec3f wo{std::sqrt(1 - c * c), 0, c};
    double sum = 0;
    for (std::uint32_t i = 0; i < kPoints; ++i) {
        const Vec2f u{(static_cast<float>(i) + 0.5f) / kPoints,
                      static_cast<float>(ReverseBits(i)) * 0x1p-32f + 0.5f / kPoints};
        const Vec3f m = ggx::SampleVisibleNormal(wo, alpha, u);
        const Vec3f wi = Reflect(wo, m);
        if (wi.z > 0) {
            sum += 4 * c * wi.z * ggx::Visibility(wo, wi, alpha) / ggx::G1(wo, alpha) *
                   FresnelDielectric(Dot(wo, m), ior);
        }
    }
    return static_cast<float>(sum / kPoints);
}

// Of f(cosine) by the midpoint rule: 2 x integral of f cos.
template <class F>
float CosineMean(F f) {
    constexpr int kSteps = 1024;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
        const float c = (static_cast<float>(i) + 0.5f) / kSteps;
        sum += 2 * static_cast<double>(c) * static_cast<double>(f(c));
    }
    return static_cast<float>(sum / kSteps);
}

}  // namespace

CoatTable::CoatTable(float ior) : ior_(ior) {
    smooth_mean_ = CosineMean([&](float c) { return FresnelDielectric(c, ior); });
    albedos_.resize(static_cast<std::size_t>(kAlphas) * kCosines);
    for (int a = 0; a < kAlphas; ++a) {
        const float root = static_cast<float>(a) / (kAlphas - 1);
        for (int c = 0; c < kCosines; ++c) {
            const float cosine = static_cast<float>(c) / (kCosines - 1);
            albedos_[static_cast<std::size_t>(a * kCosines + c)] =
                Integrate(root * root, cosine * cosine, ior);
        }
    }
    means_.resize(kAlphas);
    for (int a = 0; a < kAlphas; ++a) {
        Row row;
        row.lower_ = row.upper_ = &albedos_[static_cast<std::size_t>(a * kCosines)];
        means_[static_cast<std::size_t>(a)] = CosineMean([&](float c) { return row.At(c); });
    }
}

CoatTable::Row CoatTable::At(float alpha) const {
    Row row;
    row.ior_ = ior_;
    if (alpha < ggx::kSmallestAlpha) {
        row.mean_ = smooth_mean_;
        return row;
    }
    const float x = std::sqrt(std::min(alpha, 1.0f)) * (kAlphas - 1);
    const int i = std::min(static_cast<int>(x), kAlphas - 2);
    const std::size_t k = static_cast<std::size_t>(i);
    row.weight_ = x - static_cast<float>(i);
    row.lower_ = &albedos_[k * kCosines];
    row.upper_ = row.lower_ + kCosines;
    row.mean_ = means_[k] + row.weight_ * (means_[k + 1] - means_[k]);
    return row;
}

float CoatTable::Row::At(float cos_theta) const {
    if (lower_ == nullptr) {
        return FresnelDielectric(std::min(cos_theta, 1.0f), ior_);
    }
    const float x = std::sqrt(std::clamp(cos_theta, 0.0f, 1.0f)) * (kCosines - 1);
    const int i = std::min(static_cast<int>(x), kCosines - 2);
    const float t = x - static_cast<float>(i);
    const float low = lower_[i] + t * (lower_[i + 1] - lower_[i]);
    const float high = upper_[i] + t * (upper_[i + 1] - upper_[i]);
    return low + weight_ * (high - low);
}

}  // namespace relume::render
