#include "server/rpc/finish_image.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cmath>

#include "core/base/clock.h"
#include "core/image/exr.h"
#include "proto/codec/codec.h"
#include "proto/codec/protocol.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/frame.h"
#include "server/denoise/output_image.h"

namespace relume::server {
namespace {

std::string SettingsText(const CheckedSpec& spec) {
    std::string text;
    google::protobuf::util::JsonPrintOptions options;
    options.preserve_proto_field_names = true;
    (void)google::protobuf::util::MessageToJsonString(codec::ToProto(spec.settings), &text,
                                                      options);
    return text;
}

std::optional<double> MeanError(const denoise::Result& result) {
    if (!result.error || result.error->empty()) {
        return std::nullopt;
    }
    double sum = 0;
    for (const float e : *result.error) {
        sum += e;
    }
    return sum / static_cast<double>(result.error->size());
}

void AddDecisions(const jobs::JobQueue::FilterWork& work, Image* image) {
    if (!work.selector.empty()) {
        std::ranges::copy(work.selector, image->Plane(image->Add("selector.Y")).begin());
    }
    if (!work.decisions.empty()) {
        std::ranges::transform(work.decisions, image->Plane(image->Add("decision.Y")).begin(),
                               [](jobs::Decision d) { return static_cast<float>(d); });
    }
}

}  // namespace

ErrorEstimate EstimateError(const Film& film) {
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        const double error = film.EstimateRelMSE(i);
        sum += error;
        squares += error * error;
    }
    const auto n = static_cast<double>(film.pixel_count());
    const double mean = sum / n;
    return {mean, n > 1 ? 1.96 * std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1)) : 0};
}

FinishedImage FinishImage(const jobs::JobQueue::FilterWork& work, const CheckedSpec& spec,
                          const std::string& numeric_class, const CancelToken& cancel) {
    const Film& film = *work.film;
    const SteadyClock clock;
    const TimePoint start = clock.Now();
    const denoise::Frame frame = denoise::FrameFromFilm(film);
    const auto denoiser = denoise::MakeDenoiser(spec.filter);
    const denoise::Result result = denoise::RunDenoiser(*denoiser, frame, cancel);
    FinishedImage finished;
    finished.outcome.seconds = ToSeconds(clock.Now() - start);
    finished.outcome.filter = denoiser->Describe();
    finished.outcome.notes = result.notes;
    finished.outcome.mse = MeanError(result);

    Image image = denoise::AssembleOutput(film, frame, result, spec.message.all_layers());
    if (spec.message.all_layers()) {
        AddDecisions(work, &image);
    }
    const ErrorEstimate error = EstimateError(film);
    auto& metadata = image.metadata();
    metadata["relume.version"] = kBuild;
    metadata["relume.numeric_class"] = numeric_class;
    metadata["relume.scene"] = spec.manifest.main;
    metadata["relume.scene_sha256"] = ManifestDigest(spec.manifest);
    metadata["relume.settings"] = SettingsText(spec);
    metadata["relume.seed"] = std::to_string(spec.settings.seed);
    metadata["relume.sampler"] = spec.sampler;
    metadata["relume.filter"] = finished.outcome.filter;
    metadata["relume.spp"] =
        fmt::format("{:.6g}", film.TotalSamples() / static_cast<double>(film.pixel_count()));
    metadata["relume.relmse"] = fmt::format("{:.6g}", error.relmse);
    metadata["relume.relmse_interval"] = fmt::format(
        "{:.6g} {:.6g}", std::max(0.0, error.relmse - error.margin), error.relmse + error.margin);
    finished.outcome.image_sha256 = ImageDigest(image);
    finished.exr = EncodeExr(image);
    finished.outcome.result_size = finished.exr.size();
    return finished;
}

}  // namespace relume::server
