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

constexpr double kMost = 0.15;         // of the image's light
constexpr double kMostByPixel = 0.03;  // of it, that one pixel's difference counts
constexpr double kMostOfPixel = 0.2;   // of a pixel's light

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
        return WithParameter(inner().Describe(), "energy=restore");
    }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        Result result = inner().Reconstruct(frame, cancel);
        std::vector<unsigned char> left_out = FindSeenLights(frame);
        left_out.resize(frame.pixel_count(), 0);
        double filtered = 0, lost = 0;
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            if (!IsFinite(result, i)) {
                left_out[i] = 1;
            }
            filtered += left_out[i] == 0 ? LightOf(result, i) : 0.0;
        }
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            if (IsFinite(result, i)) {
                const double light =
                    static_cast<double>(frame.color[0][i]) + frame.color[1][i] + frame.color[2][i];
                lost += std::clamp(light - LightOf(result, i), -kMostByPixel * filtered,
                                   kMostByPixel * filtered);
            }
        }
        const double share = filtered > 0 ? std::clamp(lost / filtered, -kMost, kMost) : 0.0;
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
