#include <fmt/format.h>

#include "core/base/error.h"
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
    const std::string owner =
        light.source.empty() ? fmt::format("light '{}'", light.name) : light.source;
    std::string known;
    for (const Entry& entry : kLights) {
        if (light.type == entry.type) {
            try {
                const ParamSet params = light.params;  // reading marks: scenes are shared
                PunctualLight compiled = entry.make(params);
                params.RejectUnused(fmt::format("light type '{}'", light.type));
                compiled.position = light.to_world.Point({0, 0, 0});
                compiled.direction = Normalize(light.to_world.Vector({0, 0, -1}));
                if (!IsFinite(compiled.position) || !IsFinite(compiled.direction)) {
                    ThrowInvalidArgument("its transform is not finite or has a scale of 0");
                }
                return compiled;
            } catch (const Error& error) {
                throw Error(error.code(), fmt::format("{}: {}", owner, error.what()));
            }
        }
        known += fmt::format("{}{}", known.empty() ? "" : ", ", entry.type);
    }
    ThrowInvalidArgument(
        fmt::format("{}: unknown light type '{}'; known are {}", owner, light.type, known));
}

}  // namespace relume::render
