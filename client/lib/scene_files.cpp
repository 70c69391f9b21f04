#include "client/lib/scene_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <utility>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/parallel.h"
#include "core/base/sha256.h"

namespace relume::client {
namespace fs = std::filesystem;
namespace {

class LocalSource final : public FileSource {
  public:
    explicit LocalSource(std::map<std::string, std::string> files) : files_(std::move(files)) {}

    std::string Read(const std::string& name) const override {
        const auto it = files_.find(name);
        if (it == files_.end()) {
            ThrowNotFound(name + ": is not among the scene's files");
        }
        return ReadFile(it->second);
    }

  private:
    std::map<std::string, std::string> files_;
};

ManifestEntry HashFile(const std::string& name, const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    if (!in || fs::is_directory(path)) {
        ThrowNotFound(fmt::format(
            "{}: can't be read, and the scene refers to it; check that it is there", path));
    }
    Sha256 sha;
    ManifestEntry entry{name, 0, {}};
    std::vector<char> buffer(std::size_t{1} << 20);
    while (in.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || in.gcount() > 0) {
        const auto n = static_cast<std::size_t>(in.gcount());
        sha.Update(buffer.data(), n);
        entry.size += n;
    }
    if (in.bad()) {
        throw Error(ErrorCode::kDataLoss, path + ": reading failed");
    }
    entry.sha256 = sha.HexDigest();
    return entry;
}

// The name of `file` below `folder`, "" if it lies elsewhere.
std::string NameBelow(const fs::path& folder, const fs::path& file) {
    const std::string relative = fs::weakly_canonical(file)
                                     .lexically_relative(fs::weakly_canonical(folder))
                                     .generic_string();
    return IsSafeRelativePath(relative) ? relative : "";
}

}  // namespace

LocalScene CollectScene(const std::string& scene_path, const std::string& environment) {
    const fs::path main(scene_path);
    std::error_code ignored;
    if (!fs::is_regular_file(main, ignored)) {
        ThrowNotFound(
            fmt::format("{}: {}; check the path", scene_path,
                        fs::exists(main, ignored) ? "is not a file" : "no such scene file"));
    }
    const fs::path folder = main.has_parent_path() ? main.parent_path() : fs::path(".");

    // What the scene's files are called and where they lie.
    LocalScene scene;
    scene.manifest.main = main.filename().string();
    std::vector<std::string> names;
    for (const auto& name :
         ListSceneFiles(*MakeFolderSource(folder.string()), scene.manifest.main)) {
        names.push_back(name);
        scene.files[name] = (folder / name).string();
    }
    if (!environment.empty()) {
        if (!fs::is_regular_file(environment, ignored)) {
            ThrowNotFound(fmt::format("{}: no such environment map; check the path", environment));
        }
        scene.environment = NameBelow(folder, environment);
        if (scene.environment.empty()) {
            scene.environment = "environment/" + fs::path(environment).filename().string();
            if (scene.files.count(scene.environment) != 0) {
                scene.environment =
                    "environment/of-the-job/" + fs::path(environment).filename().string();
            }
        }
        if (scene.files.emplace(scene.environment, environment).second) {
            names.push_back(scene.environment);
        }
    }

    // Their digests.
    scene.manifest.entries.resize(names.size());
    ParallelFor(0, names.size(), 1, [&](std::size_t i0, std::size_t i1) {
        for (std::size_t i = i0; i < i1; ++i) {
            scene.manifest.entries[i] = HashFile(names[i], scene.files.at(names[i]));
        }
    });
    ValidateManifest(scene.manifest);
    return scene;
}

std::unique_ptr<FileSource> MakeLocalSource(const LocalScene& scene) {
    return std::make_unique<LocalSource>(scene.files);
}

Scene LoadForChecks(const LocalScene& scene, const RenderSettings& settings) {
    LoadOptions options;
    options.decode_images = false;
    options.environment = scene.environment;
    options.environment_scale = settings.environment_scale;
    options.time = settings.time;
    options.shutter = settings.shutter;
    return LoadScene(*MakeLocalSource(scene), scene.manifest.main, options);
}

std::vector<std::string> CheckScene(const Scene& scene, const RenderSettings& settings) {
    std::vector<std::string> notes = scene.notes;
    if (!settings.look && FindCamera(scene, settings.camera) == nullptr) {
        notes.push_back("the scene has no camera: one that sees all of it was fitted");
    }
    if (!scene.HasLight()) {
        if (!settings.allow_black) {
            ThrowInvalidArgument(fmt::format(
                "{}: nothing shines in this scene, the image would be black; give it light with "
                "--environment FILE.hdr, or ask for the black image with --allow-black",
                scene.name));
        }
        notes.push_back("nothing shines in this scene: the image is black, as asked for");
    }
    return notes;
}

void RequireNoNotes(const Scene& scene) {
    if (!scene.notes.empty()) {
        ThrowInvalidArgument(
            fmt::format("{}: not rendered, since --strict was given and {} or replaced: {}; change "
                        "the scene or "
                        "leave out --strict",
                        scene.name,
                        scene.notes.size() == 1
                            ? "one thing is not supported"
                            : fmt::format("{} things are not supported", scene.notes.size()),
                        fmt::join(scene.notes, "; ")));
    }
}

void SetDefaultSize(const Camera* camera, RenderSettings* settings) {
    const float aspect = camera != nullptr ? camera->params.GetFloat("aspect_ratio", 0) : 0;
    settings->height = 720;
    settings->width = 1280;
    if (aspect > 0.1f && aspect < 10) {
        settings->width = static_cast<int>(std::lround(720 * aspect));
    }
}

}  // namespace relume::client
