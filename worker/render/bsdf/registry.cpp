#include "worker/render/bsdf/registry.h"

#include <fmt/format.h>

#include "core/base/error.h"

namespace relume::render {

CompiledMaterial MakeDiffuse(const ParamSet& params, const Scene& scene);
CompiledMaterial MakeMetallicRoughness(const ParamSet& params, const Scene& scene);
CompiledMaterial MakeDielectric(const ParamSet& params, const Scene& scene);

namespace {

struct Entry {
    const char* type;
    CompiledMaterial (*make)(const ParamSet& params, const Scene& scene);
};

constexpr Entry kMaterials[] = {
    {"diffuse", MakeDiffuse},
    {"metallic_roughness", MakeMetallicRoughness},
    {"dielectric", MakeDielectric},
};

}  // namespace

CompiledMaterial CompileMaterial(const Material& material, const Scene& scene) {
    const std::string owner =
        material.source.empty() ? fmt::format("material '{}'", material.name) : material.source;
    std::string known;
    for (const Entry& entry : kMaterials) {
        if (material.type == entry.type) {
            try {
                const ParamSet params = material.params;  // reading marks: scenes are shared
                const CompiledMaterial compiled = entry.make(params, scene);
                params.RejectUnused(fmt::format("material type '{}'", material.type));
                return compiled;
            } catch (const Error& error) {
                throw Error(error.code(), fmt::format("{}: {}", owner, error.what()));
            }
        }
        known += fmt::format("{}{}", known.empty() ? "" : ", ", entry.type);
    }
    ThrowInvalidArgument(
        fmt::format("{}: unknown material type '{}'; known are {}", owner, material.type, known));
}

}  // namespace relume::render
