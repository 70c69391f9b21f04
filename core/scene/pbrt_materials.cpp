#include "core/scene/pbrt_materials.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

namespace relume::pbrt {

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

bool HasNoSurface(const std::string& type) {
    return type.empty() || type == "none" || type == "interface";
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
    if (index >= 0 && HasNoSurface(document_.materials[static_cast<std::size_t>(index)].type)) {
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
