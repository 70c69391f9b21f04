#include "worker/render/light/spherical_triangle.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/chi2.h"

namespace relume::render {
namespace {

constexpr int kTests = 4;

bool Inside(Vec3f d, Vec3f a, Vec3f b, Vec3f c) {
    const float s = Dot(a, Cross(b, c)) > 0 ? 1.0f : -1.0f;
    return s * Dot(d, Cross(a, b)) >= 0 && s * Dot(d, Cross(b, c)) >= 0 &&
           s * Dot(d, Cross(c, a)) >= 0;
}

TEST(SphericalTriangle, SolidAnglesAreKnown) {
    const Vec3f x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    EXPECT_NEAR(SphericalTriangle(x, y, z).solid_angle(), kPi / 2, 1e-6f);  // an octant
    // A face of a tetrahedron about the origin: a quarter of the sphere.
    EXPECT_NEAR(
        SphericalTriangle(Normalize({1, 1, 1}), Normalize({1, -1, -1}), Normalize({-1, 1, -1}))
            .solid_angle(),
        kPi, 1e-6f);
    // A face of a cube: a sixth.
    EXPECT_NEAR(SphericalQuad(Normalize({-1, -1, 1}), Normalize({1, -1, 1}), Normalize({-1, 1, 1}),
                              Normalize({1, 1, 1}))
                    .solid_angle(),
                4 * kPi / 6, 1e-6f);
}

TEST(SphericalTriangle, IsDrawnFromUniformly) {
    const Vec3f corners[3][3] = {
        {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
        {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}},                   // obtuse angles
        {{1, 0.1f, 0.2f}, {-0.2f, 1, 0.1f}, {-1, -0.2f, 0.5f}},  // nearly half a great circle
    };
    for (const auto& corner : corners) {
        const Vec3f a = Normalize(corner[0]), b = Normalize(corner[1]), c = Normalize(corner[2]);
        const SphericalTriangle triangle(a, b, c);
        const double probability = test::TestSphereSampler(
            {[&](Vec2f u, float, Vec3f* d) {
                 *d = triangle.Sample(u);
                 return true;
             },
             [&](Vec3f d) { return Inside(d, a, b, c) ? 1.0 / triangle.solid_angle() : 0.0; }},
            50000);
        EXPECT_GT(probability, test::SignificanceOf(kTests));
    }
}

TEST(SphericalQuad, IsDrawnFromUniformly) {
    const Vec3f a = Normalize({-1, -1, 1}), b = Normalize({2, -1, 1}), c = Normalize({-1, 1, 0.5f}),
                d = Normalize({2, 1, 0.5f});
    const SphericalQuad quad(a, b, c, d);
    const double probability = test::TestSphereSampler(
        {[&](Vec2f u, float, Vec3f* w) {
             *w = quad.Sample(u);
             return true;
         },
         [&](Vec3f w) {
             return Inside(w, a, b, c) || Inside(w, d, c, b) ? 1.0 / quad.solid_angle() : 0.0;
         }},
        50000);
    EXPECT_GT(probability, test::SignificanceOf(kTests));
}

TEST(SphericalTriangle, SmallOnesStayInside) {
    // As small as they are drawn from: about 1e-3 sr, seen at a slant.
    const Vec3f a = Normalize({0, 0, 1}), b = Normalize({0.05f, 0.001f, 1}),
                c = Normalize({0.01f, 0.05f, 1.02f});
    const SphericalTriangle triangle(a, b, c);
    Vec3f mean;
    for (int i = 0; i < 1024; ++i) {
        const Vec3f d = triangle.Sample(
            {(static_cast<float>(i % 32) + 0.5f) / 32, (static_cast<float>(i / 32) + 0.5f) / 32});
        EXPECT_NEAR(Length(d), 1, 1e-6f);
        EXPECT_TRUE(Inside(d + (a + b + c) * 1e-4f, a, b, c));
        mean += d * (1.0f / 1024);
    }
    // Of a small triangle: its middle.
    EXPECT_NEAR(Length(Normalize(mean) - Normalize(a + b + c)), 0, 5e-4f);
}

}  // namespace
}  // namespace relume::render
