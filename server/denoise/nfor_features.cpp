#include "server/denoise/nfor_features.h"

#include <algorithm>
#include <utility>

#include "server/denoise/feature_prefilter.h"
#include "server/denoise/halves.h"
#include "server/denoise/nlm_filter.h"
#include "server/denoise/regression.h"

namespace relume::denoise {
namespace {

constexpr struct {
    int first;
    std::size_t count;
    const char* name;
} kGroups[] = {{kAlbedoR, 3, "albedo"},
               {kNormalX, 3, "normal"},
               {kDepth, 1, "depth"},
               {kVisibility, 1, "visibility"}};

constexpr NlmOptions kFeatureNlm = {.k = 0.5f, .patch = 3};
constexpr int kFirstRadius = 5, kLastRadius = 2;

float Largest(const Plane& plane) {
    float largest = 0;
    for (const float value : plane) {
        largest = std::max(largest, value);
    }
    return largest;
}

// Less than regression takes for constant.
bool IsConstant(const Plane& plane, float scale) {
    const auto [least, largest] = std::ranges::minmax(plane);
    const float range = (largest - least) * scale;
    return range * range < kConstantVariance;
}

// Variance of the mean of half `half`, the samples' own; 0 if not known.
Plane HalfVariance(const Frame& frame, int feature, int half) {
    Plane variance = frame.feature_variance[feature];
    variance.resize(frame.pixel_count());
    for (std::size_t i = 0; i < variance.size(); ++i) {
        variance[i] /= frame.count.empty() ? 0.5f : std::max(1.0f, HalfCount(frame.count[i], half));
    }
    return variance;
}

const Plane& HalfMean(const Frame& frame, int feature, std::size_t half) {
    const Plane& plane = frame.feature_half[half][feature];
    return plane.empty() ? frame.feature[feature] : plane;
}

// Appends the filtered planes to `out`.
void Filter(const NlmGuide& guide, int radius, const std::vector<const Plane*>& in,
            std::vector<Plane>* out, const CancelToken& cancel) {
    std::vector<Plane> filtered(in.size());
    std::vector<Plane*> to;
    for (Plane& plane : filtered) {
        to.push_back(&plane);
    }
    FilterNlm(guide, kFeatureNlm, radius, in, to, cancel);
    std::ranges::move(filtered, std::back_inserter(*out));
}

}  // namespace

NforFeatures FilterHalfFeatures(const Frame& frame, const CancelToken& cancel) {
    NforFeatures out;
    for (const auto& group : kGroups) {
        if (frame.feature[group.first].empty()) {
            continue;
        }
        float scale = 1;
        if (group.first == kDepth) {
            const float largest = Largest(frame.feature[kDepth]);
            scale = largest > 0 ? 1 / largest : 0;
        }
        std::vector<int> members;
        for (int f = group.first; f < group.first + static_cast<int>(group.count); ++f) {
            if (!IsConstant(frame.feature[f], scale)) {
                members.push_back(f);
            }
        }
        if (members.empty()) {
            continue;
        }
        out.names += (out.names.empty() ? "" : ", ") + std::string(group.name);
        out.group.push_back(members.size());
        for (std::size_t h = 0; h < 2; ++h) {
            NlmGuide guide;
            guide.width = frame.width;
            guide.height = frame.height;
            std::vector<const Plane*> in;
            std::vector<Plane> variance;
            for (const int f : members) {
                in.push_back(&HalfMean(frame, f, h));
                guide.value.push_back(&HalfMean(frame, f, 1 - h));
                variance.push_back(HalfVariance(frame, f, static_cast<int>(1 - h)));
            }
            for (const Plane& plane : variance) {
                guide.variance.push_back(&plane);
            }
            Filter(guide, kFirstRadius, in, &out.half[h], cancel);
            for (std::size_t k = out.half[h].size() - members.size(); k < out.half[h].size(); ++k) {
                for (float& value : out.half[h][k]) {
                    value *= scale;
                }
            }
        }
    }
    return out;
}

std::vector<Plane> CombineFeatures(NforFeatures features, int width, int height,
                                   const CancelToken& cancel) {
    std::vector<Plane> out;
    std::size_t done = 0;
    for (const std::size_t count : features.group) {
        NlmGuide guide;
        guide.width = width;
        guide.height = height;
        std::vector<const Plane*> in;
        for (std::size_t k = done; k < done + count; ++k) {
            // The first becomes the mean, the second its variance.
            Plane &a = features.half[0][k], &b = features.half[1][k];
            for (std::size_t i = 0; i < a.size(); ++i) {
                const float difference = a[i] - b[i];
                a[i] = 0.5f * (a[i] + b[i]);
                b[i] = 0.25f * difference * difference;
            }
            in.push_back(&a);
            guide.value.push_back(&a);
            guide.variance.push_back(&b);
        }
        Filter(guide, kLastRadius, in, &out, cancel);
        done += count;
    }
    return out;
}

OneFeatures FilterFeatures(const Frame& frame, const CancelToken& cancel) {
    PrefilteredFeatures filtered = PrefilterFeatures(frame, cancel);
    OneFeatures out;
    for (const auto& group : kGroups) {
        bool any = false;
        for (int f = group.first; f < group.first + static_cast<int>(group.count); ++f) {
            Plane& plane = filtered.feature[f];
            if (plane.empty()) {
                continue;
            }
            const float largest = group.first == kDepth ? Largest(frame.feature[kDepth]) : 1;
            const float scale = largest > 0 ? 1 / largest : 0;
            if (IsConstant(plane, scale)) {
                continue;
            }
            for (float& value : plane) {
                value *= scale;
            }
            out.planes.push_back(std::move(plane));
            any = true;
        }
        if (any) {
            out.names += (out.names.empty() ? "" : ", ") + std::string(group.name);
        }
    }
    return out;
}

}  // namespace relume::denoise
