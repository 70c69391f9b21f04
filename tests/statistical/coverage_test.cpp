#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "core/scene/motion.h"
#include "tests/support/scenes.h"

// Things that move or are out of focus cover each pixel as long, and from as much of the lens, as
// geometry says: what shines with radiance 1 before black is seen as its coverage.
namespace relume::test {
namespace {

constexpr int kSize = 24;
constexpr std::uint32_t kSpp = 1024;

// An orthographic camera that sees x and y from -1 to 1, y up.
Camera Flat() {
    Camera camera;
    camera.type = "orthographic";
    camera.params.Set("xmag", 1.0f);
    camera.params.Set("ymag", 1.0f);
    camera.to_world = Transform::Translate({0, 0, 5});
    return camera;
}

std::shared_ptr<Scene> Shining(Mesh mesh, std::vector<Transform> motion) {
    auto scene = std::make_shared<Scene>();
    scene->materials = {Diffuse({0.5f, 0.5f, 0.5f}, {1, 1, 1})};
    mesh.material = 0;
    AddMesh(scene.get(), std::move(mesh), motion.front());
    if (motion.size() > 1) {
        scene->instances[0].motion = std::move(motion);
    }
    scene->cameras.push_back(Flat());
    return scene;
}

// Pixels' means of `inside(x, y)`, the share of the time in which the point is covered.
std::vector<double> Coverage(const std::function<double(double x, double y)>& inside) {
    constexpr int kGrid = 24;
    std::vector<double> coverage;
    for (int row = 0; row < kSize; ++row) {
        for (int column = 0; column < kSize; ++column) {
            double sum = 0;
            for (int i = 0; i < kGrid * kGrid; ++i) {
                const double x = column + (i % kGrid + 0.5) / kGrid;
                const double y = row + (i / kGrid + 0.5) / kGrid;
                sum += inside(2 * x / kSize - 1, 1 - 2 * y / kSize);
            }
            coverage.push_back(sum / (kGrid * kGrid));
        }
    }
    return coverage;
}

// Share of [0, 1] in which a point lies in a disc whose centre goes straight from a to b.
double TimeInDisc(double x, double y, Vec2f a, Vec2f b, double r) {
    const double vx = b.x - a.x, vy = b.y - a.y, px = x - a.x, py = y - a.y;
    const double aa = vx * vx + vy * vy, bb = px * vx + py * vy, cc = px * px + py * py - r * r;
    const double root = bb * bb - aa * cc;
    if (root <= 0) {
        return 0;
    }
    const double t0 = (bb - std::sqrt(root)) / aa, t1 = (bb + std::sqrt(root)) / aa;
    return std::max(0.0, std::min(t1, 1.0) - std::max(t0, 0.0));
}

// Each pixel lies within 5 standard errors of independent samples (ours are better spread) of what
// is due, and so does the mean; `slack` is what the numbers compared with may be off by.
void ExpectCoverage(const Film& film, const std::vector<double>& expected, double slack) {
    ASSERT_EQ(film.pixel_count(), expected.size());
    double sum = 0, expected_sum = 0;
    int worse_than_2 = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        const double p = std::clamp(expected[i], 0.0, 1.0), mean = film.Mean(i).x;
        const double error = std::sqrt(p * (1 - p) / kSpp);
        EXPECT_NEAR(mean, p, 5 * error + slack) << "pixel " << i % kSize << ", " << i / kSize;
        worse_than_2 += std::abs(mean - p) > 2 * error + slack ? 1 : 0;
        sum += mean;
        expected_sum += p;
    }
    EXPECT_LT(worse_than_2, static_cast<int>(expected.size()) / 20);
    EXPECT_GT(expected_sum, 5);
    EXPECT_NEAR(sum / expected_sum, 1, 2e-3);
}

Film Render(const std::shared_ptr<Scene>& scene, int depth = 1) {
    return RenderAll(scene, Settings(kSize, kSize, depth), kSpp);
}

TEST(Coverage, MovingSphere) {
    const Transform scale = Transform::Scale({0.3f, 0.3f, 0.3f});
    const Vec2f a{-0.5f, -0.3f}, b{0.6f, 0.2f};
    const auto expected = Coverage([&](double x, double y) { return TimeInDisc(x, y, a, b, 0.3); });
    // 1e-3: the sphere is a polyhedron of 96 x 192 quads.
    ExpectCoverage(Render(Shining(Sphere(0, 96), {Transform::Translate({a.x, a.y, 0}) * scale,
                                                  Transform::Translate({b.x, b.y, 0}) * scale})),
                   expected, 1e-3);
}

TEST(Coverage, WayOfThreeKeys) {
    const Transform scale = Transform::Scale({0.25f, 0.25f, 0.25f});
    const Vec2f at[3] = {{-0.5f, -0.5f}, {0.5f, -0.2f}, {0.2f, 0.6f}};
    std::vector<Transform> keys;
    for (const Vec2f p : at) {
        keys.push_back(Transform::Translate({p.x, p.y, 0}) * scale);
    }
    ExpectCoverage(
        Render(Shining(Sphere(0, 96), keys)), Coverage([&](double x, double y) {
            return (TimeInDisc(x, y, at[0], at[1], 0.25) + TimeInDisc(x, y, at[1], at[2], 0.25)) /
                   2;
        }),
        1e-3);
}

TEST(Coverage, RotatingBar) {
    // From 10 to 130 degrees about the origin; the loader's choice of keys.
    constexpr double kFrom = 10 * M_PI / 180, kTurn = 120 * M_PI / 180;
    SampledTransform samples;
    for (const double t : SampleTimes(0, 1)) {
        const auto half = static_cast<float>((kFrom + kTurn * t) / 2);
        samples.push_back(Transform::Rotate(0, 0, std::sin(half), std::cos(half)));
    }
    const std::vector<Transform> keys = MotionKeys(samples);
    EXPECT_EQ(keys.size(), 33u);
    const Film film = Render(Shining(
        Quad({0.2f, -0.1f, 0}, {0.9f, -0.1f, 0}, {0.9f, 0.1f, 0}, {0.2f, 0.1f, 0}, 0), keys));
    std::vector<std::pair<double, double>> turns;  // cosine and sine at 500 times
    for (int i = 0; i < 500; ++i) {
        const double angle = kFrom + kTurn * (i + 0.5) / 500;
        turns.emplace_back(std::cos(angle), std::sin(angle));
    }
    ExpectCoverage(film, Coverage([&](double x, double y) {
                       const auto inside =
                           std::count_if(turns.begin(), turns.end(), [&](const auto& turn) {
                               const double u = x * turn.first + y * turn.second;
                               const double v = y * turn.first - x * turn.second;
                               return u > 0.2 && u < 0.9 && std::abs(v) < 0.1;
                           });
                       return static_cast<double>(inside) / static_cast<double>(turns.size());
                   }),
                   2e-3);
}

TEST(Coverage, DefocusedSphere) {
    // At the origin, 6 before the lens, which is in focus at 4.
    constexpr double kRadius = 0.8, kLens = 0.3, kFocus = 4, kDistance = 6;
    auto scene = Shining(Sphere(0, 96), {Transform::Scale({0.8f, 0.8f, 0.8f})});
    scene->cameras[0] = PerspectiveCamera({0, 0, 6}, {0, 0, 0}, 0.4f);
    scene->cameras[0].params.Set("lens_radius", 0.3f);
    scene->cameras[0].params.Set("focus_distance", 4.0f);
    const double half = std::tan(0.2);
    std::vector<std::pair<double, double>> points;  // of the lens, each for as much of it
    constexpr int kRings = 16, kSectors = 24;
    for (int i = 0; i < kRings * kSectors; ++i) {
        const double r = kLens * std::sqrt((i / kSectors + 0.5) / kRings);
        const double phi = 2 * M_PI * (i % kSectors + 0.5) / kSectors;
        points.emplace_back(r * std::cos(phi), r * std::sin(phi));
    }
    ExpectCoverage(
        Render(scene), Coverage([&](double x, double y) {
            const double fx = x * half * kFocus, fy = y * half * kFocus;
            const auto hits = std::count_if(points.begin(), points.end(), [&](const auto& lens) {
                // From the point of the lens through (fx, fy, focus), past the centre.
                const double dx = fx - lens.first, dy = fy - lens.second, dz = kFocus;
                const double t = (-lens.first * dx - lens.second * dy + kDistance * dz) /
                                 (dx * dx + dy * dy + dz * dz);
                const double cx = lens.first + t * dx, cy = lens.second + t * dy,
                             cz = t * dz - kDistance;
                return cx * cx + cy * cy + cz * cz < kRadius * kRadius;
            });
            return static_cast<double>(hits) / static_cast<double>(points.size());
        }),
        2e-3);
}

TEST(Coverage, AShadowIsThatOfTheSameTime) {
    // Light from above; a sphere goes by between it and the floor, behind the camera.
    auto scene = std::make_shared<Scene>();
    scene->materials = {Diffuse({1, 1, 1})};
    AddMesh(scene.get(), Quad({-3, -3, 0}, {3, -3, 0}, {3, 3, 0}, {-3, 3, 0}, 0));
    const Transform scale = Transform::Scale({0.3f, 0.3f, 0.3f});
    AddMesh(scene.get(), Sphere(0, 96));
    const Vec2f a{-0.6f, 0}, b{0.6f, 0.4f};
    scene->instances[1].motion = {Transform::Translate({a.x, a.y, 8}) * scale,
                                  Transform::Translate({b.x, b.y, 8}) * scale};
    scene->cameras.push_back(Flat());
    Light sun;
    sun.type = "directional";
    sun.params.Set("irradiance", std::vector<float>{kPi, kPi, kPi});
    scene->lights.push_back(sun);
    ExpectCoverage(Render(scene, 2),
                   Coverage([&](double x, double y) { return 1 - TimeInDisc(x, y, a, b, 0.3); }),
                   1e-3);
}

TEST(Coverage, AMovingCameraSeesTheInverseOfAMovingScene) {
    const Transform scale = Transform::Scale({0.3f, 0.3f, 0.3f});
    auto camera_moves = Shining(Sphere(0, 96), {scale});
    camera_moves->cameras[0].motion = {Transform::Translate({0.5f, 0.3f, 5}),
                                       Transform::Translate({-0.6f, -0.2f, 5})};
    const Vec2f a{-0.5f, -0.3f}, b{0.6f, 0.2f};
    ExpectCoverage(Render(camera_moves),
                   Coverage([&](double x, double y) { return TimeInDisc(x, y, a, b, 0.3); }), 1e-3);
}

TEST(Coverage, FeaturesAverageOverTime) {
    const Transform scale = Transform::Scale({0.3f, 0.3f, 0.3f});
    const Film film = Render(Shining(Sphere(0, 96), {Transform::Translate({-0.5f, 0, 0}) * scale,
                                                     Transform::Translate({0.5f, 0, 1}) * scale}));
    int partly = 0;
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        const double albedo = (film.Plane(kFeatureMeanA + int{kAlbedoR})[i] +
                               film.Plane(kFeatureMeanB + int{kAlbedoR})[i]) /
                              2;
        const double coverage = film.Mean(i).x;
        EXPECT_NEAR(albedo, 0.5 * coverage, 1e-5);
        partly += coverage > 0.1 && coverage < 0.9 ? 1 : 0;
        // Where it is covered half the time, the feature varies as a coin does.
        const double variance = film.Plane(kFeatureM2 + int{kAlbedoR})[i] / (kSpp - 1);
        EXPECT_NEAR(variance, 0.25 * coverage * (1 - coverage), 2e-3);
    }
    EXPECT_GT(partly, 50);
}

