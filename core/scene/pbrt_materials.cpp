#include "core/scene/pbrt_materials.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relume::pbrt {
namespace {

using Kind = TextureNode::Kind;

void SetValue(const Value& value, bool color, const std::string& name, Material* material) {
    if (color) {
        material->params.Set(name,
                             std::vector<float>{value.factor.x, value.factor.y, value.factor.z});
    } else {
        material->params.Set(name, value.factor.x);
    }
    if (value.texture >= 0) {
        material->params.Set(name + "_texture", static_cast<float>(value.texture));
    }
}

void SetRgb(Rgb c, const std::string& name, Material* material) {
    SetValue({c, -1}, true, name, material);
}

bool IsNone(const std::string& type) {
    return type.empty() || type == "none" || type == "interface";
}

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

void Materials::SetBump(const Declared& from, int before, Material* material) {
    const Params& params = from.params;
    for (const char* name : {"displacement", "bumpmap"}) {
        if (params.Find(name, "texture") != nullptr) {
            const Value bump = textures_->Number(params, name, before, 0);
            if (bump.texture >= 0) {
                material->params.Set("bump_texture", static_cast<float>(bump.texture));
                material->params.Set("bump_scale", bump.factor.x);
            }
            break;
        }
        params.Find(name, "float");  // constant: no bump
    }
    const std::string normals = params.String("normalmap", "");
    if (!normals.empty()) {
        material->params.Set("normal_texture",
                             static_cast<float>(textures_->Plain(normals, false, from.place)));
    }
}

void Materials::SetAbsorption(const Declared& from, const std::string& inside, Material* material) {
    const auto it = document_.media.find(inside);
    if (inside.empty()) {
        return;
    }
    if (it == document_.media.end()) {
        Fail(from.place,
             fmt::format("the medium '{}' is not known; define it with MakeNamedMedium", inside));
    }
    const Declared& medium = it->second;
    const Params& params = medium.params;
    if (medium.type != "homogeneous" || params.Has("preset")) {
        notes_->Add(medium.place,
                    fmt::format("media of type {} are not supported: '{}' is ignored",
                                params.Has("preset") ? "preset" : medium.type, inside));
        return;
    }
    const float scale = params.Float("scale", 1);
    // pbrt's defaults are skim milk.
    const Rgb absorbed =
        spectra_->Get(params, "sigma_a", SpectrumUse::kIndex, {0.0011f, 0.0024f, 0.014f}) * scale;
    const Rgb scattered =
        spectra_->Get(params, "sigma_s", SpectrumUse::kIndex, {2.55f, 3.21f, 3.77f}) * scale;
    if (MaxComponent(scattered) > 0) {
        notes_->Add(medium.place, fmt::format("scattering in media is not supported: '{}' only "
                                              "absorbs",
                                              inside));
    }
    params.Ignore("g");
    params.NoteUnused("medium", notes_);
    SetRgb(absorbed, "absorption", material);
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

void Materials::ConvertDisney(const Declared& from, int before, Material* material) {
    const Params& params = from.params;
    material->type = "metallic_roughness";
    SetColor(params, "color", before, {0.5f, 0.5f, 0.5f}, "base_color", material);
    const auto number = [&](const char* name, float otherwise, const char* as) {
        const Value value = textures_->Number(params, name, before, otherwise);
        if (value.texture >= 0) {
            notes_->Add(from.place, fmt::format("disney: a texture for {} is not supported: {} is "
                                                "used",
                                                name, otherwise));
        }
        material->params.Set(
            as, std::clamp(value.texture >= 0 ? otherwise : value.factor.x, 0.0f, 1.0f));
    };
    number("metallic", 0, "metallic");
    number("roughness", 0.5f, "roughness");
    number("spectrans", 0, "transmission");
    material->params.Set("ior", Index(params, 1.5f));
    material->params.Set("thin", params.Bool("thin", false));
    params.Ignore("clearcoatgloss sheentint");  // without meaning where sheen and clearcoat are 0
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
        if (IsNone(document_.materials[static_cast<std::size_t>(index)].type)) {
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

void Materials::Convert(const Declared& from, int before, const std::string& inside,
                        Material* material) {
    const std::string& type = from.type;
    material->source = fmt::format("{}: material {}", from.place.Text(),
                                   from.name.empty() ? type : "'" + from.name + "'");
    material->name = from.name;
    const Params& params = from.params;
    params.Ignore("type");
    if (!ConvertOpaque(from, before, material) && !ConvertOther(from, before, inside, material)) {
        // The colour that comes closest, if it has one.
        notes_->Add(from.place, fmt::format("materials of type {} are not supported: a diffuse one "
                                            "is used",
                                            type));
        material->type = "diffuse";
        const char* color = "reflectance";
        for (const char* name : {"Kd", "color"}) {
            color = params.Has(name) ? name : color;
        }
        SetColor(params, color, before, {0.5f, 0.5f, 0.5f}, "base_color", material);
        for (const Param& param : params.all()) {
            param.used = true;
        }
    }
    if (!inside.empty() && material->type != "dielectric" && material->type != "mix") {
        notes_->Add(from.place, fmt::format("media inside of materials other than glass are "
                                            "ignored ('{}')",
                                            inside));
    }
    SetBump(from, before, material);
    params.NoteUnused(fmt::format("material of type {}", type), notes_);
}

int Materials::Base(int index, const std::string& inside) {
    const std::string key = fmt::format("{}\n{}", index, inside);
    const auto known = known_.find(key);
    if (known != known_.end()) {
        return known->second;
    }
    Material material;
    if (index < 0) {
        material.type = "diffuse";
        material.name = "default";
        material.source = "the default material";
        SetRgb({0.5f, 0.5f, 0.5f}, "base_color", &material);
    } else {
        const Declared& from = document_.materials[static_cast<std::size_t>(index)];
        if (++depth_ > 32) {
            Fail(from.place, "this mix of materials contains itself; correct it");
        }
        Convert(from, document_.textures_before[static_cast<std::size_t>(index)], inside,
                &material);
        --depth_;
    }
    materials_.push_back(std::move(material));
    const int result = static_cast<int>(materials_.size()) - 1;
    known_[key] = result;
    return result;
}

bool Materials::SetAlpha(const Shape& shape, Material* material) {
    const Params& params = shape.is.params;
    if (!params.Has("alpha")) {
        return true;
    }
    const Value alpha =
        textures_->Number(params, "alpha", static_cast<int>(document_.textures.size()), 1);
    if (alpha.texture < 0 && !(alpha.factor.x > 0)) {
        return false;
    }
    SetValue(alpha, false, "alpha", material);
    // pbrt-v3 cuts out where alpha is 0, pbrt-v4 lets that share of rays through.
    material->params.Set("alpha_mode", document_.version3 ? "mask" : "blend");
    if (document_.version3) {
        material->params.Set("alpha_cutoff", 1.0f / 512);
    }
    return true;
}

void Materials::SetEmission(const Shape& shape, int index, Material* material) {
    const Declared& light = document_.area_lights[static_cast<std::size_t>(shape.area_light)];
    const Params& params = light.params;
    if (light.type != "diffuse" && light.type != "area") {
        notes_->Add(light.place, fmt::format("area lights of type {} are not supported: it shines "
                                             "as a diffuse one",
                                             light.type));
    }
    Rgb radiance = spectra_->Get(params, "L", SpectrumUse::kLight, {1, 1, 1}) *
                   spectra_->Get(params, "scale", SpectrumUse::kIndex, {1, 1, 1});
    const bool two_sided = params.Bool("twosided", false);
    params.Ignore("samples nsamples");
    const std::string image = params.String("filename", "");
    if (!image.empty()) {
        material->params.Set("emissive_texture",
                             static_cast<float>(textures_->Plain(image, true, light.place)));
    }
    const float power = params.Float("power", 0);
    if (power > 0) {
        if (!image.empty()) {
            notes_->Add(light.place,
                        "the power of area lights with a picture is that of a white "
                        "picture");
        }
        radiance *= power;
        const std::string& type = shape.is.type;
        power_lights_.push_back(
            {index, two_sided ? 2.0f : 1.0f,
             type == "trianglemesh" || type == "plymesh" || type == "loopsubdiv"});
    }
    SetRgb(radiance, "emissive", material);
    material->params.Set("double_sided", two_sided);
    params.NoteUnused("area light", notes_);
}

int Materials::Of(const Shape& shape, bool in_object) {
    if (!shape.media.outside.empty()) {
        notes_->Add(shape.is.place, fmt::format("the medium '{}' around shapes is not supported, "
                                                "and ignored",
                                                shape.media.outside));
    }
    bool shines = shape.area_light >= 0;
    if (shines && in_object) {
        notes_->Add(shape.is.place, "area lights in objects do not shine, as in pbrt");
        shines = false;
    }
    int index = shape.material;
    if (index >= 0 && IsNone(document_.materials[static_cast<std::size_t>(index)].type)) {
        if (!shines) {
            notes_->Add(shape.is.place,
                        "shapes without a surface (boundaries of media) are left "
                        "out");
            return -1;
        }
        notes_->Add(shape.is.place, "area lights without a surface are seen as black ones");
        index = -1;
    }
    const Params& params = shape.is.params;
    const Param* texture = params.Find("alpha", "texture");
    const bool has_alpha = params.Has("alpha");
    params.Ignore("shadowalpha");
    const bool by_power =
        shines &&
        document_.area_lights[static_cast<std::size_t>(shape.area_light)].params.Has("power");
    const std::string key =
        fmt::format("{}\n{}\n{}\n{}\n{}", index, shape.media.inside, shines ? shape.area_light : -1,
                    texture != nullptr ? fmt::format("{}", fmt::join(texture->strings, "\n"))
                    : has_alpha        ? fmt::format("{}", params.Float("alpha", 1))
                                       : "",
                    by_power ? fmt::format("{}", static_cast<const void*>(&shape)) : "");
    const auto known = known_.find(key);
    if (known != known_.end()) {
        return known->second;
    }
    const int base = Base(index, shape.media.inside);
    if (!shines && !has_alpha) {
        known_[key] = base;
        return base;
    }
    const int result = static_cast<int>(materials_.size());
    Material material = materials_[static_cast<std::size_t>(base)];
    if (!SetAlpha(shape, &material)) {
        if (!shines) {
            known_[key] = -1;
            return -1;
        }
        notes_->Add(shape.is.place, "area lights of alpha 0, which pbrt hides, are visible");
    }
    if (shines) {
        if (index < 0 && shape.material >= 0) {
            SetRgb({0, 0, 0}, "base_color", &material);
        }
        SetEmission(shape, result, &material);
    }
    materials_.push_back(std::move(material));
    known_[key] = result;
    return result;
}

bool Materials::HasTextures(int material) const {
    const Material& m = materials_[static_cast<std::size_t>(material)];
    if (m.type == "mix") {  // its parts may have some
        return true;
    }
    for (const auto& [name, value] : m.params.values()) {
        if (name.size() > 8 && name.compare(name.size() - 8, 8, "_texture") == 0) {
            return true;
        }
    }
    return false;
}

}  // namespace relume::pbrt
