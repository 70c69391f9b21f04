#include "core/scene/obj_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relume::obj {
namespace {

constexpr bool kSrgb = true, kLinear = false;

float NumberOf(const MtlMaterial& from, const char* name, float otherwise) {
    const auto it = from.numbers.find(name);
    return it == from.numbers.end() ? otherwise : it->second;
}

Rgb ColorOf(const MtlMaterial& from, const char* name, Rgb otherwise) {
    const auto it = from.colors.find(name);
    return it == from.colors.end() ? otherwise : it->second;
}

bool HasMap(const MtlMaterial& from, const char* name) { return from.maps.count(name) != 0; }

void SetRgb(Rgb color, const char* param, Material* material) {
    material->params.Set(param, std::vector<float>{color.x, color.y, color.z});
}

Rgb AtMostOne(Rgb c) { return Min(c, {1, 1, 1}); }

bool IsBlack(Rgb c) { return !(MaxComponent(c) > 0); }

// What diffuse pictures are multiplied with, and what surfaces without any are.
Rgb DiffuseOf(const MtlMaterial& from) {
    return AtMostOne(
        ColorOf(from, "Kd", HasMap(from, "map_Kd") ? Rgb{1, 1, 1} : Rgb{0.8f, 0.8f, 0.8f}));
}

bool IsPbr(const MtlMaterial& from) {
    for (const char* name : {"Pr", "Pm", "Ps", "Pc"}) {
        if (from.numbers.count(name) != 0 || HasMap(from, ("map_" + std::string(name)).c_str())) {
            return true;
        }
    }
    return false;
}

// Of GGX: alpha is its square.
float RoughnessOf(const MtlMaterial& from, float otherwise) {
    const auto phong = from.numbers.find("Ns");
    const float roughness =
        phong == from.numbers.end() ? otherwise : std::sqrt(std::sqrt(2 / (phong->second + 2)));
    return std::min(NumberOf(from, "Pr", HasMap(from, "map_Pr") ? 1 : roughness), 1.0f);
}

Material Default() {
    Material material;
    material.name = "default";
    material.type = "diffuse";
    material.source = "the default material";
    SetRgb({0.8f, 0.8f, 0.8f}, "base_color", &material);
    return material;
}

}  // namespace

std::vector<int> Materials::Convert(const Document& document,
                                    const std::vector<MtlMaterial>& library) {
    std::map<std::string, const MtlMaterial*> by_name;
    for (const MtlMaterial& material : library) {
        by_name.emplace(material.name, &material);  // the first one of a name
    }
    std::vector<int> index_of(document.material_uses.size() + 1, -1);
    int default_index = -1;
    const auto use_default = [&](std::size_t index) {
        if (default_index < 0) {
            default_index = static_cast<int>(materials_.size());
            materials_.push_back(Default());
        }
        index_of[index] = default_index;
    };
    const bool bare = std::any_of(document.parts.begin(), document.parts.end(),
                                  [](const Part& part) { return part.material < 0; });
    if (bare || document.parts.empty()) {
        use_default(0);
    }
    for (std::size_t i = 0; i < document.material_uses.size(); ++i) {
        const Document::Named& use = document.material_uses[i];
        const auto it = by_name.find(use.name);
        if (it == by_name.end()) {
            notes_->Add(use.place, fmt::format("the material '{}' is in no library: the default is "
                                               "used",
                                               use.name));
            use_default(i + 1);
            continue;
        }
        Material material;
        material.name = use.name;
        material.source = fmt::format("{}: material '{}'", it->second->place.Text(), use.name);
        ConvertOne(*it->second, &material);
        index_of[i + 1] = static_cast<int>(materials_.size());
        materials_.push_back(std::move(material));
    }
    return index_of;
}

