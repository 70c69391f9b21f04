#include "tests/support/scenes.h"

#include <cmath>

#include "core/film/tile.h"
#include "worker/render/render.h"

namespace relume::test {

namespace {

std::vector<float> Floats(Rgb c) { return {c.x, c.y, c.z}; }

}  // namespace

Material Diffuse(Rgb base_color, Rgb emissive) {
    Material m;
    m.type = "diffuse";
    m.params.Set("base_color", Floats(base_color));
    m.params.Set("emissive", Floats(emissive));
    return m;
}

Material MetallicRoughness(Rgb base_color, float metallic, float roughness) {
    Material m;
    m.type = "metallic_roughness";
    m.params.Set("base_color", Floats(base_color));
    m.params.Set("metallic", metallic);
    m.params.Set("roughness", roughness);
    return m;
}

Material Dielectric(float ior, float roughness) {
    Material m;
    m.type = "dielectric";
    m.params.Set("ior", ior);
    m.params.Set("roughness", roughness);
    return m;
}

Mesh Quad(Vec3f p0, Vec3f p1, Vec3f p2, Vec3f p3, int material) {
    Mesh mesh;
    mesh.positions = {p0, p1, p2, p3};
    mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.material = material;
    return mesh;
}

Mesh Cube(int material, bool inward) {
    Mesh mesh;
    for (int axis = 0; axis < 3; ++axis) {
        for (const float side : {-1.0f, 1.0f}) {
            const std::uint32_t base = static_cast<std::uint32_t>(mesh.positions.size());
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            for (int k = 0; k < 4; ++k) {
                Vec3f p;
                p[axis] = side;
                p[u] = k == 1 || k == 2 ? 1.0f : -1.0f;
                p[v] = k >= 2 ? 1.0f : -1.0f;
                mesh.positions.push_back(p);
            }
            if ((side > 0) != inward) {
                mesh.triangles.push_back({base, base + 1, base + 2});
                mesh.triangles.push_back({base, base + 2, base + 3});
            } else {
                mesh.triangles.push_back({base, base + 2, base + 1});
                mesh.triangles.push_back({base, base + 3, base + 2});
            }
        }
    }
    mesh.material = material;
    return mesh;
}

Mesh Sphere(int material, int n) {
    Mesh mesh;
    for (int y = 0; y <= n; ++y) {
        for (int x = 0; x <= 2 * n; ++x) {
            const float u = static_cast<float>(x) / static_cast<float>(2 * n);
            const float v = static_cast<float>(y) / static_cast<float>(n);
            const Vec3f p{std::sin(kPi * v) * std::cos(2 * kPi * u), std::cos(kPi * v),
                          -std::sin(kPi * v) * std::sin(2 * kPi * u)};
            mesh.positions.push_back(p);
            mesh.normals.push_back(Normalize(p));
            mesh.uvs.push_back({u, v});
        }
    }
    const std::uint32_t row = static_cast<std::uint32_t>(2 * n + 1);
    for (std::uint32_t y = 0; y < static_cast<std::uint32_t>(n); ++y) {
        for (std::uint32_t x = 0; x + 1 < row; ++x) {
            const std::uint32_t i = y * row + x;
            if (y > 0) {
                mesh.triangles.push_back({i, i + row, i + 1});
            }
            if (y + 1 < static_cast<std::uint32_t>(n)) {
                mesh.triangles.push_back({i + 1, i + row, i + row + 1});
            }
        }
    }
    mesh.material = material;
    return mesh;
}

void AddMesh(Scene* scene, Mesh mesh, const Transform& to_world) {
    scene->instances.push_back({static_cast<int>(scene->meshes.size()), to_world});
    scene->meshes.push_back(std::move(mesh));
}

Camera PerspectiveCamera(Vec3f eye, Vec3f target, float yfov, Vec3f up) {
    Camera camera;
    camera.name = "camera";
    camera.type = "perspective";
    camera.params.Set("yfov", yfov);
    camera.to_world = Transform::LookAt(eye, target, up);
    return camera;
}

Light PointLight(Vec3f position, Rgb intensity) {
    Light light;
    light.type = "point";
    light.params.Set("intensity", Floats(intensity));
    light.to_world = Transform::Translate(position);
    return light;
}

void SetEnvironment(Scene* scene, Rgb color) {
    auto environment = std::make_shared<Environment>();
    environment->color = color;
    scene->environment = environment;
}

int AddTexture(Scene* scene, int width, int height, int channels, std::vector<std::uint8_t> bytes,
               bool srgb) {
    SceneImage image;
    image.name = "in memory";
    image.width = width;
    image.height = height;
    image.channels = channels;
    image.bytes = std::move(bytes);
    scene->images.push_back(std::move(image));
    Texture texture;
    texture.image = static_cast<int>(scene->images.size()) - 1;
    texture.srgb = srgb;
    scene->textures.push_back(texture);
    return static_cast<int>(scene->textures.size()) - 1;
}

int AddTexture(Scene* scene, int width, int height, int channels, std::vector<float> floats) {
    const int index =
        AddTexture(scene, width, height, channels, std::vector<std::uint8_t>(), false);
    scene->images.back().floats = std::move(floats);
    return index;
}

std::shared_ptr<Scene> CornellBox() {
    auto scene = std::make_shared<Scene>();
    scene->materials = {Diffuse({0.75f, 0.75f, 0.75f}),
                        Diffuse({0.6f, 0.08f, 0.08f}),
                        Diffuse({0.1f, 0.5f, 0.1f}),
                        Diffuse({0, 0, 0}, {12, 10, 7}),
                        MetallicRoughness({0.9f, 0.7f, 0.4f}, 1, 0.3f),
                        Dielectric(1.5f, 0)};
    AddMesh(scene.get(), Quad({-1, -1, 1}, {1, -1, 1}, {1, -1, -1}, {-1, -1, -1}, 0));  // floor
    AddMesh(scene.get(), Quad({-1, 1, -1}, {1, 1, -1}, {1, 1, 1}, {-1, 1, 1}, 0));      // ceiling
    AddMesh(scene.get(), Quad({-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, 0));  // back
    AddMesh(scene.get(), Quad({-1, -1, 1}, {-1, -1, -1}, {-1, 1, -1}, {-1, 1, 1}, 1));  // left
    AddMesh(scene.get(), Quad({1, -1, -1}, {1, -1, 1}, {1, 1, 1}, {1, 1, -1}, 2));      // right
    AddMesh(scene.get(), Quad({-0.3f, 0.99f, -0.3f}, {0.3f, 0.99f, -0.3f}, {0.3f, 0.99f, 0.3f},
                              {-0.3f, 0.99f, 0.3f}, 3));
    AddMesh(scene.get(), Cube(4),
            Transform::Translate({-0.4f, -0.6f, -0.3f}) * Transform::Scale({0.3f, 0.4f, 0.3f}));
    AddMesh(scene.get(), Sphere(5, 16),
            Transform::Translate({0.4f, -0.65f, 0.2f}) * Transform::Scale({0.35f, 0.35f, 0.35f}));
    scene->cameras.push_back(PerspectiveCamera({0, 0, 3.8f}, {0, 0, 0}, 0.7f));
    return scene;
}

RenderSettings Settings(int width, int height, int max_depth) {
    RenderSettings settings;
    settings.width = width;
    settings.height = height;
    settings.max_depth = max_depth;
    settings.seed = 7;
    return settings;
}

Film RenderAll(std::shared_ptr<const Scene> scene, const RenderSettings& settings,
               std::uint32_t spp, int tile) {
    const render::Renderer renderer(std::move(scene), settings);
    Film film(settings.Window(), settings.width, settings.height);
    const CancelToken cancel;
    for (const TileRect& rect : CutIntoTiles(settings.Window(), tile)) {
        TileTask task{rect, std::vector<std::uint32_t>(rect.area(), 0),
                      std::vector<std::uint32_t>(rect.area(), spp)};
        film.Merge(renderer.RenderTile(task, cancel));
    }
    return film;
}

Estimate EstimateMean(const Film& film, int channel) {
    Moments moments;
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        moments.Add(film.Mean(i)[channel]);
    }
    return {moments.mean, std::sqrt(moments.MeanVariance())};
}

}  // namespace relume::test
