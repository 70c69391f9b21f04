#include "server/denoise/filter_frame.h"

#include <chrono>
#include <utility>

namespace relume::denoise {

Filtered FilterFrame(const std::string& filter, const Frame& frame, const CancelToken& cancel) {
    return FilterFrame(MakeDenoiser(filter), frame, cancel);
}

Filtered FilterFrame(std::shared_ptr<const Denoiser> denoiser, const Frame& frame,
                     const CancelToken& cancel) {
    const auto start = std::chrono::steady_clock::now();
    Filtered filtered;
    filtered.choice = denoiser->Choose(frame, cancel);
    if (filtered.choice) {
        denoiser = filtered.choice->denoiser;
    }
    filtered.result = RunDenoiser(*denoiser, frame, cancel);
    filtered.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (filtered.choice) {
        filtered.error = EstimateChosen(*filtered.choice, frame, cancel);
    }
    if (filtered.error) {
        AddMap(frame, filtered.result, &*filtered.error);
    } else {
        filtered.error = EstimateFiltered(*denoiser, frame, filtered.result, cancel);
    }
    const bool judged = filtered.error && filtered.choice && filtered.choice->base;
    if (judged && filtered.error->relmse > filtered.error->unfiltered &&
        denoiser->Describe() != "none") {
        Choice& choice = *filtered.choice;
        const bool base_helps =
            filtered.error->relmse < choice.over_base * filtered.error->unfiltered;
        denoiser = base_helps ? choice.base : MakeDenoiser("none");
        choice.denoiser = denoiser;
        choice.reason = "on the whole image the chosen one was worse than none";
        filtered.result = RunDenoiser(*denoiser, frame, cancel);
        if (base_helps) {
            choice.over_base = 1;
            choice.over_base_error = 0;
            filtered.error = EstimateChosen(choice, frame, cancel);
            if (filtered.error) {
                AddMap(frame, filtered.result, &*filtered.error);
            }
        } else {
            filtered.error = EstimateFiltered(*denoiser, frame, filtered.result, cancel);
        }
    }
    filtered.filter = denoiser->Describe();
    return filtered;
}

}  // namespace relume::denoise
