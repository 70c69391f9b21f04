#include "core/scene/pbrt_textures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relume::pbrt {
namespace {

using Kind = TextureNode::Kind;
// An expression is a tree of at most this many nodes, this deep.
constexpr int kMaxNodes = 4096, kMaxDepth = 64;

TextureNode Constant(Rgb value) {
    TextureNode node;
    node.value = value;
    return node;
}

}  // namespace

Value Textures::Color(const Params& params, const char* name, int before, SpectrumUse use,
                      Rgb otherwise) {
    nodes_ = 0;
    return Settle(Operand(params, name, "color ", before, use, otherwise));
}

Value Textures::Number(const Params& params, const char* name, int before, float otherwise,
                       Kind remap) {
    nodes_ = 0;
    const Kind grey = document_.version3 ? Kind::kLuminance : Kind::kMean;
    TextureNode node =
        Operand(params, name, "float ", before, SpectrumUse::kIndex, Rgb{1, 1, 1} * otherwise);
    // A factor stays outside, so that the picture itself may be used as it is.
    TextureNode factor = Constant({1, 1, 1});
    if (remap == Kind::kConstant && node.kind == Kind::kScale && node.children[0].is_constant()) {
        factor = MakeFunction(grey, std::move(node.children[0]));
        TextureNode inner = std::move(node.children[1]);
        node = std::move(inner);
    }
    if (!node.is_constant() || remap != Kind::kConstant) {
        node = MakeFunction(remap, MakeFunction(grey, std::move(node)));
    } else {
        node = MakeFunction(grey, std::move(node));
    }
    return Settle(MakeScale(std::move(factor), std::move(node)));
}

TextureNode Textures::Operand(const Params& params, const char* name, const char* kind, int before,
                              SpectrumUse use, Rgb otherwise) {
    if (const Param* param = params.Find(name, "texture")) {
        if (param->strings.size() != 1) {
            Fail(param->place, fmt::format("'{}' must have the name of one texture", name));
        }
        return Build(kind + param->strings[0], before, param->place, use);
    }
    return Constant(spectra_->Get(params, name, use, otherwise));
}

TextureNode Textures::Build(const std::string& key, int before, const Place& place,
                            SpectrumUse use) {
    int index = document_.texture_names.Find(key, before);
    const std::string name = key.substr(6), kind = key.substr(0, 6);
    if (index < 0) {  // of the other type
        index =
            document_.texture_names.Find((kind == "float " ? "color " : "float ") + name, before);
    }
    if (index < 0) {
        Fail(place,
             fmt::format("the texture '{}' is not known; define it or correct the name", name));
    }
    if (++nodes_ > kMaxNodes || depth_ >= kMaxDepth) {
        Fail(place, fmt::format("the texture '{}' refers to itself, or to too many others", name));
    }
    ++depth_;
    const Declared& texture = document_.textures[static_cast<std::size_t>(index)];
    const Params& params = texture.params;
    const auto operand = [&](const char* operand_name, float otherwise, const char* as) {
        return Operand(params, operand_name, as, index, use, Rgb{1, 1, 1} * otherwise);
    };
    TextureNode node;
    const std::string& type = texture.type;
    if (type == "constant") {
        node = operand("value", 1, kind.c_str());
    } else if (type == "scale") {
        const bool v4 = params.Has("tex") || params.Has("scale");
        node = MakeScale(operand(v4 ? "tex" : "tex1", 1, kind.c_str()),
                         operand(v4 ? "scale" : "tex2", 1, v4 ? "float " : kind.c_str()));
    } else if (type == "mix" || type == "directionmix") {
        const bool directional = type != "mix";
        if (directional) {
            notes_->Add(texture.place,
                        "textures of type directionmix are not supported: the two "
                        "are mixed evenly");
            params.Ignore("dir");
        }
        node =
            MakeMix(operand("tex1", 0, kind.c_str()), operand("tex2", 1, kind.c_str()),
                    directional ? Constant({0.5f, 0.5f, 0.5f}) : operand("amount", 0.5f, "float "));
    } else if (type == "checkerboard") {
        node = BuildChecker(texture, kind.c_str(), index, use);
    } else if (type == "imagemap") {
        node = BuildImage(texture);
    } else {
        notes_->Add(texture.place, fmt::format("textures of type {} are not supported: replaced by "
                                               "a grey of 0.5",
                                               type));
        for (const Param& param : params.all()) {
            param.used = true;
        }
        node = Constant({0.5f, 0.5f, 0.5f});
    }
    params.NoteUnused(fmt::format("texture of type {}", type), notes_);
    --depth_;
    return node;
}

