#pragma once

#include <vector>

#include "core/scene/pbrt_document.h"
#include "core/scene/pbrt_textures.h"
#include "core/scene/scene.h"

namespace relume::pbrt {

// The environment before its picture is there.
struct EnvironmentPlan {
    bool exists = false;
    int picture = -1;         // of Textures, then of Scene::images
    bool equal_area = false;  // pbrt-v4's map, if the picture is square
    Environment environment;
};

// A goniometric light before its picture is there.
struct PicturedLight {
    std::size_t light;  // of Scene::lights
    int picture;        // as in EnvironmentPlan
    bool equal_area;
};
struct LightPlan {
    EnvironmentPlan environment;
    std::vector<PicturedLight> pictured;
};

// Lights that are not shapes: delta lights go to `scene`.
LightPlan ReadLights(const Document& document, Textures* textures, Spectra* spectra, Scene* scene,
                     Notes* notes);

// Gives the scene its environment, and goniometric lights their pictures, as linear floats in
// latitude and longitude.
void FinishLights(const LightPlan& plan, Scene* scene, Notes* notes);

// Clarberg's equal-area map of the sphere to the unit square ("Fast Equal-Area Mapping of the
// (Hemi)Sphere using SIMD", 2008), as pbrt-v4 turns it: the middle is +z.
Vec2f EqualAreaSquare(Vec3f direction);

// The camera, at most one, and what Film, Sampler and Integrator advise. `times`: see ShutterTimes.
void ReadCamera(const Document& document, const std::vector<double>& times, Scene* scene,
                Notes* notes);

// The times at which things that move are looked at (SampleTimes): from the camera's shutteropen to
// its shutterclose, unless the options say otherwise.
std::vector<double> ShutterTimes(const Document& document, const LoadOptions& options);

// The rotation (and mirroring) of a transformation without its scale; that in `scale`, as the cube
// root of the determinant. False if it is skewed or scales unevenly: the nearest axes are given.
bool SplitScale(const Transform& transform, Transform* rigid, float* scale);

}  // namespace relume::pbrt
