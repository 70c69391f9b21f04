#include "core/scene/pbrt_texture_node.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/base/parallel.h"
#include "core/image/srgb.h"

namespace relume::pbrt {
namespace {

using Kind = TextureNode::Kind;
constexpr int kMostSide = 4096;

float DecodeSrgb(float c) {
    return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f);
}

const std::array<float, 256>& SrgbTable() {
    static const std::array<float, 256> table = [] {
        std::array<float, 256> t{};
        for (std::size_t i = 0; i < t.size(); ++i) {
            t[i] = DecodeSrgb(static_cast<float>(i) / 255);
        }
        return t;
    }();
    return table;
}

int Wrap(int i, int n, WrapMode wrap) {
    if (wrap == WrapMode::kClamp) {
        return std::clamp(i, 0, n - 1);
    }
    if (wrap == WrapMode::kMirror) {
        const int m = ((i % (2 * n)) + 2 * n) % (2 * n);
        return m < n ? m : 2 * n - 1 - m;
    }
    return ((i % n) + n) % n;
}

Rgb Texel(const SceneImage& image, int x, int y, bool srgb) {
    const auto channels = static_cast<std::size_t>(image.channels);
    const std::size_t at = (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                            static_cast<std::size_t>(x)) *
                           channels;
    const auto read = [&](std::size_t c) {
        if (image.bytes.empty()) {
            return image.floats[at + c];
        }
        const std::uint8_t byte = image.bytes[at + c];
        return srgb ? SrgbTable()[byte] : static_cast<float>(byte) / 255;
    };
    // One or two channels: grey, and grey with alpha.
    return channels < 3 ? Rgb{1, 1, 1} * read(0) : Rgb{read(0), read(1), read(2)};
}

// Bilinear; s and t (up) in pictures.
Rgb Lookup(const SceneImage& image, float s, float t, const TextureNode& node) {
    const float x = s * static_cast<float>(image.width) - 0.5f;
    const float y = (1 - t) * static_cast<float>(image.height) - 0.5f;
    constexpr float kFar = 1e9f;
    const float fx = std::floor(std::clamp(x, -kFar, kFar));
    const float fy = std::floor(std::clamp(y, -kFar, kFar));
    const int x0 = Wrap(static_cast<int>(fx), image.width, node.wrap);
    const int x1 = Wrap(static_cast<int>(fx) + 1, image.width, node.wrap);
    const int y0 = Wrap(static_cast<int>(fy), image.height, node.wrap);
    const int y1 = Wrap(static_cast<int>(fy) + 1, image.height, node.wrap);
    // Texels of a picture's own size need no neighbours, but for the rounding of s and t.
    const auto weight = [](float w) { return w < 1e-3f ? 0 : w > 1 - 1e-3f ? 1 : w; };
    const float ax = weight(x - fx), ay = weight(y - fy);
    if ((ax == 0 || ax == 1) && (ay == 0 || ay == 1)) {
        return Texel(image, ax == 0 ? x0 : x1, ay == 0 ? y0 : y1, node.srgb);
    }
    return Lerp(ay, Lerp(ax, Texel(image, x0, y0, node.srgb), Texel(image, x1, y0, node.srgb)),
                Lerp(ax, Texel(image, x0, y1, node.srgb), Texel(image, x1, y1, node.srgb)));
}

Rgb Evaluate(const TextureNode& node, float u, float v, const std::vector<SceneImage>& pictures) {
    const float s = node.mapping.su * u + node.mapping.du;
    const float t = node.mapping.sv * v + node.mapping.dv;
    const auto child = [&](std::size_t i) { return Evaluate(node.children[i], u, v, pictures); };
    switch (node.kind) {
        case Kind::kConstant:
            return node.value;
        case Kind::kImage:
            return Lookup(pictures[static_cast<std::size_t>(node.picture)], s, t, node);
        case Kind::kScale:
            return child(0) * child(1);
        case Kind::kMix: {
            const Rgb amount = child(2);
            return child(0) * (Rgb{1, 1, 1} - amount) + child(1) * amount;
        }
        case Kind::kChecker: {
            const float parity = std::floor(s) + std::floor(t);
            return child(parity - 2 * std::floor(parity / 2) < 0.5f ? 0 : 1);
        }
        default:
            return Apply(node.kind, child(0));
    }
}

// The images and checkerboards of an expression.
void Leaves(const TextureNode& node, std::vector<const TextureNode*>* leaves) {
    if (node.kind == Kind::kImage || node.kind == Kind::kChecker) {
        leaves->push_back(&node);
    }
    for (const TextureNode& child : node.children) {
        Leaves(child, leaves);
    }
}

bool IsWhole(float x) { return std::abs(x - std::round(x)) < 1e-4f; }

}  // namespace

