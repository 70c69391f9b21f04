#pragma once

#include <memory>
#include <optional>
#include <string>

#include "core/base/cancel_token.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/error_estimate.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// A filtered frame, and what became of the choice if the filter had one.
struct Filtered {
    Result result;
    std::string filter;  // with all parameters: the one that made it
    std::optional<Choice> choice;
    std::optional<ErrorEstimate> error;  // of the result
    double seconds = 0;                  // to choose and to filter, without the estimate
};

// Chooses, filters and estimates the error. A filter that was chosen by trial never makes an image
// worse than the noisy one by the estimate: the filter that others were judged against is taken
// then, or if that is no better the noisy image. Throws as RunDenoiser.
Filtered FilterFrame(std::shared_ptr<const Denoiser> denoiser, const Frame& frame,
                     const CancelToken& cancel);
// The filter of that name (MakeDenoiser).
Filtered FilterFrame(const std::string& filter, const Frame& frame, const CancelToken& cancel);

}  // namespace relume::denoise
