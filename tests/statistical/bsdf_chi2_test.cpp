#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/chi2.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/registry.h"

namespace relume::render {
namespace {

struct Case {
    const char* name;
    CompiledMaterial material;
    bool front = true;
    Vec3f shading_normal{0, 0, 1};  // of a surface whose triangle has normal +z
    Vec3f coat_normal{0, 0, 0};     // 0: the shading normal
};

CompiledMaterial Metal(float metallic, float roughness) {
    CompiledMaterial m;
    m.model = Model::kMetallicRoughness;
    m.base_color = {0.8f, 0.5f, 0.3f};
    m.metallic = metallic;
    m.roughness = roughness;
    return m;
}

// Plastic that lets some light through.
CompiledMaterial HalfGlass(float ior, float roughness, bool thin, float transmission) {
    CompiledMaterial m = Metal(0, roughness);
    m.has_glass = true;
    m.ior = ior;
    m.thin = thin;
    m.transmission = transmission;
    return m;
}

// Made as scenes make them.
CompiledMaterial Make(const char* type,
                      std::vector<std::pair<const char*, std::vector<float>>> params) {
    Scene scene;
    Material material{"m", type, {}, "m"};
    for (auto& [name, value] : params) {
        material.params.Set(name, value);
    }
    scene.materials.push_back(material);
    return CompileMaterials(scene).front();
}

CompiledMaterial Glass(float ior, float roughness) {
    return Make("dielectric", {{"ior", {ior}}, {"roughness", {roughness}}});
}

std::vector<Case> Cases() {
    const Vec3f tilted = Normalize({0.3f, 0.2f, 1});
    const CompiledMaterial diffuse;
    const std::vector<float> base{0.8f, 0.5f, 0.3f};
    const auto layered = [&](float coat, float coat_roughness, float sheen, float metallic) {
        return Make("metallic_roughness", {{"base_color", base},
                                           {"roughness", {0.5f}},
                                           {"metallic", {metallic}},
                                           {"clearcoat", {coat}},
                                           {"clearcoat_roughness", {coat_roughness}},
                                           {"sheen_color", {sheen, sheen, 0.5f * sheen}},
                                           {"sheen_roughness", {0.4f}}});
    };
    const auto coated = [&](float u, float v) {
        return Make("coated_diffuse", {{"base_color", base}, {"alpha_u", {u}}, {"alpha_v", {v}}});
    };
    const auto coated_metal = [&](float alpha, float conductor) {
        return Make("coated_conductor", {{"alpha_u", {alpha}},
                                         {"conductor_alpha_u", {conductor}},
                                         {"conductor_alpha_v", {0.5f * conductor}}});
    };
    std::vector<Case> cases = {
        {"diffuse", diffuse},
        {"diffuse, tilted normal", diffuse, true, tilted},
        {"Oren and Nayar", Make("diffuse", {{"base_color", base}, {"sigma", {30}}})},
        {"diffuse transmission",
         Make("diffuse_transmission",
              {{"base_color", {0.4f, 0.3f, 0.2f}}, {"transmittance", {0.1f, 0.3f, 0.3f}}})},
        {"rough plastic", Metal(0, 0.5f)},
        {"smooth plastic (mirror over diffuse)", Metal(0, 0)},
        {"rough metal", Metal(1, 0.6f)},
        {"glossy metal", Metal(1, 0.35f)},
        {"very rough metal, tilted normal", Metal(1, 1), true, tilted},
        {"half metal", Metal(0.5f, 0.4f)},
        {"plastic with specular",
         Make("metallic_roughness", {{"base_color", base},
                                     {"metallic", {0.2f}},
                                     {"roughness", {0.5f}},
                                     {"specular", {0.6f}},
                                     {"specular_color", {1, 0.4f, 0.2f}}})},
        {"rough glass from outside", Glass(1.5f, 0.5f)},
        {"rough glass from inside", Glass(1.5f, 0.5f), false},
        {"rough glass, tilted normal", Glass(1.5f, 0.6f), true, tilted},
        {"anisotropic glass",
         Make("dielectric", {{"alpha_u", {0.2f}}, {"alpha_v", {0.6f}}, {"reflect", base}})},
        {"rough thin glass", HalfGlass(1.5f, 0.5f, true, 1)},
        {"half transmitting plastic", HalfGlass(1.4f, 0.5f, true, 0.5f)},
        {"half transmitting solid plastic", HalfGlass(1.4f, 0.5f, false, 0.5f)},
        {"conductor", Make("conductor", {{"alpha_u", {0.3f}}})},
        {"anisotropic conductor",
         Make("conductor", {{"reflectance", base}, {"alpha_u", {0.2f}}, {"alpha_v", {0.6f}}})},
        {"smooth coat over diffuse", coated(0, 0)},
        {"rough coat over diffuse", coated(0.3f, 0.3f)},
        {"anisotropic coat over diffuse", coated(0.2f, 0.5f)},
        {"rough coat over metal", coated_metal(0.3f, 0.3f)},
        {"smooth coat over rough metal", coated_metal(0, 0.4f)},
        {"clear coat over plastic", layered(1, 0.5f, 0, 0)},
        {"half a smooth clear coat over metal", layered(0.5f, 0, 0, 1)},
        {"sheen", layered(0, 0, 0.9f, 0)},
        {"clear coat over sheen over half metal", layered(0.8f, 0.4f, 0.5f, 0.5f)},
    };
    Case turned{"clear coat with its own normal", layered(1, 0.4f, 0, 0.5f)};
    turned.coat_normal = Normalize({-0.3f, 0.1f, 1});
    cases.push_back(turned);
    return cases;
}

Bsdf At(const Case& c, Vec3f wo) {
    ShadingFrame at;
    at.frame = Frame::FromZ(c.shading_normal);
    at.geometric = {0, 0, 1};
    at.front = c.front;
    at.coat = c.coat_normal;
    return Bsdf(c.material, TextureSet(), {}, at, wo);
}

Vec3f Direction(float theta, float phi) {
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

constexpr float kThetas[] = {0.1f, 0.7f, 1.3f};

TEST(BsdfChi2, SampleFollowsPdf) {
    const int tests = static_cast<int>(Cases().size() * std::size(kThetas));
    for (const Case& c : Cases()) {
        for (const float theta : kThetas) {
            const Bsdf bsdf = At(c, Direction(theta, 0.4f));
            const double p = test::TestSphereSampler({[&](Vec2f u, float choice, Vec3f* d) {
                                                          const auto s = bsdf.Sample(u, choice);
                                                          if (!s || s->pdf == 0) {
                                                              return false;
                                                          }
                                                          *d = s->wi;
                                                          return true;
                                                      },
                                                      [&](Vec3f d) { return bsdf.Pdf(d); }},
                                                     100000);
            EXPECT_GT(p, test::SignificanceOf(tests)) << c.name << " at " << theta;
        }
    }
}

TEST(BsdfSample, WeightAndPdfAreThoseOfEvaluate) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> uniform(0, 0.999999f);
    for (const Case& c : Cases()) {
        const Bsdf bsdf = At(c, Direction(0.6f, 1.1f));
        for (int i = 0; i < 1000; ++i) {
            const auto s = bsdf.Sample({uniform(random), uniform(random)}, uniform(random));
            if (!s || s->pdf == 0) {
                continue;
            }
            const BsdfValue v = bsdf.Evaluate(s->wi);
            // World to local and back costs a few bits; sharp lobes magnify them.
            EXPECT_NEAR(v.pdf, s->pdf, 2e-3f * s->pdf + 1e-6f) << c.name;
            const float cosine = std::abs(Dot(c.shading_normal, s->wi));
            for (int k = 0; k < 3; ++k) {
                EXPECT_NEAR(v.f[k] * cosine, s->weight[k] * s->pdf,
                            2e-3f * s->weight[k] * s->pdf + 1e-6f)
                    << c.name;
            }
        }
    }
}

TEST(BsdfEnergy, IsConserved) {
    // Albedo by sampling, all lobes: at most 1 whatever the roughness; and 1 for white surfaces
    // that lose nothing.
    std::mt19937 random(4);
    std::uniform_real_distribution<float> uniform(0, 0.999999f);
    const auto albedo = [&](CompiledMaterial m, float theta, bool front) {
        m.base_color = {1, 1, 1};
        const Bsdf bsdf = At({"", m, front}, Direction(theta, 0.4f));
        double sum = 0;
        constexpr int kSamples = 40000;
        for (int i = 0; i < kSamples; ++i) {
            if (const auto s = bsdf.Sample({uniform(random), uniform(random)}, uniform(random))) {
                sum +=
                    s->weight.y * s->eta2;  // without the scaling of radiance, power is conserved
            }
        }
        return sum / kSamples;
    };
    for (const float theta : {0.05f, 0.5f, 1.0f, 1.4f, 1.5f}) {
        for (const float roughness : {0.0f, 0.02f, 0.1f, 0.3f, 0.6f, 1.0f}) {
            // White metal and white plastic lose nothing: 1, up to noise and the albedo table's
            // grid.
            EXPECT_NEAR(albedo(Metal(1, roughness), theta, true), 1, 0.015)
                << theta << " " << roughness;
            EXPECT_NEAR(albedo(Metal(0, roughness), theta, true), 1, 0.015)
                << theta << " " << roughness;
            // Nor does white under a coat.
            const float alpha = roughness * roughness;
            EXPECT_NEAR(albedo(Make("coated_diffuse", {{"alpha_u", {alpha}}}), theta, true), 1,
                        0.015)
                << theta << " " << roughness;
            for (const bool front : {true, false}) {
                // Rough glass scatters once only: it may lose, never gain.
                const double glass = albedo(Glass(1.5f, roughness), theta, front);
                EXPECT_LT(glass, 1.01) << theta << " " << roughness;
                EXPECT_GT(glass, roughness < 0.15f ? 0.95 : 0.4) << theta << " " << roughness;
                EXPECT_LT(albedo(HalfGlass(1.5f, roughness, true, 1), theta, front), 1.01);
            }
        }
        // What is perfectly specular or Lambertian keeps all of it.
        const std::vector<float> white{1, 1, 1};
        const std::pair<const char*, CompiledMaterial> exact[] = {
            {"mirror", Make("conductor", {{"reflectance", white}})},
            {"glass", Make("dielectric", {})},
            {"pane", Make("thin_dielectric", {})},
            {"both sides", Make("diffuse_transmission", {{"base_color", {0.3f, 0.3f, 0.3f}},
                                                         {"transmittance", {0.7f, 0.7f, 0.7f}}})},
        };
        for (const auto& [name, material] : exact) {
            EXPECT_NEAR(albedo(material, theta, true), 1, 2e-3) << name << " " << theta;
        }
        for (const Case& c : Cases()) {
            if (c.shading_normal.z != 1) {
                continue;  // may gain
            }
            const double sum = albedo(c.material, theta, c.front);
            EXPECT_LT(sum, c.name == std::string("anisotropic coat over diffuse") ? 1.03 : 1.015)
                << c.name << " " << theta;
            EXPECT_GT(sum, 0.2) << c.name << " " << theta;
        }
    }
}

TEST(BsdfEval, IsReciprocal) {
    // f(wo, wi) = f(wi, wo) for reflection; for refraction the ratio is the square of the relative
    // index.
    std::mt19937 random(5);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (const Case& c : Cases()) {
        if (c.shading_normal.z != 1 || !(c.coat_normal == Vec3f{})) {
            continue;  // shading normals break reciprocity: Veach 1997, 5.3
        }
        for (int i = 0; i < 300; ++i) {
            const Vec3f a = Direction(1.4f * uniform(random), 6.28f * uniform(random));
            const Vec3f b = Direction(1.4f * uniform(random), 6.28f * uniform(random));
            const Rgb ab = At(c, a).Eval(b), ba = At(c, b).Eval(a);
            for (int k = 0; k < 3; ++k) {
                EXPECT_NEAR(ab[k], ba[k], 1e-3f * (ab[k] + 1e-3f)) << c.name;
            }
            // Through the surface: seen from b, which lies below, the frame is upside down.
            Case below = c;
            below.front = !c.front;
            const Vec3f flipped{a.x, -a.y, -a.z};  // turned about the x axis
            const Rgb through = At(c, b).Eval(flipped);
            const Rgb back = At(below, {flipped.x, -flipped.y, -flipped.z}).Eval({b.x, -b.y, -b.z});
            const float eta = c.material.thin ? 1 : c.front ? c.material.ior : 1 / c.material.ior;
            for (int k = 0; k < 3; ++k) {
                // Radiance is scaled by the square of the relative index (Veach 1997, 5.2).
                EXPECT_NEAR(through[k] * eta * eta, back[k], 1e-2f * (back[k] + 1e-3f)) << c.name;
            }
        }
    }
}

}  // namespace
}  // namespace relume::render
