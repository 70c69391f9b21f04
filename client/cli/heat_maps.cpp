#include "client/cli/heat_maps.h"

#include <fmt/format.h>

#include <filesystem>
#include <list>

#include "client/lib/output_file.h"
#include "core/base/error.h"
#include "core/image/heat_map.h"

namespace relume::client {
namespace {

struct Layer {
    const char* channel;
    HeatMapStyle style;
};

const std::vector<Layer>& Layers() {
    static const std::vector<Layer> layers = {
        {"samples.Y", {"samples.Y: samples a pixel, log2 axis", 2, 0, {}}},
        {"relmse.Y", {"relmse.Y: estimated relative MSE, log axis", 10, 0.005, {}}},
        {"selector.Y", {"selector.Y: what chose the pixels, log axis", 10, 0.005, {}}},
        {"decision.Y",
         {"decision.Y: what became of the pixels", 10, 0, {"converged", "sampled on", "capped"}}},
    };
    return layers;
}

}  // namespace

std::vector<HeatMapFile> WriteHeatMaps(const Image& image, const std::string& image_path,
                                       const std::string& folder) {
    const std::filesystem::path path(image_path);
    const std::filesystem::path target =
        folder.empty() ? path.parent_path() : std::filesystem::path(folder);
    std::vector<HeatMapFile> made;
    std::list<OutputFile> files;
    for (const auto& layer : Layers()) {
        if (!image.Has(layer.channel)) {
            continue;
        }
        const std::string channel = layer.channel;
        const std::string name =
            path.stem().string() + "." + channel.substr(0, channel.find('.')) + ".png";
        made.push_back({channel, (target / name).string()});
        CheckOutput(made.back().path);
        files.emplace_back(made.back().path)
            .Append(EncodePng(
                DrawHeatMap(image.Plane(channel), image.width(), image.height(), layer.style)));
    }
    if (made.empty()) {
        ThrowInvalidArgument(
            image_path +
            ": has no channel samples.Y, relmse.Y, selector.Y or decision.Y to make a heat map of; "
            "`relume render` writes the first two, and with --layers all the others");
    }
    for (auto& file : files) {
        file.Commit();
    }
    return made;
}

}  // namespace relume::client
