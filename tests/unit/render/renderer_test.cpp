#include "worker/render/render.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <xmmintrin.h>

#include <array>
#include <cmath>
#include <thread>

#include "core/base/error.h"
#include "tests/support/scenes.h"

namespace relume::render {
namespace {

// `count` samples from `first` for each pixel of the rectangle.
TileTask Task(TileRect rect, std::uint32_t first, std::uint32_t count) {
    return {rect, std::vector<std::uint32_t>(rect.area(), first),
            std::vector<std::uint32_t>(rect.area(), count)};
}

// A scene in which every kind of surface and light takes part.
std::shared_ptr<Scene> Everything() {
    auto scene = test::CornellBox();
    scene->lights.push_back(test::PointLight({0, 0.5f, 0.5f}, {1, 1, 1}));
    test::SetEnvironment(scene.get(), {0.2f, 0.3f, 0.4f});
    scene->materials[1].params.Set("alpha_mode", "blend");
    scene->materials[1].params.Set("base_alpha", 0.5f);
    scene->cameras[0].params.Set("lens_radius", 0.05f);
    scene->cameras[0].params.Set("focus_distance", 3.8f);
    return scene;
}

void ExpectSame(const TileResult& a, const TileResult& b) {
    EXPECT_EQ(a.pixels, b.pixels);
    EXPECT_EQ(a.planes, b.planes);
    EXPECT_EQ(a.rays, b.rays);
}

// Planes of all channels, pixel by pixel, of a window rendered in tiles of `size`.
std::vector<float> Rendered(const std::shared_ptr<Scene>& scene, const RenderSettings& settings,
                            int size) {
    const Film film = test::RenderAll(scene, settings, 6, size);
    std::vector<float> all;
    for (int c = 0; c < kFilmChannelCount; ++c) {
        const auto plane = film.Plane(c);
        all.insert(all.end(), plane.begin(), plane.end());
    }
    return all;
}

TEST(Renderer, LeaseRenderedAgainIsBitEqual) {
    const RenderSettings settings = test::Settings(24, 20, 6);
    const Renderer first(Everything(), settings), second(Everything(), settings);
    const CancelToken cancel;
    const TileTask task = Task({3, 4, 19, 17}, 5, 7);
    const TileResult result = first.RenderTile(task, cancel);
    EXPECT_EQ(result.pixels.size(), task.rect.area());
    EXPECT_GT(result.rays, task.TotalSamples());
    ExpectSame(result, first.RenderTile(task, cancel));
    ExpectSame(result, second.RenderTile(task, cancel));
}

TEST(Renderer, ViewsOfOneBuiltSceneEqualThoseOfTheirOwn) {
    const auto built = std::make_shared<const BuiltScene>(*Everything());
    const CancelToken cancel;
    const TileTask task = Task({2, 3, 12, 11}, 0, 3);
    RenderSettings settings = test::Settings(24, 20, 6);
    std::vector<TileResult> results;
    for (int i = 0; i < 4; ++i) {
        settings.seed = i == 1 ? 5 : 0;
        settings.max_depth = i == 2 ? 2 : 6;
        if (i == 3) {
            settings.look = LookCamera{{0.2f, 0.1f, 3}, {0, 0, 0}, {0, 1, 0}, 45};
        }
        results.push_back(Renderer(built, settings).RenderTile(task, cancel));
        ExpectSame(results.back(), Renderer(Everything(), settings).RenderTile(task, cancel));
    }
    for (std::size_t i = 1; i < results.size(); ++i) {
        EXPECT_NE(results[i].planes, results[0].planes) << i;
    }
}

TEST(Renderer, ThreadAndItsFloatingPointModeDoNotMatter) {
    const Renderer renderer(Everything(), test::Settings(16, 16, 6));
    const CancelToken cancel;
    const TileTask task = Task({0, 0, 16, 16}, 0, 4);
    const TileResult result = renderer.RenderTile(task, cancel);
    TileResult others[3];
    std::vector<std::thread> threads;
    for (TileResult& other : others) {
        threads.emplace_back([&] {
            _MM_SET_ROUNDING_MODE(_MM_ROUND_UP);
            other = renderer.RenderTile(task, cancel);
        });
    }
    for (std::thread& thread : threads) {
        thread.join();
    }
    for (const TileResult& other : others) {
        ExpectSame(result, other);
    }
}

// The samples are those that the moments are of, and asking for them changes no other bit.
TEST(Renderer, SamplesAreThoseOfTheMoments) {
    const Renderer renderer(Everything(), test::Settings(24, 20, 6));
    const CancelToken cancel;
    TileTask task = Task({3, 4, 19, 17}, 5, 7);
    task.count[3] = 0;
    const TileResult plain = renderer.RenderTile(task, cancel);
    EXPECT_TRUE(plain.samples.empty());
    task.keep_samples = true;
    const TileResult result = renderer.RenderTile(task, cancel);
    ExpectSame(result, plain);
    ASSERT_EQ(result.samples.size(), task.TotalSamples());
    const std::size_t n = result.pixels.size();
    std::size_t first_hits = 0;
    int second_hits = 0, lens = 0;
    for (std::size_t k = 0; k < n; ++k) {
        std::array<double, 2> sum{}, count{};
        for (std::size_t s = 0; s < 7; ++s) {
            const SampleRecord& record = result.samples[7 * k + s];
            sum[(5 + s) % 2] += record.radiance.y;
            count[(5 + s) % 2] += 1;
            EXPECT_TRUE(record.x >= 0 && record.x < 1 && record.y >= 0 && record.y < 1);
            if (Length(record.hits[0].normal) > 0) {
                ASSERT_NEAR(Length(record.hits[0].normal), 1, 1e-4);
                ++first_hits;
            } else {  // beside the box
                ASSERT_EQ(record.hits[0].albedo, (Rgb{0.2f, 0.3f, 0.4f}));
                ASSERT_GT(Length(record.hits[0].position), 1);
            }
            second_hits += Length(record.hits[1].normal) > 0.5f ? 1 : 0;
            lens += record.random[0] != record.random[1] ? 1 : 0;
            EXPECT_EQ(record.random[2], 0);  // nothing moves
        }
        EXPECT_NEAR(sum[0] / count[0], result.planes[(kMeanA + 1) * n + k], 1e-5 * sum[0]);
        EXPECT_NEAR(sum[1] / count[1], result.planes[(kMeanB + 1) * n + k], 1e-5 * sum[1]);
    }
    EXPECT_GT(first_hits, result.samples.size() / 2);
    EXPECT_GT(second_hits, 0);
    EXPECT_GT(lens, 0);
}

TEST(Renderer, TilesDoNotShow) {
    const auto scene = Everything();
    const RenderSettings settings = test::Settings(24, 20, 6);
    const std::vector<float> whole = Rendered(scene, settings, 64);
    EXPECT_EQ(whole, Rendered(scene, settings, 16));
    EXPECT_EQ(whole, Rendered(scene, settings, 7));
    EXPECT_EQ(whole, Rendered(scene, settings, 1));
}

TEST(Renderer, CropIsPartOfTheFullFrame) {
    const auto scene = Everything();
    RenderSettings settings = test::Settings(24, 20, 6);
    const Film full = test::RenderAll(scene, settings, 4);
    settings.crop = {5, 3, 17, 11};
    const Film crop = test::RenderAll(scene, settings, 4);
    for (int c = 0; c < kFilmChannelCount; ++c) {
        for (int y = 3; y < 11; ++y) {
            for (int x = 5; x < 17; ++x) {
                ASSERT_EQ(crop.Plane(c)[static_cast<std::size_t>((y - 3) * 12 + x - 5)],
                          full.Plane(c)[static_cast<std::size_t>(y * 24 + x)]);
            }
        }
    }
}

TEST(Renderer, RangesInOrderEqualOneRange) {
    // The same samples: counts are equal, means and deviations up to the rounding of the film's
    // floats between merges.
    const auto scene = Everything();
    const RenderSettings settings = test::Settings(16, 12, 6);
    const Renderer renderer(scene, settings);
    const CancelToken cancel;
    const TileRect window = settings.Window();
    Film whole(window, 16, 12), parts(window, 16, 12);
    whole.Merge(renderer.RenderTile(Task(window, 0, 9), cancel));
    for (const auto& [first, count] : {std::pair{0u, 2u}, {2u, 1u}, {3u, 6u}}) {
        parts.Merge(renderer.RenderTile(Task(window, first, count), cancel));
    }
    for (int c = 0; c < kFilmChannelCount; ++c) {
        for (std::size_t i = 0; i < whole.pixel_count(); ++i) {
            const float a = whole.Plane(c)[i], b = parts.Plane(c)[i];
            EXPECT_NEAR(a, b, 1e-5f * std::abs(a) + 1e-6f) << c;
        }
    }
}

TEST(Renderer, OnlyPixelsThatAreAskedForAreSampled) {
    const Renderer renderer(Everything(), test::Settings(8, 8, 4));
    const CancelToken cancel;
    TileTask task = Task({0, 0, 8, 8}, 0, 0);
    task.count[9] = 3;
    task.count[40] = 130;  // more than a wave
    task.first[40] = 2;
    const TileResult result = renderer.RenderTile(task, cancel);
    EXPECT_EQ(result.pixels, (std::vector<std::uint32_t>{9, 40}));
    ASSERT_EQ(result.planes.size(), 2u * kFilmChannelCount);
    EXPECT_EQ(result.planes[2 * kCountA], 2);  // samples 0 and 2
    EXPECT_EQ(result.planes[2 * kCountB], 1);  // sample 1
    EXPECT_EQ(result.planes[2 * kCountA + 1], 65);
    EXPECT_EQ(result.planes[2 * kCountB + 1], 65);
    const TileResult nothing = renderer.RenderTile(Task({0, 0, 8, 8}, 0, 0), cancel);
    EXPECT_TRUE(nothing.pixels.empty());
    EXPECT_EQ(nothing.rays, 0u);
}

TEST(Renderer, CancelledTaskIsEmpty) {
    const Renderer renderer(Everything(), test::Settings(16, 16, 4));
    CancelToken cancel;
    cancel.Cancel();
    EXPECT_TRUE(renderer.RenderTile(Task({0, 0, 16, 16}, 0, 8), cancel).pixels.empty());
}

TEST(Renderer, SeedChangesSamples) {
    RenderSettings settings = test::Settings(8, 8, 4);
    const std::vector<float> a = Rendered(Everything(), settings, 8);
    settings.seed = 8;
    EXPECT_NE(a, Rendered(Everything(), settings, 8));
}

TEST(Renderer, DepthOneSeesEmissionAlone) {
    auto scene = test::CornellBox();
    const Film film = test::RenderAll(scene, test::Settings(32, 32, 1), 4);
    int lit = 0;
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        const Rgb mean = film.Mean(i);
        EXPECT_LE(mean.x, 12.0f);
        lit += mean.x > 0 ? 1 : 0;
        EXPECT_EQ(film.Plane(kMaxLuminance)[i], 0);  // nothing indirect
    }
    EXPECT_GT(lit, 0);
    EXPECT_LT(lit, 200);
    EXPECT_GT(film.Plane(int{kFeatureMeanA} + kAlbedoR)[16 * 32 + 16], 0);  // features are there
}

TEST(Renderer, LastSegmentIsTheSameHoweverItIsFound) {
    // With punctual lights alone the last segment is not traced, with an environment it asks for
    // any hit. A black emitter in a corner makes the renderer do it the long way.
    for (const bool environment : {false, true}) {
        auto plain = std::make_shared<Scene>();
        plain->materials = {test::Diffuse({0.7f, 0.7f, 0.7f}),
                            test::Diffuse({0, 0, 0}, {1e-30f, 1e-30f, 1e-30f})};
        test::AddMesh(plain.get(), test::Cube(0, true));
        test::AddMesh(plain.get(), test::Cube(0),
                      Transform::Translate({0, -0.7f, 0}) * Transform::Scale({0.3f, 0.3f, 0.3f}));
        if (environment) {
            plain->meshes[0].triangles.resize(10);  // one side is open
            test::SetEnvironment(plain.get(), {1, 1, 1});
        }
        plain->lights.push_back(test::PointLight({0, 0.8f, 0}, {1, 1, 1}));
        plain->cameras.push_back(test::PerspectiveCamera({0, 0, 0.9f}, {0, -0.5f, -1}, 1));
        auto emitter = std::make_shared<Scene>(*plain);
        test::AddMesh(emitter.get(), test::Quad({0.9f, 0.9f, 0.9f}, {0.91f, 0.9f, 0.9f},
                                                {0.91f, 0.91f, 0.9f}, {0.9f, 0.91f, 0.9f}, 1));
        const test::Estimate a =
            test::EstimateMean(test::RenderAll(plain, test::Settings(24, 24, 3), 32), 1);
        const test::Estimate b =
            test::EstimateMean(test::RenderAll(emitter, test::Settings(24, 24, 3), 32), 1);
        EXPECT_NEAR(a.mean, b.mean, 0.01 * b.mean) << environment;
        EXPECT_GT(a.mean, 0.01);
    }
}

TEST(Renderer, NothingThatShinesIsRefused) {
    auto scene = test::CornellBox();
    scene->materials[3] = test::Diffuse({0, 0, 0});
    RenderSettings settings = test::Settings(8, 8, 4);
    try {
        const Renderer renderer(scene, settings);
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
        EXPECT_THAT(error.what(), testing::HasSubstr("no light"));
    }
    settings.allow_black = true;
    const Film film = test::RenderAll(scene, settings, 2);
    EXPECT_EQ(test::EstimateMean(film, 0).mean, 0);
    EXPECT_EQ(film.TotalBadSamples(), 0);
}

TEST(Renderer, UnknownMaterialIsRefusedByName) {
    auto scene = test::CornellBox();
    scene->materials[0].type = "velvet";
    scene->materials[0].source = "box.gltf: material 0 'wall'";
    try {
        const Renderer renderer(scene, test::Settings(8, 8, 4));
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("material 0 'wall'"));
        EXPECT_THAT(error.what(), testing::HasSubstr("metallic_roughness"));
    }
}

