#include "core/scene/formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>

#include "core/base/error.h"

// Formats in order of trial, one a line: name and file extensions. Each has its own load_<name>.cpp
// with Load<Name>(files, main_name, options) and List<Name>Files(files, main_name).
#define RELUME_SCENE_FORMATS(FORMAT) \
    FORMAT(Gltf, ".gltf .glb")       \
    FORMAT(Pbrt, ".pbrt")            \
    FORMAT(Obj, ".obj")

namespace relume {

#define RELUME_DECLARE_FORMAT(name, extensions)                                  \
    Scene Load##name(const FileSource&, const std::string&, const LoadOptions&); \
    std::vector<std::string> List##name##Files(const FileSource&, const std::string&);
RELUME_SCENE_FORMATS(RELUME_DECLARE_FORMAT)
#undef RELUME_DECLARE_FORMAT

namespace {

struct Format {
    std::string_view extensions;  // lower case, with a space between
    Scene (*load)(const FileSource&, const std::string&, const LoadOptions&);
    std::vector<std::string> (*list)(const FileSource&, const std::string&);
};

#define RELUME_FORMAT_ENTRY(name, extensions) {extensions, &Load##name, &List##name##Files},
constexpr Format kFormats[] = {RELUME_SCENE_FORMATS(RELUME_FORMAT_ENTRY)};
#undef RELUME_FORMAT_ENTRY

const Format& FindFormat(const std::string& main_name) {
    const auto dot = main_name.rfind('.');
    std::string extension = dot == std::string::npos ? std::string() : main_name.substr(dot);
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    std::string known;
    for (const Format& format : kFormats) {
        const std::string padded = fmt::format(" {} ", format.extensions);
        if (!extension.empty() && padded.find(" " + extension + " ") != std::string::npos) {
            return format;
        }
        known += fmt::format("{}{}", known.empty() ? "" : " ", format.extensions);
    }
    ThrowInvalidArgument(
        fmt::format("{}: unknown scene format '{}'; known: {}", main_name, extension, known));
}

}  // namespace

Scene LoadScene(const FileSource& files, const std::string& main_name, const LoadOptions& options) {
    return FindFormat(main_name).load(files, main_name, options);
}

std::vector<std::string> ListSceneFiles(const FileSource& files, const std::string& main_name) {
    return FindFormat(main_name).list(files, main_name);
}

}  // namespace relume
