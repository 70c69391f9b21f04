#include "core/scene/pbrt_lights.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
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

class Reader {
  public:
    Reader(bool version3, Textures* textures, Spectra* spectra, Scene* scene, Notes* notes)
        : is_version3_(version3),
          textures_(textures),
          spectra_(spectra),
          scene_(scene),
          notes_(notes) {}

    EnvironmentPlan Read(const std::vector<PlacedLight>& lights) {
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
            if (light.is.type == "goniometric") {
                params.Ignore("mapname filename");
                notes_->Add(light.is.place,
                            "the pictures of goniometric lights are ignored: they "
                            "shine evenly");
            }
            Add(light, "point", Transform::Translate(position), "intensity", intensity);
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

    void ReadInfinite(const PlacedLight& light) {
        const Params& params = light.is.params;
        if (plan_.exists) {
            notes_->Add(light.is.place,
                        "only one infinite light is supported: further ones are "
                        "left out");
            for (const Param& param : params.all()) {
                param.used = true;
            }
            return;
        }
        plan_.exists = true;
        plan_.environment.color =
            spectra_->Get(params, "L", SpectrumUse::kLight, {1, 1, 1}) * Scale(params, spectra_);
        const std::string map3 = params.String("mapname", ""), map4 = params.String("filename", "");
        const float illuminance = params.Float("illuminance", 0);
        if (!map3.empty() || !map4.empty()) {
            plan_.picture = textures_->Picture(map3.empty() ? map4 : map3, light.is.place);
            plan_.equal_area = map3.empty();
            if (illuminance > 0) {
                notes_->Add(light.is.place,
                            "the illuminance of an infinite light with a picture "
                            "is ignored: the picture's values are used");
            }
        } else if (illuminance > 0) {
            plan_.environment.color *= illuminance / kPi;
        }
        if (params.Has("portal")) {
            params.Ignore("portal");
            notes_->Add(light.is.place, "portals of infinite lights are not needed, and ignored");
        }
        // Scene's maps have y up and u turning to the right seen from inside; pbrt's z up and u
        // turning left.
        const Transform to_pbrt({0, 0, 1, 0, -1, 0, 0, 0, 0, 1, 0, 0});
        Transform rigid;
        float scale = 1;
        if (!SplitScale(light.to_world, &rigid, &scale)) {
            notes_->Add(light.is.place,
                        "the infinite light's transformation is uneven: only its "
                        "rotation is used");
        }
        plan_.environment.to_world = rigid * to_pbrt;
    }

    bool is_version3_;
    Textures* textures_;
    Spectra* spectra_;
    Scene* scene_;
    Notes* notes_;
    EnvironmentPlan plan_;
};

void MakeLinear(SceneImage* image) {
    image->floats.reserve(image->bytes.size());
    for (const std::uint8_t byte : image->bytes) {
        const float c = static_cast<float>(byte) / 255;
        image->floats.push_back(c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f));
    }
    image->bytes = {};
}

// Texels beyond an edge of an equal-area map lie on the same edge, mirrored.
Rgb Texel(const SceneImage& image, int x, int y) {
    const int n = image.width;
    if (x < 0 || x >= n) {
        x = x < 0 ? -1 - x : 2 * n - 1 - x;
        y = n - 1 - y;
    }
    if (y < 0 || y >= n) {
        y = y < 0 ? -1 - y : 2 * n - 1 - y;
        x = n - 1 - x;
    }
    x = std::clamp(x, 0, n - 1);
    y = std::clamp(y, 0, n - 1);
    const auto channels = static_cast<std::size_t>(image.channels);
    const std::size_t at =
        (static_cast<std::size_t>(y) * static_cast<std::size_t>(n) + static_cast<std::size_t>(x)) *
        channels;
    return channels < 3 ? Rgb{1, 1, 1} * image.floats[at]
                        : Rgb{image.floats[at], image.floats[at + 1], image.floats[at + 2]};
}

Rgb Bilinear(const SceneImage& image, Vec2f uv) {
    const auto n = static_cast<float>(image.width);
    const float x = uv.x * n - 0.5f, y = uv.y * n - 0.5f;
    const float fx = std::floor(x), fy = std::floor(y);
    const int x0 = static_cast<int>(fx), y0 = static_cast<int>(fy);
    return Lerp(y - fy, Lerp(x - fx, Texel(image, x0, y0), Texel(image, x0 + 1, y0)),
                Lerp(x - fx, Texel(image, x0, y0 + 1), Texel(image, x0 + 1, y0 + 1)));
}

// pbrt's equal-area map in latitude (z up) and longitude, 2 x 2 samples a texel.
SceneImage ToLatitudeLongitude(const SceneImage& square) {
    SceneImage map;
    map.name = square.name;
    map.width = 2 * square.width;
    map.height = square.height;
    if (square.floats.empty()) {
        return map;
    }
    map.channels = 3;
    map.floats.reserve(static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height) *
                       3);
    for (int y = 0; y < map.height; ++y) {
        for (int x = 0; x < map.width; ++x) {
            Rgb sum;
            for (int i = 0; i < 4; ++i) {
                const float phi = 2 * kPi *
                                  (static_cast<float>(x) + ((i & 1) != 0 ? 0.75f : 0.25f)) /
                                  static_cast<float>(map.width);
                const float theta = kPi * (static_cast<float>(y) + ((i & 2) != 0 ? 0.75f : 0.25f)) /
                                    static_cast<float>(map.height);
                sum += Bilinear(
                    square, EqualAreaSquare({std::sin(theta) * std::cos(phi),
                                             std::sin(theta) * std::sin(phi), std::cos(theta)}));
            }
            for (int c = 0; c < 3; ++c) {
                map.floats.push_back(0.25f * sum[c]);
            }
        }
    }
    return map;
}

}  // namespace

Vec2f EqualAreaSquare(Vec3f d) {
    const float x = std::abs(d.x), y = std::abs(d.y), z = std::abs(d.z);
    const float r = std::sqrt(std::max(0.0f, 1 - z));
    const float a = std::max(x, y), b = std::min(x, y);
    float angle = a == 0 ? 0 : std::atan(b / a) * (2 / kPi);  // 0 to 1/2
    angle = x < y ? 1 - angle : angle;
    float v = angle * r, u = r - v;
    if (d.z < 0) {
        std::swap(u, v);
        u = 1 - u;
        v = 1 - v;
    }
    return {(std::copysign(u, d.x) + 1) / 2, (std::copysign(v, d.y) + 1) / 2};
}

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

EnvironmentPlan ReadLights(const Document& document, Textures* textures, Spectra* spectra,
                           Scene* scene, Notes* notes) {
    return Reader(document.version3, textures, spectra, scene, notes).Read(document.lights);
}

void FinishEnvironment(EnvironmentPlan plan, Scene* scene, Notes* notes) {
    if (!plan.exists) {
        return;
    }
    if (plan.picture >= 0) {
        SceneImage& image = scene->images[static_cast<std::size_t>(plan.picture)];
        MakeLinear(&image);
        if (plan.equal_area && image.width == image.height) {
            image = ToLatitudeLongitude(image);
        } else if (plan.equal_area) {
            notes->Add({}, fmt::format("{}: is not square, as pbrt-v4's equal-area maps are: it is "
                                       "taken as a latitude-longitude map",
                                       image.name));
        }
    }
    plan.environment.image = plan.picture;
    scene->environment = std::make_shared<Environment>(plan.environment);
}

}  // namespace relume::pbrt
