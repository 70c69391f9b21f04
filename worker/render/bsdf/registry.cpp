#include "worker/render/bsdf/registry.h"

#include "worker/render/bsdf/params.h"
#include "worker/render/compile_by_type.h"

namespace relume::render {

CompiledMaterial MakeDiffuse(const ParamSet& params, const Scene& scene);
CompiledMaterial MakeMetallicRoughness(const ParamSet& params, const Scene& scene);
CompiledMaterial MakeCoatedDiffuse(const ParamSet& params, const Scene& scene);
CompiledMaterial MakeConductor(const ParamSet& params, const Scene& scene);
CompiledMaterial MakeCoatedConductor(const ParamSet& params, const Scene& scene);
CompiledMaterial MakeDielectric(const ParamSet& params, const Scene& scene);
CompiledMaterial MakeThinDielectric(const ParamSet& params, const Scene& scene);
CompiledMaterial MakeDiffuseTransmission(const ParamSet& params, const Scene& scene);
CompiledMaterial MakeMix(const ParamSet& params, const Scene& scene);

namespace {

struct Entry {
    const char* type;
    CompiledMaterial (*make)(const ParamSet& params, const Scene& scene);
};

constexpr Entry kMaterials[] = {
    {"diffuse", MakeDiffuse},
    {"metallic_roughness", MakeMetallicRoughness},
    {"coated_diffuse", MakeCoatedDiffuse},
    {"conductor", MakeConductor},
    {"coated_conductor", MakeCoatedConductor},
    {"dielectric", MakeDielectric},
    {"thin_dielectric", MakeThinDielectric},
    {"diffuse_transmission", MakeDiffuseTransmission},
    {"mix", MakeMix},
};

}  // namespace

std::vector<CompiledMaterial> CompileMaterials(const Scene& scene) {
    std::vector<CompiledMaterial> materials;
    materials.reserve(scene.materials.size());
    for (const Material& material : scene.materials) {
        materials.push_back(CompileByType(
            "material", material, kMaterials,
            [&](const Entry& entry, const ParamSet& params) { return entry.make(params, scene); }));
    }
    FinishMaterials(scene, &materials);
    return materials;
}

}  // namespace relume::render
