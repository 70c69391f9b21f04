#include <fmt/format.h>

#include <set>
#include <utility>

#include "core/base/error.h"
#include "core/base/log.h"
#include "server/rpc/coordinator.h"
#include "server/rpc/saved_info.h"

// Books of Coordinator: what is on the disk of jobs, and what comes back from there.
namespace relume::server {
namespace {

constexpr double kUsedNotedSeconds = 1;

}  // namespace

store::JobRow Coordinator::RowOf(const jobs::JobInfo& info) const {
    const Record& record = records_.at(info.name);
    store::JobRow row;
    row.number = info.number;
    row.name = info.name;
    row.request_id = record.request_id;
    row.spec = record.spec.message.SerializeAsString();
    row.info = SaveInfo(info, wall_);
    row.result_sha256 = record.result_sha256;
    row.over = jobs::IsOver(info.state);
    row.used_seconds = ToSeconds(info.Used(Now()));
    return row;
}

void Coordinator::Write(const store::JobRow& row, bool fresh, Done done) {
    if (stopping_) {
        done(Error(ErrorCode::kUnavailable, "the server stops"));
        return;
    }
    books_.Post([this, row, fresh, done = std::move(done)] {
        std::optional<Error> why;
        try {
            if (fresh) {
                ledger_.Add(row);
            } else {
                ledger_.Update(row);
            }
        } catch (const Error& error) {
            why = error;
        }
        control_.Post([done, why] { done(why); });
    });
}

// Those that failed, by whatever cause.
void Coordinator::NoteThoseOver() {
    for (const std::string& name : queue_.TakeOver()) {
        const auto it = records_.find(name);
        if (it == records_.end() || it->second.over) {
            continue;
        }
        it->second.over = true;
        keeper_.Over(name);
        Write(RowOf(queue_.Get(name)), false, [name](const std::optional<Error>& why) {
            if (why) {
                const LogScope scope({.job = name});
                spdlog::error("{}: that it is over is not written down: {}", name, why->what());
            }
        });
    }
}

// Time limits go on where a server that died left off.
void Coordinator::NoteUsedTime(TimePoint now) {
    if (ToSeconds(now - used_noted_) < kUsedNotedSeconds) {
        return;
    }
    used_noted_ = now;
    std::vector<std::pair<std::string, double>> used;
    for (const std::string& name : queue_.Rendering()) {
        if (records_.at(name).spec.budgets.seconds) {
            used.emplace_back(name, ToSeconds(queue_.Get(name).Used(now)));
        }
    }
    if (!used.empty()) {
        books_.Post([this, used = std::move(used)] { ledger_.SetUsed(used); });
    }
}

void Coordinator::Load() {
    std::set<std::string> files;
    for (const store::JobRow& row : ledger_.Jobs()) {
        for (const auto& snapshot : ledger_.Snapshots(row.name)) {
            files.insert(snapshot.file.name);
        }
        LoadJob(row);
    }
    snapshots_.RemoveOthers([&](const std::string& name) { return files.count(name) != 0; });
}

void Coordinator::LoadJob(const store::JobRow& row) {
    const LogScope scope({.job = row.name});
    const TimePoint now = Now();
    std::string problem;
    CheckedSpec spec;
    spec.message.ParseFromString(row.spec);
    jobs::SavedJob saved;
    saved.info.name = row.name;
    saved.info.number = row.number;
    try {
        saved.info = LoadInfo(row.info, row.used_seconds, wall_, now);
        spec = CheckSpec(spec.message, blobs_);
    } catch (const Error& error) {
        problem = error.what();
    }
    Record* record = AddRecord(row.name, row.request_id, std::move(spec));
    record->result_sha256 = row.result_sha256;
    record->over = row.over;
    if (!row.over && !problem.empty()) {
        saved.info.state = jobs::JobState::kFailed;
        saved.info.message = "the server has started again, and can't go on with it: " + problem;
        saved.info.ended = now;
        record->over = true;
        ledger_.Update(RowOf(saved.info));
    }
    const std::uint64_t last_event = std::uint64_t{epoch() - 1} << 32;
    saved.last_event = last_event;
    if (jobs::IsOver(saved.info.state)) {
        queue_.RestoreJob(std::move(saved), {}, now);
        return;
    }
    saved.cancelled = saved.info.stop == jobs::StopReason::kCancelled;
    if (auto film = keeper_.Load(row.name, row.used_seconds, now)) {
        film->last_event = last_event;
        film->cancelled = saved.cancelled;
        film->info.paused = saved.info.paused;
        if (film->info.samples_budget != record->spec.budgets.samples) {
            film->checkpoint->stop.reset();  // it was extended since
        }
        try {
            queue_.RestoreJob(std::move(*film), SetupOf(record->spec, record->cancel), now);
            const jobs::JobInfo& info = queue_.Get(row.name);
            spdlog::info("{}: goes on with {} samples in {} passes", row.name, info.samples_done,
                         info.passes.size());
            return;
        } catch (const Error& error) {
            spdlog::warn("{}: {}", row.name, error.what());
        }
    }
    spdlog::info("{}: {}", row.name, saved.cancelled ? "has no film" : "begins anew");
    queue_.RestoreJob(std::move(saved), SetupOf(record->spec, record->cancel), now);
}

void Coordinator::ExtendJob(const std::string& name, double spp, Done done) {
    const jobs::JobInfo& info = queue_.Get(name);
    if (!info.outcome) {
        throw Error(ErrorCode::kFailedPrecondition,
                    fmt::format("{} has no image; only a job that has can be extended", name));
    }
    v1::JobSpec message = records_.at(name).spec.message;
    const auto pixels = static_cast<double>(records_.at(name).spec.settings.Window().area());
    const double has = static_cast<double>(info.samples_done) / pixels;
    if (!(spp > has)) {
        ThrowInvalidArgument(fmt::format(
            "{} has {:.6g} samples a pixel already; ask for more than that", name, has));
    }
    CheckQuotas(records_.at(name).caller, records_.at(name).bytes);
    message.set_spp(spp);
    message.clear_target();
    message.clear_time_limit();
    io_.Post([this, name, message, done = std::move(done)] {
        const auto spec = std::make_shared<CheckedSpec>();
        auto film = std::make_shared<std::optional<jobs::SavedJob>>();
        std::optional<Error> why;
        try {
            *spec = CheckSpec(message, blobs_);
            *film = keeper_.Load(name, 0, Now());
            if (!*film) {
                why = Error(ErrorCode::kFailedPrecondition,
                            fmt::format("the film of {} is not kept any more; submit its scene "
                                        "again with a larger --spp",
                                        name));
            }
        } catch (const Error& error) {
            why = error;
        }
        control_.Post([this, name, spec, film, why, done] {
            if (why) {
                done(why);
                return;
            }
            try {
                Extend(name, std::move(*spec), std::move(**film), done);
            } catch (const Error& error) {
                done(error);
            }
        });
    });
}

void Coordinator::Extend(const std::string& name, CheckedSpec spec, jobs::SavedJob film,
                         const Done& done) {
    const auto cancel = std::make_shared<CancelToken>();
    film.checkpoint->info = std::move(film.info);
    queue_.Extend(name, std::move(*film.checkpoint), std::move(film.film), SetupOf(spec, cancel),
                  Now());
    Record& record = records_.at(name);
    record.spec = std::move(spec);
    record.brief = record.spec.message;
    record.brief.mutable_scene()->clear_entries();
    record.cancel = cancel;
    record.over = false;
    const LogScope scope({.job = name});
    spdlog::info("{}: extended to {:.6g} samples a pixel", name, record.spec.message.spp());
    Write(RowOf(queue_.Get(name)), false, done);
    Changed();
}

void Coordinator::Acknowledge(jobs::WorkerId worker, const std::string& ticket) {
    if (!ticket.empty() && queue_.KnowsWorker(worker)) {
        acknowledged_[worker].push_back(ticket);
    }
}

std::vector<std::string> Coordinator::TakeAcknowledged(jobs::WorkerId worker) {
    const auto taken = acknowledged_.extract(worker);
    return taken.empty() ? std::vector<std::string>() : std::move(taken.mapped());
}

}  // namespace relume::server
