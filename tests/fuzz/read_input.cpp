#include "tests/fuzz/read_input.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <span>
#include <stdexcept>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/image/decode.h"
#include "core/image/exr.h"
#include "core/scene/formats.h"
#include "core/scene/image_header.h"
#include "core/scene/manifest.h"
#include "core/scene/ply.h"
#include "core/scene/uri.h"
#include "server/denoise/network/tza.h"
#include "tests/fuzz/read_messages.h"

namespace relume::test {
namespace {

constexpr std::string_view kSeparator = "\n%%FILE\n";

void Promise(bool kept, const char* what) {
    if (!kept) {
        throw std::logic_error(what);
    }
}

// What a scene gets for a file that its input does not hold.
const std::map<std::string, std::string>& SoundFiles() {
    static const std::map<std::string, std::string> files{
        {".ply",
         "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
         "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
         "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"},
        {".pfm", "PF\n2 1\n-1.0\n" + std::string(24, '\x3f')},
        {".pbrt", "Shape \"sphere\"\n"},
        {".spd", "400 1\n500 2\n700 1.5\n"},
        {".mtl", "newmtl a\nKd 1 0 0\nmap_Kd a.pfm\n"},
        {".bin", std::string(4096, '\x01')},
    };
    return files;
}

class InputFiles final : public FileSource {
  public:
    InputFiles(std::string main_name, std::string_view bytes) {
        std::size_t at = bytes.find(kSeparator);
        files_[std::move(main_name)] = std::string(bytes.substr(0, at));
        while (at != std::string_view::npos) {
            bytes.remove_prefix(at + kSeparator.size());
            at = bytes.find(kSeparator);
            parts_.emplace_back(bytes.substr(0, at));
        }
    }

    std::string Read(const std::string& name) const override {
        const std::lock_guard lock(mutex_);
        if (const auto it = files_.find(name); it != files_.end()) {
            return it->second;
        }
        if (files_.size() <= parts_.size()) {
            return files_[name] = parts_[files_.size() - 1];
        }
        const auto dot = name.rfind('.');
        const auto sound = SoundFiles().find(dot == std::string::npos ? "" : name.substr(dot));
        if (sound == SoundFiles().end()) {
            ThrowNotFound(name + ": missing");
        }
        return files_[name] = sound->second;
    }

  private:
    std::vector<std::string> parts_;
    mutable std::mutex mutex_;
    mutable std::map<std::string, std::string> files_;  // the main one, and those asked for
};

void CheckScene(const Scene& scene) {
    for (const Mesh& mesh : scene.meshes) {
        for (const Vec3u t : mesh.triangles) {
            Promise(std::max({t.x, t.y, t.z}) < mesh.positions.size(), "corner out of range");
        }
        for (const Vec3f p : mesh.positions) {
            Promise(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z),
                    "position is not finite");
        }
        Promise(
            mesh.material >= 0 && static_cast<std::size_t>(mesh.material) < scene.materials.size(),
            "material out of range");
    }
    for (const Instance& instance : scene.instances) {
        Promise(instance.mesh >= 0 && static_cast<std::size_t>(instance.mesh) < scene.meshes.size(),
                "mesh out of range");
    }
}

void ReadScene(const std::string& extension, std::string_view bytes) {
    const std::string main = "scene." + extension;
    try {
        ListSceneFiles(InputFiles(main, bytes), main);
    } catch (const Error&) {
    }
    for (const bool decode : {false, true}) {
        try {
            LoadOptions options;
            options.decode_images = decode;
            CheckScene(LoadScene(InputFiles(main, bytes), main, options));
        } catch (const Error&) {
            return;
        }
    }
}

void ReadPicture(std::string_view bytes) {
    ImageSize size;
    bool has_size = false;
    try {
        size = ReadImageHeader(bytes, "picture");
        has_size = true;
    } catch (const Error&) {
    }
    try {
        const DecodedImage image = DecodeImage(bytes, "picture");
        const std::size_t values = static_cast<std::size_t>(image.width) *
                                   static_cast<std::size_t>(image.height) *
                                   static_cast<std::size_t>(image.channels);
        Promise(values > 0 && image.bytes.size() + image.floats.size() == values,
                "values do not match the size");
        Promise(!has_size || (size.width == image.width && size.height == image.height),
                "header and picture disagree");
    } catch (const Error&) {
    }
}

void ReadPlyMesh(std::string_view bytes) {
    try {
        const PlyMesh mesh = ReadPly(bytes, "mesh.ply");
        for (const Vec3u t : mesh.triangles) {
            Promise(std::max({t.x, t.y, t.z}) < mesh.positions.size(), "corner out of range");
        }
        Promise(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size(), "normals");
        Promise(mesh.uvs.empty() || mesh.uvs.size() == mesh.positions.size(), "uvs");
    } catch (const Error&) {
    }
}

// Lines, each a path of a manifest's entry and a reference of a scene's.
void ReadTexts(std::string_view bytes) {
    SceneManifest manifest;
    while (!bytes.empty()) {
        const std::size_t end = std::min(bytes.find('\n'), bytes.size());
        const std::string line(bytes.substr(0, end));
        bytes.remove_prefix(std::min(end + 1, bytes.size()));
        try {
            const std::string name = UriToName(line, "place");
            Promise(IsSafeRelativePath(name), "a URI leads out of the folder");
        } catch (const Error&) {
        }
        try {
            if (IsDataUri(line)) {
                DecodeDataUri(line, "place");
            }
        } catch (const Error&) {
        }
        if (const auto path = CollapseDots(line)) {
            Promise(!path->empty() && path->front() != '/',
                    "a collapsed path is absolute or empty");
        }
        manifest.entries.push_back({line, line.size(), std::string(64, 'a')});
        manifest.main = manifest.entries.front().path;
    }
    try {
        ValidateManifest(manifest);
        ManifestDigest(manifest);
    } catch (const Error&) {
    }
}

void ReadWeights(std::string_view bytes) {
    try {
        for (const auto& [name, tensor] :
             denoise::ParseTza(std::as_bytes(std::span(bytes)), "weights.tza")) {
            std::size_t count = 1;
            for (const int size : tensor.shape) {
                count *= static_cast<std::size_t>(size);
            }
            Promise(tensor.values.size() == count, "values do not match the shape");
        }
    } catch (const Error&) {
    }
}

}  // namespace

const std::vector<std::string>& InputKinds() {
    static const std::vector<std::string> kinds{"pbrt",  "gltf", "glb",   "obj",  "ply", "image",
                                                "texts", "tza",  "codec", "spec", "work"};
    return kinds;
}

void ReadInput(const std::string& kind, std::string_view bytes) {
    if (kind == "image") {
        ReadPicture(bytes);
    } else if (kind == "ply") {
        ReadPlyMesh(bytes);
    } else if (kind == "texts") {
        ReadTexts(bytes);
    } else if (kind == "tza") {
        ReadWeights(bytes);
    } else if (kind == "codec" || kind == "spec" || kind == "work") {
        ReadMessages(kind, bytes);
    } else {
        ReadScene(kind, bytes);
    }
}

}  // namespace relume::test
