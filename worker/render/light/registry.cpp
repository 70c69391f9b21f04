#include "core/base/error.h"
#include "worker/render/compile_by_type.h"
#include "worker/render/light/punctual.h"

namespace relume::render {

PunctualLight MakePoint(const ParamSet& params);
PunctualLight MakeSpot(const ParamSet& params);
PunctualLight MakeDirectional(const ParamSet& params);
PunctualLight MakeGoniometric(const ParamSet& params);

namespace {

struct Entry {
    const char* type;
    PunctualLight (*make)(const ParamSet& params);
};

constexpr Entry kLights[] = {
    {"point", MakePoint},
    {"spot", MakeSpot},
    {"directional", MakeDirectional},
    {"goniometric", MakeGoniometric},
};

}  // namespace

PunctualLight CompileLight(const Scene& scene, const Light& light) {
    return CompileByType("light", light, kLights, [&](const Entry& entry, const ParamSet& params) {
        PunctualLight compiled = entry.make(params);
        compiled.position = light.to_world.Point({0, 0, 0});
        compiled.direction = Normalize(light.to_world.Vector({0, 0, -1}));
        if (!IsFinite(compiled.position) || !IsFinite(compiled.direction)) {
            ThrowInvalidArgument("its transform is not finite or has a scale of 0");
        }
        if (compiled.kind == PunctualLight::Kind::kGoniometric) {
            if (compiled.image < 0 ||
                static_cast<std::size_t>(compiled.image) >= scene.images.size()) {
                ThrowInvalidArgument(fmt::format("image refers to picture {}, but there are {}",
                                                 compiled.image, scene.images.size()));
            }
            compiled.map = std::make_shared<const SphereMap>(scene, compiled.image, Rgb{1, 1, 1});
            compiled.from_world = light.to_world.Inverse();
        }
        return compiled;
    });
}

}  // namespace relume::render
