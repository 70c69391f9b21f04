#include "client/lib/image_origin.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <filesystem>

#include "core/base/error.h"
#include "proto/codec/codec.h"

namespace relume::client {
namespace {

const std::string& Metadata(const Image& image, const std::string& key) {
    const auto it = image.metadata().find(key);
    if (it == image.metadata().end()) {
        ThrowInvalidArgument(fmt::format(
            "has no metadata {}: it was not rendered by relume, or another program has written it "
            "since",
            key));
    }
    return it->second;
}

}  // namespace

ImageOrigin ReadOrigin(const Image& image) {
    ImageOrigin origin;
    const std::string& text = Metadata(image, "relume.settings");
    v1::RenderSettings message;
    // Settings that this build does not know might change the picture: not ignored.
    if (!google::protobuf::util::JsonStringToMessage(text, &message).ok()) {
        ThrowInvalidArgument(
            fmt::format("metadata relume.settings = '{}': can't be read by this build", text));
    }
    origin.settings = codec::FromProto(message);
    origin.scene_sha256 = Metadata(image, "relume.scene_sha256");
    origin.filter = Metadata(image, "relume.filter");
    origin.build = Metadata(image, "relume.version");
    const TileRect window = origin.settings.Window();
    if (window.width() != image.width() || window.height() != image.height() ||
        window.x0 != image.x0() || window.y0 != image.y0()) {
        ThrowInvalidArgument(fmt::format(
            "is {}x{} pixels, but its metadata relume.settings are of {}x{}: it was cut or scaled "
            "after it was rendered",
            image.width(), image.height(), window.width(), window.height()));
    }
    return origin;
}

std::string FindEnvironment(const ImageOrigin& origin, const std::string& scene_path,
                            const std::string& given) {
    const std::string& name = origin.settings.environment;
    if (name.empty()) {
        if (!given.empty()) {
            ThrowInvalidArgument(
                "the image was rendered without --environment; leave it out here, too");
        }
        return "";
    }
    if (!given.empty()) {
        return given;
    }
    const auto beside = std::filesystem::path(scene_path).parent_path() / name;
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(beside, ignored)) {
        ThrowInvalidArgument(fmt::format(
            "the image was lit by the environment '{}', which is not in the scene's folder; say "
            "where it is with --environment FILE",
            name));
    }
    return beside.string();
}

}  // namespace relume::client
