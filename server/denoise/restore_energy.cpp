#include "server/denoise/restore_energy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "server/denoise/seen_lights.h"
#include "server/denoise/wrapped_denoiser.h"

namespace relume::denoise {
namespace {

constexpr double kMost = 0.1;

class Restored final : public WrappedDenoiser {
  public:
    using WrappedDenoiser::WrappedDenoiser;

    std::string Describe() const override {
        const std::string name = inner().Describe();
        return name + (name.find(':') == std::string::npos ? ":" : ",") + "energy=restore";
    }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        Result result = inner().Reconstruct(frame, cancel);
        const std::vector<unsigned char> lights = FindSeenLights(frame);
        const auto is_light = [&](std::size_t i) { return !lights.empty() && lights[i] != 0; };
        double filtered = 0, lost = 0, variance = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                if (is_light(i)) {
                    continue;
                }
                const double value = result.color[c][i], noise = frame.variance[c][i];
                if (std::isfinite(value) && std::isfinite(noise)) {
                    filtered += value;
                    lost += frame.color[c][i] - value;
                    variance += noise;
                }
            }
        }
        // Channels of a sample go together: 3 V is the variance of their sum.
        variance *= 3;
        const double sure = lost != 0 ? std::max(0.0, 1 - variance / (lost * lost)) : 0.0;
        const double share = filtered > 0 ? std::clamp(sure * lost / filtered, -kMost, kMost) : 0.0;
        if (share != 0) {
            const auto gain = static_cast<float>(1 + share);
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                for (std::size_t c = 0; c < 3 && !is_light(i); ++c) {
                    result.color[c][i] *= gain;
                }
                if (result.error && !is_light(i)) {
                    (*result.error)[i] *= gain * gain;
                }
            }
            result.derivative.reset();
        }
        result.notes["energy"] = fmt::format("{:+.2f} %", 100 * share);
        return result;
    }
};

}  // namespace

std::unique_ptr<Denoiser> RestoreEnergy(std::unique_ptr<Denoiser> denoiser) {
    return std::make_unique<Restored>(std::move(denoiser));
}

}  // namespace relume::denoise
