#include "server/rpc/filter_loop.h"

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/byte_stream.h"
#include "core/base/cancel_token.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/error_estimate.h"
#include "server/denoise/frame.h"
#include "server/denoise/halves.h"

namespace relume::server {
namespace {

// The cheapest filter that ranks regions as others do (methods 5.5).
constexpr const char* kForGuiding = "bilateral:mode=robust";

}  // namespace

jobs::Guide MakeGuide(const std::string& filter) {
    if (denoise::MakeDenoiser(filter)->Describe() == "none") {
        return {};
    }
    const std::shared_ptr<const denoise::Denoiser> denoiser = denoise::MakeDenoiser(kForGuiding);
    return [denoiser](const Film& film, double) {
        const denoise::Frame small = denoise::ShrinkFrame(denoise::FrameFromFilm(film));
        const denoise::Plane differ =
            denoise::Disagreement(denoise::FilterHalves(*denoiser, small, CancelToken()));
        std::vector<float> whole(film.pixel_count());
        const auto width = static_cast<std::size_t>(film.width());
        for (std::size_t i = 0; i < whole.size(); ++i) {
            whole[i] =
                differ[i / width / 2 * static_cast<std::size_t>(small.width) + i % width / 2];
        }
        return whole;
    };
}

jobs::Guide MakeMethodGuide(const std::string& filter) {
    std::shared_ptr<const denoise::Denoiser> denoiser = denoise::MakeDenoiser(filter);
    return [denoiser](const Film& film, double samples) {
        return denoiser->PlanSamples(denoise::FrameFromFilm(film), samples, CancelToken());
    };
}

namespace {

struct EstimatorState {
    std::shared_ptr<const denoise::Denoiser> asked;
    std::optional<denoise::Choice> choice;  // if that chooses
    double samples = 0;                     // when it did
};

std::string SaveEstimator(const EstimatorState& state) {
    ByteWriter out;
    out.Put(state.samples);
    out.Put<std::uint8_t>(state.choice ? 1 : 0);
    if (state.choice) {
        const denoise::Choice& choice = *state.choice;
        out.PutText(choice.denoiser->Describe());
        out.PutText(choice.base ? choice.base->Describe() : std::string());
        out.Put(choice.over_base);
        out.Put(choice.over_base_error);
    }
    return out.Take();
}

// Of the choice as much as estimates look at.
void RestoreEstimator(std::string_view bytes, EstimatorState* state) {
    ByteReader in(bytes);
    state->samples = in.Get<double>();
    state->choice.reset();
    if (in.Get<std::uint8_t>() != 0) {
        denoise::Choice& choice = state->choice.emplace();
        choice.denoiser = denoise::MakeDenoiser(std::string(in.GetText()));
        const std::string base(in.GetText());
        if (!base.empty()) {
            choice.base = denoise::MakeDenoiser(base);
        }
        choice.over_base = in.Get<double>();
        choice.over_base_error = in.Get<double>();
    }
    in.End();
}

}  // namespace

jobs::Estimators MakeErrorEstimator(const std::string& filter) {
    const auto state = std::make_shared<EstimatorState>();
    state->asked = denoise::MakeDenoiser(filter);
    if (state->asked->GetNeeds().samples) {
        state->asked = denoise::MakeDenoiser(kForGuiding);  // minutes for each plan else
    }
    jobs::Estimators estimators;
    estimators.save = [state] { return SaveEstimator(*state); };
    estimators.restore = [state](std::string_view bytes) { RestoreEstimator(bytes, state.get()); };
    estimators.error = [state](const Film& film) {
        const CancelToken never;
        const denoise::Frame frame = denoise::FrameFromFilm(film);
        const double samples = film.TotalSamples();
        if (state->samples == 0 || samples >= 2 * state->samples) {
            state->choice = state->asked->Choose(frame, never);
            state->samples = samples;
        }
        const denoise::Denoiser& taken = state->choice ? *state->choice->denoiser : *state->asked;
        if (state->choice && taken.Describe() != "none") {
            const auto error = denoise::EstimateChosen(*state->choice, frame, never);
            state->choice->base_error = nullptr;  // of this frame alone
            state->choice->base_windows.clear();
            if (error) {
                return error->relmse;
            }
        }
        if (taken.Describe() != "none") {
            if (const auto error = denoise::EstimateByHalves(taken, frame, never)) {
                return error->relmse;
            }
            const denoise::Result result = denoise::RunDenoiser(taken, frame, never);
            if (const auto error = denoise::EstimateFiltered(taken, frame, result, never)) {
                return error->relmse;
            }
        }
        return denoise::EstimateNoisy(frame).relmse;
    };
    return estimators;
}

}  // namespace relume::server
