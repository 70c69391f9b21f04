#include <gtest/gtest.h>

#include "tests/support/chi2.h"
#include "worker/render/sampler/warp.h"

namespace relume::render {
namespace {

constexpr int kTests = 5;

TEST(WarpChi2, CosineHemisphere) {
    const double p = test::TestSphereSampler({[](Vec2f u, float, Vec3f* d) {
                                                  *d = SampleCosineHemisphere(u);
                                                  return true;
                                              },
                                              [](Vec3f d) { return CosineHemispherePdf(d.z); }});
    EXPECT_GT(p, test::SignificanceOf(kTests));
}

TEST(WarpChi2, Sphere) {
    const double p = test::TestSphereSampler({[](Vec2f u, float, Vec3f* d) {
                                                  *d = SampleSphere(u);
                                                  return true;
                                              },
                                              [](Vec3f) { return 1 / (4 * kPi); }});
    EXPECT_GT(p, test::SignificanceOf(kTests));
}

TEST(WarpChi2, Disk) {
    const double p =
        test::TestSquareSampler({[](Vec2f u) {
                                     return SampleDisk(u) * 0.5f + Vec2f{0.5f, 0.5f};
                                 },
                                 [](Vec2f p01) {
                                     const Vec2f q = p01 - Vec2f{0.5f, 0.5f};
                                     return q.x * q.x + q.y * q.y < 0.25f ? 4 * kInvPi : 0.0f;
                                 }},
                                50000);  // few: the rim is integrated coarsely
    EXPECT_GT(p, test::SignificanceOf(kTests));
}

TEST(WarpChi2, Triangle) {
    // Mapped onto the lower half of the unit square by its barycentrics.
    const double p = test::TestSquareSampler({[](Vec2f u) {
                                                  const Barycentric b = SampleTriangle(u);
                                                  return Vec2f{b.b1, b.b2};
                                              },
                                              [](Vec2f q) { return q.x + q.y < 1 ? 2.0 : 0.0; }},
                                             50000);
    EXPECT_GT(p, test::SignificanceOf(kTests));
}

TEST(WarpChi2, Tent) {
    const double p = test::TestSquareSampler(
        {[](Vec2f u) {
             return Vec2f{0.5f + 0.5f * SampleTent(u.x), 0.5f + 0.5f * SampleTent(u.y)};
         },
         [](Vec2f q) { return 4.0 * (1 - std::abs(2 * q.x - 1)) * (1 - std::abs(2 * q.y - 1)); }});
    EXPECT_GT(p, test::SignificanceOf(kTests));
}

TEST(WarpChi2, WrongDensityIsFound) {
    // The test itself has power: a density 3 % off in one half of the sphere is rejected.
    const double p =
        test::TestSphereSampler({[](Vec2f u, float, Vec3f* d) {
                                     *d = SampleSphere(u);
                                     return true;
                                 },
                                 [](Vec3f d) { return (d.x > 0 ? 1.03 : 0.97) / (4 * M_PI); }});
    EXPECT_LT(p, 1e-6);
}

}  // namespace
}  // namespace relume::render