void Materials::ConvertOne(const MtlMaterial& from, Material* material) {
    const int illum = static_cast<int>(NumberOf(from, "illum", 2));
    const float ior = NumberOf(from, "Ni", 1.5f);
    const bool glass = illum == 4 || illum == 6 || illum == 7 || illum == 9;
    const bool passes =
        from.numbers.count("Ni") != 0 || from.colors.count("Tf") != 0 || NumberOf(from, "d", 1) < 1;
    if (glass && passes && ior > 1) {
        material->type = "dielectric";
        material->params.Set("ior", ior);
        SetRgb(AtMostOne(ColorOf(from, "Tf", {1, 1, 1})), "tint", material);
        if (from.numbers.count("Pr") != 0) {
            material->params.Set("roughness", RoughnessOf(from, 0));
        }
    } else if ((illum == 3 || illum == 5) && !IsPbr(from) &&
               !IsBlack(ColorOf(from, "Ks", {0, 0, 0}))) {
        SetMirror(from, material);
    } else {
        SetSurface(from, material);
    }
    if (material->type != "dielectric") {
        SetAlpha(from, material);
    }
    SetRelief(from, material);
    const Rgb emission = ColorOf(from, "Ke", HasMap(from, "map_Ke") ? Rgb{1, 1, 1} : Rgb{0, 0, 0});
    if (!IsBlack(emission)) {
        SetRgb(emission, "emissive", material);
        material->params.Set("double_sided", true);
        SetTexture(from, "map_Ke", "emissive_texture", kSrgb, material);
    }
}

void Materials::SetSurface(const MtlMaterial& from, Material* material) {
    const int illum = static_cast<int>(NumberOf(from, "illum", 2));
    const bool pbr = IsPbr(from);
    const Rgb specular = AtMostOne(
        ColorOf(from, "Ks", pbr || HasMap(from, "map_Ks") ? Rgb{0.5f, 0.5f, 0.5f} : Rgb{0, 0, 0}));
    SetRgb(DiffuseOf(from), "base_color", material);
    SetTexture(from, "map_Kd", "base_color_texture", kSrgb, material);
    if (!pbr && (illum < 2 || IsBlack(specular))) {
        material->type = "diffuse";
        return;
    }
    material->type = "metallic_roughness";
    SetRgb(specular * 2, "specular_color", material);
    SetTexture(from, "map_Ks", "specular_color_texture", kSrgb, material);
    SetMetalAndRoughness(from, material);
    SetLayers(from, material);
}

// Two parts that together reflect Kd + Ks, or as much of it as there is light.
void Materials::SetMirror(const MtlMaterial& from, Material* material) {
    Rgb diffuse = DiffuseOf(from), specular = AtMostOne(ColorOf(from, "Ks", {0, 0, 0}));
    const float most = std::max(MaxComponent(diffuse + specular), 1.0f);
    diffuse = diffuse / most;
    specular = specular / most;
    const float d = MaxComponent(diffuse), s = MaxComponent(specular);
    const float share = s / (d + s);
    Material mirror;
    mirror.name = material->name;
    mirror.source = material->source;
    mirror.type = "conductor";
    mirror.params.Set("fresnel", static_cast<int>(NumberOf(from, "illum", 3)) == 5);
    SetRgb(specular / share, "reflectance", &mirror);
    SetTexture(from, "map_Ks", "reflectance_texture", kSrgb, &mirror);
    if (!(d > 0)) {
        *material = std::move(mirror);
        return;
    }
    Material base;
    base.name = material->name;
    base.source = material->source;
    base.type = "diffuse";
    SetRgb(diffuse / (1 - share), "base_color", &base);
    SetTexture(from, "map_Kd", "base_color_texture", kSrgb, &base);
    material->type = "mix";
    material->params.Set("material_a", static_cast<float>(materials_.size()));
    material->params.Set("material_b", static_cast<float>(materials_.size() + 1));
    material->params.Set("amount", share);
    materials_.push_back(std::move(base));
    materials_.push_back(std::move(mirror));
}