TEST(Renderer, FittedCameraIsNoted) {
    auto scene = test::CornellBox();
    scene->cameras.clear();
    const Renderer renderer(scene, test::Settings(8, 8, 4));
    EXPECT_THAT(renderer.notes(), testing::Contains(testing::HasSubstr("no camera")));
}

TEST(Renderer, BadSamplesAreCountedNotSummed) {
    // Emission that overflows when it is added up over bounces: paths of one segment are finite.
    auto scene = std::make_shared<Scene>();
    scene->materials = {test::Diffuse({1, 1, 1}, {1e38f, 1e38f, 1e38f})};
    test::AddMesh(scene.get(), test::Cube(0, true));
    scene->cameras.push_back(test::PerspectiveCamera({0, 0, 0}, {0, 0, -1}, 1));
    const Film finite = test::RenderAll(scene, test::Settings(8, 8, 1), 4);
    EXPECT_EQ(finite.TotalBadSamples(), 0);
    EXPECT_EQ(finite.TotalSamples(), 8 * 8 * 4);
    const Film film = test::RenderAll(scene, test::Settings(8, 8, 6), 4);
    EXPECT_GT(film.TotalBadSamples(), 200);
    EXPECT_EQ(film.TotalBadSamples() + film.TotalSamples(), 8 * 8 * 4);
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        EXPECT_TRUE(IsFinite(film.Mean(i)));
        EXPECT_EQ(film.NextIndex(i), 4u);
    }
}

}  // namespace
}  // namespace relume::render
