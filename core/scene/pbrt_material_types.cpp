#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/scene/pbrt_materials.h"

// What each type of material of pbrt becomes.
namespace relume::pbrt {
namespace {

using Kind = TextureNode::Kind;

}  // namespace

void Materials::SetColor(const Params& params, const char* name, int before, Rgb otherwise,
                         const char* as, Material* material) {
    SetValue(textures_->Color(params, name, before, SpectrumUse::kReflectance, otherwise), true, as,
             material);
}

void Materials::SetNumber(const Params& params, const char* name, int before, float otherwise,
                          const char* as, Material* material) {
    SetValue(textures_->Number(params, name, before, otherwise), false, as, material);
}

float Materials::Index(const Params& params, float otherwise) {
    float eta = otherwise;
    for (const char* name : {"eta", "index"}) {
        if (const auto rgb = spectra_->Find(params, name, SpectrumUse::kIndex)) {
            eta = rgb->y;
            break;
        }
    }
    return eta > 0 ? eta : 1;
}

void Materials::SetRoughness(const Params& params, int before, float otherwise, bool version3,
                             const std::string& prefix, const char* as_u, const char* as_v,
                             Material* material) {
    const Kind remap = !params.Bool("remaproughness", true) ? Kind::kConstant
                       : version3                           ? Kind::kRoughness3
                                                            : Kind::kRoughness4;
    const char* as[2] = {as_u, as_v};
    const std::string names[2] = {prefix + "uroughness", prefix + "vroughness"};
    const std::string both = prefix + "roughness";
    for (int i = 0; i < 2; ++i) {
        const std::string& name = params.Has(names[i]) ? names[i] : both;
        Value value = textures_->Number(params, name.c_str(), before, otherwise, remap);
        // Whatever the map, pbrt's glass of roughness 0 is smooth.
        if (material->type == "dielectric" && value.texture < 0 &&
            textures_->Number(params, name.c_str(), before, otherwise).factor.x == 0) {
            value.factor = {0, 0, 0};
        }
        SetValue(value, false, as[i], material);
    }
}

void Materials::SetConductor(const Params& params, int before, const std::string& prefix,
                             Material* material) {
    if (params.Has("reflectance")) {
        SetColor(params, "reflectance", before, {1, 1, 1}, "reflectance", material);
        return;
    }
    const std::string eta = prefix + "eta", k = prefix + "k";
    SetRgb(spectra_->Get(params, eta, SpectrumUse::kIndex, *NamedIndex("metal-Cu-eta")), "eta",
           material);
    SetRgb(spectra_->Get(params, k, SpectrumUse::kIndex, *NamedIndex("metal-Cu-k")), "k", material);
}

// The index of refraction of a dielectric coat of pbrt-v3: FresnelBlend (`schlick`) reflects Ks
// straight on, the others Ks times what their index gives.
void Materials::SetCoat(const Declared& from, int before, bool schlick, Material* material) {
    const Params& params = from.params;
    const float eta = schlick ? 1.5f : Index(params, 1.5f);
    const float full = schlick ? 1 : (eta - 1) * (eta - 1) / ((eta + 1) * (eta + 1));
    const Rgb standard = Rgb{1, 1, 1} * (schlick ? 0.5f : 0.25f);
    const Value ks = textures_->Color(params, "Ks", before, SpectrumUse::kReflectance, standard);
    float mean = Average(ks.factor);
    if (ks.texture >= 0) {
        notes_->Add(from.place, "a texture for Ks is not supported: its mean is taken as 0.5");
        mean *= 0.5f;
    }
    if (ks.factor.x != ks.factor.y || ks.factor.x != ks.factor.z) {
        notes_->Add(from.place, "a coat's colour Ks is not supported: its mean is used");
    }
    const float root = std::sqrt(std::clamp(mean * full, 0.0f, 0.98f));
    material->params.Set("ior", (1 + root) / (1 - root));
}

bool Materials::ConvertOpaque(const Declared& from, int before, Material* material) {
    const std::string& type = from.type;
    const Params& params = from.params;
    const auto coated = [&](const char* color, Rgb otherwise, float roughness, bool version3) {
        material->type = "coated_diffuse";
        SetColor(params, color, before, otherwise, "base_color", material);
        SetRoughness(params, before, roughness, version3, "", "alpha_u", "alpha_v", material);
    };
    const auto diffuse = [&](const char* color, Rgb otherwise) {
        material->type = "diffuse";
        SetColor(params, color, before, otherwise, "base_color", material);
    };
    if (type == "matte" || type == "diffuse") {
        diffuse(type == "matte" ? "Kd" : "reflectance", {0.5f, 0.5f, 0.5f});
        const Value sigma = textures_->Number(params, "sigma", before, 0);
        if (sigma.texture >= 0) {
            notes_->Add(from.place, "a texture for sigma is not supported: 0 is used");
        } else if (sigma.factor.x != 0) {
            material->params.Set("sigma", sigma.factor.x);
        }
    } else if (type == "plastic" || type == "substrate" || type == "uber") {
        const bool substrate = type == "substrate";
        coated("Kd", Rgb{1, 1, 1} * (substrate ? 0.5f : 0.25f), 0.1f, true);
        SetCoat(from, before, substrate, material);
        if (type == "uber") {
            for (const char* name : {"Kr", "Kt"}) {
                const Value value =
                    textures_->Color(params, name, before, SpectrumUse::kReflectance, {0, 0, 0});
                if (value.texture >= 0 || MaxComponent(value.factor) > 0) {
                    notes_->Add(from.place,
                                fmt::format("uber: {} is not supported, and ignored", name));
                }
            }
            const Value opacity =
                textures_->Color(params, "opacity", before, SpectrumUse::kReflectance, {1, 1, 1});
            if (opacity.texture >= 0 || !(opacity.factor == Rgb{1, 1, 1})) {
                SetValue({Rgb{1, 1, 1} * Average(opacity.factor), opacity.texture}, false, "alpha",
                         material);
                material->params.Set("alpha_mode", "blend");
            }
        }
    } else if (type == "coateddiffuse") {
        coated("reflectance", {0.5f, 0.5f, 0.5f}, 0, false);
        material->params.Set("ior", Index(params, 1.5f));
        // The layer in between is clear unless it has an albedo.
        const auto albedo = spectra_->Find(params, "albedo", SpectrumUse::kReflectance);
        if ((albedo && MaxComponent(*albedo) > 0) || params.Find("albedo", "texture") != nullptr) {
            notes_->Add(from.place, "coateddiffuse: scattering in the coat (albedo) is ignored");
        }
        params.Ignore("thickness g maxdepth nsamples");
    } else if (type == "metal" || type == "conductor") {
        material->type = "conductor";
        SetConductor(params, before, "", material);
        SetRoughness(params, before, type == "metal" ? 0.01f : 0, type == "metal", "", "alpha_u",
                     "alpha_v", material);
    } else if (type == "mirror") {
        material->type = "conductor";
        SetColor(params, "Kr", before, {0.9f, 0.9f, 0.9f}, "reflectance", material);
        material->params.Set("fresnel", false);
    } else if (type == "coatedconductor") {
        material->type = "coated_conductor";
        SetConductor(params, before, "conductor.", material);
        SetRoughness(params, before, 0, false, "interface.", "alpha_u", "alpha_v", material);
        SetRoughness(params, before, 0, false, "conductor.", "conductor_alpha_u",
                     "conductor_alpha_v", material);
        const auto eta = spectra_->Find(params, "interface.eta", SpectrumUse::kIndex);
        material->params.Set("ior", eta && eta->y > 0 ? eta->y : 1.5f);
        const auto albedo = spectra_->Find(params, "albedo", SpectrumUse::kReflectance);
        if ((albedo && MaxComponent(*albedo) > 0) || params.Find("albedo", "texture") != nullptr) {
            notes_->Add(from.place, "coatedconductor: scattering in the coat (albedo) is ignored");
        }
        params.Ignore("thickness interface.thickness g maxdepth nsamples");
    } else if (type == "disney") {
        ConvertDisney(from, before, material);
    } else {
        return false;
    }
    return true;
}

bool Materials::ConvertOther(const Declared& from, int before, const std::string& inside,
                             Material* material) {
    const std::string& type = from.type;
    const Params& params = from.params;
    if (type == "glass" || type == "dielectric") {
        material->type = "dielectric";
        material->params.Set("ior", Index(params, 1.5f));
        SetRoughness(params, before, 0, type == "glass", "", "alpha_u", "alpha_v", material);
        if (type == "glass") {
            SetColor(params, "Kr", before, {1, 1, 1}, "reflect", material);
            SetColor(params, "Kt", before, {1, 1, 1}, "tint", material);
        }
        SetAbsorption(from, inside, material);
    } else if (type == "thindielectric") {
        material->type = "thin_dielectric";
        material->params.Set("ior", Index(params, 1.5f));
    } else if (type == "diffusetransmission") {
        material->type = "diffuse_transmission";
        const float scale = params.Float("scale", 1);
        const Rgb quarter{0.25f, 0.25f, 0.25f};
        for (const char* name : {"reflectance", "transmittance"}) {
            Value value =
                textures_->Color(params, name, before, SpectrumUse::kReflectance, quarter);
            value.factor *= scale;
            SetValue(value, true, name[0] == 'r' ? "base_color" : name, material);
        }
    } else if (type == "translucent") {
        material->type = "diffuse_transmission";
        const Value kd = textures_->Color(params, "Kd", before, SpectrumUse::kReflectance,
                                          {0.25f, 0.25f, 0.25f});
        const Value ks = textures_->Color(params, "Ks", before, SpectrumUse::kReflectance,
                                          {0.25f, 0.25f, 0.25f});
        const Rgb half{0.5f, 0.5f, 0.5f};
        const Rgb reflect = spectra_->Get(params, "reflect", SpectrumUse::kReflectance, half);
        const Rgb transmit = spectra_->Get(params, "transmit", SpectrumUse::kReflectance, half);
        SetValue({kd.factor * reflect, kd.texture}, true, "base_color", material);
        SetValue({kd.factor * transmit, kd.texture}, true, "transmittance", material);
        if (ks.texture >= 0 || MaxComponent(ks.factor) > 0) {
            notes_->Add(from.place,
                        "translucent: the glossy part (Ks) is not supported, and "
                        "ignored");
        }
        params.Ignore("roughness remaproughness");
    } else if (type == "mix") {
        ConvertMix(from, before, inside, material);
    } else {
        return false;
    }
    return true;
}

void Materials::ConvertMix(const Declared& from, int before, const std::string& inside,
                           Material* material) {
    const Params& params = from.params;
    std::vector<std::string> names = params.Strings("materials");
    const bool version3 = names.empty();
    if (version3) {  // there, `amount` is the first one's share
        names = {params.String("namedmaterial2", ""), params.String("namedmaterial1", "")};
    }
    if (names.size() != 2) {
        Fail(from.place, "a mix must name two materials");
    }
    const int order = static_cast<int>(&from - document_.materials.data());
    int parts[2];
    for (std::size_t i = 0; i < 2; ++i) {
        const int index = document_.material_names.Find(names[i], order);
        if (index < 0) {
            Fail(from.place, fmt::format("the material '{}' of a mix is not known; define it with "
                                         "MakeNamedMaterial",
                                         names[i]));
        }
        if (HasNoSurface(document_.materials[static_cast<std::size_t>(index)].type)) {
            Fail(from.place, "a mix can't have a part without a surface; use alpha instead");
        }
        parts[i] = Base(index, inside);
    }
    material->type = "mix";
    material->params.Set("material_a", static_cast<float>(parts[0]));
    material->params.Set("material_b", static_cast<float>(parts[1]));
    if (params.Find("amount", "texture") != nullptr) {
        SetNumber(params, "amount", before, 0.5f, "amount", material);
    } else {
        const Rgb amount =
            spectra_->Get(params, "amount", SpectrumUse::kReflectance, {0.5f, 0.5f, 0.5f});
        if (amount.x != amount.y || amount.x != amount.z) {
            notes_->Add(from.place, "mix: a coloured amount is not supported: its mean is used");
        }
        material->params.Set("amount", std::clamp(Average(amount), 0.0f, 1.0f));
    }
}

}  // namespace relume::pbrt
