#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/film/moments.h"
#include "core/math/frame.h"
#include "tests/support/lit.h"
#include "tests/support/scenes.h"
#include "worker/render/bsdf/bsdf.h"

namespace relume::render {
namespace {

// Light reflected at the origin (normal +z) towards `wo`, estimated in three ways that must agree.
struct Estimates {
    Moments by_light, by_bsdf, by_both;
};

Estimates Estimate(const test::Lit& lit, const CompiledMaterial& material, Vec3f wo, int samples) {
    ShadingFrame at;
    at.frame = Frame::FromZ({0, 0, 1});
    at.geometric = {0, 0, 1};
    const Bsdf bsdf(material, lit.textures, {}, at, wo);
    std::mt19937 random(11);
    std::uniform_real_distribution<float> uniform(0, 0.999999f);
    const auto pair = [&] { return Vec2f{uniform(random), uniform(random)}; };
    const LightReceiver origin{{0, 0, 0}, bsdf.normal(), material.Transmits()};
    Estimates e;
    for (int i = 0; i < samples; ++i) {
        // A direction towards a light.
        double light = 0, light_weight = 0;
        const auto s = lit.lights.Sample(origin, static_cast<std::uint32_t>(random()), pair());
        if (s) {
            Ray ray;
            ray.direction = s->wi;
            ray.far = s->distance * 0.9999f;
            if (!lit.accel.Occluded(ray)) {
                const BsdfValue value = bsdf.Evaluate(s->wi);
                light = value.f.y * s->radiance.y * std::abs(s->wi.z) / s->pdf;
                light_weight = PowerHeuristic(s->pdf, value.pdf);
            }
        }
        // A direction of the material.
        double found = 0, found_weight = 0;
        if (const auto b = bsdf.Sample(pair(), uniform(random))) {
            Ray ray;
            ray.direction = b->wi;
            Hit hit;
            float pdf = 0;
            if (lit.accel.Intersect(ray, &hit)) {
                const Object& object = lit.accel.objects()[hit.object];
                if (object.first_light >= 0 && Dot(hit.normal, b->wi) < 0) {
                    found = b->weight.y * lit.materials[object.material].emissive.y;
                    pdf =
                        lit.lights.AreaPdf(origin, object, hit.triangle, hit.t, b->wi, hit.normal);
                }
            } else {
                found = b->weight.y * lit.lights.Environment(b->wi, &pdf).y;
            }
            found_weight = PowerHeuristic(b->pdf, pdf);
        }
        e.by_light.Add(light);
        e.by_bsdf.Add(found);
        e.by_both.Add(light * light_weight + found * found_weight);
    }
    return e;
}

void ExpectAgree(const Moments& a, const Moments& b, const char* what) {
    const double error = std::sqrt(a.MeanVariance() + b.MeanVariance());
    EXPECT_NEAR(a.mean, b.mean, 3.5 * error) << what;
    EXPECT_LT(error, 0.03 * b.mean) << what << ": too noisy to tell anything";
}

TEST(Mis, LightSamplingMaterialSamplingAndBothAgree) {
    Scene scene;
    scene.materials = {test::Diffuse({0, 0, 0}, {4, 4, 4}), test::Diffuse({0.5f, 0.5f, 0.5f})};
    test::AddMesh(&scene, test::Quad({-1, -1, 2}, {-1, 1, 2}, {1, 1, 2}, {1, -1, 2}, 0));
    test::AddMesh(&scene, test::Sphere(1, 8),  // throws a shadow
                  Transform::Translate({1.5f, 0, 1}) * Transform::Scale({0.3f, 0.3f, 0.3f}));
    test::SetEnvironment(&scene, {0.5f, 0.5f, 0.5f});
    const test::Lit lit(scene);
    CompiledMaterial glossy;
    glossy.model = Model::kMetallicRoughness;
    glossy.base_color = {0.8f, 0.6f, 0.4f};
    for (const float metallic : {0.0f, 1.0f}) {
        for (const float roughness : {0.4f, 0.7f}) {
            glossy.metallic = metallic;
            glossy.roughness = roughness;
            const Estimates e = Estimate(lit, glossy, Normalize({0.4f, 0.1f, 1}), 150000);
            ExpectAgree(e.by_light, e.by_both, "light sampling against both");
            ExpectAgree(e.by_bsdf, e.by_both, "material sampling against both");
            EXPECT_LT(e.by_both.SampleVariance(),
                      std::min(e.by_light.SampleVariance(), e.by_bsdf.SampleVariance()) * 1.5);
        }
    }
    // Every other model that has no perfectly specular part.
    const std::vector<float> color{0.8f, 0.5f, 0.3f};
    Scene others;
    const auto add = [&](const char* type,
                         std::vector<std::pair<const char*, std::vector<float>>> params) {
        Material material{type, type, {}, type};
        for (auto& [name, value] : params) {
            material.params.Set(name, value);
        }
        others.materials.push_back(material);
    };
    add("diffuse", {{"base_color", color}, {"sigma", {30}}});
    add("coated_diffuse", {{"base_color", color}, {"alpha_u", {0.3f}}, {"alpha_v", {0.5f}}});
    add("conductor", {{"reflectance", color}, {"alpha_u", {0.5f}}, {"alpha_v", {0.3f}}});
    add("coated_conductor", {{"alpha_u", {0.4f}}, {"conductor_alpha_u", {0.4f}}});
    add("dielectric", {{"alpha_u", {0.5f}}, {"alpha_v", {0.6f}}});
    add("diffuse_transmission", {{"base_color", color}, {"transmittance", {0.1f, 0.3f, 0.5f}}});
    add("metallic_roughness", {{"base_color", color},
                               {"roughness", {0.6f}},
                               {"clearcoat", {0.8f}},
                               {"clearcoat_roughness", {0.6f}},
                               {"sheen_color", color},
                               {"sheen_roughness", {0.5f}}});
    for (const CompiledMaterial& material : CompileMaterials(others)) {
        const Estimates e = Estimate(lit, material, Normalize({0.4f, 0.1f, 1}), 100000);
        ExpectAgree(e.by_light, e.by_both, "light sampling against both");
        ExpectAgree(e.by_bsdf, e.by_both, "material sampling against both");
    }
}

TEST(Mis, ManyNearLightsAgree) {
    // More than one node of the tree, drawn from by solid angle and by area, some below the
    // horizon, and seen through a surface that lets light in from behind.
    Scene scene;
    scene.materials = {test::Diffuse({0, 0, 0}, {4, 4, 4}), test::Diffuse({0, 0, 0}, {9, 9, 9})};
    scene.materials[1].params.Set("double_sided", true);
    std::mt19937 random(3);
    std::uniform_real_distribution<float> uniform(-1, 1);
    for (int i = 0; i < 24; ++i) {
        const Vec3f middle =
            Normalize({uniform(random), uniform(random), uniform(random)}) * (1.5f + 0.1f * i);
        const Frame f = Frame::FromZ(
            Normalize(-middle + Vec3f{uniform(random), uniform(random), uniform(random)}));
        const Vec3f u = f.x * 0.8f, v = f.y * 0.7f;
        test::AddMesh(&scene,
                      test::Quad(middle - u - v, middle + u - v, middle + u + v,
                                 i % 3 == 0 ? middle - u + v : middle - u * 0.5f + v, i % 2));
    }
    const test::Lit lit(scene);
    CompiledMaterial glossy;
    glossy.model = Model::kMetallicRoughness;
    glossy.base_color = {0.8f, 0.6f, 0.4f};
    glossy.roughness = 0.5f;
    CompiledMaterial leaf;
    leaf.model = Model::kDiffuseTransmission;
    leaf.base_color = {0.4f, 0.4f, 0.4f};
    leaf.transmit = {0.5f, 0.5f, 0.5f};
    for (const CompiledMaterial& material : {glossy, leaf}) {
        const Estimates e = Estimate(lit, material, Normalize({0.4f, 0.1f, 1}), 100000);
        ExpectAgree(e.by_light, e.by_both, "light sampling against both");
        ExpectAgree(e.by_bsdf, e.by_both, "material sampling against both");
    }
}

}  // namespace
}  // namespace relume::render
