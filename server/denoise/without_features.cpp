#include "server/denoise/without_features.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/error.h"

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

class Without final : public Denoiser {
  public:
    Without(std::unique_ptr<Denoiser> denoiser, const std::string& names)
        : denoiser_(std::move(denoiser)), names_(names), groups_(ParseGroups(names)) {}

    std::string Describe() const override {
        const std::string inner = denoiser_->Describe();
        return fmt::format("{}{}without={}", inner,
                           inner.find(':') == std::string::npos ? ':' : ',', names_);
    }
    Needs GetNeeds() const override { return denoiser_->GetNeeds(); }
    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        return denoiser_->Reconstruct(Blind(frame), cancel);
    }
    Plane PlanSamples(const Frame& frame, double samples,
                      const CancelToken& cancel) const override {
        return denoiser_->PlanSamples(Blind(frame), samples, cancel);
    }

  private:
    Frame Blind(const Frame& frame) const {
        Frame blind = frame;
        for (const FeatureGroup& group : groups_) {
            for (int f = group.first; f < group.first + group.count; ++f) {
                blind.feature[f] = {};
                blind.feature_variance[f] = {};
                blind.feature_half[0][f] = {};
                blind.feature_half[1][f] = {};
            }
        }
        return blind;
    }

    std::unique_ptr<Denoiser> denoiser_;
    std::string names_;
    std::vector<FeatureGroup> groups_;
};

}  // namespace

std::unique_ptr<Denoiser> WithoutFeatures(std::unique_ptr<Denoiser> denoiser,
                                          const std::string& names) {
    return std::make_unique<Without>(std::move(denoiser), names);
}

}  // namespace relume::denoise
