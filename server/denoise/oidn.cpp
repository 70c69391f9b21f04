// Open Image Denoise's published networks (Afra 2019 to 2025, version 2.3; methods 5.1), run by
// network/: U-Nets that see radiance on a perceptual curve at a common exposure, albedo and normal.
//
//   features=prefiltered, noisy, none: albedo and normal first through networks of their own, and
//       then the network that is told that they are clean, as its documentation recommends; as they
//       are; not looked at. A feature without variance anywhere is clean as it is.
//   size=base, small, large: of the network for colour; those for features are always base. Large
//       is published for prefiltered features alone.
//
// A frame without normal is filtered with albedo as it is, one without albedo by colour alone. The
// weights are not part of Relume: deploy/fetch-oidn gets them. Where the build has found Open Image
// Denoise's library, that is run instead, with the weights that are part of it (oidn_library.h).
//
// Limits: it does not converge to the noisy image, however many samples there are, has no estimate
// of its own error, and may draw what it has learnt from other scenes. The exposure is the whole
// image's, so that one bright pixel is seen everywhere, by rounding at least. Results of different
// processors differ by rounding.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "core/base/error.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/each_pixel.h"
#include "server/denoise/oidn_library.h"
#include "server/denoise/oidn_networks.h"
#include "server/denoise/oidn_transfer.h"

namespace relume::denoise {
namespace {

using ThreePlanes = std::array<Plane, 3>;

template <typename F>
Plane Map(const Plane& in, const F& f) {
    return FillPlane(in.size(), [&](std::size_t i) { return f(in[i]); });
}

float Clamp01(float value) { return std::clamp(value, 0.0f, 1.0f); }

ThreePlanes RunOn(const Network& network, const std::vector<const ThreePlanes*>& inputs,
                  const Frame& frame, const CancelToken& cancel) {
    std::vector<const float*> planes;
    for (const ThreePlanes* three : inputs) {
        for (const Plane& plane : *three) {
            planes.push_back(plane.data());
        }
    }
    std::vector<Plane> outputs = network.Run(planes, frame.width, frame.height, cancel);
    return {std::move(outputs[0]), std::move(outputs[1]), std::move(outputs[2])};
}

bool HasFeature(const Frame& frame, int first) {
    return !frame.feature[first].empty() && !frame.feature[first + 1].empty() &&
           !frame.feature[first + 2].empty();
}

bool IsClean(const Frame& frame, int first) {
    for (int f = first; f < first + 3; ++f) {
        const Plane& variance = frame.feature_variance[f];
        if (variance.empty() || std::ranges::any_of(variance, [](float v) { return v > 0; })) {
            return false;
        }
    }
    return true;
}

class Oidn final : public Denoiser {
  public:
    Oidn(std::string features, std::string size)
        : features_(std::move(features)), size_(std::move(size)) {
        if (size_ == "large" && features_ != "prefiltered") {
            ThrowInvalidArgument(
                "filter 'oidn': size=large is published for features=prefiltered "
                "alone; take size=base");
        }
        main_ = OfSize(features_ == "none"    ? "rt_hdr"
                       : features_ == "noisy" ? kOidnNoisyNetwork
                                              : kOidnCleanNetwork);
        if (HasOidnLibrary()) {
            return;
        }
        CheckOidnNetwork(main_);
        if (features_ == "prefiltered") {
            CheckOidnNetwork(kOidnAlbedoNetwork);
            CheckOidnNetwork(kOidnNormalNetwork);
        }
    }

    std::string Describe() const override {
        return fmt::format("oidn:features={},size={}", features_, size_);
    }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        Result result;
        const bool has_albedo = features_ != "none" && HasFeature(frame, kAlbedoR);
        const bool has_normal = has_albedo && HasFeature(frame, kNormalX);
        result.notes["features"] = has_normal ? features_ : has_albedo ? "albedo, noisy" : "none";
        if (HasOidnLibrary()) {
            result.notes["engine"] = "Open Image Denoise's library";
            ThreePlanes color = ByLibrary(frame, has_albedo, has_normal, cancel);
            std::ranges::move(color, std::begin(result.color));
            return result;
        }

