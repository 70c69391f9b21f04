#include "server/denoise/without_features.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "server/denoise/feature_groups.h"
#include "server/denoise/on_changed_frame.h"

namespace relume::denoise {
namespace {

std::vector<FeatureGroup> ParseGroups(const std::string& names) {
    std::vector<FeatureGroup> groups;
    for (std::size_t begin = 0; begin <= names.size();) {
        const std::size_t end = std::min(names.find('-', begin), names.size());
        const std::string name = names.substr(begin, end - begin);
        const auto* group = std::ranges::find_if(
            kFeatureGroups, [&](const FeatureGroup& known) { return name == known.name; });
        if (group == std::end(kFeatureGroups)) {
            std::string known;
            for (const FeatureGroup& g : kFeatureGroups) {
                known += (known.empty() ? "" : ", ") + std::string(g.name);
            }
            ThrowInvalidArgument(
                fmt::format("without={}: no feature is named '{}'; known, joined by '-': {}", names,
                            name, known));
        }
        groups.push_back(*group);
        begin = end + 1;
    }
    return groups;
}

}  // namespace

std::unique_ptr<Denoiser> WithoutFeatures(std::unique_ptr<Denoiser> denoiser,
                                          const std::string& names) {
    return OnChangedFrame(std::move(denoiser), "without=" + names,
                          [groups = ParseGroups(names)](Frame* frame) {
                              for (const FeatureGroup& group : groups) {
                                  for (int f = group.first; f < group.first + group.count; ++f) {
                                      frame->feature[f] = {};
                                      frame->feature_variance[f] = {};
                                      frame->feature_half[0][f] = {};
                                      frame->feature_half[1][f] = {};
                                  }
                              }
                          });
}

}  // namespace relume::denoise
