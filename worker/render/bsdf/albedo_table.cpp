#include "worker/render/bsdf/albedo_table.h"

#include <array>
#include <cmath>

#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/ggx.h"
#include "worker/render/sampler/sobol.h"

namespace relume::render {
namespace {

constexpr int kSize = AlbedoRow::kSize;

struct Table {
    std::array<std::array<Albedo, kSize>, kSize> rows;  // [roughness][cosine]
    std::array<Albedo, kSize> means;
};

// Mean of G2/G1 over visible normals, split by Schlick's weight; 256 Hammersley points.
Albedo Integrate(float roughness, float cos_theta) {
    const float alpha = roughness * roughness;
    if (alpha < ggx::kSmallestAlpha) {
        const float f = SchlickWeight(cos_theta);
        return {1 - f, f};
    }
    constexpr std::uint32_t kPoints = 256;
    const float c = std::max(cos_theta, 1e-3f);
    const Vec3f wo{std::sqrt(1 - c * c), 0, c};
    double a = 0, b = 0;
    for (std::uint32_t i = 0; i < kPoints; ++i) {
        const Vec2f u{(static_cast<float>(i) + 0.5f) / kPoints,
                      static_cast<float>(ReverseBits(i)) * 0x1p-32f + 0.5f / kPoints};
        const Vec3f m = ggx::SampleVisibleNormal(wo, alpha, u);
        const Vec3f wi = Reflect(wo, m);
        if (wi.z <= 0) {
            continue;
        }
        const double g = 4 * c * wi.z * ggx::Visibility(wo, wi, alpha) / ggx::G1(wo, alpha);
        const double f = SchlickWeight(Dot(wo, m));
        a += g * (1 - f);
        b += g * f;
    }
    return {static_cast<float>(a / kPoints), static_cast<float>(b / kPoints)};
}

const Table& GetTable() {
    static const Table table = [] {
        Table t{};
        for (int r = 0; r < kSize; ++r) {
            auto& row = t.rows[static_cast<std::size_t>(r)];
            for (int c = 0; c < kSize; ++c) {
                row[static_cast<std::size_t>(c)] = Integrate(static_cast<float>(r) / (kSize - 1),
                                                             static_cast<float>(c) / (kSize - 1));
            }
            // 2 x integral of the piecewise linear function times the cosine, exactly: what is
            // normalised by it then conserves energy with the same interpolation.
            double a = 0, b = 0;
            const double h = 1.0 / (kSize - 1);
            for (std::size_t c = 0; c + 1 < kSize; ++c) {
                const double mu = static_cast<double>(c) * h;
                const double w0 = h * (mu / 2 + h / 6), w1 = h * (mu / 2 + h / 3);
                a += 2 * (w0 * row[c].a + w1 * row[c + 1].a);
                b += 2 * (w0 * row[c].b + w1 * row[c + 1].b);
            }
            t.means[static_cast<std::size_t>(r)] = {static_cast<float>(a), static_cast<float>(b)};
        }
        return t;
    }();
    return table;
}
const Table& kTable = GetTable();

}  // namespace

AlbedoRow::AlbedoRow(float roughness) {
    const float x = std::clamp(roughness, 0.0f, 1.0f) * (kSize - 1);
    const int i = std::min(static_cast<int>(x), kSize - 2);
    const std::size_t row = static_cast<std::size_t>(i);
    lower_ = kTable.rows[row].data();
    upper_ = kTable.rows[row + 1].data();
    weight_ = x - static_cast<float>(i);
    const Albedo m0 = kTable.means[row], m1 = kTable.means[row + 1];
    mean_ = {m0.a + weight_ * (m1.a - m0.a), m0.b + weight_ * (m1.b - m0.b)};
}

}  // namespace relume::render
