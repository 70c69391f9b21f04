#include "server/denoise/seen_lights.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/parallel.h"
#include "core/math/vec.h"
#include "server/denoise/wrapped_denoiser.h"

namespace relume::denoise {
namespace {

constexpr int kAround = 2;        // radius of the surroundings, pixels
constexpr float kShare = 0.2f;    // of them that must be darker: one side of a rim
constexpr float kMuch = 64;       // times as bright
constexpr std::size_t kRows = 8;  // a task

float LuminanceAt(const Plane (&planes)[3], std::size_t i) {
    return relume::Luminance({planes[0][i], planes[1][i], planes[2][i]});
}

// Calls f(j) for the pixels around pixel i, without itself.
template <typename F>
void ForEachAround(const Frame& frame, std::size_t i, const F& f) {
    const auto width = static_cast<std::size_t>(frame.width);
    const int x = static_cast<int>(i % width), y = static_cast<int>(i / width);
    for (int v = std::max(y - kAround, 0); v <= std::min(y + kAround, frame.height - 1); ++v) {
        for (int u = std::max(x - kAround, 0); u <= std::min(x + kAround, frame.width - 1); ++u) {
            const std::size_t j = static_cast<std::size_t>(v) * width + static_cast<std::size_t>(u);
            if (j != i) {
                f(j);
            }
        }
    }
}

// Whether seen light in the pixel is much brighter and noisier than the darker of its neighbours.
bool Outshines(const Frame& frame, std::size_t i) {
    const float seen = LuminanceAt(frame.color, i) - frame.brightest[i];
    // Of the sum of the channels, which go together.
    float deviation = 0;
    for (const Plane& variance : frame.variance) {
        deviation += std::sqrt(std::max(variance[i], 0.0f)) * (1.0f / 3.0f);
    }
    const float least = std::min(seen, deviation) / kMuch;
    if (!(least > 0)) {
        return false;
    }
    int darker = 0, all = 0;
    ForEachAround(frame, i, [&](std::size_t j) {
        darker += LuminanceAt(frame.color, j) < least ? 1 : 0;
        ++all;
    });
    return static_cast<float>(darker) > kShare * static_cast<float>(all);
}

// Mean of `plane` over the pixels around i that are not `found`; 0 if all are.
float MeanAround(const Frame& frame, const std::vector<unsigned char>& found, const Plane& plane,
                 std::size_t i) {
    float sum = 0, pixels = 0;
    ForEachAround(frame, i, [&](std::size_t j) {
        if (found[j] == 0) {
            sum += plane[j];
            ++pixels;
        }
    });
    return pixels > 0 ? sum / pixels : 0.0f;
}

// Takes what is above `most` in luminance out of pixel i, colours in proportion.
std::array<float, 3> TakeAbove(float most, std::size_t i, Plane (&color)[3]) {
    const float luminance = LuminanceAt(color, i);
    const float share = luminance > most ? 1 - most / luminance : 0.0f;
    std::array<float, 3> taken{};
    for (std::size_t c = 0; c < 3; ++c) {
        taken[c] = share * color[c][i];
        color[c][i] -= taken[c];
    }
    return taken;
}

struct SeenLights {
    std::vector<std::size_t> pixels;
    std::vector<std::array<float, 3>> color;  // radiance, of each
    std::vector<float> variance;              // of the mean, mean over the channels
};

// Takes them out of means, halves and variances.
SeenLights TakeOut(const std::vector<unsigned char>& found, Frame* frame) {
    SeenLights lights;
    for (std::size_t i = 0; i < found.size(); ++i) {
        if (found[i] != 0) {
            lights.pixels.push_back(i);
            lights.color.push_back(TakeAbove(frame->brightest[i], i, frame->color));
            lights.variance.push_back(0);
            for (int h = 0; h < 2 && frame->has_halves(); ++h) {
                TakeAbove(frame->brightest[i], i, frame->half[h]);
            }
        }
    }
    for (int c = 0; c < 3; ++c) {
        for (Plane* plane : {&frame->variance[c], &frame->sample_variance[c]}) {
            std::vector<float> around;
            for (const std::size_t i : lights.pixels) {
                around.push_back(plane->empty() ? 0.0f : MeanAround(*frame, found, *plane, i));
            }
            for (std::size_t k = 0; k < around.size() && !plane->empty(); ++k) {
                float& variance = (*plane)[lights.pixels[k]];
                const float rest = std::min(around[k], variance);
                if (plane == &frame->variance[c]) {
                    lights.variance[k] += (variance - rest) * (1.0f / 3.0f);
                }
                variance = rest;
            }
        }
    }
    return lights;
}

class Apart final : public WrappedDenoiser {
  public:
    using WrappedDenoiser::WrappedDenoiser;

    std::string Describe() const override { return inner().Describe(); }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        const std::vector<unsigned char> found = FindSeenLights(frame);
        if (found.empty()) {
            return inner().Reconstruct(frame, cancel);
        }
        Frame dark = frame;
        const SeenLights lights = TakeOut(found, &dark);
        Result result = inner().Reconstruct(dark, cancel);
        for (std::size_t k = 0; k < lights.pixels.size(); ++k) {
            const std::size_t i = lights.pixels[k];
            for (std::size_t c = 0; c < 3; ++c) {
                result.color[c][i] += lights.color[k][c];
                if (result.derivative) {
                    (*result.derivative)[c][i] = 1;
                }
            }
            if (result.error) {
                (*result.error)[i] += lights.variance[k];
            }
        }
        return result;
    }
};

}  // namespace

std::vector<unsigned char> FindSeenLights(const Frame& frame) {
    if (frame.brightest.empty()) {
        return {};
    }
    std::vector<unsigned char> found(frame.pixel_count(), 0);
    const auto width = static_cast<std::size_t>(frame.width);
    ParallelFor(0, static_cast<std::size_t>(frame.height), kRows,
                [&](std::size_t y0, std::size_t y1) {
                    for (std::size_t i = y0 * width; i < y1 * width; ++i) {
                        found[i] = Outshines(frame, i) ? 1 : 0;
                    }
                });
    if (std::ranges::find(found, 1) == found.end()) {
        found.clear();
    }
    return found;
}

std::unique_ptr<Denoiser> LightsApart(std::unique_ptr<Denoiser> denoiser) {
    return std::make_unique<Apart>(std::move(denoiser));
}

}  // namespace relume::denoise
