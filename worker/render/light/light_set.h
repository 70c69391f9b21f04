#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/scene/scene.h"
#include "worker/render/accel/accel.h"
#include "worker/render/light/area_light.h"
#include "worker/render/light/environment_light.h"
#include "worker/render/light/light_sample.h"
#include "worker/render/light/light_tree.h"
#include "worker/render/light/punctual.h"

namespace relume::render {

// All that shines, in groups: what has a place, each directional light, and the environment. Groups
// are chosen by their power; the environment gets a quarter to a half of the samples if there is
// anything else, since what it seems to send into a scene says little about what arrives inside.
// What has a place is chosen by a tree, for each point anew. Immutable, thread-safe.
class LightSet {
  public:
    // Numbers the emitting triangles in the objects of `accel`. Keeps references to all but
    // `scene`. `environment`: the scene's.
    LightSet(const Scene& scene, const std::vector<CompiledMaterial>& materials,
             const TextureSet& textures, std::shared_ptr<const EnvironmentLight> environment,
             Accel* accel);

    // Nothing shines, or nothing that Sample could find.
    bool black() const { return none_to_sample() && !moving_emitters_; }
    bool none_to_sample() const { return size() == 0; }
    bool has_emissive_surfaces() const { return emissive_surfaces_ || moving_emitters_; }
    // Surfaces that shine and move: rays find them by chance, Sample does not.
    bool has_moving_emitters() const { return moving_emitters_; }
    bool has_environment() const { return environment_probability_ > 0; }
    // One light only: Sample does not read `choice`.
    bool single() const { return size() == 1; }
    std::size_t size() const {
        return tree_.size() + directional_.size() + (has_environment() ? 1 : 0);
    }

    // True if Sample will choose the environment: DrawEnvironment can be done ahead then, while the
    // memory is busy with other things.
    bool ChoosesEnvironment(std::uint32_t choice) const {
        return has_environment() && choice * 0x1p-32 >= 1 - environment_probability_;
    }
    EnvironmentLight::Place DrawEnvironment(Vec2f u) const { return environment_->Draw(u); }

    // Light from one light towards the receiver; empty if none goes there.
    // `choice`: 32 uniform bits. `drawn`: DrawEnvironment(u), if it has been done.
    std::optional<LightSample> Sample(const LightReceiver& at, std::uint32_t choice, Vec2f u,
                                      const EnvironmentLight::Place* drawn = nullptr) const;

    // Density with which Sample, called with the receiver at a ray's origin, would have chosen the
    // point where that ray hit an object that is a light. `direction` and `normal` have unit
    // length.
    float AreaPdf(const LightReceiver& from, const Object& object, std::uint32_t triangle,
                  float distance, Vec3f direction, Vec3f normal) const;
    // The same for a ray that left the scene, with the radiance there. Black without an
    // environment.
    Rgb Environment(const EnvironmentLight::Place& place, float* pdf) const;
    Rgb Environment(Vec3f direction, float* pdf) const {
        return Environment(FindEnvironment(direction), pdf);
    }
    EnvironmentLight::Place FindEnvironment(Vec3f direction) const {
        return environment_->Find(direction);
    }

    std::size_t repaired_environment_values() const { return environment_->repaired(); }

  private:
    struct Directional {
        PunctualLight light;
        float probability = 0;
    };
    // Power (W) of what has a place, and of each directional light.
    struct Powers {
        double placed = 0;
        std::vector<double> directional;
    };

    // Of object `o`. Two triangles of one colour that follow each other are joined if they can be.
    void AddAreaLights(const Mesh& mesh, const Transform& to_world, std::uint32_t o,
                       const Object& object, std::vector<LightExtent>* extents, Powers* powers);
    void AddPunctualLights(const Scene& scene, float radius, std::vector<LightExtent>* extents,
                           Powers* powers);
    void ShareOut(const Powers& powers, float radius);
    std::optional<LightSample> SamplePlaced(const LightReceiver& at, double u, Vec2f uv) const;
    std::optional<LightSample> SampleArea(const AreaLight& light, Vec3f p, Vec2f u) const;

    const std::vector<CompiledMaterial>& materials_;
    const TextureSet& textures_;
    const Accel& accel_;
    std::vector<std::uint32_t> area_of_;   // by number of an emitting triangle
    std::vector<AreaLight> areas_;         // lights of tree_: first these
    std::vector<PunctualLight> punctual_;  // then these
    LightTree tree_;
    std::vector<Directional> directional_;
    std::shared_ptr<const EnvironmentLight> environment_;
    float placed_probability_ = 0, environment_probability_ = 0;
    bool emissive_surfaces_ = false;
    bool moving_emitters_ = false;
};

}  // namespace relume::render
