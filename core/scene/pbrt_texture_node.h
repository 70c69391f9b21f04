#pragma once

#include <optional>
#include <vector>

#include "core/scene/scene.h"

namespace relume::pbrt {

// s = su u + du, t = sv v + dv; v and t run up.
struct UvMapping {
    float su = 1, sv = 1, du = 0, dv = 0;

    friend bool operator==(const UvMapping&, const UvMapping&) = default;
    // As Texture::uv_transform.
    void ToTexture(Texture* texture) const;
};

// A texture as an expression over texture coordinates.
struct TextureNode {
    enum class Kind {
        kConstant,
        kImage,
        kScale,       // product of two
        kMix,         // of two by a third: 0 is the first
        kChecker,     // of two
        kInvert,      // 1 - x
        kMean,        // of the channels
        kLuminance,   // of the channels
        kRoughness3,  // pbrt-v3's map of roughness to the alpha of a microfacet distribution
        kRoughness4,  // pbrt-v4's: the square root
    };
    Kind kind = Kind::kConstant;
    Rgb value{1, 1, 1};  // of a constant
    int picture = -1;
    bool srgb = false;
    WrapMode wrap = WrapMode::kRepeat;
    UvMapping mapping;  // of an image or checkerboard
    std::vector<TextureNode> children;

    bool is_constant() const { return kind == Kind::kConstant; }
};

// What such a function makes of a constant; the value itself for other kinds.
Rgb Apply(TextureNode::Kind function, Rgb value);

// One that applies `function` to `child`; of a constant, a constant.
TextureNode MakeFunction(TextureNode::Kind function, TextureNode child);
TextureNode MakeScale(TextureNode a, TextureNode b);
TextureNode MakeMix(TextureNode a, TextureNode b, TextureNode amount);

// Where a baked picture lies.
struct BakePlan {
    int width = 0, height = 0;
    UvMapping mapping;
    WrapMode wrap = WrapMode::kRepeat;
    bool exact = true;  // false: its parts repeat differently, and it is cut off at 0 and 1
};
BakePlan PlanBake(const TextureNode& node, const std::vector<SceneImage>& pictures);

// The expression's values on the plan's texels; no pixels if the pictures have none.
SceneImage BakeTexture(const TextureNode& node, const BakePlan& plan,
                       const std::vector<SceneImage>& pictures);

// The picture if the expression is the mean or luminance of one that is grey already; -1 if not.
int GreyPicture(const TextureNode& node, const std::vector<SceneImage>& pictures);

}  // namespace relume::pbrt