void UvMapping::ToTexture(Texture* texture) const {
    const float m[6] = {su, 0, du, 0, sv, 1 - sv - dv};
    std::copy(std::begin(m), std::end(m), texture->uv_transform);
}

Rgb Apply(Kind function, Rgb value) {
    const auto each = [&](auto map) { return Rgb{map(value.x), map(value.y), map(value.z)}; };
    switch (function) {
        case Kind::kInvert:
            return each([](float x) { return std::max(0.0f, 1 - x); });
        case Kind::kMean:
            return Rgb{1, 1, 1} * Average(value);
        case Kind::kLuminance:
            return Rgb{1, 1, 1} * Luminance(value);
        case Kind::kRoughness3:
            return each([](float x) {
                // "Physically Based Rendering", 3rd edition, section 8.4.
                const float l = std::log(std::max(x, 1e-3f));
                return 1.62142f +
                       l * (0.819955f + l * (0.1734f + l * (0.0171201f + l * 0.000640711f)));
            });
        case Kind::kRoughness4:
            return each([](float x) { return std::sqrt(std::max(0.0f, x)); });
        default:
            return value;
    }
}

TextureNode MakeFunction(Kind function, TextureNode child) {
    TextureNode node;
    if (child.is_constant() || function == Kind::kConstant) {
        node = std::move(child);
        node.value = Apply(function, node.value);
        return node;
    }
    node.kind = function;
    node.children.push_back(std::move(child));
    return node;
}

TextureNode MakeScale(TextureNode a, TextureNode b) {
    TextureNode node;
    if (a.is_constant() && b.is_constant()) {
        node.value = a.value * b.value;
        return node;
    }
    if (b.is_constant()) {
        std::swap(a, b);
    }
    if (a.is_constant() && a.value == Rgb{1, 1, 1}) {
        return b;
    }
    node.kind = Kind::kScale;
    node.children.push_back(std::move(a));
    node.children.push_back(std::move(b));
    return node;
}

TextureNode MakeMix(TextureNode a, TextureNode b, TextureNode amount) {
    TextureNode node;
    if (amount.is_constant() && (amount.value == Rgb{0, 0, 0} || amount.value == Rgb{1, 1, 1})) {
        return amount.value == Rgb{0, 0, 0} ? a : b;
    }
    if (a.is_constant() && b.is_constant() && amount.is_constant()) {
        node.value = a.value * (Rgb{1, 1, 1} - amount.value) + b.value * amount.value;
        return node;
    }
    node.kind = Kind::kMix;
    node.children.push_back(std::move(a));
    node.children.push_back(std::move(b));
    node.children.push_back(std::move(amount));
    return node;
}

