#include "server/rpc/finish_image.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>

#include "core/image/exr.h"
#include "proto/codec/codec.h"
#include "proto/codec/protocol.h"
#include "server/denoise/error_estimate.h"
#include "server/denoise/filter_frame.h"
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

jobs::EstimatedError Interval(const denoise::ErrorEstimate& estimate) {
    return {estimate.relmse, estimate.low, estimate.high};
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

FinishedImage FinishImage(const jobs::JobQueue::FilterWork& work, const CheckedSpec& spec,
                          const std::string& numeric_class, const CancelToken& cancel) {
    const Film& film = *work.film;
    denoise::Frame frame = denoise::FrameFromFilm(film);
    frame.sampling = {work.rays, work.falls};
    const denoise::Filtered made = denoise::FilterFrame(spec.filter, frame, cancel);
    const denoise::Result& result = made.result;
    const auto& filtered = made.error;
    FinishedImage finished;
    finished.outcome.seconds = made.seconds;
    finished.outcome.filter = made.filter;
    finished.outcome.notes = result.notes;
    finished.outcome.mse = MeanError(result);
    if (made.choice) {
        for (const auto& c : made.choice->candidates) {
            finished.outcome.candidates.push_back(
                {c.filter, c.relmse, c.above_best, c.uncertainty, c.seconds});
        }
        finished.outcome.reason = made.choice->reason;
        finished.outcome.dropped = made.choice->dropped;
    }

    const denoise::ErrorEstimate noisy = denoise::EstimateNoisy(frame);
    Image image = denoise::AssembleOutput(film, frame, result, filtered ? &*filtered : nullptr,
                                          spec.message.all_layers());
    if (spec.message.all_layers()) {
        AddDecisions(work, &image);
    }
    auto& metadata = image.metadata();
    metadata["relume.version"] = kBuild;
    metadata["relume.numeric_class"] = numeric_class;
    metadata["relume.scene"] = spec.manifest.main;
    metadata["relume.scene_sha256"] = ManifestDigest(spec.manifest);
    metadata["relume.settings"] = SettingsText(spec);
    metadata["relume.seed"] = std::to_string(spec.settings.seed);
    metadata["relume.sampler"] = spec.sampler;
    metadata["relume.filter"] = finished.outcome.filter;
    if (work.cancelled) {
        metadata["relume.unfinished"] = "cancelled";
    }
    metadata["relume.spp"] =
        fmt::format("{:.6g}", film.TotalSamples() / static_cast<double>(film.pixel_count()));
    denoise::WriteSampling(frame.sampling, &metadata);
    denoise::WriteClaim("relume.relmse", &noisy, &metadata);
    denoise::WriteClaim("relume.filtered_relmse", filtered ? &*filtered : nullptr, &metadata);
    finished.outcome.noisy = Interval(noisy);
    if (filtered) {
        finished.outcome.filtered = Interval(*filtered);
    }
    finished.outcome.image_sha256 = ImageDigest(image);
    finished.exr = EncodeExr(image);
    finished.outcome.result_size = finished.exr.size();
    return finished;
}

}  // namespace relume::server
