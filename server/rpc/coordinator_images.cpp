#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "core/base/log.h"
#include "core/base/sha256.h"
#include "server/rpc/coordinator.h"

// Images of Coordinator: filtering them, and keeping what came of it.
namespace relume::server {
namespace {

constexpr double kStoreAgainSeconds = 2;

// What the time to finish an image depends on, beside its size.
std::string FinishKind(const CheckedSpec& spec) {
    return spec.filter + (spec.message.all_layers() ? " all layers" : "");
}

// Seconds by which the final image's filter may be dearer, if it is chosen when all samples are in.
double DearerChoice(const jobs::Outcome& outcome) {
    constexpr double kWithEstimate = 1.5;  // over filtering alone
    double taken = 0, dearest = 0;
    for (const jobs::FilterCandidate& candidate : outcome.candidates) {
        taken = candidate.filter == outcome.filter ? candidate.seconds : taken;
        dearest = std::max(dearest, candidate.seconds);
    }
    return kWithEstimate * (dearest - taken);
}

}  // namespace

void Coordinator::StartFilters() {
    while (!stopping_) {
        auto work = queue_.TakeFilterWork();
        if (!work) {
            break;
        }
        const auto& info = queue_.Get(work->name);
        keeper_.Final(*work);
        const LogScope scope({.job = work->name});
        spdlog::info("{}: {} samples in {} passes after {:.2f} s ({})", work->name,
                     info.samples_done, info.passes.size(), info.render_seconds, info.message);
        to_filter_.push_back(std::move(*work));
    }
    // One at a time, those of a higher priority first.
    std::erase_if(to_filter_, [&](const auto& work) {
        return !queue_.Knows(work.name) || jobs::IsOver(queue_.Get(work.name).state);
    });
    if (stopping_ || filtering_ || to_filter_.empty()) {
        return;
    }
    const auto first = std::ranges::max_element(
        to_filter_, {}, [&](const auto& work) { return queue_.Get(work.name).priority; });
    jobs::JobQueue::FilterWork work = std::move(*first);
    to_filter_.erase(first);
    const Record& record = records_.at(work.name);
    const std::string numeric_class = queue_.Get(work.name).numeric_class;
    filtering_ = true;
    filter_.Post(
        [this, work = std::move(work), spec = record.spec, cancel = record.cancel, numeric_class] {
            Filter(work, spec, numeric_class, *cancel);
            control_.Post([this] {
                filtering_ = false;
                StartFilters();
            });
        });
}

// By what was measured, else by doing it once with the samples so far.
double Coordinator::PredictFinish(const Film& film, const CheckedSpec& spec,
                                  const CancelToken& cancel) {
    const std::string kind = FinishKind(spec);
    if (const auto seconds = finish_times_.Predict(kind, film.pixel_count())) {
        return *seconds;
    }
    jobs::JobQueue::FilterWork trial;
    trial.film = {std::shared_ptr<const Film>(), &film};  // not owned
    const TimePoint start = Now();
    const FinishedImage finished = FinishImage(trial, spec, "", cancel);
    Sha256Hex(finished.exr);
    const double seconds = ToSeconds(Now() - start) + DearerChoice(finished.outcome);
    finish_times_.Add(kind, film.pixel_count(), seconds);
    return seconds;
}

void Coordinator::Filter(const jobs::JobQueue::FilterWork& work, const CheckedSpec& spec,
                         const std::string& numeric_class, const CancelToken& cancel) {
    const std::string& name = work.name;
    std::string failure;
    const TimePoint start = Now();
    try {
        auto finished =
            std::make_shared<FinishedImage>(FinishImage(work, spec, numeric_class, cancel));
        finished->exr_sha256 = Sha256Hex(finished->exr);
        if (!cancel.cancelled()) {
            finish_times_.Add(FinishKind(spec), work.film->pixel_count(), ToSeconds(Now() - start));
            StoreImage(name, std::move(finished));
        }
        return;
    } catch (const std::bad_alloc&) {
        failure =
            "the server ran out of memory while it filtered the image; choose a smaller --size";
    } catch (const std::exception& error) {
        failure = error.what();
    }
    if (cancel.cancelled()) {
        return;
    }
    control_.Post([this, name, failure] {
        if (records_.count(name) != 0) {
            const LogScope scope({.job = name});
            spdlog::error("{}: {}", name, failure);
            queue_.Fail(name, failure, Now());
            Changed();
        }
    });
}

// On the filter thread.
void Coordinator::StoreImage(const std::string& name, std::shared_ptr<const FinishedImage> image) {
    try {
        results_.Put(JobId(name), image->exr);
    } catch (const Error& error) {
        control_.Post(
            [this, name, image, why = std::string(error.what())] { NotStored(name, image, why); });
        return;
    }
    control_.Post([this, name, image] { Stored(name, image); });
}

// The job has succeeded when the ledger says so: nobody may see what a crash could undo.
void Coordinator::Stored(const std::string& name,
                         const std::shared_ptr<const FinishedImage>& image) {
    const auto record = records_.find(name);
    if (stopping_ || record == records_.end() || jobs::IsOver(queue_.Get(name).state)) {
        return;
    }
    const TimePoint now = Now();
    jobs::JobInfo info = queue_.Get(name);
    info.state = info.stop == jobs::StopReason::kCancelled ? jobs::JobState::kCancelled
                                                           : jobs::JobState::kSucceeded;
    info.outcome = image->outcome;
    info.ended = now;
    info.held.clear();
    info.paused.reset();
    record->second.result_sha256 = image->exr_sha256;
    store::JobRow row = RowOf(info);
    Write(row, false, [this, name, image, now](const std::optional<Error>& why) {
        const auto it = records_.find(name);
        if (it == records_.end()) {
            return;
        }
        if (why) {
            NotStored(name, image, why->what());
            return;
        }
        const LogScope scope({.job = name});
        spdlog::info("{}: filtered in {:.2f} s, image {}", name, image->outcome.seconds,
                     image->outcome.image_sha256);
        it->second.over = true;
        keeper_.Over(name);
        queue_.Succeed(name, image->outcome, now);
        Changed();
    });
}

// It is tried again until there is room.
void Coordinator::NotStored(const std::string& name, std::shared_ptr<const FinishedImage> image,
                            const std::string& why) {
    if (records_.count(name) == 0 || jobs::IsOver(queue_.Get(name).state)) {
        return;
    }
    Hold(name, why);
    unstored_.push_back({name, std::move(image), Now() + FromSeconds(kStoreAgainSeconds)});
}

void Coordinator::Hold(const std::string& name, const std::string& why) {
    if (!queue_.Knows(name) || queue_.Get(name).held == why) {
        return;
    }
    const LogScope scope({.job = name});
    if (!why.empty()) {
        spdlog::error("{}: held, and tried again every few seconds: {}", name, why);
    }
    queue_.Hold(name, why, Now());
    Changed();
}

}  // namespace relume::server
