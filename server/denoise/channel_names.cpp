// Names of channels: Relume's own first, then Blender's and Cycles' passes, pbrt-v4's GBufferFilm
// (of 2020, and since), and what many others use. Spelt exactly: pbrt's Variance is of a sample,
// Relume's variance of the mean.
#include "server/denoise/channel_names.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "core/base/error.h"

namespace relume::denoise {
namespace {

struct Alias {
    Quantity quantity;
    std::vector<const char*> names;
};

const std::vector<Alias>& Aliases() {
    static const std::vector<Alias> aliases = {
        {Quantity::kColor, {"noisy.R", "noisy.G", "noisy.B"}},
        {Quantity::kColor, {"Noisy Image.R", "Noisy Image.G", "Noisy Image.B"}},
        {Quantity::kColor, {"R", "G", "B"}},
        {Quantity::kColor, {"Combined.R", "Combined.G", "Combined.B"}},
        {Quantity::kColor, {"beauty.R", "beauty.G", "beauty.B"}},
        {Quantity::kColor, {"rgba.R", "rgba.G", "rgba.B"}},
        {Quantity::kColor, {"color.R", "color.G", "color.B"}},
        {Quantity::kMeanVariance, {"variance.R", "variance.G", "variance.B"}},
        {Quantity::kSampleVariance, {"Variance.R", "Variance.G", "Variance.B"}},
        {Quantity::kCount, {"samples.Y"}},
        {Quantity::kBrightest, {"brightest.Y"}},
        {Quantity::kHalfA, {"buffer_a.R", "buffer_a.G", "buffer_a.B"}},
        {Quantity::kHalfB, {"buffer_b.R", "buffer_b.G", "buffer_b.B"}},
        {Quantity::kAlbedo, {"albedo.R", "albedo.G", "albedo.B"}},
        {Quantity::kAlbedo, {"Denoising Albedo.R", "Denoising Albedo.G", "Denoising Albedo.B"}},
        {Quantity::kAlbedo, {"Albedo.R", "Albedo.G", "Albedo.B"}},
        {Quantity::kNormal, {"Ns.X", "Ns.Y", "Ns.Z"}},
        {Quantity::kNormal, {"Nsx", "Nsy", "Nsz"}},
        {Quantity::kNormal, {"N.X", "N.Y", "N.Z"}},
        {Quantity::kNormal, {"Denoising Normal.X", "Denoising Normal.Y", "Denoising Normal.Z"}},
        {Quantity::kNormal, {"Normal.X", "Normal.Y", "Normal.Z"}},
        {Quantity::kNormal, {"normal.X", "normal.Y", "normal.Z"}},
        {Quantity::kNormal, {"normal.R", "normal.G", "normal.B"}},
        {Quantity::kNormal, {"sh_normal.X", "sh_normal.Y", "sh_normal.Z"}},
        {Quantity::kDepth, {"Denoising Depth.Z"}},
        {Quantity::kDepth, {"Denoising Depth.V"}},
        {Quantity::kDepth, {"Depth.Z"}},
        {Quantity::kDepth, {"Depth.V"}},
        {Quantity::kDepth, {"depth.Z"}},
        {Quantity::kDepth, {"depth.Y"}},
        {Quantity::kDepth, {"Z"}},
        {Quantity::kDepth, {"P.Z"}},
        {Quantity::kDepth, {"Pz"}},
        {Quantity::kVisibility, {"visibility.Y"}},
    };
    return aliases;
}

// Components stand alone only without a layer in front of them: "albedo.R" must not be taken for R.
bool MayHaveLayers(const char* name) {
    return std::string_view(name).find('.') != std::string_view::npos;
}

std::optional<ChannelGroup> FindAlias(const Image& image, const Alias& alias) {
    for (const std::string& channel : image.channels()) {
        const std::string first = alias.names[0];
        const bool below_layers = MayHaveLayers(alias.names[0]) && channel.ends_with("." + first);
        if (channel != first && !below_layers) {
            continue;
        }
        const std::string layers = channel.substr(0, channel.size() - first.size());
        ChannelGroup group;
        for (const char* name : alias.names) {
            group.push_back(image.Find(layers + name));
        }
        if (std::ranges::all_of(group, [](int index) { return index >= 0; })) {
            return group;
        }
    }
    return std::nullopt;
}

}  // namespace

std::optional<ChannelGroup> FindChannels(const Image& image, Quantity quantity) {
    for (const Alias& alias : Aliases()) {
        if (alias.quantity == quantity) {
            if (auto group = FindAlias(image, alias)) {
                return group;
            }
        }
    }
    return std::nullopt;
}

std::optional<ChannelGroup> FindSuffixed(const Image& image, const ChannelGroup& channels,
                                         const std::string& suffix) {
    ChannelGroup group;
    for (const int index : channels) {
        std::string name = image.channels()[static_cast<std::size_t>(index)];
        name.insert(std::min(name.rfind('.'), name.size()), suffix);
        group.push_back(image.Find(name));
        if (group.back() < 0) {
            return std::nullopt;
        }
    }
    return group;
}

std::string NamesOf(const Image& image, const ChannelGroup& channels) {
    std::string names;
    for (const int index : channels) {
        names += (names.empty() ? "" : ", ") + image.channels()[static_cast<std::size_t>(index)];
    }
    return names;
}

Image SelectLayer(const Image& image, const std::string& layer) {
    Image selected(image.width(), image.height());
    selected.SetWindow(image.x0(), image.y0(), image.display_width(), image.display_height());
    selected.metadata() = image.metadata();
    std::set<std::string> layers;
    for (const std::string& channel : image.channels()) {
        if (channel.starts_with(layer + ".")) {
            std::ranges::copy(
                image.Plane(channel),
                selected.Plane(selected.Add(channel.substr(layer.size() + 1))).begin());
        }
        if (const auto dot = channel.find('.'); dot != std::string::npos) {
            layers.insert(channel.substr(0, dot));
        }
    }
    if (selected.channels().empty()) {
        ThrowNotFound(
            fmt::format("there is no layer '{}'; there are {}", layer,
                        layers.empty() ? "none" : fmt::format("{}", fmt::join(layers, ", "))));
    }
    return selected;
}

}  // namespace relume::denoise
