#include <algorithm>
#include <memory>
#include <set>
#include <utility>

#include "core/scene/gltf_animation.h"
#include "core/scene/scene_images.h"
#include "core/scene/uri.h"

// glTF 2.0, as .gltf with its files or as .glb: triangles, metallic-roughness materials with
// textures and transmission, KHR_lights_punctual, cameras, the node tree with its animations, skins
// and morph targets. What is left out is said in Scene::notes. One unit is a metre; radiance is as
// the file has it.

namespace relume {
namespace gltf {
namespace {

// What the file holds beside the scene that is drawn.
Notes IgnoredIn(const Document& document) {
    Notes notes;
    if (document.has_other_animations) {
        notes.Add("animations of other things than nodes are ignored");
    }
    for (const std::string& extension : document.model.extensionsUsed) {
        if (!IsKnownExtension(extension)) {
            notes.Add(fmt::format("the extension {} is not supported, and ignored", extension));
        }
    }
    return notes;
}

std::vector<ImageRequest> Requests(const Document& document, const Data& data, const Look& look) {
    std::vector<ImageRequest> requests;
    for (const Look::Picture& picture : look.pictures) {
        const Document::Image& image = document.images[static_cast<std::size_t>(picture.image)];
        ImageRequest request;
        request.wanted_by = picture.wanted_by;
        request.embedded = image.uri.empty() || IsDataUri(image.uri);
        if (request.embedded) {
            request.name = fmt::format("embedded image {}", picture.image);
            request.bytes = image.uri.empty()
                                ? std::string(data.View(image.buffer_view, picture.wanted_by))
                                : DecodeDataUri(image.uri, picture.wanted_by);
        } else {
            request.name = UriToName(image.uri, picture.wanted_by);
        }
        requests.push_back(std::move(request));
    }
    return requests;
}

// A file with its buffers, from which the scene is read at any time.
class Opened {
  public:
    Opened(const FileSource& files, const std::string& main_name, std::uint64_t most_array_bytes)
        : document_(ParseDocument(files, main_name)),
          notes_(IgnoredIn(document_)),
          data_(&document_, files, most_array_bytes),
          animations_(document_, data_, &notes_) {}
    Opened(const Opened&) = delete;
    Opened& operator=(const Opened&) = delete;

    // All but the pictures; what they are is answered.
    Look Read(float time, float shutter, Scene* scene) const {
        const Data data = data_;  // which counts what this reading makes, not the ones before
        Notes notes = notes_;
        const double open = animations_.empty() ? 0 : std::max(shutter, 0.0f);
        const Poses poses{&animations_, SampleTimes(std::max(time, 0.0f), open)};
        Placed placed = ReadNodes(document_, poses, &notes);
        Look look = ReadMaterials(document_, placed, &notes);
        scene->name = document_.name;
        ReadMeshes(document_, data, poses, placed, look, scene, &notes);
        scene->hints.animation_seconds = static_cast<float>(animations_.end());
        scene->lights = std::move(placed.lights);
        scene->cameras = std::move(placed.cameras);
        scene->materials = std::move(look.materials);
        scene->textures = std::move(look.textures);
        scene->notes = notes.Take();
        return look;
    }

    std::vector<ImageRequest> Pictures(const Look& look) const {
        return Requests(document_, data_, look);
    }
    bool moves() const { return !animations_.empty(); }

  private:
    Document document_;
    Notes notes_;  // of the file
    Data data_;
    Animations animations_;
};

class GltfTimes final : public SceneTimes {
  public:
    // `scene`: at any time; what does not depend on it is kept.
    GltfTimes(std::unique_ptr<const Opened> file, const Scene& scene)
        : file_(std::move(file)), environment_(scene.environment) {
        for (const SceneImage& image : scene.images) {
            SceneImage& kept = images_.emplace_back();
            kept.name = image.name;
            kept.width = image.width;
            kept.height = image.height;
        }
    }

    Scene At(float time, float shutter) const override {
        Scene scene;
        file_->Read(time, shutter, &scene);
        scene.images = images_;
        scene.environment = environment_;
        ValidateScene(scene);
        return scene;
    }

  private:
    std::unique_ptr<const Opened> file_;
    std::vector<SceneImage> images_;  // without pixels
    std::shared_ptr<const Environment> environment_;
};

}  // namespace
}  // namespace gltf

Scene LoadGltf(const FileSource& files, const std::string& main_name, const LoadOptions& options) {
    Scene scene;
    auto opened = std::make_unique<const gltf::Opened>(files, main_name, options.most_array_bytes);
    auto requests = opened->Pictures(opened->Read(options.time, options.shutter, &scene));
    const bool keep = options.times != nullptr && opened->moves();
    if (!keep) {
        opened.reset();  // before the pictures take their memory
    }
    scene.images = LoadImages(files, std::move(requests), options.decode_images);
    AddEnvironment(files, options, &scene);
    ValidateScene(scene);
    if (options.times != nullptr) {
        *options.times =
            keep ? std::make_shared<gltf::GltfTimes>(std::move(opened), scene) : nullptr;
    }
    return scene;
}

std::vector<std::string> ListGltfFiles(const FileSource& files, const std::string& main_name) {
    const gltf::Document document = gltf::ParseDocument(files, main_name);
    std::vector<std::string> names{main_name};
    std::set<std::string> seen{main_name};
    const auto add = [&](const std::string& uri, const SourceLocation& place) {
        if (!uri.empty() && !IsDataUri(uri)) {
            std::string name = UriToName(uri, place);
            if (seen.insert(name).second) {
                names.push_back(std::move(name));
            }
        }
    };
    for (std::size_t i = 0; i < document.buffers.size(); ++i) {
        add(document.buffers[i].uri, document.Place("buffer", i, ""));
    }
    // Of the pictures, those that something visible wants.
    gltf::Notes notes;
    auto pictures =
        gltf::ReadMaterials(document, gltf::ReadNodes(document, {}, &notes), &notes).pictures;
    std::sort(pictures.begin(), pictures.end(),
              [](const auto& a, const auto& b) { return a.image < b.image; });
    for (const auto& picture : pictures) {
        add(document.images[static_cast<std::size_t>(picture.image)].uri, picture.wanted_by);
    }
    return names;
}

}  // namespace relume
