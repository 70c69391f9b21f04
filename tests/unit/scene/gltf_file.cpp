#include "tests/unit/scene/gltf_file.h"

#include <string_view>
#include <utility>

namespace relume::test {

using nlohmann::json;

std::string Base64(const std::string& bytes) {
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const auto byte = i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0;
            bits = bits << 8 | static_cast<std::uint32_t>(byte);
        }
        for (std::size_t k = 0; k < 4; ++k) {
            out += i + k <= bytes.size() ? kDigits[(bits >> (18 - 6 * k)) & 63] : '=';
        }
    }
    return out;
}

GltfFile::GltfFile() {
    json = {{"asset", {{"version", "2.0"}}},
            {"scene", 0},
            {"scenes", json::array({{{"nodes", json::array()}}})}};
}

int GltfFile::AddView(const std::string& bytes, int byte_stride) {
    buffer.resize((buffer.size() + 3) / 4 * 4);
    nlohmann::json view = {
        {"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", bytes.size()}};
    if (byte_stride != 0) {
        view["byteStride"] = byte_stride;
    }
    buffer += bytes;
    return Add("bufferViews", view);
}

int GltfFile::AddAccessor(const std::string& bytes, int component_type, const char* type, int count,
                          bool normalized, int byte_stride) {
    nlohmann::json accessor = {{"bufferView", AddView(bytes, byte_stride)},
                               {"componentType", component_type},
                               {"type", type},
                               {"count", count}};
    if (normalized) {
        accessor["normalized"] = true;
    }
    return Add("accessors", accessor);
}

int GltfFile::AddFloats(const std::vector<float>& values, const char* type) {
    const int components = type == std::string("SCALAR") ? 1 : type[3] - '0';
    return AddAccessor(Bytes(values), kFloat, type, static_cast<int>(values.size()) / components);
}

int GltfFile::Add(const char* array, nlohmann::json item) {
    json[array].push_back(std::move(item));
    return static_cast<int>(json[array].size()) - 1;
}

int GltfFile::AddNode(nlohmann::json node) {
    const int index = Add("nodes", std::move(node));
    json["scenes"][0]["nodes"].push_back(index);
    return index;
}

int GltfFile::AddMesh(nlohmann::json attributes, int indices, nlohmann::json more) {
    nlohmann::json primitive = more.is_null() ? nlohmann::json::object() : std::move(more);
    primitive["attributes"] = std::move(attributes);
    if (indices >= 0) {
        primitive["indices"] = indices;
    }
    return Add("meshes", {{"primitives", nlohmann::json::array({primitive})}});
}

std::string GltfFile::Text() const {
    nlohmann::json whole = json;
    if (!buffer.empty()) {
        whole["buffers"] =
            nlohmann::json::array({{{"uri", "scene.bin"}, {"byteLength", buffer.size()}}});
    }
    return whole.dump(1);
}

std::string GltfFile::Binary() const {
    nlohmann::json whole = json;
    whole["buffers"] = nlohmann::json::array({{{"byteLength", buffer.size()}}});
    std::string text = whole.dump(), data = buffer;
    text.resize((text.size() + 3) / 4 * 4, ' ');
    data.resize((data.size() + 3) / 4 * 4, '\0');
    const auto size = [](std::size_t n) { return static_cast<std::uint32_t>(n); };
    return "glTF" + Bytes<std::uint32_t>({2, size(28 + text.size() + data.size())}) +
           Bytes<std::uint32_t>({size(text.size())}) + "JSON" + text +
           Bytes<std::uint32_t>({size(data.size())}) + std::string("BIN\0", 4) + data;
}

MapSource GltfFile::Files() const {
    MapSource source;
    source.files["scene.gltf"] = Text();
    source.files["scene.bin"] = buffer;
    return source;
}

GltfFile TriangleFile() {
    GltfFile file;
    const int positions = file.AddFloats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
    file.AddNode({{"mesh", file.AddMesh({{"POSITION", positions}})}});
    return file;
}

GltfFile TexturedFile(json material) {
    GltfFile file = TriangleFile();
    json& primitive = file.json["meshes"][0]["primitives"][0];
    primitive["attributes"]["TEXCOORD_0"] = file.AddFloats({0, 0, 1, 0, 0, 1}, "VEC2");
    primitive["material"] = file.Add("materials", std::move(material));
    return file;
}

Scene Load(const MapSource& files, LoadOptions options) {
    return LoadScene(files, "scene.gltf", options);
}

Scene Load(const GltfFile& file) { return Load(file.Files()); }

std::string TgaPicture(int width, int height, std::uint8_t r, std::uint8_t g, std::uint8_t b) {
    std::string bytes(18, '\0');
    bytes[2] = 2;
    bytes[12] = static_cast<char>(width & 255);
    bytes[13] = static_cast<char>(width >> 8);
    bytes[14] = static_cast<char>(height & 255);
    bytes[15] = static_cast<char>(height >> 8);
    bytes[16] = 24;
    for (int i = 0; i < width * height; ++i) {
        bytes += Bytes<std::uint8_t>({b, g, r});
    }
    return bytes;
}

std::string HdrPicture(int width, int height, std::uint8_t r, std::uint8_t g, std::uint8_t b,
                       std::uint8_t e) {
    std::string bytes = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(height) +
                        " +X " + std::to_string(width) + "\n";
    for (int i = 0; i < width * height; ++i) {
        bytes += Bytes<std::uint8_t>({r, g, b, e});
    }
    return bytes;
}

}  // namespace relume::test
