#include "server/rpc/coordinator.h"

#include <fmt/format.h>

#include <chrono>
#include <future>
#include <random>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/log.h"
#include "core/base/resources.h"
#include "core/base/sha256.h"
#include "proto/codec/digests.h"
#include "server/rpc/finish_image.h"

namespace relume::server {
namespace {

constexpr double kTickSeconds = 0.1;
// Of those seen from outside one by one.
constexpr std::size_t kMaxJobsShown = 100, kMaxWorkersShown = 200;
constexpr std::chrono::seconds kStatusPatience{5};
constexpr const char* kJobPrefix = "jobs/";

std::string RandomName() {
    std::random_device random;
    return fmt::format("{}{:08x}{:08x}", kJobPrefix, random(), random());
}

}  // namespace

std::string JobId(const std::string& name) { return name.substr(std::string(kJobPrefix).size()); }

Coordinator::Coordinator(const CoordinatorOptions& options)
    : quotas_(options.quotas),
      folder_(options.data),
      disk_(options.disk),
      ledger_(options.data / "state.db"),
      snapshots_(options.data / "films", disk_),
      blobs_(options.data / "blobs", options.blob_quota),
      results_(options.data / "results", disk_),
      keeper_(options.films,
              {[this](const std::string& job, const std::string& why) { Hold(job, why); },
               [this](jobs::WorkerId worker, const std::string& ticket) {
                   Acknowledge(worker, ticket);
               }},
              &queue_, &ledger_, &snapshots_, &wall_, &control_, &films_) {
    std::random_device random;
    queue_.SetCrossCheck(options.cross_check, (std::uint64_t{random()} << 32) | random());
    queue_.SetSilence(options.silent_seconds);
    queue_.SetFilmMemory(quotas_.film_memory > 0 ? quotas_.film_memory
                                                 : AvailableResources().memory / 2);
    Load();
    control_.Every(FromSeconds(kTickSeconds), [this] { Tick(); });
}

Coordinator::~Coordinator() {
    std::promise<void> done;
    control_.Post([&] {
        stopping_ = true;
        keeper_.Stop();
        for (const auto& [name, record] : records_) {
            record.cancel->Cancel();
        }
        done.set_value();
    });
    done.get_future().wait();
}

void Coordinator::Tick() {
    const TimePoint now = Now();
    // A busy server has not come to what they said: they are not silent for that.
    ForEach(worker_streams_, &Listener::NoteReceived);
    queue_.Tick(now);
    // Also those who have nothing to wait for: a lease may have become worth a race.
    ForEach(worker_streams_, &Listener::Advance);
    Changed();
    keeper_.Tick(now);
    if (stopping_) {
        return;
    }
    NoteThoseOver();
    NoteUsedTime(now);
    std::erase_if(unstored_, [&](const Unstored& image) {
        if (image.due > now) {
            return false;
        }
        filter_.Post([this, image] { StoreImage(image.name, image.image); });
        return true;
    });
}

jobs::JobSetup Coordinator::SetupOf(const CheckedSpec& spec,
                                    const std::shared_ptr<CancelToken>& cancel) {
    jobs::JobSetup setup = spec.Setup();
    if (spec.budgets.seconds) {
        setup.estimators.finish_seconds = [this, spec, cancel](const Film& film) {
            return PredictFinish(film, spec, *cancel);
        };
    }
    return setup;
}

Coordinator::Record* Coordinator::AddRecord(const std::string& name, const std::string& request_id,
                                            CheckedSpec spec) {
    Record& record = records_[name];
    record.scene_sha256 = ManifestDigest(spec.manifest);
    record.context_digest = codec::ContextDigest(name, spec.manifest, spec.settings);
    record.cancel = std::make_shared<CancelToken>();
    record.caller = spec.caller;
    record.bytes = spec.message.ByteSizeLong();
    record.spec = std::move(spec);
    record.brief = record.spec.message;
    record.brief.mutable_scene()->clear_entries();
    if (!request_id.empty()) {
        record.request_id = request_id;
        request_ids_[request_id] = name;
    }
    return &record;
}

std::string Coordinator::CreateJob(const std::string& request_id, CheckedSpec spec, Done done) {
    if (const auto it = request_ids_.find(request_id); it != request_ids_.end()) {
        control_.Post([done = std::move(done)] { done({}); });
        return it->second;
    }
    CheckQuotas(spec.caller, spec.message.ByteSizeLong());
    ForgetOldJobs();
    std::string name = RandomName();
    while (records_.count(name) != 0) {
        name = RandomName();
    }
    const LogScope scope({.job = name});
    spdlog::info("{}: {} at {}x{}, {}, sampler {}, filter {}", name, spec.manifest.main,
                 spec.settings.Window().width(), spec.settings.Window().height(),
                 jobs::Describe(spec.budgets), spec.sampler, spec.filter);
    const Record* record = AddRecord(name, request_id, std::move(spec));
    queue_.AddJob(name, SetupOf(record->spec, record->cancel), Now());
    Write(RowOf(queue_.Get(name)), true,
          [this, name, done = std::move(done)](const std::optional<Error>& why) {
              if (why && records_.count(name) != 0) {
                  queue_.Fail(name, why->what(), Now());
                  request_ids_.erase(records_.at(name).request_id);
              }
              done(why);
          });
    return name;
}

void Coordinator::Forget(const std::string& name) {
    request_ids_.erase(records_.at(name).request_id);
    records_.erase(name);
    keeper_.Over(name);
    if (stopping_) {
        return;
    }
    books_.Post([this, name] {
        for (const auto& file : ledger_.Remove(name)) {
            snapshots_.Remove(file);
        }
        results_.Remove(JobId(name));
    });
}

void Coordinator::FillJob(const jobs::JobInfo& info, bool with_entries, v1::Job* job) const {
    const Record& record = records_.at(info.name);
    InfoToProto(info, wall_, job);
    *job->mutable_spec() = with_entries ? record.spec.message : record.brief;
    job->set_scene_sha256(record.scene_sha256);
    if (const auto share = queue_.ShareOf(info.name, Now())) {
        job->set_share(*share);
    }
}

std::uint64_t Coordinator::TaskDigest(const std::string& name, std::uint64_t unit,
                                      const TileTask& task) const {
    return codec::TaskDigest(records_.at(name).context_digest, unit, task);
}

Coordinator::ResultFile Coordinator::ResultOf(const std::string& name) const {
    const jobs::JobInfo& info = queue_.Get(name);
    if (!info.outcome) {
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
        status.job_texts.push_back({spec.message.display_name(), spec.sampler, spec.filter,
                                    spec.message.owner(), spec.message.priority()});
    }
    status.blobs_in = traffic_.blobs_in;
    status.blobs_out = traffic_.blobs_out;
    status.results_out = traffic_.results_out;
    status.work_in = traffic_.work_in;
    status.work_out = traffic_.work_out;
    status.blob_bytes = blobs_.used();
    status.blob_quota = blobs_.quota();
    status.tasks_waiting = {{"control", control_.waiting()}, {"io", io_.waiting()},
                            {"plan", plan_.waiting()},       {"filter", filter_.waiting()},
                            {"books", books_.waiting()},     {"films", films_.waiting()}};
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

void Coordinator::SaveFilms(const std::function<void()>& done) {
    // Those whose last samples came in meanwhile; filters begin with the next server.
    while (const auto work = queue_.TakeFilterWork()) {
        keeper_.Final(*work);
    }
    keeper_.SaveAll(done);
}

void Coordinator::StartPlans() {
    if (!stopping_ && !planning_) {
        auto taken = queue_.TakePlanWork(Now());
        if (!taken) {
            return;
        }
        planning_ = true;
        const auto cancel = records_.at(taken->name).cancel;
        plan_.Post([this, cancel, work = std::move(*taken)] {
            std::shared_ptr<jobs::PlanResult> result;
            if (!cancel->cancelled()) {
                result = std::make_shared<jobs::PlanResult>(jobs::RunPlan(work));
            }
            control_.Post([this, name = work.name, result] {
                planning_ = false;
                if (result && !result->failure.empty()) {
                    const LogScope scope({.job = name});
                    spdlog::error("{}: {}", name, result->failure);
                }
                if (result) {
                    queue_.Planned(name, std::move(*result), Now());
                }
                Changed();
            });
        });
    }
}

}  // namespace relume::server
