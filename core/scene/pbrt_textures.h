#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/scene/pbrt_document.h"
#include "core/scene/pbrt_spectra.h"
#include "core/scene/pbrt_texture_node.h"
#include "core/scene/scene_images.h"

namespace relume::pbrt {

// A material's colour or number: `factor`, times a texture if there is one.
struct Value {
    Rgb factor{1, 1, 1};
    int texture = -1;  // index of Scene::textures
};

// Turns pbrt's textures into Scene's, which are plain look-ups of pictures: constants become
// factors, a checkerboard of constants a picture of 2 x 2 texels, and what else is not one picture
// is worked out texel by texel ("baked") once the pictures are there.
class Textures {
  public:
    Textures(const Document& document, Spectra* spectra, Notes* notes)
        : document_(document), spectra_(spectra), notes_(notes) {}

    // A parameter that may be a texture; `before`: see Names::Find.
    Value Color(const Params& params, const char* name, int before, SpectrumUse use, Rgb otherwise);
    // One number in all channels; of coloured pictures the mean (pbrt-v3: the luminance).
    Value Number(const Params& params, const char* name, int before, float otherwise,
                 TextureNode::Kind remap = TextureNode::Kind::kConstant);
    // A whole picture over texture coordinates 0 to 1.
    int Plain(const std::string& path, bool srgb, const Place& place);

    // Index of a picture that the loader wants, new or known.
    int Picture(const std::string& path, const Place& place);
    const std::vector<ImageRequest>& requests() const { return requests_; }

    // Loads pictures, bakes, and fills in images and textures of the scene. `kept`: pictures that
    // something else than a texture uses, turned into indices of Scene::images.
    void Finish(const FileSource& files, bool decode, Scene* scene, std::vector<int>* kept);

  private:
    TextureNode Operand(const Params& params, const char* name, const char* kind, int before,
                        SpectrumUse use, Rgb otherwise);
    TextureNode Build(const std::string& key, int before, const Place& place, SpectrumUse use);
    TextureNode BuildImage(const Declared& texture);
    TextureNode BuildChecker(const Declared& texture, const char* kind, int index, SpectrumUse use);
    UvMapping ReadMapping(const Declared& texture);
    Value Settle(TextureNode node);
    int Add(const Texture& texture);

    struct Bake {
        TextureNode node;
        std::size_t texture;
    };

    const Document& document_;
    Spectra* spectra_;
    Notes* notes_;
    std::vector<ImageRequest> requests_;
    std::map<std::string, int> picture_of_;
    std::vector<Texture> textures_;  // image: a picture, or -2 - i for a made one
    std::vector<SceneImage> made_;
    std::vector<Bake> bakes_;
    int depth_ = 0, nodes_ = 0;
};

}  // namespace relume::pbrt
