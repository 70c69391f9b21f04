#include "server/rpc/coordinator.h"

#include <fmt/format.h>

#include <chrono>
#include <future>
#include <random>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/log.h"
#include "core/base/sha256.h"
#include "server/rpc/finish_image.h"

namespace relume::server {
namespace {

constexpr double kTickSeconds = 0.1;
constexpr std::size_t kOverJobsKept = 1000;  // with their results
// Of those seen from outside one by one.
constexpr std::size_t kMaxJobsShown = 100, kMaxWorkersShown = 200;
constexpr std::chrono::seconds kStatusPatience{5};
constexpr const char* kJobPrefix = "jobs/";

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

std::string RandomName() {
    std::random_device random;
    return fmt::format("{}{:08x}{:08x}", kJobPrefix, random(), random());
}

}  // namespace

std::string JobId(const std::string& name) { return name.substr(std::string(kJobPrefix).size()); }

Coordinator::Coordinator(const CoordinatorOptions& options)
    : epoch_(static_cast<std::uint32_t>(std::chrono::duration_cast<std::chrono::seconds>(
                                            std::chrono::system_clock::now().time_since_epoch())
                                            .count())),
      folder_(options.data),
      blobs_(options.data / "blobs", options.blob_quota),
      results_(options.data / "results") {
    control_.Every(FromSeconds(kTickSeconds), [this] {
        queue_.Tick(Now());
        // Also those who have nothing to wait for: a lease may have become worth a race.
        ForEach(worker_streams_, &Listener::Advance);
        Changed();
    });
}

Coordinator::~Coordinator() {
    std::promise<void> done;
    control_.Post([&] {
        stopping_ = true;
        for (const auto& [name, record] : records_) {
            record.cancel->Cancel();
        }
        done.set_value();
    });
    done.get_future().wait();
}

std::string Coordinator::CreateJob(const std::string& request_id, CheckedSpec spec) {
    if (const auto it = request_ids_.find(request_id); it != request_ids_.end()) {
        return it->second;
    }
    for (const auto& forgotten : queue_.ForgetOverJobs(kOverJobsKept)) {
        request_ids_.erase(records_.at(forgotten).request_id);
        records_.erase(forgotten);
        io_.Post([this, forgotten] { results_.Remove(JobId(forgotten)); });
    }
    std::string name = RandomName();
    while (records_.count(name) != 0) {
        name = RandomName();
    }
    jobs::JobSetup setup = spec.Setup();
    const auto cancel = std::make_shared<CancelToken>();
    if (spec.budgets.seconds) {
        setup.estimators.finish_seconds = [this, spec, cancel](const Film& film) {
            return PredictFinish(film, spec, *cancel);
        };
    }
    queue_.AddJob(name, std::move(setup), Now());
    const LogScope scope({.job = name});
    spdlog::info("{}: {} at {}x{}, {}, sampler {}, filter {}", name, spec.manifest.main,
                 spec.settings.Window().width(), spec.settings.Window().height(),
                 jobs::Describe(spec.budgets), spec.sampler, spec.filter);
    Record& record = records_[name];
    record.scene_sha256 = ManifestDigest(spec.manifest);
    record.cancel = cancel;
    record.spec = std::move(spec);
    record.brief = record.spec.message;
    record.brief.mutable_scene()->clear_entries();
    if (!request_id.empty()) {
        record.request_id = request_id;
        request_ids_[request_id] = name;
    }
    return name;
}

void Coordinator::CancelJob(const std::string& name) {
    queue_.Cancel(name, Now());
    records_.at(name).cancel->Cancel();
    const LogScope scope({.job = name});
    spdlog::info("{}: cancelled", name);
}

void Coordinator::FillJob(const jobs::JobInfo& info, bool with_entries, v1::Job* job) const {
    const Record& record = records_.at(info.name);
    InfoToProto(info, wall_, job);
    *job->mutable_spec() = with_entries ? record.spec.message : record.brief;
    job->set_scene_sha256(record.scene_sha256);
}

Coordinator::ResultFile Coordinator::ResultOf(const std::string& name) const {
    const jobs::JobInfo& info = queue_.Get(name);
    if (info.state != jobs::JobState::kSucceeded) {
        const bool over = jobs::IsOver(info.state);
        throw Error(ErrorCode::kFailedPrecondition,
                    over ? fmt::format("{} has no result: {}", name, info.message)
                         : fmt::format("{} is not ready yet; watch it and fetch it then", name));
    }
    return {JobId(name), info.outcome->result_size, records_.at(name).result_sha256};
}

std::optional<metrics::FarmStatus> Coordinator::AskStatus() {
    const auto answer = std::make_shared<std::promise<metrics::FarmStatus>>();
    auto status = answer->get_future();
    control_.Post([this, answer] { answer->set_value(Status()); });
    if (status.wait_for(kStatusPatience) != std::future_status::ready) {
        return std::nullopt;
    }
    return status.get();
}

metrics::FarmStatus Coordinator::Status() const {
    metrics::FarmStatus status;
    status.queue = queue_.Status(Now(), kMaxJobsShown, kMaxWorkersShown);
    for (const auto& job : status.queue.under_way) {
        const CheckedSpec& spec = records_.at(job.name).spec;
        status.job_texts.push_back({spec.message.display_name(), spec.sampler, spec.filter});
    }
    status.blobs_in = traffic_.blobs_in;
    status.blobs_out = traffic_.blobs_out;
    status.results_out = traffic_.results_out;
    status.work_in = traffic_.work_in;
    status.work_out = traffic_.work_out;
    status.blob_bytes = blobs_.used();
    status.blob_quota = blobs_.quota();
    status.tasks_waiting = {{"control", control_.waiting()},
                            {"io", io_.waiting()},
                            {"plan", plan_.waiting()},
                            {"filter", filter_.waiting()}};
    return status;
}

void Coordinator::Remove(Listener* listener) {
    worker_streams_.erase(listener);
    watchers_.erase(listener);
}

// A call may end its listener's stream, and others' in turn: those are gone then.
void Coordinator::ForEach(const std::set<Listener*>& listeners, void (Listener::*call)()) {
    for (Listener* listener : std::vector<Listener*>(listeners.begin(), listeners.end())) {
        if (listeners.count(listener) != 0) {
            (listener->*call)();
        }
    }
}

void Coordinator::Changed() {
    StartPlans();
    StartFilters();
    while (queue_.TakeNews()) {
        ForEach(worker_streams_, &Listener::Advance);
        StartPlans();
        StartFilters();
    }
    ForEach(watchers_, &Listener::Advance);
}

void Coordinator::StopStreams() {
    stopping_ = true;
    ForEach(worker_streams_, &Listener::Stop);
    ForEach(watchers_, &Listener::Stop);
}

void Coordinator::StartPlans() {
    while (!stopping_) {
        auto taken = queue_.TakePlanWork(Now());
        if (!taken) {
            return;
        }
        const auto cancel = records_.at(taken->name).cancel;
        plan_.Post([this, cancel, work = std::move(*taken)] {
            if (cancel->cancelled()) {
                return;
            }
            const auto result = std::make_shared<jobs::PlanResult>(jobs::RunPlan(work));
            control_.Post([this, name = work.name, result] {
                if (!result->failure.empty()) {
                    const LogScope scope({.job = name});
                    spdlog::error("{}: {}", name, result->failure);
                }
                queue_.Planned(name, std::move(*result), Now());
                Changed();
            });
        });
    }
}

void Coordinator::StartFilters() {
    while (!stopping_) {
        auto work = queue_.TakeFilterWork();
        if (!work) {
            return;
        }
        const Record& record = records_.at(work->name);
        const auto& info = queue_.Get(work->name);
        const LogScope scope({.job = work->name});
        spdlog::info("{}: {} samples in {} passes after {:.2f} s ({})", work->name,
                     info.samples_done, info.passes.size(), info.render_seconds, info.message);
        filter_.Post(
            [this, work = std::move(*work), spec = record.spec, cancel = record.cancel,
             numeric_class = info.numeric_class] { Filter(work, spec, numeric_class, *cancel); });
    }
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
        FinishedImage finished = FinishImage(work, spec, numeric_class, cancel);
        std::string sha256 = Sha256Hex(finished.exr);
        if (!cancel.cancelled()) {
            results_.Put(JobId(name), finished.exr);
            finish_times_.Add(FinishKind(spec), work.film->pixel_count(), ToSeconds(Now() - start));
            control_.Post(
                [this, name, outcome = std::move(finished.outcome), sha256 = std::move(sha256)] {
                    if (const auto record = records_.find(name); record != records_.end()) {
                        record->second.result_sha256 = sha256;
                        const LogScope scope({.job = name});
                        spdlog::info("{}: filtered in {:.2f} s, image {}", name, outcome.seconds,
                                     outcome.image_sha256);
                        queue_.Succeed(name, outcome, Now());
                        Changed();
                    }
                });
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

}  // namespace relume::server