UvMapping Textures::ReadMapping(const Declared& texture) {
    const Params& params = texture.params;
    const std::string mapping = params.String("mapping", "uv");
    if (mapping != "uv") {
        notes_->Add(texture.place, fmt::format("the texture mapping {} is not supported: the "
                                               "surface's texture coordinates are used",
                                               mapping));
        params.Ignore("v1 v2");
    }
    return {params.Float("uscale", 1), params.Float("vscale", 1), params.Float("udelta", 0),
            params.Float("vdelta", 0)};
}

TextureNode Textures::BuildChecker(const Declared& texture, const char* kind, int index,
                                   SpectrumUse use) {
    TextureNode a = Operand(texture.params, "tex1", kind, index, use, {1, 1, 1});
    TextureNode b = Operand(texture.params, "tex2", kind, index, use, {0, 0, 0});
    texture.params.Ignore("aamode");
    if (texture.params.Int("dimension", 2) != 2) {
        notes_->Add(texture.place,
                    "checkerboards in space are not supported: the two textures "
                    "are mixed evenly");
        return MakeMix(std::move(a), std::move(b), Constant({0.5f, 0.5f, 0.5f}));
    }
    TextureNode node;
    node.kind = Kind::kChecker;
    node.mapping = ReadMapping(texture);
    node.children.push_back(std::move(a));
    node.children.push_back(std::move(b));
    return node;
}

TextureNode Textures::BuildImage(const Declared& texture) {
    const Params& params = texture.params;
    TextureNode node;
    node.kind = Kind::kImage;
    node.mapping = ReadMapping(texture);
    node.picture = Picture(params.String("filename", ""), texture.place);
    params.Ignore("filter trilinear maxanisotropy");
    node.srgb = params.Bool("gamma", true);  // pbrt-v3
    const std::string encoding = params.String("encoding", node.srgb ? "sRGB" : "linear");
    node.srgb = encoding != "linear";
    if ((encoding != "sRGB" && encoding != "linear") || params.Find("gamma", "float") != nullptr) {
        notes_->Add(texture.place,
                    "encodings of pictures other than sRGB and linear are taken as "
                    "sRGB");
    }
    const std::string wrap = params.String("wrap", "repeat");
    if (wrap == "clamp" || wrap == "black") {
        node.wrap = WrapMode::kClamp;
    }
    if (wrap != "repeat" && wrap != "clamp") {
        notes_->Add(texture.place, fmt::format("the wrap mode {} is not supported: {} is used",
                                               wrap, wrap == "black" ? "clamp" : "repeat"));
    }
    const bool invert = params.Bool("invert", false);
    const Rgb scale = spectra_->Get(params, "scale", SpectrumUse::kIndex, {1, 1, 1});
    TextureNode scaled = MakeScale(Constant(scale), std::move(node));
    return invert ? MakeFunction(Kind::kInvert, std::move(scaled)) : scaled;
}

int Textures::Picture(const std::string& path, const Place& place) {
    if (path.empty()) {
        Fail(place, "it has no \"string filename\" of a picture; add it");
    }
    const std::string name = PathToName(path, place);
    const auto [it, is_new] = picture_of_.emplace(name, static_cast<int>(requests_.size()));
    if (is_new) {
        requests_.push_back({name, place.Text(), false, ""});
    }
    return it->second;
}

