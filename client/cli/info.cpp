// relume info: what is in a scene or an image.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/heat_maps.h"
#include "client/cli/options.h"
#include "client/cli/progress.h"
#include "client/cli/scene_needs.h"
#include "client/lib/scene_files.h"
#include "core/base/error.h"
#include "core/image/exr.h"

namespace relume::client {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kBeside = "true";  // CLI11's value of a flag without one

struct InfoOptions {
    std::string file, environment;
    std::optional<float> time, shutter;
    std::string png;  // "": none; else kBeside, or the folder for heat maps
    TalkOptions talk;
};

bool IsExr(const std::string& path) {
    char magic[4] = {};
    std::ifstream(path, std::ios::binary).read(magic, sizeof magic);
    return std::string(magic, sizeof magic) == "\x76\x2f\x31\x01";
}

Json SceneJson(const LocalScene& files, const Scene& scene) {
    std::uint64_t bytes = 0;
    for (const auto& entry : files.manifest.entries) {
        bytes += entry.size;
    }
    Json json{{"scene", files.manifest.main},
              {"sha256", ManifestDigest(files.manifest)},
              {"files", files.manifest.entries.size()},
              {"bytes", bytes},
              {"meshes", scene.meshes.size()},
              {"instances", scene.instances.size()},
              {"triangles", scene.TriangleCount()},
              {"materials", Json::array()},
              {"textures", Json::array()},
              {"lights", Json::array()},
              {"cameras", Json::array()},
              {"animation_seconds", nullptr},
              {"environment", nullptr},
              {"bounds", nullptr},
              {"asks_for", Json::object()},
              {"needs", SceneNeeds(scene)},
              {"notes", scene.notes}};
    for (const auto& material : scene.materials) {
        json["materials"].push_back({{"name", material.name}, {"type", material.type}});
    }
    for (const auto& image : scene.images) {
        json["textures"].push_back(
            {{"name", image.name}, {"width", image.width}, {"height", image.height}});
    }
    for (const auto& light : scene.lights) {
        json["lights"].push_back({{"name", light.name}, {"type", light.type}});
    }
    for (const auto& camera : scene.cameras) {
        json["cameras"].push_back({{"name", camera.name}, {"type", camera.type}});
    }
    if (scene.hints.animation_seconds > 0) {
        json["animation_seconds"] = scene.hints.animation_seconds;
    }
    if (scene.environment) {
        const int image = scene.environment->image;
        json["environment"] =
            image < 0 ? "constant" : scene.images[static_cast<std::size_t>(image)].name;
    }
    if (scene.hints.width > 0 && scene.hints.height > 0) {
        json["asks_for"]["width"] = scene.hints.width;
        json["asks_for"]["height"] = scene.hints.height;
    }
    if (scene.hints.max_depth > 0) {
        json["asks_for"]["max_depth"] = scene.hints.max_depth;
    }
    if (scene.hints.spp > 0) {
        json["asks_for"]["spp"] = scene.hints.spp;
    }
    const Box3f box = scene.Bounds();
    json["bounds"] = {{box.lower.x, box.lower.y, box.lower.z},
                      {box.upper.x, box.upper.y, box.upper.z}};
    return json;
}

Json ImageJson(const std::string& path, const Image& image) {
    // Layers by name with their channels, the image itself first.
    std::map<std::string, std::vector<std::string>> layers;
    for (const auto& channel : image.channels()) {
        const std::size_t dot = channel.rfind('.');
        layers[dot == std::string::npos ? "" : channel.substr(0, dot)].push_back(
            channel.substr(dot == std::string::npos ? 0 : dot + 1));
    }
    Json json{{"image", path},
              {"width", image.width()},
              {"height", image.height()},
              {"x0", image.x0()},
              {"y0", image.y0()},
              {"display_width", image.display_width()},
              {"display_height", image.display_height()},
              {"digest", ImageDigest(image)},
              {"layers", Json::array()},
              {"metadata", Json::object()}};
    for (auto& [layer, channels] : layers) {
        std::sort(channels.begin(), channels.end(), [](const auto& a, const auto& b) {
            const std::string order = "RGBAXYZ";
            return std::pair(order.find(a), a) < std::pair(order.find(b), b);
        });
        json["layers"].push_back({{"name", layer}, {"channels", channels}});
    }
    for (const auto& [key, value] : image.metadata()) {
        json["metadata"][key] = value;
    }
    return json;
}

// "name (type)" of each, or "none".
std::string List(const Json& items) {
    std::map<std::string, int> types;
    for (const auto& item : items) {
        ++types[item["type"].get<std::string>()];
    }
    std::string text = std::to_string(items.size());
    for (const auto& [type, count] : types) {
        text +=
            fmt::format("{}{} {}", text.find(':') == std::string::npos ? ": " : ", ", count, type);
    }
    return text;
}

void PrintLine(const std::string& key, const std::string& value) {
    fmt::print("{:<13} {}\n", key, value);
}

void PrintScene(const Json& json) {
    PrintLine("scene", json["scene"]);
    PrintLine("files", fmt::format("{}, {}B", json["files"].get<int>(),
                                   FormatCount(json["bytes"].get<double>())));
    PrintLine("digest", json["sha256"]);
    PrintLine("meshes", fmt::format("{} in {} instances", json["meshes"].get<std::size_t>(),
                                    json["instances"].get<std::size_t>()));
    PrintLine("triangles", std::to_string(json["triangles"].get<std::uint64_t>()));
    PrintLine("materials", List(json["materials"]));
    PrintLine("textures", std::to_string(json["textures"].size()));
    for (const auto& image : json["textures"]) {
        PrintLine("", fmt::format("{}x{} {}", image["width"].get<int>(), image["height"].get<int>(),
                                  image["name"].get<std::string>()));
    }
    PrintLine("lights", List(json["lights"]));
    PrintLine("cameras", json["cameras"].empty() ? "none: one that sees all of it is fitted"
                                                 : std::to_string(json["cameras"].size()));
    int index = 0;
    for (const auto& camera : json["cameras"]) {
        PrintLine("", fmt::format("{} '{}', {}", index++, camera["name"].get<std::string>(),
                                  camera["type"].get<std::string>()));
    }
    if (!json["animation_seconds"].is_null()) {
        PrintLine("animation",
                  fmt::format("{:.6g} s: --time and --shutter choose what is seen of it",
                              json["animation_seconds"].get<double>()));
    }
    PrintLine("environment",
              json["environment"].is_null() ? "none" : json["environment"].get<std::string>());
    const auto& b = json["bounds"];
    PrintLine("bounds",
              fmt::format("[{:.4g} {:.4g} {:.4g}] to [{:.4g} {:.4g} {:.4g}]", b[0][0].get<double>(),
                          b[0][1].get<double>(), b[0][2].get<double>(), b[1][0].get<double>(),
                          b[1][1].get<double>(), b[1][2].get<double>()));
    for (const auto& [what, value] : json["asks_for"].items()) {
        PrintLine("asks for", fmt::format("{} {}", what, value.get<int>()));
    }
    for (const auto& need : json["needs"]) {
        PrintLine("needs", need);
    }
    for (const auto& note : json["notes"]) {
        PrintLine("note", note);
    }
}

void PrintImage(const Json& json) {
    PrintLine("image", json["image"]);
    PrintLine("size", fmt::format("{}x{}", json["width"].get<int>(), json["height"].get<int>()));
    if (json["width"] != json["display_width"] || json["height"] != json["display_height"]) {
        PrintLine("crop of",
                  fmt::format("{}x{}, from pixel {},{}", json["display_width"].get<int>(),
                              json["display_height"].get<int>(), json["x0"].get<int>(),
                              json["y0"].get<int>()));
    }
    PrintLine("digest", json["digest"]);
    for (const auto& layer : json["layers"]) {
        const auto channels = layer["channels"].get<std::vector<std::string>>();
        const auto name = layer["name"].get<std::string>();
        PrintLine("layer",
                  fmt::format("{}: {}", name.empty() ? "(image)" : name, fmt::join(channels, " ")));
    }
    for (const auto& [key, value] : json["metadata"].items()) {
        PrintLine("metadata", fmt::format("{} = {}", key, value.get<std::string>()));
    }
    if (json.contains("heat_maps")) {
        for (const auto& map : json["heat_maps"]) {
            PrintLine("heat map", map["png"]);
        }
    }
}

int RunInfo(const InfoOptions& options) {
    WithExitCode(kExitInput, [&] {
        const bool image = IsExr(options.file);
        Json json;
        if (image) {
            const Image read = ReadExr(options.file);
            json = ImageJson(options.file, read);
            if (!options.png.empty()) {
                const std::string folder = options.png == kBeside ? "" : options.png;
                for (const auto& map : WriteHeatMaps(read, options.file, folder)) {
                    json["heat_maps"].push_back({{"channel", map.channel}, {"png", map.path}});
                }
            }
        } else {
            if (!options.png.empty()) {
                ThrowInvalidArgument(options.file + ": --png is for images; this is no EXR file");
            }
            const LocalScene files = CollectScene(options.file, options.environment);
            RenderSettings settings;
            settings.time = options.time.value_or(-1);
            settings.shutter = options.shutter.value_or(-1);
            json = SceneJson(files, LoadForChecks(files, settings));
        }
        if (options.talk.json) {
            fmt::print("{}\n", json.dump(2));
        } else if (image) {
            PrintImage(json);
        } else {
            PrintScene(json);
        }
    });
    return kExitDone;
}

}  // namespace

Runner AddInfo(CLI::App* app) {
    const auto options = std::make_shared<InfoOptions>();
    app->add_option("FILE", options->file, "scene (.gltf, .glb, .pbrt, .obj) or image (.exr)")
        ->required()
        ->type_name("FILE");
    app->add_option("--environment", options->environment,
                    "latitude-longitude map that is to light the scene")
        ->type_name("FILE");
    AddTimeOptions(app, &options->time, &options->shutter);
    // A flag, so that a word after it is never taken for its value: --png FILE names the image.
    app->add_flag("--png", options->png,
                  "heat maps of the image's samples, error, selector and decisions, beside it as "
                  "NAME.LAYER.png; --png=FOLDER: in that folder");
    AddJsonOption(app, &options->talk);
    return [options](Interrupts*) { return RunInfo(*options); };
}

}  // namespace relume::client
