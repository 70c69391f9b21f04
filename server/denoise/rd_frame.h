#pragma once

#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/frame.h"
#include "server/denoise/nlm_weights.h"
#include "server/denoise/rd_features.h"
#include "server/denoise/rd_filter.h"

namespace relume::denoise {

// The constants of rd.cpp, and all of it but features and planner.

inline constexpr int kRdRadius = 10;  // pixels, of the candidates' windows, if not told
enum RdCandidate { kFine, kSmooth, kFeatures, kRdCandidates };
inline constexpr RdFilter kRdCandidateFilters[kRdCandidates] = {
    {NlmOptions{.patch = 1}, 1e-3f}, {NlmOptions{.patch = 3}, 1e-3f}, {std::nullopt, 1e-4f}};
// Smooths errors and choices.
inline constexpr NlmOptions kRdSmoothing = {.k = 1};

inline NlmGuide ColorGuide(const Frame& frame) {
    return {frame.width, frame.height, frame.color, frame.variance};
}

struct RdFrame {
    Plane color[3];
    Plane error;               // estimated squared error, mean over RGB
    std::vector<Plane> share;  // of each candidate, 1 in all
};

// With candidates of that radius a pixel sees no further than this in frame and features.
inline constexpr int RdReach(int radius) { return (radius + 3) + 1 + 5 + 1 + (5 + 3); }

RdFrame FilterRdFrame(const Frame& frame, const RdFeaturePlanes& features, int radius,
                      const NlmKernels& kernels, const CancelToken& cancel);

}  // namespace relume::denoise
