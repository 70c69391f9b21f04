#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/film/film.h"
#include "core/scene/render_settings.h"
#include "core/scene/scene.h"

namespace relume::test {

// Scenes made in memory, and what renders of them are measured by.

Material Diffuse(Rgb base_color, Rgb emissive = {});
Material MetallicRoughness(Rgb base_color, float metallic, float roughness);
Material Dielectric(float ior, float roughness);

// Two triangles p0 p1 p2 p3, counter-clockwise seen from the front; uvs (0,0) (1,0) (1,1) (0,1).
Mesh Quad(Vec3f p0, Vec3f p1, Vec3f p2, Vec3f p3, int material);
// Of half extent 1 about the origin; fronts outside, or inside if `inward`.
Mesh Cube(int material, bool inward = false);
// Unit sphere of 2 n x n quads, smooth normals, uvs.
Mesh Sphere(int material, int n);

// Appends the mesh and one instance of it.
void AddMesh(Scene* scene, Mesh mesh, const Transform& to_world = {});
Camera PerspectiveCamera(Vec3f eye, Vec3f target, float yfov, Vec3f up = {0, 1, 0});
Light PointLight(Vec3f position, Rgb intensity);
void SetEnvironment(Scene* scene, Rgb color);

// An 8-bit or float picture and a texture of it; returns the texture's index.
int AddTexture(Scene* scene, int width, int height, int channels, std::vector<std::uint8_t> bytes,
               bool srgb);
int AddTexture(Scene* scene, int width, int height, int channels, std::vector<float> floats);

// A quarter-dark box with a light and a few blocks: diffuse, metal and glass. Costs few rays.
std::shared_ptr<Scene> CornellBox();

RenderSettings Settings(int width, int height, int max_depth);

// All pixels of the window, `spp` samples each from index 0, in tiles of `tile`.
Film RenderAll(std::shared_ptr<const Scene> scene, const RenderSettings& settings,
               std::uint32_t spp, int tile = 32);

// Mean over all pixels of a channel's mean radiance, and the standard error of it from the scatter
// of the pixels (for pictures whose pixels all have the same expectation).
struct Estimate {
    double mean = 0, standard_error = 0;
};
Estimate EstimateMean(const Film& film, int channel);

}  // namespace relume::test