BakePlan PlanBake(const TextureNode& node, const std::vector<SceneImage>& pictures) {
    std::vector<const TextureNode*> leaves;
    Leaves(node, &leaves);
    BakePlan plan;
    bool same = true;
    for (const TextureNode* leaf : leaves) {
        same = same && leaf->kind == Kind::kImage && leaf->mapping == leaves[0]->mapping &&
               leaf->wrap == leaves[0]->wrap && leaf->mapping.su != 0 && leaf->mapping.sv != 0;
    }
    if (same && !leaves.empty()) {
        plan.mapping = leaves[0]->mapping;
        plan.wrap = leaves[0]->wrap;
    }
    double width = 1, height = 1;
    for (const TextureNode* leaf : leaves) {
        const bool image = leaf->kind == Kind::kImage;
        // A checkerboard's edges are as sharp as its texels: 64 a field.
        const double w = image ? pictures[static_cast<std::size_t>(leaf->picture)].width : 64;
        const double h = image ? pictures[static_cast<std::size_t>(leaf->picture)].height : 64;
        const UvMapping& m = leaf->mapping;
        width = std::max(width, same ? w : w * std::abs(m.su));
        height = std::max(height, same ? h : h * std::abs(m.sv));
        const double period = image ? 1 : 2;
        plan.exact = plan.exact && (same || (IsWhole(static_cast<float>(m.su / period)) &&
                                             IsWhole(static_cast<float>(m.sv / period)) &&
                                             leaf->wrap == WrapMode::kRepeat));
    }
    plan.width = static_cast<int>(std::min<double>(kMostSide, std::ceil(width)));
    plan.height = static_cast<int>(std::min<double>(kMostSide, std::ceil(height)));
    return plan;
}

SceneImage BakeTexture(const TextureNode& node, const BakePlan& plan,
                       const std::vector<SceneImage>& pictures) {
    SceneImage image;
    image.name = "baked texture";
    image.width = plan.width;
    image.height = plan.height;
    std::vector<const TextureNode*> leaves;
    Leaves(node, &leaves);
    for (const TextureNode* leaf : leaves) {
        if (leaf->picture >= 0) {
            const SceneImage& picture = pictures[static_cast<std::size_t>(leaf->picture)];
            image.name = "texture made of " + picture.name;
            if (picture.bytes.empty() && picture.floats.empty()) {
                return image;
            }
        }
    }
    const bool grey = node.kind == Kind::kMean || node.kind == Kind::kLuminance ||
                      node.kind == Kind::kRoughness3 || node.kind == Kind::kRoughness4;
    const std::size_t channels = grey ? 1 : 3;
    const auto width = static_cast<std::size_t>(plan.width);
    const auto height = static_cast<std::size_t>(plan.height);
    image.channels = static_cast<int>(channels);
    image.floats.resize(width * height * channels);
    ParallelFor(0, height, 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t y = begin; y < end; ++y) {
            for (std::size_t x = 0; x < width; ++x) {
                const float s = (static_cast<float>(x) + 0.5f) / static_cast<float>(width);
                const float t = 1 - (static_cast<float>(y) + 0.5f) / static_cast<float>(height);
                const Rgb c = Evaluate(node, (s - plan.mapping.du) / plan.mapping.su,
                                       (t - plan.mapping.dv) / plan.mapping.sv, pictures);
                for (std::size_t i = 0; i < channels; ++i) {
                    image.floats[(y * width + x) * channels + i] = c[static_cast<int>(i)];
                }
            }
        }
    });
    // Colours in range go into bytes, as those of files.
    const bool in_range = std::all_of(image.floats.begin(), image.floats.end(),
                                      [](float c) { return c >= 0 && c <= 1; });
    if (!grey && in_range) {
        image.bytes.reserve(image.floats.size());
        for (const float c : image.floats) {
            image.bytes.push_back(static_cast<std::uint8_t>(std::lround(255 * EncodeSrgb(c))));
        }
        image.floats = {};
    }
    return image;
}

int GreyPicture(const TextureNode& node, const std::vector<SceneImage>& pictures) {
    if ((node.kind != Kind::kMean && node.kind != Kind::kLuminance) ||
        node.children[0].kind != Kind::kImage) {
        return -1;
    }
    const int index = node.children[0].picture;
    const SceneImage& picture = pictures[static_cast<std::size_t>(index)];
    const auto channels = static_cast<std::size_t>(picture.channels);
    const auto is_grey = [&](const auto& values) {
        for (std::size_t i = 0; channels >= 3 && i + 2 < values.size(); i += channels) {
            if (values[i] != values[i + 1] || values[i] != values[i + 2]) {
                return false;
            }
        }
        return true;
    };
    return is_grey(picture.bytes) && is_grey(picture.floats) ? index : -1;
}

}  // namespace relume::pbrt
