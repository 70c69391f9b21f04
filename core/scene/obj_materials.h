#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/scene/obj.h"
#include "core/scene/scene_images.h"

namespace relume::obj {

// Turns the materials that faces use into Scene's:
//   Kd and Ks with Ns          "metallic_roughness" ("diffuse" if Ks is 0 or illum 0 or 1): Ks 1 is
//                              8 % at normal incidence, as Blender has it, and Ns is Phong's
//                              exponent: GGX alpha sqrt(2 / (Ns + 2))
//   Pr Pm Ps Pc Pcr            the same with roughness, metal, sheen and clearcoat
//   illum 3, 5                 mirrors of reflectance Ks, mixed with what is diffuse
//   illum 4, 6, 7, 9, Ni > 1   "dielectric", tinted by Tf: rays bend
//   d, Tr, map_d               alpha
//   Ke, map_Ke                 emission, from both sides: OBJ has no front
class Materials {
  public:
    explicit Materials(Notes* notes) : notes_(notes) {}

    // The materials of `document.material_uses`, each by its name, and before them the default:
    // what MakeMeshes wants.
    std::vector<int> Convert(const Document& document, const std::vector<MtlMaterial>& library);

    const std::vector<ImageRequest>& requests() const { return requests_; }

    // Loads the pictures and moves all into the scene.
    void Finish(const FileSource& files, bool decode, Scene* scene);

  private:
    struct Packed {  // made of two pictures: G of the one, B of the other
        int texture, roughness, metallic;
    };

    void ConvertOne(const MtlMaterial& from, Material* material);
    void SetSurface(const MtlMaterial& from, Material* material);
    void SetMirror(const MtlMaterial& from, Material* material);
    void SetMetalAndRoughness(const MtlMaterial& from, Material* material);
    void SetLayers(const MtlMaterial& from, Material* material);
    void SetRelief(const MtlMaterial& from, Material* material);
    void SetAlpha(const MtlMaterial& from, Material* material);
    // The texture of the map of this name, -1 if there is none.
    int TextureOf(const MtlMaterial& from, const std::string& map, bool srgb);
    void SetTexture(const MtlMaterial& from, const std::string& map, const char* param, bool srgb,
                    Material* material);
    int Add(const Texture& texture);
    void Pack(const Packed& packed, Scene* scene) const;
    void UseMatte(std::size_t material, Scene* scene);
    bool IsNormalMap(const SceneImage& image) const;

    Notes* notes_;
    std::vector<Material> materials_;
    std::vector<Texture> textures_;
    std::vector<ImageRequest> requests_;
    std::map<std::string, int> picture_of_;
    std::vector<Packed> packed_;
    std::vector<std::size_t> mattes_;        // materials whose alpha picture's alpha is meant
    std::vector<std::size_t> bump_or_norm_;  // materials whose "bump" may be a normal map
};

}  // namespace relume::obj
