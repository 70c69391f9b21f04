#include <algorithm>
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
void NoteIgnored(const Document& document, Notes* notes) {
    if (document.has_other_animations) {
        notes->Add("animations of other things than nodes are ignored");
    }
    for (const std::string& extension : document.model.extensionsUsed) {
        if (!IsKnownExtension(extension)) {
            notes->Add(fmt::format("the extension {} is not supported, and ignored", extension));
        }
    }
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

// All but the pictures. File and buffers are gone when it returns.
std::vector<ImageRequest> ReadAllButImages(const FileSource& files, const std::string& main_name,
                                           const LoadOptions& options, Scene* scene, Notes* notes) {
    Document document = ParseDocument(files, main_name);
    NoteIgnored(document, notes);
    const Data data(&document, files);
    const Animations animations(document, data, notes);
    const double shutter = animations.empty() ? 0 : std::max(options.shutter, 0.0f);
    const Poses poses{&animations, SampleTimes(std::max(options.time, 0.0f), shutter)};
    Placed placed = ReadNodes(document, poses, notes);
    Look look = ReadMaterials(document, placed, notes);
    ReadMeshes(document, data, poses, placed, look, scene, notes);
    scene->hints.animation_seconds = static_cast<float>(animations.end());
    std::vector<ImageRequest> requests = Requests(document, data, look);
    scene->lights = std::move(placed.lights);
    scene->cameras = std::move(placed.cameras);
    scene->materials = std::move(look.materials);
    scene->textures = std::move(look.textures);
    return requests;
}

}  // namespace
}  // namespace gltf

Scene LoadGltf(const FileSource& files, const std::string& main_name, const LoadOptions& options) {
    Scene scene;
    scene.name = main_name;
    gltf::Notes notes;
    scene.images =
        LoadImages(files, gltf::ReadAllButImages(files, main_name, options, &scene, &notes),
                   options.decode_images);
    AddEnvironment(files, options, &scene);
    scene.notes = notes.Take();
    ValidateScene(scene);
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
