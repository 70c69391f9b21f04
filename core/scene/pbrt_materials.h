#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/scene/pbrt_textures.h"
#include "core/scene/scene.h"

namespace relume::pbrt {

// Sets a material's parameter: three numbers (color) or one, and the texture beside it.
void SetValue(const Value& value, bool color, const std::string& name, Material* material);
void SetRgb(Rgb c, const std::string& name, Material* material);

// Materials that bound media and are not seen.
bool HasNoSurface(const std::string& type);

// Turns the materials that shapes use into Scene's, each combination of material, area light,
// interior medium and alpha once. The meaning of each type is in scene.h.
class Materials {
  public:
    Materials(const Document& document, Textures* textures, Spectra* spectra, Notes* notes)
        : document_(document), textures_(textures), spectra_(spectra), notes_(notes) {}

    // The material of a shape; -1 if nothing of it is seen (alpha 0, no surface). Shapes of objects
    // do not shine, as in pbrt.
    int Of(const Shape& shape, bool in_object);

    // Lights that are given by their power: the emission of `material`, which belongs to one mesh,
    // is to be divided by area times pi, once for each side.
    struct PowerLight {
        int material;
        float sides;
        bool each_triangle;  // every triangle has the power: multiply by their number
    };
    const std::vector<PowerLight>& power_lights() const { return power_lights_; }

    bool HasTextures(int material) const;
    std::vector<Material>& all() { return materials_; }

  private:
    int Base(int index, const std::string& inside);
    void Convert(const Declared& from, int before, const std::string& inside, Material* material);
    bool ConvertOpaque(const Declared& from, int before, Material* material);
    bool ConvertOther(const Declared& from, int before, const std::string& inside,
                      Material* material);
    void ConvertMix(const Declared& from, int before, const std::string& inside,
                    Material* material);
    void ConvertDisney(const Declared& from, int before, Material* material);
    void SetColor(const Params& params, const char* name, int before, Rgb otherwise, const char* as,
                  Material* material);
    void SetNumber(const Params& params, const char* name, int before, float otherwise,
                   const char* as, Material* material);
    void SetRoughness(const Params& params, int before, float otherwise, bool version3,
                      const std::string& prefix, const char* as_u, const char* as_v,
                      Material* material);
    void SetConductor(const Params& params, int before, const std::string& prefix,
                      Material* material);
    void SetCoat(const Declared& from, int before, bool schlick, Material* material);
    void SetBump(const Declared& from, int before, Material* material);
    void SetAbsorption(const Declared& from, const std::string& inside, Material* material);
    bool SetAlpha(const Shape& shape, Material* material);
    void SetEmission(const Shape& shape, int index, Material* material);
    float Index(const Params& params, float otherwise);

    const Document& document_;
    Textures* textures_;
    Spectra* spectra_;
    Notes* notes_;
    std::vector<Material> materials_;
    std::map<std::string, int> known_;
    std::vector<PowerLight> power_lights_;
    int depth_ = 0;
};

}  // namespace relume::pbrt
