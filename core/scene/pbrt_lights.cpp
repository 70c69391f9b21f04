#include "core/scene/pbrt_lights.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/math/frame.h"

namespace relume::pbrt {
namespace {

Rgb Scale(const Params& params, Spectra* spectra) {
    return spectra->Get(params, "scale", SpectrumUse::kIndex, {1, 1, 1});
}

std::vector<float> Numbers(Rgb c) { return {c.x, c.y, c.z}; }

// At `position`, with -z along `direction`.
Transform Aim(Vec3f position, Vec3f direction) {
    const Frame f = Frame::FromZ(-Normalize(direction));
    return Transform({f.x.x, f.y.x, f.z.x, position.x, f.x.y, f.y.y, f.z.y, position.y, f.x.z,
                      f.y.z, f.z.z, position.z});
}

// Scene's maps have y up and u turning to the right seen from inside; pbrt's z up and u turning
// left.
Transform FromMap() { return Transform({0, 0, 1, 0, -1, 0, 0, 0, 0, 1, 0, 0}); }

class Reader {
  public:
    Reader(bool version3, Textures* textures, Spectra* spectra, Scene* scene, Notes* notes)
        : is_version3_(version3),
          textures_(textures),
          spectra_(spectra),
          scene_(scene),
          notes_(notes) {}

    LightPlan Read(const std::vector<PlacedLight>& lights) {
        for (const PlacedLight& light : lights) {
            const std::string& type = light.is.type;
            if (type == "infinite") {
                ReadInfinite(light);
            } else if (type == "distant") {
                ReadDistant(light);
            } else if (type == "point" || type == "spot" || type == "goniometric") {
                ReadPoint(light);
            } else {
                notes_->Add(light.is.place, fmt::format("lights of type {} are not supported, and "
                                                        "left out",
                                                        type));
                continue;
            }
            light.is.params.Ignore("samples nsamples");
            light.is.params.NoteUnused(fmt::format("{} light", type), notes_);
        }
        return std::move(plan_);
    }

  private:
    void Add(const PlacedLight& from, const char* type, const Transform& to_world,
             const char* strength, Rgb value, ParamSet params = {}) {
        Light light;
        light.type = type;
        light.params = std::move(params);
        light.params.Set(strength, Numbers(value));
        light.to_world = to_world;
        light.source = fmt::format("{}: {} light", from.is.place.Text(), from.is.type);
        if (!to_world.IsFinite()) {
            Fail(from.is.place, "the light has no direction; correct from and to");
        }
        scene_->lights.push_back(std::move(light));
    }

    void ReadDistant(const PlacedLight& light) {
        const Params& params = light.is.params;
        Rgb irradiance =
            spectra_->Get(params, "L", SpectrumUse::kLight, {1, 1, 1}) * Scale(params, spectra_);
        const float illuminance = params.Float("illuminance", 0);
        irradiance *= illuminance > 0 ? illuminance : 1;
        const Vec3f from = params.Point("from", {0, 0, 0}), to = params.Point("to", {0, 0, 1});
        const Transform aim = Aim({0, 0, 0}, light.to_world.Vector(to - from));
        Add(light, "directional", aim, "irradiance", irradiance);
    }

    void ReadPoint(const PlacedLight& light) {
        const Params& params = light.is.params;
        const bool spot = light.is.type == "spot";
        Rgb intensity =
            spectra_->Get(params, "I", SpectrumUse::kLight, {1, 1, 1}) * Scale(params, spectra_);
        const float power = params.Float("power", 0);
        const Vec3f from = params.Point("from", {0, 0, 0});
        const Vec3f position = light.to_world.Point(from);
        if (!spot) {
            intensity *= power > 0 ? power / (4 * kPi) : 1;
            if (light.is.type != "goniometric" || !ReadGoniometric(light, from, intensity)) {
                Add(light, "point", Transform::Translate(position), "intensity", intensity);
            }
            return;
        }
        const float outer = params.Float("coneangle", 30) * (kPi / 180);
        const float delta = params.Float("conedeltaangle", 5) * (kPi / 180);
        const float inner = outer - delta;
        if (!(outer > 0) || !(outer <= kPi) || !(delta >= 0) || !(inner >= 0)) {
            Fail(light.is.place,
                 "a spot light's angles must be 0 <= conedeltaangle <= coneangle "
                 "<= 180; correct them");
        }
        if (power > 0) {
            const float end = std::cos(outer), start = std::cos(inner);
            intensity *= power / (2 * kPi * ((1 - start) + (start - end) / 2));
        }
        ParamSet cone;
        cone.Set("outer_angle", outer);
        cone.Set("inner_angle", std::min(inner, outer * 0.9999f));
        // pbrt-v4's cubic, or version 3's fourth power, between the cosines.
        cone.Set("falloff", is_version3_ ? "quartic" : "smoothstep");
        const Vec3f to = params.Point("to", {0, 0, 1});
        Add(light, "spot", Aim(position, light.to_world.Vector(to - from)), "intensity", intensity,
            std::move(cone));
    }

