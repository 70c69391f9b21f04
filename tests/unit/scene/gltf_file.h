#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/scene/formats.h"

namespace relume::test {

// Files by name, in memory; remembers what was read.
class MapSource final : public FileSource {
  public:
    std::string Read(const std::string& name) const override {
        const std::lock_guard<std::mutex> lock(*mutex_);
        reads.push_back(name);
        const auto it = files.find(name);
        if (it == files.end()) {
            ThrowNotFound(name + ": missing; restore the file");
        }
        return it->second;
    }

    std::map<std::string, std::string> files;
    mutable std::vector<std::string> reads;

  private:
    std::unique_ptr<std::mutex> mutex_ = std::make_unique<std::mutex>();  // so that it moves
};

template <class T>
std::string Bytes(const std::vector<T>& values) {
    std::string bytes(values.size() * sizeof(T), '\0');
    if (!values.empty()) {
        std::memcpy(bytes.data(), values.data(), bytes.size());
    }
    return bytes;
}

std::string Base64(const std::string& bytes);

// Component types of glTF 2.0, section 3.6.2.2.
inline constexpr int kByte = 5120, kUByte = 5121, kShort = 5122, kUShort = 5123, kUInt = 5125,
                     kFloat = 5126;

// A glTF file under construction: `json` and one buffer.
struct GltfFile {
    nlohmann::json json;
    std::string buffer;

    GltfFile();

    // These append and return an index.
    int AddView(const std::string& bytes, int byte_stride = 0);
    int AddAccessor(const std::string& bytes, int component_type, const char* type, int count,
                    bool normalized = false, int byte_stride = 0);
    int AddFloats(const std::vector<float>& values, const char* type);  // an accessor
    int Add(const char* array, nlohmann::json item);
    int AddNode(nlohmann::json node);  // in the scene too
    // A mesh of one primitive, not in a node.
    int AddMesh(nlohmann::json attributes, int indices = -1, nlohmann::json more = {});

    std::string Text() const;  // its buffer is "scene.bin"
    std::string Binary() const;
    MapSource Files() const;  // scene.gltf and scene.bin
};

// One triangle (0,0,0) (1,0,0) (0,1,0): accessor 0 of mesh 0 of node 0.
GltfFile TriangleFile();
// As that, with texture coordinates and material 0.
GltfFile TexturedFile(nlohmann::json material);

// The file "scene.gltf", without decoding pictures.
Scene Load(const MapSource& files, LoadOptions options = {.decode_images = false});
Scene Load(const GltfFile& file);

// An uncompressed TGA of 24 bits, all pixels of this colour.
std::string TgaPicture(int width, int height, std::uint8_t r, std::uint8_t g, std::uint8_t b);
// A Radiance picture, all pixels of this RGBE value.
std::string HdrPicture(int width, int height, std::uint8_t r, std::uint8_t g, std::uint8_t b,
                       std::uint8_t e);

// The message of the Error that `run` must throw, "" (and a failure) if it throws none.
template <class F>
std::string MessageOf(F&& run) {
    try {
        run();
    } catch (const Error& error) {
        return error.what();
    }
    ADD_FAILURE() << "no error was thrown";
    return "";
}

}  // namespace relume::test
