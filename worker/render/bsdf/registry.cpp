#include "worker/render/bsdf/registry.h"

#include "worker/render/compile_by_type.h"

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
    return CompileByType(
        "material", material, kMaterials,
        [&](const Entry& entry, const ParamSet& params) { return entry.make(params, scene); });
}

}  // namespace relume::render
