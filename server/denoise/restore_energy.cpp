#include "server/denoise/restore_energy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "server/denoise/each_pixel.h"
#include "server/denoise/seen_lights.h"
#include "server/denoise/wrapped_denoiser.h"

namespace relume::denoise {
namespace {

constexpr double kMost = 0.1;         // of the image's light
constexpr double kMostOfPixel = 0.2;  // of a pixel's

bool IsFinite(const Result& result, std::size_t i) {
    return std::isfinite(result.color[0][i]) && std::isfinite(result.color[1][i]) &&
           std::isfinite(result.color[2][i]);
}

double LightOf(const Result& result, std::size_t i) {
    return static_cast<double>(result.color[0][i]) + result.color[1][i] + result.color[2][i];
}

// The number by which a pixel's light, up to kMostOfPixel of it, is its share of itself that is
// given back, so that all have `light` together: sum of min(kMostOfPixel, slope * light_i) *
// light_i. Each round finds pixels that have reached kMostOfPixel, and more slope for the others;
// those stay, so that it ends.
double SlopeThatGives(double light, const Result& result,
                      const std::vector<unsigned char>& left_out) {
    double slope = 0;
    for (;;) {
        double full = 0, squares = 0;
        for (std::size_t i = 0; i < left_out.size(); ++i) {
            const double pixel = left_out[i] == 0 ? LightOf(result, i) : 0.0;
            if (pixel <= 0) {
                continue;
            }
            if (slope * pixel >= kMostOfPixel) {
                full += kMostOfPixel * pixel;
            } else {
                squares += pixel * pixel;
            }
        }
        const double next = squares > 0 ? (light - full) / squares : slope;
        if (!(next > slope * (1 + 1e-9))) {
            return slope;
        }
        slope = next;
    }
}

class Restored final : public WrappedDenoiser {
  public:
    using WrappedDenoiser::WrappedDenoiser;

    std::string Describe() const override {
        const std::string name = inner().Describe();
        return name + (name.find(':') == std::string::npos ? ":" : ",") + "energy=restore";
    }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        Result result = inner().Reconstruct(frame, cancel);
        std::vector<unsigned char> left_out = FindSeenLights(frame);
        left_out.resize(frame.pixel_count(), 0);
        double filtered = 0, lost = 0, variance = 0;
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            double noise = 0, light = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                noise += frame.variance[c][i];
                light += frame.color[c][i];
            }
            if (!IsFinite(result, i) || !std::isfinite(noise)) {
                left_out[i] = 1;
            }
            if (left_out[i] == 0) {
                filtered += LightOf(result, i);
                lost += light - LightOf(result, i);
                variance += noise;
            }
        }
        // Channels of a sample go together: 3 V is the variance of their sum.
        variance *= 3;
        const double sure = lost != 0 ? std::max(0.0, 1 - variance / (lost * lost)) : 0.0;
        const double share = filtered > 0 ? std::clamp(sure * lost / filtered, -kMost, kMost) : 0.0;
        if (share != 0) {
            const double slope = SlopeThatGives(std::abs(share) * filtered, result, left_out);
            ForEachPixel(frame.pixel_count(), [&](std::size_t i) {
                const double light = left_out[i] == 0 ? std::max(0.0, LightOf(result, i)) : 0.0;
                const double part = std::min(kMostOfPixel, slope * light);
                const auto gain = static_cast<float>(1 + std::copysign(part, share));
                for (Plane& plane : result.color) {
                    plane[i] *= gain;
                }
                if (result.error) {
                    (*result.error)[i] *= gain * gain;
                }
            });
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