int Textures::Plain(const std::string& path, bool srgb, const Place& place) {
    Texture texture;
    texture.image = Picture(path, place);
    texture.srgb = srgb;
    return Add(texture);
}

int Textures::Add(const Texture& texture) {
    const auto same = std::find(textures_.begin(), textures_.end(), texture);
    if (same != textures_.end() && texture.image >= 0) {
        return static_cast<int>(same - textures_.begin());
    }
    textures_.push_back(texture);
    return static_cast<int>(textures_.size()) - 1;
}

Value Textures::Settle(TextureNode node) {
    Value value;
    while (node.kind == Kind::kScale && node.children[0].is_constant()) {
        value.factor *= node.children[0].value;
        TextureNode inner = std::move(node.children[1]);
        node = std::move(inner);
    }
    if (node.is_constant()) {
        value.factor *= node.value;
        return value;
    }
    Texture texture;
    if (node.kind == Kind::kImage) {
        texture.image = node.picture;
        texture.srgb = node.srgb;
        texture.wrap_u = texture.wrap_v = node.wrap;
        node.mapping.ToTexture(&texture);
        value.texture = Add(texture);
        return value;
    }
    SceneImage image;
    if (node.kind == Kind::kChecker && node.children[0].is_constant() &&
        node.children[1].is_constant()) {
        // Two fields each way; the bottom left one is the first.
        const Rgb a = node.children[0].value, b = node.children[1].value;
        image = {"checkerboard",
                 2,
                 2,
                 3,
                 {},
                 {b.x, b.y, b.z, a.x, a.y, a.z, a.x, a.y, a.z, b.x, b.y, b.z}};
        texture.nearest = true;
        const UvMapping& m = node.mapping;
        UvMapping{m.su / 2, m.sv / 2, m.du / 2, m.dv / 2}.ToTexture(&texture);
    } else {
        bakes_.push_back({std::move(node), textures_.size()});
    }
    texture.image = -2 - static_cast<int>(made_.size());
    made_.push_back(std::move(image));
    value.texture = Add(texture);
    return value;
}

void Textures::Finish(const FileSource& files, bool decode, Scene* scene, std::vector<int>* kept) {
    std::vector<SceneImage> images = LoadImages(files, requests_, decode);
    const auto pictures = images.size();
    for (const Bake& bake : bakes_) {
        Texture& texture = textures_[bake.texture];
        const int grey = GreyPicture(bake.node, images);
        if (grey >= 0) {
            const TextureNode& image = bake.node.children[0];
            texture.image = grey;
            texture.srgb = image.srgb;
            texture.wrap_u = texture.wrap_v = image.wrap;
            image.mapping.ToTexture(&texture);
            continue;
        }
        const BakePlan plan = PlanBake(bake.node, images);
        if (!plan.exact) {
            notes_->Add({},
                        "textures whose parts repeat differently are worked out for texture "
                        "coordinates from 0 to 1 alone");
        }
        SceneImage& image = made_[static_cast<std::size_t>(-2 - texture.image)];
        image = BakeTexture(bake.node, plan, images);
        texture.srgb = !image.bytes.empty();
        texture.wrap_u = texture.wrap_v = plan.wrap;
        plan.mapping.ToTexture(&texture);
    }
    for (SceneImage& image : made_) {
        images.push_back(std::move(image));
    }
    // Pictures that only went into others are dropped.
    std::vector<int> index_of(images.size(), -1);
    const auto use = [&](int image) {
        int& index = index_of[static_cast<std::size_t>(image)];
        if (index < 0) {
            index = static_cast<int>(scene->images.size());
            scene->images.push_back(std::move(images[static_cast<std::size_t>(image)]));
        }
        return index;
    };
    for (Texture& texture : textures_) {
        texture.image = use(texture.image >= 0 ? texture.image
                                               : static_cast<int>(pictures) + (-2 - texture.image));
    }
    for (int& picture : *kept) {
        picture = use(picture);
    }
    scene->textures = std::move(textures_);
}

}  // namespace relume::pbrt
