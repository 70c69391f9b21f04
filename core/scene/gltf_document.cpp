#include <algorithm>
#include <cstring>
#include <exception>
#include <nlohmann/json.hpp>
#include <set>

#include "core/base/error.h"
#include "core/scene/gltf.h"

namespace relume::gltf {
namespace {

using nlohmann::json;

constexpr int kMaxDepth = 64;  // of JSON; what is deeper is an attack on the stack

const std::set<std::string> kKnownExtensions = {
    "KHR_lights_punctual",        "KHR_materials_clearcoat", "KHR_materials_emissive_strength",
    "KHR_materials_ior",          "KHR_materials_sheen",     "KHR_materials_specular",
    "KHR_materials_transmission", "KHR_materials_unlit",     "KHR_materials_volume",
    "KHR_mesh_quantization",      "KHR_texture_transform",
};

std::uint32_t Little32(const std::string& bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at + i])) << (8 * i);
    }
    return value;
}

// Splits a .glb (section 4.4): a header of magic, version and length, then chunks of length, type
// and data: JSON first, binary second.
std::string SplitBinary(std::string bytes, Document* document) {
    const auto truncated = [&](std::size_t wanted) {
        throw Error(ErrorCode::kDataLoss,
                    fmt::format("{}: truncated: has {} bytes, needs {}; restore the file",
                                document->name, bytes.size(), wanted));
    };
    if (bytes.size() < 20) {
        truncated(20);
    }
    if (Little32(bytes, 4) != 2) {
        Fail(document->name,
             fmt::format("binary glTF version {} is not known; export the scene as glTF 2.0",
                         Little32(bytes, 4)));
    }
    const std::size_t length = Little32(bytes, 8);
    if (bytes.size() < length) {
        truncated(length);
    }
    std::string text;
    std::size_t binary_at = bytes.size(), binary_size = 0;
    std::size_t chunk = 0;
    for (std::size_t at = 12; at + 8 <= length; ++chunk) {
        const std::size_t size = Little32(bytes, at);
        const std::string type = bytes.substr(at + 4, 4);
        if (size > length - at - 8) {
            Fail(document->name,
                 fmt::format("byte {}: chunk {} is longer than the file; export the scene "
                             "again",
                             at, chunk));
        }
        if (chunk == 0) {
            if (type != "JSON") {
                Fail(document->name,
                     "byte 16: the first chunk is not JSON; export the scene again");
            }
            text = bytes.substr(at + 8, size);
        } else if (chunk == 1 && type == std::string("BIN\0", 4)) {
            binary_at = at + 8;
            binary_size = size;
        }
        at += 8 + size;
    }
    bytes.erase(0, binary_at);
    bytes.resize(binary_size);
    document->binary_chunk = std::move(bytes);
    return text;
}

// One line for a person out of the library's "[json.exception...] parse error at line 1, column 2:
// ...".
std::string Readable(const std::exception& error) {
    std::string text = error.what();
    if (!text.empty() && text.front() == '[') {
        text = text.substr(std::min(text.find(']') + 2, text.size()));
    }
    std::replace(text.begin(), text.end(), '\n', ' ');
    while (!text.empty() && text.back() == ' ') {
        text.pop_back();
    }
    constexpr std::size_t kMaxMessage = 200;  // the token it quotes may be a data URI
    return text.size() <= kMaxMessage ? text : text.substr(0, kMaxMessage) + "...";
}

// Looked at beforehand: the library's own hook walks over all of an array's elements at each of
// them.
void CheckDepth(const std::string& text, const std::string& name) {
    int depth = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (in_string) {
            i += c == '\\' ? 1 : 0;
            in_string = c != '"';
        } else if (c == '"') {
            in_string = true;
        } else if (c == '{' || c == '[') {
            if (++depth > kMaxDepth) {
                Fail(name, fmt::format("JSON is nested deeper than {}; export the scene again",
                                       kMaxDepth));
            }
        } else if (c == '}' || c == ']') {
            --depth;
        }
    }
}