void Materials::SetMetalAndRoughness(const MtlMaterial& from, Material* material) {
    const float metallic =
        std::min(NumberOf(from, "Pm", HasMap(from, "map_Pm") ? 1.0f : 0.0f), 1.0f);
    material->params.Set("metallic", metallic);
    material->params.Set("roughness", RoughnessOf(from, IsPbr(from) ? 1 : 0.5f));
    const int roughness = TextureOf(from, "map_Pr", kLinear);
    const int metal = metallic > 0 ? TextureOf(from, "map_Pm", kLinear) : -1;
    if (roughness < 0 && metal < 0) {
        return;
    }
    int both = roughness;
    if (metal >= 0 ? roughness != metal : metallic > 0) {
        // The parameter wants one picture, of what is not given white.
        Texture texture = textures_[static_cast<std::size_t>(roughness >= 0 ? roughness : metal)];
        const auto picture = [&](int index) {
            return index < 0 ? -1 : textures_[static_cast<std::size_t>(index)].image;
        };
        both = static_cast<int>(textures_.size());
        packed_.push_back({both, picture(roughness), picture(metal)});
        textures_.push_back(texture);
        if (roughness >= 0 && metal >= 0) {
            const Map &a = from.maps.at("map_Pr"), &b = from.maps.at("map_Pm");
            if (a.scale.x != b.scale.x || a.scale.y != b.scale.y || a.offset.x != b.offset.x ||
                a.offset.y != b.offset.y) {
                notes_->Add(b.place, "map_Pm lies as map_Pr does: its own -s and -o are ignored");
            }
        }
    }
    material->params.Set("metallic_roughness_texture", static_cast<float>(both));
}

void Materials::SetLayers(const MtlMaterial& from, Material* material) {
    const float sheen = std::min(NumberOf(from, "Ps", HasMap(from, "map_Ps") ? 1 : 0), 1.0f);
    if (sheen > 0) {
        SetRgb(Rgb{1, 1, 1} * sheen, "sheen_color", material);
        material->params.Set("sheen_roughness", 0.3f);  // MTL has none
        SetTexture(from, "map_Ps", "sheen_color_texture", kLinear, material);
    }
    const float coat = std::min(NumberOf(from, "Pc", HasMap(from, "map_Pc") ? 1 : 0), 1.0f);
    if (coat > 0) {
        material->params.Set("clearcoat", coat);
        material->params.Set(
            "clearcoat_roughness",
            std::min(NumberOf(from, "Pcr", HasMap(from, "map_Pcr") ? 1 : 0), 1.0f));
        SetTexture(from, "map_Pc", "clearcoat_texture", kLinear, material);
        SetTexture(from, "map_Pcr", "clearcoat_roughness_texture", kLinear, material);
    }
}

void Materials::SetRelief(const MtlMaterial& from, Material* material) {
    const auto norm = from.maps.find("norm"), bump = from.maps.find("bump");
    if (norm != from.maps.end()) {
        SetTexture(from, "norm", "normal_texture", kLinear, material);
        material->params.Set("normal_scale", norm->second.bump);
    } else if (bump != from.maps.end() && bump->second.bump != 0) {
        SetTexture(from, "bump", "bump_texture", kLinear, material);
        material->params.Set("bump_scale", bump->second.bump);
        bump_or_norm_.push_back(materials_.size());
    }
}

void Materials::SetAlpha(const MtlMaterial& from, Material* material) {
    const float alpha = std::min(NumberOf(from, "d", 1), 1.0f);
    const auto map = from.maps.find("map_d");
    if (from.maps.count("map_Tr") != 0) {
        notes_->Add(from.maps.at("map_Tr").place,
                    "'map_Tr' of materials is not supported, and ignored: use map_d");
    }
    if (alpha < 1) {
        material->params.Set("alpha", alpha);
    }
    if (map != from.maps.end()) {
        const int texture = TextureOf(from, "map_d", kLinear);
        material->params.Set("alpha_texture", static_cast<float>(texture));
        // Its matte channel is meant, if it has one.
        if (map->second.channel == 0 || map->second.channel == 'm') {
            mattes_.push_back(materials_.size());
        }
    }
    if (alpha < 1 || map != from.maps.end()) {
        material->params.Set("alpha_mode", "blend");
    }
}

}  // namespace relume::obj
