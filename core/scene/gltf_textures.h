#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/gltf.h"

// The textures of glTF's materials; included by the files that read materials alone.
namespace relume::gltf {

// The object that an extension has, or null.
const tinygltf::Value* FindExtension(const tinygltf::ExtensionMap& extensions, const char* name);
// A number at `key`; `otherwise` if `object` is null or has none.
double Number(const tinygltf::Value* object, const char* key, double otherwise);
// Three numbers at `key`, likewise.
std::vector<float> Color(const tinygltf::Value* object, const char* key,
                         const std::vector<float>& otherwise);

// Encoding of a texture's 8-bit values.
inline constexpr bool kSrgb = true, kLinear = false;

// Collects Look's textures and pictures, each distinct one once, with KHR_texture_transform.
class TextureReader {
  public:
    TextureReader(const Document& document, Notes* notes, Look* look)
        : document_(document), notes_(notes), look_(look) {}

    // Between these, textures belong to one material, which has one set of texture coordinates:
    // End answers with it (n of TEXCOORD_n).
    void Begin();
    int End(const Material& material);

    // Sets `param` to the texture that `info` names; nothing if it names none.
    void Set(const char* param, const tinygltf::TextureInfo& info, bool srgb, Material* material);
    // The same for normal maps, with "normal_scale".
    void SetNormal(const tinygltf::NormalTextureInfo& info, Material* material);
    // The same for the texture at `key` of an extension.
    void Set(const char* param, const tinygltf::Value& extension, const char* key, bool srgb,
             Material* material);

  private:
    struct Use {
        std::string param;
        int set;
    };

    void Add(const char* param, int index, int tex_coord, const tinygltf::Value* transform,
             bool srgb, Material* material);
    int PictureIndex(int image, const SourceLocation& wanted_by);

    const Document& document_;
    Notes* notes_;
    Look* look_;
    std::map<std::pair<std::string, int>, int> picture_of_;
    std::vector<Use> uses_;  // of the current material
};

// Reads the extensions of a material that add layers to "metallic_roughness": transmission with ior
// and volume, specular, clearcoat, sheen.
void ReadLayers(const tinygltf::Material& from, TextureReader* textures, Material* material,
                Notes* notes);

}  // namespace relume::gltf
