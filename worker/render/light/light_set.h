#pragma once

#include <optional>
#include <vector>

#include "core/scene/scene.h"
#include "worker/render/accel/accel.h"
#include "worker/render/light/alias_table.h"
#include "worker/render/light/area_light.h"
#include "worker/render/light/environment_light.h"
#include "worker/render/light/light_sample.h"
#include "worker/render/light/punctual.h"

namespace relume::render {

// All that shines. Lights are chosen by their power; the environment gets a quarter to a half of
// the samples if there is anything else, since what it seems to send into a scene says little about
// what arrives inside. Immutable, thread-safe.
class LightSet {
  public:
    // Numbers the emitting triangles in the objects of `accel`. Keeps references to all but
    // `scene`.
    LightSet(const Scene& scene, const std::vector<CompiledMaterial>& materials,
             const TextureSet& textures, Accel* accel);

    // Nothing shines.
    bool black() const { return table_.empty(); }
    bool has_emissive_surfaces() const { return emissive_surfaces_; }
    bool has_environment() const { return environment_probability_ > 0; }
    // One light only: Sample does not read `choice`.
    bool single() const { return table_.size() == 1; }
    std::size_t size() const { return table_.size(); }

    // Light from one light towards p; empty if none goes there.
    // `choice`: 32 uniform bits.
    std::optional<LightSample> Sample(Vec3f p, std::uint32_t choice, Vec2f u) const;

    // Density with which Sample, called at the origin of a ray, would have chosen the point where
    // that ray hit an object that is a light. `direction` and `normal` have unit length.
    float AreaPdf(const Object& object, std::uint32_t triangle, float distance, Vec3f direction,
                  Vec3f normal) const;
    // The same for a ray that left the scene, with the radiance there. Black without an
    // environment.
    Rgb Environment(Vec3f direction, float* pdf) const;

    std::size_t repaired_environment_values() const { return environment_.repaired(); }

  private:
    void AddAreaLights(const Scene& scene, Accel* accel, std::vector<double>* powers);
    std::optional<LightSample> SampleArea(const AreaLight& light, Vec3f p, Vec2f u) const;

    const std::vector<CompiledMaterial>& materials_;
    const TextureSet& textures_;
    const Accel& accel_;
    std::vector<AreaLight> areas_;         // first in table_
    std::vector<PunctualLight> punctual_;  // then these
    EnvironmentLight environment_;         // and last this, if not black
    float environment_probability_ = 0;
    bool emissive_surfaces_ = false;
    AliasTable table_;
};

}  // namespace relume::render
