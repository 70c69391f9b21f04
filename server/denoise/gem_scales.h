#pragma once

#include <array>
#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// How GEM chooses a Gaussian for each pixel (Rousselle, Knaus, Zwicker 2011; methods 2.2).
struct GemScales {
    std::vector<float> sigma;  // pixels, rising
    float gamma = 0.2f;        // below 1/1.9; more keeps more of the noise
    // The flags of where to stop are smoothed by sigma times this. When samples are planned the
    // smoothed ones count; for the image a pixel stops only where its own is raised, too.
    float flag_blur = 2;
    bool own_flag_needed = true;
};
GemScales FinalGemScales(float gamma), PlanGemScales(float gamma);

// `scale`: index of sigma, -1 for the pixel itself.
struct GemSelection {
    std::vector<signed char> scale;
    std::array<Plane, 3> mean;  // at that scale
    Plane error;                // estimated squared error a pixel, mean over RGB
    Plane support;              // samples within the kernel
    Plane own;                  // a pixel's own share of its mean
};
GemSelection SelectScales(const Frame& frame, const GemScales& scales, const CancelToken& cancel);

// How far a difference of two scales is trusted, for `samples` in the coarse one's kernel.
float GemConfidence(float gamma, float samples);

}  // namespace relume::denoise
