#include "core/film/aov.h"

namespace relume {

const char* FeatureName(int feature) {
    static constexpr std::array<const char*, kFeatureCount> kNames = {
        "albedo.R", "albedo.G", "albedo.B", "N.X", "N.Y", "N.Z", "Z", "visibility.Y"};
    return kNames[static_cast<std::size_t>(feature)];
}

const std::vector<std::string>& FilmChannelNames() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> list = {"n_a", "n_b", "bad", "max_luminance"};
        for (const char* group : {"mean_a.", "mean_b.", "m2_a.", "m2_b."}) {
            for (const char* channel : {"R", "G", "B"}) {
                list.push_back(std::string(group) + channel);
            }
        }
        for (const char* group : {"feature_mean_a.", "feature_mean_b.", "feature_m2."}) {
            for (int f = 0; f < kFeatureCount; ++f) {
                list.push_back(std::string(group) + FeatureName(f));
            }
        }
        return list;
    }();
    return names;
}

}  // namespace relume
