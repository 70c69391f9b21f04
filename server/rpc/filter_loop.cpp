#include "server/rpc/filter_loop.h"

#include "core/base/cancel_token.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/frame.h"
#include "server/denoise/halves.h"

namespace relume::server {

jobs::Guide MakeGuide(const std::string& filter) {
    std::shared_ptr<const denoise::Denoiser> denoiser = denoise::MakeDenoiser(filter);
    if (denoiser->Describe() == "none") {
        return {};
    }
    return [denoiser](const Film& film) {
        const denoise::Frame frame = denoise::FrameFromFilm(film);
        return denoise::Disagreement(denoise::FilterHalves(*denoiser, frame, CancelToken()));
    };
}

}  // namespace relume::server