    // False if it has no picture: then it shines evenly.
    bool ReadGoniometric(const PlacedLight& light, Vec3f from, Rgb intensity) {
        const Params& params = light.is.params;
        const std::string map3 = params.String("mapname", ""), map4 = params.String("filename", "");
        if (map3.empty() && map4.empty()) {
            return false;
        }
        if (params.Float("power", 0) > 0) {
            notes_->Add(light.is.place,
                        "the power of a goniometric light is that of a white picture");
        }
        plan_.pictured.push_back({scene_->lights.size(),
                                  textures_->Picture(map3.empty() ? map4 : map3, light.is.place),
                                  map3.empty()});
        Transform rigid;
        float scale = 1;
        if (!SplitScale(light.to_world * Transform::Translate(from), &rigid, &scale)) {
            notes_->Add(light.is.place,
                        "the goniometric light's transformation is uneven: only its rotation and "
                        "place are used");
        }
        // pbrt turns the map to have y up, by swapping y and z; both versions do.
        const Transform swap({1, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0});
        Add(light, "goniometric", rigid * swap * FromMap(), "intensity", intensity);
        return true;
    }

    void ReadInfinite(const PlacedLight& light) {
        const Params& params = light.is.params;
        EnvironmentPlan& plan = plan_.environment;
        if (plan.exists) {
            notes_->Add(light.is.place,
                        "only one infinite light is supported: further ones are "
                        "left out");
            for (const Param& param : params.all()) {
                param.used = true;
            }
            return;
        }
        plan.exists = true;
        plan.environment.color =
            spectra_->Get(params, "L", SpectrumUse::kLight, {1, 1, 1}) * Scale(params, spectra_);
        const std::string map3 = params.String("mapname", ""), map4 = params.String("filename", "");
        const float illuminance = params.Float("illuminance", 0);
        if (!map3.empty() || !map4.empty()) {
            plan.picture = textures_->Picture(map3.empty() ? map4 : map3, light.is.place);
            plan.equal_area = map3.empty();
            if (illuminance > 0) {
                notes_->Add(light.is.place,
                            "the illuminance of an infinite light with a picture "
                            "is ignored: the picture's values are used");
            }
        } else if (illuminance > 0) {
            plan.environment.color *= illuminance / kPi;
        }
        if (params.Has("portal")) {
            params.Ignore("portal");
            notes_->Add(light.is.place, "portals of infinite lights are not needed, and ignored");
        }
        Transform rigid;
        float scale = 1;
        if (!SplitScale(light.to_world, &rigid, &scale)) {
            notes_->Add(light.is.place,
                        "the infinite light's transformation is uneven: only its "
                        "rotation is used");
        }
        plan.environment.to_world = rigid * FromMap();
    }

    bool is_version3_;
    Textures* textures_;
    Spectra* spectra_;
    Scene* scene_;
    Notes* notes_;
    LightPlan plan_;
};

}  // namespace

bool SplitScale(const Transform& transform, Transform* rigid, float* scale) {
    const auto& m = transform.rows();
    const Vec3f x{m[0], m[4], m[8]}, y{m[1], m[5], m[9]}, z{m[2], m[6], m[10]};
    const float determinant = transform.Determinant();
    *scale = std::cbrt(std::abs(determinant));
    const Vec3f forward = Normalize(z);
    const Vec3f up = Normalize(y - forward * Dot(forward, y));
    const Vec3f right = determinant < 0 ? Cross(forward, up) : Cross(up, forward);
    *rigid = Transform({right.x, up.x, forward.x, m[3], right.y, up.y, forward.y, m[7], right.z,
                        up.z, forward.z, m[11]});
    const float tolerance = 1e-3f * *scale;
    return Length(x - right * *scale) < tolerance && Length(y - up * *scale) < tolerance &&
           Length(z - forward * *scale) < tolerance;
}

LightPlan ReadLights(const Document& document, Textures* textures, Spectra* spectra, Scene* scene,
                     Notes* notes) {
    return Reader(document.version3, textures, spectra, scene, notes).Read(document.lights);
}

}  // namespace relume::pbrt