TEST(Coverage, AMovingLampLightsAsTheMeanOfItsPlaces) {
    const auto lit = [](std::vector<Transform> motion) {
        auto scene = std::make_shared<Scene>();
        scene->materials = {Diffuse({0.8f, 0.8f, 0.8f}), Diffuse({0, 0, 0}, {2, 2, 2})};
        AddMesh(scene.get(), Quad({-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}, 0));
        AddMesh(scene.get(), Quad({-1, 1, 6}, {1, 1, 6}, {1, -1, 6}, {-1, -1, 6}, 1),
                motion.front());
        if (motion.size() > 1) {
            scene->instances[1].motion = std::move(motion);
        }
        scene->cameras.push_back(Flat());
        return RenderAll(scene, Settings(16, 16, 2), 256);
    };
    const auto at = [](float t) { return Transform::Translate({-6 + 12 * t, 0, 0}); };
    constexpr int kPlaces = 16;
    double expected = 0, error2 = 0;
    for (int i = 0; i < kPlaces; ++i) {
        const Estimate e = EstimateMean(lit({at((static_cast<float>(i) + 0.5f) / kPlaces)}), 0);
        expected += e.mean / kPlaces;
        error2 += e.standard_error * e.standard_error / (kPlaces * kPlaces);
    }
    const Estimate e = EstimateMean(lit({at(0), at(1)}), 0);
    EXPECT_NEAR(e.mean, expected,
                4 * std::sqrt(e.standard_error * e.standard_error + error2) + 2e-3 * expected);
    EXPECT_LT(e.standard_error, 0.03 * expected);
}

}  // namespace
}  // namespace relume::test
