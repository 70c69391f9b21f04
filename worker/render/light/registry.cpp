#include "core/base/error.h"
#include "worker/render/compile_by_type.h"
#include "worker/render/light/punctual.h"

namespace relume::render {

PunctualLight MakePoint(const ParamSet& params);
PunctualLight MakeSpot(const ParamSet& params);
PunctualLight MakeDirectional(const ParamSet& params);

namespace {

struct Entry {
    const char* type;
    PunctualLight (*make)(const ParamSet& params);
};

constexpr Entry kLights[] = {
    {"point", MakePoint},
    {"spot", MakeSpot},
    {"directional", MakeDirectional},
};

}  // namespace

PunctualLight CompileLight(const Light& light) {
    return CompileByType("light", light, kLights, [&](const Entry& entry, const ParamSet& params) {
        PunctualLight compiled = entry.make(params);
        compiled.position = light.to_world.Point({0, 0, 0});
        compiled.direction = Normalize(light.to_world.Vector({0, 0, -1}));
        if (!IsFinite(compiled.position) || !IsFinite(compiled.direction)) {
            ThrowInvalidArgument("its transform is not finite or has a scale of 0");
        }
        return compiled;
    });
}

}  // namespace relume::render