        // Which network, and what it sees beside colour: in [0, 1].
        const bool lacks = features_ != "none" && !has_normal;
        const std::shared_ptr<const Network> network =
            LoadOidnNetwork(lacks ? OfSize(has_albedo ? "rt_hdr_alb" : "rt_hdr") : main_);
        ThreePlanes albedo, normal;
        for (int c = 0; c < 3 && has_albedo; ++c) {
            albedo[static_cast<std::size_t>(c)] = Map(frame.feature[kAlbedoR + c], Clamp01);
        }
        for (int c = 0; c < 3 && has_normal; ++c) {
            normal[static_cast<std::size_t>(c)] =
                Map(frame.feature[kNormalX + c], [](float n) { return Clamp01(n * 0.5f + 0.5f); });
        }
        if (has_normal && features_ == "prefiltered") {
            if (!IsClean(frame, kAlbedoR)) {
                albedo = Prefilter(*LoadOidnNetwork(kOidnAlbedoNetwork), albedo, frame, ToSrgb,
                                   FromSrgb, cancel);
            }
            if (!IsClean(frame, kNormalX)) {
                const auto as_it_is = [](float value) { return value; };
                normal = Prefilter(*LoadOidnNetwork(kOidnNormalNetwork), normal, frame, as_it_is,
                                   as_it_is, cancel);
            }
        }

        // Colour.
        const float exposure = AutoExposure(frame.color, frame.width, frame.height);
        ThreePlanes color;
        for (std::size_t c = 0; c < 3; ++c) {
            color[c] = Map(frame.color[c], [=](float x) { return ToPu(x * exposure); });
        }
        std::vector<const ThreePlanes*> inputs = {&color};
        if (has_albedo) {
            inputs.push_back(&albedo);
        }
        if (has_normal) {
            inputs.push_back(&normal);
        }
        const ThreePlanes filtered = RunOn(*network, inputs, frame, cancel);
        for (std::size_t c = 0; c < 3; ++c) {
            result.color[c] = Map(filtered[c], [=](float y) { return FromPu(y) / exposure; });
        }
        return result;
    }

  private:
    ThreePlanes ByLibrary(const Frame& frame, bool has_albedo, bool has_normal,
                          const CancelToken& cancel) const {
        const auto copy = [&](int first) {
            const auto f = static_cast<std::size_t>(first);
            return ThreePlanes{frame.feature[f], frame.feature[f + 1], frame.feature[f + 2]};
        };
        const ThreePlanes color = {frame.color[0], frame.color[1], frame.color[2]};
        OidnTask task{frame.width, frame.height, nullptr, nullptr, nullptr};
        ThreePlanes albedo, normal;
        if (has_albedo) {
            albedo = copy(kAlbedoR);
        }
        if (has_normal) {
            normal = copy(kNormalX);
        }
        if (has_normal && features_ == "prefiltered") {
            task.albedo = &albedo;
            if (!IsClean(frame, kAlbedoR)) {
                albedo = RunOidnLibrary(task, cancel);
            }
            task.albedo = nullptr;
            task.normal = &normal;
            if (!IsClean(frame, kNormalX)) {
                normal = RunOidnLibrary(task, cancel);
            }
            task.clean = true;
        }
        task.color = &color;
        task.albedo = has_albedo ? &albedo : nullptr;
        task.normal = has_normal ? &normal : nullptr;
        task.size = size_ == "small"   ? OidnTask::Size::kSmall
                    : size_ == "large" ? OidnTask::Size::kLarge
                                       : OidnTask::Size::kBase;
        return RunOidnLibrary(task, cancel);
    }

    std::string OfSize(const std::string& name) const {
        const bool published = size_ == "small" || (size_ == "large" && name == kOidnCleanNetwork);
        return published ? name + "_" + size_ : name;
    }

    template <typename To, typename From>
    static ThreePlanes Prefilter(const Network& network, const ThreePlanes& feature,
                                 const Frame& frame, const To& to, const From& from,
                                 const CancelToken& cancel) {
        ThreePlanes input;
        for (std::size_t c = 0; c < 3; ++c) {
            input[c] = Map(feature[c], to);
        }
        ThreePlanes output = RunOn(network, {&input}, frame, cancel);
        for (Plane& plane : output) {
            plane = Map(plane, [&](float y) { return from(Clamp01(y)); });
        }
        return output;
    }

    std::string features_, size_;
    std::string main_;  // name of the network for colour
};

}  // namespace

std::unique_ptr<Denoiser> MakeOidn(const ParamSet& params) {
    return std::make_unique<Oidn>(
        params.GetChoice("features", "prefiltered", {"prefiltered", "noisy", "none"}),
        params.GetChoice("size", "base", {"base", "small", "large"}));
}

}  // namespace relume::denoise