json ParseJson(const std::string& text, const std::string& name) {
    CheckDepth(text, name);
    json root;
    try {
        root = json::parse(text);
    } catch (const json::exception& error) {
        Fail(name, fmt::format("not whole JSON: {}; restore the file or export it again",
                               Readable(error)));
    }
    if (!root.is_object()) {
        Fail(name, "is JSON but not glTF; choose a glTF 2.0 file");
    }
    return root;
}

// The string at `key`, "" if there is none; moved, since it may be a long data URI.
std::string TakeString(json* entry, const char* key) {
    const auto it = entry->find(key);
    return it == entry->end() ? std::string() : std::move(it->get_ref<std::string&>());
}

// Takes what this loader reads itself, or not at all, out of `root`.
void TakeParts(json* root, Document* document) {
    for (json& entry : (*root)["buffers"]) {
        document->buffers.push_back(
            {TakeString(&entry, "uri"), entry.at("byteLength").get<std::uint64_t>()});
    }
    for (json& entry : (*root)["images"]) {
        document->images.push_back(
            {TakeString(&entry, "name"), TakeString(&entry, "uri"), entry.value("bufferView", -1)});
    }
    if (const auto animations = root->find("animations"); animations != root->end()) {
        for (json& animation : *animations) {
            const auto other = [](const json& channel) {
                const auto target = channel.find("target");
                return target == channel.end() || !target->contains("node");
            };
            json& channels = animation.at("channels");
            const auto kept = std::stable_partition(channels.begin(), channels.end(),
                                                    [&](const json& c) { return !other(c); });
            document->has_other_animations |= kept != channels.end();
            channels.erase(kept, channels.end());
        }
    }
    for (const char* part : {"buffers", "images"}) {
        root->erase(part);
    }
}

void CheckVersion(const json& root, const std::string& name) {
    const json asset = root.value("asset", json::object());
    const std::string version = asset.value("version", std::string());
    if (version.substr(0, 2) != "2.") {
        Fail(name, version.empty()
                       ? "has no asset.version; choose a glTF 2.0 file"
                       : fmt::format("glTF version {} is not known; export the scene as glTF "
                                     "2.0",
                                     version));
    }
}

}  // namespace

[[noreturn]] void Fail(const SourceLocation& place, const std::string& problem) {
    ThrowInvalidArgument(fmt::format("{}: {}", place, problem));
}

bool IsKnownExtension(const std::string& name) { return kKnownExtensions.count(name) != 0; }

void Notes::Add(const std::string& note) {
    if (std::find(notes_.begin(), notes_.end(), note) == notes_.end()) {
        notes_.push_back(note);
    }
}

SourceLocation Document::Place(const char* kind, std::size_t index,
                               const std::string& item_name) const {
    return item_name.empty() ? fmt::format("{}: {} {}", name, kind, index)
                             : fmt::format("{}: {} {} '{}'", name, kind, index, item_name);
}

Document ParseDocument(const FileSource& files, const std::string& name) {
    Document document;
    document.name = name;
    std::string text = files.Read(name);
    if (text.substr(0, 4) == "glTF") {
        text = SplitBinary(std::move(text), &document);
    }
    json root = ParseJson(text, name);

    // Both libraries throw what they please when a value is of the wrong type.
    std::string problem, warning;
    try {
        CheckVersion(root, name);
        TakeParts(&root, &document);
        text = root.dump();
        root = json();
        tinygltf::TinyGLTF parser;
        const bool parsed =
            parser.LoadASCIIFromString(&document.model, &problem, &warning, text.c_str(),
                                       static_cast<unsigned int>(text.size()), "");
        // The library drops some malformed elements, with a message alone.
        if (!parsed || !problem.empty()) {
            Fail(name, fmt::format("malformed glTF: {}; export the scene again",
                                   Readable(std::runtime_error(problem))));
        }
    } catch (const Error&) {
        throw;
    } catch (const std::exception& error) {
        Fail(name, fmt::format("malformed glTF: {}; export the scene again", Readable(error)));
    }
    for (const std::string& extension : document.model.extensionsRequired) {
        if (!IsKnownExtension(extension)) {
            Fail(name,
                 fmt::format(
                     "needs the extension {}, which is not known; export the scene without it",
                     extension));
        }
    }
    return document;
}

}  // namespace relume::gltf
